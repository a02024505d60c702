//! NUMERICS §10, `measure`: figures of a state.

use cloth_core::{Model, stepper::ColliderState};

use crate::{
    Number, Particles, Vector, bending::bending_energies, buckling::spring_energy_doubled,
    collider_response::penetration_max, membrane::membrane_figures, spring_forces::spring_force_on,
};

/// Figures of a state, as in [`Measures`](cloth_core::Measures).
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures<N> {
    /// Largest l/L - 1 of the springs whose strain is measured.
    pub strain_max: N,
    /// A particle of that spring.
    pub strain_particle: u32,
    /// Mean of |l/L - 1|.
    pub strain_mean: N,
    /// Deepest intrusion into a collider \[m\].
    pub penetration_max: N,
    /// Kinetic energy \[J\].
    pub energy_kinetic: N,
    /// Energy of the springs \[J\].
    pub energy_elastic: N,
    /// Energy in gravity and uniform fields \[J\].
    pub energy_potential: N,
    /// Linear momentum \[kg m/s\].
    pub momentum: Vector<N>,
    /// |sum of spring forces| / sum of |spring force|, which is zero but for rounding.
    pub momentum_drift: N,
}

/// Measures a state.
#[must_use]
pub fn measure<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    colliders: &[ColliderState],
) -> Figures<N> {
    let mut figures = Figures {
        penetration_max: penetration_max(model, particles, colliders),
        ..Figures::default()
    };
    particle_sums(model, particles, &mut figures);
    spring_sums(model, particles, &mut figures);
    fabric_sums(model, particles, &mut figures);
    figures
}

/// Energy of triangles of fabric, and their larger principal stretches, which count as the strain of both ends of a spring.
fn fabric_sums<N: Number>(model: &Model, particles: &Particles<N>, figures: &mut Figures<N>) {
    let add = |sum: N, term: N| sum.plus_in_double(term, particles.epsilon);
    let (springs, triangles) = (model.springs().len(), model.elements().triangles());
    let mut largest = (springs > 0).then_some(figures.strain_max);
    let mut sum = N::ZERO;
    let bent = bending_energies(model, particles);
    let stretched = membrane_figures(model, particles);
    for ((triangle, (energy, stretch)), bent) in triangles.iter().zip(stretched).zip(bent) {
        let strain = stretch - N::ONE;
        sum = add(sum, strain.abs());
        figures.energy_elastic = add(figures.energy_elastic, energy + bent);
        if largest.is_none_or(|largest| strain.value() > largest.value()) {
            figures.strain_particle = triangle.particles[0];
        }
        largest = Some(largest.map_or(strain, |largest| largest.max(strain)));
    }
    figures.strain_max = largest.unwrap_or_default();
    let all = (springs + triangles.len()).max(1) as f64;
    let of_springs = figures.strain_mean * N::exact(springs as f64);
    figures.strain_mean = (of_springs + sum) / N::exact(all);
}

fn particle_sums<N: Number>(model: &Model, particles: &Particles<N>, figures: &mut Figures<N>) {
    let add = |sum: N, term: N| sum.plus_in_double(term, particles.epsilon);
    let half = N::exact(0.5);
    let acceleration = Vector::rounded(model.uniform_acceleration());
    for (i, &mass) in model.masses().iter().enumerate() {
        let mass = N::rounded(mass);
        let [x, v] = [particles.positions[i], particles.velocities[i]];
        figures.energy_kinetic = add(figures.energy_kinetic, half * mass * v.dot(v));
        figures.energy_potential = add(figures.energy_potential, -(mass * acceleration.dot(x)));
        figures.momentum = figures.momentum.each(v.scaled(mass), add);
    }
}

/// What the springs of one particle add up to.
#[derive(Clone, Copy, Default)]
struct Row<N> {
    strain: N,
    /// Twice the energy of each spring.
    energy: N,
    force: Vector<N>,
    force_magnitude: N,
}

/// Each spring counts for both its particles. The rows are short and summed in the precision of the
/// backend, the sums over all rows in double precision.
fn spring_sums<N: Number>(model: &Model, particles: &Particles<N>, figures: &mut Figures<N>) {
    let (springs, epsilon) = (model.springs(), particles.epsilon);
    let mut rows = vec![Row::default(); particles.len()];
    let mut largest: Option<(N, u32)> = None;
    let measured = springs.strain_measured();
    for spring in springs.iter() {
        let kind = springs.kinds()[spring.kind as usize];
        let rest_length = N::rounded(kind.rest_length);
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let length = (particles.positions[j] - particles.positions[i]).length();
        let extension = length - rest_length;
        let strain = extension / rest_length;
        if measured[spring.kind as usize] {
            let (before, particle) = largest.unwrap_or((strain, i as u32));
            let is_larger = strain.value() > before.value();
            largest = Some((before.max(strain), if is_larger { i as u32 } else { particle }));
        }
        let force = spring_force_on(model, particles, &spring);
        let energy_doubled = spring_energy_doubled(&kind, length, epsilon);
        rows[i].force += force;
        rows[j].force -= force;
        for row in [i, j] {
            rows[row].strain += strain.abs();
            rows[row].energy += energy_doubled;
            rows[row].force_magnitude += force.length();
        }
    }
    let add = |sum: N, term: N| sum.plus_in_double(term, epsilon);
    let sum = |part: fn(&Row<N>) -> N| rows.iter().map(part).fold(N::ZERO, add);
    let ends = N::exact(2.0 * springs.len().max(1) as f64);
    (figures.strain_max, figures.strain_particle) = largest.unwrap_or_default();
    figures.strain_mean = sum(|row| row.strain) / ends;
    figures.energy_elastic = N::exact(0.25) * sum(|row| row.energy);
    let total = rows.iter().fold(Vector::ZERO, |sum, row| sum.each(row.force, add));
    let magnitude = sum(|row| row.force_magnitude);
    if magnitude.value() > 0.0 {
        figures.momentum_drift = total.length() / magnitude;
    }
}
