//! Backends that are wrong on purpose, to prove that the checks can fail.

mod implicit;
mod kernels;

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use cloth_core::{
    Backend, BackendInfo, Kernels, Model, Result, Solver, SolverConfig, stepper::SteppedSolver,
};

use self::kernels::PerturbedKernels;

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// What the stage changes, it changes by too much; stages whose result stays
    /// inside are told a length of the substep that is too long, `constraint_release` is
    /// told a solution and `constraint_impulses` a right-hand side that is too large.
    Scaled(Stage),
    /// What constraints do to the cloth is not summed.
    ConstraintImpulsesDropped,
    /// The first pair in contact is overlooked.
    ContactPairDropped,
    /// The fused substep, or a fused linear solver, is not the same as its stages.
    FusedDiffers,
    /// Every run differs a little from the one before.
    RunsDiffer,
}

/// A stage that can be perturbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// `control_forces`
    ControlForces,
    /// `field_forces`
    FieldForces,
    /// `procedural_forces`
    ProceduralForces,
    /// `spring_forces`
    SpringForces,
    /// `membrane_forces`
    MembraneForces,
    /// `bending_forces`
    BendingForces,
    /// `aerodynamic_forces`
    AerodynamicForces,
    /// `contact_forces`
    ContactForces,
    /// `integrate_explicit`
    IntegrateExplicit,
    /// `contact_impulses`
    ContactImpulses,
    /// `strain_limit`
    StrainLimit,
    /// `stretch_limit`
    StretchLimit,
    /// `collider_response`
    ColliderResponse,
    /// `collider_impulses`
    ColliderImpulses,
    /// `vertex_normals`
    VertexNormals,
    /// `measure`
    Measure,
    /// `state_keep`
    StateKeep,
    /// `state_restore`
    StateRestore,
    /// `spring_linearise`
    SpringLinearise,
    /// `membrane_linearise`
    MembraneLinearise,
    /// `bending_linearise`
    BendingLinearise,
    /// `contact_linearise`
    ContactLinearise,
    /// `implicit_assemble`
    ImplicitAssemble,
    /// `control_forces_assemble`
    ControlForcesAssemble,
    /// `collider_constraints`
    ColliderConstraints,
    /// `constraint_release`
    ConstraintRelease,
    /// `constraint_impulses`
    ConstraintImpulses,
    /// `constraint_filter`
    ConstraintFilter,
    /// `constraint_project`
    ConstraintProject,
    /// `matrix_apply`
    MatrixApply,
    /// `preconditioner_build`
    PreconditionerBuild,
    /// `preconditioner_apply`
    PreconditionerApply,
    /// `vector_dot`
    VectorDot,
    /// `vector_combine`
    VectorCombine,
    /// `vector_fill`
    VectorFill,
    /// `velocity_add`
    VelocityAdd,
    /// `position_advance`
    PositionAdvance,
    /// `position_from_kept`
    PositionFromKept,
    /// `semi_implicit_solve`
    SemiImplicitSolve,
    /// `torque_correct`
    TorqueCorrect,
}

/// A backend with a defect.
pub struct PerturbedBackend<B> {
    inner: B,
    defect: Defect,
    size: f64,
    runs: AtomicU64,
}

impl<B: Backend> PerturbedBackend<B> {
    /// `inner` with a defect of a ten-thousandth.
    pub const fn new(inner: B, defect: Defect) -> Self {
        Self::with_size(inner, defect, 1e-4)
    }

    /// `inner` with a defect of this relative size.
    pub const fn with_size(inner: B, defect: Defect, size: f64) -> Self {
        Self { inner, defect, size, runs: AtomicU64::new(0) }
    }

    fn kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<PerturbedKernels> {
        let run = self.runs.fetch_add(1, Ordering::Relaxed);
        let inner = self.inner.create_kernels(model, config)?;
        Ok(PerturbedKernels::new(inner, self.defect, self.size, run))
    }
}

impl<B: Backend> Backend for PerturbedBackend<B> {
    fn info(&self) -> &BackendInfo {
        self.inner.info()
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        Ok(Box::new(SteppedSolver::new(self.kernels(model, config)?)?))
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        Ok(Box::new(self.kernels(model, config)?))
    }
}
