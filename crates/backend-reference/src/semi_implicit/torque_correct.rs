//! NUMERICS §6, `torque_correct`.

use cloth_core::Model;

use crate::{Matrix, Number, Particles, Vector};

/// An axis has no inertia if it has less than this share of the largest one.
const SHARE_MIN: f64 = 1e-12;

/// What a solution has beyond h times the forces, in a piece of cloth.
#[derive(Clone, Copy, Debug)]
pub struct Surplus<N> {
    /// Linear momentum.
    pub linear: Vector<N>,
    /// Angular momentum about the centre of mass.
    pub angular: Vector<N>,
    /// A place in the piece: seen from the origin of the world, far away, the centre would lose digits.
    origin: Vector<N>,
    /// The centre of mass, seen from there.
    centre: Vector<N>,
}

impl<N: Number> Surplus<N> {
    /// A position, seen from the centre of mass.
    #[must_use]
    pub fn arm(&self, position: Vector<N>) -> Vector<N> {
        (position - self.origin) - self.centre
    }
}

/// Sums m y - h f and (x - c) x (m y - h f) over a piece.
#[must_use]
pub fn angular_surplus<N: Number>(
    model: &Model,
    positions: &[Vector<N>],
    forces: &[Vector<N>],
    solution: &[Vector<N>],
    length: f64,
    piece: &[u32],
) -> Surplus<N> {
    let particles = || piece.iter().map(|&particle| particle as usize);
    let (h, mass) = (N::rounded(length), |i: usize| N::rounded(model.masses()[i]));
    let origin = particles().next().map_or(Vector::ZERO, |first| positions[first]);
    let (mut mass_sum, mut first) = (N::ZERO, Vector::ZERO);
    for i in particles() {
        mass_sum += mass(i);
        first += (positions[i] - origin).scaled(mass(i));
    }
    let centre = first.divided(mass_sum);
    let mut surplus = Surplus { linear: Vector::ZERO, angular: Vector::ZERO, origin, centre };
    for i in particles() {
        let momentum = solution[i].scaled(mass(i)) - forces[i].scaled(h);
        surplus.linear += momentum;
        surplus.angular += surplus.arm(positions[i]).cross(momentum);
    }
    surplus
}

/// Takes the angular momentum of each piece that nothing holds, beyond that of its forces, out of the solution.
pub(crate) fn torque_correct(
    model: &Model,
    particles: &Particles<f64>,
    forces: &[Vector<f64>],
    length: f64,
    solution: &mut [Vector<f64>],
) {
    for piece in model.connected_pieces() {
        if piece.iter().any(|&particle| particles.is_held(particle as usize)) {
            continue;
        }
        let positions = &particles.positions;
        let surplus = angular_surplus(model, positions, forces, solution, length, &piece);
        let mut inertia = Matrix::ZERO;
        for &particle in &piece {
            let arm = surplus.arm(positions[particle as usize]);
            let tensor = Matrix::diagonal(arm.dot(arm)) + Matrix::outer(arm, arm).negated();
            inertia += tensor.scaled(model.masses()[particle as usize]);
        }
        let rate = rotation_rate(inertia, surplus.angular);
        for &particle in &piece {
            let arm = surplus.arm(positions[particle as usize]);
            solution[particle as usize] -= rate.cross(arm);
        }
    }
}

/// The angular velocity of a body with this inertia tensor and angular momentum: Cholesky factorisation with diagonal pivoting
/// (Higham 2002, "Accuracy and Stability of Numerical Algorithms", section 10.3). About an axis without inertia it is zero.
fn rotation_rate(inertia: Matrix<f64>, momentum: Vector<f64>) -> Vector<f64> {
    let mut matrix = inertia.0.map(|row| row.0);
    let mut right_side = momentum.0;
    let smallest = SHARE_MIN * (0..3).map(|k| matrix[k][k]).fold(0.0, f64::max);
    let mut left = vec![0, 1, 2];
    let mut pivots: Vec<usize> = Vec::new();
    while let Some(&pivot) =
        left.iter().max_by(|a, b| matrix[**a][**a].total_cmp(&matrix[**b][**b]))
    {
        let has_inertia = matrix[pivot][pivot] > smallest;
        if !has_inertia {
            break;
        }
        left.retain(|&k| k != pivot);
        for &row in &left {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            for &column in &left {
                matrix[row][column] -= factor * matrix[pivot][column];
            }
            right_side[row] -= factor * right_side[pivot];
        }
        pivots.push(pivot);
    }
    let mut rate = [0.0; 3];
    for (number, &pivot) in pivots.iter().enumerate().rev() {
        let known: f64 = pivots[number + 1..].iter().map(|&k| matrix[pivot][k] * rate[k]).sum();
        rate[pivot] = (right_side[pivot] - known) / matrix[pivot][pivot];
    }
    Vector(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_a_turning_body_is_found_and_a_line_turns_about_no_axis_of_its_own() {
        let turning = |bodies: &[[f64; 3]], rate: [f64; 3]| {
            let (mut inertia, mut momentum) = (Matrix::ZERO, Vector::ZERO);
            for arm in bodies.iter().copied().map(Vector) {
                inertia += Matrix::diagonal(arm.dot(arm)) + Matrix::outer(arm, arm).negated();
                momentum += arm.cross(Vector(rate).cross(arm));
            }
            rotation_rate(inertia, momentum)
        };
        let bodies = [[1.0, 0.2, -0.3], [-0.5, 2.0, 0.1], [0.3, -0.7, 1.5], [0.0, -0.2, -0.4]];
        let rate = turning(&bodies, [0.3, -1.2, 0.7]);
        assert!((rate - Vector([0.3, -1.2, 0.7])).length() < 1e-14, "{rate:?}");
        let line = [-2.0, 0.5, 1.5].map(|place: f64| [0.6, -0.48, 0.64].map(|c| place * c));
        let rate = turning(&line, [1.0, 2.0, -0.5]);
        for arm in line.map(Vector) {
            let expected = Vector([1.0, 2.0, -0.5]).cross(arm);
            assert!((rate.cross(arm) - expected).length() < 1e-13, "{rate:?}");
        }
    }
}
