//! Steps that no explicit scheme could take.

use std::sync::Arc;

use cloth_core::{
    Field, Frame, GridPatch, ImplicitSettings, Integrator, LinearMethod, Model, ModelBuilder,
    Precision, SolverConfig, Stencil,
};
use harness::{
    backends::{Candidate, candidates_with},
    feature::Feature,
    models::{grid_cloth, material},
};

use crate::rig::{build, download, solver_of};

/// A patch that hangs from two corners. The masses, springs and drag are those of the common workload of
/// the benchmarks.
fn hanging(side: u32, stencil: Stencil, stiffness_factor: f64) -> Arc<Model> {
    let mut fabric = material(1e-4, 10.0 * stiffness_factor, 1e-3);
    for springs in [&mut fabric.stretch, &mut fabric.shear, &mut fabric.bend] {
        springs.damping = 0.005;
    }
    fabric.bend.stiffness = 5.0 * stiffness_factor;
    let mut patch = GridPatch::horizontal(side, 0.02, 0.0);
    patch.stencil = stencil;
    let mut cloth = grid_cloth("patch", patch, fabric);
    cloth.pins = vec![0, side - 1];
    build(ModelBuilder::new().field(Field::Drag { rate: [0.5; 3] }).cloth(cloth))
}

/// Within the ball around the pins that the cloth can reach with this elongation.
fn assert_bounded(candidate: &Candidate, positions: &[[f64; 3]], reach: f64) {
    for (i, x) in positions.iter().enumerate() {
        let distance = x.iter().map(|c| c * c).sum::<f64>().sqrt();
        assert!(distance <= reach, "{}: particle {i} at {x:?}", candidate.label);
    }
}

/// A stiffness a million times that of fabric in steps of a fiftieth of a second.
#[test]
fn a_stiffness_raised_by_a_million_stays_bounded() {
    for exponent in [0, 2, 4, 6] {
        let model = hanging(16, Stencil::Neighbours12, 10.0_f64.powi(exponent));
        for candidate in candidates_with(Feature::Implicit) {
            let integrator = Integrator::Implicit(ImplicitSettings::default());
            let mut solver = solver_of(candidate, &model, 0.02, integrator);
            for step in 0..candidate.work(100) {
                solver.advance(Frame { duration: 0.02 }).unwrap();
                let report = solver.synchronize();
                let what = format!("{} 1e{exponent} step {step}", candidate.label);
                if let Err(error) = report {
                    panic!("{what}: {error}");
                }
            }
            assert_bounded(candidate, &download(&mut *solver).positions, 3.0);
        }
    }
}

/// Jacobi with these numbers of iterations, whether it converges in them or not.
fn jacobi(candidate: &Candidate, side: u32, iterations: u32, steps: u32) {
    let model = hanging(side, Stencil::Neighbours24, 1.0);
    let mut settings = ImplicitSettings::default();
    settings.linear.method = LinearMethod::Jacobi;
    settings.linear.tolerance = 0.0;
    settings.linear.iterations_max = iterations;
    // The corners carry half of the weight each and stretch their springs by more than any fabric bears: what
    // is asked for here is that all particles stay, not that the cloth is sound.
    let config = SolverConfig {
        precision: candidate.precision,
        time_step: 0.01,
        integrator: Integrator::Implicit(settings),
        strain_bound: 1e3,
        threads: std::thread::available_parallelism().ok(),
        ..SolverConfig::default()
    };
    let mut solver = candidate.backend.create_solver(model, &config).unwrap();
    let frames = 4;
    for frame in 0..frames {
        solver.advance(Frame { duration: 0.01 * f64::from(steps / frames) }).unwrap();
        let what = format!("{} {side}^2, {iterations} iterations", candidate.label);
        if let Err(error) = solver.synchronize() {
            panic!("{what}, frame {frame}: {error}");
        }
    }
    let state = download(&mut *solver);
    assert_eq!(state.positions.len(), (side * side) as usize);
    // The load on single corners stretches the cloth a few times its length.
    assert_bounded(candidate, &state.positions, 10.0 * 0.02 * f64::from(side));
}

/// The steps or particles along a side of the full run if `CLOTH_TEST_FULL` is set, by default so many that a test takes seconds.
fn full_or(full: u32, usual: u32) -> u32 {
    if std::env::var_os("CLOTH_TEST_FULL").is_some() { full } else { usual }
}

#[test]
fn jacobi_loses_no_particle_of_3600() {
    for iterations in [10, 30, 70] {
        for candidate in candidates_with(Feature::Implicit) {
            jacobi(candidate, 60, iterations, candidate.work(full_or(3000, 40)));
        }
    }
}

/// Jacobi with 65,536 particles, in the full run. Tests of their own, as the full run of one takes many minutes.
fn jacobi_of_65536(iterations: u32, precision: Precision) {
    for candidate in candidates_with(Feature::Implicit).filter(|c| c.precision == precision) {
        jacobi(candidate, full_or(256, 80), iterations, full_or(3000, 4));
    }
}

#[test]
fn ten_iterations_of_jacobi_lose_no_particle_of_65536_in_single_precision() {
    jacobi_of_65536(10, Precision::F32);
}

#[test]
fn ten_iterations_of_jacobi_lose_no_particle_of_65536_in_double_precision() {
    jacobi_of_65536(10, Precision::F64);
}

#[test]
fn thirty_iterations_of_jacobi_lose_no_particle_of_65536_in_single_precision() {
    jacobi_of_65536(30, Precision::F32);
}

#[test]
fn thirty_iterations_of_jacobi_lose_no_particle_of_65536_in_double_precision() {
    jacobi_of_65536(30, Precision::F64);
}

#[test]
fn seventy_iterations_of_jacobi_lose_no_particle_of_65536_in_single_precision() {
    jacobi_of_65536(70, Precision::F32);
}

#[test]
fn seventy_iterations_of_jacobi_lose_no_particle_of_65536_in_double_precision() {
    jacobi_of_65536(70, Precision::F64);
}
