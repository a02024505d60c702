//! What colliders did to all particles.

use cloth_core::Result;

use crate::{
    layout::BLOCK,
    queue::{Buffer, Queue},
};

/// Memory for what each collider did to each particle.
pub(crate) struct FeedbackMemory {
    /// Component q of collider c is number 6 c + q, each for all particles.
    pub(crate) impulses: Buffer<f64>,
    /// The same at the start of a frame that may have to be done again.
    pub(crate) of_frame: Buffer<f64>,
    /// And at the last `state_keep`.
    pub(crate) kept: Buffer<f64>,
    /// Sums over blocks of particles.
    pub(crate) sums: Buffer<f64>,
}

impl FeedbackMemory {
    /// Components of an impulse and its moment.
    pub(crate) const COMPONENTS: usize = 6;

    /// Nothing done yet.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue, particles: usize, colliders: usize) -> Result<Self> {
        let components = Self::COMPONENTS * colliders;
        Ok(Self {
            impulses: Buffer::zeros(queue, components * particles)?,
            of_frame: Buffer::zeros(queue, components * particles)?,
            kept: Buffer::zeros(queue, components * particles)?,
            sums: Buffer::zeros(queue, components * particles.div_ceil(BLOCK))?,
        })
    }
}
