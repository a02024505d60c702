//! The elements against finite differences, exact solutions and their own invariants.

mod bending;
mod membrane;
mod meshes;
mod rest;

use super::vector::Vector;

/// Numbers that look random, the same on every run.
struct Random(u64);

impl Random {
    /// Between -1 and 1.
    fn signed(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / 2.0_f64.powi(52) - 1.0
    }

    fn vector(&mut self) -> Vector<f64> {
        [self.signed(), self.signed(), self.signed()]
    }

    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * 0.5 * (1.0 + self.signed())
    }

    /// A rotation matrix, row by row, from a random quaternion.
    fn rotation(&mut self) -> glam::DMat3 {
        let q = glam::DVec4::new(self.signed(), self.signed(), self.signed(), self.signed());
        glam::DMat3::from_quat(glam::DQuat::from_vec4(q.normalize()))
    }
}

/// Eigenvalues of a symmetric matrix by Jacobi rotations.
fn eigenvalues<const N: usize>(mut a: [[f64; N]; N]) -> [f64; N] {
    for _ in 0..20 {
        for p in 0..N {
            for q in p + 1..N {
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
                let [row_p, row_q] = [a[p], a[q]];
                a[p] = std::array::from_fn(|k| c * row_p[k] - s * row_q[k]);
                a[q] = std::array::from_fn(|k| s * row_p[k] + c * row_q[k]);
            }
        }
    }
    std::array::from_fn(|k| a[k][k])
}

/// Largest difference of two lists, relative to the largest entry of the second.
fn deviation(found: &[f64], expected: &[f64]) -> f64 {
    let largest = expected.iter().fold(0.0_f64, |sum, x| sum.max(x.abs()));
    let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f64::max) / largest
}
