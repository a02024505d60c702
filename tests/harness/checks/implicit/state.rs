//! Velocities and positions at the end of a substep.

use cloth_core::{LinearVector, State};

use super::{super::motion::compare_state, prepared::Prepared};
use crate::{
    Verdict,
    backends::Candidate,
    bits::first_difference,
    models::Description,
    tracked::{Tracked, TrackedVector},
    verdict::ensure,
};

/// `velocity_add` against NUMERICS §5.
///
/// # Errors
/// What is wrong.
pub fn velocity_add(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    for scale in [1.0, -0.25] {
        let solution = prepared.fill(candidate, LinearVector::Solution)?;
        let mut state = State::default();
        prepared.kernels.state_read(&mut state)?;
        let mut expected =
            crate::stages::Particles::new(&prepared.case.model, &state, candidate.epsilon());
        for (v, y) in expected.velocities.iter_mut().zip(solution) {
            *v += y.scaled(Tracked::rounded(scale));
        }
        prepared.kernels.velocity_add(scale)?;
        compare_state(candidate, &expected, &mut *prepared.kernels)?;
    }
    Ok(())
}

fn moved(positions: &[TrackedVector], velocities: &[TrackedVector], h: f64) -> Vec<TrackedVector> {
    let h = Tracked::rounded(h);
    positions.iter().zip(velocities).map(|(&x, v)| x + v.scaled(h)).collect()
}

/// `position_advance` against NUMERICS §5.
///
/// # Errors
/// What is wrong.
pub fn position_advance(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let length = prepared.substep.length;
    prepared.kernels.position_advance(length)?;
    let particles = &mut prepared.particles;
    particles.positions = moved(&particles.positions, &particles.velocities, length);
    particles.uncertain.fill(false);
    compare_state(candidate, particles, &mut *prepared.kernels)
}

/// `position_from_kept` against NUMERICS §5: the positions of `state_keep`, the velocities of now.
///
/// # Errors
/// What is wrong.
pub fn position_from_kept(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    let kept = prepared.case.state.clone();
    prepared.kernels.state_keep()?;
    let mut other = kept.clone();
    other.positions.iter_mut().for_each(|x| x[1] += 1.0);
    other.velocities = prepared.random_vector(candidate);
    prepared.kernels.state_write(&candidate.rounded(&other))?;
    let particles = &mut prepared.particles;
    particles.velocities = other.velocities.iter().copied().map(TrackedVector::exact).collect();
    particles.uncertain.fill(false);
    let start = particles.positions.clone();
    for length in [prepared.substep.length, 0.0] {
        prepared.kernels.position_from_kept(length)?;
        particles.positions = moved(&start, &particles.velocities, length);
        compare_state(candidate, particles, &mut *prepared.kernels)?;
    }
    Ok(())
}

fn restored(candidate: &Candidate, description: &Description) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    prepared.kernels.state_keep()?;
    prepared.kernels.state_read(&mut prepared.case.state)?;
    prepared.fill(candidate, LinearVector::Solution)?;
    prepared.kernels.velocity_add(1.0)?;
    prepared.kernels.position_advance(prepared.substep.length)?;
    prepared.kernels.state_restore()?;
    let mut found = State::default();
    prepared.kernels.state_read(&mut found)?;
    let difference = first_difference(&prepared.case.state, &found);
    ensure(difference.is_none(), || {
        format!("{}: particle {difference:?} is not where it was", candidate.label)
    })
}

/// `state_keep`: what is kept are all bits.
///
/// # Errors
/// What is wrong.
pub fn state_keep(candidate: &Candidate, description: &Description) -> Verdict {
    restored(candidate, description)
}

/// `state_restore`: what comes back are all bits.
///
/// # Errors
/// What is wrong.
pub fn state_restore(candidate: &Candidate, description: &Description) -> Verdict {
    restored(candidate, description)
}
