//! What bodies do to cloth, for rigid bodies that cloth moves.

use crate::{ColliderImpulse, Model};

/// What bodies did to cloth, one sum for each collider, with what it was at the start of a substep that may be taken back.
#[derive(Clone, Debug, Default)]
pub struct BodyImpulses {
    sums: Vec<ColliderImpulse>,
    kept: Vec<ColliderImpulse>,
}

impl BodyImpulses {
    /// None, of the colliders of a model; without memory if the model does not ask for them or has no bodies.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let is_asked = model.collider_impulses() && model.has_contact_bodies();
        let count = if is_asked { model.colliders().len() } else { 0 };
        let sums = vec![ColliderImpulse::default(); count];
        Self { kept: sums.clone(), sums }
    }

    /// Whether the model asks for them.
    #[must_use]
    pub const fn is_asked(&self) -> bool {
        !self.sums.is_empty()
    }

    /// A collider gave an impulse \[kg m/s\] to cloth at a place \[m\].
    pub fn add(&mut self, collider: usize, place: [f64; 3], linear: [f64; 3]) {
        if let Some(sum) = self.sums.get_mut(collider) {
            *sum += ColliderImpulse::at(place, linear);
        }
    }

    /// `state_keep`.
    pub fn keep(&mut self) {
        self.kept.clone_from(&self.sums);
    }

    /// `state_restore`.
    pub fn restore(&mut self) {
        self.sums.clone_from(&self.kept);
    }

    /// Adds all sums to those of `out`, and starts again from zero.
    pub fn take(&mut self, out: &mut [ColliderImpulse]) {
        for (sum, out) in self.sums.iter_mut().zip(out) {
            *out += std::mem::take(sum);
        }
    }
}
