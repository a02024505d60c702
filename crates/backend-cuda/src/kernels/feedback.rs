//! What colliders did to all particles.

use cloth_core::{ColliderImpulse, Result};

use super::CudaKernels;
use crate::{
    layout::{BLOCK, CudaReal},
    memory::FeedbackMemory,
    queue::{Launch, argument},
};

const COMPONENTS: usize = FeedbackMemory::COMPONENTS;

impl<T: CudaReal> CudaKernels<T> {
    /// The sums since the last call.
    pub(super) fn impulses_take(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        let colliders = self.model.colliders().len();
        out.clear();
        out.resize(colliders, ColliderImpulse::default());
        if let Some(triangles) = &mut self.triangles {
            triangles.impulses_take(out);
        }
        let Some(memory) = &self.memory.feedback else { return Ok(()) };
        let (sums, count) = (memory.sums.address(), memory.sums.len());
        let blocks = self.count().div_ceil(BLOCK);
        let launch =
            Launch { blocks: count as u32, threads: BLOCK as u32, shared: 0, cooperative: false };
        self.stage("collider_response", |kernels| {
            let name = ("collider_impulses", "collider_impulses");
            kernels.start(name, launch, &[argument(&(blocks as u32)), argument(&sums)])
        })?;
        let mut read = Vec::new();
        if let Some(memory) = &self.memory.feedback {
            memory.sums.read(&self.memory.queue, &mut read)?;
        }
        for (sum, blocks) in out.iter_mut().zip(read.chunks(COMPONENTS * blocks)) {
            for of_block in blocks.chunks_exact(COMPONENTS) {
                *sum += ColliderImpulse {
                    linear: [of_block[0], of_block[1], of_block[2]],
                    angular: [of_block[3], of_block[4], of_block[5]],
                };
            }
        }
        Ok(())
    }
}
