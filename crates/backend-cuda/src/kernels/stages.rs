//! The stages, as the engine calls them.

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, ContactStatistics, DeferredOutcome, ForceControl, Integrator, Kernels,
    Measures, Model, NewtonStart, PinWrite, Result, SolverConfig, StageTime, State, Team,
    contact::{Candidate, Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};

use super::CudaKernels;
use crate::{
    layout::{BLOCK, CudaReal},
    measure,
    queue::{Launch, argument},
};

impl<T: CudaReal> Kernels for CudaKernels<T> {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn config(&self) -> &SolverConfig {
        &self.config
    }

    fn state_write(&mut self, state: &State) -> Result<()> {
        self.schwarz_forget();
        self.state_upload(state)
    }

    fn state_read(&mut self, out: &mut State) -> Result<()> {
        self.state_download(out)
    }

    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.settle()?;
        if self.has_force {
            return self.vectors_download(out);
        }
        out.clear();
        out.resize(self.count(), [0.0; 3]);
        Ok(())
    }

    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        self.pins_upload(pins)
    }

    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.settle()?;
        self.schwarz_forget();
        if let Some(triangles) = &mut self.triangles {
            triangles.frame_begin(plan);
        }
        self.colliders_upload(plan)
    }

    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.control_forces_upload(forces)
    }

    fn has_control_forces(&self) -> bool {
        self.control_forces.count > 0
    }

    fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        self.kick_push(substep)
    }

    fn control_forces_restore(&mut self) -> Result<()> {
        self.kick_restore()
    }

    fn field_forces(&mut self) -> Result<()> {
        self.has_force = true;
        self.particle_stage("field_forces", &[])
    }

    fn procedural_forces(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        if !self.model.has_procedural_fields() {
            return Ok(());
        }
        self.substep_write(substep)?;
        self.particle_stage("procedural_forces", &[argument(&0_u32)])
    }

    fn spring_forces(&mut self) -> Result<()> {
        self.particle_stage("spring_forces", &[])
    }

    fn membrane_forces(&mut self) -> Result<()> {
        self.membranes_pull()
    }

    fn bending_forces(&mut self) -> Result<()> {
        self.patches_push()
    }

    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        if self.model.air().is_none() {
            return Ok(());
        }
        self.substep_write(substep)?;
        self.particle_stage("aerodynamic_forces", &[argument(&0_u32)])
    }

    fn contact_candidates(&mut self) -> Result<()> {
        self.settle()?;
        self.stage("contact_candidates", Self::contacts_find)
    }

    fn contact_pairs(&mut self, substep: &Substep) -> Result<()> {
        self.triangle_pairs(substep)
    }

    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.triangle_geometry(substep, start)
    }

    fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        self.triangle_certify(substep)
    }

    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.triangle_certify_iterate(substep)
    }

    fn iterate_keep(&mut self) -> Result<()> {
        self.triangle_iterate_keep()
    }

    fn triangles_touch(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| triangles.touches())
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        self.triangle_contacts(out);
        Ok(())
    }

    fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        self.triangle_list(out)
    }

    fn contact_forces(&mut self) -> Result<()> {
        if self.triangles.is_some() {
            self.settle()?;
            return self.triangle_forces();
        }
        if !self.contact_is_penalty() {
            return Ok(());
        }
        self.settle()?;
        self.contacts_count()?;
        self.particle_stage("contact_forces", &[])
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        if !self.has_force {
            return Ok(());
        }
        let length = T::from_f64(substep.length);
        self.particle_stage("integrate_explicit", &[argument(&length)])?;
        self.memory.swap();
        Ok(())
    }

    fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        if self.memory.contact.as_ref().is_none_or(|contact| contact.is_penalty()) {
            return Ok(());
        }
        self.stage("contact_impulses", |kernels| kernels.impulses(substep.length, 0))
    }

    fn strain_limit_colours(&self) -> usize {
        self.memory.tables.colours[0].len() - 1
    }

    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.settle()?;
        self.stage("strain_limit", |kernels| {
            kernels.colour_limit("strain_limit", substep.length, colour)
        })
    }

    fn stretch_limit_colours(&self) -> usize {
        self.memory.tables.colours[1].len() - 1
    }

    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        self.settle()?;
        self.stage("stretch_limit", |kernels| {
            kernels.colour_limit("stretch_limit", substep.length, colour)
        })
    }

    fn strain_limit_sweeps(&mut self, substep: &Substep) -> Result<()> {
        if self.memory.data.limit_sweeps == 0 {
            return Ok(());
        }
        self.settle()?;
        self.stage("strain_limit", |kernels| kernels.sweeps_limit(substep.length))
    }

    fn start_keep(&mut self) -> Result<()> {
        self.settle()?;
        self.triangle_start_keep();
        self.start_copy()
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        self.substep_write(substep)?;
        let done = self.particle_stage("collider_response", &[argument(&0_u32)]);
        self.memory.data.start_position = 0;
        done
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.settle()?;
        self.impulses_take(out)
    }

    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.settle()?;
        self.normals_download(out)
    }

    fn measure(&mut self) -> Result<Measures> {
        self.settle()?;
        let acceleration = self.model.uniform_acceleration();
        let [x, y, z] = acceleration.each_ref().map(argument);
        let first = self.frames.collider_first(usize::MAX, self.model.colliders().len());
        let blocks = self.count().div_ceil(BLOCK) as u32;
        let launch = Launch { blocks, threads: BLOCK as u32, shared: 0, cooperative: false };
        self.stage("measure", |kernels| {
            kernels.start(("measure", "measure"), launch, &[x, y, z, argument(&first)])
        })?;
        let mut partials = Vec::new();
        self.memory.partials.read(&self.memory.queue, &mut partials)?;
        let measures = measure::total(&partials, self.fabric_measure()?);
        let step = self.memory.status.read(&self.memory.queue)?.non_finite_step;
        let non_finite_step = (step != u64::MAX).then_some(step);
        Ok(Measures { non_finite_step, ..measures })
    }

    fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        self.settle()?;
        match &mut self.triangles {
            Some(triangles) => Ok(triangles.statistics()),
            None => self.contact_counts(),
        }
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        // What does whole frames has kinds of springs of its own.
        let has_own = !matches!(self.config.integrator, Integrator::Implicit(_))
            || !self.triangle_stitches_set(model);
        if has_own {
            return Ok(false);
        }
        self.settle()?;
        self.memory.tables.spring_kinds_write(&self.memory.queue, model)?;
        self.model = Arc::clone(model);
        Ok(true)
    }

    fn ghosts_read(&mut self, out: &mut Vec<Ghost>) {
        self.triangle_ghosts(out);
    }

    fn ghosts_write(&mut self, ghosts: &[Ghost]) {
        self.triangle_ghosts_set(ghosts);
    }

    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        self.contact_candidates()?;
        self.pairs_read(out)
    }

    fn stage_times(&mut self) -> Vec<StageTime> {
        self.timing.take(&self.memory.queue)
    }

    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        if self.triangles.is_some() {
            // The host decides in each substep.
            return stepper::explicit::substep(self, substep);
        }
        self.frame_push(substep)
    }

    fn deferred_outcome(&mut self) -> Result<DeferredOutcome> {
        let report = std::mem::take(&mut self.semi_implicit.report);
        Ok(DeferredOutcome { report, broken: None })
    }

    fn batch<R: Send>(&mut self, work: impl FnOnce(&mut Self) -> R + Send) -> R {
        // The host decides what touches what, in loops of a few ten microseconds.
        match self.triangles.is_some() {
            true => Team::program().install_awake(|| work(self)),
            false => work(self),
        }
    }
}
