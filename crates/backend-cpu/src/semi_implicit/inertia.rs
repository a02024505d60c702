//! The rate at which a body turns.

/// An axis has no inertia if it has less than this share of the largest one.
const SHARE_MIN: f64 = 1e-12;

/// The angular velocity of a body with inertia tensor `tensor` \[kg m^2\] and angular momentum
/// `momentum` \[kg m^2/s\], by Cholesky factorisation with diagonal pivoting (Higham 2002, "Accuracy
/// and Stability of Numerical Algorithms", section 10.3).
///
/// Without inertia about some axis, all particles lie on it: turning about it moves nothing, so
/// that the component along it is free. The pivot that is left is then taken as zero.
pub(super) fn rate(tensor: [[f64; 3]; 3], momentum: [f64; 3]) -> [f64; 3] {
    let mut matrix = tensor;
    let mut right_side = momentum;
    let mut order = [0, 1, 2];
    let largest = (0..3).map(|k| tensor[k][k]).fold(0.0, f64::max);
    let mut rank = 0;
    while rank < 3 {
        let mut pivot = rank;
        for k in rank..3 {
            if matrix[order[k]][order[k]] > matrix[order[pivot]][order[pivot]] {
                pivot = k;
            }
        }
        order.swap(rank, pivot);
        let p = order[rank];
        if matrix[p][p] <= SHARE_MIN * largest {
            break;
        }
        for &row in &order[rank + 1..] {
            let factor = matrix[row][p] / matrix[p][p];
            for &column in &order[rank + 1..] {
                matrix[row][column] -= factor * matrix[p][column];
            }
            right_side[row] -= factor * right_side[p];
        }
        rank += 1;
    }
    let mut result = [0.0; 3];
    for place in (0..rank).rev() {
        let p = order[place];
        let known = order[place + 1..rank].iter().map(|&k| matrix[p][k] * result[k]);
        result[p] = (right_side[p] - known.sum::<f64>()) / matrix[p][p];
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::cross;

    /// Inertia tensor and angular momentum of unit masses that turn with `rate` about the origin.
    fn turning(bodies: &[[f64; 3]], rate: [f64; 3]) -> ([[f64; 3]; 3], [f64; 3]) {
        let (mut tensor, mut momentum) = ([[0.0; 3]; 3], [0.0; 3]);
        for x in bodies {
            let angular = cross(*x, cross(rate, *x));
            for row in 0..3 {
                momentum[row] += angular[row];
                for column in 0..3 {
                    let square: f64 = x.iter().map(|c| c * c).sum();
                    let diagonal = if row == column { square } else { 0.0 };
                    tensor[row][column] += diagonal - x[row] * x[column];
                }
            }
        }
        (tensor, momentum)
    }

    #[test]
    fn the_rate_of_a_turning_body_is_found() {
        let bodies = [[1.0, 0.2, -0.3], [-0.5, 2.0, 0.1], [0.3, -0.7, 1.5], [0.0, -0.2, -0.4]];
        let expected = [0.3, -1.2, 0.7];
        let (tensor, momentum) = turning(&bodies, expected);
        for (found, expected) in rate(tensor, momentum).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn bodies_on_a_line_move_as_they_did() {
        let axis = [0.6, -0.48, 0.64];
        let bodies = [-2.0, 0.5, 1.5].map(|place: f64| axis.map(|c| place * c));
        let turn = [1.0, 2.0, -0.5];
        let (tensor, momentum) = turning(&bodies, turn);
        let found = rate(tensor, momentum);
        for body in bodies {
            for (found, expected) in cross(found, body).iter().zip(cross(turn, body)) {
                assert!((found - expected).abs() < 1e-13, "{found} {expected}");
            }
        }
        assert_eq!(rate([[0.0; 3]; 3], [0.0; 3]), [0.0; 3]);
    }
}
