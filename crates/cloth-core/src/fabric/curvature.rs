//! The bending stiffness of a triangle in terms of the folds of its three edges (NUMERICS §12).

use super::PlateRigidity;
use crate::Real;

/// A stiffness of a triangle's folds is at most this many times that of its stiffest hinge on its own: where the six vertices
/// around a triangle lie nearly on a conic, a curvature hardly folds its edges, and the exact stiffness would be any large number.
const LARGEST_SHARE: f64 = 10.0;

/// A hinge as the triangle sees it, at rest and laid flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeGeometry {
    /// Direction of the edge in the pattern of the triangle, of unit length.
    pub tangent: [f64; 2],
    /// Direction at a right angle to the edge, of unit length, towards the inside of the triangle.
    pub normal: [f64; 2],
    /// Length of the edge \[m\].
    pub length: f64,
    /// Heights of the triangle and of its neighbour over the edge \[m\].
    pub heights: [f64; 2],
    /// Where the feet of these heights lie, from the start of the edge along `tangent` \[m\].
    pub feet: [f64; 2],
}

/// Moments of the three edges of a triangle for the folds of the three, a symmetric matrix without negative eigenvalues.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvatureStiffness<T> {
    /// Entries 00, 11, 22, 01, 02, 12 \[N m\]; zero for edges without a neighbour.
    pub entries: [T; 6],
}

impl HingeGeometry {
    /// Derivatives of the fold by the curvatures k11, k22, k12 of a surface \[m\].
    fn row(&self) -> [f64; 3] {
        let Self { tangent: t, normal: n, length, heights, feet } = *self;
        let saddle = |k: usize| feet[k] * (length - feet[k]) / heights[k];
        let along_normal = 0.5 * (heights[0] + heights[1]);
        let along_edge = -0.5 * (saddle(0) + saddle(1));
        let mixed = feet[0] - feet[1];
        [
            along_normal * n[0] * n[0] + along_edge * t[0] * t[0] + mixed * n[0] * t[0],
            along_normal * n[1] * n[1] + along_edge * t[1] * t[1] + mixed * n[1] * t[1],
            2.0 * (along_normal * n[0] * n[1] + along_edge * t[0] * t[1])
                + mixed * (n[0] * t[1] + n[1] * t[0]),
        ]
    }

    /// How much the flat hinge folds for a motion out of the plane \[1/m\]: of its start and end, and of the third vertices of both
    /// triangles.
    #[must_use]
    pub fn weights(&self) -> [f64; 4] {
        let apexes = self.heights.map(f64::recip);
        let shares = self.feet.map(|foot| foot / self.length);
        let end = -(shares[0] * apexes[0] + shares[1] * apexes[1]);
        [-(end + apexes[0] + apexes[1]), end, apexes[0], apexes[1]]
    }

    /// Stiffness of the hinge on its own \[N m\]: B |e|^2 / (A1 + A2), B the rigidity across it.
    #[must_use]
    pub fn lone_stiffness(&self, rigidity: f64) -> f64 {
        2.0 * rigidity * self.length / (self.heights[0] + self.heights[1])
    }
}

impl CurvatureStiffness<f64> {
    /// The stiffness of a triangle with this area \[m^2\] and these hinges, `None` for edges without a neighbour; and whether it
    /// had to be limited.
    #[must_use]
    pub fn new(
        area: f64,
        plate: &PlateRigidity,
        hinges: &[Option<HingeGeometry>; 3],
    ) -> (Self, bool) {
        let determinant = plate.warp * plate.weft - plate.coupling * plate.coupling;
        let compliance = |a: [f64; 3], b: [f64; 3]| {
            (plate.weft * a[0] * b[0] + plate.warp * a[1] * b[1]
                - plate.coupling * (a[0] * b[1] + a[1] * b[0]))
                / determinant
                + a[2] * b[2] / (4.0 * plate.twist)
        };
        let rows = hinges.map(|hinge| hinge.map(|hinge| hinge.row()));
        let mut matrix = [[0.0; 3]; 3];
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = match (rows[i], rows[j]) {
                    (Some(a), Some(b)) => compliance(a, b),
                    _ => 0.0,
                };
            }
        }
        let rigidity = plate.warp.max(plate.weft);
        let stiffest = hinges.iter().flatten().map(|hinge| hinge.lone_stiffness(rigidity));
        let largest = LARGEST_SHARE * stiffest.fold(0.0, f64::max);
        let (values, vectors) = eigen(matrix);
        let mut limited = false;
        let mut entries = [0.0; 6];
        for (value, vector) in values.into_iter().zip(vectors) {
            // An edge without a neighbour has the eigenvector of its own axis and the value zero.
            let present = vector.iter().zip(&rows).any(|(v, row)| row.is_some() && v.abs() > 0.5);
            if !present {
                continue;
            }
            let exact = area / value;
            let stiff = !(0.0..=largest).contains(&exact);
            limited |= stiff;
            let stiffness = if stiff { largest } else { exact };
            for (entry, (i, j)) in entries.iter_mut().zip(PAIRS) {
                *entry += stiffness * vector[i] * vector[j];
            }
        }
        (Self { entries }, limited)
    }

    /// The same, rounded to the precision of a solver.
    #[must_use]
    pub fn rounded<T: Real>(&self) -> CurvatureStiffness<T> {
        CurvatureStiffness { entries: self.entries.map(T::from_f64) }
    }
}

/// Which entry is which.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl<T: Real> CurvatureStiffness<T> {
    /// Moments of the three edges \[N m\] for the differences of their folds from rest \[rad\].
    #[inline(always)]
    #[must_use]
    pub fn moments(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        let [k00, k11, k22, k01, k02, k12] = self.entries;
        [k00 * a + k01 * b + k02 * c, k01 * a + k11 * b + k12 * c, k02 * a + k12 * b + k22 * c]
    }

    /// The moment of edge `a` for the fold of edge `b` \[N m\].
    #[inline(always)]
    #[must_use]
    pub fn entry(&self, a: usize, b: usize) -> T {
        const PLACES: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
        self.entries[PLACES[a][b]]
    }

    /// Energy \[J\].
    #[inline(always)]
    #[must_use]
    pub fn energy(&self, folds: [T; 3]) -> T {
        let m = self.moments(folds);
        T::from_f64(0.5) * (m[0] * folds[0] + m[1] * folds[1] + m[2] * folds[2])
    }
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix by Jacobi rotations; it is done once for each triangle.
fn eigen(mut a: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    // Row k is the k-th eigenvector.
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = ratio.signum() / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                (vectors[p][k], vectors[q][k]) =
                    (c * vectors[p][k] - s * vectors[q][k], s * vectors[p][k] + c * vectors[q][k]);
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_make_the_matrix_again() {
        let matrix = [[4.0, 1.0, -2.0], [1.0, 3.0, 0.5], [-2.0, 0.5, 1.5]];
        let (values, vectors) = eigen(matrix);
        for i in 0..3 {
            for j in 0..3 {
                let sum: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((sum - matrix[i][j]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_triangle_alone_has_no_stiffness() {
        let plate = PlateRigidity { warp: 1.0, weft: 1.0, coupling: 0.0, twist: 0.5 };
        let (stiffness, limited) = CurvatureStiffness::new(1.0, &plate, &[None; 3]);
        assert_eq!((stiffness.entries, limited), ([0.0; 6], false));
    }
}
