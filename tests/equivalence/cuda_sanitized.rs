//! The kernels of the CUDA backend once or twice each, in little time: what `compute-sanitizer` is run on, for which other tests would take
//! hours.

use cloth_backend_cuda::CudaOptions;
use cloth_core::{ImplicitSettings, Integrator, LinearMethod, Stencil};
use harness::{
    backends::{cpu, cuda},
    checks::{self, PatchFrames},
    models::description,
};

use crate::cuda_bits::for_all;

fn check(options: CudaOptions, patch: &PatchFrames) {
    let Some(gpu) = cuda(options) else { return };
    assert_eq!(checks::patch_frames([&cpu(2), &gpu], patch), Ok(()));
}

/// Kernels of single stages.
#[test]
fn stages() {
    for_all(2, &description(), checks::bits_of_explicit_stages);
    for_all(2, &description(), checks::bits_of_implicit_stages);
}

/// Patches of a few tiles, folded within one and where two meet, with contact and without it; and as meshes.
#[test]
fn small_patches() {
    for sides in [[43, 20], [53, 20]] {
        for (patches, contact) in [(true, true), (true, false), (false, true), (false, false)] {
            let options = CudaOptions { patches, ..CudaOptions::default() };
            check(
                options,
                &PatchFrames { contact, frames: &[1, 9], ..PatchFrames::explicit(sides) },
            );
        }
    }
}

/// A patch of fabric.
#[test]
fn small_fabric() {
    let mut settings = ImplicitSettings::default();
    settings.linear.iterations_max = 3;
    for integrator in [Integrator::Explicit, Integrator::Implicit(settings)] {
        let frames = &[1, 2];
        let patch =
            PatchFrames { fabric: true, integrator, frames, ..PatchFrames::explicit([43, 20]) };
        check(CudaOptions::default(), &patch);
    }
}

/// One of so many tiles that blocks have several.
#[test]
fn large_patches() {
    for contact in [true, false] {
        let patch = PatchFrames { contact, frames: &[1, 9], ..PatchFrames::explicit([401, 347]) };
        check(CudaOptions::default(), &patch);
    }
}

/// Implicit steps with rows of teams, and of single threads.
#[test]
fn implicit_patches() {
    for (sides, stencil) in [
        ([43, 20], Stencil::Neighbours24),
        ([371, 359], Stencil::Neighbours24),
        ([371, 359], Stencil::Neighbours12),
    ] {
        let mut settings = ImplicitSettings::default();
        settings.linear.method = LinearMethod::ConjugateGradient;
        settings.linear.iterations_max = 3;
        let patch = PatchFrames {
            stencil,
            collider: false,
            integrator: Integrator::Implicit(settings),
            frames: &[1],
            ..PatchFrames::explicit(sides)
        };
        check(CudaOptions::default(), &patch);
    }
}
