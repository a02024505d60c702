//! One V(1,1) cycle over groups of groups, in steps. The chunks of a step may be done in any order and by any threads: each writes what is its
//! own alone, and reads what steps before have written.

use std::ops::Range;

use pulp::{NullaryFnOnce, Simd, WithSimd};

use super::{
    CoarseLevel, Schwarz,
    block_factors::SCRATCH,
    lanes::{add_product, tree, widen},
    members,
};
use crate::{GroupHierarchy, Real};

/// Unknowns of a node.
pub(super) const UNKNOWNS: usize = 6;

/// Nodes of the last level in one chunk, whose right-hand side is found or which are solved for.
const LAST: usize = 4;

/// Unknowns of a run of smoothed nodes.
const SMOOTHED: usize = UNKNOWNS * GroupHierarchy::SMOOTHED;

/// Particles of a group, side by side, filled up.
const GROUP: usize = GroupHierarchy::GROUP;

/// Numbers of the particles of a group: three components, each of all particles.
const MOVED: usize = 3 * GROUP;

/// The prolongation of a group: for three components and six unknowns those of all particles.
pub(super) type GroupProlongation = [[[f32; GROUP]; UNKNOWNS]; 3];

/// A step, for the nodes of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The right-hand side from the level below or from particles, and the first smoothing, which the last level has not.
    Down(usize),
    /// The last level is solved, and moves the one below, or particles.
    Solve,
    /// The second smoothing of a level, which then moves the one below, or particles.
    Up(usize),
}

/// What a step down restricts.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a, F> {
    /// A vector by particle.
    Particles(F),
    /// The right-hand side and what was smoothed of the level below.
    Level(&'a [f64], &'a [f64]),
}

/// The vectors of a level, six numbers for each node.
#[derive(Clone, Debug, Default)]
pub struct LevelVectors {
    /// What to solve for.
    pub right_side: Vec<f64>,
    /// What the first smoothing gives, and then what the level above adds; nothing on the last level.
    pub smoothed: Vec<f64>,
    /// The solution.
    pub solution: Vec<f64>,
}

/// What a cycle works on.
#[derive(Clone, Debug, Default)]
pub struct CycleVectors {
    /// What the first level moves particles by, group by group, which [`Schwarz::moved`] takes out.
    pub moved: Vec<f64>,
    /// Of each level.
    pub levels: Vec<LevelVectors>,
}

impl Schwarz {
    /// The steps of a cycle: down through all levels, and up again.
    #[must_use]
    pub const fn step_count(&self) -> usize {
        2 * self.levels.len()
    }

    /// A step of a cycle, and nothing behind the last one.
    #[must_use]
    pub const fn step(&self, number: usize) -> Option<Step> {
        let levels = self.levels.len();
        if number < levels {
            Some(Step::Down(number))
        } else if number == levels && levels > 0 {
            Some(Step::Solve)
        } else if number < 2 * levels {
            Some(Step::Up(2 * levels - 1 - number))
        } else {
            None
        }
    }

    /// Memory for the vectors of all levels, as they are built.
    #[must_use]
    pub fn vectors(&self) -> CycleVectors {
        let levels = self.levels.iter().map(|level| {
            let zeros = || vec![0.0; UNKNOWNS * level.matrix().len()];
            let smoothed = if level.is_last() { Vec::new() } else { zeros() };
            LevelVectors { right_side: zeros(), smoothed, solution: zeros() }
        });
        CycleVectors { moved: vec![0.0; MOVED * self.packed.len()], levels: levels.collect() }
    }

    /// Chunks of a step.
    #[must_use]
    pub fn chunks(&self, step: Step) -> usize {
        let level = self.level_of(step);
        self.levels[level].matrix().len().div_ceil(self.chunk_nodes(level))
    }

    /// What a cycle moves particles by for a vector by particle, by one thread: what others are compared with.
    #[must_use]
    pub fn apply<T: Real>(&self, from: impl Fn(usize) -> [T; 3], arch: pulp::Arch) -> Vec<f64> {
        let CycleVectors { mut moved, mut levels } = self.vectors();
        for step in (0..).map_while(|number| self.step(number)) {
            let (below, own) = levels.split_at_mut(self.level_of(step));
            let LevelVectors { right_side, smoothed, solution } = &mut own[0];
            for chunk in 0..self.chunks(step) {
                let [own, entries_below] = self.entries(step, chunk);
                if let Step::Down(level) = step {
                    let from = match below.last() {
                        None => Source::Particles(&from),
                        Some(below) => Source::Level(&below.right_side, &below.smoothed),
                    };
                    let smoothed = smoothed.get_mut(own.clone()).unwrap_or_default();
                    let to = (&mut right_side[own], smoothed);
                    self.down((level, chunk), from, to, arch);
                } else {
                    let below = below.last_mut().map_or(&mut moved, |below| &mut below.smoothed);
                    let to = (&mut solution[own], &mut below[entries_below]);
                    self.up((step, chunk), (right_side, smoothed), to, arch);
                }
            }
        }
        moved
    }

    /// What a particle is moved by.
    #[inline(always)]
    #[must_use]
    pub fn moved<T: Real>(&self, particle: usize, moved: &[f64]) -> [T; 3] {
        let slot = self.slots[particle] as usize;
        let group = &moved[slot / GROUP * MOVED..][..MOVED];
        std::array::from_fn(|axis| T::from_f64(group[axis * GROUP + slot % GROUP]))
    }

    /// The entries of a chunk, and of what it moves: the nodes of the level below that are grouped in its nodes, or particles.
    #[must_use]
    pub fn entries(&self, step: Step, chunk: usize) -> [Range<usize>; 2] {
        let (nodes, below) = self.nodes(step, chunk);
        let times = |by: usize, range: &Range<usize>| by * range.start..by * range.end;
        let moved = match self.level_of(step) {
            0 => times(MOVED, &nodes),
            _ => times(UNKNOWNS, &below),
        };
        [times(UNKNOWNS, &nodes), moved]
    }

    /// The nodes of a chunk, and those of the level below that are grouped in these.
    fn nodes(&self, step: Step, chunk: usize) -> (Range<usize>, Range<usize>) {
        let level = self.level_of(step);
        let nodes = self.chunk_nodes(level);
        let range = chunk * nodes..self.levels[level].matrix().len().min((chunk + 1) * nodes);
        let below = level.checked_sub(1).map_or(0..0, |below| {
            let starts = self.levels[below].starts();
            starts[range.start] as usize..starts[range.end] as usize
        });
        (range, below)
    }

    /// A chunk of a step down: writes its right-hand side, and what is smoothed of it unless the level is the last one. What it reads of the
    /// level below is whole.
    pub fn down<T: Real>(
        &self,
        (level, chunk): (usize, usize),
        from: Source<'_, impl Fn(usize) -> [T; 3]>,
        (right_side, smoothed): (&mut [f64], &mut [f64]),
        arch: pulp::Arch,
    ) {
        let (groups, _) = self.nodes(Step::Down(level), chunk);
        match from {
            Source::Level(b, x) => {
                self.levels[level - 1].restrict(groups, (b, x), right_side, arch);
            }
            Source::Particles(vector) => self.restrict(groups, vector, right_side, arch),
        }
        let own = &self.levels[level];
        if !own.is_last() {
            let (b, weight) = (&*right_side, own.weight());
            arch.dispatch(Smoothing { level: own, run: chunk, b, x: smoothed, weight });
        }
    }

    /// A chunk of another step: writes its solution, and adds to what was smoothed of the nodes below or writes what particles are moved by. It reads
    /// the right-hand side and what was smoothed of its level, both whole.
    pub fn up(
        &self,
        (step, chunk): (Step, usize),
        (right_side, smoothed): (&[f64], &[f64]),
        (solution, below): (&mut [f64], &mut [f64]),
        arch: pulp::Arch,
    ) {
        let (nodes, nodes_below) = self.nodes(step, chunk);
        let at = self.level_of(step);
        let level = &self.levels[at];
        if level.is_last() {
            level.inverse_product(UNKNOWNS * nodes.start, right_side, solution, arch);
        } else {
            let b = &right_side[UNKNOWNS * nodes.start..UNKNOWNS * nodes.end];
            arch.dispatch(Correction { level, run: chunk, b, x: smoothed, solution });
        }
        let coarse = &*solution;
        match at.checked_sub(1) {
            Some(at) => {
                let level = &self.levels[at];
                arch.dispatch(Prolongation { level, nodes: nodes_below, coarse, x: below });
            }
            None => {
                let prolongation = &self.packed[nodes];
                arch.dispatch(ParticleProlongation { prolongation, coarse, moved: below });
            }
        }
    }

    /// The level of a step.
    #[must_use]
    pub fn level_of(&self, step: Step) -> usize {
        match step {
            Step::Down(level) | Step::Up(level) => level,
            Step::Solve => self.levels.len() - 1,
        }
    }

    fn chunk_nodes(&self, level: usize) -> usize {
        if self.levels[level].is_last() { LAST } else { GroupHierarchy::SMOOTHED }
    }

    /// P^T of a vector by particle, for some groups.
    fn restrict<T: Real>(
        &self,
        groups: Range<usize>,
        from: impl Fn(usize) -> [T; 3],
        right_side: &mut [f64],
        arch: pulp::Arch,
    ) {
        for (group, right_side) in groups.zip(right_side.as_chunks_mut().0) {
            let particles = members(&self.hierarchy, group);
            let prolongation = &self.packed[group];
            arch.dispatch(Restriction { prolongation, particles, from: &from, right_side });
        }
    }
}

impl CoarseLevel {
    /// P^T (b - A x) for some groups of its nodes: the right-hand side of the level above.
    fn restrict(
        &self,
        groups: Range<usize>,
        (b, x): (&[f64], &[f64]),
        right_side: &mut [f64],
        arch: pulp::Arch,
    ) {
        arch.dispatch(NodeRestriction { level: self, groups, b, x, right_side });
    }
}

/// P^T of a vector on one group.
struct Restriction<'a, 'b, F> {
    prolongation: &'a GroupProlongation,
    particles: &'a [u32],
    from: &'a F,
    right_side: &'b mut [f64; UNKNOWNS],
}

impl<T: Real, F: Fn(usize) -> [T; 3]> WithSimd for Restriction<'_, '_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { prolongation, particles, from, right_side } = self;
        let mut vector = [[0.0; GROUP]; 3];
        for (place, &particle) in particles.iter().enumerate() {
            let entries = from(particle as usize);
            (0..3).for_each(|axis| vector[axis][place] = entries[axis].to_f64());
        }
        let mut wide = [[0.0; GROUP]; UNKNOWNS];
        let mut modes = [[0.0; GROUP]; UNKNOWNS];
        for (of_axis, vector) in prolongation.iter().zip(&vector) {
            widen(of_axis.as_flattened(), wide.as_flattened_mut());
            let (vector, _) = S::as_simd_f64s(vector);
            for (modes, wide) in modes.iter_mut().zip(&wide) {
                let ((modes, _), (wide, _)) = (S::as_mut_simd_f64s(modes), S::as_simd_f64s(wide));
                for ((mode, wide), entry) in modes.iter_mut().zip(wide).zip(vector) {
                    add_product(simd, mode, *wide, *entry);
                }
            }
        }
        // A tree, as particles are side by side.
        *right_side = modes.map(tree);
    }
}

/// P coarse on the particles of some groups.
struct ParticleProlongation<'a, 'b> {
    prolongation: &'a [GroupProlongation],
    coarse: &'a [f64],
    moved: &'b mut [f64],
}

impl WithSimd for ParticleProlongation<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { prolongation, coarse, moved } = self;
        let groups = prolongation.iter().zip(coarse.as_chunks::<UNKNOWNS>().0);
        let mut wide = [[0.0; GROUP]; UNKNOWNS];
        for ((prolongation, coarse), moved) in groups.zip(moved.as_chunks_mut::<MOVED>().0) {
            for (of_axis, moved) in prolongation.iter().zip(moved.as_chunks_mut::<GROUP>().0) {
                widen(of_axis.as_flattened(), wide.as_flattened_mut());
                moved.fill(0.0);
                let (moved, _) = S::as_mut_simd_f64s(moved);
                for (wide, coarse) in wide.iter().zip(coarse) {
                    let ((wide, _), coarse) = (S::as_simd_f64s(wide), simd.splat_f64s(*coarse));
                    for (moved, wide) in moved.iter_mut().zip(wide) {
                        add_product(simd, moved, *wide, coarse);
                    }
                }
            }
        }
    }
}

/// P^T (b - A x) on some groups of nodes.
struct NodeRestriction<'a, 'b> {
    level: &'a CoarseLevel,
    groups: Range<usize>,
    b: &'a [f64],
    x: &'a [f64],
    right_side: &'b mut [f64],
}

impl NullaryFnOnce for NodeRestriction<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { level, groups, b, x, right_side } = self;
        let (starts, prolongation) = (level.starts(), level.prolongation());
        for (group, coarse) in groups.zip(right_side.as_chunks_mut::<UNKNOWNS>().0) {
            *coarse = [0.0; UNKNOWNS];
            for node in starts[group] as usize..starts[group + 1] as usize {
                let image = level.matrix().row_product(node, x);
                let mut of_node = [0.0; UNKNOWNS];
                for (k, row) in prolongation[node].iter().enumerate() {
                    let residual = b[UNKNOWNS * node + k] - image[k];
                    (0..UNKNOWNS).for_each(|l| of_node[l] += row[l] * residual);
                }
                (0..UNKNOWNS).for_each(|k| coarse[k] += of_node[k]);
            }
        }
    }
}

/// x = weight Z b on a run of nodes.
pub(super) struct Smoothing<'a, 'b> {
    pub(super) level: &'a CoarseLevel,
    pub(super) run: usize,
    pub(super) b: &'a [f64],
    pub(super) x: &'b mut [f64],
    pub(super) weight: f64,
}

impl WithSimd for Smoothing<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { level, run, b, x, weight } = self;
        let mut scratch = [0.0; SCRATCH * SMOOTHED];
        level.factors().apply(simd, run, (b, x), &mut scratch);
        x.iter_mut().for_each(|x| *x *= weight);
    }
}

/// Solution = x + w Z (b - A x) on a run of nodes.
struct Correction<'a, 'b> {
    level: &'a CoarseLevel,
    run: usize,
    b: &'a [f64],
    x: &'a [f64],
    solution: &'b mut [f64],
}

impl WithSimd for Correction<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { level, run, b, x, solution } = self;
        let mut residual = [0.0; SMOOTHED];
        let residual = &mut residual[..b.len()];
        let first = run * GroupHierarchy::SMOOTHED;
        let rows = residual.as_chunks_mut::<UNKNOWNS>().0.iter_mut();
        for ((node, r), b) in (first..).zip(rows).zip(b.as_chunks::<UNKNOWNS>().0) {
            let image = level.matrix().row_product(node, x);
            *r = std::array::from_fn(|k| b[k] - image[k]);
        }
        let mut scratch = [0.0; SCRATCH * SMOOTHED];
        level.factors().apply(simd, run, (residual, solution), &mut scratch);
        let x = &x[UNKNOWNS * first..];
        solution
            .iter_mut()
            .zip(x)
            .for_each(|(solution, x)| *solution = level.weight() * *solution + x);
    }
}

/// x += P coarse on some nodes.
struct Prolongation<'a, 'b> {
    level: &'a CoarseLevel,
    nodes: Range<usize>,
    coarse: &'a [f64],
    x: &'b mut [f64],
}

impl NullaryFnOnce for Prolongation<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { level, nodes, coarse, x } = self;
        let Some(&first) = level.group_of().get(nodes.start) else { return };
        let motions = &level.prolongation()[nodes.clone()];
        let groups = &level.group_of()[nodes];
        for ((motion, group), x) in motions.iter().zip(groups).zip(x.as_chunks_mut::<UNKNOWNS>().0)
        {
            let coarse = &coarse[UNKNOWNS * (group - first) as usize..][..UNKNOWNS];
            for (x, row) in x.iter_mut().zip(motion) {
                *x += (0..UNKNOWNS).fold(0.0, |sum, k| sum + row[k] * coarse[k]);
            }
        }
    }
}
