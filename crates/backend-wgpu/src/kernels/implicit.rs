//! The stages of the implicit integrator on a GPU.

use cloth_core::{
    ConstraintStatistics, Error, ImplicitKernels, LinearOutcome, LinearSettings, LinearStart,
    LinearVector, MatrixBlock, MatrixForm, NewtonStart, Preconditioner, Result, stepper::Substep,
};

use super::WgpuKernels;
use crate::{contact::Command, fault::BACKEND};

impl ImplicitKernels for WgpuKernels {
    fn state_keep(&mut self) -> Result<()> {
        self.stages.execute(Command::StateKeep)
    }

    fn state_restore(&mut self) -> Result<()> {
        self.stages.execute(Command::StateRestore)
    }

    fn velocity_keep(&mut self) -> Result<()> {
        self.stages.execute(Command::VelocityKeep)
    }

    fn velocity_restore(&mut self) -> Result<()> {
        self.stages.execute(Command::VelocityRestore)
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::SpringLinearise(*substep))
    }

    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stages.execute(Command::MembraneLinearise(*substep, start))
    }

    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stages.execute(Command::BendingLinearise(*substep, start))
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ContactLinearise(*substep))
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stages.execute(Command::ImplicitAssemble(*substep, start))
    }

    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stages.execute(Command::ControlForcesAssemble(*substep, start))
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::ColliderConstraints(*substep))
    }

    fn constraint_release(&mut self) -> Result<u64> {
        self.stages.constraint_release()
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        self.stages.constraint_statistics()
    }

    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        self.stages.execute(Command::ConstraintImpulses(start))
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        self.stages.constraint_filter(vector)
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        self.stages.constraint_project(vector)
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        self.stages.matrix_apply(form, from, to)
    }

    fn preconditioner_forget(&mut self) {
        self.stages.schwarz_forget();
    }

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        self.stages.preconditioner_build(preconditioner)
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.stages.preconditioner_apply(from, to)
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        self.stages.vector_dot(a, b)
    }

    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()> {
        self.stages.vector_combine(from, to)
    }

    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        self.stages.vector_fill(value, to)
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        let feature = "the linear solver direct (it has cg and jacobi)".into();
        Err(Error::Unsupported { backend: BACKEND, feature })
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        self.stages.execute(Command::VelocityAdd(scale))
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.stages.execute(Command::PositionAdvance(length))
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        self.stages.execute(Command::PositionFromKept(length))
    }

    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        self.stages.matrix_read(out)
    }

    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.stages.vector_read(vector, out)
    }

    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        self.stages.vector_write(vector, values)
    }

    fn conjugate_gradient(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        let method = cloth_core::LinearMethod::ConjugateGradient;
        self.stages.solve_now(&LinearSettings { method, ..*settings }, start)
    }

    fn jacobi(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<LinearOutcome> {
        let method = cloth_core::LinearMethod::Jacobi;
        self.stages.solve_now(&LinearSettings { method, ..*settings }, start)
    }
}
