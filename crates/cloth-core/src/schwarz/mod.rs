//! NUMERICS §5: the preconditioner `schwarz`, in two levels of which the upper one is solved by a V-cycle.
//!
//! It is built here, from a matrix that a backend gives as [`Rows`], and applied here for a processor, in [`Step`]s that threads share; a GPU applies
//! it with kernels of its own, to the same tables.
//!
//! What single particles add is the preconditioner `block`, which every backend has anyway; here is what rigid motions of groups add.
//!
//! Data layout, the same for all backends: particles stand in the order of [`GroupHierarchy`]; each has the three rows of its prolongation, six
//! numbers each. Above, a node has six unknowns, and all matrices are blocks of 6 x 6. Runs of nodes have the rows of inverse factors
//! ([`BlockFactors`]).

#![allow(clippy::needless_range_loop, reason = "indices are those of the formulas")]

mod block_factors;
mod coarse_level;
mod copy;
mod cycle;
mod lanes;
mod node_matrix;
mod pattern;
mod reuse;
mod rigid_modes;
mod rows;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::GroupHierarchy;

pub use block_factors::BlockFactors;
pub use coarse_level::CoarseLevel;
use coarse_level::Nodes;
pub use copy::{ContactRow, ContactRows, ElementRows, MatrixCopy, PairRows};
use cycle::GroupProlongation;
pub use cycle::{CycleVectors, LevelVectors, Source, Step};
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

/// The preconditioner of the matrix that it was built for: what rigid motions of groups of particles add to it.
#[derive(Debug)]
pub struct Schwarz {
    hierarchy: GroupHierarchy,
    /// The place of each particle in the order of the hierarchy, and its group.
    places: Vec<u32>,
    group_of: Vec<u32>,
    /// What unit unknowns of its group do to the particle at each place, S included.
    prolongation: Vec<[[f32; 6]; 3]>,
    /// The same as a processor applies it, and the slot of each particle there. Nothing where a device has built it.
    packed: Vec<GroupProlongation>,
    slots: Vec<u32>,
    levels: Vec<CoarseLevel>,
    /// The filters that it was built with, xx, yy, zz, xy, xz, yz.
    filters: Vec<[f32; 6]>,
}

/// It is built anew where an entry of a filter has changed by more: a contact with a collider has come or gone, or its
/// normal has turned by six degrees.
const FILTER_CHANGE: f32 = 0.1;

/// The filter of free particles.
pub const FREE: [f32; 6] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// Which couplings the coarse matrices have: all but in a negative control.
type Couplings = fn(Coupling) -> bool;

impl Schwarz {
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
        Self {
            prolongation: vec![[[0.0; 6]; 3]; count],
            packed: Vec::new(),
            slots: Vec::new(),
            levels: Vec::new(),
            filters: vec![FREE; count],
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
        self.build_with(rows, |_| true, arch);
    }

    /// Builds it for other filters than those before, if there are. Returns whether anything was built.
    ///
    /// S P^-1 S is positive with the filters of before, too, but good for nothing: particles that colliders let go have no part in the motions of
    /// their groups, and those that they hold now do.
    pub fn update(&mut self, rows: &impl Rows, arch: pulp::Arch) -> bool {
        let builds = self.is_outdated(|particle| packed(rows, particle));
        if builds {
            self.build(rows, arch);
        }
        builds
    }

    /// Whether [`Self::update`] builds anything for these filters, xx, yy, zz, xy, xz, yz.
    pub fn is_outdated(&self, filter: impl Fn(u32) -> [f32; 6]) -> bool {
        (self.filters.iter().zip(0_u32..)).any(|(built, particle)| {
            let now = filter(particle);
            now.iter().zip(built).any(|(now, built)| (now - built).abs() > FILTER_CHANGE)
        })
    }

    /// Takes in what a device has built: the coarse matrix of groups, their centres, and the unknowns of rigid motions; builds the levels above.
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

    /// Notes the filters that it was built with.
    fn filters_note(&mut self, filter: impl Fn(u32) -> [f32; 6]) {
        (self.filters.iter_mut().zip(0_u32..))
            .for_each(|(built, particle)| *built = filter(particle));
    }

    fn build_with(&mut self, rows: &impl Rows, couplings: Couplings, arch: pulp::Arch) {
        self.filters_note(|particle| packed(rows, particle));
        let nodes = self.modes_find(rows);
        self.pack();
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

    /// The prolongation with particles of a group side by side.
    fn pack(&mut self) {
        let Self { hierarchy, prolongation, packed, slots, places, group_of, .. } = self;
        let starts = &hierarchy.levels()[0];
        if slots.is_empty() {
            packed.resize(starts.len() - 1, [[[0.0; GroupHierarchy::GROUP]; 6]; 3]);
            slots.extend(places.iter().zip(&*group_of).map(|(place, &group)| {
                GroupHierarchy::GROUP as u32 * group + place - starts[group as usize]
            }));
        }
        let groups = packed.par_iter_mut().zip(starts.par_windows(2)).with_min_len(TASK);
        groups.for_each(|(packed, ends)| {
            let particles = &prolongation[ends[0] as usize..ends[1] as usize];
            for (lane, rows) in particles.iter().enumerate() {
                for (packed, row) in packed.iter_mut().zip(rows) {
                    (0..6).for_each(|k| packed[k][lane] = row[k]);
                }
            }
        });
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
