//! Stages that add to the forces.

use cloth_core::Kernels;

use crate::{
    Verdict, backends::Candidate, models::Description, stages, tracked::TrackedVector,
    verdict::compare,
};

fn forces(kernels: &mut dyn Kernels) -> cloth_core::Result<Vec<[f64; 3]>> {
    let mut forces = Vec::new();
    kernels.forces_read(&mut forces)?;
    Ok(forces)
}

/// `field_forces` against NUMERICS §3.
///
/// # Errors
/// What is wrong.
pub fn field_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let expected = stages::field_forces(&case.model, &case.particles());
    compare(candidate, "field force", &expected, &forces(&mut *kernels)?, &[])
}

/// `procedural_forces` against NUMERICS §3, with all expressions.
///
/// # Errors
/// What is wrong.
pub fn procedural_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let fields = description.fields.max(stages::PROCEDURAL_COUNT + 3);
    let case = Description { fields, ..description.clone() }.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    let substep = case.substep();
    kernels.procedural_forces(&substep)?;
    stages::procedural_forces(&case.model, &case.particles(), &substep, &mut expected);
    compare(candidate, "procedural force", &expected, &forces(&mut *kernels)?, &[])
}

/// `spring_forces` against NUMERICS §2.
///
/// # Errors
/// What is wrong.
pub fn spring_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    // What the fields left is taken as it is, so that only this stage is judged.
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    kernels.spring_forces()?;
    stages::spring_forces(&case.model, &case.particles(), &mut expected);
    compare(candidate, "spring force", &expected, &forces(&mut *kernels)?, &[])
}

/// `membrane_forces` against NUMERICS §11.
///
/// # Errors
/// What is wrong.
pub fn membrane_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    kernels.membrane_forces()?;
    stages::membrane_forces(&case.model, &case.particles(), &mut expected);
    compare(candidate, "membrane force", &expected, &forces(&mut *kernels)?, &[])
}

/// `bending_forces` against NUMERICS §12.
///
/// # Errors
/// What is wrong.
pub fn bending_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    kernels.bending_forces()?;
    stages::bending_forces(&case.model, &case.particles(), &mut expected);
    compare(candidate, "bending force", &expected, &forces(&mut *kernels)?, &[])
}

/// `aerodynamic_forces` against NUMERICS §3.
///
/// # Errors
/// What is wrong.
pub fn aerodynamic_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    let substep = case.substep();
    kernels.aerodynamic_forces(&substep)?;
    stages::aerodynamic_forces(&case.model, &case.particles(), &substep, &mut expected);
    compare(candidate, "force of the air", &expected, &forces(&mut *kernels)?, &[])
}

/// `contact_forces` against NUMERICS §8.
///
/// # Errors
/// What is wrong.
pub fn contact_forces(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    let mut expected: Vec<_> =
        forces(&mut *kernels)?.into_iter().map(TrackedVector::exact).collect();
    kernels.contact_candidates()?;
    kernels.contact_forces()?;
    let mut particles = case.particles();
    stages::contact_forces(&case.model, &mut particles, &mut expected);
    let found = forces(&mut *kernels)?;
    compare(candidate, "contact force", &expected, &found, &particles.uncertain)
}
