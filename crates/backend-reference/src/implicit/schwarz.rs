//! NUMERICS §5, the preconditioner `schwarz`: the formulas with dense matrices, for small models.

use cloth_core::GroupHierarchy;

use super::{Constraints, LinearSystem};
use crate::{Matrix, Vector};

/// A mode of which this share or less of the largest of its kind is left is dropped.
const RANK_MIN: f64 = 1e-6;
/// A pivot that is not above it counts as 1.
const PIVOT_MIN: f64 = 1e-12;
/// Steps of the power iteration.
const POWER_STEPS: usize = 8;

/// A matrix, row by row.
type Dense = Vec<Vec<f64>>;

/// P V P^T: what rigid motions of groups add to the inverse blocks of particles.
#[derive(Clone, Debug, Default)]
pub struct Schwarz {
    /// P: a row for each component of each particle.
    prolongation: Dense,
    levels: Vec<Level>,
}

/// A level above the particles.
#[derive(Clone, Debug, Default)]
struct Level {
    matrix: Dense,
    /// Z, or the inverse of the matrix on the last level.
    inverse: Dense,
    weight: f64,
    /// P of the next level, nothing on the last one.
    prolongation: Dense,
}

/// Nodes of a level: where they are, and the unknowns that a rigid motion is.
struct Node {
    centre: [f64; 3],
    unknowns: Dense,
}

impl Schwarz {
    /// The preconditioner of a system for particles in these places.
    #[must_use]
    pub fn new(
        hierarchy: &GroupHierarchy,
        system: &LinearSystem<f64>,
        constraints: &Constraints<f64>,
        positions: &[Vector<f64>],
    ) -> Self {
        let filter = |particle: usize| constraints.0[particle].filter();
        let count = positions.len();
        let mut free = zeros(3 * count);
        system.blocks().into_iter().for_each(|(at, block)| put(&mut free, at, block));
        let members: Vec<Vec<usize>> = (hierarchy.levels()[0].windows(2))
            .map(|ends| {
                let places = ends[0] as usize..ends[1] as usize;
                hierarchy.order()[places].iter().map(|&particle| particle as usize).collect()
            })
            .collect();
        let mut prolongation = vec![vec![0.0; 6 * members.len()]; 3 * count];
        let mut nodes = Vec::new();
        for (group, particles) in members.iter().enumerate() {
            let centre = mean(particles.iter().map(|&i| positions[i].0));
            let motion = |i: usize| -> Dense {
                let moved = point_motion(difference(positions[i].0, centre));
                product(&filter(i).0.map(|row| row.0.to_vec()).to_vec(), &moved)
            };
            let mut gram = zeros(6);
            particles
                .iter()
                .for_each(|&i| add(&mut gram, &transposed_product(&motion(i), &motion(i))));
            let (motions, unknowns) = modes(&gram);
            for &i in particles {
                for (axis, row) in product(&motion(i), &motions).iter().enumerate() {
                    prolongation[3 * i + axis][6 * group..6 * group + 6].copy_from_slice(row);
                }
            }
            nodes.push(Node { centre, unknowns });
        }
        let matrix = transposed_product(&prolongation, &product(&free, &prolongation));
        Self { prolongation, levels: levels(matrix, nodes, &hierarchy.levels()[1..]) }
    }

    /// P V P^T r.
    #[must_use]
    pub fn apply(&self, r: &[Vector<f64>]) -> Vec<Vector<f64>> {
        let flat: Vec<f64> = r.iter().flat_map(|vector| vector.0).collect();
        let coarse = transposed_apply(&self.prolongation, &flat);
        let out = apply(&self.prolongation, &cycle(&self.levels, &coarse));
        out.chunks(3).map(|c| Vector([c[0], c[1], c[2]])).collect()
    }
}

/// All levels above the particles; `groups` says where the groups of nodes of each start.
fn levels(mut matrix: Dense, mut nodes: Vec<Node>, groups: &[Vec<u32>]) -> Vec<Level> {
    let mut levels = Vec::new();
    for starts in groups {
        let mut prolongation = vec![vec![0.0; 6 * (starts.len() - 1)]; matrix.len()];
        let mut above = Vec::new();
        for (group, ends) in starts.windows(2).enumerate() {
            let range = ends[0] as usize..ends[1] as usize;
            let centre = mean(nodes[range.clone()].iter().map(|node| node.centre));
            let motion = |node: usize| {
                let moved = moved_motion(difference(nodes[node].centre, centre));
                product(&nodes[node].unknowns, &moved)
            };
            let mut gram = zeros(6);
            range.clone().for_each(|k| add(&mut gram, &transposed_product(&motion(k), &motion(k))));
            let (motions, unknowns) = modes(&gram);
            for node in range {
                for (k, row) in product(&motion(node), &motions).iter().enumerate() {
                    prolongation[6 * node + k][6 * group..6 * group + 6].copy_from_slice(row);
                }
            }
            above.push(Node { centre, unknowns });
        }
        let coarse = transposed_product(&prolongation, &product(&matrix, &prolongation));
        let mut inverse = zeros(matrix.len());
        let unknowns: Vec<usize> = (0..matrix.len()).collect();
        for rows in unknowns.chunks(6 * GroupHierarchy::SMOOTHED) {
            for (&row, entries) in rows.iter().zip(self::inverse(&part(&matrix, rows))) {
                inverse[row][rows[0]..rows[0] + rows.len()].copy_from_slice(&entries);
            }
        }
        let weight = weight(&matrix, &inverse);
        levels.push(Level { matrix, inverse, weight, prolongation });
        (matrix, nodes) = (coarse, above);
    }
    let inverse = inverse(&matrix);
    levels.push(Level { matrix, inverse, weight: 1.0, prolongation: Vec::new() });
    levels
}

/// One V(1,1) cycle for A x = b.
fn cycle(levels: &[Level], b: &[f64]) -> Vec<f64> {
    let Some((level, above)) = levels.split_first() else { return Vec::new() };
    if above.is_empty() {
        return apply(&level.inverse, b);
    }
    let residual = |x: &[f64]| -> Vec<f64> {
        apply(&level.matrix, x).iter().zip(b).map(|(image, b)| b - image).collect()
    };
    let smoothed = |r: &[f64]| apply(&level.inverse, r).into_iter().map(|z| level.weight * z);
    let mut x: Vec<f64> = smoothed(b).collect();
    let coarse = cycle(above, &transposed_apply(&level.prolongation, &residual(&x)));
    x.iter_mut().zip(apply(&level.prolongation, &coarse)).for_each(|(x, add)| *x += add);
    let r = residual(&x);
    x.iter_mut().zip(smoothed(&r)).for_each(|(x, add)| *x += add);
    x
}

/// w = min(1, 4/3 0.9 / lambda).
fn weight(matrix: &Dense, inverse: &Dense) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x: Vec<f64> = (0..matrix.len()).map(scattered).collect();
    let mut largest = 1.0_f64;
    for _ in 0..POWER_STEPS {
        let z = apply(matrix, &x);
        let w = apply(inverse, &z);
        let (upper, lower) = (dot(&w, &z), dot(&x, &z));
        if !(upper > 0.0 && lower > 0.0 && upper.is_finite()) {
            break;
        }
        largest = largest.max(upper / lower);
        x = w.iter().map(|w| w / upper.sqrt()).collect();
    }
    (4.0 / 3.0 * 0.9 / largest).min(1.0)
}

/// Numbers between -1 and 1 without order: the fixed vector of the power iteration.
fn scattered(index: usize) -> f64 {
    let mixed = (index as u32).wrapping_mul(2_654_435_761).wrapping_add(1_013_904_223);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519);
    f64::from((mixed ^ (mixed >> 13)) >> 8) / f64::from(1_u32 << 23) - 1.0
}

/// R^-1 and R^-T G of a Gram matrix G = R^T R, columns that depend on those before left out.
fn modes(gram: &Dense) -> (Dense, Dense) {
    let largest = |from: usize| (from..from + 3).fold(0.0_f64, |m, k| m.max(gram[k][k]));
    let mut r = zeros(6);
    for k in 0..6 {
        for j in (0..k).filter(|&j| r[j][j] != 0.0).collect::<Vec<_>>() {
            let known: f64 = (0..j).map(|i| r[i][j] * r[i][k]).sum();
            r[j][k] = (gram[j][k] - known) / r[j][j];
        }
        let left = gram[k][k] - (0..k).map(|j| r[j][k] * r[j][k]).sum::<f64>();
        if left > RANK_MIN * largest(k / 3 * 3) {
            r[k][k] = left.sqrt();
        } else {
            r.iter_mut().for_each(|row| row[k] = 0.0);
        }
    }
    let mut motions = zeros(6);
    for k in (0..6).filter(|&k| r[k][k] != 0.0) {
        motions[k][k] = 1.0 / r[k][k];
        for j in (0..k).rev().filter(|&j| r[j][j] != 0.0) {
            let sum: f64 = (j + 1..=k).map(|i| r[j][i] * motions[i][k]).sum();
            motions[j][k] = -sum / r[j][j];
        }
    }
    let unknowns = transposed_product(&motions, gram);
    (motions, unknowns)
}

/// The inverse of a symmetric matrix by way of d A d = L L^T with unit diagonal, pivots without anything left counted as 1.
#[allow(clippy::needless_range_loop, reason = "indices are those of the formulas")]
fn inverse(matrix: &Dense) -> Dense {
    let size = matrix.len();
    let scale: Vec<f64> = (0..size)
        .map(|k| matrix[k][k])
        .map(|entry| if entry > 0.0 && entry.is_finite() { 1.0 / entry.sqrt() } else { 1.0 })
        .collect();
    let mut factor = zeros(size);
    for k in 0..size {
        for i in k..size {
            let known: f64 = (0..k).map(|j| factor[i][j] * factor[k][j]).sum();
            let entry = scale[i] * scale[k] * matrix[k][i] - known;
            factor[i][k] = if i > k {
                entry / factor[k][k]
            } else if entry > PIVOT_MIN {
                entry.sqrt()
            } else {
                1.0
            };
        }
    }
    // Rows of L^-1: w_i = (e_i - sum over j < i of L_ij w_j) / L_ii.
    let mut rows = zeros(size);
    for i in 0..size {
        for k in 0..=i {
            let known: f64 = (k..i).map(|j| factor[i][j] * rows[j][k]).sum();
            rows[i][k] = (f64::from(u8::from(i == k)) - known) / factor[i][i];
        }
    }
    let squares = transposed_product(&rows, &rows);
    (0..size).map(|i| (0..size).map(|j| scale[i] * squares[i][j] * scale[j]).collect()).collect()
}

fn zeros(size: usize) -> Dense {
    vec![vec![0.0; size]; size]
}

fn put(matrix: &mut Dense, [i, j]: [usize; 2], block: Matrix<f64>) {
    for (row, entries) in block.0.iter().enumerate() {
        matrix[3 * i + row][3 * j..3 * j + 3].copy_from_slice(&entries.0);
    }
}

fn part(matrix: &Dense, rows: &[usize]) -> Dense {
    rows.iter().map(|&row| rows.iter().map(|&column| matrix[row][column]).collect()).collect()
}

fn add(to: &mut Dense, from: &Dense) {
    for (to, from) in to.iter_mut().flatten().zip(from.iter().flatten()) {
        *to += from;
    }
}

/// a b.
fn product(a: &Dense, b: &Dense) -> Dense {
    let width = b.first().map_or(0, Vec::len);
    let row = |a: &Vec<f64>| {
        let mut sum = vec![0.0; width];
        for (a, b) in a.iter().zip(b).filter(|(a, _)| **a != 0.0) {
            sum.iter_mut().zip(b).for_each(|(sum, b)| *sum += a * b);
        }
        sum
    };
    a.iter().map(row).collect()
}

/// a^T b.
fn transposed_product(a: &Dense, b: &Dense) -> Dense {
    let columns = a.first().map_or(0, Vec::len);
    let turned = (0..columns).map(|k| a.iter().map(|row| row[k]).collect()).collect();
    product(&turned, b)
}

fn apply(matrix: &Dense, x: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

fn transposed_apply(matrix: &Dense, x: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; matrix.first().map_or(0, Vec::len)];
    for (row, x) in matrix.iter().zip(x) {
        sum.iter_mut().zip(row).for_each(|(sum, a)| *sum += a * x);
    }
    sum
}

fn mean(points: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let points: Vec<_> = points.collect();
    std::array::from_fn(|axis| {
        points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64
    })
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// [I, -[d]_x].
fn point_motion([x, y, z]: [f64; 3]) -> Dense {
    vec![
        vec![1.0, 0.0, 0.0, 0.0, z, -y],
        vec![0.0, 1.0, 0.0, -z, 0.0, x],
        vec![0.0, 0.0, 1.0, y, -x, 0.0],
    ]
}

/// Motions about a centre as those about a point at the distance d from it.
fn moved_motion(d: [f64; 3]) -> Dense {
    let mut motion = point_motion(d);
    motion.extend((3..6).map(|k| (0..6).map(|l| f64::from(u8::from(k == l))).collect()));
    motion
}
