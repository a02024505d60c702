//! NUMERICS §5: the preconditioner `schwarz`, in two levels of which the upper one is solved by a V-cycle.
//!
//! It is built here, from a matrix that a backend gives as [`Rows`], and applied here for a processor; a GPU applies it with
//! kernels of its own, to the same tables.
//!
//! Data layout, the same for all backends: particles stand in the order of [`GroupHierarchy`]; unknown 3 s + axis is that of the
//! particle at place s. Each group has the rows of its inverse factor ([`BlockFactors`]), each particle the three rows of its
//! prolongation, six numbers each. Above, a node has six unknowns, and all matrices are blocks of 6 x 6.

#![allow(clippy::needless_range_loop, reason = "indices are those of the formulas")]

mod block_factors;
mod coarse_level;
mod copy;
mod node_matrix;
mod pattern;
mod reuse;
mod rigid_modes;
mod rows;
#[cfg(test)]
mod tests;

use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::{GroupHierarchy, Real};

pub use block_factors::BlockFactors;
use block_factors::{SCRATCH, Workspace};
pub use coarse_level::CoarseLevel;
use coarse_level::{Nodes, cycle};
pub use copy::{ContactRow, ContactRows, ElementRows, MatrixCopy, PairRows};
pub use node_matrix::NodeMatrix;
use node_matrix::{RowSum, UpperRow, congruent};
pub use pattern::GroupPattern;
/// The instructions that a processor has.
pub use pulp::Arch;
pub use reuse::Reuse;
pub use rigid_modes::Matrix6;
use rigid_modes::{Modes, ZERO6, centre, point_motion, product, transposed_product_add};
pub use rows::{Block, Coupling, Rows, rank_one, symmetric};

/// Groups in one task.
const TASK: usize = 16;

/// The preconditioner of the matrix that it was built for.
#[derive(Debug)]
pub struct Schwarz<T> {
    hierarchy: GroupHierarchy,
    /// The place of each particle in the order of the hierarchy, and its group.
    places: Vec<u32>,
    group_of: Vec<u32>,
    factors: BlockFactors<T>,
    /// What unit unknowns of its group do to the particle at each place, S included.
    prolongation: Vec<[[f32; 6]; 3]>,
    levels: Vec<CoarseLevel>,
    /// What the factors of groups make of a vector, group by group.
    local: Vec<[[T; 3]; GroupHierarchy::GROUP]>,
    /// The filters that the factors of groups were built with, xx, yy, zz, xy, xz, yz.
    filters: Vec<[f32; 6]>,
    /// Groups to factorise.
    outdated: Vec<bool>,
}

/// Factors are built anew where an entry of a filter has changed by more: a contact with a collider has come or gone, or its
/// normal has turned by six degrees.
const FILTER_CHANGE: f32 = 0.1;

/// The filter of free particles.
pub const FREE: [f32; 6] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// Which couplings the coarse matrices have: all but in a negative control.
type Couplings = fn(Coupling) -> bool;

impl<T: Real> Schwarz<T> {
    /// The tables for groups, nothing built yet.
    #[must_use]
    pub fn new(hierarchy: GroupHierarchy) -> Self {
        let order = hierarchy.order();
        let count = order.len();
        let (mut places, mut group_of) = (vec![0; count], vec![0; count]);
        for (place, &particle) in order.iter().enumerate() {
            places[particle as usize] = place as u32;
        }
        let starts = &hierarchy.levels()[0];
        for (group, ends) in starts.windows(2).enumerate() {
            for &particle in &order[ends[0] as usize..ends[1] as usize] {
                group_of[particle as usize] = group as u32;
            }
        }
        let sizes = starts.windows(2).map(|ends| 3 * (ends[1] - ends[0]) as usize);
        Self {
            factors: BlockFactors::new(sizes),
            prolongation: vec![[[0.0; 6]; 3]; count],
            levels: Vec::new(),
            local: vec![[[T::ZERO; 3]; GroupHierarchy::GROUP]; starts.len() - 1],
            filters: vec![FREE; count],
            outdated: vec![true; starts.len() - 1],
            places,
            group_of,
            hierarchy,
        }
    }

    /// Particles.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Builds it for a matrix.
    pub fn build(&mut self, rows: &impl Rows, arch: pulp::Arch) {
        self.outdated.fill(true);
        self.build_with(rows, |_| true, arch);
    }

    /// Builds it for other filters than those before, if there are: factors of the groups that have them, and all levels above. The
    /// other groups keep their factors. Returns whether anything was built.
    ///
    /// S P^-1 S is positive with the filters of before, too, but good for nothing: particles that colliders let go move alone, and
    /// those that they hold now do so as if the cloth around them were soft.
    pub fn update(&mut self, rows: &impl Rows, arch: pulp::Arch) -> bool {
        let builds = self.is_outdated(|particle| packed(rows, particle));
        if builds {
            self.build_with(rows, |_| true, arch);
        }
        builds
    }

    /// Whether [`Self::update`] builds anything for these filters, xx, yy, zz, xy, xz, yz.
    pub fn is_outdated(&mut self, filter: impl Fn(u32) -> [f32; 6]) -> bool {
        let Self { hierarchy, outdated, filters, .. } = self;
        for (group, outdated) in outdated.iter_mut().enumerate() {
            *outdated = members(hierarchy, group).iter().any(|&particle| {
                let (now, built) = (filter(particle), filters[particle as usize]);
                now.iter().zip(built).any(|(now, built)| (now - built).abs() > FILTER_CHANGE)
            });
        }
        self.outdated.contains(&true)
    }

    /// Whether the factor of each group is to be built: all of them, or what [`Self::is_outdated`] has found.
    pub fn outdated(&mut self, all: bool) -> &[bool] {
        if all {
            self.outdated.fill(true);
        }
        &self.outdated
    }

    /// Takes in what a device has built, of whose factors those of [`Self::outdated`] are new: the coarse matrix of groups, their centres,
    /// and the unknowns of rigid motions; builds the levels above.
    pub fn build_above(
        &mut self,
        matrix: NodeMatrix,
        (centres, unknowns): (Vec<[f64; 3]>, Vec<Matrix6>),
        filter: impl Fn(u32) -> [f32; 6],
        arch: pulp::Arch,
    ) {
        self.filters_note(filter);
        let groups = &self.hierarchy.levels()[1..];
        self.levels = coarse_level::levels(matrix, Nodes { centres, unknowns }, groups, arch);
    }

    /// Notes the filters that factors were built with.
    fn filters_note(&mut self, filter: impl Fn(u32) -> [f32; 6]) {
        for (group, outdated) in self.outdated.iter_mut().enumerate() {
            if std::mem::take(outdated) {
                for &particle in members(&self.hierarchy, group) {
                    self.filters[particle as usize] = filter(particle);
                }
            }
        }
    }

    /// Builds the factors of groups that are outdated, and all levels above.
    fn build_with(&mut self, rows: &impl Rows, couplings: Couplings, arch: pulp::Arch) {
        self.factorise(rows, arch);
        self.filters_note(|particle| packed(rows, particle));
        let nodes = self.modes_find(rows);
        let matrix = self.coarse_matrix(rows, couplings);
        let groups = &self.hierarchy.levels()[1..];
        self.levels = coarse_level::levels(matrix, nodes, groups, arch);
    }

    /// The particles, those of a group one after the other.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        self.hierarchy.order()
    }

    /// Where the particles of each group start, and the end.
    #[must_use]
    pub fn group_starts(&self) -> &[u32] {
        &self.hierarchy.levels()[0]
    }

    /// The group of each particle.
    #[must_use]
    pub fn group_of(&self) -> &[u32] {
        &self.group_of
    }

    /// The place of each particle in [`Self::order`].
    #[must_use]
    pub fn places(&self) -> &[u32] {
        &self.places
    }

    /// The inverses of the blocks of groups.
    #[must_use]
    pub const fn factors(&self) -> &BlockFactors<T> {
        &self.factors
    }

    /// For each place what unit unknowns of its group do there.
    #[must_use]
    pub fn prolongation(&self) -> &[[[f32; 6]; 3]] {
        &self.prolongation
    }

    /// All levels of groups, the last of which has few nodes. None before anything is built.
    #[must_use]
    pub fn levels(&self) -> &[CoarseLevel] {
        &self.levels
    }

    fn particles(&self, group: usize) -> &[u32] {
        members(&self.hierarchy, group)
    }

    fn group_count(&self) -> usize {
        self.hierarchy.levels()[0].len() - 1
    }

    /// The inverse factors of the blocks of groups of S A S + tr(D) (I - S).
    fn factorise(&mut self, rows: &impl Rows, arch: pulp::Arch) {
        let Self { hierarchy, places, group_of, factors, outdated, .. } = self;
        let (hierarchy, places, group_of) = (&*hierarchy, &*places, &*group_of);
        factors.tasks().into_par_iter().enumerate().with_min_len(TASK).for_each_init(
            Workspace::default,
            |work, (group, mut task)| {
                if !outdated[group] {
                    return;
                }
                let particles = members(hierarchy, group);
                work.begin(3 * particles.len());
                let first = hierarchy.levels()[0][group] as usize;
                for (local, &particle) in particles.iter().enumerate() {
                    let i = particle as usize;
                    let filter = rows.filter(i);
                    let mut diagonal = rows.base(i);
                    rows.row(i, &mut |j, block, _| {
                        diagonal_subtract(&mut diagonal, &block);
                        let other = places[j] as usize;
                        if group_of[j] as usize == group && other > first + local {
                            let block = filtered(&block, filter.as_ref(), rows.filter(j).as_ref());
                            let other = other - first;
                            entries(&block, |k, l, entry| {
                                work.add(3 * local + k, 3 * other + l, entry);
                            });
                        }
                    });
                    let block = restricted(&diagonal, filter.as_ref());
                    entries(&block, |k, l, entry| {
                        if k <= l {
                            work.add(3 * local + k, 3 * local + l, entry);
                        }
                    });
                }
                task.factorise(work, arch);
            },
        );
    }

    /// The rigid modes of groups, and the groups as nodes.
    fn modes_find(&mut self, rows: &impl Rows) -> Nodes {
        let Self { hierarchy, prolongation, .. } = self;
        let starts = &hierarchy.levels()[0];
        let mut rest = prolongation.as_mut_slice();
        let of_groups: Vec<_> = starts
            .windows(2)
            .map(|ends| rest.split_off_mut(..(ends[1] - ends[0]) as usize).unwrap_or_default())
            .collect();
        let hierarchy = &*hierarchy;
        let modes = |(group, prolongation): (usize, &mut [[[f32; 6]; 3]])| {
            let particles = members(hierarchy, group);
            let centre = centre(particles.iter().map(|&i| rows.position(i as usize)));
            let mut gram = ZERO6;
            let mut motions = [[[0.0; 6]; 3]; GroupHierarchy::GROUP];
            let motions = &mut motions[..particles.len()];
            for (motion, &particle) in motions.iter_mut().zip(particles) {
                let place = rows.position(particle as usize);
                *motion = point_motion(std::array::from_fn(|axis| place[axis] - centre[axis]));
                if let Some(filter) = rows.filter(particle as usize) {
                    let free = *motion;
                    *motion = std::array::from_fn(|row| {
                        std::array::from_fn(|k| {
                            (0..3).fold(0.0, |sum, axis| sum + filter[row][axis] * free[axis][k])
                        })
                    });
                }
                transposed_product_add(&mut gram, motion, motion);
            }
            let modes = Modes::new(&gram);
            for (to, motion) in prolongation.iter_mut().zip(motions) {
                *to = product(motion, &modes.motions).map(|row| row.map(|entry| entry as f32));
            }
            (centre, modes.unknowns)
        };
        let nodes = of_groups.into_par_iter().enumerate().with_min_len(TASK).map(modes);
        let (centres, unknowns) = nodes.unzip();
        Nodes { centres, unknowns }
    }

    /// P^T A P.
    fn coarse_matrix(&self, rows: &impl Rows, couplings: Couplings) -> NodeMatrix {
        let upper: Vec<UpperRow> = (0..self.group_count())
            .into_par_iter()
            .with_min_len(TASK)
            .map(|group| {
                let mut sum = RowSum::new(group as u32);
                for &particle in self.particles(group) {
                    let i = particle as usize;
                    let own = self.prolongation_of(i);
                    let mut diagonal = rows.base(i);
                    rows.row(i, &mut |j, block, coupling| {
                        if !couplings(coupling) {
                            return;
                        }
                        diagonal_subtract(&mut diagonal, &block);
                        if let Some(to) = sum.block(self.group_of[j]) {
                            add(to, &congruent(&own, &block, &self.prolongation_of(j)));
                        }
                    });
                    if let Some(to) = sum.block(group as u32) {
                        add(to, &congruent(&own, &diagonal, &own));
                    }
                }
                sum.finish()
            })
            .collect();
        NodeMatrix::from_upper(&upper)
    }

    fn prolongation_of(&self, particle: usize) -> [[f64; 6]; 3] {
        self.prolongation[self.places[particle] as usize].map(|row| row.map(f64::from))
    }

    /// Finds P^-1 of a vector by particle, unfiltered, which [`Self::of`] then gives.
    pub fn apply(&mut self, from: impl Fn(usize) -> [T; 3] + Sync, arch: pulp::Arch) {
        let Some(first) = self.levels.first_mut() else { return };
        let Self { hierarchy, factors, prolongation, local, .. } = self;
        let (hierarchy, factors, from) = (&*hierarchy, &*factors, &from);
        local
            .par_iter_mut()
            .zip(first.right_side_mut().par_chunks_mut(6))
            .enumerate()
            .with_min_len(TASK)
            .for_each(|(group, (local, right_side))| {
                let start = hierarchy.levels()[0][group] as usize;
                let particles = members(hierarchy, group);
                let prolongation = &prolongation[start..][..particles.len()];
                let local = &mut local[..particles.len()];
                let task =
                    GroupTask { factors, prolongation, particles, group, from, local, right_side };
                arch.dispatch(task);
            });
        cycle(&mut self.levels);
    }

    /// What the last [`Self::apply`] has found for a particle.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, particle: usize) -> [T; 3] {
        let Some(first) = self.levels.first() else { return [T::ZERO; 3] };
        let (place, group) = (self.places[particle] as usize, self.group_of[particle] as usize);
        let coarse = &first.solution()[6 * group..][..6];
        let local = &self.local[group][place - self.hierarchy.levels()[0][group] as usize];
        std::array::from_fn(|axis| {
            let row = &self.prolongation[place][axis];
            let sum = (0..6).fold(0.0, |sum, k| sum + f64::from(row[k]) * coarse[k]);
            local[axis] + T::from_f64(sum)
        })
    }
}

/// A vector on one group: what its factor makes of it, and P^T of it, compiled for each instruction set.
struct GroupTask<'a, 'b, T, F> {
    factors: &'a BlockFactors<T>,
    prolongation: &'a [[[f32; 6]; 3]],
    particles: &'a [u32],
    group: usize,
    from: &'a F,
    local: &'b mut [[T; 3]],
    right_side: &'b mut [f64],
}

impl<T: Real, F: Fn(usize) -> [T; 3]> NullaryFnOnce for GroupTask<'_, '_, T, F> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { factors, prolongation, particles, group, from, local, right_side } = self;
        let mut vector = [[T::ZERO; 3]; GroupHierarchy::GROUP];
        let vector = &mut vector[..particles.len()];
        let mut modes = [[0.0; 6]; GroupHierarchy::GROUP];
        let all = vector.iter_mut().zip(particles).zip(prolongation).zip(&mut modes);
        for (((vector, &particle), rows), modes) in all {
            *vector = from(particle as usize);
            for (row, entry) in rows.iter().zip(*vector) {
                let entry = entry.to_f64();
                (0..6).for_each(|k| modes[k] += f64::from(row[k]) * entry);
            }
        }
        // A tree, as particles are side by side elsewhere.
        let mut half = GroupHierarchy::GROUP / 2;
        while half > 0 {
            for place in 0..half {
                (0..6).for_each(|k| modes[place][k] += modes[place + half][k]);
            }
            half /= 2;
        }
        right_side.copy_from_slice(&modes[0]);
        let mut scratch = [[T::ZERO; 3 * GroupHierarchy::GROUP]; SCRATCH];
        factors.apply(
            group,
            vector.as_flattened(),
            local.as_flattened_mut(),
            scratch.as_flattened_mut(),
        );
    }
}

fn members(hierarchy: &GroupHierarchy, group: usize) -> &[u32] {
    let starts = &hierarchy.levels()[0];
    &hierarchy.order()[starts[group] as usize..starts[group + 1] as usize]
}

/// S of a particle as it is compared.
fn packed(rows: &impl Rows, particle: u32) -> [f32; 6] {
    rows.filter(particle as usize).map_or(FREE, |s| {
        [s[0][0], s[1][1], s[2][2], s[0][1], s[0][2], s[1][2]].map(|entry| entry as f32)
    })
}

fn add(to: &mut Matrix6, block: &Matrix6) {
    for (to, entry) in to.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
        *to += entry;
    }
}

/// Takes the symmetric part of a block of the row from the diagonal.
#[inline(always)]
fn diagonal_subtract(diagonal: &mut Block, block: &Block) {
    for row in 0..3 {
        for column in 0..3 {
            diagonal[row][column] -= 0.5 * (block[row][column] + block[column][row]);
        }
    }
}

/// S_i A S_j.
#[inline(always)]
fn filtered(block: &Block, left: Option<&Block>, right: Option<&Block>) -> Block {
    let mut filtered = *block;
    if let Some(filter) = left {
        filtered = rows::product(filter, &filtered);
    }
    if let Some(filter) = right {
        filtered = rows::product(&filtered, filter);
    }
    filtered
}

/// S D S + tr(D) (I - S).
fn restricted(diagonal: &Block, filter: Option<&Block>) -> Block {
    let mut restricted = filtered(diagonal, filter, filter);
    if let Some(filter) = filter {
        let trace = diagonal[0][0] + diagonal[1][1] + diagonal[2][2];
        for (row, entries) in restricted.iter_mut().enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                *entry += trace * (f64::from(u8::from(row == column)) - filter[row][column]);
            }
        }
    }
    restricted
}

#[inline(always)]
fn entries(block: &Block, mut visit: impl FnMut(usize, usize, f64)) {
    for (k, row) in block.iter().enumerate() {
        for (l, entry) in row.iter().enumerate() {
            visit(k, l, *entry);
        }
    }
}
