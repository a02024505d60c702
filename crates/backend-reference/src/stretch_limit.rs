//! NUMERICS §4, `stretch_limit`: triangles of fabric that are stretched too far.

use cloth_core::{FabricTriangle, Model, fabric::stretch_limit::LEAST_SHARE};

use crate::{Number, Particles, Vector};

/// Difference of the squares of the principal stretches, in units of their mean, below which rounding turns the principal
/// directions.
const ALIKE: f64 = 1e-3;

/// Shortens the triangles of one colour, by their numbers, that are stretched to more than `ratio`.
pub fn stretch_limit<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    triangles: &[u32],
    ratio: f64,
    length: f64,
) {
    let [ratio, h] = [ratio, length].map(N::rounded);
    for &number in triangles {
        let triangle = &model.elements().triangles()[number as usize];
        for (particle, shift) in shifts(triangle, particles, ratio) {
            particles.positions[particle] += shift;
            particles.velocities[particle] += shift.divided(h);
        }
    }
}

/// How far each corner moves.
fn shifts<N: Number>(
    triangle: &FabricTriangle,
    particles: &mut Particles<N>,
    ratio: N,
) -> Vec<(usize, Vector<N>)> {
    let own = triangle.particles.map(|particle| particle as usize);
    let [p, q] = triangle.rest.inverse.map(|row| row.map(N::rounded));
    let gradients = [[-(p[0] + q[0]), -(p[1] + q[1])], p, q];
    let [x0, x1, x2] = own.map(|particle| particles.positions[particle]);
    let f = |k: usize| (x1 - x0).scaled(p[k]) + (x2 - x0).scaled(q[k]);
    let [f_u, f_v] = [f(0), f(1)];
    let [c11, c22, c12] = [f_u.dot(f_u), f_v.dot(f_v), f_u.dot(f_v)];
    let half = N::exact(0.5);
    let [mean, apart] = [half * (c11 + c22), half * (c11 - c22)];
    let radius = (apart * apart + c12 * c12).sqrt();
    let limit = ratio * ratio;
    let largest = mean + radius;
    if largest.value() <= limit.value() && !largest.is_close(limit, particles.epsilon) {
        return Vec::new();
    }
    if radius.value() < ALIKE * mean.value() {
        own.iter().for_each(|&particle| particles.uncertain[particle] = true);
    }
    let [x, y] = if apart.value() >= 0.0 { [radius + apart, c12] } else { [c12, radius - apart] };
    let norm = N::length([x, y, N::ZERO]);
    let [x, y] = if norm.value() > 0.0 { [x / norm, y / norm] } else { [N::ONE, N::ZERO] };
    let weights = own.map(|particle| particles.inverse_masses[particle]);
    let heaviest = weights[0].max(weights[1]).max(weights[2]);
    let mut shifts = own.map(|particle| (particle, Vector::ZERO));
    for ([du, dv], square) in [([x, y], largest), ([-y, x], mean - radius)] {
        // Where rounding decides, what is done is as small as rounding.
        if square.value() <= limit.value() && !square.is_close(limit, particles.epsilon) {
            continue;
        }
        let stretch = square.sqrt();
        let along = f_u.scaled(du) + f_v.scaled(dv);
        let slopes = gradients.map(|[u, v]| u * du + v * dv);
        let squares = slopes.map(|slope| slope * slope);
        let sum = squares[0] + squares[1] + squares[2];
        let total = weights[0] * squares[0] + weights[1] * squares[1] + weights[2] * squares[2];
        let total = total.max(N::rounded(LEAST_SHARE) * (heaviest * sum));
        if total.value() <= 0.0 {
            continue;
        }
        let scale = (stretch - ratio).max(N::ZERO) / total / stretch;
        for ((_, shift), (weight, slope)) in shifts.iter_mut().zip(weights.into_iter().zip(slopes))
        {
            *shift -= along.scaled(weight * (scale * slope));
        }
    }
    shifts.into()
}
