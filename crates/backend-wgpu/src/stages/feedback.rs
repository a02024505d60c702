//! What colliders did to all particles.

use cloth_core::{ColliderImpulse, Result};

use super::Stages;
use crate::{buffers::impulses_size, dispatch::MEASURE_BLOCK};

impl Stages {
    /// The sums since the last call.
    pub(crate) fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        let colliders = self.model.colliders().len();
        out.clear();
        out.resize(colliders, ColliderImpulse::default());
        if !self.model.collider_impulses() || colliders == 0 {
            return Ok(());
        }
        if let Some(triangles) = &mut self.triangles {
            triangles.impulses_take(out);
        }
        self.settle()?;
        let blocks = self.particle_count().div_ceil(MEASURE_BLOCK) as usize;
        let items = ((blocks * colliders) as u32, 1);
        self.dispatch("collider_response", "collider_impulses", items, self.present, (0, 0))?;
        let words = 16 * (blocks * colliders) as u64;
        let partials: Vec<[f32; 16]> = self.read_words("impulse_partials", words)?;
        for (sum, of_collider) in out.iter_mut().zip(partials.chunks(blocks)) {
            for partial in of_collider {
                let number = |at: usize| f64::from(partial[at]) + f64::from(partial[at + 4]);
                *sum += ColliderImpulse {
                    linear: [0, 1, 2].map(number),
                    angular: [8, 9, 10].map(number),
                };
            }
        }
        Ok(())
    }

    /// Records a copy of what colliders did so far, if that is asked for.
    pub(super) fn impulses_copy(&mut self, [from, to]: [&str; 2]) -> Result<()> {
        if !self.model.collider_impulses() || self.model.colliders().is_empty() {
            return Ok(());
        }
        let (from, to) = (self.buffers.get(from, 0, 0)?, self.buffers.get(to, 0, 0)?);
        self.recorder.copy(&self.context, from, 0, to, 0, impulses_size(&self.model));
        Ok(())
    }
}
