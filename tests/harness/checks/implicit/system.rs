//! Matrix and right-hand side.

use cloth_core::{LinearVector, MatrixForm, NewtonStart};

use super::prepared::Prepared;
use crate::{
    Verdict,
    backends::Candidate,
    models::{Contact, Description, RandomForces},
    stages,
    verdict::{compare, ensure},
};

/// `spring_linearise`, `contact_linearise` and `implicit_assemble` against NUMERICS §5: the blocks of
/// the matrix and the right-hand side, friction of the contacts with colliders included.
///
/// # Errors
/// What is wrong.
pub fn implicit_assemble(
    candidate: &Candidate,
    description: &Description,
    start: NewtonStart,
) -> Verdict {
    compare_system(candidate, &mut Prepared::new(candidate, description, start)?)
}

/// `control_forces_assemble` against NUMERICS §3: what the system has more for forces on single particles.
///
/// # Errors
/// What is wrong.
pub fn control_forces_assemble(
    candidate: &Candidate,
    description: &Description,
    start: NewtonStart,
) -> Verdict {
    let mut prepared = Prepared::new(candidate, description, start)?;
    let Prepared { case, kernels, substep, particles, system, .. } = &mut prepared;
    let forces = RandomForces::of_seed(description.seed, case.model.particle_count());
    kernels.control_forces_write(&forces)?;
    kernels.control_forces_assemble(substep, start)?;
    let given = &case.state.positions;
    stages::control_forces_assemble(particles, (&forces, given), substep, start, system);
    compare_system(candidate, &mut prepared)
}

/// `matrix_apply` to a translation of all, in a case without surroundings: only the mass resists it, however stiff the cloth is, and to its own rounding.
///
/// # Errors
/// What is wrong.
pub fn matrix_apply_to_a_translation(candidate: &Candidate, description: &Description) -> Verdict {
    let alone = Description {
        fields: 0,
        air: false,
        colliders: 0,
        contact: Contact::Off,
        ..description.clone()
    };
    let mut prepared = Prepared::at_start(candidate, &alone)?;
    let way = [0.25, -9.5, 1.0];
    prepared.kernels.vector_fill(way, LinearVector::Direction)?;
    let (from, to) = (LinearVector::Direction, LinearVector::DirectionImage);
    prepared.kernels.matrix_apply(MatrixForm::MatrixFree, from, to)?;
    let mut found = Vec::new();
    prepared.kernels.vector_read(to, &mut found)?;
    for ((particle, image), &mass) in found.iter().enumerate().zip(prepared.case.model.masses()) {
        for (image, way) in image.iter().zip(way) {
            let expected = mass * way;
            let bound = 4.0 * candidate.epsilon() * expected.abs();
            ensure((image - expected).abs() <= bound || !mass.is_finite(), || {
                format!("{}: particle {particle} has {image}, not {expected}", candidate.label)
            })?;
        }
    }
    Ok(())
}

/// The blocks of the matrix and the right-hand side.
pub(super) fn compare_system(candidate: &Candidate, prepared: &mut Prepared) -> Verdict {
    let right_side = prepared.read(LinearVector::RightSide)?;
    let uncertain = &prepared.particles.uncertain;
    compare(candidate, "right-hand side", &prepared.system.right_side, &right_side, uncertain)?;
    let mut found = Vec::new();
    prepared.kernels.matrix_read(&mut found)?;
    let place = |block: &cloth_core::MatrixBlock| [block.row as usize, block.column as usize];
    ensure(found.is_sorted_by(|a, b| place(a) < place(b)), || {
        format!("{}: blocks are not ascending", candidate.label)
    })?;
    let is_certain = |[row, column]: [usize; 2]| !(uncertain[row] || uncertain[column]);
    let expected: Vec<_> =
        prepared.system.blocks().into_iter().filter(|(place, _)| is_certain(*place)).collect();
    found.retain(|block| is_certain(place(block)));
    ensure(expected.len() == found.len(), || {
        format!("{}: {} blocks, expected {}", candidate.label, found.len(), expected.len())
    })?;
    for ((expected_place, expected), found) in expected.iter().zip(&found) {
        ensure(*expected_place == place(found), || {
            format!("{}: block {:?}, expected {expected_place:?}", candidate.label, place(found))
        })?;
        let what = format!("block {expected_place:?}, rows");
        compare(candidate, &what, &expected.0, &found.entries, &[])?;
    }
    Ok(())
}

/// `matrix_apply` against NUMERICS §5.
///
/// # Errors
/// What is wrong.
pub fn matrix_apply(candidate: &Candidate, description: &Description, form: MatrixForm) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let vector = prepared.fill(candidate, LinearVector::Direction)?;
    prepared.kernels.matrix_apply(form, LinearVector::Direction, LinearVector::DirectionImage)?;
    let found = prepared.read(LinearVector::DirectionImage)?;
    let expected = match form {
        MatrixForm::MatrixFree => prepared.system.apply(&vector),
        _ => prepared.system.apply_blocks(&vector),
    };
    // A pair for which rounding decides is missing or not in the rows of its two particles.
    compare(candidate, "image", &expected, &found, &prepared.particles.uncertain)
}
