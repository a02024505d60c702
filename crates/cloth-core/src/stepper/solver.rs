//! A solver made of any backend's kernels.

use std::{collections::BTreeMap, sync::Arc, time::Instant};

use crate::{
    ColliderImpulse, ConstraintStatistics, ContactStatistics, Control, DeferredOutcome, Divergence,
    DivergenceCause, DivergenceOrigin, Error, Frame, Kernels, Measures, Model, PinAction,
    PinControl, PinWrite, Pinch, Pose, Result, Solver, SolverReport, State, StepReport,
    contact::{Contacts, Ghost, GhostGuide},
    error::positive,
};

use super::{
    FramePlan, FrameSpan,
    held_places::HeldPlaces,
    time_step::{FrameEnd, TimeStep},
};

/// [`Solver`] over the stages of a backend: divides frames, moves pins and colliders, runs the
/// integrator that the settings ask for, and measures the result.
pub struct SteppedSolver<K> {
    kernels: K,
    plan: FramePlan,
    time_step: TimeStep,
    pins: Vec<PinWrite>,
    control: Control,
    colliders: Vec<Pose>,
    collider_targets: Vec<Pose>,
    wind_velocity: [f64; 3],
    /// Where anchors of forces are, and where they are to be, from where they were given \[m\].
    anchor_offset: [[f64; 3]; 2],
    time: f64,
    step: u64,
    held_places: HeldPlaces,
    ghosts: Vec<Ghost>,
    guide: Option<GhostGuide>,
    /// Of particles that are elsewhere.
    scratch: State,
    report: StepReport,
    solver_report: SolverReport,
    frame_end: FrameEnd,
    frame_start: Option<Instant>,
}

impl<K: Kernels> SteppedSolver<K> {
    /// A solver in the initial state of the model.
    ///
    /// # Errors
    /// [`Error::Invalid`] for settings that make no sense; what the device reports.
    pub fn new(kernels: K) -> Result<Self> {
        kernels.config().validate()?;
        kernels.model().precision_check(kernels.config().precision)?;
        let state = kernels.model().initial_state();
        let precision = kernels.config().precision;
        let wind_velocity = kernels.model().air().map_or([0.0; 3], |air| air.wind_velocity);
        let mut solver = Self {
            time_step: TimeStep::new(kernels.config()),
            kernels,
            plan: FramePlan::default(),
            pins: Vec::new(),
            control: Control::default(),
            colliders: Vec::new(),
            collider_targets: Vec::new(),
            wind_velocity,
            anchor_offset: [[0.0; 3]; 2],
            time: 0.0,
            step: 0,
            held_places: HeldPlaces::new(precision),
            ghosts: Vec::new(),
            guide: None,
            scratch: State::default(),
            report: StepReport::default(),
            solver_report: SolverReport::default(),
            frame_end: FrameEnd::default(),
            frame_start: None,
        };
        solver.upload(&state)?;
        Ok(solver)
    }

    /// The kernels, for what a backend offers beyond [`Solver`].
    pub const fn kernels_mut(&mut self) -> &mut K {
        &mut self.kernels
    }

    /// Makes ready to say where the particles of moving pins are now: the one case in which a control may read the state
    /// back, and only for a particle that was free, or was caught in flight.
    fn pin_places_find(&mut self) -> Result<()> {
        let is_unknown =
            |pin: &PinControl| pin.action.moves() && self.held_places.get(pin.particle).is_none();
        if self.control.pins.iter().any(is_unknown) {
            self.kernels.state_read(&mut self.scratch)?;
        }
        Ok(())
    }

    /// Where a particle was when its place was last asked for.
    fn pin_place(&self, particle: u32) -> [f64; 3] {
        let read = || self.scratch.positions.get(particle as usize).copied();
        self.held_places.get(particle).or_else(read).unwrap_or_default()
    }

    /// Holds what bodies have pinched between them, and lets go what is outside of them again.
    fn ghosts_guide(&mut self, duration: f64) -> Result<()> {
        if self.kernels.config().pinch != Pinch::Ghost {
            return Ok(());
        }
        self.kernels.ghosts_read(&mut self.ghosts);
        if self.ghosts.is_empty() {
            return Ok(());
        }
        self.kernels.state_read(&mut self.scratch)?;
        self.scratch.time = self.time;
        self.scratch.colliders.clone_from(&self.colliders);
        let model = Arc::clone(self.kernels.model());
        if self.guide.is_none() {
            self.guide = GhostGuide::new(&model);
        }
        if let Some(guide) = &mut self.guide {
            let end = (&*self.collider_targets, self.time + duration);
            let controlled = &self.control.pins;
            let pins = guide.pins(&model, &mut self.ghosts, &self.scratch, end, controlled);
            self.control.pins.extend(pins);
            self.kernels.ghosts_write(&self.ghosts);
        }
        Ok(())
    }

    /// Turns the pending control into writes for the kernels.
    fn control_apply(&mut self, duration: f64) -> Result<()> {
        for control in &self.control.colliders {
            self.collider_targets[control.collider as usize] = control.pose;
        }
        self.ghosts_guide(duration)?;
        self.pins.clear();
        self.pin_places_find()?;
        let mut moved = std::mem::take(&mut self.control.pins);
        for PinControl { particle, action } in &mut moved {
            let place = self.pin_place(*particle);
            if let PinAction::MoveBy(way) = *action {
                *action = PinAction::MoveTo(std::array::from_fn(|k| place[k] + way[k]));
            }
            self.pins.push(PinWrite::at_frame_start(*particle, action, place, duration));
        }
        self.control.pins = moved;
        if !self.pins.is_empty() {
            self.kernels.pins_write(&self.pins)?;
        }
        if let Some(wind) = self.control.wind_velocity {
            self.wind_velocity = wind;
        }
        if let Some(forces) = &self.control.forces {
            let last: BTreeMap<u32, _> = forces.iter().map(|f| (f.particle, *f)).collect();
            let forces: Vec<_> = last.into_values().collect();
            self.kernels.control_forces_write(&forces)?;
            self.anchor_offset = [[0.0; 3]; 2];
        }
        if let Some(offset) = self.control.anchor_offset {
            self.anchor_offset[1] = offset;
        }
        Ok(())
    }

    /// Puts pins that moved exactly on their targets, at rest there until told otherwise.
    fn control_finish(&mut self) -> Result<()> {
        self.pins.clear();
        for pin in self.control.pins.drain(..) {
            self.held_places.pin_set(&pin);
            if let PinAction::MoveTo(target) = pin.action {
                self.pins.push(PinWrite {
                    particle: pin.particle,
                    held: true,
                    position: Some(target),
                    velocity: Some([0.0; 3]),
                });
            }
        }
        if !self.pins.is_empty() {
            self.kernels.pins_write(&self.pins)?;
        }
        self.control = Control::default();
        self.colliders.clone_from(&self.collider_targets);
        self.anchor_offset[0] = self.anchor_offset[1];
        Ok(())
    }

    /// Books what came of substeps that were recorded without waiting for them.
    fn deferred_settle(&mut self) -> Result<()> {
        let DeferredOutcome { report, broken } = self.kernels.deferred_outcome()?;
        self.solver_report.add_attempt(&report, true);
        if broken.is_some() {
            self.kernels.control_forces_restore()?;
        }
        let broken = self.plan.substeps.iter().find(|substep| Some(substep.step) == broken);
        if let Some(&substep) = broken {
            self.step = substep.step - 1;
            self.time = substep.time;
            self.frame_end = FrameEnd { substeps: substep.index as u32, broken: Some(substep) };
        }
        Ok(())
    }

    fn divergence(&self, measures: &Measures) -> Option<Divergence> {
        let bound = self.kernels.config().strain_bound;
        let (particle, cause) = if let Some(particle) = measures.non_finite_particle {
            (particle, DivergenceCause::NonFinite)
        } else if measures.strain_max > bound {
            let strain = measures.strain_max;
            (measures.strain_particle, DivergenceCause::Strain { strain, bound })
        } else if self.frame_end.broken.is_some() {
            (measures.strain_particle, DivergenceCause::LinearSolver)
        } else {
            return None;
        };
        let broken = self.frame_end.broken.map(|substep| substep.step);
        let step = measures.non_finite_step.or(broken).unwrap_or(self.step);
        let substep = self.plan.substeps.iter().find(|substep| substep.step == step);
        let integrator = &self.kernels.config().integrator;
        Some(Divergence {
            step,
            time: substep.map_or(self.time, |substep| substep.time + substep.length),
            particle,
            cause,
            time_step: self.time_step.length(),
            stable_time_step: self.kernels.model().stable_time_step_of(integrator),
            origin: DivergenceOrigin::Unknown,
        })
    }
}

impl<K: Kernels> Solver for SteppedSolver<K> {
    fn model(&self) -> &Arc<Model> {
        self.kernels.model()
    }

    fn colliders(&self) -> &[Pose] {
        &self.colliders
    }

    fn upload(&mut self, state: &State) -> Result<()> {
        state.validate(self.kernels.model())?;
        self.kernels.state_write(state)?;
        self.held_places.state_set(state);
        self.time = state.time;
        self.step = state.step;
        self.time_step.upload(state);
        self.colliders.clone_from(&state.colliders);
        self.collider_targets.clone_from(&state.colliders);
        self.control = Control::default();
        Ok(())
    }

    fn set_control(&mut self, control: &Control) -> Result<()> {
        control.validate(self.kernels.model())?;
        self.control = control.clone();
        Ok(())
    }

    fn advance(&mut self, frame: Frame) -> Result<()> {
        positive(|| "duration of the frame".into(), frame.duration)?;
        self.deferred_settle()?;
        self.frame_start = Some(Instant::now());
        self.control_apply(frame.duration)?;
        let span = FrameSpan {
            time: self.time,
            duration: frame.duration,
            wind_velocity: self.wind_velocity,
            anchor_offset: self.anchor_offset,
            from: &self.colliders,
            to: &self.collider_targets,
        };
        self.solver_report = SolverReport::default();
        self.frame_end = self.time_step.frame(
            &mut self.kernels,
            &mut self.plan,
            (&span, self.step),
            &mut self.solver_report,
        )?;
        let broken = self.frame_end.broken.map(|substep| substep.time);
        self.time = broken.unwrap_or(self.time + frame.duration);
        self.step += u64::from(self.frame_end.substeps);
        self.control_finish()
    }

    fn synchronize(&mut self) -> Result<StepReport> {
        if let Some(start) = self.frame_start.take() {
            let measures = self.kernels.measure()?;
            self.deferred_settle()?;
            let ContactStatistics { contacts, candidates, rebuilds, truncated, exempt, ghosts } =
                self.kernels.contact_statistics()?;
            let ConstraintStatistics { constrained, released } =
                self.kernels.constraint_statistics()?;
            self.report = StepReport {
                time: self.time,
                substeps: self.frame_end.substeps,
                solver: SolverReport {
                    constrained,
                    released,
                    preconditioner: (self.solver_report.preconditioner)
                        .or_else(|| Some(self.kernels.config().preconditioner()?.at_first())),
                    ..std::mem::take(&mut self.solver_report)
                },
                contacts,
                contact_candidates: candidates,
                contact_rebuilds: rebuilds,
                contact_truncated: truncated,
                contact_exempt: exempt,
                contact_ghosts: ghosts,
                measures,
                stage_times: self.kernels.stage_times(),
                wall_time: start.elapsed(),
                ..StepReport::default()
            };
            if let Some(divergence) = self.divergence(&measures) {
                return Err(Error::Diverged(divergence));
            }
        }
        Ok(self.report.clone())
    }

    fn download(&mut self, out: &mut State) -> Result<()> {
        self.deferred_settle()?;
        self.kernels.state_read(out)?;
        out.time = self.time;
        out.step = self.step;
        self.time_step.download(out);
        out.colliders.clone_from(&self.colliders);
        Ok(())
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        self.deferred_settle()?;
        self.kernels.stitches_set(model)
    }

    fn particle_position(&mut self, particle: u32) -> Result<[f64; 3]> {
        if self.held_places.get(particle).is_none() {
            self.deferred_settle()?;
            self.kernels.state_read(&mut self.scratch)?;
        }
        Ok(self.pin_place(particle))
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.kernels.collider_impulses(out)
    }

    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.kernels.vertex_normals(out)
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        self.deferred_settle()?;
        self.kernels.contacts_read(out)
    }
}
