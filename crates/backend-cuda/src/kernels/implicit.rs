//! The stages of the implicit integrator.

use cloth_core::{
    ConstraintStatistics, ContactResponse, ImplicitKernels, LinearOutcome, LinearSettings,
    LinearStart, LinearVector, MatrixBlock, MatrixForm, NewtonStart, Preconditioner, Result,
    stepper::{
        Substep,
        linear::{block_sum, restarts},
    },
};

use super::{
    CudaKernels,
    linear::{check_matrix, check_preconditioner, unsupported},
    matrix_copy::symmetric,
};
use crate::{
    layout::{BLOCK, CudaReal, Real4},
    linear::Outcome,
    memory::Memory,
    queue::{Launch, argument},
};

impl<T: CudaReal> ImplicitKernels for CudaKernels<T> {
    fn state_keep(&mut self) -> Result<()> {
        self.settle()?;
        let Memory { queue, data, state, .. } = &mut self.memory;
        state.keep(queue, data)?;
        if let Some(memory) = &mut self.memory.feedback {
            memory.kept.copy_from(&self.memory.queue, &memory.impulses)?;
        }
        if let Some(triangles) = &mut self.triangles {
            triangles.keep();
        }
        Ok(())
    }

    fn state_restore(&mut self) -> Result<()> {
        self.settle()?;
        let Memory { queue, data, state, .. } = &mut self.memory;
        state.kept_prepare(queue, data)?;
        if let Some(memory) = &mut self.memory.feedback {
            memory.impulses.copy_from(&self.memory.queue, &memory.kept)?;
        }
        if let Some(triangles) = &mut self.triangles {
            triangles.restore();
        }
        let launch = Launch::over(self.count());
        self.start(("implicit_motion", "state_restore"), launch, &[])
    }

    fn velocity_keep(&mut self) -> Result<()> {
        self.settle()?;
        let present = self.memory.present();
        self.memory.state.velocity_keep(&self.memory.queue, present)
    }

    fn velocity_restore(&mut self) -> Result<()> {
        self.settle()?;
        let present = self.memory.present();
        self.memory.state.velocity_restore(&self.memory.queue, present)
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        let linear = self.linear()?;
        linear.length_set(T::from_f64(substep.length));
        linear.data.has_pairs = 0;
        linear.data.has_contacts = 0;
        // The constant matrix lies in the same memory.
        self.semi_implicit.length = None;
        self.linear_stage(("spring_linearise", "spring_linearise"), &[])
    }

    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.membranes_linearise(substep, start)
    }

    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.patches_linearise(substep, start)
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        if self.triangles.is_some() {
            self.length_set(substep)?;
            return self.triangle_linearise();
        }
        let Some(ContactResponse::Penalty { stiffness, damping }) =
            self.model.self_contact().map(|contact| contact.response)
        else {
            return Ok(());
        };
        self.settle()?;
        self.length_set(substep)?;
        let rows = self.memory.tables.springs.headers.iter().map(|header| header[1] & 0xff_ffff);
        let joined = rows.max().unwrap_or(0);
        let capacity = (self.memory.data.candidate_capacity + joined) as usize;
        self.linear()?;
        if let Some(linear) = &mut self.linear {
            linear.pairs_prepare(&self.memory, capacity)?;
            let length = T::from_f64(substep.length);
            let (stiffness, damping) = (T::from_f64(stiffness), T::from_f64(damping));
            let stiffness = length * stiffness;
            linear.data.pair_share = stiffness / (stiffness + damping);
            linear.data.has_pairs = 1;
            let weight = (length * (stiffness + damping)).sqrt();
            self.linear_stage(("contact_linearise", "contact_linearise"), &[argument(&weight)])?;
        }
        Ok(())
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        if !self.has_force {
            return Ok(());
        }
        self.settle()?;
        if !self.memory.state.has_kept() {
            self.state_keep()?;
        }
        self.length_set(substep)?;
        self.substep_write(substep)?;
        self.fabric_assemble()?;
        let is_iterate = u32::from(start == NewtonStart::Iterate);
        self.linear_stage(("implicit_assemble", "implicit_assemble"), &[argument(&is_iterate)])
    }

    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.control_forces_add(substep, start)
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        self.length_set(substep)?;
        if self.model.colliders().is_empty() {
            return Ok(());
        }
        self.linear()?;
        if let Some(linear) = &mut self.linear {
            let zero: Outcome = bytemuck::Zeroable::zeroed();
            linear.outcome.write(&self.memory.queue, 0, &[zero])?;
        }
        let first = self.frames.collider_first(substep.index, self.model.colliders().len());
        let name = ("collider_constraints", "collider_constraints");
        self.linear_stage(name, &[argument(&first)])
    }

    fn constraint_release(&mut self) -> Result<u64> {
        if self.model.colliders().is_empty() {
            return Ok(0);
        }
        let before = self.outcome()?;
        if before.constrained == 0 {
            return Ok(0);
        }
        self.row_apply(LinearVector::Solution, LinearVector::Image)?;
        self.linear_stage(("constraint_release", "constraint_release"), &[])?;
        let changed = u64::from(self.outcome()?.changed - before.changed);
        self.linear()?.released += changed;
        Ok(changed)
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        if self.linear.is_none() || self.model.colliders().is_empty() {
            return Ok(ConstraintStatistics::default());
        }
        let constrained = u64::from(self.outcome()?.constrained);
        let released = std::mem::take(&mut self.linear()?.released);
        Ok(ConstraintStatistics { constrained, released })
    }

    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        if self.memory.feedback.is_none() {
            return Ok(());
        }
        let is_iterate = u32::from(start == NewtonStart::Iterate);
        if is_iterate == 0 {
            self.row_apply(LinearVector::Solution, LinearVector::Image)?;
        }
        let name = ("constraint_impulses", "constraint_impulses");
        self.linear_stage(name, &[argument(&is_iterate)])
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        let vector = vector as u32;
        self.linear_stage(("constraint_filter", "constraint_filter"), &[argument(&vector)])
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        let vector = vector as u32;
        self.linear_stage(("constraint_project", "constraint_project"), &[argument(&vector)])
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        check_matrix(form)?;
        self.row_apply(from, to)
    }

    fn preconditioner_forget(&mut self) {
        self.schwarz_forget();
    }

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        let preconditioner = preconditioner.at_first();
        let blocks = check_preconditioner(preconditioner)?;
        let linear = self.linear()?;
        linear.preconditioner = preconditioner;
        linear.data.has_blocks = u32::from(blocks);
        self.linear_stage(("preconditioner_build", "preconditioner_build"), &[])?;
        match preconditioner {
            Preconditioner::Schwarz => self.schwarz_build(),
            _ => Ok(()),
        }
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        if self.linear()?.is_schwarz() {
            return self.schwarz_apply(from, to);
        }
        let (from, to) = (from as u32, to as u32);
        let name = ("preconditioner_apply", "preconditioner_apply");
        self.linear_stage(name, &[argument(&from), argument(&to)])
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        self.settle()?;
        let (a, b) = (a as u32, b as u32);
        let blocks = self.count().div_ceil(BLOCK);
        let launch =
            Launch { blocks: blocks as u32, threads: BLOCK as u32, shared: 0, cooperative: false };
        self.stage("vector_dot", |kernels| {
            let arguments = [argument(&a), argument(&b)];
            kernels.linear_start(("vector_dot", "vector_dot"), launch, &arguments)
        })?;
        let mut partials = Vec::new();
        if let Some(linear) = &self.linear {
            linear.partials.read_first(&self.memory.queue, blocks, &mut partials)?;
        }
        Ok(block_sum(partials.into_iter()))
    }

    fn vector_combine(
        &mut self,
        (from_scale, from): (f64, LinearVector),
        (to_scale, to): (f64, LinearVector),
    ) -> Result<()> {
        let has_from = from != to && from_scale != 0.0;
        let to_scale = if from == to { from_scale + to_scale } else { to_scale };
        let (from_scale, to_scale) = (T::from_f64(from_scale), T::from_f64(to_scale));
        let (from, to, has_from) = (from as u32, to as u32, u32::from(has_from));
        let arguments = [
            argument(&from),
            argument(&to),
            argument(&from_scale),
            argument(&to_scale),
            argument(&has_from),
        ];
        self.linear_stage(("vector_combine", "vector_combine"), &arguments)
    }

    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        let [x, y, z] = value.map(T::from_f64);
        let to = to as u32;
        let arguments = [argument(&to), argument(&x), argument(&y), argument(&z)];
        self.linear_stage(("vector_fill", "vector_fill"), &arguments)
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        unsupported("the linear solver direct")
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        let scale = T::from_f64(scale);
        self.linear_stage(("implicit_motion", "velocity_add"), &[argument(&scale)])
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.position_move(length, 0)
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        let Memory { queue, data, state, .. } = &mut self.memory;
        state.kept_prepare(queue, data)?;
        self.position_move(length, 1)
    }

    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        self.settle()?;
        let (mut on, mut off) = (Vec::new(), Vec::new());
        let Some(copy) = self.matrix_copy()? else {
            out.clear();
            return Ok(());
        };
        if let Some(linear) = &self.linear {
            linear.diagonal[0].read(&self.memory.queue, &mut on)?;
            linear.diagonal[1].read(&self.memory.queue, &mut off)?;
        }
        let diagonal: Vec<_> = on.iter().zip(&off).map(|(on, off)| symmetric(on, off)).collect();
        copy.read(&diagonal, out);
        Ok(())
    }

    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.settle()?;
        self.linear()?;
        let mut read = Vec::new();
        if let Some(linear) = &self.linear {
            linear.vectors[vector as usize].read(&self.memory.queue, &mut read)?;
        }
        out.clear();
        out.extend(read.iter().map(|&[x, y, z, _]: &Real4<T>| [x, y, z].map(T::to_f64)));
        Ok(())
    }

    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        self.settle()?;
        self.linear()?;
        let entries: Vec<Real4<T>> =
            values.iter().map(|v| [v[0], v[1], v[2], 0.0].map(T::from_f64)).collect();
        if let Some(linear) = &mut self.linear {
            linear.vectors[vector as usize].write(&self.memory.queue, 0, &entries)?;
        }
        Ok(())
    }

    fn conjugate_gradient(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        check_matrix(settings.matrix)?;
        let (mut done, outcome) = self.solve("conjugate_gradient", settings, start)?;
        let preconditioner = self.linear()?.preconditioner;
        if outcome.indefinite != 0 && restarts(preconditioner, done.residual) {
            // Rounding has made it so: the rest with the diagonal, as `linear::restart`.
            self.preconditioner_build(Preconditioner::Diagonal)?;
            let iterations_max = settings.iterations_max - done.iterations;
            let rest = LinearSettings { iterations_max, ..*settings };
            let (after, _) = self.solve("conjugate_gradient", &rest, LinearStart::Solution)?;
            let iterations = done.iterations + after.iterations;
            done = LinearOutcome { iterations, restarted: true, ..after };
        }
        self.schwarz_solved(&done);
        Ok(done)
    }

    fn jacobi(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<LinearOutcome> {
        check_matrix(settings.matrix)?;
        Ok(self.solve("jacobi", settings, start)?.0)
    }
}
