//! Every block of the matrix against central differences of the forces.

use cloth_core::{
    Air, ContactResponse, GridPatch, Model, ModelBuilder, SelfContact, SpringKind, State,
};
use glam::DVec3;
use harness::{
    models::{grid_cloth, material},
    random::Random,
};

use crate::{
    implicit_rig::{Shape, assemble, kernels, matrix, network_model, random_state},
    rig::{build, in_double},
};

/// Step of the differences relative to the size of a force: the error of central differences is
/// the step squared, that of rounding eps / step.
const STEP: f64 = 1e-5;

type Matrix3 = [[f64; 3]; 3];

/// Central differences of a force by three numbers.
fn differences(step: f64, force: impl Fn(DVec3) -> DVec3) -> Matrix3 {
    let columns = DVec3::AXES.map(|axis| (force(axis * step) - force(-axis * step)) / (2.0 * step));
    std::array::from_fn(|row| columns.map(|column| column[row]))
}

fn norm(matrix: &Matrix3) -> f64 {
    matrix.iter().flatten().map(|entry| entry * entry).sum::<f64>().sqrt()
}

fn combine(a: &Matrix3, factor: f64, b: &Matrix3) -> Matrix3 {
    std::array::from_fn(|row| std::array::from_fn(|k| a[row][k] + factor * b[row][k]))
}

/// The force of NUMERICS section 2 on the first particle of a spring.
fn spring_force(kind: &SpringKind, difference: DVec3, approach: DVec3) -> DVec3 {
    let length = difference.length();
    let normal = difference / length.max(1e-18);
    (kind.stiffness * (length - kind.rest_length) + kind.damping * approach.dot(normal)) * normal
}

/// h^2 df/dx + h df/dv of the elastic force and of the damper at a direction that stays: what the
/// matrix is to hold, but for the across part of compressed springs.
fn spring_block(kind: &SpringKind, difference: DVec3, length: f64) -> Matrix3 {
    let elastic = SpringKind { damping: 0.0, ..*kind };
    let step = STEP * difference.length();
    let by_position =
        differences(step, |change| spring_force(&elastic, difference + change, DVec3::ZERO));
    // Linear: the step does not matter.
    let by_velocity = differences(1.0, |change| spring_force(kind, difference, change));
    let zero = [[0.0; 3]; 3];
    let block = combine(&zero, length * length, &by_position);
    combine(&block, length, &by_velocity)
}

/// The part of a block along the spring alone.
fn along(block: &Matrix3, normal: DVec3) -> Matrix3 {
    let image = DVec3::from_array(std::array::from_fn(|row| DVec3::from(block[row]).dot(normal)));
    let factor = image.dot(normal);
    std::array::from_fn(|row| std::array::from_fn(|k| factor * normal[row] * normal[k]))
}

#[test]
fn blocks_of_springs_are_the_derivatives_of_their_force() {
    let mut random = Random::new(9);
    let [mut stretched, mut compressed, mut coinciding] = [0; 3];
    for case in 0..300 {
        let shape = Shape::ALL[case % 3];
        let model = network_model(8, &mut random);
        let state = random_state(&model, shape, &mut random);
        let length = random.logarithmic(1e-3, 1.0 / 30.0);
        for candidate in in_double() {
            let (mut kernels, substep) = kernels(candidate, &model, &state, length);
            assemble(&mut *kernels, &substep);
            let blocks = matrix(&mut *kernels);
            for block in blocks.iter().filter(|block| block.row < block.column) {
                let place = [block.row, block.column];
                let spring = model.springs().iter().find(|s| s.particles == place).unwrap();
                let kind = &model.springs().kinds()[spring.kind as usize];
                let [a, b] = place.map(|i| DVec3::from(state.positions[i as usize]));
                let distance = a.distance(b);
                let found = combine(&[[0.0; 3]; 3], -1.0, &block.entries);
                assert!(found.iter().flatten().all(|entry| entry.is_finite()), "{place:?}");
                if distance < 1e-9 {
                    // No direction that differences could keep to: finite, and in no direction more than
                    // k h^2 + c h.
                    let largest = length * length * kind.stiffness + length * kind.damping;
                    let is_bounded = |entry: &f64| entry.abs() <= 1.001 * largest;
                    assert!(found.iter().flatten().all(is_bounded), "{place:?}: {found:?}");
                    coinciding += 1;
                    continue;
                }
                let mut expected = spring_block(kind, b - a, length);
                if distance < kind.rest_length {
                    // Dropped exactly: what is left is along the spring.
                    expected = along(&expected, (b - a) / distance);
                    compressed += 1;
                } else {
                    stretched += 1;
                }
                // Rounding of positions, relative to the length of the spring, adds to that of
                // the differences.
                let tolerance = (1e-6 + 1e-15 / distance / STEP) * norm(&expected);
                let error = norm(&combine(&found, -1.0, &expected));
                assert!(error <= tolerance, "{place:?}: {found:?}, {expected:?}");
            }
        }
    }
    assert!(stretched > 500 && compressed > 500 && coinciding > 50, "of each kind some");
}

/// Diagonal blocks are the mass and minus the sum of the others in the row.
#[test]
fn rows_of_blocks_sum_up_to_the_mass() {
    let mut random = Random::new(10);
    for shape in Shape::ALL {
        let model = network_model(12, &mut random);
        let state = random_state(&model, shape, &mut random);
        for candidate in in_double() {
            let (mut kernels, substep) = kernels(candidate, &model, &state, 0.01);
            assemble(&mut *kernels, &substep);
            let mut sums = vec![[[0.0; 3]; 3]; model.particle_count()];
            let mut sizes = vec![0.0; model.particle_count()];
            for block in matrix(&mut *kernels) {
                let row = block.row as usize;
                sums[row] = combine(&sums[row], 1.0, &block.entries);
                sizes[row] += norm(&block.entries);
            }
            for (i, sum) in sums.iter().enumerate() {
                let mut rest = *sum;
                (0..3).for_each(|k| rest[k][k] -= model.masses()[i]);
                assert!(norm(&rest) <= 1e-14 * sizes[i], "particle {i}: {rest:?}");
            }
        }
    }
}

fn forces(model: &std::sync::Arc<Model>, state: &State) -> Vec<DVec3> {
    let candidate = in_double().next().unwrap();
    let (mut kernels, substep) = kernels(candidate, model, state, 0.01);
    kernels.field_forces().unwrap();
    kernels.aerodynamic_forces(&substep).unwrap();
    let mut forces = Vec::new();
    kernels.forces_read(&mut forces).unwrap();
    forces.into_iter().map(DVec3::from).collect()
}

/// The block of a particle holds h times minus the derivative of the force of the air by a velocity
/// that all particles have in common.
#[test]
fn the_jacobian_of_the_air_has_the_row_sums_of_the_true_one() {
    let mut fabric = material(0.01, 20.0, 1e-3);
    fabric.aerodynamics.pressure = 1.1;
    fabric.aerodynamics.friction = 0.3;
    let air = Air::with_wind([3.0, 1.0, -2.0]);
    let patch = GridPatch::horizontal(5, 0.1, 0.0);
    let model =
        build(ModelBuilder::new().gravity([0.0; 3]).air(air).cloth(grid_cloth("p", patch, fabric)));
    let mut random = Random::new(11);
    let length = 0.01;
    let candidate = in_double().next().unwrap();
    for _ in 0..20 {
        let mut state = model.initial_state();
        for i in 0..state.len() {
            let shift = random.vector(0.03);
            state.positions[i] = std::array::from_fn(|k| state.positions[i][k] + shift[k]);
            state.velocities[i] = random.vector(1.0);
        }
        let (mut kernels, substep) = kernels(candidate, &model, &state, length);
        assemble(&mut *kernels, &substep);
        let mut sums = vec![[[0.0; 3]; 3]; model.particle_count()];
        for block in matrix(&mut *kernels) {
            let row = block.row as usize;
            sums[row] = combine(&sums[row], 1.0, &block.entries);
        }
        for (i, sum) in sums.iter().enumerate() {
            let derivative = differences(1e-5, |change| {
                let mut state = state.clone();
                for v in &mut state.velocities {
                    *v = (DVec3::from(*v) + change).into();
                }
                forces(&model, &state)[i]
            });
            let mut expected = combine(&[[0.0; 3]; 3], -length, &derivative);
            (0..3).for_each(|k| expected[k][k] += model.masses()[i]);
            let error = norm(&combine(sum, -1.0, &expected));
            // Relative to the part of the air alone.
            let part = length * norm(&derivative);
            assert!(error <= 1e-6 * part, "particle {i}: {sum:?}, {expected:?}");
        }
    }
}

/// A penalty force is linearised along the normal, as one of a spring is, without its across part.
#[test]
fn blocks_of_contacts_are_along_the_normal() {
    let [distance, stiffness, damping, length] = [0.05, 300.0, 0.2, 0.01];
    let mut random = Random::new(12);
    let response = ContactResponse::Penalty { stiffness, damping };
    let kind = SpringKind {
        class: cloth_core::SpringClass::Stretch,
        rest_length: distance,
        stiffness,
        damping,
        rigidity: None,
    };
    let mut pairs = 0;
    for _ in 0..30 {
        let places: Vec<_> = (0..12).map(|_| random.vector(0.06)).collect();
        let cloth = crate::rig::particles(&places, [0.0; 3]);
        let contact = SelfContact { distance, response };
        let model = build(ModelBuilder::new().cloth(cloth).self_contact(contact));
        let mut state = model.initial_state();
        state.velocities.iter_mut().for_each(|v| *v = random.vector(1.0));
        for candidate in in_double() {
            let (mut kernels, substep) = kernels(candidate, &model, &state, length);
            assemble(&mut *kernels, &substep);
            for block in matrix(&mut *kernels).iter().filter(|block| block.row < block.column) {
                let [a, b] = [block.row, block.column].map(|i| DVec3::from(places[i as usize]));
                assert!(a.distance(b) < distance);
                let expected = along(&spring_block(&kind, b - a, length), (b - a) / a.distance(b));
                let found = combine(&[[0.0; 3]; 3], -1.0, &block.entries);
                let error = norm(&combine(&found, -1.0, &expected));
                assert!(error <= 1e-6 * norm(&expected), "{found:?}, {expected:?}");
                pairs += 1;
            }
        }
    }
    assert!(pairs > 100, "only {pairs} pairs");
}
