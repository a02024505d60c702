//! Kernels with a defect.

use std::sync::Arc;

use cloth_backend_reference::{Particles, Vector, contact_forces, contact_impulses};
use cloth_core::{
    ColliderImpulse, ContactStatistics, ForceControl, ImplicitSettings, Kernels, Measures, Model,
    NewtonStart, PinWrite, Result, SolverConfig, SolverReport, StageTime, State,
    contact::{Candidate, Contacts},
    stepper::{self, FramePlan, Substep},
};

use super::{Defect, Stage};

/// Kernels with a defect. The inner kernels have no way to change their forces, so that a wrong
/// force is kept here and added when forces are read or integrated.
pub(super) struct PerturbedKernels {
    pub(super) inner: Box<dyn Kernels>,
    pub(super) defect: Defect,
    /// Relative size of the defect: a stiffness, say, that is off by this much.
    pub(super) size: f64,
    run: u64,
    extra_forces: Vec<[f64; 3]>,
}

/// `from + factor (to - from)`, component by component.
pub(super) fn extrapolate(from: &[[f64; 3]], to: &mut [[f64; 3]], factor: f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = std::array::from_fn(|k| from[k] + factor * (to[k] - from[k]));
    }
}

impl PerturbedKernels {
    /// `inner` with a defect; `run` tells the runs of a backend apart.
    pub(super) fn new(inner: Box<dyn Kernels>, defect: Defect, size: f64, run: u64) -> Self {
        let extra_forces = vec![[0.0; 3]; inner.model().particle_count()];
        Self { inner, defect, size, run, extra_forces }
    }

    pub(super) fn state(&mut self) -> Result<State> {
        let mut state = State::default();
        self.inner.state_read(&mut state)?;
        state.colliders = self.model().initial_state().colliders;
        Ok(state)
    }

    /// Runs a stage that changes forces.
    fn force_stage(
        &mut self,
        stage: Stage,
        run: impl FnOnce(&mut dyn Kernels) -> Result<()>,
    ) -> Result<()> {
        if self.defect != Defect::Scaled(stage) {
            return run(&mut *self.inner);
        }
        let [mut before, mut after] = [Vec::new(), Vec::new()];
        if stage == Stage::FieldForces {
            before = vec![[0.0; 3]; self.extra_forces.len()];
        } else {
            self.inner.forces_read(&mut before)?;
        }
        run(&mut *self.inner)?;
        self.inner.forces_read(&mut after)?;
        let size = self.size;
        for (extra, (before, after)) in self.extra_forces.iter_mut().zip(before.iter().zip(&after))
        {
            *extra = std::array::from_fn(|k| extra[k] + size * (after[k] - before[k]));
        }
        Ok(())
    }

    fn velocities_scale(&mut self, factor: f64) -> Result<()> {
        let mut state = self.state()?;
        state.velocities.iter_mut().for_each(|v| *v = v.map(|component| component * factor));
        self.inner.state_write(&state)
    }

    /// Whether this stage is the wrong one.
    pub(super) fn is_scaled(&self, stage: Stage) -> bool {
        self.defect == Defect::Scaled(stage)
    }

    /// Runs a stage that changes the state.
    pub(super) fn state_stage(
        &mut self,
        stage: Stage,
        run: impl FnOnce(&mut dyn Kernels) -> Result<()>,
    ) -> Result<()> {
        if self.defect != Defect::Scaled(stage) {
            return run(&mut *self.inner);
        }
        let before = self.state()?;
        run(&mut *self.inner)?;
        let mut after = self.state()?;
        extrapolate(&before.positions, &mut after.positions, 1.0 + self.size);
        extrapolate(&before.velocities, &mut after.velocities, 1.0 + self.size);
        self.inner.state_write(&after)
    }

    /// Adds what `extra_forces` does to the state.
    fn extra_forces_integrate(&mut self, time_step: f64) -> Result<()> {
        if self.extra_forces.iter().all(|force| *force == [0.0; 3]) {
            return Ok(());
        }
        let mut state = self.state()?;
        for (i, force) in self.extra_forces.iter().enumerate() {
            if state.held[i] == 0 {
                let mass = self.inner.model().masses()[i];
                let change = force.map(|component| time_step * component / mass);
                for (k, change) in change.into_iter().enumerate() {
                    state.velocities[i][k] += change;
                    state.positions[i][k] += time_step * change;
                }
            }
        }
        self.inner.state_write(&state)
    }

    /// Penalty force of the pair that is to be overlooked, taken away again.
    fn contact_force_drop(&mut self) -> Result<()> {
        let mut pairs = Vec::new();
        self.inner.contact_pairs_read(&mut pairs)?;
        pairs.truncate(1);
        let state = self.state()?;
        let model = self.inner.model().clone();
        let mut particles = Particles::new(&model, &state, f64::EPSILON);
        let mut forces = vec![Vector::<f64>::ZERO; state.len()];
        contact_forces(&model, &mut particles, &pairs, &mut forces);
        for (extra, force) in self.extra_forces.iter_mut().zip(&forces) {
            *extra = std::array::from_fn(|k| extra[k] - force.0[k]);
        }
        Ok(())
    }

    /// Impulses of all pairs but the one that is to be overlooked.
    fn contact_impulses_but_one(&mut self, substep: &Substep) -> Result<()> {
        let mut pairs = Vec::new();
        self.inner.contact_pairs_read(&mut pairs)?;
        let model = self.inner.model().clone();
        let mut state = self.state()?;
        let mut particles = Particles::<f64>::new(&model, &state, f64::EPSILON);
        let pairs = pairs.get(1..).unwrap_or_default();
        contact_impulses(&model, &mut particles, pairs, substep.length);
        state.positions = particles.positions.iter().map(|x| x.0).collect();
        state.velocities = particles.velocities.iter().map(|v| v.0).collect();
        self.inner.state_write(&state)
    }
}

impl Kernels for PerturbedKernels {
    fn model(&self) -> &Arc<Model> {
        self.inner.model()
    }

    fn config(&self) -> &SolverConfig {
        self.inner.config()
    }

    fn state_write(&mut self, state: &State) -> Result<()> {
        self.inner.state_write(state)
    }

    fn state_read(&mut self, out: &mut State) -> Result<()> {
        self.inner.state_read(out)
    }

    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.inner.forces_read(out)?;
        for (force, extra) in out.iter_mut().zip(&self.extra_forces) {
            *force = std::array::from_fn(|k| force[k] + extra[k]);
        }
        Ok(())
    }

    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        self.inner.pins_write(pins)
    }

    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.inner.frame_begin(plan)
    }

    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.inner.control_forces_write(forces)
    }

    fn has_control_forces(&self) -> bool {
        self.inner.has_control_forces()
    }

    fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        self.state_stage(Stage::ControlForces, |inner| inner.control_forces(substep))
    }

    fn control_forces_restore(&mut self) -> Result<()> {
        self.inner.control_forces_restore()
    }

    fn field_forces(&mut self) -> Result<()> {
        self.extra_forces.fill([0.0; 3]);
        self.force_stage(Stage::FieldForces, |inner| inner.field_forces())
    }

    fn procedural_forces(&mut self, substep: &Substep) -> Result<()> {
        self.force_stage(Stage::ProceduralForces, |inner| inner.procedural_forces(substep))
    }

    fn spring_forces(&mut self) -> Result<()> {
        self.force_stage(Stage::SpringForces, |inner| inner.spring_forces())
    }

    fn membrane_forces(&mut self) -> Result<()> {
        self.force_stage(Stage::MembraneForces, |inner| inner.membrane_forces())
    }

    fn bending_forces(&mut self) -> Result<()> {
        self.force_stage(Stage::BendingForces, |inner| inner.bending_forces())
    }

    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()> {
        self.force_stage(Stage::AerodynamicForces, |inner| inner.aerodynamic_forces(substep))
    }

    fn contact_candidates(&mut self) -> Result<()> {
        self.inner.contact_candidates()
    }

    fn contact_pairs(&mut self, substep: &Substep) -> Result<()> {
        self.inner.contact_pairs(substep)
    }

    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.inner.contact_geometry(substep, start)
    }

    fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        self.inner.contact_certify(substep)
    }

    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.inner.contact_certify_iterate(substep)
    }

    fn iterate_keep(&mut self) -> Result<()> {
        self.inner.iterate_keep()
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        self.inner.contacts_read(out)
    }

    fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        self.inner.contact_list_read(out)
    }

    fn contact_forces(&mut self) -> Result<()> {
        self.force_stage(Stage::ContactForces, |inner| inner.contact_forces())?;
        if self.defect == Defect::ContactPairDropped { self.contact_force_drop() } else { Ok(()) }
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        self.state_stage(Stage::IntegrateExplicit, |inner| inner.integrate_explicit(substep))?;
        self.extra_forces_integrate(substep.length)
    }

    fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        if self.defect == Defect::ContactPairDropped {
            return self.contact_impulses_but_one(substep);
        }
        self.state_stage(Stage::ContactImpulses, |inner| inner.contact_impulses(substep))
    }

    fn strain_limit_colours(&self) -> usize {
        self.inner.strain_limit_colours()
    }

    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.state_stage(Stage::StrainLimit, |inner| inner.strain_limit(substep, colour))
    }

    fn stretch_limit_colours(&self) -> usize {
        self.inner.stretch_limit_colours()
    }

    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.state_stage(Stage::StretchLimit, |inner| inner.stretch_limit(substep, colour))
    }

    fn start_keep(&mut self) -> Result<()> {
        self.inner.start_keep()
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        self.state_stage(Stage::ColliderResponse, |inner| inner.collider_response(substep))
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.inner.collider_impulses(out)?;
        if self.is_scaled(Stage::ColliderImpulses) {
            for sum in out {
                sum.linear = sum.linear.map(|component| component * (1.0 + self.size));
            }
        }
        Ok(())
    }

    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.inner.vertex_normals(out)?;
        if self.defect == Defect::Scaled(Stage::VertexNormals) {
            out.iter_mut().for_each(|normal| *normal = normal.map(|c| c * (1.0 + self.size)));
        }
        Ok(())
    }

    fn measure(&mut self) -> Result<Measures> {
        let mut measures = self.inner.measure()?;
        if self.defect == Defect::Scaled(Stage::Measure) {
            measures.energy_elastic *= 1.0 + self.size;
        }
        Ok(measures)
    }

    fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        self.inner.contact_statistics()
    }

    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        self.inner.contact_pairs_read(out)?;
        if self.defect == Defect::ContactPairDropped && !out.is_empty() {
            out.remove(0);
        }
        Ok(())
    }

    fn stage_times(&mut self) -> Vec<StageTime> {
        self.inner.stage_times()
    }

    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        stepper::explicit::substep(self, substep)?;
        let factor = match self.defect {
            Defect::FusedDiffers => 1.0 + self.size,
            Defect::RunsDiffer => 1.0 + self.size * self.run as f64,
            Defect::Scaled(_) | Defect::ContactPairDropped | Defect::ConstraintImpulsesDropped => {
                return Ok(());
            }
        };
        self.velocities_scale(factor)
    }

    fn implicit_substep(
        &mut self,
        substep: &Substep,
        settings: &ImplicitSettings,
        report: &mut SolverReport,
    ) -> Result<bool> {
        let done = stepper::implicit::substep(self, substep, settings, report)?;
        if self.defect == Defect::FusedDiffers {
            self.velocities_scale(1.0 + self.size)?;
        }
        Ok(done)
    }
}
