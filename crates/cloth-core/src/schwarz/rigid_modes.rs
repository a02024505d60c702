//! Rigid motions of groups as unknowns: orthonormal, and as many as are independent.
//!
//! A motion has six numbers (t, w): a translation and a rotation about a centre c, which moves x with t + w x (x - c).

/// A 6 x 6 matrix, row by row.
pub type Matrix6 = [[f64; 6]; 6];

pub(super) const ZERO6: Matrix6 = [[0.0; 6]; 6];

/// A mode of which this share or less of the largest of its kind is independent of those before it is left out: rotations of
/// a single particle, that of a straight rope about itself.
const RANK_MIN: f64 = 1e-6;

/// Orthonormal modes of a group, from the Gram matrix G of its rigid motions: G = R^T R.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modes {
    /// R^-1: the motions of unit unknowns. Columns of modes that are left out are zero.
    pub(super) motions: Matrix6,
    /// R^-T G: the unknowns of a motion.
    pub(super) unknowns: Matrix6,
}

impl Modes {
    /// Cholesky factorisation in fixed order, translations first.
    pub(super) fn new(gram: &Matrix6) -> Self {
        let largest = |from: usize| (from..from + 3).fold(0.0_f64, |m, k| m.max(gram[k][k]));
        let limits = [RANK_MIN * largest(0), RANK_MIN * largest(3)];
        let mut factor = ZERO6;
        for k in 0..6 {
            let mut pivot = gram[k][k];
            for j in 0..k {
                if factor[j][j] == 0.0 {
                    continue;
                }
                let mut entry = gram[j][k];
                for row in factor.iter().take(j) {
                    entry -= row[j] * row[k];
                }
                entry /= factor[j][j];
                factor[j][k] = entry;
                pivot -= entry * entry;
            }
            if pivot > limits[k / 3] {
                factor[k][k] = pivot.sqrt();
            } else {
                factor.iter_mut().for_each(|row| row[k] = 0.0);
            }
        }
        let mut motions = ZERO6;
        for k in (0..6).filter(|&k| factor[k][k] != 0.0) {
            motions[k][k] = 1.0 / factor[k][k];
            for j in (0..k).rev().filter(|&j| factor[j][j] != 0.0) {
                let sum: f64 = (j + 1..=k).map(|i| factor[j][i] * motions[i][k]).sum();
                motions[j][k] = -sum / factor[j][j];
            }
        }
        Self { motions, unknowns: transposed_product(&motions, gram) }
    }
}

/// a b.
#[inline(always)]
pub(super) fn product<const N: usize>(a: &[[f64; 6]; N], b: &Matrix6) -> [[f64; 6]; N] {
    let mut out = [[0.0; 6]; N];
    for (out, a) in out.iter_mut().zip(a) {
        for (k, b) in b.iter().enumerate() {
            for column in 0..6 {
                out[column] += a[k] * b[column];
            }
        }
    }
    out
}

/// to += a^T b.
#[inline(always)]
pub(super) fn transposed_product_add<const N: usize>(
    to: &mut Matrix6,
    a: &[[f64; 6]; N],
    b: &[[f64; 6]; N],
) {
    for (a, b) in a.iter().zip(b) {
        for (row, to) in to.iter_mut().enumerate() {
            for column in 0..6 {
                to[column] += a[row] * b[column];
            }
        }
    }
}

/// a^T b.
pub(super) fn transposed_product<const N: usize>(a: &[[f64; 6]; N], b: &[[f64; 6]; N]) -> Matrix6 {
    let mut out = ZERO6;
    transposed_product_add(&mut out, a, b);
    out
}

/// How the motions about a centre move a point at the distance d from it.
pub(super) const fn point_motion([x, y, z]: [f64; 3]) -> [[f64; 6]; 3] {
    [[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]]
}

/// The motions about a centre as motions about another, at the distance d from it.
pub(super) const fn moved_motion(d: [f64; 3]) -> Matrix6 {
    let [x, y, z] = point_motion(d);
    [
        x,
        y,
        z,
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    ]
}

/// The mean of some points.
pub(super) fn centre(points: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut count = 0.0;
    for point in points {
        (0..3).for_each(|axis| sum[axis] += point[axis]);
        count += 1.0;
    }
    sum.map(|sum| if count > 0.0 { sum / count } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes of a body, and how many there are.
    fn modes(points: &[[f64; 3]]) -> (Vec<[[f64; 6]; 3]>, usize) {
        let centre = centre(points.iter().copied());
        let motion =
            |point: &[f64; 3]| point_motion(std::array::from_fn(|axis| point[axis] - centre[axis]));
        let mut gram = ZERO6;
        for point in points {
            let motion = motion(point);
            transposed_product_add(&mut gram, &motion, &motion);
        }
        let modes = Modes::new(&gram);
        let count = (0..6).filter(|&k| modes.motions[k][k] != 0.0).count();
        (points.iter().map(|point| product(&motion(point), &modes.motions)).collect(), count)
    }

    #[test]
    fn modes_are_orthonormal_and_as_many_as_are_independent() {
        let rope = |[x, y, z]: [f64; 3]| -> Vec<[f64; 3]> {
            (0..9).map(|k| [x, y, z].map(|d| 3.0 + 0.01 * d * f64::from(k))).collect()
        };
        let plane: Vec<[f64; 3]> =
            (0..16).map(|k| [f64::from(k % 4), 0.3 * f64::from(k / 4), 2.0]).collect();
        let cases = [
            (vec![[1.0, 2.0, 3.0]], 3),
            (vec![[1.0, 2.0, 3.0]; 5], 3),
            (vec![[0.0; 3], [1e-3, 0.0, 0.0]], 5),
            (rope([1.0, 0.0, 0.0]), 5),
            (rope([1.0, -2.0, 3.0]), 5),
            (plane, 6),
        ];
        for (points, expected) in cases {
            let (modes, count) = modes(&points);
            assert_eq!(count, expected, "{points:?}");
            let mut gram = ZERO6;
            modes.iter().for_each(|mode| transposed_product_add(&mut gram, mode, mode));
            for (row, entries) in gram.iter().enumerate() {
                for (column, entry) in entries.iter().enumerate() {
                    let is_mode = row == column && *entry > 0.5;
                    let wanted = f64::from(u8::from(is_mode));
                    assert!((entry - wanted).abs() < 1e-9, "{points:?}: {gram:?}");
                }
            }
        }
    }

    #[test]
    fn a_motion_has_its_unknowns() {
        let points: Vec<[f64; 3]> =
            (0..7).map(|k| [f64::from(k), f64::from(k * k % 5), f64::from(k % 3)]).collect();
        let mut gram = ZERO6;
        for point in &points {
            transposed_product_add(&mut gram, &point_motion(*point), &point_motion(*point));
        }
        let Modes { motions, unknowns } = Modes::new(&gram);
        let identity = product(&motions, &unknowns);
        for (row, entries) in identity.iter().enumerate() {
            for (column, entry) in entries.iter().enumerate() {
                let wanted = f64::from(u8::from(row == column));
                assert!((entry - wanted).abs() < 1e-9, "{identity:?}");
            }
        }
    }
}
