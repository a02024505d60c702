//! NUMERICS §8: contact of cloth with itself, with the particles marked for which rounding decides whether they touch.

use cloth_backend_reference::{self as reference, ContactPairs};
use cloth_core::Model;

use super::Particles;
use crate::tracked::TrackedVector;

/// All pairs in contact, their particles marked where rounding decides.
pub fn contact_pairs(model: &Model, particles: &mut Particles) -> ContactPairs {
    let found = reference::contact_candidates(model, particles);
    for &particle in found.uncertain.iter().flatten() {
        particles.uncertain[particle as usize] = true;
    }
    found
}

/// Adds the penalty force of every pair to both particles.
pub fn contact_forces(model: &Model, particles: &mut Particles, forces: &mut [TrackedVector]) {
    let found = contact_pairs(model, particles);
    reference::contact_forces(model, particles, &found.pairs, forces);
}

/// Momentum exchange and separation of all pairs.
pub fn contact_impulses(model: &Model, particles: &mut Particles, length: f64) {
    if model.self_contact().is_none_or(|contact| !contact.excludes_neighbours()) {
        return;
    }
    let found = contact_pairs(model, particles);
    spread(particles, &found);
    reference::contact_impulses(model, particles, &found.pairs, length);
}

/// A pair that may or may not be in contact changes the counts N of its two particles, and with
/// them the share g of all that these touch.
fn spread(particles: &mut Particles, found: &ContactPairs) {
    let mut counted_differently = vec![false; particles.len()];
    for &particle in found.uncertain.iter().flatten() {
        counted_differently[particle as usize] = true;
    }
    for pair in &found.pairs {
        if pair.iter().any(|&particle| counted_differently[particle as usize]) {
            pair.iter().for_each(|&particle| particles.uncertain[particle as usize] = true);
        }
    }
}
