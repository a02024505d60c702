//! A wrong backend must be found out: each check is given one with a small defect and has to fail.

use cloth_core::{
    ContactResponse, Integrator, LinearMethod, LinearSettings, NewtonStart, Precision,
    Preconditioner, Stencil,
};
use harness::{
    Verdict,
    backends::{Candidate, SharedCuda, SharedGpu, cpu, cuda_candidate, gpu_candidate, is_left_out},
    checks,
    linear::MATRIX_FORMS,
    models::{Contact, Deformation, Description, Piece, Place, RandomForces},
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
        buckling: false,
    }
}

fn with_impulses() -> Description {
    Description { contact: Contact::Impulse, deformation: Deformation::Compressed, ..busy() }
}

/// Most bend springs are on the branch of the bent strut.
fn buckled() -> Description {
    Description { buckling: true, deformation: Deformation::Compressed, ..busy() }
}

fn without_contact() -> Description {
    Description { contact: Contact::Off, colliders: 0, strain_limit: false, ..busy() }
}

/// The check passes the real backend and finds the defect of the perturbed one: on the CPU and through CUDA in both
/// precisions, and on the GPU through wgpu.
fn control(
    defect: Defect,
    description: &Description,
    check: impl Fn(&Candidate, &Description) -> Verdict,
) {
    control_in(&[Precision::F64, Precision::F32], defect, description, &check);
    if is_left_out("wgpu") {
        return;
    }
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
    match check(real, description) {
        Err(failure) if real.is_known_to_lack(&failure) => return,
        Err(failure) => panic!("the check fails without the defect: {failure}"),
        Ok(()) => {}
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
        for [real, perturbed] in with_defect(precision, defect) {
            control_of(&real, &perturbed, defect, description, &check);
        }
    }
}

/// The CPU backend, and that of CUDA where there is a GPU, which gives the same bits: each as it is, and with a defect.
fn with_defect(precision: Precision, defect: Defect) -> Vec<[Candidate; 2]> {
    let backend = PerturbedBackend::new(cpu(1), defect);
    let mut pairs = vec![[
        Candidate::new("cpu", Box::new(cpu(1)), precision),
        Candidate::new("perturbed cpu", Box::new(backend), precision),
    ]];
    pairs.extend(SharedCuda::new().map(|cuda| {
        let backend = PerturbedBackend::new(cuda, defect);
        [
            cuda_candidate("cuda", Box::new(cuda), precision),
            cuda_candidate("perturbed cuda", Box::new(backend), precision),
        ]
    }));
    pairs
}

#[test]
fn every_perturbed_stage_is_found_by_its_check() {
    control(Defect::Scaled(Stage::FieldForces), &busy(), checks::field_forces);
    control(Defect::Scaled(Stage::ControlForces), &busy(), |candidate, description| {
        let forces = RandomForces::from_seed(description.seed);
        checks::control_forces(candidate, description, &forces)
    });
    control(Defect::Scaled(Stage::ControlForcesAssemble), &busy(), |candidate, description| {
        checks::control_forces_assemble(candidate, description, NewtonStart::Iterate)
    });
    control(Defect::Scaled(Stage::ProceduralForces), &busy(), checks::procedural_forces);
    control(Defect::Scaled(Stage::SpringForces), &busy(), checks::spring_forces);
    control(Defect::Scaled(Stage::SpringForces), &buckled(), checks::spring_forces);
    control(Defect::Scaled(Stage::Measure), &buckled(), checks::measure);
    control(Defect::Scaled(Stage::AerodynamicForces), &busy(), checks::aerodynamic_forces);
    control(Defect::Scaled(Stage::ContactForces), &busy(), checks::contact_forces);
    control(Defect::Scaled(Stage::IntegrateExplicit), &busy(), checks::integrate_explicit);
    control(Defect::Scaled(Stage::ContactImpulses), &with_impulses(), checks::contact_impulses);
    control(Defect::Scaled(Stage::StrainLimit), &busy(), checks::strain_limit);
    control(Defect::Scaled(Stage::ColliderResponse), &busy(), checks::collider_response);
    control(Defect::Scaled(Stage::ColliderResponse), &on_grid(), checks::collider_response);
    control(Defect::Scaled(Stage::VertexNormals), &busy(), checks::vertex_normals);
    control(Defect::Scaled(Stage::Measure), &busy(), checks::measure);
    control(Defect::Scaled(Stage::SemiImplicitSolve), &busy(), checks::semi_implicit_solve);
    control(Defect::Scaled(Stage::VelocityAdd), &busy(), checks::solution_motion);
    let free = Description { pins: false, ..busy() };
    // A ten-thousandth of what is taken back, itself a small part of the angular momentum, is below
    // the rounding of f32.
    let defect = Defect::Scaled(Stage::TorqueCorrect);
    control_in(&[Precision::F64], defect, &free, checks::torque_correct);
}

/// Fabric and springs in one case.
fn of_fabric() -> Description {
    let fabric = Piece::Fabric { columns: 6, rows: 5, holes: true };
    let grid = Piece::Grid { columns: 5, rows: 4, stencil: Stencil::Neighbours12 };
    Description { pieces: vec![fabric, grid], strain_limit: false, ..busy() }
}

#[test]
fn every_perturbed_stage_of_fabric_is_found_by_its_check() {
    type Check = fn(&Candidate, &Description) -> Verdict;
    let start: Check = |candidate, description| {
        checks::implicit_assemble(candidate, description, NewtonStart::StepStart)
    };
    let iterate: Check = |candidate, description| {
        checks::implicit_assemble(candidate, description, NewtonStart::Iterate)
    };
    let stages: [(Stage, Check); 7] = [
        (Stage::SemiImplicitSolve, checks::semi_implicit_solve),
        (Stage::MembraneForces, checks::membrane_forces),
        (Stage::BendingForces, checks::bending_forces),
        (Stage::MembraneLinearise, start),
        (Stage::MembraneLinearise, iterate),
        (Stage::BendingLinearise, start),
        (Stage::BendingLinearise, iterate),
    ];
    for (stage, check) in stages {
        control(Defect::Scaled(stage), &of_fabric(), check);
    }
    // Stretched evenly, any two directions would be principal ones.
    let uneven =
        Description { deformation: Deformation::Jitter, strain_limit: true, ..of_fabric() };
    // Velocities come from differences of positions, whose rounding in f32 hides a ten-thousandth of them.
    let defect = Defect::Scaled(Stage::StretchLimit);
    control_in(&[Precision::F64], defect, &uneven, checks::stretch_limit);
}

/// The fifth collider is a distance grid.
fn on_grid() -> Description {
    Description { colliders: 5, ..on_colliders() }
}

/// Particles among colliders, moved and pulled in all directions.
fn on_colliders() -> Description {
    Description { contact: Contact::Off, deformation: Deformation::Jitter, ..busy() }
}

#[test]
fn impulses_of_colliders_that_are_a_little_off_are_found() {
    control_some(Defect::Scaled(Stage::ColliderImpulses), checks::collider_impulses);
    if is_left_out("wgpu") {
        return;
    }
    let real = gpu_candidate("wgpu", Box::new(SharedGpu));
    let backend =
        PerturbedBackend::with_size(SharedGpu, Defect::Scaled(Stage::ColliderImpulses), 1e-3);
    let perturbed = gpu_candidate("perturbed wgpu", Box::new(backend));
    let _turn = real.turn();
    let seeds = || (0..8).map(|seed| Description { seed: 2 * seed, ..on_grid() });
    for description in seeds() {
        assert_eq!(checks::collider_impulses(&real, &description), Ok(()));
    }
    let is_found = |description| checks::collider_impulses(&perturbed, &description).is_err();
    assert!(seeds().any(is_found), "no model shows it");
}

/// The same for a stage of contacts with colliders, whose defect changes nothing unless a particle happens to come
/// to rest just before a collider, to slide on it, or to be let go: the check has to find it in one of many models.
fn control_some(defect: Defect, check: impl Fn(&Candidate, &Description) -> Verdict) {
    let precisions = [Precision::F64, Precision::F32].into_iter();
    for [real, perturbed] in precisions.flat_map(|precision| with_defect(precision, defect)) {
        let mut found = false;
        for seed in 0..64 {
            let description = Description { seed, ..on_colliders() };
            if let Err(failure) = check(&real, &description) {
                panic!("the check fails without the defect: {failure}");
            }
            found |= check(&perturbed, &description).is_err();
        }
        assert!(found, "{defect:?} in {} is not seen", real.label);
    }
}

#[test]
fn every_perturbed_stage_of_the_implicit_step_is_found_by_its_check() {
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        for stage in [Stage::SpringLinearise, Stage::ContactLinearise, Stage::ImplicitAssemble] {
            control(Defect::Scaled(stage), &busy(), |candidate, description| {
                checks::implicit_assemble(candidate, description, start)
            });
        }
    }
    // Most bend springs have the slope of a bent strut.
    control(Defect::Scaled(Stage::SpringLinearise), &buckled(), |candidate, description| {
        checks::implicit_assemble(candidate, description, NewtonStart::StepStart)
    });
    for &form in MATRIX_FORMS {
        control(Defect::Scaled(Stage::MatrixApply), &busy(), |candidate, description| {
            checks::matrix_apply(candidate, description, form)
        });
    }
    for stage in [Stage::PreconditionerBuild, Stage::PreconditionerApply] {
        for blocks in [false, true] {
            control(Defect::Scaled(stage), &busy(), |candidate, description| {
                checks::preconditioner_apply(candidate, description, blocks)
            });
        }
    }
    let busy = busy();
    control(Defect::Scaled(Stage::ConstraintFilter), &busy, checks::constraint_filter);
    control(Defect::Scaled(Stage::ConstraintProject), &busy, checks::constraint_project);
    control_some(Defect::Scaled(Stage::ColliderConstraints), checks::collider_constraints);
    control_some(Defect::Scaled(Stage::ColliderConstraints), |candidate, description| {
        checks::implicit_assemble(candidate, description, NewtonStart::StepStart)
    });
    control_some(Defect::Scaled(Stage::ConstraintRelease), checks::constraint_release);
    control_some(Defect::Scaled(Stage::ConstraintImpulses), checks::constraint_impulses);
    control_some(Defect::ConstraintImpulsesDropped, checks::constraint_impulses);
    control(Defect::Scaled(Stage::VectorDot), &busy, checks::vector_dot);
    control(Defect::Scaled(Stage::VectorCombine), &busy, checks::vector_combine);
    control(Defect::Scaled(Stage::VectorFill), &busy, checks::vector_fill);
    control(Defect::Scaled(Stage::VelocityAdd), &busy, checks::velocity_add);
    control(Defect::Scaled(Stage::PositionAdvance), &busy, checks::position_advance);
    control(Defect::Scaled(Stage::PositionFromKept), &busy, checks::position_from_kept);
    control(Defect::Scaled(Stage::StateKeep), &busy, checks::state_keep);
    control(Defect::Scaled(Stage::StateRestore), &busy, checks::state_restore);
}

#[test]
fn a_fused_linear_solver_that_differs_is_found() {
    control(Defect::FusedDiffers, &busy(), |candidate, description| {
        checks::conjugate_gradient(candidate, description, Preconditioner::Block)
    });
    control(Defect::FusedDiffers, &busy(), checks::jacobi);
    control(Defect::FusedDiffers, &busy(), checks::implicit_frame);
}

#[test]
fn a_solution_that_is_a_little_off_is_found() {
    for method in [LinearMethod::ConjugateGradient, LinearMethod::Jacobi] {
        let settings = LinearSettings { method, ..LinearSettings::default() };
        // In f32 a ten-thousandth is within the tolerance.
        control_in(&[Precision::F64], Defect::FusedDiffers, &busy(), |candidate, description| {
            checks::linear_solution(candidate, description, &settings)
        });
    }
}

#[test]
fn an_implicit_trajectory_of_a_perturbed_backend_is_found() {
    let check = |candidate: &Candidate, description: &Description| {
        checks::implicit_trajectory(candidate, description, 8)
    };
    for stage in [Stage::SpringLinearise, Stage::ImplicitAssemble, Stage::PositionAdvance] {
        control_in(&[Precision::F64], Defect::Scaled(stage), &without_contact(), check);
    }
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
        integrator: Integrator::Explicit,
        strain_limit: true,
    };
    let real = cpu(1);
    assert_eq!(checks::same_bits(&[&real, &real], &scenario), Ok(()));
    assert!(checks::same_bits(&[&backend, &backend], &scenario).is_err());
    assert!(checks::resumes_with_same_bits(&backend, &scenario).is_err());
}
