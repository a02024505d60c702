//! NUMERICS §10: figures of a state.

use cloth_core::{Model, stepper::ColliderState};

use super::{Particles, ZERO, penetration_max, spring_energy_doubled, spring_force_on};
use crate::tracked::{Tracked, TrackedVector};

/// [`Measures`](cloth_core::Measures) with bounds.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrackedMeasures {
    /// Largest l/L - 1 of the springs whose strain is measured.
    pub strain_max: Tracked,
    /// Mean of |l/L - 1|.
    pub strain_mean: Tracked,
    /// Deepest intrusion into a collider.
    pub penetration_max: Tracked,
    /// Kinetic energy.
    pub energy_kinetic: Tracked,
    /// Energy of the springs.
    pub energy_elastic: Tracked,
    /// Energy in gravity and uniform fields.
    pub energy_potential: Tracked,
    /// Linear momentum.
    pub momentum: TrackedVector,
    /// Bound of |sum of spring forces| / sum of |spring force|, which is zero but for rounding.
    pub momentum_drift: Tracked,
}

/// Measures a state.
#[must_use]
pub fn measure(
    model: &Model,
    particles: &Particles,
    colliders: &[ColliderState],
    epsilon: f64,
) -> TrackedMeasures {
    let mut measures = TrackedMeasures {
        penetration_max: penetration_max(model, particles, colliders, epsilon),
        ..TrackedMeasures::default()
    };
    particle_sums(model, particles, &mut measures, epsilon);
    spring_sums(model, particles, &mut measures, epsilon);
    measures
}

fn particle_sums(
    model: &Model,
    particles: &Particles,
    measures: &mut TrackedMeasures,
    epsilon: f64,
) {
    let add = |sum: Tracked, term: Tracked| sum.plus_in_double(term, epsilon);
    let half = Tracked::exact(0.5);
    let acceleration = TrackedVector::rounded(model.uniform_acceleration());
    for (i, &mass) in model.masses().iter().enumerate() {
        let mass = Tracked::rounded(mass);
        let [position, velocity] = [particles.positions[i], particles.velocities[i]];
        measures.energy_kinetic =
            add(measures.energy_kinetic, half * mass * velocity.dot(velocity));
        measures.energy_potential =
            add(measures.energy_potential, -(mass * acceleration.dot(position)));
        measures.momentum = measures.momentum.each(velocity.scaled(mass), add);
    }
}

/// What the springs of one particle add up to.
#[derive(Clone, Copy, Default)]
struct Row {
    strain: Tracked,
    /// Twice the energy of each spring.
    energy: Tracked,
    force: TrackedVector,
    force_magnitude: Tracked,
}

/// Each spring counts for both its particles. The rows are short and summed in the precision of the
/// backend, the sums over all rows in double precision.
fn spring_sums(model: &Model, particles: &Particles, measures: &mut TrackedMeasures, epsilon: f64) {
    let springs = model.springs();
    let mut rows = vec![Row::default(); particles.len()];
    let mut strain_max: Option<Tracked> = None;
    let measured = springs.strain_measured();
    for spring in springs.iter() {
        let kind = springs.kinds()[spring.kind as usize];
        let rest_length = Tracked::rounded(kind.rest_length);
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let length = (particles.positions[j] - particles.positions[i]).length();
        let extension = length - rest_length;
        let strain = extension / rest_length;
        if measured[spring.kind as usize] {
            strain_max = Some(strain_max.map_or(strain, |max| max.max(strain)));
        }
        let force = spring_force_on(model, particles, &spring, epsilon);
        let energy_doubled = spring_energy_doubled(&kind, length, epsilon);
        rows[i].force += force;
        rows[j].force -= force;
        for row in [i, j] {
            rows[row].strain += strain.abs();
            rows[row].energy += energy_doubled;
            rows[row].force_magnitude += force.length();
        }
    }
    let add = |sum: Tracked, term: Tracked| sum.plus_in_double(term, epsilon);
    let sum = |part: fn(&Row) -> Tracked| rows.iter().map(part).fold(ZERO, add);
    let ends = Tracked::exact(2.0 * springs.len().max(1) as f64);
    measures.strain_max = strain_max.unwrap_or(ZERO);
    measures.strain_mean = sum(|row| row.strain) / ends;
    measures.energy_elastic = Tracked::exact(0.25) * sum(|row| row.energy);
    let total = rows.iter().fold(TrackedVector::ZERO, |sum, row| sum.each(row.force, add));
    let magnitude = sum(|row| row.force_magnitude);
    if magnitude.value > 0.0 {
        measures.momentum_drift = total.length() / magnitude;
    }
}
