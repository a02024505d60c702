//! A triangle of fabric that is stretched too far (NUMERICS §4, `stretch_limit`).

use super::{
    membrane::{RestState, corner_gradients, deformation},
    vector::{Vector, combination, dot},
};
use crate::Real;

/// Share of the largest inverse mass with which a direction counts at least: where the only free corner hardly moves it, or is much
/// heavier than those that are held, the triangle is left a little too long instead of its corner being thrown away.
pub const LEAST_SHARE: f64 = 0.1;

/// How the corners move \[m\] so that no principal stretch is above `ratio`; `None` if none is. `inverse_masses` \[1/kg\] are zero for corners
/// that are held. Momentum and angular momentum stay.
///
/// The stretch s_i along the direction d_i of the pattern is |f_i|, f_i = F d_i, and its gradient by corner a is p_a f_i / s_i, p_a the derivative of
/// the corner's hat function along d_i: what a spring has at its ends, with weights.
#[inline(always)]
#[must_use]
pub fn correction<T: Real>(
    corners: [Vector<T>; 3],
    inverse_masses: [T; 3],
    rest: &RestState<T>,
    ratio: T,
) -> Option<[Vector<T>; 3]> {
    let [f_u, f_v] = deformation(corners, rest);
    let [c11, c22, c12] = [dot(f_u, f_u), dot(f_v, f_v), dot(f_u, f_v)];
    let half = T::from_f64(0.5);
    let mean = half * (c11 + c22);
    let apart = half * (c11 - c22);
    let radius = (apart * apart + c12 * c12).sqrt();
    let longest = ratio * ratio;
    if mean + radius <= longest {
        return None;
    }
    // Of two forms of the eigenvector the one that does not cancel.
    let [x, y] = if apart >= T::ZERO { [radius + apart, c12] } else { [c12, radius - apart] };
    let length = (x * x + y * y).sqrt();
    let [x, y] = if length > T::ZERO { [x / length, y / length] } else { [T::ONE, T::ZERO] };
    let gradients = corner_gradients(rest);
    let largest = inverse_masses[0].maximum(inverse_masses[1]).maximum(inverse_masses[2]);
    let mut shift = [[T::ZERO; 3]; 3];
    for ([du, dv], square) in [([x, y], mean + radius), ([-y, x], mean - radius)] {
        if square <= longest {
            continue;
        }
        let stretch = square.sqrt();
        let along = combination(f_u, du, f_v, dv);
        let p = gradients.map(|[u, v]| u * du + v * dv);
        let squares = p.map(|p| p * p);
        let sum = squares[0] + squares[1] + squares[2];
        let own = inverse_masses[0] * squares[0]
            + inverse_masses[1] * squares[1]
            + inverse_masses[2] * squares[2];
        let total = own.maximum(T::from_f64(LEAST_SHARE) * (largest * sum));
        if total <= T::ZERO {
            continue;
        }
        let scale = (stretch - ratio) / total / stretch;
        for ((shift, p), inverse_mass) in shift.iter_mut().zip(p).zip(inverse_masses) {
            let factor = inverse_mass * (scale * p);
            for (entry, along) in shift.iter_mut().zip(along) {
                *entry += -(factor * along);
            }
        }
    }
    Some(shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::membrane::{principal_stretches, rest_state, strain};

    fn rest() -> RestState<f64> {
        rest_state([[0.0, 0.0], [0.03, 0.002], [0.01, 0.02]]).unwrap()
    }

    fn moved(corners: [Vector<f64>; 3], shift: [Vector<f64>; 3]) -> [Vector<f64>; 3] {
        [0, 1, 2].map(|a| [0, 1, 2].map(|k| corners[a][k] + shift[a][k]))
    }

    fn stretches(corners: [Vector<f64>; 3]) -> [f64; 2] {
        principal_stretches(strain(deformation(corners, &rest())))
    }

    const LONG: [Vector<f64>; 3] = [[0.0, 0.0, 0.0], [0.04, 0.002, 0.01], [0.01, 0.03, -0.002]];

    #[test]
    fn sweeps_end_at_the_limit_and_keep_the_momenta() {
        let inverse_masses = [1.0, 2.0, 0.7];
        let mut corners = LONG;
        assert!(stretches(corners)[1] > 1.05, "{:?}", stretches(corners));
        let mut sums = [[0.0; 3]; 2];
        for sweep in 0.. {
            let Some(shift) = correction(corners, inverse_masses, &rest(), 1.05) else {
                assert!(sweep > 0);
                break;
            };
            for a in 0..3 {
                let [x, s] = [glam::DVec3::from(corners[a]), glam::DVec3::from(shift[a])];
                let impulse = s / inverse_masses[a];
                for k in 0..3 {
                    sums[0][k] += impulse[k];
                    sums[1][k] += x.cross(impulse)[k];
                }
            }
            corners = moved(corners, shift);
            if stretches(corners)[0] < 1.05 + 1e-9 {
                break;
            }
            assert!(sweep < 30, "{:?}", stretches(corners));
        }
        assert!(stretches(corners)[0] < 1.05 + 1e-9);
        sums.as_flattened().iter().for_each(|sum| assert!(sum.abs() < 1e-12, "{sums:?}"));
    }

    #[test]
    fn what_is_short_or_held_stays() {
        assert_eq!(correction(LONG, [1.0; 3], &rest(), 2.0), None);
        let held = correction(LONG, [0.0; 3], &rest(), 1.05).unwrap();
        assert_eq!(held, [[0.0; 3]; 3]);
        let [a, b, _] = correction(LONG, [0.0, 0.0, 1.0], &rest(), 1.05).unwrap();
        assert_eq!([a, b], [[0.0; 3]; 2]);
    }

    /// As much in both directions: any two of them do. One triangle alone is sheared by it, as both corrections move its corners by their
    /// masses; neither stretch stays too long.
    #[test]
    fn an_even_stretch_is_taken_back() {
        let rest = rest_state([[0.0, 0.0], [0.02, 0.0], [0.0, 0.02]]).unwrap();
        let corners = [[0.0; 3], [0.03, 0.0, 0.0], [0.0, 0.03, 0.0]];
        let mut now = corners;
        for _ in 0..60 {
            let Some(shift) = correction(now, [1.0; 3], &rest, 1.1) else { break };
            now = moved(now, shift);
        }
        let [larger, smaller] = principal_stretches(strain(deformation(now, &rest)));
        assert!(
            (larger - 1.1).abs() < 1e-6 && (0.85..1.1).contains(&smaller),
            "{larger} {smaller}"
        );
    }
}
