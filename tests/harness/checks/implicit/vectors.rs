//! Preconditioners, and operations on vectors.

use cloth_core::{LinearVector, Preconditioner};

use super::prepared::Prepared;
use crate::{
    Verdict,
    backends::{Candidate, SAFETY},
    models::Description,
    stages,
    tracked::{Tracked, TrackedVector},
    verdict::{compare, ensure},
};

/// `preconditioner_build` and `preconditioner_apply` against NUMERICS §5, for the diagonal and for
/// blocks.
///
/// # Errors
/// What is wrong.
pub fn preconditioner_apply(
    candidate: &Candidate,
    description: &Description,
    blocks: bool,
) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let kind = if blocks { Preconditioner::Block } else { Preconditioner::Diagonal };
    prepared.kernels.preconditioner_build(kind)?;
    let residual = prepared.fill(candidate, LinearVector::Residual)?;
    prepared.kernels.preconditioner_apply(LinearVector::Residual, LinearVector::Preconditioned)?;
    let found = prepared.read(LinearVector::Preconditioned)?;
    let matrix = prepared.system.diagonal();
    let apply = |(i, constraint): (usize, &stages::Constraint)| {
        let diagonal = matrix[i];
        stages::preconditioner_apply(diagonal, constraint, blocks, residual[i], candidate.epsilon())
    };
    let expected: Vec<_> = prepared.constraints.0.iter().enumerate().map(apply).collect();
    compare(candidate, "preconditioned", &expected, &found, &prepared.particles.uncertain)
}

/// What every preconditioner must be for the conjugate gradient method to converge: symmetric,
/// positive definite on what is free, and zero on what is constrained.
///
/// # Errors
/// What is wrong.
pub fn preconditioner_is_symmetric(
    candidate: &Candidate,
    description: &Description,
    kind: Preconditioner,
) -> Verdict {
    use LinearVector::{Direction, DirectionImage, Image, Preconditioned, Residual};
    let mut prepared = Prepared::at_start(candidate, description)?;
    let kernels = &mut prepared.kernels;
    kernels.preconditioner_build(kind)?;
    let mut filtered = [Vec::new(), Vec::new()];
    for (vector, out) in [(Residual, 0), (Direction, 1)] {
        prepared.fill(candidate, vector)?;
        prepared.kernels.constraint_filter(vector)?;
        filtered[out] = prepared.read(vector)?;
    }
    let kernels = &mut prepared.kernels;
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    kernels.preconditioner_apply(Direction, DirectionImage)?;
    let [ab, ba, aa] = [
        kernels.vector_dot(Residual, DirectionImage)?,
        kernels.vector_dot(Direction, Preconditioned)?,
        kernels.vector_dot(Residual, Preconditioned)?,
    ];
    let sum = |vectors: &[[f64; 3]]| vectors.iter().flatten().map(|c| c * c).sum::<f64>();
    let preconditioned = prepared.read(Preconditioned)?;
    let square = sum(&filtered[0]);
    ensure(square == 0.0 || aa > 0.0, || format!("{}: r.c is {aa:e}", candidate.label))?;
    // Rounding of the preconditioned vectors, condition numbers of the blocks included.
    let scale = (sum(&preconditioned) * sum(&filtered[1])).sqrt();
    ensure((ab - ba).abs() <= 1e4 * candidate.epsilon() * scale, || {
        format!("{}: {kind} is not symmetric: {ab:e}, {ba:e}", candidate.label)
    })?;
    // Filtering once more changes nothing.
    prepared.kernels.vector_combine((1.0, Preconditioned), (0.0, Image))?;
    prepared.kernels.constraint_filter(Image)?;
    let again = prepared.read(Image)?;
    let largest = preconditioned.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    let changed = preconditioned.iter().flatten().zip(again.iter().flatten());
    let changed = changed.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    ensure(changed <= 16.0 * candidate.epsilon() * largest, || {
        format!("{}: {kind} leaves {changed:e} in constrained directions", candidate.label)
    })
}

/// `vector_dot`: the bound is that of a sum in any order.
///
/// # Errors
/// What is wrong.
pub fn vector_dot(candidate: &Candidate, description: &Description) -> Verdict {
    use LinearVector::{Direction, Residual};
    let mut prepared = Prepared::at_start(candidate, description)?;
    let a = prepared.fill(candidate, Residual)?;
    let b = prepared.fill(candidate, Direction)?;
    for (vectors, expected) in
        [((Residual, Direction), dot(&a, &b)), ((Residual, Residual), dot(&a, &a))]
    {
        let found = prepared.kernels.vector_dot(vectors.0, vectors.1)?;
        let bound = SAFETY * candidate.epsilon() * expected.error;
        ensure((found - expected.value).abs() <= bound, || {
            let value = expected.value;
            format!("{}: {found:e}, expected {value:e}, bound {bound:e}", candidate.label)
        })?;
    }
    Ok(())
}

fn dot(a: &[TrackedVector], b: &[TrackedVector]) -> Tracked {
    let mut magnitude = 0.0;
    let mut sum = Tracked::default();
    for (a, b) in a.iter().zip(b) {
        let [x, y] = [a.values(), b.values()];
        for (x, y) in x.into_iter().zip(y) {
            sum.value += x * y;
            magnitude += (x * y).abs();
            // The partial sum in the worst order, and the product.
            sum.error += magnitude + (x * y).abs();
        }
    }
    // Half of it is what a bound of each rounding by eps/2 would give, and the safety of a tracked
    // number, meant for what is computed in another way, is not needed for a sum.
    sum.error /= 2.0 * SAFETY;
    sum
}

/// `vector_combine`, with the scales that drop a vector even if it holds no numbers.
///
/// # Errors
/// What is wrong.
pub fn vector_combine(candidate: &Candidate, description: &Description) -> Verdict {
    use LinearVector::{Image, Solution};
    let mut prepared = Prepared::at_start(candidate, description)?;
    let nothing = vec![[f64::NAN; 3]; prepared.particles.len()];
    for (from_scale, to_scale) in [(1.0, 0.0), (-0.37, 1.0), (0.0, 0.81), (1.3, -2.1), (0.0, 0.0)] {
        let mut from = prepared.fill(candidate, Image)?;
        let mut to = prepared.fill(candidate, Solution)?;
        if from_scale == 0.0 {
            prepared.kernels.vector_write(Image, &nothing)?;
            from.fill(TrackedVector::ZERO);
        }
        if to_scale == 0.0 {
            prepared.kernels.vector_write(Solution, &nothing)?;
            to.fill(TrackedVector::ZERO);
        }
        prepared.kernels.vector_combine((from_scale, Image), (to_scale, Solution))?;
        let [a, b] = [from_scale, to_scale].map(Tracked::rounded);
        let expected: Vec<_> =
            from.iter().zip(&to).map(|(from, to)| from.scaled(a) + to.scaled(b)).collect();
        let found = prepared.read(Solution)?;
        compare(candidate, &format!("{from_scale}, {to_scale}:"), &expected, &found, &[])?;
    }
    Ok(())
}

/// `vector_fill`, of a vector that holds no numbers.
///
/// # Errors
/// What is wrong.
pub fn vector_fill(candidate: &Candidate, description: &Description) -> Verdict {
    use LinearVector::Solution;
    let mut prepared = Prepared::at_start(candidate, description)?;
    let nothing = vec![[f64::NAN; 3]; prepared.particles.len()];
    prepared.kernels.vector_write(Solution, &nothing)?;
    let value = [0.3, -9.81, 1e-4];
    prepared.kernels.vector_fill(value, Solution)?;
    let expected = vec![TrackedVector::rounded(value); nothing.len()];
    compare(candidate, "filled:", &expected, &prepared.read(Solution)?, &[])
}
