//! A case with its linear system in place.

use cloth_core::{Kernels, LinearVector, NewtonStart, Result, State, stepper::Substep};

use crate::{
    backends::Candidate,
    models::{Case, Description},
    random::Random,
    stages::{self, Constraints, LinearSystem, Linearisation, Particles},
    tracked::TrackedVector,
};

/// Length of the substep in units of that of the case, which is well within the stability limit of
/// the explicit scheme.
const LENGTH_FACTOR: f64 = 30.0;

/// A case, kernels that have assembled its system, and the same from the plain loops.
pub(super) struct Prepared {
    pub(super) case: Case,
    pub(super) kernels: Box<dyn Kernels>,
    pub(super) substep: Substep,
    pub(super) particles: Particles,
    pub(super) system: LinearSystem,
    pub(super) constraints: Constraints,
    pub(super) random: Random,
}

impl Prepared {
    /// At the start of a substep.
    pub(super) fn at_start(candidate: &Candidate, description: &Description) -> Result<Self> {
        Self::new(candidate, description, NewtonStart::StepStart)
    }

    /// At the start of a substep, or at an iterate somewhere near, with the constraints of the start.
    pub(super) fn new(
        candidate: &Candidate,
        description: &Description,
        start: NewtonStart,
    ) -> Result<Self> {
        let mut case = description.case(candidate);
        let mut random = Random::new(description.seed ^ 0x5eed);
        let mut kernels = case.kernels(candidate)?;
        let mut substep = case.substep();
        substep.length *= LENGTH_FACTOR;
        kernels.state_keep()?;
        kernels.collider_constraints(&substep)?;
        let mut particles = case.particles();
        let constraints = {
            let colliders = case.plan.colliders_at(substep.index);
            stages::collider_constraints(&case.model, &mut particles, colliders, substep.length)
        };
        let uncertain = std::mem::take(&mut particles.uncertain);
        let velocities_start: Vec<_> =
            case.state.velocities.iter().copied().map(TrackedVector::exact).collect();
        if start == NewtonStart::Iterate {
            case.state = candidate.rounded(&iterate(&case.state, substep.length, &mut random));
            kernels.state_write(&case.state)?;
        }
        kernels.field_forces()?;
        if case.model.air().is_some() {
            kernels.aerodynamic_forces(&substep)?;
        }
        kernels.spring_linearise(&substep)?;
        if case.model.has_fabric() {
            kernels.membrane_linearise(&substep, start)?;
            kernels.bending_linearise(&substep, start)?;
        }
        let penalty = kernels.contact_is_penalty();
        if penalty {
            kernels.contact_candidates()?;
            kernels.contact_forces()?;
            kernels.contact_linearise(&substep)?;
        }
        kernels.implicit_assemble(&substep, start)?;
        // The forces are taken as they are: other checks judge them.
        let mut forces = Vec::new();
        kernels.forces_read(&mut forces)?;
        let forces: Vec<_> = forces.into_iter().map(TrackedVector::exact).collect();
        let model = &case.model;
        let mut particles = Particles { uncertain, ..case.particles() };
        let mut terms = stages::spring_linearise(model, &mut particles, substep.length);
        if penalty {
            let pairs = stages::contact_pairs(model, &mut particles).pairs;
            let length = substep.length;
            terms.extend(stages::contact_linearise(model, &mut particles, &pairs, length));
        }
        let about = Linearisation {
            length: substep.length,
            wind_velocity: substep.wind_velocity,
            start,
            velocities_start: &velocities_start,
        };
        let elements = [
            stages::membrane_linearise(model, &particles, substep.length, start),
            stages::bending_linearise(model, &particles, substep.length, start),
        ];
        let parts = (terms, &elements[..]);
        let mut system = stages::implicit_assemble(model, &particles, parts, &forces, &about);
        constraints.add_drags(&particles.velocities, &mut system);
        Ok(Self { case, kernels, substep, particles, system, constraints, random })
    }

    /// Numbers between -1 and 1 that the candidate holds exactly.
    pub(super) fn random_vector(&mut self, candidate: &Candidate) -> Vec<[f64; 3]> {
        let vectors = (0..self.particles.len()).map(|_| self.random.vector(1.0)).collect();
        candidate.rounded(&State { positions: vectors, ..State::default() }).positions
    }

    /// Fills a vector of the kernels with such numbers.
    pub(super) fn fill(
        &mut self,
        candidate: &Candidate,
        vector: LinearVector,
    ) -> Result<Vec<TrackedVector>> {
        let values = self.random_vector(candidate);
        self.kernels.vector_write(vector, &values)?;
        Ok(values.into_iter().map(TrackedVector::exact).collect())
    }

    /// A vector of the kernels.
    pub(super) fn read(&mut self, vector: LinearVector) -> Result<Vec<[f64; 3]>> {
        let mut values = Vec::new();
        self.kernels.vector_read(vector, &mut values)?;
        Ok(values)
    }
}

/// A state that is not far from another one.
fn iterate(state: &State, length: f64, random: &mut Random) -> State {
    let mut state = state.clone();
    for i in 0..state.len() {
        if state.held[i] == 0 {
            let change = random.vector(0.5);
            for (k, change) in change.into_iter().enumerate() {
                state.velocities[i][k] += change;
                state.positions[i][k] += length * state.velocities[i][k];
            }
        }
    }
    state
}
