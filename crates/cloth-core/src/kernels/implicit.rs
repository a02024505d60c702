//! The stages of the implicit integrator.

use crate::{
    LinearSettings, MatrixForm, Preconditioner, Result, stepper::Substep, stepper::linear,
};

/// A vector of the linear system, three numbers for each particle, in the memory of the backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LinearVector {
    /// The unknown y, a change of velocity \[m/s\].
    Solution,
    /// The right-hand side b \[N s\].
    RightSide,
    /// The residual r.
    Residual,
    /// The preconditioned residual c.
    Preconditioned,
    /// The image s of c.
    Image,
    /// The search direction p.
    Direction,
    /// The image q of p.
    DirectionImage,
}

impl LinearVector {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Solution,
        Self::RightSide,
        Self::Residual,
        Self::Preconditioned,
        Self::Image,
        Self::Direction,
        Self::DirectionImage,
    ];
}

/// What the system of a Newton iteration is linearised about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewtonStart {
    /// The state at the start of the substep: the step of Baraff and Witkin (1998).
    StepStart,
    /// An iterate: velocity v, position x = x0 + h v, with x0 and v0 kept by `state_keep`.
    Iterate,
}

/// Where an iterative solver starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearStart {
    /// At z, the vector that does nothing but meet the constraints.
    Constraints,
    /// At the present solution, with its constrained part replaced by z.
    Solution,
}

/// What a linear solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearOutcome {
    /// Iterations done; 1 for a direct solver.
    pub iterations: u32,
    /// Relative residual that is left, |S (b - A y)| / |S (b - A z)|.
    pub residual: f64,
    /// Estimate of the error in the norm of the energy that is left, relative to that of the start, where one is made. It is
    /// of some iterations before the last one, so that the error is smaller.
    pub energy: Option<f64>,
    /// Whether the iteration went on with the diagonal as preconditioner, because rounding had made the matrix or the
    /// preconditioner indefinite.
    pub restarted: bool,
    /// Whether what is measured is within the tolerance.
    pub converged: bool,
    /// Whether a number stopped being finite, or the matrix was not positive definite. The solution
    /// is then of no use.
    pub breakdown: bool,
}

/// Counts of the constraints of a substep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConstraintStatistics {
    /// Particles whose velocity a collider constrained.
    pub constrained: u64,
    /// Contacts that were released, or began to slide, or slid with another drag, after a solve.
    pub released: u64,
}

/// One block of the matrix, row and column by particle: for tests and tools.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixBlock {
    /// Particle of the three rows.
    pub row: u32,
    /// Particle of the three columns.
    pub column: u32,
    /// The entries, row by row.
    pub entries: [[f64; 3]; 3],
}

/// The stages of NUMERICS §5: a linear system A y = b under constraints, on memory that the backend
/// owns.
///
/// The composite stages [`conjugate_gradient`](Self::conjugate_gradient) and
/// [`jacobi`](Self::jacobi) have defaults made of the small ones. A backend overrides them where
/// fusing pays.
pub trait ImplicitKernels: Send {
    /// Keeps a copy of positions and velocities, and of the sums of collider impulses, for [`state_restore`](Self::state_restore) and
    /// [`position_from_kept`](Self::position_from_kept).
    ///
    /// # Errors
    /// What the device reports.
    fn state_keep(&mut self) -> Result<()>;

    /// Takes positions, velocities and the sums of collider impulses back to the copy.
    ///
    /// # Errors
    /// What the device reports.
    fn state_restore(&mut self) -> Result<()>;

    /// Keeps a copy of the velocities, those of an iterate of Newton's method, beside the copy of the state.
    ///
    /// # Errors
    /// What the device reports.
    fn velocity_keep(&mut self) -> Result<()>;

    /// Takes velocities back to that copy.
    ///
    /// # Errors
    /// What the device reports.
    fn velocity_restore(&mut self) -> Result<()>;

    /// NUMERICS §5: direction and the two factors of every spring at the present state.
    ///
    /// # Errors
    /// What the device reports.
    fn spring_linearise(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §11: the blocks of the triangles of fabric at the present state, and what they add to b with that `start`.
    ///
    /// # Errors
    /// What the device reports; `Unsupported` by a backend that has none.
    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()>;

    /// NUMERICS §12: the blocks of folds, and what bending adds to b. Comes after `membrane_linearise`.
    ///
    /// # Errors
    /// What the device reports; `Unsupported` by a backend that has none.
    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()>;

    /// NUMERICS §5: direction and factor of the pairs in contact, if contact acts through forces.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_linearise(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §5: the matrix A and the right-hand side b, from what is linearised, the velocities,
    /// the contacts that slide, and f, which has all forces but those of springs and fabric.
    ///
    /// # Errors
    /// What the device reports.
    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()>;

    /// NUMERICS §3, `control_forces`: adds forces on single particles and their springs to the system that `implicit_assemble` has made.
    ///
    /// # Errors
    /// What the device reports.
    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()>;

    /// NUMERICS §5: the constraints that colliders put on velocities in this substep, from the
    /// present state.
    ///
    /// # Errors
    /// What the device reports.
    fn collider_constraints(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §5: releases contacts whose force pulls, lets those slide whose force leaves the cone
    /// of friction, and corrects the drag of those that slide, given the solution. Returns how many
    /// contacts changed; matrix and right-hand side then have changed with them.
    ///
    /// # Errors
    /// What the device reports.
    fn constraint_release(&mut self) -> Result<u64>;

    /// Counts since the last call.
    ///
    /// # Errors
    /// What the device reports.
    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics>;

    /// NUMERICS §5: adds what the constraints of a substep, and the friction of contacts that slide, did to
    /// the cloth to the sums of collider impulses, if the model asks for them. The velocities are those
    /// of the end of the substep, the positions those of its start. With
    /// [`StepStart`](NewtonStart::StepStart) the solution has been added to the velocities; with
    /// [`Iterate`](NewtonStart::Iterate) the right-hand side is that of the present velocities. Uses the
    /// image.
    ///
    /// # Errors
    /// What the device reports.
    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()>;

    /// NUMERICS §5: filters a vector, y = S y.
    ///
    /// # Errors
    /// What the device reports.
    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()>;

    /// NUMERICS §5: gives a vector the velocity changes that constraints ask for, y = S y + z.
    ///
    /// # Errors
    /// What the device reports.
    fn constraint_project(&mut self, vector: LinearVector) -> Result<()>;

    /// NUMERICS §5: to = A from, unfiltered.
    ///
    /// # Errors
    /// What the device reports.
    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()>;

    /// NUMERICS §5: makes the preconditioner of the present matrix and constraints. That of the name `schwarz` may be one
    /// made before, since [`Self::preconditioner_forget`].
    ///
    /// # Errors
    /// `Unsupported` for one that the backend does not have; what the device reports.
    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()>;

    /// A substep begins, or the state is another: a preconditioner of before counts no more, and the next one is made anew.
    fn preconditioner_forget(&mut self);

    /// NUMERICS §5: to = S P^-1 from.
    ///
    /// # Errors
    /// What the device reports.
    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()>;

    /// The scalar product of two vectors, summed by blocks of fixed size.
    ///
    /// # Errors
    /// What the device reports.
    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64>;

    /// to = from_scale from + to_scale to. A scale of zero drops its vector, whatever it holds.
    ///
    /// # Errors
    /// What the device reports.
    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()>;

    /// The same value in every particle.
    ///
    /// # Errors
    /// What the device reports.
    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()>;

    /// Solves A y = b under the constraints by sparse Cholesky factorisation.
    ///
    /// # Errors
    /// `Unsupported` where the backend has none; `OutOfMemory`.
    fn direct_solve(&mut self) -> Result<LinearOutcome>;

    /// v += scale y, y the solution.
    ///
    /// # Errors
    /// What the device reports.
    fn velocity_add(&mut self, scale: f64) -> Result<()>;

    /// x += length v.
    ///
    /// # Errors
    /// What the device reports.
    fn position_advance(&mut self, length: f64) -> Result<()>;

    /// x = x0 + length v, x0 from the last `state_keep`.
    ///
    /// # Errors
    /// What the device reports.
    fn position_from_kept(&mut self, length: f64) -> Result<()>;

    /// All blocks of the matrix that can differ from zero, by rows, columns ascending: for tests and
    /// tools.
    ///
    /// # Errors
    /// What the device reports.
    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()>;

    /// Copies a vector out: for tests and tools.
    ///
    /// # Errors
    /// What the device reports.
    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()>;

    /// Copies a vector of length n in: for tests and tools.
    ///
    /// # Errors
    /// What the device reports.
    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()>;

    /// Composite: the conjugate gradient method. See [`linear::conjugate_gradient`].
    ///
    /// # Errors
    /// Those of the stages it is made of.
    fn conjugate_gradient(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        linear::conjugate_gradient(self, settings, start)
    }

    /// Composite: damped block Jacobi. See [`linear::jacobi`].
    ///
    /// # Errors
    /// Those of the stages it is made of.
    fn jacobi(&mut self, settings: &LinearSettings, start: LinearStart) -> Result<LinearOutcome> {
        linear::jacobi(self, settings, start)
    }
}
