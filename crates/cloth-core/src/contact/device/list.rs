//! The list of pairs on a device: when it is built, and what is found in it.

use crate::{Real, Result};

use super::{
    super::{ContactSurface, UnprovenPair},
    Moved,
    task::{GROUP, PAIRS_MAX, PairAnswer, PairDevice, PairLook, PairTask, TASK_MARKED, WaysFrom},
};

/// What the list reaches beyond the distance of contact, relative to it.
const SKIN: f64 = 1.0;
/// Most blocks over particles, each with a result of its own.
const MOVED_BLOCKS_MAX: usize = 256;
/// Particles of such a block, at least.
const MOVED_THREADS: usize = 128;
/// Pairs that are read at once at least.
const EXPECTED_MIN: usize = 64;

/// The list of pairs on a device.
#[derive(Debug)]
pub struct DeviceList<T> {
    /// What kernels are told.
    pub task: PairTask<T>,
    /// Whether there is a list.
    has_list: bool,
    /// Pairs that were found lately: so many are read at once.
    expected: usize,
    answer: PairAnswer<T>,
    pub(super) rebuilds: u32,
}

/// What a look at the device has found.
#[derive(Debug)]
pub(super) struct Look<T> {
    /// Starts and ends of the ways.
    pub(super) moved: [Moved<T>; 2],
    pub(super) found: Vec<UnprovenPair>,
}

impl<T: Real> Look<T> {
    pub(super) fn is_finite(&self) -> bool {
        self.moved.iter().all(Moved::is_finite)
    }
}

impl<T: Real> DeviceList<T> {
    pub(super) fn new(surface: &ContactSurface) -> Self {
        let (triangles, own) = (surface.triangles().len(), surface.cloth_triangles());
        let groups = |triangles: usize| triangles.div_ceil(GROUP).next_power_of_two() as u32;
        // Those of cloths are one half of the tree, those of bodies the other one.
        let has_bodies = triangles > own;
        let own_groups =
            if has_bodies { groups(own).max(groups(triangles - own)) } else { groups(own) };
        let nodes = surface.node_count();
        let blocks = nodes.div_ceil(MOVED_THREADS).clamp(1, MOVED_BLOCKS_MAX);
        let task = PairTask {
            reach: T::from_f64((1.0 + SKIN) * surface.reach()),
            distance: T::from_f64(surface.reach()),
            length: T::ZERO,
            delta: T::ZERO,
            flags: 0,
            group_count: if has_bodies { 2 * own_groups } else { own_groups },
            pair_count: 0,
            pair_capacity: (16 * triangles).max(1024) as u32,
            found_capacity: 1024,
            moved_blocks: blocks as u32,
            edge_count: surface.edges().len() as u32,
            node_count: nodes as u32,
            own_group_count: own_groups,
            pair_first: 0,
        };
        let expected = EXPECTED_MIN;
        Self { task, has_list: false, expected, answer: PairAnswer::default(), rebuilds: 0 }
    }

    /// Whether the list has all pairs that are `distance` or less apart along all axes at both ends of the ways.
    pub(super) fn holds_for(&self, look: &Look<T>, distance: T) -> bool {
        self.has_list && look.moved.iter().all(|moved| moved.holds(self.task.reach, distance))
    }

    /// The same at the starts.
    pub(super) fn holds_at_start(&self, look: &Look<T>, distance: T) -> bool {
        self.has_list && look.moved[0].holds(self.task.reach, distance)
    }

    /// Asks the device how far particles have moved, and which pairs of the list are found.
    pub(super) fn look(
        &mut self,
        device: &mut impl PairDevice<T>,
        look: PairLook,
        ways: WaysFrom,
    ) -> Result<Look<T>> {
        let has_pairs = self.has_list && self.task.pair_count > 0;
        self.look_at(device, if has_pairs { look } else { PairLook::Moved }, ways)
    }

    fn look_at(
        &mut self,
        device: &mut impl PairDevice<T>,
        look: PairLook,
        ways: WaysFrom,
    ) -> Result<Look<T>> {
        loop {
            let Self { task, answer, expected, .. } = self;
            device.look(task, ways, look, *expected, answer)?;
            if answer.found > task.found_capacity {
                task.found_capacity = room(answer.found);
                device.results_create(task)?;
                continue;
            }
            // Down slowly, as looks for contacts and for proofs take turns.
            let count = answer.found as usize;
            *expected = (count + count / 4).max(*expected / 8 * 7).max(EXPECTED_MIN);
            let (starts, ends) = answer.moved.split_at(answer.moved.len() / 2);
            return Ok(Look { moved: [Moved::of(starts), Moved::of(ends)], found: answer.pairs() });
        }
    }

    /// Builds the list for both ends of the ways that are on the device, and all that are the same share of the way from one to the other.
    pub(super) fn build(&mut self, device: &mut impl PairDevice<T>) -> Result<()> {
        device.references_take(&self.task)?;
        self.has_list = false;
        self.task.flags &= !TASK_MARKED;
        self.fill(device)?;
        self.has_list = true;
        self.rebuilds += 1;
        Ok(())
    }

    /// Finds the unproven pairs with a mark on the ways that are on the device, by a list of such pairs alone, behind the other one: marks change from one
    /// round to the next, and so few have them that to list all anew would be most of the work.
    pub(super) fn look_marked(&mut self, device: &mut impl PairDevice<T>) -> Result<Look<T>> {
        let PairTask { reach, pair_count, .. } = self.task;
        self.task.pair_first = if self.has_list { pair_count } else { 0 };
        self.task.flags |= TASK_MARKED;
        self.task.reach = self.task.delta + self.task.delta;
        let found = self.fill(device).and_then(|()| {
            let has_pairs = self.task.pair_count > 0;
            let look = if has_pairs { PairLook::Unproven } else { PairLook::Moved };
            self.look_at(device, look, WaysFrom::Device)
        });
        self.task.reach = reach;
        self.task.pair_first = 0;
        self.task.pair_count = if self.has_list { pair_count } else { 0 };
        found
    }

    /// Fills the list from the first pair of the task on. Without room for all, there is a longer list with nothing else in it.
    fn fill(&mut self, device: &mut impl PairDevice<T>) -> Result<()> {
        device.boxes_fit(&self.task)?;
        loop {
            let listed = device.list_fill(&self.task)?;
            let end = self.task.pair_first.saturating_add(listed);
            if end <= self.task.pair_capacity {
                self.task.pair_count = listed;
                return Ok(());
            }
            self.task.pair_capacity = room(end);
            device.list_create(&self.task)?;
            self.has_list = false;
        }
    }
}

/// Room for so many, and some more.
fn room(needed: u32) -> u32 {
    needed.saturating_add(needed / 2).min(PAIRS_MAX).max(needed)
}
