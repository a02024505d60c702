//! The CUDA backend gives the bits of the CPU backend.

use std::sync::LazyLock;

use cloth_backend_cuda::CudaOptions;
use cloth_core::{ContactResponse, ImplicitSettings, Integrator, LinearMethod, Precision, Stencil};
use harness::{
    Verdict,
    backends::{Candidate, SharedCuda, candidates, cpu, cuda},
    checks::{self, PatchFrames, Scenario, same_bits},
    models::{Contact, Deformation, Description, Piece, description, description_of_fabric},
    stages::PROCEDURAL_COUNT,
};
use proptest::{
    strategy::Strategy,
    test_runner::{Config, RngSeed, TestCaseError, TestRunner},
};

/// Each precision on both, or nothing on a machine without a GPU.
fn pairs() -> Vec<[&'static Candidate; 2]> {
    let named = |name: &str, precision| {
        candidates().iter().find(move |candidate| {
            candidate.label.starts_with(name) && candidate.precision == precision
        })
    };
    if SharedCuda::new().is_none() {
        return Vec::new();
    }
    [Precision::F32, Precision::F64]
        .into_iter()
        .filter_map(|precision| Some([named("cpu", precision)?, named("cuda", precision)?]))
        .collect()
}

pub(super) fn for_all(
    cases: u32,
    strategy: &impl Strategy<Value = Description>,
    check: impl Fn([&Candidate; 2], &Description) -> Verdict,
) {
    let mut config = Config { failure_persistence: None, cases, ..Config::default() };
    config.rng_seed = RngSeed::Fixed(1998);
    let outcome = TestRunner::new(config).run(strategy, |case| {
        for pair in pairs() {
            check(pair, &case)
                .map_err(|failure| TestCaseError::fail(format!("{}: {failure}", pair[1].label)))?;
        }
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

#[test]
fn every_explicit_stage_gives_the_bits_of_the_cpu() {
    for_all(160, &description(), checks::bits_of_explicit_stages);
}

#[test]
fn expressions_and_distance_grids_give_the_bits_of_the_cpu() {
    let cases = description().prop_map(|mut case| {
        case.fields = PROCEDURAL_COUNT + 3;
        case.colliders = 5;
        case
    });
    for_all(48, &cases, checks::bits_of_explicit_stages);
    for_all(24, &cases, checks::bits_of_implicit_stages);
}

#[test]
fn every_implicit_stage_gives_the_bits_of_the_cpu() {
    for_all(120, &description(), checks::bits_of_implicit_stages);
}

#[test]
fn contact_gives_the_bits_of_the_cpu() {
    for contact in [Contact::Impulse, Contact::Penalty] {
        let cases = description().prop_map(move |mut case| {
            case.contact = contact;
            case
        });
        for_all(48, &cases, checks::bits_of_explicit_stages);
        let folded = Description {
            pieces: vec![Piece::Grid { columns: 37, rows: 25, stencil: Stencil::Neighbours12 }],
            deformation: Deformation::Folded,
            contact,
            ..first(&description())
        };
        for pair in pairs() {
            assert_eq!(checks::bits_of_explicit_stages(pair, &folded), Ok(()));
        }
    }
}

#[test]
fn a_large_solve_gives_the_bits_of_the_cpu() {
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let (response, precision) =
        (ContactResponse::Impulse { restitution: 0.1, friction: 0.3 }, Precision::F32);
    for method in [LinearMethod::ConjugateGradient, LinearMethod::Jacobi] {
        let mut settings = ImplicitSettings::default();
        settings.linear.method = method;
        let integrator = Integrator::Implicit(settings);
        // Two frames: the upper layer has landed on the lower one then.
        let scenario = Scenario {
            side: 230,
            response,
            precision,
            substeps: 12,
            integrator,
            strain_limit: true,
        };
        assert_eq!(same_bits(&[&cpu(2), &gpu], &scenario), Ok(()));
    }
}

/// Some description.
fn first(strategy: &impl Strategy<Value = Description>) -> Description {
    use proptest::strategy::ValueTree;
    match strategy.new_tree(&mut TestRunner::deterministic()) {
        Ok(tree) => tree.current(),
        Err(reason) => panic!("{reason}"),
    }
}

#[test]
fn a_thousand_substeps_with_contact_end_in_the_bits_of_the_cpu() {
    static CPU: LazyLock<cloth_backend_cpu::CpuBackend> = LazyLock::new(|| cpu(2));
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let impulse = ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };
    let penalty = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
    for precision in [Precision::F32, Precision::F64] {
        for response in [impulse, penalty] {
            for (integrator, substeps) in [
                (Integrator::Explicit, 1002),
                (Integrator::Implicit(ImplicitSettings::default()), 60),
            ] {
                for strain_limit in [false, true] {
                    let integrator = integrator.clone();
                    let scenario = Scenario {
                        side: 40,
                        response,
                        precision,
                        substeps,
                        integrator,
                        strain_limit,
                    };
                    assert_eq!(same_bits(&[&*CPU, &gpu], &scenario), Ok(()));
                }
            }
        }
    }
}

#[test]
fn frames_of_a_patch_give_the_bits_of_the_cpu() {
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let cpu = cpu(2);
    // A patch of one tile, of some with and without surroundings all around, of more than there are multiprocessors.
    for sides in [[19, 5], [101, 37], [130, 30], [230, 190]] {
        for (contact, surroundings) in [(false, false), (true, false), (false, true), (true, true)]
        {
            for precision in [Precision::F32, Precision::F64] {
                let explicit = PatchFrames::explicit(sides);
                let patch = PatchFrames { contact, surroundings, precision, ..explicit };
                assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
            }
        }
    }
}

#[test]
fn frames_of_many_tiles_give_the_bits_of_the_cpu() {
    let cpu = cpu(2);
    // As a patch, tiles in runs that go over the edges of the patch; as a mesh, with fewer and with more springs than are loaded
    // ahead.
    for (patches, stencil, contact) in [
        (true, Stencil::Neighbours12, false),
        (true, Stencil::Neighbours12, true),
        (false, Stencil::Neighbours12, false),
        (false, Stencil::Neighbours24, false),
    ] {
        let Some(gpu) = cuda(CudaOptions { patches, ..CudaOptions::default() }) else { return };
        for sides in [[371, 1101], [1030, 515]] {
            let patch = PatchFrames { stencil, contact, ..PatchFrames::explicit(sides) };
            assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
        }
    }
}

#[test]
fn implicit_steps_of_a_large_patch_give_the_bits_of_the_cpu() {
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let cpu = cpu(2);
    for method in [LinearMethod::ConjugateGradient, LinearMethod::Jacobi] {
        let mut settings = ImplicitSettings::default();
        settings.linear.method = method;
        settings.linear.iterations_max = 20;
        // Springs alone, and with all that a row and the filter can have beside them.
        for is_full in [false, true] {
            // The sides are no multiples of those of a tile.
            let patch = PatchFrames {
                stencil: Stencil::Neighbours24,
                contact: is_full,
                collider: is_full,
                integrator: Integrator::Implicit(settings),
                frames: &[1, 2],
                surroundings: is_full,
                ..PatchFrames::explicit([371, 359])
            };
            assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
        }
    }
}

/// Every stage of fabric.
#[test]
fn stages_of_fabric_give_the_bits_of_the_cpu() {
    // CUDA has no strain limit of fabric.
    let cases =
        description_of_fabric().prop_map(|case| Description { strain_limit: false, ..case });
    for_all(60, &cases, checks::bits_of_explicit_stages);
    for_all(40, &cases, checks::bits_of_implicit_stages);
}

/// Frames of fabric: explicit ones, whose triangles come before the pass, alone, with all that can follow, and implicit ones.
#[test]
fn frames_of_fabric_give_the_bits_of_the_cpu() {
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let cpu = cpu(2);
    for sides in [[19, 5], [70, 43], [371, 359]] {
        for precision in [Precision::F32, Precision::F64] {
            let plain = PatchFrames { fabric: true, precision, ..PatchFrames::explicit(sides) };
            for (contact, impulses, surroundings) in
                [(false, false, false), (true, false, true), (false, true, true)]
            {
                let patch = PatchFrames { contact, impulses, surroundings, ..plain.clone() };
                assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
            }
            for (method, newton) in [
                (LinearMethod::ConjugateGradient, 1),
                (LinearMethod::ConjugateGradient, 3),
                (LinearMethod::Jacobi, 1),
            ] {
                let mut settings = ImplicitSettings::default();
                settings.linear.method = method;
                settings.linear.iterations_max = 20;
                settings.newton.iterations_max = newton;
                let integrator = Integrator::Implicit(settings);
                for contact in [false, true] {
                    let integrator = integrator.clone();
                    let frames = &[1, 2];
                    let patch = PatchFrames { integrator, contact, frames, ..plain.clone() };
                    assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
                }
            }
        }
    }
}

/// Frames in which other stages follow the pass: impulses, sweeps of the strain limit, both.
#[test]
fn frames_of_several_stages_give_the_bits_of_the_cpu() {
    let Some(gpu) = cuda(CudaOptions::default()) else { return };
    let cpu = cpu(2);
    for (impulses, sweeps) in [(true, 0), (false, 1), (false, 3), (true, 2)] {
        for sides in [[70, 43], [371, 359]] {
            for precision in [Precision::F32, Precision::F64] {
                let patch =
                    PatchFrames { impulses, sweeps, precision, ..PatchFrames::explicit(sides) };
                assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
            }
        }
    }
    let patch = PatchFrames { contact: true, sweeps: 2, ..PatchFrames::explicit([70, 43]) };
    assert_eq!(checks::patch_frames([&cpu, &gpu], &patch), Ok(()));
}
