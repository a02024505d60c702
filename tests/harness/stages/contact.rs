//! NUMERICS §8: contact of cloth with itself, every pair tried.

use cloth_core::{ContactResponse, Model};

use super::{ONE, Particles, ZERO};
use crate::tracked::{Tracked, TrackedVector};

/// Squares of distances \[m^2\] up to this have no normal.
const LENGTH_SQUARED_MIN: Tracked = Tracked::rounded(1e-14);

/// The pairs of particles that are in contact.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ContactPairs {
    /// Pairs (i, j), i < j, ascending.
    pub pairs: Vec<[u32; 2]>,
    /// Those of all pairs, in contact or not, for which rounding decides.
    pub uncertain: Vec<[u32; 2]>,
}

/// All pairs in contact: closer than the contact distance, and not left out by the response.
#[must_use]
pub fn contact_pairs(model: &Model, particles: &Particles, epsilon: f64) -> ContactPairs {
    let mut found = ContactPairs::default();
    let Some(contact) = model.self_contact() else { return found };
    let distance = Tracked::rounded(contact.distance);
    for i in 0..particles.len() {
        for j in i + 1..particles.len() {
            let difference = particles.positions[i] - particles.positions[j];
            let pair = [i as u32, j as u32];
            let length = difference.length();
            let [is_uncertain, is_near] =
                [length.is_close(distance, epsilon), length.value < distance.value];
            if (is_uncertain || is_near) && !is_left_out(model, pair) {
                found.pairs.extend(is_near.then_some(pair));
                found.uncertain.extend(is_uncertain.then_some(pair));
            }
        }
    }
    found
}

/// Whether the response leaves a pair out: joined by a spring, or close at the start.
fn is_left_out(model: &Model, [i, j]: [u32; 2]) -> bool {
    let Some(contact) = model.self_contact() else { return true };
    let [a, b] = [i, j].map(|particle| glam::DVec3::from(model.positions()[particle as usize]));
    contact.excludes_neighbours()
        && (model.springs().joins(i, j) || a.distance(b) < contact.distance)
}

/// Adds the penalty force of every pair to both particles.
pub fn contact_forces(
    model: &Model,
    particles: &mut Particles,
    forces: &mut [TrackedVector],
    epsilon: f64,
) {
    let found = contact_pairs(model, particles, epsilon);
    for pair in &found.uncertain {
        pair.iter().for_each(|&particle| particles.uncertain[particle as usize] = true);
    }
    contact_forces_of(model, particles, &found.pairs, forces, epsilon);
}

/// Adds the penalty force of these pairs.
pub fn contact_forces_of(
    model: &Model,
    particles: &mut Particles,
    pairs: &[[u32; 2]],
    forces: &mut [TrackedVector],
    epsilon: f64,
) {
    let Some(contact) = model.self_contact() else { return };
    let ContactResponse::Penalty { stiffness, damping } = contact.response else { return };
    let [distance, stiffness, damping] =
        [contact.distance, stiffness, damping].map(Tracked::rounded);
    for pair in pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let difference = particles.positions[i] - particles.positions[j];
        let squared = difference.dot(difference);
        if squared.is_close(LENGTH_SQUARED_MIN, epsilon) {
            particles.uncertain[i] = true;
            particles.uncertain[j] = true;
        }
        if squared.value <= LENGTH_SQUARED_MIN.value {
            continue;
        }
        let length = difference.length();
        let normal = difference.divided(length);
        let separation = (particles.velocities[i] - particles.velocities[j]).dot(normal);
        let force = normal.scaled(stiffness * (distance - length) - damping * separation);
        forces[i] += force;
        forces[j] -= force;
    }
}

/// Momentum exchange and separation, all pairs from the old state.
pub fn contact_impulses(model: &Model, particles: &mut Particles, length: f64, epsilon: f64) {
    if model.self_contact().is_none_or(|contact| !contact.excludes_neighbours()) {
        return;
    }
    let found = contact_pairs(model, particles, epsilon);
    uncertain_spread(particles, &found);
    contact_impulses_of(model, particles, &found.pairs, length, epsilon);
}

/// The impulses of these pairs alone.
pub fn contact_impulses_of(
    model: &Model,
    particles: &mut Particles,
    pairs: &[[u32; 2]],
    length: f64,
    epsilon: f64,
) {
    let Some(contact) = model.self_contact() else { return };
    let ContactResponse::Impulse { restitution, friction } = contact.response else { return };
    let mut counts = vec![0_u32; particles.len()];
    pairs.iter().flatten().for_each(|&particle| counts[particle as usize] += 1);
    let [distance, restitution, friction] =
        [contact.distance, restitution, friction].map(Tracked::rounded);
    let rebound = ONE + restitution;
    let recovery = Tracked::rounded((length / 5e-3).min(1.0));
    let old = particles.clone();
    for pair in pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let [w_i, w_j] = [old.inverse_masses[i], old.inverse_masses[j]];
        let difference = old.positions[i] - old.positions[j];
        let squared = difference.dot(difference);
        if w_i.value + w_j.value == 0.0 || squared.value <= LENGTH_SQUARED_MIN.value {
            continue;
        }
        let apart = difference.length();
        let count = Tracked::exact(f64::from(counts[i].max(counts[j])));
        let share = ONE / count / (w_i + w_j);
        let normal = difference.divided(apart);
        let relative = old.velocities[i] - old.velocities[j];
        let approach = relative.dot(normal);
        // Near zero rounding decides on the branch; what it does is then near zero as well.
        if approach.value < 0.0 || approach.is_close(ZERO, epsilon) {
            let approach = approach.min(ZERO);
            let tangential = relative - normal.scaled(approach);
            let slip = tangential.length();
            let grip = if slip.value > 0.0 {
                ONE.min(friction * rebound * approach.abs() / slip)
            } else {
                ONE
            };
            let change = normal.scaled(rebound * approach) + tangential.scaled(grip);
            particles.velocities[i] -= change.scaled(w_i * share);
            particles.velocities[j] += change.scaled(w_j * share);
        }
        let push = normal.scaled(recovery * (distance - apart));
        particles.positions[i] += push.scaled(w_i * share);
        particles.positions[j] -= push.scaled(w_j * share);
    }
}

/// A pair that may or may not be in contact changes the counts N of its two particles, and with
/// them the share g of all that these touch.
fn uncertain_spread(particles: &mut Particles, found: &ContactPairs) {
    let mut counted_differently = vec![false; particles.len()];
    for &particle in found.uncertain.iter().flatten() {
        counted_differently[particle as usize] = true;
        particles.uncertain[particle as usize] = true;
    }
    for pair in &found.pairs {
        if pair.iter().any(|&particle| counted_differently[particle as usize]) {
            pair.iter().for_each(|&particle| particles.uncertain[particle as usize] = true);
        }
    }
}
