//! NUMERICS §2: springs with dampers, and those that buckle.

use cloth_core::{BUCKLING_COEFFICIENTS, Model, Spring, SpringKind};

use super::{LENGTH_MIN, Particles, ZERO};
use crate::tracked::{Tracked, TrackedVector};

/// Rigidity in units of k L^3 above which k (l - L) is the larger force at all lengths.
const RIGIDITY_LIMIT: f64 = 0.0319;

/// The force of a spring on the first of its particles; the other one feels the opposite. `epsilon`
/// is that of the backend.
#[must_use]
pub fn spring_force_on(
    model: &Model,
    particles: &Particles,
    spring: &Spring,
    epsilon: f64,
) -> TrackedVector {
    let kind = model.springs().kinds()[spring.kind as usize];
    let [i, j] = spring.particles.map(|particle| particle as usize);
    let difference = particles.positions[j] - particles.positions[i];
    let length = difference.length();
    let normal = difference.divided(length.max(LENGTH_MIN));
    let approach = (particles.velocities[j] - particles.velocities[i]).dot(normal);
    normal
        .scaled(spring_tension(&kind, length, epsilon) + Tracked::rounded(kind.damping) * approach)
}

/// Adds the force of every spring to both its particles.
pub fn spring_forces(
    model: &Model,
    particles: &Particles,
    forces: &mut [TrackedVector],
    epsilon: f64,
) {
    for spring in model.springs().iter() {
        let force = spring_force_on(model, particles, &spring, epsilon);
        forces[spring.particles[0] as usize] += force;
        forces[spring.particles[1] as usize] -= force;
    }
}

/// Elastic tension at a length; `epsilon` is that of the backend.
#[must_use]
pub fn spring_tension(kind: &SpringKind, length: Tracked, epsilon: f64) -> Tracked {
    match branches(kind, length, epsilon) {
        (ramp, None) => ramp,
        // Either can turn out to be the larger one, and then the error of either counts.
        (ramp, Some(buckled)) if ramp.is_close(buckled, epsilon) => ramp.max(buckled),
        (ramp, Some(buckled)) if buckled.value > ramp.value => buckled,
        (ramp, Some(_)) => ramp,
    }
}

/// Derivative of the elastic tension by the length, and whether rounding decides on which branch it
/// is; `epsilon` is that of the backend.
#[must_use]
pub fn spring_tension_derivative(
    kind: &SpringKind,
    length: Tracked,
    epsilon: f64,
) -> (Tracked, bool) {
    let stiffness = Tracked::rounded(kind.stiffness);
    let (ramp, Some(buckled)) = branches(kind, length, epsilon) else {
        return (stiffness, false);
    };
    let uncertain = ramp.is_close(buckled, epsilon);
    if buckled.value <= ramp.value {
        return (stiffness, uncertain);
    }
    let c = BUCKLING_COEFFICIENTS;
    let derivative = [c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 5.0 * c[5], 0.0];
    let slope = -polynomial(derivative, compression(kind, length, epsilon));
    (force_scale(kind) * Tracked::rounded(kind.rest_length.recip()) * slope, uncertain)
}

/// Twice the elastic energy at a length; `epsilon` is that of the backend.
#[must_use]
pub fn spring_energy_doubled(kind: &SpringKind, length: Tracked, epsilon: f64) -> Tracked {
    let two = Tracked::exact(2.0);
    let stiff = |length: Tracked| {
        let stretch = length - Tracked::rounded(kind.rest_length);
        Tracked::rounded(kind.stiffness) * stretch * stretch
    };
    let ramp = stiff(length);
    let ((force, Some(buckled_force)), Some([onset, end])) =
        (branches(kind, length, epsilon), buckled_range(kind))
    else {
        return ramp;
    };
    let mean = std::array::from_fn(|k| BUCKLING_COEFFICIENTS[k] / (k + 1) as f64);
    let work = |length: Tracked| {
        let stretch = length - Tracked::rounded(kind.rest_length);
        two * force_scale(kind) * stretch * polynomial(mean, compression(kind, length, epsilon))
    };
    // The integral goes on along the other branch wherever the larger one changes.
    let at = |part: &dyn Fn(Tracked) -> Tracked, u: f64| {
        part(Tracked::exact((1.0 - u) * kind.rest_length)).value
    };
    let buckled_offset = at(&stiff, onset) - at(&work, onset);
    let stiff_offset = at(&work, end) + buckled_offset - at(&stiff, end);
    let buckled = work(length) + Tracked::rounded(buckled_offset);
    let is_beyond = compression(kind, length, epsilon).value > 0.5 * (onset + end);
    let ramp = if is_beyond { ramp + Tracked::rounded(stiff_offset) } else { ramp };
    let mut energy = if buckled_force.value > force.value { buckled } else { ramp };
    if force.is_close(buckled_force, epsilon) {
        energy.error = ramp.error.max(buckled.error) + (ramp.value - buckled.value).abs() / epsilon;
    }
    energy
}

/// B / L^2 of a spring that has a rigidity.
fn force_scale(kind: &SpringKind) -> Tracked {
    Tracked::rounded(kind.rigidity.unwrap_or_default() / kind.rest_length.powi(2))
}

fn compression(kind: &SpringKind, length: Tracked, epsilon: f64) -> Tracked {
    let rest_length = Tracked::rounded(kind.rest_length);
    let compression = (rest_length - length) / rest_length;
    let is_stretched = compression.value < 0.0 && !compression.is_close(ZERO, epsilon);
    if is_stretched { ZERO } else { compression.max(ZERO) }
}

/// c0 + c1 u + ... + c5 u^5. The error of u is passed on by the derivative: by the terms one by one
/// it would be many times as large, as their signs differ.
fn polynomial(coefficients: [f64; 6], u: Tracked) -> Tracked {
    let at_value = Tracked::exact(u.value);
    let terms = coefficients.map(Tracked::rounded).into_iter();
    let mut sum = terms.rev().reduce(|sum, term| term + at_value * sum).unwrap_or(ZERO);
    let slope = (1..6).rev().fold(0.0, |sum, k| k as f64 * coefficients[k] + u.value * sum);
    sum.error += slope.abs() * u.error;
    sum
}

/// k (l - L), and the force of the bent strut for a spring whose rigidity is not beyond the limit.
fn branches(kind: &SpringKind, length: Tracked, epsilon: f64) -> (Tracked, Option<Tracked>) {
    let ramp = Tracked::rounded(kind.stiffness) * (length - Tracked::rounded(kind.rest_length));
    let limit = RIGIDITY_LIMIT * kind.stiffness * kind.rest_length.powi(3);
    let buckled = kind.rigidity.filter(|&rigidity| rigidity <= limit).map(|_| {
        force_scale(kind) * polynomial(BUCKLING_COEFFICIENTS, compression(kind, length, epsilon))
    });
    (ramp, buckled)
}

/// The compressions between which the force of the bent strut is the larger one, if there are any.
fn buckled_range(kind: &SpringKind) -> Option<[f64; 2]> {
    let [scale, ramp] = [force_scale(kind).value, kind.stiffness * kind.rest_length];
    let excess =
        |u: f64| ramp * u + scale * polynomial(BUCKLING_COEFFICIENTS, Tracked::exact(u)).value;
    // Its only maximum, wherever it is positive, by ternary search.
    let [mut low, mut high] = [0.0_f64, 1.0];
    for _ in 0..200 {
        let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if excess(a) < excess(b) { low = a } else { high = b }
    }
    let top = if excess(1.0) >= excess(high) { 1.0 } else { high };
    let zero = |mut inside: f64, mut outside: f64| {
        for _ in 0..100 {
            let middle = 0.5 * (inside + outside);
            if excess(middle) > 0.0 { inside = middle } else { outside = middle }
        }
        inside
    };
    (kind.rigidity.is_some() && excess(top) > 0.0)
        .then(|| [zero(top, 0.0), if excess(1.0) > 0.0 { 1.0 } else { zero(top, 1.0) }])
}
