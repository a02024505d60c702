//! NUMERICS §2, immediate buckling: the tension of a spring, its derivative and its energy. `epsilon` is that of the backend in
//! question.

use cloth_core::{BUCKLING_COEFFICIENTS, SpringKind};

use crate::Number;

/// Rigidity in units of k L^3 above which k (l - L) is the larger force at all lengths.
const RIGIDITY_LIMIT: f64 = 0.0319;

/// Elastic tension at a length.
#[must_use]
pub fn spring_tension<N: Number>(kind: &SpringKind, length: N, epsilon: f64) -> N {
    match branches(kind, length, epsilon) {
        (ramp, None) => ramp,
        // Either can turn out to be the larger one, and then the error of either counts.
        (ramp, Some(buckled)) if ramp.is_close(buckled, epsilon) => ramp.max(buckled),
        (ramp, Some(buckled)) if buckled.value() > ramp.value() => buckled,
        (ramp, Some(_)) => ramp,
    }
}

/// Derivative of the elastic tension by the length, and whether rounding decides on which branch it
/// is.
#[must_use]
pub fn spring_tension_derivative<N: Number>(
    kind: &SpringKind,
    length: N,
    epsilon: f64,
) -> (N, bool) {
    let stiffness = N::rounded(kind.stiffness);
    let (ramp, Some(buckled)) = branches(kind, length, epsilon) else {
        return (stiffness, false);
    };
    let uncertain = ramp.is_close(buckled, epsilon);
    if buckled.value() <= ramp.value() {
        return (stiffness, uncertain);
    }
    let c = BUCKLING_COEFFICIENTS;
    let derivative = [c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 5.0 * c[5], 0.0];
    let slope = -polynomial(derivative, compression(kind, length, epsilon));
    (force_scale::<N>(kind) * N::rounded(kind.rest_length.recip()) * slope, uncertain)
}

/// Twice the elastic energy at a length.
#[must_use]
pub fn spring_energy_doubled<N: Number>(kind: &SpringKind, length: N, epsilon: f64) -> N {
    let two = N::exact(2.0);
    let stiff = |length: N| {
        let stretch = length - N::rounded(kind.rest_length);
        N::rounded(kind.stiffness) * stretch * stretch
    };
    let (ramp, rest_length) = (stiff(length), N::rounded(kind.rest_length));
    let is_stretched = length.value() > kind.rest_length && !length.is_close(rest_length, epsilon);
    if is_stretched {
        return ramp;
    }
    let ((force, Some(buckled_force)), Some([onset, end])) =
        (branches(kind, length, epsilon), buckled_range(kind))
    else {
        return ramp;
    };
    let mean = std::array::from_fn(|k| BUCKLING_COEFFICIENTS[k] / (k + 1) as f64);
    let work = |length: N| {
        let stretch = length - N::rounded(kind.rest_length);
        two * force_scale::<N>(kind)
            * stretch
            * polynomial(mean, compression(kind, length, epsilon))
    };
    // The integral goes on along the other branch wherever the larger one changes.
    let at = |part: &dyn Fn(N) -> N, u: f64| part(N::exact((1.0 - u) * kind.rest_length)).value();
    let buckled_offset = at(&stiff, onset) - at(&work, onset);
    let stiff_offset = at(&work, end) + buckled_offset - at(&stiff, end);
    let buckled = work(length) + N::rounded(buckled_offset);
    let is_beyond = compression(kind, length, epsilon).value() > 0.5 * (onset + end);
    let ramp = if is_beyond { ramp + N::rounded(stiff_offset) } else { ramp };
    let is_buckled = buckled_force.value() > force.value();
    let (energy, other) = if is_buckled { (buckled, ramp) } else { (ramp, buckled) };
    if force.is_close(buckled_force, epsilon) {
        return energy.or_by_rounding(other, epsilon);
    }
    energy
}

/// B / L^2 of a spring that has a rigidity.
fn force_scale<N: Number>(kind: &SpringKind) -> N {
    N::rounded(kind.rigidity.unwrap_or_default() / kind.rest_length.powi(2))
}

fn compression<N: Number>(kind: &SpringKind, length: N, epsilon: f64) -> N {
    let rest_length = N::rounded(kind.rest_length);
    let compression = (rest_length - length) / rest_length;
    let is_stretched = compression.value() < 0.0 && !compression.is_close(N::ZERO, epsilon);
    if is_stretched { N::ZERO } else { compression.max(N::ZERO) }
}

/// c0 + c1 u + ... + c5 u^5. The error of u is passed on by the derivative: by the terms one by one
/// it would be many times as large, as their signs differ.
fn polynomial<N: Number>(coefficients: [f64; 6], u: N) -> N {
    let at_value = N::exact(u.value());
    let terms = coefficients.map(N::rounded).into_iter();
    let sum = terms.rev().reduce(|sum, term| term + at_value * sum).unwrap_or(N::ZERO);
    let slope = (1..6).rev().fold(0.0, |sum, k| k as f64 * coefficients[k] + u.value() * sum);
    sum.as_function_of(u, slope)
}

/// k (l - L), and the force of the bent strut for a spring whose rigidity is not beyond the limit.
fn branches<N: Number>(kind: &SpringKind, length: N, epsilon: f64) -> (N, Option<N>) {
    let ramp = N::rounded(kind.stiffness) * (length - N::rounded(kind.rest_length));
    let limit = RIGIDITY_LIMIT * kind.stiffness * kind.rest_length.powi(3);
    let buckled = kind.rigidity.filter(|&rigidity| rigidity <= limit).map(|_| {
        force_scale::<N>(kind)
            * polynomial(BUCKLING_COEFFICIENTS, compression(kind, length, epsilon))
    });
    (ramp, buckled)
}

/// The compressions between which the force of the bent strut is the larger one, if there are any.
fn buckled_range(kind: &SpringKind) -> Option<[f64; 2]> {
    let [scale, ramp] = [force_scale::<f64>(kind), kind.stiffness * kind.rest_length];
    let excess = |u: f64| ramp * u + scale * polynomial(BUCKLING_COEFFICIENTS, u);
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
