//! One test for each stage of the implicit integrator, under the name of the stage.

use cloth_core::{ImplicitSettings, Integrator, LinearSettings, MatrixForm, NewtonStart};
use harness::{
    backends::{Candidate, candidates_with, cpu},
    checks::{self, PatchFrames},
    feature::Feature,
    linear::{LINEAR_METHODS, MATRIX_FORMS, PRECONDITIONERS},
    models::{Contact, Description, description, description_of_fabric},
    runner::for_all,
};
use proptest::strategy::Strategy;

/// Generated cases for each stage and backend.
const CASES: u32 = 64;

fn with_colliders() -> impl Strategy<Value = Description> {
    description().prop_map(|mut description| {
        description.colliders = description.colliders.max(1);
        description
    })
}

fn with_contact() -> impl Strategy<Value = Description> {
    description().prop_map(|mut description| {
        description.contact = Contact::Penalty;
        description
    })
}

#[test]
fn spring_linearise_and_implicit_assemble() {
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        for_all(CASES, &description(), |candidate, case| {
            checks::implicit_assemble(candidate, case, start)
        });
    }
}

#[test]
fn control_forces_assemble() {
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        for_all(CASES, &description(), |candidate, case| {
            checks::control_forces_assemble(candidate, case, start)
        });
    }
}

#[test]
fn membrane_linearise_and_bending_linearise() {
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        for_all(CASES, &description_of_fabric(), |candidate, case| {
            checks::implicit_assemble(candidate, case, start)
        });
    }
}

#[test]
fn matrix_apply_of_fabric() {
    for_all(CASES, &description_of_fabric(), |candidate, case| {
        checks::matrix_apply(candidate, case, MatrixForm::MatrixFree)
    });
}

#[test]
fn matrix_apply_to_a_translation() {
    for_all(CASES, &description_of_fabric(), checks::matrix_apply_to_a_translation);
}

#[test]
fn contact_linearise() {
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        for_all(CASES, &with_contact(), |candidate, case| {
            checks::implicit_assemble(candidate, case, start)
        });
    }
}

#[test]
fn matrix_apply() {
    for &form in MATRIX_FORMS {
        for_all(CASES, &description(), |candidate, case| {
            checks::matrix_apply(candidate, case, form)
        });
    }
}

#[test]
fn collider_constraints() {
    for_all(2 * CASES, &with_colliders(), checks::collider_constraints);
}

/// Cases in which particles touch four colliders at a time, two of them with nearly the same normal.
#[test]
fn stages_of_constraints_with_many_contacts() {
    let cases = with_colliders().prop_map(|mut case| {
        case.colliders = 4;
        case.contact = Contact::Off;
        case.pieces.truncate(1);
        case
    });
    for_all(CASES, &cases, |candidate, case| {
        checks::collider_constraints(candidate, case)?;
        checks::constraint_release(candidate, case)?;
        checks::constraint_impulses(candidate, case)
    });
}

#[test]
fn constraint_filter() {
    for_all(CASES, &with_colliders(), checks::constraint_filter);
}

#[test]
fn constraint_project() {
    for_all(CASES, &with_colliders(), checks::constraint_project);
}

#[test]
fn constraint_release() {
    for_all(CASES, &with_colliders(), checks::constraint_release);
}

#[test]
fn constraint_impulses() {
    for_all(2 * CASES, &with_colliders(), checks::constraint_impulses);
}

#[test]
fn preconditioner_build_and_preconditioner_apply() {
    for blocks in [false, true] {
        for_all(CASES, &description(), |candidate, case| {
            checks::preconditioner_apply(candidate, case, blocks)
        });
    }
    for &kind in PRECONDITIONERS {
        for_all(CASES, &description(), |candidate, case| {
            checks::preconditioner_is_symmetric(candidate, case, kind)
        });
    }
}

#[test]
fn vector_dot() {
    for_all(CASES, &description(), checks::vector_dot);
}

#[test]
fn vector_combine() {
    for_all(CASES, &description(), checks::vector_combine);
}

#[test]
fn vector_fill() {
    for_all(CASES, &description(), checks::vector_fill);
}

#[test]
fn velocity_add() {
    for_all(CASES, &description(), checks::velocity_add);
}

#[test]
fn position_advance() {
    for_all(CASES, &description(), checks::position_advance);
}

#[test]
fn position_from_kept() {
    for_all(CASES, &description(), checks::position_from_kept);
}

#[test]
fn state_keep_and_state_restore() {
    for_all(CASES, &description(), checks::state_restore);
}

#[test]
fn conjugate_gradient_is_its_stages() {
    for &preconditioner in PRECONDITIONERS {
        for_all(CASES, &description(), |candidate, case| {
            checks::conjugate_gradient(candidate, case, preconditioner)
        });
    }
}

#[test]
fn jacobi_is_its_stages() {
    for_all(CASES, &description(), checks::jacobi);
}

#[test]
fn implicit_substep_is_its_stages() {
    for_all(CASES, &description(), checks::implicit_frame);
}

#[test]
fn every_method_solves_the_system() {
    for &method in LINEAR_METHODS {
        let settings = LinearSettings { method, ..LinearSettings::default() };
        for_all(CASES, &description(), |candidate, case| {
            checks::linear_solution(candidate, case, &settings)
        });
    }
}

#[test]
fn conjugate_gradient_solves_the_system_with_every_preconditioner_and_matrix() {
    for &preconditioner in PRECONDITIONERS {
        for &matrix in MATRIX_FORMS {
            let settings = LinearSettings { preconditioner, matrix, ..LinearSettings::default() };
            for_all(CASES / 2, &description(), |candidate, case| {
                checks::linear_solution(candidate, case, &settings)
            });
        }
    }
}

/// With particles for three levels of groups: bits of the CPU on CUDA, and wgpu near it.
#[test]
fn preconditioner_apply_of_many_groups() {
    for collider in [false, true] {
        for candidate in candidates_with(Feature::Schwarz) {
            let exact = candidate.label.starts_with("cuda");
            // Where a processor stands for a GPU, that with a collider is enough.
            let is_asked = collider || candidate.case_divisor == 1;
            if !(exact || candidate.label.starts_with("wgpu") && is_asked) {
                continue;
            }
            let patch = PatchFrames {
                fabric: true,
                collider,
                integrator: Integrator::Implicit(ImplicitSettings::default()),
                precision: candidate.precision,
                ..PatchFrames::explicit([131, 130])
            };
            let base = Candidate::new("cpu", Box::new(cpu(2)), candidate.precision);
            let tolerances = if exact { [0.0; 2] } else { [1e-5; 2] };
            let verdict = checks::schwarz_of_many_groups([&base, candidate], &patch, tolerances);
            assert_eq!(verdict, Ok(()));
        }
    }
}
