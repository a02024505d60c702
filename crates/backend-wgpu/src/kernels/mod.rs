//! The stages of the engine on one solver's memory.

mod implicit;
mod semi_implicit;

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, ContactStatistics, DeferredOutcome, ForceControl, ImplicitKernels,
    ImplicitSettings, Kernels, LinearStart, Measures, MidpointSettings, Model, NewtonStart,
    PinWrite, Result, SolverConfig, SolverReport, StageTime, State, Team,
    contact::{Candidate, Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};

use crate::{contact::Command, linear::SolveRequest, stages::Stages};

/// The stages on a GPU.
///
/// Calls record work; it is handed over at the end of a batch, or when a result is asked for. With
/// contact between cloths, changes are kept as commands until the device has confirmed the frame.
pub struct WgpuKernels {
    stages: Stages,
}

impl WgpuKernels {
    pub(crate) fn new(stages: Stages) -> Self {
        Self { stages }
    }

    pub(crate) fn stages_mut(&mut self) -> &mut Stages {
        &mut self.stages
    }
}

impl Kernels for WgpuKernels {
    fn model(&self) -> &Arc<Model> {
        self.stages.model()
    }

    fn config(&self) -> &SolverConfig {
        self.stages.config()
    }

    fn state_write(&mut self, state: &State) -> Result<()> {
        self.stages.state_write(state)
    }

    fn state_read(&mut self, out: &mut State) -> Result<()> {
        self.stages.state_read(out)
    }

    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.stages.forces_read(out)
    }

    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        self.stages.execute(Command::PinsWrite(pins.to_vec()))
    }

    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.stages.frame_begin(plan)
    }

    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.stages.control_forces_write(forces)
    }

    fn has_control_forces(&self) -> bool {
        self.stages.has_control_forces()
    }

    fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ControlForces(*substep))
    }

    fn control_forces_restore(&mut self) -> Result<()> {
        self.stages.execute(Command::ControlForcesRestore)
    }

    fn field_forces(&mut self) -> Result<()> {
        self.stages.execute(Command::FieldForces)
    }

    fn procedural_forces(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ProceduralForces(*substep))
    }

    fn spring_forces(&mut self) -> Result<()> {
        self.stages.execute(Command::SpringForces)
    }

    fn membrane_forces(&mut self) -> Result<()> {
        self.stages.execute(Command::MembraneForces)
    }

    fn bending_forces(&mut self) -> Result<()> {
        self.stages.execute(Command::BendingForces)
    }

    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::AerodynamicForces(*substep))
    }

    fn contact_candidates(&mut self) -> Result<()> {
        self.stages.execute(Command::ContactCandidates)
    }

    fn contact_pairs(&mut self, substep: &Substep) -> Result<()> {
        self.stages.contact_pairs_find(substep)
    }

    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stages.contact_geometry(substep, start)
    }

    fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        self.stages.contact_certify(substep)
    }

    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.stages.contact_certify_iterate(substep)
    }

    fn triangles_touch(&self) -> bool {
        self.stages.triangles_touch()
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        self.stages.contacts_read(out);
        Ok(())
    }

    fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        self.stages.contact_list_read(out)
    }

    fn contact_forces(&mut self) -> Result<()> {
        self.stages.execute(Command::ContactForces)
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::IntegrateExplicit(*substep))
    }

    fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ContactImpulses(*substep))
    }

    fn strain_limit_colours(&self) -> usize {
        self.stages.strain_limit_colours()
    }

    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.stages.execute(Command::StrainLimit(*substep, colour))
    }

    fn stretch_limit_colours(&self) -> usize {
        self.stages.stretch_limit_colours()
    }

    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.stages.execute(Command::StretchLimit(*substep, colour))
    }

    fn iterate_keep(&mut self) -> Result<()> {
        self.stages.execute(Command::IterateKeep)
    }

    fn start_keep(&mut self) -> Result<()> {
        self.stages.execute(Command::StartKeep)
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ColliderResponse(*substep))
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.stages.collider_impulses(out)
    }

    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.stages.vertex_normals_read(out)
    }

    fn measure(&mut self) -> Result<Measures> {
        self.stages.measure()
    }

    fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        self.stages.contact_statistics()
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        self.stages.stitches_set(model)
    }

    fn ghosts_read(&mut self, out: &mut Vec<Ghost>) {
        self.stages.ghosts_read(out);
    }

    fn ghosts_write(&mut self, ghosts: &[Ghost]) {
        self.stages.ghosts_write(ghosts);
    }

    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        self.stages.contact_pairs(out)
    }

    fn stage_times(&mut self) -> Vec<StageTime> {
        self.stages.stage_times()
    }

    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        if !self.stages.is_fused() {
            return stepper::explicit::substep(self, substep);
        }
        if !self.stages.colliders_in_pass() {
            stepper::collider_start(self)?;
        }
        self.stages.execute(Command::ExplicitPass(*substep))?;
        if self.stages.colliders_in_pass() {
            return Ok(());
        }
        stepper::explicit::after_integration(self, substep)?;
        if self.model().colliders().is_empty() { Ok(()) } else { self.collider_response(substep) }
    }

    fn implicit_substep(
        &mut self,
        substep: &Substep,
        settings: &ImplicitSettings,
        report: &mut SolverReport,
    ) -> Result<bool> {
        if !self.stages.defers() {
            // The host looks at every solve: nothing may be left open meanwhile.
            let was_batch = self.stages.batch_set(false);
            let outcome = stepper::implicit::substep(self, substep, settings, report);
            self.stages.batch_set(was_batch);
            return outcome;
        }
        report.newton_iterations += 1;
        let is_warm = settings.linear.warm_start && substep.index > 0;
        let start = if is_warm { LinearStart::Solution } else { LinearStart::Constraints };
        let request = SolveRequest::new(settings, start);
        stepper::collider_start(self)?;
        if self.model().has_collider_constraints() {
            self.collider_constraints(substep)?;
        }
        stepper::implicit::controlled_system(self, substep, NewtonStart::StepStart)?;
        self.stages.execute(Command::ImplicitSolve(*substep, request))?;
        self.velocity_add(1.0)?;
        stepper::implicit::advance(self, substep, NewtonStart::StepStart)?;
        Ok(true)
    }

    fn midpoint_substep(
        &mut self,
        substep: &Substep,
        settings: &MidpointSettings,
        report: &mut SolverReport,
    ) -> Result<bool> {
        // The host looks at every solve, as in Newton's method.
        let was_batch = self.stages.batch_set(false);
        let outcome = stepper::midpoint::substep(self, substep, settings, report);
        self.stages.batch_set(was_batch);
        outcome
    }

    fn deferred_outcome(&mut self) -> Result<DeferredOutcome> {
        self.stages.deferred_outcome()
    }

    fn batch<R: Send>(&mut self, work: impl FnOnce(&mut Self) -> R + Send) -> R {
        self.stages.batch_begin();
        // The host decides what touches what, in loops of a few ten microseconds.
        let result = match self.stages.has_triangles() {
            true => Team::program().install_awake(|| work(self)),
            false => work(self),
        };
        self.stages.batch_end();
        result
    }
}
