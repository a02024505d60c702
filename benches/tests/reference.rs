//! The reference programs compute what the engine computes: ratios of times are between equals.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    Frame, ImplicitSettings, Integrator, LinearSettings, Precision, Preconditioner, backend_create,
    scene::{BenchKind, CompileOptions, bench_scene},
};
use cloth_benches::{HangWorkload, reference_build, reference_source, reference_state};
use tempfile::TempDir;

const SIDE: u32 = 20;

/// Largest distance between particles of the same number \[m\].
fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let apart =
        |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(apart).fold(0.0, f64::max)
}

/// The scenes of the reference.
#[derive(Clone, Copy, PartialEq)]
enum Scene {
    Hang,
    Sphere,
    /// One that hangs with its far half laid over the near one, so near that all of it is in contact.
    Fold,
}

/// Positions of the engine in double precision.
fn explicit(scene: Scene, contact: bool, frames: u32) -> Vec<[f64; 3]> {
    let kind = if scene == Scene::Sphere { BenchKind::Sphere } else { BenchKind::Hang };
    let compiled = bench_scene(kind, SIDE, contact).compile(&CompileOptions::default()).unwrap();
    let mut config = compiled.config.clone();
    config.precision = Precision::F64;
    let backend = backend_create("cpu", None).unwrap();
    let mut solver = backend.create_solver(compiled.model.clone(), &config).unwrap();
    let mut state = compiled.model.initial_state();
    if scene == Scene::Fold {
        let side = SIDE as usize;
        for row in side.div_ceil(2)..side {
            for column in 0..side {
                let [x, y] = [column, side - 1 - row].map(|count| 0.02 * count as f64);
                state.positions[row * side + column] = [x, y, 0.75 * 0.016];
            }
        }
        solver.upload(&state).unwrap();
    }
    for _ in 0..frames {
        solver.advance(Frame::per_second(compiled.frames_per_second)).unwrap();
        solver.synchronize().unwrap();
    }
    solver.download(&mut state).unwrap();
    state.positions
}

/// Single precision and another order of sums are all that may differ. Where a patch meets the top of the ball it decides
/// which way it slides, so that the bound is wider there.
#[test]
fn the_explicit_reference_is_where_the_engine_is() {
    let folder = TempDir::new().unwrap();
    let program = reference_build(&reference_source("explicit"), folder.path()).unwrap();
    let cases = [
        ("hang", "none", Scene::Hang, 12, 2e-6),
        ("sphere", "none", Scene::Sphere, 12, 1e-3),
        ("fold", "grid", Scene::Fold, 3, 1e-5),
    ];
    for (name, word, scene, frames, bound) in cases {
        let words = [name, word, &SIDE.to_string(), &frames.to_string()];
        let found = reference_state(&program, &words).unwrap();
        let expected = explicit(scene, word == "grid", frames);
        let apart = distance(&found, &expected);
        assert!(apart < bound, "{words:?}: {apart} m apart");
        // What the bound could not tell apart would be no evidence.
        let without = match scene {
            Scene::Hang => explicit(scene, false, frames - 1),
            Scene::Sphere => explicit(Scene::Hang, false, frames),
            Scene::Fold => explicit(scene, false, frames),
        };
        assert!(distance(&found, &without) > 10.0 * bound, "{words:?}: nothing happens");
    }
}

/// Both with thirty iterations from zero and a diagonal preconditioner, so that what they leave is the same, too.
#[test]
fn the_implicit_reference_is_where_the_engine_is() {
    let folder = TempDir::new().unwrap();
    let program = reference_build(&reference_source("implicit"), folder.path()).unwrap();
    let steps = 12_usize;
    let words = [SIDE.to_string(), steps.to_string()];
    let found = reference_state(&program, &words.each_ref().map(String::as_str)).unwrap();
    let linear = LinearSettings {
        preconditioner: Preconditioner::Diagonal,
        tolerance: 0.0,
        iterations_max: 30,
        ..LinearSettings::default()
    };
    let integrator =
        Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() });
    let workload = HangWorkload { precision: Precision::F64, ..HangWorkload::new(SIDE) };
    let backend = backend_create("cpu", None).unwrap();
    let state = workload.start(&*backend, integrator, steps).unwrap().state().unwrap();
    let apart = distance(&found, &state.positions);
    let fallen = state.positions.iter().map(|position| -position[2]).fold(0.0, f64::max);
    assert!(fallen > 0.05 && apart < 1e-4, "{apart} m apart, fallen {fallen} m");
}

#[test]
fn words_that_make_no_sense_are_refused() {
    let folder = TempDir::new().unwrap();
    let program = reference_build(&reference_source("explicit"), folder.path()).unwrap();
    assert!(reference_state(&program, &["hang", "none", "2", "1"]).is_err());
    assert!(reference_build(&folder.path().join("none.cpp"), folder.path()).is_err());
}
