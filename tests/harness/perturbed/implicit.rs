//! The stages of the implicit integrators with a defect.

use cloth_core::{
    ConstraintStatistics, ImplicitKernels, Kernels, LinearOutcome, LinearSettings, LinearStart,
    LinearVector, MatrixBlock, MatrixForm, NewtonStart, Preconditioner, Result,
    SemiImplicitKernels, SemiImplicitSolve,
    stepper::{self, Substep},
};

use super::{
    Defect, Stage,
    kernels::{PerturbedKernels, extrapolate},
};

impl PerturbedKernels {
    fn has(&self, stage: Stage) -> bool {
        self.defect == Defect::Scaled(stage)
    }

    /// The substep, longer if it is this stage that is wrong.
    fn substep_of(&self, stage: Stage, substep: &Substep) -> Substep {
        let factor = if self.has(stage) { 1.0 + self.size } else { 1.0 };
        Substep { length: substep.length * factor, ..*substep }
    }

    /// Makes what became of a vector a little larger.
    fn vector_scale(&mut self, vector: LinearVector) -> Result<()> {
        let mut values = Vec::new();
        self.inner.vector_read(vector, &mut values)?;
        values.iter_mut().for_each(|value| *value = value.map(|c| c * (1.0 + self.size)));
        self.inner.vector_write(vector, &values)
    }

    fn vector_scale_if(&mut self, stage: Stage, vector: LinearVector) -> Result<()> {
        if self.has(stage) { self.vector_scale(vector) } else { Ok(()) }
    }

    /// What is wrong with a fused solver.
    fn solution_differs(&mut self) -> Result<()> {
        if self.defect == Defect::FusedDiffers {
            self.vector_scale(LinearVector::Solution)?;
        }
        Ok(())
    }
}

impl ImplicitKernels for PerturbedKernels {
    fn state_keep(&mut self) -> Result<()> {
        if !self.has(Stage::StateKeep) {
            return self.inner.state_keep();
        }
        let state = self.state()?;
        let mut wrong = state.clone();
        wrong.velocities.iter_mut().for_each(|v| *v = v.map(|c| c * (1.0 + self.size)));
        self.inner.state_write(&wrong)?;
        self.inner.state_keep()?;
        self.inner.state_write(&state)
    }

    fn state_restore(&mut self) -> Result<()> {
        self.state_stage(Stage::StateRestore, |inner| inner.state_restore())
    }

    fn velocity_keep(&mut self) -> Result<()> {
        self.inner.velocity_keep()
    }

    fn velocity_restore(&mut self) -> Result<()> {
        self.inner.velocity_restore()
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.inner.spring_linearise(&self.substep_of(Stage::SpringLinearise, substep))
    }

    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.inner.membrane_linearise(&self.substep_of(Stage::MembraneLinearise, substep), start)
    }

    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.inner.bending_linearise(&self.substep_of(Stage::BendingLinearise, substep), start)
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.inner.contact_linearise(&self.substep_of(Stage::ContactLinearise, substep))
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.inner.implicit_assemble(&self.substep_of(Stage::ImplicitAssemble, substep), start)
    }

    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        let substep = self.substep_of(Stage::ControlForcesAssemble, substep);
        self.inner.control_forces_assemble(&substep, start)
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        self.inner.collider_constraints(&self.substep_of(Stage::ColliderConstraints, substep))
    }

    fn constraint_release(&mut self) -> Result<u64> {
        if !self.has(Stage::ConstraintRelease) {
            return self.inner.constraint_release();
        }
        let mut solution = Vec::new();
        self.inner.vector_read(LinearVector::Solution, &mut solution)?;
        self.vector_scale(LinearVector::Solution)?;
        let changed = self.inner.constraint_release()?;
        self.inner.vector_write(LinearVector::Solution, &solution)?;
        Ok(changed)
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        self.inner.constraint_statistics()
    }

    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        if self.defect == Defect::ConstraintImpulsesDropped {
            return Ok(());
        }
        if !self.has(Stage::ConstraintImpulses) {
            return self.inner.constraint_impulses(start);
        }
        let mut right_side = Vec::new();
        self.inner.vector_read(LinearVector::RightSide, &mut right_side)?;
        self.vector_scale(LinearVector::RightSide)?;
        self.inner.constraint_impulses(start)?;
        self.inner.vector_write(LinearVector::RightSide, &right_side)
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        self.inner.constraint_filter(vector)?;
        self.vector_scale_if(Stage::ConstraintFilter, vector)
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        self.inner.constraint_project(vector)?;
        self.vector_scale_if(Stage::ConstraintProject, vector)
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        self.inner.matrix_apply(form, from, to)?;
        self.vector_scale_if(Stage::MatrixApply, to)
    }

    fn preconditioner_forget(&mut self) {
        self.inner.preconditioner_forget();
    }

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        self.inner.preconditioner_build(preconditioner)
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.inner.preconditioner_apply(from, to)?;
        self.vector_scale_if(Stage::PreconditionerBuild, to)?;
        self.vector_scale_if(Stage::PreconditionerApply, to)
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        let factor = if self.has(Stage::VectorDot) { 1.0 + self.size } else { 1.0 };
        Ok(factor * self.inner.vector_dot(a, b)?)
    }

    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()> {
        self.inner.vector_combine(from, to)?;
        self.vector_scale_if(Stage::VectorCombine, to.1)
    }

    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        self.inner.vector_fill(value, to)?;
        self.vector_scale_if(Stage::VectorFill, to)
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        self.inner.direct_solve()
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        self.state_stage(Stage::VelocityAdd, |inner| inner.velocity_add(scale))
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.state_stage(Stage::PositionAdvance, |inner| inner.position_advance(length))
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        self.state_stage(Stage::PositionFromKept, |inner| inner.position_from_kept(length))
    }

    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        self.inner.matrix_read(out)
    }

    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.inner.vector_read(vector, out)
    }

    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        self.inner.vector_write(vector, values)
    }

    fn conjugate_gradient(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        let outcome = stepper::linear::conjugate_gradient(self, settings, start)?;
        self.solution_differs()?;
        Ok(outcome)
    }

    fn jacobi(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<LinearOutcome> {
        let outcome = stepper::linear::jacobi(self, settings, start)?;
        self.solution_differs()?;
        Ok(outcome)
    }
}

impl SemiImplicitKernels for PerturbedKernels {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        self.inner.semi_implicit_factorise(length, solve)
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        let nothing = vec![[0.0; 3]; self.inner.model().particle_count()];
        self.inner.vector_write(LinearVector::Solution, &nothing)?;
        self.solution_stage(Stage::SemiImplicitSolve, |inner| inner.semi_implicit_solve(substep))
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        self.solution_stage(Stage::TorqueCorrect, |inner| inner.torque_correct(substep))
    }
}

impl PerturbedKernels {
    /// Runs a stage that changes the solution of the linear system.
    fn solution_stage(
        &mut self,
        stage: Stage,
        run: impl FnOnce(&mut dyn Kernels) -> Result<()>,
    ) -> Result<()> {
        if !self.is_scaled(stage) {
            return run(&mut *self.inner);
        }
        let [mut before, mut after] = [Vec::new(), Vec::new()];
        self.inner.vector_read(LinearVector::Solution, &mut before)?;
        run(&mut *self.inner)?;
        self.inner.vector_read(LinearVector::Solution, &mut after)?;
        extrapolate(&before, &mut after, 1.0 + self.size);
        self.inner.vector_write(LinearVector::Solution, &after)
    }
}
