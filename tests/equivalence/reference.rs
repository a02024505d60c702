//! Backends in double precision compute whole frames as the reference backend does.

use cloth_core::{
    Backend, ContactResponse, ImplicitSettings, Integrator, LinearMethod, LinearVector, Precision,
    SolverConfig,
};
use harness::{
    backends::{candidates, reference},
    checks::{self, PatchFrames, Scenario},
    models::{Deformation, description},
    perturbed::{Defect, PerturbedBackend, Stage},
    random::Random,
    runner::for_all,
};
use proptest::strategy::Strategy;

#[test]
fn frames_of_generated_cases() {
    let cases = description().prop_map(|mut case| {
        // A spring of no length has no direction, and what becomes of it is a matter of rounding.
        if matches!(case.deformation, Deformation::Coinciding) {
            case.deformation = Deformation::Jitter;
        }
        case
    });
    for_all(32, &cases, checks::frames);
}

fn scenarios() -> Vec<Scenario> {
    let impulse = ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };
    let penalty = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
    let mut settings = ImplicitSettings::default();
    settings.linear.tolerance = 1e-13;
    settings.linear.iterations_max = 1000;
    let mut all = Vec::new();
    for response in [impulse, penalty] {
        for (integrator, substeps) in
            [(Integrator::Explicit, 120), (Integrator::Implicit(settings), 24)]
        {
            for strain_limit in [false, true] {
                all.push(Scenario {
                    side: 16,
                    response,
                    precision: Precision::F64,
                    substeps,
                    integrator: integrator.clone(),
                    strain_limit,
                });
            }
        }
    }
    all
}

#[test]
fn frames_with_much_contact() {
    let expected = &*reference().backend;
    for candidate in candidates().iter().filter(|c| c.precision == Precision::F64) {
        let _turn = candidate.turn();
        for scenario in scenarios() {
            match checks::scenario_frames([&*candidate.backend, expected], &scenario) {
                Err(failure) if candidate.is_known_to_lack(&failure) => {}
                verdict => assert_eq!(verdict, Ok(()), "{}", candidate.label),
            }
        }
    }
}

/// The order of the sum is the same function of the number of particles everywhere: here more than a tree of blocks.
#[test]
fn scalar_products_have_the_bits_of_the_cpu() {
    let patch = PatchFrames { precision: Precision::F64, ..PatchFrames::explicit([150, 120]) };
    let model = patch.model().expect("the patch is a model");
    let config = SolverConfig { precision: Precision::F64, ..SolverConfig::default() };
    let mut random = Random::new(7);
    let [a, b] = [0, 1].map(|_| (0..150 * 120).map(|_| random.vector(1.0)).collect::<Vec<_>>());
    let backends = [&*reference().backend, &harness::backends::cpu(2)];
    let dots = backends.map(|backend: &dyn Backend| {
        let mut kernels = backend.create_kernels(model.clone(), &config)?;
        kernels.vector_write(LinearVector::Direction, &a)?;
        kernels.vector_write(LinearVector::Residual, &b)?;
        kernels.vector_dot(LinearVector::Direction, LinearVector::Residual)
    });
    let [found, expected] = dots.map(|dot: cloth_core::Result<f64>| dot.map(f64::to_bits));
    assert_eq!(found, expected);
    let plain: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum();
    assert_ne!(found, Ok(plain.to_bits()), "another order gives other bits");
}

/// With and without contact, and with all that can be around a patch, still and moving.
#[test]
fn frames_of_patches() {
    let expected = &*reference().backend;
    for candidate in candidates().iter().filter(|c| c.precision == Precision::F64) {
        let _turn = candidate.turn();
        for (contact, surroundings) in [(false, false), (false, true), (true, true)] {
            let patch = PatchFrames {
                contact,
                surroundings,
                precision: Precision::F64,
                ..PatchFrames::explicit([29, 17])
            };
            let verdict = checks::patch_frames_near([&*candidate.backend, expected], &patch);
            assert_eq!(verdict, Ok(()), "{}", candidate.label);
        }
    }
}

/// Patches of fabric: explicit frames alone and with contact, and implicit ones, as a whole on every backend.
#[test]
fn frames_of_fabric() {
    let expected = &*reference().backend;
    let implicit = |newton| {
        let mut settings = ImplicitSettings::default();
        settings.linear.method = LinearMethod::ConjugateGradient;
        settings.linear.tolerance = 1e-5;
        settings.newton.iterations_max = newton;
        Integrator::Implicit(settings)
    };
    let plain = PatchFrames { fabric: true, ..PatchFrames::explicit([29, 17]) };
    let contact = PatchFrames { contact: true, surroundings: true, ..plain.clone() };
    let impulses = PatchFrames { impulses: true, ..plain.clone() };
    let [linearised, newton] = [1, 3].map(|newton| PatchFrames {
        integrator: implicit(newton),
        frames: &[1, 3],
        ..contact.clone()
    });
    for candidate in candidates() {
        let _turn = candidate.turn();
        for patch in [&plain, &contact, &impulses, &linearised, &newton] {
            let patch = PatchFrames { precision: candidate.precision, ..patch.clone() };
            let share = match (candidate.precision, patch.integrator == Integrator::Explicit) {
                (Precision::F64, true) => 1e-9,
                _ => 2e-3,
            };
            let backends = [&*candidate.backend, expected];
            let verdict = checks::patch_frames_within(backends, &patch, share);
            assert_eq!(verdict, Ok(()), "{}", candidate.label);
        }
    }
}

/// A stage that is a millionth off is found.
#[test]
fn frames_of_a_wrong_backend_are_found() {
    let expected = &*reference().backend;
    let explicit = &scenarios()[0];
    for stage in [Stage::SpringForces, Stage::ContactImpulses, Stage::ColliderResponse] {
        let defect = Defect::Scaled(stage);
        let wrong = PerturbedBackend::with_size(harness::backends::cpu(1), defect, 1e-6);
        assert!(checks::scenario_frames([&wrong, expected], explicit).is_err(), "{stage:?}");
    }
}
