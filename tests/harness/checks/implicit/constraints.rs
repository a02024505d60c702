//! Constraints of colliders and pins.

use cloth_core::{ColliderImpulse, Kernels, LinearVector, NewtonStart};

use super::{prepared::Prepared, system::compare_system};
use crate::{
    Verdict,
    backends::Candidate,
    models::Description,
    stages::{self, TrackedImpulse},
    tracked::TrackedVector,
    verdict::{compare, ensure},
};

/// S, by its columns, and z.
fn compare_constraints(candidate: &Candidate, prepared: &mut Prepared) -> Verdict {
    let count = prepared.particles.len();
    let vector = LinearVector::Direction;
    for axis in 0..3 {
        let unit: [f64; 3] = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        prepared.kernels.vector_write(vector, &vec![unit; count])?;
        prepared.kernels.constraint_filter(vector)?;
        let found = prepared.read(vector)?;
        let unit = TrackedVector::exact(unit);
        let constraints = prepared.constraints.0.iter();
        let expected: Vec<_> = constraints.map(|c| c.filter().apply(unit)).collect();
        let uncertain = &prepared.particles.uncertain;
        compare(candidate, "column of the filter", &expected, &found, uncertain)?;
    }
    prepared.kernels.vector_write(vector, &vec![[0.0; 3]; count])?;
    prepared.kernels.constraint_project(vector)?;
    let found = prepared.read(vector)?;
    let both = prepared.constraints.0.iter().zip(&prepared.particles.velocities);
    let expected: Vec<_> = both.map(|(c, &v)| c.change(v)).collect();
    compare(candidate, "change asked for", &expected, &found, &prepared.particles.uncertain)
}

/// `collider_constraints` against NUMERICS §5, through the filter and the change asked for.
///
/// # Errors
/// What is wrong.
pub fn collider_constraints(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    compare_constraints(candidate, &mut prepared)?;
    let counted = prepared.kernels.constraint_statistics()?.constrained;
    let constraints = prepared.constraints.0.iter();
    let expected = constraints.filter(|c| !c.is_free() && !c.is_held()).count() as u64;
    let certain = !prepared.particles.uncertain.contains(&true);
    ensure(!certain || counted == expected, || {
        format!("{}: {counted} particles are constrained, expected {expected}", candidate.label)
    })
}

/// `constraint_filter` against NUMERICS §5, y = S y.
///
/// # Errors
/// What is wrong.
pub fn constraint_filter(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let vector = prepared.fill(candidate, LinearVector::Residual)?;
    prepared.kernels.constraint_filter(LinearVector::Residual)?;
    let found = prepared.read(LinearVector::Residual)?;
    let both = prepared.constraints.0.iter().zip(&vector);
    let expected: Vec<_> = both.map(|(c, &y)| c.filtered(y)).collect();
    compare(candidate, "filtered vector", &expected, &found, &prepared.particles.uncertain)
}

/// `constraint_project` against NUMERICS §5, y = S y + z.
///
/// # Errors
/// What is wrong.
pub fn constraint_project(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let vector = prepared.fill(candidate, LinearVector::Solution)?;
    prepared.kernels.constraint_project(LinearVector::Solution)?;
    let found = prepared.read(LinearVector::Solution)?;
    let velocities = &prepared.particles.velocities;
    let both = prepared.constraints.0.iter().zip(vector.iter().zip(velocities));
    let expected: Vec<_> = both.map(|(c, (&y, &v))| c.filtered(y) + c.change(v)).collect();
    compare(candidate, "projected vector", &expected, &found, &prepared.particles.uncertain)
}

/// Times that [`constraint_release`] runs the stage.
const PASSES: usize = 3;

/// `constraint_release` against NUMERICS §5, each time for another solution that is not what a solver
/// would find: filter, change asked for, matrix and right-hand side.
///
/// # Errors
/// What is wrong.
pub fn constraint_release(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    for pass in 0..PASSES {
        let solution = prepared.fill(candidate, LinearVector::Solution)?;
        let found = prepared.kernels.constraint_release()?;
        let Prepared { case, particles, system, constraints, .. } = &mut prepared;
        let expected =
            stages::constraint_release(&case.model, particles, constraints, system, &solution);
        let certain = !particles.uncertain.contains(&true);
        ensure(!certain || found == expected, || {
            format!("{}: pass {pass} changes {found}, expected {expected}", candidate.label)
        })?;
        compare_constraints(candidate, &mut prepared)?;
        compare_system(candidate, &mut prepared)?;
    }
    Ok(())
}

/// `constraint_impulses` against NUMERICS §5, for solutions that are not what a solver would find, with contacts
/// as they come and as they are after `constraint_release`; nothing is left of what is taken back.
///
/// # Errors
/// What is wrong.
pub fn constraint_impulses(candidate: &Candidate, description: &Description) -> Verdict {
    // Models of even seeds ask for impulses.
    let description = Description { seed: description.seed & !1, ..description.clone() };
    for start in [NewtonStart::StepStart, NewtonStart::Iterate] {
        let mut prepared = Prepared::new(candidate, &description, start)?;
        for pass in 0..PASSES {
            let solution = prepared.fill(candidate, LinearVector::Solution)?;
            prepared.kernels.constraint_impulses(start)?;
            let found = impulses(&mut *prepared.kernels)?;
            let Prepared { case, particles, system, constraints, .. } = &mut prepared;
            let solved = (start == NewtonStart::StepStart).then_some(&solution[..]);
            let mut expected = vec![TrackedImpulse::default(); case.model.colliders().len()];
            stages::constraint_impulses(particles, constraints, system, solved, &mut expected);
            if !particles.uncertain.contains(&true) {
                let parts =
                    |part: usize| expected.iter().map(|sums| sums[part]).collect::<Vec<_>>();
                let linear: Vec<_> = found.iter().map(|sum| sum.linear).collect();
                let name = format!("impulse in pass {pass}, {start:?}, of collider");
                compare(candidate, &name, &parts(0), &linear, &[])?;
                let angular: Vec<_> = found.iter().map(|sum| sum.angular).collect();
                compare(candidate, "moment of collider", &parts(1), &angular, &[])?;
            }
            prepared.kernels.constraint_release()?;
            let Prepared { case, particles, system, constraints, .. } = &mut prepared;
            stages::constraint_release(&case.model, particles, constraints, system, &solution);
        }
        prepared.kernels.state_keep()?;
        prepared.kernels.constraint_impulses(start)?;
        prepared.kernels.state_restore()?;
        let left = impulses(&mut *prepared.kernels)?;
        ensure(left.iter().all(|sum| *sum == ColliderImpulse::default()), || {
            format!("{}: impulses of what was taken back: {left:?}", candidate.label)
        })?;
    }
    Ok(())
}

fn impulses(kernels: &mut dyn Kernels) -> cloth_core::Result<Vec<ColliderImpulse>> {
    let mut impulses = Vec::new();
    kernels.collider_impulses(&mut impulses)?;
    Ok(impulses)
}
