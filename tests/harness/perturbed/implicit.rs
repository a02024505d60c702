//! The stages of the implicit integrators, passed on.

use cloth_core::{
    ConstraintStatistics, ImplicitKernels, LinearOutcome, LinearVector, MatrixBlock, MatrixForm,
    NewtonStart, Preconditioner, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep,
};

use super::kernels::PerturbedKernels;

impl ImplicitKernels for PerturbedKernels {
    fn state_keep(&mut self) -> Result<()> {
        self.inner.state_keep()
    }

    fn state_restore(&mut self) -> Result<()> {
        self.inner.state_restore()
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.inner.spring_linearise(substep)
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.inner.contact_linearise(substep)
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.inner.implicit_assemble(substep, start)
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        self.inner.collider_constraints(substep)
    }

    fn constraint_release(&mut self) -> Result<u64> {
        self.inner.constraint_release()
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        self.inner.constraint_statistics()
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        self.inner.constraint_filter(vector)
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        self.inner.constraint_project(vector)
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        self.inner.matrix_apply(form, from, to)
    }

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        self.inner.preconditioner_build(preconditioner)
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.inner.preconditioner_apply(from, to)
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        self.inner.vector_dot(a, b)
    }

    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()> {
        self.inner.vector_combine(from, to)
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        self.inner.direct_solve()
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        self.inner.velocity_add(scale)
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.inner.position_advance(length)
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        self.inner.position_from_kept(length)
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
}

impl SemiImplicitKernels for PerturbedKernels {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        self.inner.semi_implicit_factorise(length, solve)
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        self.inner.semi_implicit_solve(substep)
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        self.inner.torque_correct(substep)
    }
}
