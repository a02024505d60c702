//! Groups of groups: their matrices, and what smooths them.

use rayon::prelude::*;

use crate::GroupHierarchy;

use super::{
    block_factors::{BlockFactors, DenseRows, Workspace},
    cycle::{Smoothing, UNKNOWNS},
    node_matrix::NodeMatrix,
    rigid_modes::{Matrix6, Modes, ZERO6, centre, moved_motion, product, transposed_product_add},
};

/// Steps of the power iteration that finds how far smoothing may go.
const POWER_STEPS: usize = 8;

/// The share of the largest eigenvalue that the power iteration is taken to have found at least.
const POWER_FOUND: f64 = 0.9;

/// Smoothing takes this over the largest eigenvalue: it converges below 2, and 4/3 damps the upper half of all best.
const DAMPING: f64 = 4.0 / 3.0;

/// Unknowns of a run of smoothed nodes.
const RUN: usize = UNKNOWNS * GroupHierarchy::SMOOTHED;

/// Runs in one task.
const TASK: usize = 2;

/// Nodes with six unknowns each: their matrix, what smooths it, and how the next level moves them.
#[derive(Debug)]
pub struct CoarseLevel {
    matrix: NodeMatrix,
    /// Of runs of nodes, or of all nodes on the last level.
    factors: BlockFactors,
    /// Of the whole matrix, row by row, on the last level.
    inverse: Vec<f64>,
    /// Weight of the smoother.
    weight: f64,
    /// Nothing on the last level.
    grouped: Grouped,
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
        level.weight = level.weight_find(arch);
        level.grouped = grouped;
        level
    }

    /// The last level, with its inverse.
    fn last(matrix: NodeMatrix, arch: pulp::Arch) -> Self {
        let all = matrix.len().max(1);
        let mut level = Self::factorised(matrix, all, arch);
        level.inverse = level.factors.inverse(0, arch);
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
        Self { matrix, factors, inverse: Vec::new(), weight: 1.0, grouped: Grouped::default() }
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
    pub const fn factors(&self) -> &BlockFactors {
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

    /// Whether it is the last one.
    #[must_use]
    pub const fn is_last(&self) -> bool {
        self.grouped.starts.is_empty()
    }

    /// Rows of the inverse from one on, as many as `to` has entries, times b.
    pub(super) fn inverse_product(&self, row: usize, b: &[f64], to: &mut [f64], arch: pulp::Arch) {
        let rows = &self.inverse[row * b.len()..(row + to.len()) * b.len()];
        arch.dispatch(DenseRows { rows, x: b, to });
    }

    /// The weight with which smoothing converges: from the largest eigenvalue of S A, S what the factors are, by
    /// power iteration from a fixed vector, with quotients w z / x z, z = A x, w = S z, which never fall.
    fn weight_find(&self, arch: pulp::Arch) -> f64 {
        let size = 6 * self.matrix.len();
        let mut x: Vec<f64> = (0..size).map(scattered).collect();
        let (mut image, mut next) = (vec![0.0; size], vec![0.0; size]);
        let mut largest = 1.0_f64;
        for _ in 0..POWER_STEPS {
            self.matrix.apply(&x, &mut image, arch);
            let runs = next.par_chunks_mut(RUN).zip(image.par_chunks(RUN)).enumerate();
            runs.with_min_len(TASK).for_each(|(run, (x, b))| {
                arch.dispatch(Smoothing { level: self, run, b, x, weight: 1.0 });
            });
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
