//! A wrong backend must be found out: each check is given one with a small defect and has to fail.

use cloth_core::{ContactResponse, Precision, Stencil};
use harness::{
    Verdict,
    backends::{Candidate, SharedGpu, cpu, gpu_candidate},
    checks,
    models::{Contact, Deformation, Description, Piece, Place},
    perturbed::{Defect, PerturbedBackend, Stage},
};

/// A case in which every stage has something to do.
fn busy() -> Description {
    let grid = Piece::Grid { columns: 9, rows: 7, stencil: Stencil::Neighbours12 };
    Description {
        seed: 7,
        pieces: vec![grid, Piece::Mesh { columns: 5, rows: 4, holes: true }],
        place: Place::Origin,
        deformation: Deformation::Stretched,
        pins: true,
        fields: 2,
        air: true,
        colliders: 4,
        contact: Contact::Penalty,
        strain_limit: true,
    }
}

fn with_impulses() -> Description {
    Description { contact: Contact::Impulse, deformation: Deformation::Compressed, ..busy() }
}

fn without_contact() -> Description {
    Description { contact: Contact::Off, colliders: 0, strain_limit: false, ..busy() }
}

/// The check passes the real backend and finds the defect of the perturbed one: on the CPU in both
/// precisions, and on the GPU.
fn control(
    defect: Defect,
    description: &Description,
    check: impl Fn(&Candidate, &Description) -> Verdict,
) {
    control_in(&[Precision::F64, Precision::F32], defect, description, &check);
    let real = gpu_candidate("wgpu", Box::new(SharedGpu));
    // The rounding that WGSL allows hides a defect of a ten-thousandth here and there.
    let backend = PerturbedBackend::with_size(SharedGpu, defect, 1e-3);
    let perturbed = gpu_candidate("perturbed wgpu", Box::new(backend));
    let _turn = real.turn();
    control_of(&real, &perturbed, defect, description, &check);
}

fn control_of(
    real: &Candidate,
    perturbed: &Candidate,
    defect: Defect,
    description: &Description,
    check: impl Fn(&Candidate, &Description) -> Verdict,
) {
    if let Err(failure) = check(real, description) {
        panic!("the check fails without the defect: {failure}");
    }
    assert!(check(perturbed, description).is_err(), "{defect:?} in {} is not seen", real.label);
}

fn control_in(
    precisions: &[Precision],
    defect: Defect,
    description: &Description,
    check: impl Fn(&Candidate, &Description) -> Verdict,
) {
    for &precision in precisions {
        let real = Candidate::new("cpu", Box::new(cpu(1)), precision);
        let backend = PerturbedBackend::new(cpu(1), defect);
        let perturbed = Candidate::new("perturbed", Box::new(backend), precision);
        control_of(&real, &perturbed, defect, description, &check);
    }
}

#[test]
fn every_perturbed_stage_is_found_by_its_check() {
    control(Defect::Scaled(Stage::FieldForces), &busy(), checks::field_forces);
    control(Defect::Scaled(Stage::SpringForces), &busy(), checks::spring_forces);
    control(Defect::Scaled(Stage::AerodynamicForces), &busy(), checks::aerodynamic_forces);
    control(Defect::Scaled(Stage::ContactForces), &busy(), checks::contact_forces);
    control(Defect::Scaled(Stage::IntegrateExplicit), &busy(), checks::integrate_explicit);
    control(Defect::Scaled(Stage::ContactImpulses), &with_impulses(), checks::contact_impulses);
    control(Defect::Scaled(Stage::StrainLimit), &busy(), checks::strain_limit);
    control(Defect::Scaled(Stage::ColliderResponse), &busy(), checks::collider_response);
    control(Defect::Scaled(Stage::VertexNormals), &busy(), checks::vertex_normals);
    control(Defect::Scaled(Stage::Measure), &busy(), checks::measure);
}

#[test]
fn a_dropped_contact_pair_is_found() {
    let defect = Defect::ContactPairDropped;
    control(defect, &busy(), checks::contact_candidates);
    control(defect, &busy(), |candidate, description| {
        checks::contact_candidates_after_moves(candidate, description, 1)
    });
    control(defect, &busy(), checks::contact_forces);
    control(defect, &with_impulses(), checks::contact_impulses);
    for description in [busy(), with_impulses()] {
        control(defect, &description, |candidate, description| {
            checks::contact_candidates_reused(candidate, description, 3)
        });
    }
}

#[test]
fn a_trajectory_of_a_perturbed_backend_is_found() {
    let check = |candidate: &Candidate, description: &Description| {
        checks::trajectory(candidate, description, 20)
    };
    control(Defect::Scaled(Stage::SpringForces), &without_contact(), check);
    // A ten-thousandth of the gravity, in so short a time, is below the rounding of an f32 velocity.
    for stage in [Stage::FieldForces, Stage::AerodynamicForces] {
        control_in(&[Precision::F64], Defect::Scaled(stage), &without_contact(), check);
    }
}

#[test]
fn a_fused_substep_that_differs_is_found() {
    control(Defect::FusedDiffers, &busy(), checks::explicit_substep);
}

#[test]
fn runs_that_differ_are_found() {
    let backend = PerturbedBackend::new(cpu(1), Defect::RunsDiffer);
    let scenario = checks::Scenario {
        side: 12,
        response: ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 },
        precision: Precision::F32,
        substeps: 120,
    };
    let real = cpu(1);
    assert_eq!(checks::same_bits(&[&real, &real], &scenario), Ok(()));
    assert!(checks::same_bits(&[&backend, &backend], &scenario).is_err());
    assert!(checks::resumes_with_same_bits(&backend, &scenario).is_err());
}
