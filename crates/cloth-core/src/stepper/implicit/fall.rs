//! Where the first linear system of a substep starts from: the cloth falls (NUMERICS §5).

use crate::{ImplicitSettings, Kernels, LinearStart, LinearVector, Result};

use super::super::Substep;

/// A fall of less than this share of that of a body in free fall is no start: what hangs or lies does not fall.
const SHARE_MIN: f64 = 0.1;

/// Puts the part of a free fall that brings the solution closest, in the norm of the energy, where the first solve of a substep starts; nothing
/// if little of the cloth falls. `most` is sum m (h g)^2 of all particles, what gravity would do to them all.
///
/// All of a piece that falls gets the same velocity. Without this start a solver, which reaches a few neighbours in an iteration, takes hundreds to find
/// that out.
///
/// # Errors
/// Those of the stages.
pub(super) fn start<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    settings: &ImplicitSettings,
    most: f64,
) -> Result<LinearStart> {
    use LinearVector::{Image, RightSide, Solution};
    let fall = kernels.model().gravity().map(|g| substep.length * g);
    if fall == [0.0; 3] {
        return Ok(LinearStart::Constraints);
    }
    kernels.vector_fill(fall, Solution)?;
    kernels.constraint_filter(Solution)?;
    let work = kernels.vector_dot(Solution, RightSide)?;
    // A is at least the mass.
    if work.is_nan() || work <= SHARE_MIN * most {
        return Ok(LinearStart::Constraints);
    }
    kernels.matrix_apply(settings.linear.matrix, Solution, Image)?;
    let share = work / kernels.vector_dot(Solution, Image)?;
    if share.is_nan() || share <= SHARE_MIN {
        return Ok(LinearStart::Constraints);
    }
    kernels.vector_combine((0.0, Image), (share, Solution))?;
    Ok(LinearStart::Solution)
}
