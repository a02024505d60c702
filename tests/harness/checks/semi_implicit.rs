//! Stages of the semi-implicit integrator.

use cloth_core::{Kernels, LinearVector, SemiImplicitSolve, State, stepper::Substep};

use super::motion::compare_state;
use crate::{
    Verdict,
    backends::Candidate,
    feature::Feature,
    models::{Case, Description},
    stages::{Particles, Surplus, angular_surplus, pieces, semi_implicit_residual},
    tracked::{Tracked, TrackedVector},
    verdict::{Failure, ensure},
};

/// How much more an inverse may leave than a factorisation: its columns are rounded each on its own (Higham 2002, section 14.1).
const INVERSE_SPREAD: f64 = 8.0;

/// A case with its forces and the solution of its constant system.
struct Solved {
    case: Case,
    kernels: Box<dyn Kernels>,
    substep: Substep,
    forces: Vec<TrackedVector>,
}

impl Solved {
    /// Substeps are `factor` times as long as those of the case.
    fn new(
        candidate: &Candidate,
        description: &Description,
        factor: f64,
        solve: SemiImplicitSolve,
    ) -> Result<Self, Failure> {
        let case = description.case(candidate);
        let mut kernels = case.kernels(candidate)?;
        let substep = case.substep();
        let substep = Substep { length: factor * substep.length, ..substep };
        kernels.semi_implicit_factorise(substep.length, solve)?;
        kernels.field_forces()?;
        kernels.spring_forces()?;
        if case.model.has_fabric() {
            kernels.membrane_forces()?;
            kernels.bending_forces()?;
        }
        kernels.aerodynamic_forces(&substep)?;
        let mut forces = Vec::new();
        kernels.forces_read(&mut forces)?;
        kernels.semi_implicit_solve(&substep)?;
        let forces = forces.into_iter().map(TrackedVector::exact).collect();
        Ok(Self { case, kernels, substep, forces })
    }

    fn solution(&mut self) -> cloth_core::Result<Vec<TrackedVector>> {
        let mut solution = Vec::new();
        self.kernels.vector_read(LinearVector::Solution, &mut solution)?;
        Ok(solution.into_iter().map(TrackedVector::exact).collect())
    }

    fn surplus(&self, solution: &[TrackedVector], piece: &[u32]) -> Surplus<Tracked> {
        let (model, length) = (&self.case.model, self.substep.length);
        let positions = self.case.particles().positions;
        angular_surplus(model, &positions, &self.forces, solution, length, piece)
    }
}

/// `semi_implicit_solve` against NUMERICS §6, for both ways to solve: y must solve the system to
/// rounding. Its own error may be large where the system is badly conditioned; the residual is
/// not.
///
/// # Errors
/// What is wrong.
pub fn semi_implicit_solve(candidate: &Candidate, description: &Description) -> Verdict {
    for solve in [SemiImplicitSolve::Factorisation, SemiImplicitSolve::DenseInverse] {
        if solve == SemiImplicitSolve::DenseInverse && !candidate.offers(Feature::DenseInverse) {
            continue;
        }
        // From steps that an explicit integrator could take to some that it could not.
        for factor in [1.0, 30.0] {
            let mut solved = Solved::new(candidate, description, factor, solve)?;
            let solution = solved.solution()?;
            let Solved { case, substep, forces, .. } = &solved;
            let particles = case.particles();
            let residual =
                semi_implicit_residual(&case.model, &particles, forces, &solution, substep.length);
            // A factorisation spreads the rounding of a row over others.
            let components = || residual.iter().flat_map(|vector| vector.0);
            let error = components().map(|component| component.error).fold(0.0, f64::max);
            let spread =
                if solve == SemiImplicitSolve::DenseInverse { INVERSE_SPREAD } else { 1.0 };
            let bound = spread * candidate.tolerance(Tracked { value: 0.0, error });
            for (i, component) in components().enumerate() {
                ensure(component.value.abs() <= bound, || {
                    let (particle, value) = (i / 3, component.value);
                    let label = &candidate.label;
                    format!("{label}: {solve:?}, residual {value:e} of {particle}, bound {bound:e}")
                })?;
            }
            for (i, &held) in case.state.held.iter().enumerate().filter(|&(_, &held)| held != 0) {
                ensure(solution[i].values() == [0.0; 3], || format!("held {i}: {held} moves"))?;
            }
        }
    }
    Ok(())
}

/// `torque_correct` against NUMERICS §6: pieces that nothing holds have the angular momentum of
/// their forces afterwards, by a rotation about their centre, and all others are left alone.
///
/// # Errors
/// What is wrong.
pub fn torque_correct(candidate: &Candidate, description: &Description) -> Verdict {
    let mut solved = Solved::new(candidate, description, 30.0, SemiImplicitSolve::Factorisation)?;
    let before = solved.solution()?;
    let substep = solved.substep;
    solved.kernels.torque_correct(&substep)?;
    let after = solved.solution()?;
    let label = &candidate.label;
    for piece in pieces(&solved.case.model) {
        let is_held = piece.iter().any(|&i| solved.case.state.held[i as usize] != 0);
        let particles = || piece.iter().map(|&i| i as usize);
        if is_held || piece.len() == 1 {
            let same = particles().all(|i| before[i].values() == after[i].values());
            ensure(same, || format!("{label}: the piece of particle {} changes", piece[0]))?;
            continue;
        }
        let [old, new] = [&before, &after].map(|solution| solved.surplus(solution, &piece));
        for axis in 0..3 {
            // What there was has its rounding too.
            let angular = new.angular.0[axis];
            let error = angular.error + old.angular.0.iter().map(|c| c.error).sum::<f64>();
            let bound = candidate.tolerance(Tracked { error, ..angular });
            ensure(angular.value.abs() <= bound, || {
                format!("{label}: angular momentum {:e} is left, bound {bound:e}", angular.value)
            })?;
            let linear = new.linear.0[axis] - old.linear.0[axis];
            let bound = candidate.tolerance(linear);
            ensure(linear.value.abs() <= bound, || {
                format!("{label}: momentum changes by {:e}, bound {bound:e}", linear.value)
            })?;
        }
        for i in particles() {
            let arm = old.arm(TrackedVector::exact(solved.case.state.positions[i]));
            let radial = (after[i] - before[i]).dot(arm);
            let rounding = radial.error + arm.length().value * after[i].length().value;
            let bound = candidate.tolerance(Tracked { error: rounding, ..radial });
            ensure(radial.value.abs() <= bound, || {
                format!("{label}: particle {i} moves away from the centre: {:e}", radial.value)
            })?;
        }
    }
    Ok(())
}

/// `velocity_add`, `position_advance`, `position_from_kept`, `state_keep` and `state_restore`
/// against NUMERICS §5.
///
/// # Errors
/// What is wrong.
pub fn solution_motion(candidate: &Candidate, description: &Description) -> Verdict {
    let mut solved = Solved::new(candidate, description, 1.0, SemiImplicitSolve::Factorisation)?;
    let solution = solved.solution()?;
    let start = solved.case.particles();
    let [scale, length] = [0.75, 0.01].map(Tracked::rounded);
    let kernels = &mut *solved.kernels;
    kernels.state_keep()?;
    kernels.velocity_add(scale.value)?;
    let mut expected = start.clone();
    for (velocity, change) in expected.velocities.iter_mut().zip(&solution) {
        *velocity += change.scaled(scale);
    }
    compare_state(candidate, &expected, kernels)?;
    kernels.position_advance(length.value)?;
    let moved = |particles: &Particles, from: &Particles| {
        let velocities = particles.velocities.iter();
        let positions = from.positions.iter().zip(velocities);
        positions.map(|(&x, v)| x + v.scaled(length)).collect::<Vec<_>>()
    };
    expected.positions = moved(&expected, &expected);
    compare_state(candidate, &expected, kernels)?;
    kernels.position_from_kept(length.value)?;
    expected.positions = moved(&expected, &start);
    compare_state(candidate, &expected, kernels)?;
    kernels.state_restore()?;
    let mut state = State::default();
    kernels.state_read(&mut state)?;
    ensure(state.positions == solved.case.state.positions, || "positions not restored".into())?;
    ensure(state.velocities == solved.case.state.velocities, || "velocities not restored".into())
}
