//! NUMERICS §6: the constant system, and the pieces of cloth.

use cloth_core::{FabricMatrix, Model};

use super::Particles;
use crate::tracked::{Tracked, TrackedVector};

/// W y - b for a solution y, zero but for rounding; zero too for held particles, which have no row.
#[must_use]
pub fn semi_implicit_residual(
    model: &Model,
    particles: &Particles,
    forces: &[TrackedVector],
    solution: &[TrackedVector],
    length: f64,
) -> Vec<TrackedVector> {
    let length = Tracked::rounded(length);
    let is_held = |i: usize| particles.inverse_masses[i].value == 0.0;
    let mut residual: Vec<_> = (0..particles.len())
        .map(|i| {
            let mass = Tracked::rounded(model.masses()[i]);
            solution[i].scaled(mass) - forces[i].scaled(length)
        })
        .collect();
    for spring in model.springs().iter() {
        let kind = model.springs().kinds()[spring.kind as usize];
        let [stiffness, damping] = [kind.stiffness, kind.damping].map(Tracked::rounded);
        let weight = length * length * stiffness + length * damping;
        let [a, b] = spring.particles.map(|particle| particle as usize);
        for (i, j) in [(a, b), (b, a)] {
            residual[i] += solution[i].scaled(weight);
            residual[i] -= solution[j].scaled(weight);
            let difference = particles.velocities[j] - particles.velocities[i];
            residual[i] -= difference.scaled(stiffness).scaled(length * length);
        }
    }
    if model.has_fabric() {
        let fabric = FabricMatrix::constant(model);
        for i in 0..particles.len() {
            let own = fabric.own()[i];
            residual[i] += solution[i].scaled(Tracked::rounded(own.weight(length.value)));
            let entries = &fabric.entries()[fabric.row(i)];
            for (&j, entry) in fabric.neighbours().row(i).iter().zip(entries) {
                let j = j as usize;
                residual[i] += solution[j].scaled(Tracked::rounded(entry.weight(length.value)));
                let difference = particles.velocities[j] - particles.velocities[i];
                let stiffness = Tracked::rounded(entry.stiffness);
                residual[i] += difference.scaled(stiffness).scaled(length * length);
            }
        }
    }
    for i in (0..particles.len()).filter(|&i| is_held(i)) {
        residual[i] = TrackedVector::ZERO;
    }
    residual
}

/// Particles that springs and triangles of fabric join, each piece ascending; those alone are pieces of one.
#[must_use]
pub fn pieces(model: &Model) -> Vec<Vec<u32>> {
    let mut label: Vec<usize> = (0..model.particle_count()).collect();
    // Labels sink along springs until none can: slow and plain.
    let mut sinks = true;
    while sinks {
        sinks = false;
        let springs = model.springs().iter().map(|spring| spring.particles);
        let triangles = model.elements().triangles().iter().map(|triangle| triangle.particles);
        let sides = triangles.flat_map(|[a, b, c]| [[a, b], [b, c]]);
        for pair in springs.chain(sides) {
            let [a, b] = pair.map(|particle| particle as usize);
            let lowest = label[a].min(label[b]);
            sinks |= label[a] != lowest || label[b] != lowest;
            (label[a], label[b]) = (lowest, lowest);
        }
    }
    let mut pieces = vec![Vec::new(); label.len()];
    for (particle, &label) in label.iter().enumerate() {
        pieces[label].push(particle as u32);
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}
