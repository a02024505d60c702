//! NUMERICS §15: contact of triangles, as [`DeviceContact`](cloth_core::contact::device::DeviceContact) shares it with a device. Words of
//! buffers that host and kernels share.

mod table;

use cloth_core::contact::device::{MOVED_NUMBERS, PairTask};

pub(crate) use table::{TABLE_HEAD, table};

use crate::layout;

/// Words before those of pairs that were found (`shared/pair_results.wgsl`).
pub(crate) const fn result_head(task: &PairTask<f32>) -> usize {
    4 + 2 * MOVED_NUMBERS * task.moved_blocks as usize
}

impl From<PairTask<f32>> for layout::PairTask {
    fn from(task: PairTask<f32>) -> Self {
        let PairTask { reach, length, delta, distance, .. } = task;
        let PairTask { flags, group_count, pair_count, pair_capacity, .. } = task;
        let PairTask { found_capacity, moved_blocks, edge_count, .. } = task;
        let PairTask { node_count, own_group_count, pair_first, .. } = task;
        Self {
            reach,
            length,
            delta,
            distance,
            flags,
            group_count,
            pair_count,
            pair_capacity,
            found_capacity,
            moved_blocks,
            edge_count,
            node_count,
            own_group_count,
            pair_first,
            padding_0: 0,
            padding_1: 0,
        }
    }
}
