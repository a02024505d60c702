//! What a device cannot do is known before any work, or done in another way.

use std::time::{Duration, Instant};

use cloth_backend_wgpu::{WgpuBackend, WgpuOptions};
use cloth_core::{
    Backend, Error, ImplicitSettings, Integrator, Precision, Preconditioner, SolverConfig,
};
use harness::{backends::gpu, bits::first_difference};

use crate::rig::{IMPULSE, PENALTY, config, implicit_config, lowered, model, run, run_with};

#[test]
fn few_workgroups_along_one_dimension_give_the_same_bits() {
    // 5,041 particles need 79 workgroups, four rows of 26; searches for candidates 631, 25 rows.
    let narrow = lowered(|limits| limits.max_compute_workgroups_per_dimension = 26);
    for response in [IMPULSE, PENALTY] {
        let model = model(71, Some(response));
        let states = [run(gpu(), &model, 2), run(&narrow, &model, 2)];
        assert_eq!(first_difference(&states[0], &states[1]), None);
    }
    let (model, implicit) = (model(71, Some(PENALTY)), implicit_config());
    let run = |backend: &dyn Backend| run_with(backend, &model, &implicit, 1);
    assert_eq!(first_difference(&run(gpu()), &run(&narrow)), None);
}

#[test]
fn little_workgroup_memory_gives_the_same_bits() {
    // Too little for an iteration of the conjugate gradient method in one kernel: it has two.
    let narrow = lowered(|limits| limits.max_compute_workgroup_storage_size = 8 << 10);
    for response in [None, Some(IMPULSE)] {
        let model = model(33, response);
        let implicit = implicit_config();
        let run = |backend: &dyn Backend| run_with(backend, &model, &implicit, 2);
        assert_eq!(first_difference(&run(gpu()), &run(&narrow)), None);
    }
}

#[test]
fn too_few_workgroups_are_refused() {
    let narrow = lowered(|limits| limits.max_compute_workgroups_per_dimension = 4);
    let error = narrow.create_solver(model(71, None), &config()).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::LimitExceeded { max: 16, .. }), "{error}");
}

#[test]
fn too_large_a_buffer_is_refused_before_any_work() {
    let small = lowered(|limits| {
        limits.max_storage_buffer_binding_size = 64 << 10;
        limits.max_buffer_size = 64 << 10;
    });
    // 16 bytes for each of 5,041 particles are more than 64 KiB.
    let error = small.create_solver(model(71, None), &config()).map(|_| ()).unwrap_err();
    let Error::LimitExceeded { requested, max, limit } = error else { panic!("{error}") };
    assert!(requested > max && max == 64 << 10, "{limit}");
}

#[test]
fn a_linear_system_that_is_too_large_is_refused_before_any_work() {
    let small = lowered(|limits| {
        limits.max_storage_buffer_binding_size = 512 << 10;
        limits.max_buffer_size = 512 << 10;
    });
    // 16 bytes for each of 5,041 particles fit, seven vectors of that size do not.
    assert!(small.create_solver(model(71, None), &config()).is_ok());
    let error = small.create_solver(model(71, None), &implicit_config()).map(|_| ()).unwrap_err();
    let Error::LimitExceeded { requested, max, limit } = error else { panic!("{error}") };
    assert!(requested > max && limit.contains("linear system"), "{limit}");
}

#[test]
fn solvers_that_no_gpu_gains_from_are_unsupported_by_name() {
    let mut settings = ImplicitSettings::default();
    settings.linear.preconditioner = Preconditioner::IncompleteCholesky;
    let config = SolverConfig { integrator: Integrator::Implicit(settings), ..implicit_config() };
    let error = gpu().create_solver(model(5, None), &config).map(|_| ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the wgpu backend does not support the preconditioner incomplete-cholesky (it has diagonal, \
         block and schwarz); choose another backend"
    );
}

#[test]
fn a_device_with_few_bindings_runs_the_single_stages() {
    let few = lowered(|limits| limits.max_storage_buffers_per_shader_stage = 10);
    for contact in [None, Some(PENALTY)] {
        let model = model(17, contact);
        let states = [run(gpu(), &model, 4), run(&few, &model, 4)];
        assert_eq!(first_difference(&states[0], &states[1]), None, "{contact:?}");
    }
}

#[test]
fn double_precision_is_unsupported_by_name() {
    let config = SolverConfig { precision: Precision::F64, ..config() };
    let error = gpu().create_solver(model(5, None), &config).map(|_| ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the wgpu backend does not support precision f64; choose another backend"
    );
}

#[test]
fn a_wrong_adapter_is_answered_with_those_there_are() {
    let error = WgpuBackend::new(Some("abacus")).map(|_| ()).unwrap_err();
    let Error::NoDevice { backend: "wgpu", reason } = error else { panic!("{error}") };
    assert!(reason.starts_with("there is no adapter `abacus`; there are: 0 ("), "{reason}");
    assert!(reason.contains(&gpu().info().device));
}

#[test]
fn limits_that_no_device_has_are_an_error() {
    let mut limits = gpu().device().limits();
    limits.max_storage_buffers_per_shader_stage = 1 << 30;
    let options = WgpuOptions { limits: Some(limits), ..WgpuOptions::default() };
    let error = WgpuBackend::with_options(&options).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::NoDevice { .. }), "{error}");
}

#[test]
fn stages_are_timed_when_asked_for() {
    let options = WgpuOptions { stage_times: true, ..WgpuOptions::default() };
    let backend = WgpuBackend::with_options(&options).unwrap();
    let model = model(17, Some(IMPULSE));
    let mut solver = backend.create_solver(model.clone(), &config()).unwrap();
    let start = Instant::now();
    solver.advance(cloth_core::Frame { duration: 6.0 * 5e-4 }).unwrap();
    let report = solver.synchronize().unwrap();
    let elapsed = start.elapsed();
    for stage in ["explicit_substep", "contact_impulses", "strain_limit", "measure"] {
        let time = report.stage_times.iter().find(|time| time.stage == stage);
        assert!(time.is_some_and(|time| !time.time.is_zero()), "{stage}: {:?}", report.stage_times);
    }
    // One follows the other, so that nothing is counted twice. Two clocks may differ a little.
    let sum: Duration = report.stage_times.iter().map(|time| time.time).sum();
    assert!(sum < elapsed.mul_f64(1.05), "{sum:?} of {elapsed:?}");
    let states = [run(gpu(), &model, 2), run(&backend, &model, 2)];
    assert_eq!(first_difference(&states[0], &states[1]), None);
}
