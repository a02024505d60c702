//! The list on a device as a search that builds it when it does not hold.

use crate::{Real, Result};

use super::{
    super::{PairSearch, UnprovenPair, Ways},
    DeviceList,
    host::LastLook,
    list::Look,
    task::{PairDevice, PairLook, TASK_MARKED, TASK_NEW, WaysFrom},
};

/// The list of a device.
pub(super) struct DeviceSearch<'a, T, D> {
    pub(super) device: &'a mut D,
    pub(super) list: &'a mut DeviceList<T>,
    /// What the device has found on the first ways, with at least as large a distance.
    pub(super) first: Option<Look<T>>,
    pub(super) last: Option<LastLook<T>>,
}

impl<T: Real, D: PairDevice<T>> DeviceSearch<'_, T, D> {
    /// Finds the pairs of marked particles on the host, if the last look and the list on it say enough. Returns whether it did.
    fn unproven_on_host(
        &mut self,
        ways: &Ways<'_, T>,
        marked: &[bool],
        out: &mut Vec<UnprovenPair>,
    ) -> Result<bool> {
        let Some(last) = &self.last else { return Ok(false) };
        if !self.list.host_read(self.device)? {
            return Ok(false);
        }
        let host = self.list.host();
        let Some(moved) = host.moved(last, ways, marked) else { return Ok(false) };
        let holds = moved.holds(self.list.task.reach, ways.delta + ways.delta);
        if holds {
            out.extend(host.unproven(ways, marked));
        }
        Ok(holds)
    }
}

impl<T: Real, D: PairDevice<T>> PairSearch<T> for DeviceSearch<'_, T, D> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        if let Some(marked) = marked
            && self.unproven_on_host(ways, marked, out)?
        {
            return Ok(());
        }
        let Self { device, list, first, last } = self;
        if let Some(first) = first.take() {
            let asked = (ways.delta, ways.is_new);
            let found = first.found.into_iter();
            out.extend(found.filter(|pair| pair.is_unproven(ways.start, ways.end, asked)));
            *last = Some(LastLook::new(ways, first.moved));
            return Ok(());
        }
        let full = |x: &[T; 3], w: T| [x[0], x[1], x[2], w];
        let is_marked = |i: usize| marked.is_some_and(|marked| marked[i]);
        let starts = ways.start.iter().map(|x| full(x, T::ZERO));
        let ends = ways.end.iter().enumerate();
        let ends = ends.map(|(i, x)| full(x, if is_marked(i) { T::ONE } else { T::ZERO }));
        let vectors: Vec<[T; 4]> = starts.chain(ends).collect();
        device.ways_write(&vectors)?;
        let flags = [(marked.is_some(), TASK_MARKED), (ways.is_new, TASK_NEW)];
        list.task.flags = flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum();
        list.task.delta = ways.delta;
        let mut look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        if !list.holds_for(&look, ways.delta + ways.delta) {
            // Marked particles lag behind the others, which the next rounds will make worse: then boxes are around whole ways.
            list.build(*device, marked.is_none())?;
            *last = None;
            look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        }
        if marked.is_none() {
            *last = Some(LastLook::new(ways, look.moved));
        }
        out.extend(look.found);
        Ok(())
    }
}
