//! The list on a device as a search that builds it when it does not hold.

use rayon::prelude::*;

use crate::{Real, Result};

use super::{
    super::{PairSearch, UnprovenPair, Ways},
    DeviceList, TASK,
    list::Look,
    task::{PairDevice, PairLook, TASK_MARKED, TASK_NEW, WaysFrom},
};

/// The list of a device.
pub(super) struct DeviceSearch<'a, T, D> {
    pub(super) device: &'a mut D,
    pub(super) list: &'a mut DeviceList<T>,
    /// What the device has found on the first ways, with at least as large a distance.
    pub(super) first: Option<Look<T>>,
    /// The starts of ways that the device has.
    pub(super) start: Vec<[T; 3]>,
}

impl<T: Real, D: PairDevice<T>> PairSearch<T> for DeviceSearch<'_, T, D> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        let Self { device, list, first, start } = self;
        if let Some(first) = first.take() {
            let asked = (ways.delta, ways.is_new);
            let found = first.found.into_par_iter().with_min_len(TASK);
            out.par_extend(found.filter(|pair| pair.is_unproven(ways.start, ways.end, asked)));
            start.extend_from_slice(ways.start);
            return Ok(());
        }
        let full = |x: &[T; 3], w: T| [x[0], x[1], x[2], w];
        let is_marked = |i: usize| marked.is_some_and(|marked| marked[i]);
        let ends = ways.end.iter().enumerate();
        let ends = ends.map(|(i, x)| full(x, if is_marked(i) { T::ONE } else { T::ZERO }));
        // Ways begin in the same places from one round to the next.
        if are_equal(start, ways.start) {
            device.ways_write(ways.start.len(), &ends.collect::<Vec<_>>())?;
        } else {
            start.clear();
            start.extend_from_slice(ways.start);
            let starts = ways.start.iter().map(|x| full(x, T::ZERO));
            device.ways_write(0, &starts.chain(ends).collect::<Vec<_>>())?;
        }
        let flags = [(marked.is_some(), TASK_MARKED), (ways.is_new, TASK_NEW)];
        list.task.flags = flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum();
        list.task.delta = ways.delta;
        let mut look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        if !list.holds_for(&look, ways.delta + ways.delta) {
            list.build(*device)?;
            look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        }
        out.extend(look.found);
        Ok(())
    }
}

/// Whether places are the same, without a branch for each of them.
fn are_equal<T: Real>(a: &[[T; 3]], b: &[[T; 3]]) -> bool {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    a.len() == b.len() && pairs.fold(true, |equal, (a, b)| equal & (a == b))
}
