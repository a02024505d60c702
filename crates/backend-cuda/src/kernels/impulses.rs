//! What colliders did to all particles.

use cloth_core::{ColliderImpulse, Result};

use super::CudaKernels;
use crate::{
    layout::CudaReal,
    memory::BLOCK,
    queue::{Buffer, Launch, argument},
};

/// Components of an impulse and its moment.
const COMPONENTS: usize = 6;

/// Memory for what each collider did to each particle.
pub(crate) struct ImpulseMemory {
    /// Component q of collider c is number 6 c + q, each for all particles.
    pub(crate) impulses: Buffer<f64>,
    /// The same at the start of a frame that may have to be done again.
    pub(crate) of_frame: Buffer<f64>,
    /// And at the last `state_keep`.
    pub(crate) kept: Buffer<f64>,
    /// Sums over blocks of particles.
    sums: Buffer<f64>,
}

impl ImpulseMemory {
    pub(crate) fn new(
        queue: &crate::queue::Queue,
        particles: usize,
        colliders: usize,
    ) -> Result<Self> {
        let components = COMPONENTS * colliders;
        Ok(Self {
            impulses: Buffer::zeros(queue, components * particles)?,
            of_frame: Buffer::zeros(queue, components * particles)?,
            kept: Buffer::zeros(queue, components * particles)?,
            sums: Buffer::zeros(queue, components * particles.div_ceil(BLOCK))?,
        })
    }
}

impl<T: CudaReal> CudaKernels<T> {
    /// The sums since the last call.
    pub(super) fn impulses_take(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        let colliders = self.model.colliders().len();
        out.clear();
        out.resize(colliders, ColliderImpulse::default());
        if let Some(triangles) = &mut self.triangles {
            triangles.impulses_take(out);
        }
        let Some(memory) = &self.memory.impulses else { return Ok(()) };
        let (sums, count) = (memory.sums.address(), memory.sums.len());
        let blocks = self.count().div_ceil(BLOCK);
        let launch =
            Launch { blocks: count as u32, threads: BLOCK as u32, shared: 0, cooperative: false };
        self.stage("collider_response", |kernels| {
            let name = ("collider_impulses", "collider_impulses");
            kernels.start(name, launch, &[argument(&(blocks as u32)), argument(&sums)])
        })?;
        let mut read = Vec::new();
        if let Some(memory) = &self.memory.impulses {
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
