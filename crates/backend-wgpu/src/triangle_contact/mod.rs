//! NUMERICS §15: contact of triangles. The device lists pairs, finds those that may touch or meet, and applies forces and rows; the host
//! decides what touches, by the law that all backends share, and shortens ways where the device has found no proof.

mod moved;
mod table;

use cloth_core::{
    ContactStatistics, Model, NewtonStart,
    contact::{Candidate, Certifier, ContactSet, ContactSurface, UnprovenPair},
};

pub(crate) use moved::{MOVED_WORDS, Moved};
pub(crate) use table::TABLE_HEAD;

use crate::layout::PairTask;

/// Triangles in a group, and words of each (`shared/surface.wgsl`).
const GROUP: usize = 8;
const TRIANGLE_WORDS: usize = 8;
/// Number of a triangle that is none.
const NO_TRIANGLE: u32 = u32::MAX;

/// Words of a pair (`shared/pair_list.wgsl`).
pub(crate) const PAIR_WORDS: usize = 6;
/// What the number of its first feature has more if both are edges.
const EDGES: u32 = 1 << 31;

/// What the list reaches beyond the distance of contact, relative to it.
const SKIN: f64 = 1.0;

/// Most workgroups over particles, each with a result of its own.
const MOVED_BLOCKS_MAX: usize = 256;
/// Particles of such a workgroup, at least.
const MOVED_THREADS: usize = 128;

/// Contact of the triangles of a model.
#[derive(Debug)]
pub(crate) struct TriangleContact {
    pub(crate) surface: ContactSurface,
    pub(crate) set: ContactSet<f32>,
    pub(crate) certifier: Certifier<f32>,
    /// Pairs that may touch at the present positions.
    pub(crate) near: Vec<UnprovenPair>,
    /// What stages are told.
    pub(crate) task: PairTask,
    /// Whether there is a list of pairs.
    pub(crate) has_list: bool,
    /// Whether the table on the device has contacts.
    pub(crate) has_table: bool,
    /// Pairs that were found lately: so many are read at once.
    pub(crate) expected: usize,
    pub(crate) statistics: ContactStatistics,
    pub(crate) motion: HostMotion,
}

/// What contacts follow from, as it was last read.
#[derive(Debug, Default)]
pub(crate) struct HostMotion {
    pub(crate) position: Vec<[f32; 4]>,
    pub(crate) velocity: Vec<[f32; 4]>,
    pub(crate) start: Vec<[f32; 4]>,
}

impl TriangleContact {
    /// That of a model, if its triangles touch.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let count = model.particle_count();
        let triangles = surface.triangles().len();
        let groups = triangles.div_ceil(GROUP).next_power_of_two();
        let task = PairTask {
            reach: ((1.0 + SKIN) * contact.distance) as f32,
            distance: contact.distance as f32,
            group_count: groups as u32,
            pair_capacity: (16 * triangles).max(1024) as u32,
            found_capacity: 1024,
            moved_blocks: count.div_ceil(MOVED_THREADS).clamp(1, MOVED_BLOCKS_MAX) as u32,
            ..PairTask::default()
        };
        Some(Self {
            set: ContactSet::new(count),
            certifier: Certifier::new(count),
            near: Vec::new(),
            has_list: false,
            has_table: false,
            expected: 64,
            statistics: ContactStatistics::default(),
            motion: HostMotion::default(),
            surface,
            task,
        })
    }

    /// Contents of `surface.wgsl`.
    pub(crate) fn surface_words(&self) -> Vec<u32> {
        let slots = GROUP * self.task.group_count as usize;
        let mut words = Vec::with_capacity(TRIANGLE_WORDS * slots);
        for triangle in self.surface.groups(GROUP) {
            let [a, b, c] = self.surface.triangles()[triangle as usize];
            let (owned, [ab, bc, ca]) = self.surface.features(triangle);
            words.extend([triangle, a, b, c, u32::from(owned), ab, bc, ca]);
        }
        words.resize(TRIANGLE_WORDS * slots, NO_TRIANGLE);
        words.extend(self.surface.edges().iter().flatten());
        words
    }

    /// Boxes around the triangles and the nodes of the tree.
    pub(crate) const fn box_count(&self) -> u64 {
        (GROUP as u64 + 2) * self.task.group_count as u64
    }

    /// Words before those of pairs that were found (`shared/pair_results.wgsl`).
    pub(crate) const fn result_head(&self) -> usize {
        4 + 2 * MOVED_WORDS * self.task.moved_blocks as usize
    }

    /// Counts since the last call.
    pub(crate) fn statistics_take(&mut self) -> ContactStatistics {
        let counted = std::mem::take(&mut self.statistics);
        ContactStatistics {
            contacts: self.set.stencils().len() as u64,
            candidates: u64::from(self.task.pair_count),
            exempt: self.certifier.exempt().len() as u64,
            ..counted
        }
    }
}

/// The pairs that words tell.
pub(crate) fn pairs_of(words: &[u32]) -> impl Iterator<Item = UnprovenPair> + '_ {
    words.chunks_exact(PAIR_WORDS).map(|pair| {
        let (first, second) = (pair[4] & !EDGES, pair[5]);
        let candidate = match pair[4] & EDGES {
            0 => Candidate::VertexTriangle([first, second]),
            _ => Candidate::EdgeEdge([first, second]),
        };
        UnprovenPair { candidate, particles: [pair[0], pair[1], pair[2], pair[3]] }
    })
}

/// The part of a position or velocity that is one.
pub(crate) const fn vector(&[x, y, z, _]: &[f32; 4]) -> [f32; 3] {
    [x, y, z]
}

/// What kernels of the linear system read of the contacts, for an iterate or the start of a substep.
pub(crate) const fn is_from_start(start: NewtonStart) -> u32 {
    match start {
        NewtonStart::StepStart => 1,
        NewtonStart::Iterate => 0,
    }
}
