//! The list on a device as a search that builds it when it does not hold.

use rayon::prelude::*;

use crate::{Real, Result};

use super::{
    super::{PairSearch, UnprovenPair, Ways},
    DeviceList, TASK,
    list::Look,
    sent::SentWays,
    task::{PairDevice, PairLook, TASK_MARKED, TASK_NEW, WaysFrom},
};

/// The list of a device.
pub(super) struct DeviceSearch<'a, T, D> {
    pub(super) device: &'a mut D,
    pub(super) list: &'a mut DeviceList<T>,
    /// What the device has found on the first ways, with at least as large a distance.
    pub(super) first: Option<Look<T>>,
    /// The ways that the device has.
    pub(super) sent: &'a mut SentWays<T>,
    /// Whether the list lacks pairs of the last ways.
    pub(super) lacks: bool,
}

impl<T: Real, D: PairDevice<T>> PairSearch<T> for DeviceSearch<'_, T, D> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        let Self { device, list, first, sent, lacks } = self;
        if let Some(first) = first.take() {
            let asked = (ways.delta, ways.is_new);
            let found = first.found.into_par_iter().with_min_len(TASK);
            out.par_extend(found.filter(|pair| pair.is_unproven(ways.start, ways.end, asked)));
            sent.are_there();
            return Ok(());
        }
        sent.give(*device, ways, marked)?;
        let flags = [(marked.is_some(), TASK_MARKED), (ways.is_new, TASK_NEW)];
        list.task.flags = flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum();
        list.task.delta = ways.delta;
        if marked.is_some() && *lacks {
            out.extend(list.look_marked(*device)?.found);
            return Ok(());
        }
        let mut look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        *lacks = !list.holds_for(&look, ways.delta + ways.delta);
        if *lacks && marked.is_some() {
            look = list.look_marked(*device)?;
        } else if *lacks {
            list.build(*device)?;
            *lacks = false;
            look = list.look(*device, PairLook::Unproven, WaysFrom::Device)?;
        }
        out.extend(look.found);
        Ok(())
    }
}
