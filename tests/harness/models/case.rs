//! From a description to what a check needs.

use std::sync::Arc;

use cloth_core::{
    ClothMaterial, ContactResponse, Kernels, Model, ModelBuilder, Result, SolverConfig, State,
    StrainLimit,
    stepper::{FramePlan, FrameSpan, Substep},
};

use super::{
    description::{Description, Place},
    pieces, states, surroundings,
};
use crate::{backends::Candidate, random::Random, stages::Particles};

/// A model, a state, and a frame that is about to begin.
#[derive(Clone, Debug)]
pub struct Case {
    /// The model.
    pub model: Arc<Model>,
    /// The settings; the precision is the candidate's.
    pub config: SolverConfig,
    /// A state, rounded to the precision of the candidate.
    pub state: State,
    /// The frame.
    pub plan: FramePlan,
    /// That of the candidate.
    pub epsilon: f64,
}

/// Longest substep of a generated case \[s\].
const TIME_STEP_MAX: f64 = 1e-3;

/// A substep well within the stability limit \[s\], so that states stay finite: a tenth of the
/// shortest time scale of a particle on all its springs, and on as many contacts as a grid particle
/// has neighbours.
fn time_step(model: &Model) -> f64 {
    let mut stiffness = vec![0.0; model.particle_count()];
    let mut damping = vec![0.0; model.particle_count()];
    for spring in model.springs().iter() {
        let kind = model.springs().kinds()[spring.kind as usize];
        for particle in spring.particles {
            stiffness[particle as usize] += kind.stiffness_max();
            damping[particle as usize] += kind.damping;
        }
    }
    let elements = model.elements();
    for triangle in elements.triangles() {
        let jammed = elements.fabrics()[triangle.fabric as usize].locking().steepest();
        triangle.particles.iter().for_each(|&i| stiffness[i as usize] += jammed);
    }
    let contact = match model.self_contact().map(|contact| contact.response) {
        Some(ContactResponse::Penalty { stiffness, damping }) => [12.0 * stiffness, 12.0 * damping],
        Some(ContactResponse::Impulse { .. } | ContactResponse::Triangles { .. }) | None => {
            [0.0; 2]
        }
    };
    let shortest = model.masses().iter().enumerate().map(|(i, mass)| {
        let [stiffness, damping] = [stiffness[i] + contact[0], damping[i] + contact[1]];
        // Infinite for a particle that nothing holds; the limit below is for those.
        (mass / (2.0 * stiffness)).sqrt().min(mass / (2.0 * damping))
    });
    shortest.fold(TIME_STEP_MAX, |step, time| step.min(0.1 * time))
}

impl Description {
    /// Makes the case, the same one for the same description and precision.
    ///
    /// # Panics
    /// If a generated model is not valid: an error in the generator.
    #[must_use]
    pub fn case(&self, candidate: &Candidate) -> Case {
        let mut random = Random::new(self.seed);
        let spacing = random.between(0.03, 0.08);
        let centre = match self.place {
            Place::Origin => [0.0; 3],
            Place::Far => [100.0, -130.0, 70.0],
        };
        let mut builder = ModelBuilder::new();
        for (i, &piece) in self.pieces.iter().enumerate() {
            let name = format!("cloth {i}");
            let mut cloth = pieces::cloth(piece, name, spacing, centre, self.pins, &mut random);
            if self.buckling
                && let ClothMaterial::Springs(material) = &mut cloth.material
            {
                let stiffness = material.bend.stiffness;
                material.bend_model = pieces::random_bend_model(stiffness, spacing, &mut random);
            }
            builder = builder.cloth(cloth);
        }
        for number in 0..self.fields {
            builder = builder.field(surroundings::field(number, &mut random));
        }
        for number in 0..self.colliders {
            builder = builder.collider(surroundings::collider(number, centre, &mut random));
        }
        builder = builder.collider_impulses(self.seed.is_multiple_of(2));
        if self.air {
            builder = builder.air(surroundings::air(&mut random));
            for i in 0..self.pieces.len() {
                if random.chance(0.5) {
                    builder =
                        builder.inflation(surroundings::gas(format!("cloth {i}"), &mut random));
                }
            }
        }
        if let Some(contact) = surroundings::self_contact(self.contact, spacing, &mut random) {
            builder = builder.self_contact(contact);
        }
        let model = match builder.build() {
            Ok(model) => model,
            Err(error) => panic!("the generator made a model that is not valid: {error}"),
        };
        let state = states::deformed(&model, self.deformation, spacing, &mut random);
        let time_step = time_step(&model);
        let limit = self.strain_limit.then(StrainLimit::default);
        let config = SolverConfig {
            precision: candidate.precision,
            time_step,
            strain_limit: limit,
            ..SolverConfig::default()
        };
        let plan = plan(&model, &state, time_step, &mut random);
        let state = candidate.rounded(&state);
        Case { model: Arc::new(model), config, state, plan, epsilon: candidate.epsilon() }
    }
}

/// A frame of five substeps, the last one shorter, in which all colliders move.
fn plan(model: &Model, state: &State, time_step: f64, random: &mut Random) -> FramePlan {
    let targets: Vec<_> =
        state.colliders.iter().map(|pose| surroundings::pose_nearby(pose, random)).collect();
    let wind = model.air().map_or([0.0; 3], |air| air.wind_velocity);
    let mut plan = FramePlan::default();
    let span = FrameSpan {
        time: 0.0,
        duration: 4.5 * time_step,
        wind_velocity: wind,
        anchor_offset: [random.vector(0.1), random.vector(0.1)],
        from: &state.colliders,
        to: &targets,
    };
    plan.refill(model, &span, (0.0, 0), time_step);
    plan
}

impl Case {
    /// The kernels of a candidate, in the state and at the start of the frame of this case.
    ///
    /// # Errors
    /// Those of the backend.
    pub fn kernels(&self, candidate: &Candidate) -> Result<Box<dyn Kernels>> {
        let mut kernels = candidate.backend.create_kernels(self.model.clone(), &self.config)?;
        kernels.state_write(&self.state)?;
        kernels.frame_begin(&self.plan)?;
        Ok(kernels)
    }

    /// The particles for the plain loops.
    #[must_use]
    pub fn particles(&self) -> Particles {
        Particles::new(&self.model, &self.state, self.epsilon)
    }

    /// A substep from the middle of the frame, so that its index matters.
    #[must_use]
    pub fn substep(&self) -> Substep {
        self.plan.substeps[2]
    }
}
