//! What kernels are told, what they answer, and what a device has to be able to do.

use std::ops::Range;

use rayon::prelude::*;

use crate::{NewtonStart, Real, Result};

use super::super::{Candidate, ContactEquation, ContactSet, ContactSurface, UnprovenPair};

/// Pairs that a thread of the host takes out of words, at least.
const TASK: usize = 4096;

/// Triangles in a group.
pub const GROUP: usize = 8;
/// Words of a slot of a group: the number of its triangle, three corners, what belongs to it, three edges.
pub const TRIANGLE_WORDS: usize = 8;
/// Number of a triangle that is none.
pub const NO_TRIANGLE: u32 = u32::MAX;
/// Words of a pair: its particles, its features.
pub const PAIR_WORDS: usize = 6;
/// What the number of its first feature has more if both are edges.
pub const EDGES: u32 = 1 << 31;
/// Pairs of a list at most: some 6 GB.
pub const PAIRS_MAX: u32 = 1 << 28;

/// Flag of a [`PairTask`]: only pairs with a marked particle are looked at, and listed: for the present ways, not for the two sets of positions.
pub const TASK_MARKED: u32 = 1;
/// Flag of a [`PairTask`]: pairs that do not move are looked at as well.
pub const TASK_NEW: u32 = 2;

/// What a kernel is told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PairTask<T> {
    /// Pairs belong to the list that are not this far apart along the same axis at both sets of positions \[m\].
    pub reach: T,
    /// Time for which particles are followed \[s\].
    pub length: T,
    /// Distance of features at the end of their ways \[m\].
    pub delta: T,
    /// Distance below which pairs may touch \[m\].
    pub distance: T,
    /// Sum of the `TASK_` constants.
    pub flags: u32,
    /// Groups of triangles, a power of two: those of cloths, and behind them those of bodies.
    pub group_count: u32,
    /// Pairs in the list.
    pub pair_count: u32,
    /// Room for pairs in the list.
    pub pair_capacity: u32,
    /// Room for pairs that are found.
    pub found_capacity: u32,
    /// Blocks of particles whose motion has a result each.
    pub moved_blocks: u32,
    /// Edges of the surface.
    pub edge_count: u32,
    /// Particles, and nodes of bodies behind them.
    pub node_count: u32,
    /// Groups of cloths: two triangles of bodies are no pair.
    pub own_group_count: u32,
    /// Where the pairs of this task begin in the list: those of marked particles stand behind those of all.
    pub pair_first: u32,
}

impl<T> PairTask<T> {
    /// Groups whose triangles look for others: those of bodies do where one of them may be all that is marked.
    #[must_use]
    pub const fn listing_groups(&self) -> u32 {
        if self.flags & TASK_MARKED == 0 { self.own_group_count } else { self.group_count }
    }
}

/// Which pairs of the list a look is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairLook {
    /// None: how far particles have moved is all that is asked.
    Moved,
    /// Those that may touch at the starts of the ways.
    Near,
    /// Those that nothing proves to be apart on the ways.
    Unproven,
}

/// Where the ways come from that kernels look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaysFrom {
    /// The present positions and velocities.
    Velocities,
    /// The start of the substep and the present positions.
    Substep,
    /// The iterate that was kept last and the present positions.
    Iterate,
    /// They are on the device already.
    Device,
}

/// Vectors of all particles that a device has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionVector {
    /// Present positions, with inverse masses.
    Position,
    /// Present velocities, with masses.
    Velocity,
    /// Positions at the start of the substep.
    Start,
    /// Positions of the iterate that was kept last.
    Iterate,
}

/// What a device answers to a look.
#[derive(Clone, Debug, Default)]
pub struct PairAnswer<T> {
    /// Pairs that were found, even where there was no room for them.
    pub found: u32,
    /// Words as the device had them.
    pub words: Vec<u32>,
    /// Where in these the pairs are that there was room for, in any order.
    pub pairs: Range<usize>,
    /// Numbers of all blocks of particles ([`Moved`](super::Moved)) for starts of ways, then for ends.
    pub moved: Vec<T>,
}

/// What a device does for contact of triangles; which, when and with what outcome is decided by
/// [`DeviceContact`](super::DeviceContact).
pub trait PairDevice<T: Real> {
    /// Makes room for the list.
    ///
    /// # Errors
    /// `Overflow` if it is more than the device takes.
    fn list_create(&mut self, task: &PairTask<T>) -> Result<()>;

    /// Makes room for pairs that are found.
    ///
    /// # Errors
    /// `Overflow` if it is more than the device takes.
    fn results_create(&mut self, task: &PairTask<T>) -> Result<()>;

    /// Gives ways from number `first` on: starts, then ends, with a fourth number that is not 0 if the particle is marked.
    ///
    /// # Errors
    /// What the device reports.
    fn ways_write(&mut self, first: usize, ways: &[[T; 4]]) -> Result<()>;

    /// Gives ways of the nodes of bodies, behind those of particles: starts, and ends where they are others than those that were given last.
    ///
    /// # Errors
    /// What the device reports.
    fn nodes_write(&mut self, start: &[[T; 4]], end: Option<&[[T; 4]]>) -> Result<()>;

    /// Puts ways of particles in place, finds how far particles have moved, and the pairs of the list that are asked for. About `expected` pairs
    /// will be found.
    ///
    /// # Errors
    /// What the device reports.
    fn look(
        &mut self,
        task: &PairTask<T>,
        ways: WaysFrom,
        look: PairLook,
        expected: usize,
        out: &mut PairAnswer<T>,
    ) -> Result<()>;

    /// Takes the present ways as the two sets of positions that the list is for.
    ///
    /// # Errors
    /// What the device reports.
    fn references_take(&mut self, task: &PairTask<T>) -> Result<()>;

    /// Boxes around triangles, groups and the nodes of the tree, for both sets of positions, or those of the present ways.
    ///
    /// # Errors
    /// What the device reports.
    fn boxes_fit(&mut self, task: &PairTask<T>) -> Result<()>;

    /// Fills the list from the first pair of the task on, and says how many pairs it has or would have there.
    ///
    /// # Errors
    /// What the device reports.
    fn list_fill(&mut self, task: &PairTask<T>) -> Result<u32>;

    /// Reads vectors of all particles.
    ///
    /// # Errors
    /// What the device reports.
    fn motion_read(&mut self, wanted: &mut [(MotionVector, &mut Vec<[T; 4]>)]) -> Result<()>;

    /// Writes positions and velocities.
    ///
    /// # Errors
    /// What the device reports.
    fn motion_write(&mut self, position: &[[T; 4]], velocity: &[[T; 4]]) -> Result<()>;

    /// Takes in what contacts do, for forces and the matrix. `equation` tells what each is in the equations of particles.
    ///
    /// # Errors
    /// What the device reports.
    fn contacts_write(
        &mut self,
        set: &ContactSet<T>,
        equation: impl Fn(usize) -> ContactEquation<T> + Sync,
        newton: NewtonStart,
    ) -> Result<()>;
}

/// The surface as kernels read it: groups of triangles of cloths, and in the second half those of bodies, if there are any, slots
/// behind the last ones filled up; the ends of all edges; for each node whom seams make it one with.
#[must_use]
pub fn surface_words(surface: &ContactSurface, group_count: u32) -> Vec<u32> {
    let slots = GROUP * group_count as usize;
    let mut words = Vec::with_capacity(TRIANGLE_WORDS * slots);
    let mut groups_put = |groups: Vec<u32>, end: usize| {
        for triangle in groups {
            let [a, b, c] = surface.triangles()[triangle as usize];
            let (owned, [ab, bc, ca]) = surface.features(triangle);
            words.extend([triangle, a, b, c, u32::from(owned), ab, bc, ca]);
        }
        words.resize(TRIANGLE_WORDS * end, NO_TRIANGLE);
    };
    let bodies = surface.body_groups(GROUP);
    groups_put(surface.groups(GROUP), if bodies.is_empty() { slots } else { slots / 2 });
    groups_put(bodies, slots);
    words.extend(surface.edges().iter().flatten());
    words.extend(surface.classes());
    words
}

impl<T> PairAnswer<T> {
    /// The pairs.
    pub(super) fn pairs(&self) -> Vec<UnprovenPair> {
        let pairs = self.words[self.pairs.clone()].as_chunks::<PAIR_WORDS>().0;
        pairs.par_iter().with_min_len(TASK).map(pair_of).collect()
    }
}

/// The pairs that words tell.
pub fn pairs_of(words: &[u32]) -> impl Iterator<Item = UnprovenPair> + '_ {
    words.as_chunks::<PAIR_WORDS>().0.iter().map(pair_of)
}

fn pair_of(&[a, b, c, d, first, second]: &[u32; PAIR_WORDS]) -> UnprovenPair {
    let candidate = match first & EDGES {
        0 => Candidate::VertexTriangle([first, second]),
        _ => Candidate::EdgeEdge([first & !EDGES, second]),
    };
    UnprovenPair { candidate, particles: [a, b, c, d] }
}
