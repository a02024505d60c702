//! NUMERICS §8: contact of cloth with itself.

use cloth_core::{ContactResponse, Model, SelfContact};

use crate::{Number, Particles, Vector};

/// Squares of distances \[m^2\] up to this have no normal.
const LENGTH_SQUARED_MIN: f64 = 1e-14;

/// Places along an axis that are more than this many contact distances apart belong to no pair: one would do, but for rounding.
const SWEEP: f64 = 2.0;

/// The pairs of particles that are in contact.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ContactPairs {
    /// Pairs (i, j), i < j, ascending.
    pub pairs: Vec<[u32; 2]>,
    /// Those of all pairs, in contact or not, for which rounding decides.
    pub uncertain: Vec<[u32; 2]>,
}

/// `contact_candidates`: all pairs in contact, closer than the contact distance and not left out by the response. Particles are
/// sorted along the axis in which they spread most, so that far ones need not be compared.
#[must_use]
pub fn contact_candidates<N: Number>(model: &Model, particles: &Particles<N>) -> ContactPairs {
    let mut found = ContactPairs::default();
    let Some(contact) = model.self_contact() else { return found };
    let distance = N::rounded(contact.distance);
    let axis = widest_axis(particles);
    let place = |i: u32| particles.positions[i as usize].0[axis].value();
    let mut order: Vec<u32> = (0..particles.len() as u32).collect();
    order.sort_by(|&i, &j| place(i).total_cmp(&place(j)));
    for (number, &i) in order.iter().enumerate() {
        let reach = place(i) + SWEEP * contact.distance;
        for &j in order[number + 1..].iter().take_while(|&&j| place(j) <= reach) {
            let pair = [i.min(j), i.max(j)];
            let [a, b] = pair.map(|particle| particles.positions[particle as usize]);
            let length = (a - b).length();
            let is_near = length.value() < distance.value();
            let is_uncertain = length.is_close(distance, particles.epsilon);
            if (is_uncertain || is_near) && !is_left_out(model, contact, pair) {
                found.pairs.extend(is_near.then_some(pair));
                found.uncertain.extend(is_uncertain.then_some(pair));
            }
        }
    }
    found.pairs.sort_unstable();
    found.uncertain.sort_unstable();
    found
}

fn widest_axis<N: Number>(particles: &Particles<N>) -> usize {
    let width = |axis: usize| {
        let places = particles.positions.iter().map(|x| x.0[axis].value());
        let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
            [low.min(place), high.max(place)]
        });
        high - low
    };
    (1..3).fold(0, |widest, axis| if width(axis) > width(widest) { axis } else { widest })
}

/// Whether the response leaves a pair out: joined by a spring, or close at the start.
fn is_left_out(model: &Model, contact: &SelfContact, [i, j]: [u32; 2]) -> bool {
    let at_start = |i: u32| Vector::<f64>::exact(model.positions()[i as usize]);
    contact.excludes_neighbours()
        && (model.joins(i, j) || (at_start(i) - at_start(j)).length() < contact.distance)
}

/// Adds the penalty force of these pairs to both particles.
pub fn contact_forces<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    pairs: &[[u32; 2]],
    forces: &mut [Vector<N>],
) {
    let Some(contact) = model.self_contact() else { return };
    let ContactResponse::Penalty { stiffness, damping } = contact.response else { return };
    let [distance, stiffness, damping] = [contact.distance, stiffness, damping].map(N::rounded);
    // From zero for each particle, then added.
    let mut sums = vec![Vector::ZERO; forces.len()];
    for pair in pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let difference = particles.positions[i] - particles.positions[j];
        if !has_normal(particles, [i, j], difference) {
            continue;
        }
        let length = difference.length();
        let normal = difference.divided(length);
        let separation = (particles.velocities[i] - particles.velocities[j]).dot(normal);
        let force = normal.scaled(stiffness * (distance - length) - damping * separation);
        sums[i] += force;
        sums[j] -= force;
    }
    for (force, sum) in forces.iter_mut().zip(sums) {
        *force += sum;
    }
}

/// Whether two particles are far enough apart for a normal.
pub(crate) fn has_normal<N: Number>(
    particles: &mut Particles<N>,
    pair: [usize; 2],
    difference: Vector<N>,
) -> bool {
    let (squared, smallest) = (difference.dot(difference), N::rounded(LENGTH_SQUARED_MIN));
    particles.doubt(pair, squared, smallest);
    squared.value() > smallest.value()
}

/// Momentum exchange and separation of these pairs, all from the old state.
pub fn contact_impulses<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    pairs: &[[u32; 2]],
    length: f64,
) {
    let Some(contact) = model.self_contact() else { return };
    let ContactResponse::Impulse { restitution, friction } = contact.response else { return };
    let mut counts = vec![0_u32; particles.len()];
    pairs.iter().flatten().for_each(|&particle| counts[particle as usize] += 1);
    let [distance, restitution, friction] =
        [contact.distance, restitution, friction].map(N::rounded);
    let rebound = N::ONE + restitution;
    let recovery = N::rounded(SelfContact::recovery(length));
    let old = particles.clone();
    for pair in pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let [w_i, w_j] = [old.inverse_masses[i], old.inverse_masses[j]];
        let difference = old.positions[i] - old.positions[j];
        let is_held = w_i.value() + w_j.value() == 0.0;
        if is_held || !has_normal(particles, [i, j], difference) {
            continue;
        }
        let apart = difference.length();
        let count = N::exact(f64::from(counts[i].max(counts[j])));
        let share = N::ONE / count / (w_i + w_j);
        let normal = difference.divided(apart);
        let relative = old.velocities[i] - old.velocities[j];
        let approach = relative.dot(normal);
        // Near zero rounding decides on the branch; what it does is then near zero as well.
        if approach.value() < 0.0 || approach.is_close(N::ZERO, old.epsilon) {
            let approach = approach.min(N::ZERO);
            let tangential = relative - normal.scaled(approach);
            let slip = tangential.length();
            let grip = if slip.value() > 0.0 {
                N::ONE.min(friction * rebound * approach.abs() / slip)
            } else {
                N::ONE
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

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, GridPatch, MaterialPreset, ModelBuilder};

    use super::*;

    #[test]
    fn the_pairs_are_those_found_by_trying_all() {
        let patch = GridPatch::horizontal(13, 0.02, 0.0);
        let response = ContactResponse::Penalty { stiffness: 1.0, damping: 0.0 };
        let model = ModelBuilder::new()
            .cloth(Cloth::grid("patch", patch, &MaterialPreset::ALL[0]))
            .self_contact(SelfContact { distance: 0.03, response })
            .build()
            .unwrap();
        let mut particles = Particles::<f64>::new(&model, &model.initial_state(), f64::EPSILON);
        // Crumpled, stretched along each axis in turn.
        for axis in 0..3 {
            for (i, x) in particles.positions.iter_mut().enumerate() {
                let wave = |rate: f64| (rate * i as f64).sin();
                x.0 = [0.06 * wave(1.3), 0.05 * wave(2.1), 0.04 * wave(0.7)];
                x.0[axis] *= 5.0;
            }
            let all = (0..particles.len() as u32).flat_map(|j| (0..j).map(move |i| [i, j])).filter(
                |pair| {
                    let [a, b] = pair.map(|i| particles.positions[i as usize]);
                    (a - b).length() < 0.03
                },
            );
            let mut all: Vec<_> = all.collect();
            all.sort_unstable();
            assert!(all.len() > 20, "{} pairs", all.len());
            assert_eq!(contact_candidates(&model, &particles).pairs, all);
        }
    }
}
