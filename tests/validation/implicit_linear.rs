//! Every linear solver against elimination on the dense matrix, under constraints.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderShape, GridPatch, Kernels, LinearMethod, LinearOutcome, LinearSettings,
    LinearStart, LinearVector, Model, ModelBuilder, Pose, Precision, Preconditioner, State,
};
use harness::{
    backends::{Candidate, candidates_with},
    dense::{Dense, flat},
    feature::Feature,
    linear::{LINEAR_METHODS, MATRIX_FORMS, PRECONDITIONERS},
    models::{grid_cloth, material},
    random::Random,
};

use crate::{
    implicit_rig::{assemble, kernels_moving, matrix, vector},
    rig::build,
};

const LENGTH: f64 = 0.01;

/// A damped patch that two moving pins hold, that a moving floor stops in a corner, and that slides
/// along a moving wall.
fn problem(candidate: &Candidate) -> (Arc<Model>, State, Vec<Pose>) {
    let mut fabric = material(1e-3, 50.0, 2e-3);
    fabric.stretch.damping = 0.02;
    let mut cloth = grid_cloth("patch", GridPatch::horizontal(5, 0.05, 0.0), fabric);
    cloth.pins = vec![0, 4];
    let solid = |name: &str, translation, normal, friction| Collider {
        name: name.into(),
        shape: ColliderShape::Plane,
        pose: Pose::from_z_axis(translation, normal),
        friction,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new()
        .cloth(cloth)
        .collider(solid("floor", [0.0, 0.0, -0.02], [0.0, 0.0, 1.0], 0.8))
        .collider(solid("wall", [0.12, 0.0, 0.0], [-1.0, 0.3, 0.0], 0.0));
    let model = build(builder);
    let mut state = model.initial_state();
    let mut random = Random::new(21);
    for i in 0..state.len() {
        let shift = random.vector(0.015);
        state.positions[i] = std::array::from_fn(|k| state.positions[i][k] + shift[k]);
        state.velocities[i] = random.vector(0.5);
        state.velocities[i][2] -= 1.0;
    }
    let mut targets = state.colliders.clone();
    targets[0].translation[2] += 0.3 * LENGTH;
    targets[1].translation[0] -= 0.2 * LENGTH;
    (model, candidate.rounded(&state), targets)
}

fn prepared(candidate: &Candidate) -> Box<dyn Kernels> {
    let (model, state, targets) = problem(candidate);
    let (mut kernels, substep) = kernels_moving(candidate, &model, &state, &targets, LENGTH);
    kernels.collider_constraints(&substep).unwrap();
    assemble(&mut *kernels, &substep);
    kernels
}

/// The system under constraints, as it stands in the kernels.
struct Reference {
    matrix: Dense,
    right_side: Vec<f64>,
    filter: Dense,
    /// z.
    asked: Vec<f64>,
}

impl Reference {
    fn new(kernels: &mut dyn Kernels) -> Self {
        let particles = kernels.model().particle_count();
        let matrix = Dense::from_blocks(&matrix(kernels), particles);
        let right_side = flat(&vector(kernels, LinearVector::RightSide));
        let mut filter = Dense::zero(3 * particles);
        for axis in 0..3 {
            let unit: [f64; 3] = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
            kernels.vector_write(LinearVector::Direction, &vec![unit; particles]).unwrap();
            kernels.constraint_filter(LinearVector::Direction).unwrap();
            for (i, column) in vector(kernels, LinearVector::Direction).iter().enumerate() {
                (0..3).for_each(|row| *filter.at(3 * i + row, 3 * i + axis) = column[row]);
            }
        }
        kernels.vector_write(LinearVector::Direction, &vec![[0.0; 3]; particles]).unwrap();
        kernels.constraint_project(LinearVector::Direction).unwrap();
        let asked = flat(&vector(kernels, LinearVector::Direction));
        Self { matrix, right_side, filter, asked }
    }

    /// S (b - A y).
    fn residual(&self, y: &[f64]) -> Vec<f64> {
        let image = self.matrix.apply(y);
        let rest: Vec<f64> = self.right_side.iter().zip(&image).map(|(b, a)| b - a).collect();
        self.filter.apply(&rest)
    }

    /// z + the solution of (S A S + I - S) x = S (b - A z).
    fn solution(&self) -> Vec<f64> {
        let size = self.matrix.size();
        let mut constrained = Dense::zero(size);
        for column in 0..size {
            let mut unit = vec![0.0; size];
            unit[column] = 1.0;
            let free = self.filter.apply(&unit);
            let image = self.filter.apply(&self.matrix.apply(&free));
            for row in 0..size {
                *constrained.at(row, column) = image[row] + unit[row] - free[row];
            }
        }
        let free = constrained.solve(&self.residual(&self.asked));
        self.asked.iter().zip(&free).map(|(z, x)| z + x).collect()
    }
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// All settings that lead to different arithmetic and that a candidate offers.
fn all_settings(candidate: &Candidate, tolerance: f64) -> Vec<(LinearMethod, LinearSettings)> {
    let mut all = Vec::new();
    for &method in LINEAR_METHODS {
        // Others do not look at it.
        let used =
            if method == LinearMethod::ConjugateGradient { PRECONDITIONERS.len() } else { 1 };
        for &preconditioner in &PRECONDITIONERS[..used] {
            for &matrix in MATRIX_FORMS {
                let settings = LinearSettings {
                    method,
                    preconditioner,
                    matrix,
                    tolerance,
                    iterations_max: 20_000,
                    ..LinearSettings::default()
                };
                all.push((method, settings));
            }
        }
    }
    all.retain(|(_, settings)| candidate.offers_linear(settings));
    all
}

fn solve(
    kernels: &mut dyn Kernels,
    settings: &LinearSettings,
    start: LinearStart,
) -> LinearOutcome {
    let solver = settings.method.solver::<dyn Kernels>();
    solver.prepare(kernels, settings).unwrap();
    solver.solve(kernels, settings, start).unwrap()
}

const fn tolerances(precision: Precision) -> &'static [f64] {
    match precision {
        Precision::F32 => &[1e-2, 1e-5],
        Precision::F64 => &[1e-3, 1e-6, 1e-12],
    }
}

#[test]
fn the_problem_has_constraints_of_every_kind() {
    for candidate in candidates_with(Feature::Implicit) {
        let mut kernels = prepared(candidate);
        let reference = Reference::new(&mut *kernels);
        let rank =
            |i: usize| (0..3).map(|k| reference.filter.row(3 * i + k)[3 * i + k]).sum::<f64>();
        let particles = reference.asked.len() / 3;
        for wanted in [0.0, 2.0, 3.0] {
            let count = (0..particles).filter(|&i| (rank(i) - wanted).abs() < 1e-5).count();
            assert!(count >= 2, "{}: {count} with {wanted} free directions", candidate.label);
        }
        assert!(norm(&reference.asked) > 1.0, "changes of velocity are asked for");
    }
}

/// |y - y*| is at most |r| / m, as A is at least the mass; r is the tolerance asked for, or what is
/// left by rounding.
#[test]
fn every_solver_agrees_with_elimination() {
    for candidate in candidates_with(Feature::Implicit) {
        for &tolerance in tolerances(candidate.precision) {
            for (method, settings) in all_settings(candidate, tolerance) {
                let mut kernels = prepared(candidate);
                let reference = Reference::new(&mut *kernels);
                let expected = reference.solution();
                let outcome = solve(&mut *kernels, &settings, LinearStart::Constraints);
                let what = format!("{} {settings:?}: {outcome:?}", candidate.label);
                assert!(outcome.converged && !outcome.breakdown, "{what}");
                let found = flat(&vector(&mut *kernels, LinearVector::Solution));
                let start = norm(&reference.residual(&reference.asked));
                let left = norm(&reference.residual(&found));
                // The residual that is carried along leaves the true one by rounding.
                let rounding = 100.0 * candidate.epsilon() * start;
                let wanted = match method {
                    LinearMethod::Direct => rounding,
                    _ => tolerance * start + rounding,
                };
                assert!(left <= wanted, "{what}: residual {left:e} of {wanted:e}");
                let reported = (outcome.residual * start - left).abs();
                assert!(reported <= 0.01 * left + rounding, "{what}: residual is {left:e}");
                let mass = kernels.model().masses()[0];
                let error = distance(&found, &expected);
                let bound = wanted / mass;
                assert!(error <= bound, "{what}: off by {error:e} of {bound:e}");
            }
        }
    }
}

/// The changes that constraints ask for come out to the rounding of one operation, whatever the
/// tolerance of the solver.
#[test]
fn constrained_directions_are_met_exactly() {
    for candidate in candidates_with(Feature::Implicit) {
        for (_, settings) in all_settings(candidate, 1e-2) {
            let mut kernels = prepared(candidate);
            let reference = Reference::new(&mut *kernels);
            solve(&mut *kernels, &settings, LinearStart::Constraints);
            let found = flat(&vector(&mut *kernels, LinearVector::Solution));
            let free = reference.filter.apply(&found);
            for (row, asked) in reference.asked.iter().enumerate() {
                let constrained = found[row] - free[row];
                // Components of a particle are of the size of its velocity, some m/s.
                let error = (constrained - asked).abs();
                assert!(
                    error <= 8.0 * candidate.epsilon(),
                    "{} {settings:?}: {error:e}",
                    candidate.label
                );
            }
        }
    }
}

#[test]
fn a_warm_start_at_the_solution_is_done_at_once() {
    for candidate in candidates_with(Feature::Implicit) {
        for (method, settings) in all_settings(candidate, 1e-4) {
            let mut kernels = prepared(candidate);
            let cold = solve(&mut *kernels, &settings, LinearStart::Constraints);
            let warm = solve(&mut *kernels, &settings, LinearStart::Solution);
            let what = format!("{} {settings:?}: {cold:?}, {warm:?}", candidate.label);
            assert!(warm.converged, "{what}");
            if method != LinearMethod::Direct {
                // Groups as large as the patch leave little to do.
                let is_schwarz = settings.preconditioner == Preconditioner::Schwarz;
                assert!((cold.iterations > 3 || is_schwarz) && warm.iterations <= 1, "{what}");
                assert!(cold.iterations > warm.iterations, "{what}");
            }
        }
    }
}

#[test]
fn a_tolerance_of_zero_runs_to_the_cap() {
    for candidate in candidates_with(Feature::Implicit) {
        for (method, settings) in all_settings(candidate, 0.0) {
            if method == LinearMethod::Direct {
                continue;
            }
            for iterations_max in [1, 7] {
                let settings = LinearSettings { iterations_max, ..settings };
                let mut kernels = prepared(candidate);
                let outcome = solve(&mut *kernels, &settings, LinearStart::Constraints);
                let what = format!("{} {settings:?}: {outcome:?}", candidate.label);
                // Only nothing at all is within that tolerance.
                let is_nothing = outcome.residual == 0.0;
                assert!(outcome.iterations == iterations_max || is_nothing, "{what}");
                assert!(outcome.converged == is_nothing && !outcome.breakdown, "{what}");
            }
            // Far beyond what rounding lets it do, the solution stays what it was.
            let settings = LinearSettings { iterations_max: 3000, ..settings };
            let mut kernels = prepared(candidate);
            let reference = Reference::new(&mut *kernels);
            let outcome = solve(&mut *kernels, &settings, LinearStart::Constraints);
            let found = flat(&vector(&mut *kernels, LinearVector::Solution));
            let start = norm(&reference.residual(&reference.asked));
            let left = norm(&reference.residual(&found)) / start;
            assert!(
                left <= 1e3 * candidate.epsilon() && !outcome.breakdown,
                "{} {settings:?}: {outcome:?}, residual {left:e}",
                candidate.label
            );
        }
    }
}
