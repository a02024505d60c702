//! NUMERICS §4, `strain_limit`: springs that are too long.

use cloth_core::Model;

use crate::{Number, Particles, particles::length_min};

/// Shortens the springs of one colour, each two particles and a kind, that are longer than `ratio` L.
pub fn strain_limit<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    springs: &[[u32; 3]],
    ratio: f64,
    length: f64,
) {
    let [ratio, h] = [ratio, length].map(N::rounded);
    for &[i, j, kind] in springs {
        let [i, j] = [i, j].map(|particle| particle as usize);
        let rest_length = N::rounded(model.springs().kinds()[kind as usize].rest_length);
        let difference = particles.positions[j] - particles.positions[i];
        let length = difference.length();
        let excess = length - ratio * rest_length;
        let [w_i, w_j] = [particles.inverse_masses[i], particles.inverse_masses[j]];
        // Where rounding decides, what is done is as small as rounding.
        let is_short = excess.value() <= 0.0 && !excess.is_close(N::ZERO, particles.epsilon);
        if is_short || w_i.value() + w_j.value() == 0.0 {
            continue;
        }
        let normal = difference.divided(length.max(length_min()));
        let step = normal.scaled(excess.max(N::ZERO) / (w_i + w_j));
        particles.positions[i] += step.scaled(w_i);
        particles.velocities[i] += step.scaled(w_i).divided(h);
        particles.positions[j] -= step.scaled(w_j);
        particles.velocities[j] -= step.scaled(w_j).divided(h);
    }
}
