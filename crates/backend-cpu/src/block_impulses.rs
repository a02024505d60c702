//! Sums of what colliders do, block by block, so that threads do not matter.

use cloth_core::{ColliderImpulse, Model};
use rayon::prelude::*;

use crate::memory::BLOCK;

/// One sum for each block and collider; empty if the model does not ask for them.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockImpulses {
    sums: Vec<Option<Vec<ColliderImpulse>>>,
    colliders: usize,
}

impl BlockImpulses {
    pub(crate) fn new(model: &Model) -> Self {
        let colliders = model.colliders().len();
        let blocks = model.particle_count().div_ceil(BLOCK);
        let sums = model.collider_impulses().then(|| vec![ColliderImpulse::default(); colliders]);
        Self { sums: vec![sums; blocks], colliders }
    }

    /// The sums of each block.
    pub(crate) fn blocks_mut(
        &mut self,
    ) -> impl IndexedParallelIterator<Item = Option<&mut [ColliderImpulse]>> + '_ {
        self.sums.par_iter_mut().map(|sums| sums.as_deref_mut())
    }

    /// Sums over all blocks, in order, and starts again from zero.
    pub(crate) fn take(&mut self, out: &mut Vec<ColliderImpulse>) {
        out.clear();
        out.resize(self.colliders, ColliderImpulse::default());
        for block in self.sums.iter_mut().flatten() {
            for (sum, more) in out.iter_mut().zip(block) {
                *sum += std::mem::take(more);
            }
        }
    }
}
