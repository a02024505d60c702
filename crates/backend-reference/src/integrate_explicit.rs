//! NUMERICS §4, `integrate_explicit`: symplectic Euler.

use crate::{Number, Particles, Vector};

/// v += h w f, then x += h v.
pub fn integrate_explicit<N: Number>(
    particles: &mut Particles<N>,
    forces: &[Vector<N>],
    length: f64,
) {
    let h = N::rounded(length);
    for (i, force) in forces.iter().enumerate() {
        let inverse_mass = particles.inverse_masses[i];
        particles.velocities[i] += force.scaled(inverse_mass).scaled(h);
        let velocity = particles.velocities[i];
        particles.positions[i] += velocity.scaled(h);
    }
}
