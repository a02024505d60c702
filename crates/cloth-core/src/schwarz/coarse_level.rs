//! The V-cycle over groups of groups.

use rayon::prelude::*;

use crate::GroupHierarchy;

use super::{
    block_factors::{BlockFactors, SCRATCH, Workspace, dense_product},
    node_matrix::NodeMatrix,
    rigid_modes::{Matrix6, Modes, ZERO6, centre, moved_motion, product, transposed_product_add},
};

/// Steps of the power iteration that finds how far smoothing may go.
const POWER_STEPS: usize = 8;

/// The share of the largest eigenvalue that the power iteration is taken to have found at least.
const POWER_FOUND: f64 = 0.9;

/// Smoothing takes this over the largest eigenvalue: it converges below 2, and 4/3 damps the upper half of all best.
const DAMPING: f64 = 4.0 / 3.0;

/// Nodes in one task.
const TASK: usize = 64;

/// Unknowns of a run of smoothed nodes.
const SMOOTHED: usize = 6 * GroupHierarchy::SMOOTHED;

/// Runs of smoothed nodes in one task.
const SMOOTH_TASK: usize = 2;

/// Nodes with six unknowns each: their matrix, what smooths it, and how the next level moves them.
#[derive(Debug)]
pub struct CoarseLevel {
    matrix: NodeMatrix,
    /// Of runs of nodes, or of all nodes on the last level.
    factors: BlockFactors<f64>,
    /// Of the whole matrix, row by row, on the last level.
    inverse: Vec<f64>,
    /// Weight of the smoother.
    weight: f64,
    /// Nothing on the last level.
    grouped: Grouped,
    right_side: Vec<f64>,
    solution: Vec<f64>,
    residual: Vec<f64>,
}

/// Where nodes are, and how rigid motions about that place are unknowns of theirs.
pub(super) struct Nodes {
    pub(super) centres: Vec<[f64; 3]>,
    /// [`Modes::unknowns`].
    pub(super) unknowns: Vec<Matrix6>,
}

impl Nodes {
    pub(super) fn len(&self) -> usize {
        self.centres.len()
    }
}

/// All levels above the particles. `groups` are the levels of the hierarchy after the first one.
pub(super) fn levels(
    mut matrix: NodeMatrix,
    mut nodes: Nodes,
    groups: &[Vec<u32>],
    arch: pulp::Arch,
) -> Vec<CoarseLevel> {
    let mut tasks = Vec::with_capacity(groups.len() + 1);
    for starts in groups {
        let (prolongation, above) = group(&nodes, starts);
        let mut group_of = vec![0; nodes.len()];
        for (group, ends) in starts.windows(2).enumerate() {
            group_of[ends[0] as usize..ends[1] as usize].fill(group as u32);
        }
        let coarse = matrix.coarse(&prolongation, starts, &group_of);
        let grouped = Grouped { prolongation, group_of, starts: starts.clone() };
        tasks.push((std::mem::replace(&mut matrix, coarse), Some(grouped)));
        nodes = above;
    }
    tasks.push((matrix, None));
    // What smooths a level needs nothing of the others.
    let build = |(matrix, grouped)| match grouped {
        Some(grouped) => CoarseLevel::smoothed(matrix, grouped, arch),
        None => CoarseLevel::last(matrix, arch),
    };
    tasks.into_par_iter().map(build).collect()
}

/// The groups of a level: what unit unknowns of its group do to each node, the group of each node, and where the nodes of each group start.
#[derive(Debug, Default)]
struct Grouped {
    prolongation: Vec<Matrix6>,
    group_of: Vec<u32>,
    starts: Vec<u32>,
}

impl CoarseLevel {
    /// A level with the factors of runs of nodes.
    fn smoothed(matrix: NodeMatrix, grouped: Grouped, arch: pulp::Arch) -> Self {
        let mut level = Self::factorised(matrix, GroupHierarchy::SMOOTHED, arch);
        level.weight = level.weight_find();
        level.grouped = grouped;
        level
    }

    /// The last level, with its inverse.
    fn last(matrix: NodeMatrix, arch: pulp::Arch) -> Self {
        let all = matrix.len().max(1);
        let mut level = Self::factorised(matrix, all, arch);
        level.inverse = level.factors.inverse(0);
        level
    }

    /// With the factors of runs of so many nodes.
    fn factorised(matrix: NodeMatrix, run: usize, arch: pulp::Arch) -> Self {
        let count = matrix.len();
        let sizes = (0..count).step_by(run).map(|first| 6 * run.min(count - first));
        let mut factors = BlockFactors::new(sizes);
        let tasks = factors.tasks();
        tasks.into_par_iter().enumerate().for_each_init(
            Workspace::default,
            |work, (block, mut task)| {
                let nodes = block * run..count.min((block + 1) * run);
                work.begin(6 * nodes.len());
                for node in nodes.clone() {
                    for (column, entries) in matrix.row(node) {
                        if column < node || column >= nodes.end {
                            continue;
                        }
                        let [row, column] = [node, column].map(|node| 6 * (node - nodes.start));
                        for (k, entries) in entries.iter().enumerate() {
                            let first = if row == column { k } else { 0 };
                            for (l, entry) in entries.iter().enumerate().skip(first) {
                                work.add(row + k, column + l, *entry);
                            }
                        }
                    }
                }
                task.factorise(work, arch);
            },
        );
        let zeros = || vec![0.0; 6 * count];
        Self {
            matrix,
            factors,
            inverse: Vec::new(),
            weight: 1.0,
            grouped: Grouped::default(),
            right_side: zeros(),
            solution: zeros(),
            residual: zeros(),
        }
    }

    /// What unit unknowns of its group do to each node; nothing on the last level.
    #[must_use]
    pub fn prolongation(&self) -> &[Matrix6] {
        &self.grouped.prolongation
    }

    /// Where the nodes of each group start, and the end; nothing on the last level.
    #[must_use]
    pub fn starts(&self) -> &[u32] {
        &self.grouped.starts
    }

    /// The group of each node; nothing on the last level.
    #[must_use]
    pub fn group_of(&self) -> &[u32] {
        &self.grouped.group_of
    }

    /// The inverses of the blocks of runs of nodes, or of the whole matrix on the last level.
    #[must_use]
    pub const fn factors(&self) -> &BlockFactors<f64> {
        &self.factors
    }

    /// The inverse of the whole matrix, row by row, on the last level.
    #[must_use]
    pub fn inverse(&self) -> &[f64] {
        &self.inverse
    }

    /// Weight of the smoother.
    #[must_use]
    pub const fn weight(&self) -> f64 {
        self.weight
    }

    /// The matrix between the nodes.
    #[must_use]
    pub const fn matrix(&self) -> &NodeMatrix {
        &self.matrix
    }

    /// What to solve for.
    pub(super) fn right_side_mut(&mut self) -> &mut [f64] {
        &mut self.right_side
    }

    /// What [`cycle`] found.
    pub(super) fn solution(&self) -> &[f64] {
        &self.solution
    }

    /// The weight with which smoothing converges: from the largest eigenvalue of S A, S what the factors are, by
    /// power iteration from a fixed vector, with quotients w z / x z, z = A x, w = S z, which never fall.
    fn weight_find(&self) -> f64 {
        let size = 6 * self.matrix.len();
        let mut x: Vec<f64> = (0..size).map(scattered).collect();
        let (mut image, mut next) = (vec![0.0; size], vec![0.0; size]);
        let mut largest = 1.0_f64;
        for _ in 0..POWER_STEPS {
            self.matrix.residual(None, &x, &mut image);
            self.smooth(&image, 1.0, false, &mut next);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (upper, lower) = (dot(&next, &image), dot(&x, &image));
            if !(upper > 0.0 && lower > 0.0 && upper.is_finite()) {
                break;
            }
            largest = largest.max(upper / lower);
            let scale = 1.0 / upper.sqrt();
            x.iter_mut().zip(&next).for_each(|(x, next)| *x = scale * next);
        }
        (DAMPING * POWER_FOUND / largest).min(1.0)
    }

    /// x = weight S r, or x += weight S r.
    fn smooth(&self, r: &[f64], weight: f64, adds: bool, x: &mut [f64]) {
        let blocks = x.par_chunks_mut(SMOOTHED).zip(r.par_chunks(SMOOTHED)).enumerate();
        blocks.with_min_len(SMOOTH_TASK).for_each(|(block, (x, r))| {
            let (mut scratch, mut smoothed) = ([0.0; SCRATCH * SMOOTHED], [0.0; SMOOTHED]);
            let smoothed = &mut smoothed[..r.len()];
            self.factors.apply(block, r, smoothed, &mut scratch);
            for (x, smoothed) in x.iter_mut().zip(smoothed) {
                *x = weight * *smoothed + if adds { *x } else { 0.0 };
            }
        });
    }

    /// coarse = P^T r.
    fn restrict(&self, coarse: &mut [f64]) {
        coarse.par_chunks_mut(6).enumerate().with_min_len(TASK).for_each(|(group, coarse)| {
            coarse.fill(0.0);
            let Grouped { prolongation, starts, .. } = &self.grouped;
            for node in starts[group] as usize..starts[group + 1] as usize {
                let residual = &self.residual[6 * node..][..6];
                let mut of_node = [0.0; 6];
                for (row, residual) in prolongation[node].iter().zip(residual) {
                    (0..6).for_each(|k| of_node[k] += row[k] * residual);
                }
                (0..6).for_each(|k| coarse[k] += of_node[k]);
            }
        });
    }

    /// x += P coarse.
    fn prolong(&mut self, coarse: &[f64]) {
        let Self { grouped: Grouped { prolongation, group_of, .. }, solution, .. } = self;
        solution.par_chunks_mut(6).enumerate().with_min_len(TASK).for_each(|(node, x)| {
            let coarse = &coarse[6 * group_of[node] as usize..][..6];
            for (x, row) in x.iter_mut().zip(&prolongation[node]) {
                *x += (0..6).fold(0.0, |sum, k| sum + row[k] * coarse[k]);
            }
        });
    }
}

/// One V(1,1) cycle: the solution of the first level for its right-hand side, but for an error.
pub(super) fn cycle(levels: &mut [CoarseLevel]) {
    let Some((level, above)) = levels.split_first_mut() else { return };
    let mut solution = std::mem::take(&mut level.solution);
    if above.is_empty() {
        dense_product(&level.inverse, &level.right_side, &mut solution);
        level.solution = solution;
        return;
    }
    let mut residual = std::mem::take(&mut level.residual);
    level.smooth(&level.right_side, level.weight, false, &mut solution);
    level.matrix.residual(Some(&level.right_side), &solution, &mut residual);
    (level.solution, level.residual) = (solution, residual);
    level.restrict(above[0].right_side_mut());
    cycle(above);
    level.prolong(above[0].solution());
    (solution, residual) =
        (std::mem::take(&mut level.solution), std::mem::take(&mut level.residual));
    level.matrix.residual(Some(&level.right_side), &solution, &mut residual);
    level.smooth(&residual, level.weight, true, &mut solution);
    (level.solution, level.residual) = (solution, residual);
}

/// How the rigid modes of groups move their nodes, and the groups as nodes.
fn group(nodes: &Nodes, starts: &[u32]) -> (Vec<Matrix6>, Nodes) {
    let mut prolongation = Vec::with_capacity(nodes.len());
    let mut above = Nodes { centres: Vec::new(), unknowns: Vec::new() };
    for ends in starts.windows(2) {
        let range = ends[0] as usize..ends[1] as usize;
        let centre = centre(nodes.centres[range.clone()].iter().copied());
        let first = prolongation.len();
        let mut gram = ZERO6;
        for node in range {
            let distance = std::array::from_fn(|axis| nodes.centres[node][axis] - centre[axis]);
            let motion = product(&nodes.unknowns[node], &moved_motion(distance));
            transposed_product_add(&mut gram, &motion, &motion);
            prolongation.push(motion);
        }
        let Modes { motions, unknowns } = Modes::new(&gram);
        for motion in &mut prolongation[first..] {
            *motion = product(motion, &motions);
        }
        above.centres.push(centre);
        above.unknowns.push(unknowns);
    }
    (prolongation, above)
}

/// Numbers between -1 and 1 without order.
fn scattered(index: usize) -> f64 {
    let mixed = (index as u32).wrapping_mul(2_654_435_761).wrapping_add(1_013_904_223);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519);
    f64::from((mixed ^ (mixed >> 13)) >> 8) / f64::from(1_u32 << 23) - 1.0
}
