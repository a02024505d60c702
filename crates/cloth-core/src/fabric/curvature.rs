//! The curvature of a triangle in terms of the folds around it, and its stiffness (NUMERICS §12).

use super::PlateRigidity;
use crate::Real;

/// Eigenvalues of a triangle's fit are at least this share of the largest one: where the six vertices around a triangle lie nearly on a
/// conic, a curvature hardly folds its edges, and folds would say any large curvature.
const LEAST_SHARE: f64 = 0.002;

/// Entries of the map below this share of the largest one are what rounding has left of zero. In a solver of single precision their products are
/// numbers below the normal ones, which take some processors a hundred times as long as others.
const NOISE: f64 = 1e-10;

/// Folds that tell the curvature of a triangle: of its three edges, and for each of these the two other edges of the triangle beyond.
pub const FOLDS: usize = 9;

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

/// The curvature of a triangle from its folds, and the rigidity that it meets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvatureStiffness<T> {
    /// k11, k22 and k12 \[1/m\] for each fold \[rad\]; zero for folds that are not there.
    pub map: [[T; FOLDS]; 3],
    /// A D11, A D22, A D12 and 4 A D66 \[N m^3\].
    pub plate: [T; 4],
}

/// What the folds of a triangle's own edges say of it: the quadratic surface through its corners and the vertices beyond its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// How much of the fold of each edge belongs to this triangle, the angle between it and the surface in the middle of the edge, for the folds
    /// of its three edges.
    pub(super) halves: [[f64; 3]; 3],
    /// Whether the fit had to be limited.
    pub(super) is_limited: bool,
}

impl HingeGeometry {
    /// The angle between this triangle, and the next one, and a surface in the middle of the edge, for its curvatures k11, k22, k12 \[m\]. The sum
    /// of both is the fold.
    fn halves(&self) -> [[f64; 3]; 2] {
        let Self { tangent: t, normal: n, length, heights, feet } = *self;
        [0, 1].map(|k| {
            let along_normal = 0.5 * heights[k];
            let along_edge = -0.5 * feet[k] * (length - feet[k]) / heights[k];
            // The other triangle sees its normal the other way.
            let mixed = (feet[k] - 0.5 * length) * if k == 0 { 1.0 } else { -1.0 };
            [
                along_normal * n[0] * n[0] + along_edge * t[0] * t[0] + mixed * n[0] * t[0],
                along_normal * n[1] * n[1] + along_edge * t[1] * t[1] + mixed * n[1] * t[1],
                2.0 * (along_normal * n[0] * n[1] + along_edge * t[0] * t[1])
                    + mixed * (n[0] * t[1] + n[1] * t[0]),
            ]
        })
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

impl Fit {
    /// By the hinges of a triangle, `None` for edges without a neighbour: of all curvatures with these folds the one with the least energy.
    pub(super) fn new(plate: &PlateRigidity, hinges: &[Option<HingeGeometry>; 3]) -> Self {
        let halves = hinges.map(|hinge| hinge.map(|hinge| hinge.halves()));
        let rows = halves.map(|halves| {
            halves.map(|[own, other]| [own[0] + other[0], own[1] + other[1], own[2] + other[2]])
        });
        let mut matrix = [[0.0; 3]; 3];
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                if let (Some(a), Some(b)) = (rows[i], rows[j]) {
                    *entry = dot(a, plate.compliance(b));
                }
            }
        }
        let (values, vectors) = eigen(matrix);
        let least = LEAST_SHARE * values.iter().fold(0.0_f64, |m, v| m.max(*v));
        let mut is_limited = false;
        let mut inverse = [[0.0; 3]; 3];
        for (value, vector) in values.into_iter().zip(vectors) {
            // An edge without a neighbour has the eigenvector of its own axis and the value zero.
            let present = vector.iter().zip(&rows).any(|(v, row)| row.is_some() && v.abs() > 0.5);
            if !present || least == 0.0 {
                continue;
            }
            is_limited |= value < least;
            for (i, row) in inverse.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += vector[i] * vector[j] / value.max(least);
                }
            }
        }
        // halves = a D^-1 M^T (M D^-1 M^T)^-1
        let mut result = [[0.0; 3]; 3];
        for (edge, row) in result.iter_mut().enumerate() {
            let Some([own, _]) = halves[edge] else { continue };
            for (fold, entry) in row.iter_mut().enumerate() {
                for (k, folded) in rows.iter().enumerate() {
                    if let Some(folded) = folded {
                        *entry += dot(own, plate.compliance(*folded)) * inverse[k][fold];
                    }
                }
            }
        }
        Self { halves: result, is_limited }
    }
}

impl PlateRigidity {
    /// D^-1 of a moment.
    fn compliance(&self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let determinant = self.warp * self.weft - self.coupling * self.coupling;
        [
            (self.weft * a - self.coupling * b) / determinant,
            (self.warp * b - self.coupling * a) / determinant,
            c / (4.0 * self.twist),
        ]
    }

    /// D of a curvature.
    fn stress(&self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        [self.warp * a + self.coupling * b, self.weft * b + self.coupling * a, 4.0 * self.twist * c]
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl CurvatureStiffness<f64> {
    /// The stiffness of a triangle with this area \[m^2\] and these edges, by its own fit and those of its neighbours: for each edge the normal in the
    /// pattern and the length \[m\], and which edge of which fit lies beyond it, if any.
    pub(super) fn new(
        area: f64,
        plate: &PlateRigidity,
        own: &Fit,
        edges: &[([f64; 2], f64); 3],
        beyond: &[Option<(Fit, usize)>; 3],
    ) -> Self {
        // The curvature for the angle of each edge (Morley 1968).
        let columns =
            edges.map(|([x, y], length)| [x * x, y * y, x * y].map(|entry| entry * length / area));
        let mut map = [[0.0; FOLDS]; 3];
        for (edge, beyond) in beyond.iter().enumerate() {
            let &Some((fit, other)) = beyond else { continue };
            // Both fits say what the slope is in the middle of the edge: the mean of that.
            let mut angle = [0.0; FOLDS];
            for (fold, half) in own.halves[edge].iter().enumerate() {
                angle[fold] += 0.5 * half;
            }
            angle[edge] += 0.5 * (1.0 - fit.halves[other][other]);
            for (step, place) in [(1, 3 + 2 * edge), (2, 4 + 2 * edge)] {
                angle[place] -= 0.5 * fit.halves[other][(other + step) % 3];
            }
            for (row, entry) in map.iter_mut().zip(columns[edge]) {
                row.iter_mut().zip(angle).for_each(|(to, angle)| *to += entry * angle);
            }
        }
        // A free border takes the angle with the least energy.
        let free = || (0..3).filter(|&edge| beyond[edge].is_none());
        for fold in 0..FOLDS {
            let mut curvature = [map[0][fold], map[1][fold], map[2][fold]];
            relax(&mut curvature, plate, free().map(|edge| columns[edge]).collect());
            map.iter_mut().zip(curvature).for_each(|(row, entry)| row[fold] = entry);
        }
        let largest = map.iter().flatten().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        for entry in map.iter_mut().flatten() {
            if entry.abs() < NOISE * largest {
                *entry = 0.0;
            }
        }
        let PlateRigidity { warp, weft, coupling, twist } = *plate;
        Self { map, plate: [warp, weft, coupling, 4.0 * twist].map(|d| area * d) }
    }

    /// L^T times the map, A D = L L^T (Cholesky), rounded to the precision of a solver: three numbers \[J^(1/2)\] for the differences of folds from rest
    /// \[rad\], half the sum of whose squares is the energy. Moments are this, transposed, times the numbers, and the matrix of a triangle is the sum of
    /// three products of a vector and itself: symmetric to the last bit, and never indefinite.
    #[must_use]
    pub fn rooted<T: Real>(&self) -> [[T; FOLDS]; 3] {
        let [d11, d22, d12, d66] = self.plate;
        let root = |square: f64| square.max(0.0).sqrt();
        let l11 = root(d11);
        let l21 = if l11 > 0.0 { d12 / l11 } else { 0.0 };
        let [l22, l33] = [root(d22 - l21 * l21), root(d66)];
        let [k11, k22, k12] = &self.map;
        [
            std::array::from_fn(|fold| T::from_f64(l11 * k11[fold] + l21 * k22[fold])),
            k22.map(|entry| T::from_f64(l22 * entry)),
            k12.map(|entry| T::from_f64(l33 * entry)),
        ]
    }
}

/// Takes those multiples of the directions off a curvature that leave it with the least energy.
fn relax(curvature: &mut [f64; 3], plate: &PlateRigidity, directions: Vec<[f64; 3]>) {
    let mut taken: Vec<[f64; 3]> = Vec::new();
    for mut direction in directions {
        let take_off = |vector: &mut [f64; 3], direction: [f64; 3]| {
            let share =
                dot(*vector, plate.stress(direction)) / dot(direction, plate.stress(direction));
            vector.iter_mut().zip(direction).for_each(|(v, d)| *v -= share * d);
        };
        taken.iter().for_each(|&other| take_off(&mut direction, other));
        take_off(curvature, direction);
        taken.push(direction);
    }
}

impl<T: Real> CurvatureStiffness<T> {
    /// Curvatures k11, k22, k12 \[1/m\] for the differences of folds from rest \[rad\].
    #[inline(always)]
    #[must_use]
    pub fn curvature(&self, folds: [T; FOLDS]) -> [T; 3] {
        self.map.map(|row| {
            let mut sum = row[0] * folds[0];
            for fold in 1..FOLDS {
                sum += row[fold] * folds[fold];
            }
            sum
        })
    }

    /// The moments of a curvature, times the area \[N m^2\].
    #[inline(always)]
    #[must_use]
    pub fn stress(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        let [d11, d22, d12, d66] = self.plate;
        [d11 * a + d12 * b, d12 * a + d22 * b, d66 * c]
    }

    /// Moments of the folds \[N m\] for their differences from rest \[rad\].
    #[inline(always)]
    #[must_use]
    pub fn moments(&self, folds: [T; FOLDS]) -> [T; FOLDS] {
        let [a, b, c] = self.stress(self.curvature(folds));
        let [p, q, r] = &self.map;
        std::array::from_fn(|fold| p[fold] * a + q[fold] * b + r[fold] * c)
    }

    /// Energy \[J\].
    #[inline(always)]
    #[must_use]
    pub fn energy(&self, folds: [T; FOLDS]) -> T {
        let k = self.curvature(folds);
        let m = self.stress(k);
        T::from_f64(0.5) * (m[0] * k[0] + m[1] * k[1] + m[2] * k[2])
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
    fn half_the_squares_of_rooted_numbers_are_the_energy() {
        let mut stiffness = CurvatureStiffness::default();
        let mut number = 0.0;
        for entry in stiffness.map.iter_mut().flatten() {
            number += 1.0;
            *entry = f64::sin(7.0 * number);
        }
        let folds: [f64; FOLDS] = std::array::from_fn(|fold| f64::cos(3.0 * fold as f64));
        // An ordinary plate, one without coupling or warp, and one at the edge of what is definite.
        for plate in [[3.0, 2.0, 0.7, 1.1], [0.0, 2.0, 0.0, 1.1], [4.0, 1.0, 2.0, 0.0]] {
            stiffness.plate = plate;
            let rooted = stiffness.rooted::<f64>();
            let numbers = rooted.map(|row| row.iter().zip(folds).map(|(k, f)| k * f).sum::<f64>());
            let energy = 0.5 * numbers.iter().map(|number| number * number).sum::<f64>();
            let expected = stiffness.energy(folds);
            assert!((energy - expected).abs() < 1e-13 * expected, "{energy} {expected}");
            let moments = stiffness.moments(folds);
            for (fold, moment) in moments.into_iter().enumerate() {
                let found: f64 = (0..3).map(|k| rooted[k][fold] * numbers[k]).sum();
                assert!((found - moment).abs() < 1e-13 * expected, "{found} {moment}");
            }
        }
    }

    #[test]
    fn a_triangle_alone_has_no_curvature() {
        let plate = PlateRigidity { warp: 1.0, weft: 1.0, coupling: 0.0, twist: 0.5 };
        let fit = Fit::new(&plate, &[None; 3]);
        let edges = [([1.0, 0.0], 1.0), ([0.0, 1.0], 1.0), ([-0.6, 0.8], 1.0)];
        let stiffness = CurvatureStiffness::new(1.0, &plate, &fit, &edges, &[None; 3]);
        assert_eq!(stiffness.map, [[0.0; FOLDS]; 3]);
    }
}
