//! One test for each stage, under the name of the stage.

use cloth_core::Stencil;
use harness::{
    backends::candidates,
    checks,
    models::{
        Contact, Deformation, Description, Piece, description, description_of_fabric, forces,
    },
    runner::for_all,
};
use proptest::strategy::Strategy;

/// Generated cases for each stage and backend.
const CASES: u32 = 96;
/// Cases for a stage in which the plain loops try all pairs.
const CASES_WITH_PAIRS: u32 = 48;

fn with(change: impl Fn(&mut Description)) -> impl Strategy<Value = Description> {
    description().prop_map(move |mut description| {
        change(&mut description);
        description
    })
}

#[test]
fn control_forces() {
    let cases = (description(), forces());
    for_all(CASES, &cases, |candidate, (case, forces)| {
        checks::control_forces(candidate, case, forces)
    });
}

#[test]
fn control_forces_through_frames() {
    for_all(12, &with(|case| case.contact = Contact::Off), checks::control_forces_frames);
}

#[test]
fn field_forces() {
    for_all(CASES, &description(), checks::field_forces);
}

#[test]
fn procedural_forces() {
    for_all(CASES, &description(), checks::procedural_forces);
}

/// Two expressions: a pass over the particles then has more than one program in its registers.
#[test]
fn procedural_forces_in_the_fused_substep() {
    for_all(24, &with(|case| case.fields = 5), checks::explicit_substep);
}

#[test]
fn spring_forces() {
    for_all(CASES, &description(), checks::spring_forces);
}

#[test]
fn membrane_forces() {
    for_all(CASES, &description_of_fabric(), checks::membrane_forces);
}

#[test]
fn bending_forces() {
    for_all(CASES, &description_of_fabric(), checks::bending_forces);
}

#[test]
fn measure_of_fabric() {
    for_all(CASES, &description_of_fabric(), checks::measure);
}

#[test]
fn explicit_substep_of_fabric() {
    for_all(CASES_WITH_PAIRS, &description_of_fabric(), checks::explicit_substep);
}

#[test]
fn aerodynamic_forces() {
    for_all(CASES, &with(|case| case.air = true), checks::aerodynamic_forces);
}

#[test]
fn contact_candidates() {
    for contact in [Contact::Impulse, Contact::Penalty] {
        let cases = with(move |case| case.contact = contact);
        for_all(CASES_WITH_PAIRS, &cases, checks::contact_candidates);
    }
}

#[test]
fn contact_candidates_through_many_substeps() {
    for contact in [Contact::Impulse, Contact::Penalty] {
        let cases = with(move |case| {
            case.contact = contact;
            case.pieces.truncate(2);
        });
        for_all(12, &cases, |candidate, case| {
            checks::contact_candidates_reused(candidate, case, 40)
        });
    }
}

#[test]
fn contact_candidates_after_many_moves() {
    for contact in [Contact::Impulse, Contact::Penalty] {
        // Strips that are long compared to the contact distance: most particles are far from each
        // other at the start, and any list has to be built again when they come near.
        let cases = with(move |case| {
            case.contact = contact;
            let stencil = Stencil::Neighbours12;
            let columns = 20 + (case.seed % 30) as u32;
            case.pieces = vec![Piece::Grid { columns, rows: 2, stencil }; 3];
        });
        for_all(24, &cases, |candidate, case| {
            checks::contact_candidates_after_moves(candidate, case, 30)
        });
    }
}

#[test]
fn contact_candidates_of_approaching_sheets() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        for gap in [2.0, 3.7, 6.0, 12.0, 24.0, 40.0, 80.0] {
            let verdict = checks::contact_candidates_of_approaching_sheets(candidate, gap);
            assert_eq!(verdict, Ok(()));
        }
    }
}

#[test]
fn contact_candidates_of_a_large_folded_cloth() {
    for contact in [Contact::Impulse, Contact::Penalty] {
        let cases = with(move |case| {
            let stencil = Stencil::Neighbours12;
            case.pieces = vec![Piece::Grid { columns: 37, rows: 25, stencil }];
            case.deformation = Deformation::Folded;
            case.contact = contact;
        });
        for_all(1, &cases, |candidate, case| {
            checks::contact_candidates_reused(candidate, case, 10)?;
            checks::contact_candidates_after_moves(candidate, case, 10)
        });
    }
}

#[test]
fn contact_forces() {
    let cases = with(|case| case.contact = Contact::Penalty);
    for_all(CASES_WITH_PAIRS, &cases, checks::contact_forces);
}

#[test]
fn integrate_explicit() {
    for_all(CASES, &description(), checks::integrate_explicit);
}

#[test]
fn contact_impulses() {
    let cases = with(|case| case.contact = Contact::Impulse);
    for_all(CASES_WITH_PAIRS, &cases, checks::contact_impulses);
}

#[test]
fn strain_limit() {
    for_all(CASES, &with(|case| case.strain_limit = true), checks::strain_limit);
}

#[test]
fn stretch_limit() {
    let limited =
        description_of_fabric().prop_map(|case| Description { strain_limit: true, ..case });
    for_all(CASES, &limited, checks::stretch_limit);
}

/// The last collider but one is a distance grid.
#[test]
fn collider_response_of_distance_grids() {
    for_all(CASES, &with(|case| case.colliders = 6), checks::collider_response);
    for_all(CASES, &with(|case| case.colliders = 5), checks::measure);
}

#[test]
fn collider_impulses() {
    let cases = with(|case| case.colliders = case.colliders.max(1));
    for_all(CASES, &cases, checks::collider_impulses);
}

#[test]
fn collider_response() {
    for_all(CASES, &with(|case| case.colliders = case.colliders.max(1)), checks::collider_response);
}

#[test]
fn vertex_normals() {
    for_all(CASES, &description(), checks::vertex_normals);
}

#[test]
fn measure() {
    for_all(CASES, &description(), checks::measure);
}

#[test]
fn semi_implicit_solve() {
    for_all(CASES, &description(), checks::semi_implicit_solve);
}

#[test]
fn semi_implicit_solve_of_fabric() {
    for_all(CASES_WITH_PAIRS, &description_of_fabric(), checks::semi_implicit_solve);
}

#[test]
fn torque_correct_of_fabric() {
    let cases = description_of_fabric().prop_map(|case| Description { pins: false, ..case });
    for_all(CASES_WITH_PAIRS, &cases, checks::torque_correct);
}

#[test]
fn torque_correct() {
    for_all(CASES, &with(|case| case.pins &= case.seed % 2 == 0), checks::torque_correct);
}

#[test]
fn velocity_add_and_position_advance() {
    for_all(CASES, &description(), checks::solution_motion);
}

#[test]
fn explicit_substep_is_its_stages() {
    for_all(2 * CASES, &description(), checks::explicit_substep);
}
