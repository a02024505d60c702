//! Every rung of the historical ladder, and the one thread of the processor that they are compared with, computes what
//! the solver of the product computes.

use std::sync::Arc;

use cloth::{Backend, Error, Frame, Precision, SolverConfig, State, cuda::CudaOptions};
use cloth_benches::ladder::{FRAME, Ladder, Rung, SUBSTEPS, config, model, single_thread};
use harness::{
    Verdict,
    backends::{cpu, cuda},
    models::fold,
    perturbed::{Defect, PerturbedBackend, Stage},
    random::Random,
    verdict::ensure,
};

const SIDES: [u32; 3] = [5, 10, 20];
/// Frames of 34 substeps that are compared.
const FRAMES: usize = 2;

/// The patch folded over itself, so that springs and contacts have something to do; it meets the sphere as well.
fn folded(side: u32) -> State {
    let model = model(side).unwrap_or_else(|error| panic!("{error}"));
    let mut state = model.initial_state();
    let mut random = Random::new(u64::from(side));
    fold(&mut state, 0.5 * f64::from(side - 1) * 0.02, 0.01);
    for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
        let [moved, pushed] = [random.vector(0.002), random.vector(0.2)];
        for axis in 0..3 {
            x[axis] = f64::from((x[axis] + moved[axis]) as f32);
            v[axis] = f64::from((v[axis] + pushed[axis]) as f32);
        }
    }
    state
}

/// What a backend of the product makes of it.
fn solved(backend: &dyn Backend, precision: Precision, side: u32) -> State {
    let run = || {
        let config = SolverConfig { precision, ..config() };
        let mut solver = backend.create_solver(Arc::new(model(side)?), &config)?;
        solver.upload(&folded(side))?;
        for _ in 0..FRAMES {
            solver.advance(Frame { duration: FRAME })?;
            let report = solver.synchronize()?;
            assert_eq!(report.substeps as usize, SUBSTEPS);
        }
        let mut state = State::default();
        solver.download(&mut state)?;
        Ok(state)
    };
    run().unwrap_or_else(|error: Error| panic!("{error}"))
}

/// Largest difference of positions [m].
fn distance(a: &State, b: &State) -> f64 {
    let both = a.positions.iter().zip(&b.positions);
    let components = both.flat_map(|(a, b)| (0..3).map(move |axis| (a[axis] - b[axis]).abs()));
    // NaN is a difference.
    components.fold(0.0, |most, d| if d <= most { most } else { d })
}

/// Whether a state is the expected one but for rounding. How much that is says the product: the difference of its
/// results in single and double precision, of which a sum in another order may make several.
fn check(label: &str, found: &State, expected: [&State; 2]) -> Verdict {
    let rounding = distance(expected[0], expected[1]);
    let [found, bound] = [distance(found, expected[0]), 8.0 * rounding + 1e-6];
    ensure(found <= bound, || format!("{label}: {found:e} m off, bound {bound:e}"))
}

#[test]
fn the_single_thread_computes_what_the_solver_does() {
    let backend = cpu(1);
    for side in SIDES {
        let single = solved(&backend, Precision::F32, side);
        let double = solved(&backend, Precision::F64, side);
        assert!(distance(&single, &folded(side)) > 0.01, "nothing moves");
        let run = single_thread(side, &folded(side), FRAMES).unwrap();
        assert_eq!(run.frame_seconds.len(), FRAMES);
        assert_eq!(check("single thread", &run.state, [&single, &double]), Ok(()));
        // The check sees a solver that is a little wrong.
        for stage in [Stage::SpringForces, Stage::ContactForces, Stage::ColliderResponse] {
            let wrong = PerturbedBackend::with_size(cpu(1), Defect::Scaled(stage), 0.01);
            let wrong = solved(&wrong, Precision::F32, side);
            let verdict = check("perturbed", &wrong, [&single, &double]);
            assert!(verdict.is_err(), "{stage:?} a hundredth off is not seen at {side}");
        }
    }
}

/// The ladder on the GPU of this machine; without one `None`, which is said, or a failure where it is required.
fn ladder_of_this_machine() -> Option<Ladder> {
    cuda(CudaOptions::default())?;
    match Ladder::new(CudaOptions::default()) {
        Ok(ladder) => Some(ladder),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn every_rung_computes_what_the_solver_does() {
    let Some(ladder) = ladder_of_this_machine() else { return };
    let backend = cpu(2);
    for side in SIDES {
        let single = solved(&backend, Precision::F32, side);
        let double = solved(&backend, Precision::F64, side);
        for rung in Rung::ALL {
            let run = ladder.run_from(rung, side, &folded(side), FRAMES).unwrap();
            let label = format!("{} at {side}", rung.name());
            assert_eq!(check(&label, &run.state, [&single, &double]), Ok(()));
            assert!(run.frame_seconds.iter().all(|&time| time > 0.0), "{label}: no time");
            let again = ladder.run_from(rung, side, &folded(side), FRAMES).unwrap();
            assert_eq!(again.state, run.state, "{label}: every run gives the same bits");
            let mut wrong = folded(side);
            wrong.positions[0][2] += 1e-3;
            let run = ladder.run_from(rung, side, &wrong, FRAMES).unwrap();
            assert!(check(&label, &run.state, [&single, &double]).is_err(), "{label}: not seen");
        }
    }
}

/// The patch pressed together to a quarter of its width: more particles in a bin than there is room for at first.
fn pressed(side: u32) -> State {
    let mut state = folded(side);
    for x in &mut state.positions {
        *x = x.map(|coordinate| f64::from((0.25 * coordinate) as f32));
    }
    state
}

#[test]
fn bins_grow_and_lost_particles_are_reported() {
    let Some(ladder) = ladder_of_this_machine() else { return };
    let side = 20;
    let expected = single_thread(side, &pressed(side), 1).unwrap().state;
    let size = expected.positions.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
    let run = ladder.run_from(Rung::Bins, side, &pressed(side), 1).unwrap();
    let found = distance(&run.state, &expected);
    assert!(found <= 1e-4 * size, "{found:e} m off in {size} m");
    let mut fast = folded(side);
    // Several of the 16 bins along that axis, in which it is not expected.
    fast.velocities[7] = [400.0, 0.0, 0.0];
    let lost = ladder.run_from(Rung::Neighbours, side, &fast, 1);
    assert!(matches!(lost, Err(Error::LimitExceeded { .. })), "{:?}", lost.err());
    assert!(ladder.run_from(Rung::Bins, side, &fast, 1).is_ok());
}
