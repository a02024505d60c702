//! The stages of the semi-implicit integrator on the CPU.

use cloth_core::{
    LinearVector, Real, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep,
};

use super::CpuKernels;
use crate::{
    memory::VectorField,
    semi_implicit::{FreePieces, RightSide, SemiImplicit, TorqueTerms},
    spring_forces::MotionView,
};

/// Memory of the semi-implicit integrator.
pub(super) struct SemiImplicitMemory<T> {
    system: Option<SemiImplicit<T>>,
    /// Whether particles may have been held or released since the last factorisation.
    pub(super) pins_changed: bool,
    /// Pieces whose angular momentum is corrected, and whether they may not know of the particles held at present.
    free: Option<FreePieces>,
    pub(super) free_changed: bool,
}

impl<T> SemiImplicitMemory<T> {
    pub(super) const fn new() -> Self {
        Self { system: None, pins_changed: true, free: None, free_changed: true }
    }
}

impl<T: Real> CpuKernels<T> {
    /// Runs `work` on the semi-implicit system and the solution, if the system was ever factorised
    /// and forces were computed.
    fn semi_implicit_stage(
        &mut self,
        stage: &'static str,
        length: f64,
        work: impl FnOnce(&Self, &VectorField<T>, &mut SemiImplicit<T>, &mut VectorField<T>, T) + Send,
    ) {
        let (Some(mut system), Some(force)) = (self.semi_implicit.system.take(), self.force.take())
        else {
            return;
        };
        self.implicit_stage(stage, length, |kernels, implicit, length| {
            let vectors = implicit.vectors_mut();
            let mut solution = vectors.take(LinearVector::Solution);
            work(kernels, &force, &mut system, &mut solution, T::from_f64(length));
            vectors.put(LinearVector::Solution, solution);
        });
        self.force = Some(force);
        self.semi_implicit.system = Some(system);
    }
}

impl<T: Real> SemiImplicitKernels for CpuKernels<T> {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        self.stage("semi_implicit_factorise", |kernels| {
            let memory = &mut kernels.semi_implicit;
            let system = match memory.system.take() {
                Some(system) => system,
                None => SemiImplicit::new(&kernels.model, kernels.springs.margin())?,
            };
            let system = memory.system.insert(system);
            if std::mem::take(&mut memory.pins_changed) {
                system.held_update(&kernels.masses);
            }
            system.factorise(&kernels.model, length, solve)
        })
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        let (stage, length) = ("semi_implicit_solve", substep.length);
        self.semi_implicit_stage(stage, length, |kernels, force, system, solution, length| {
            let right_side = RightSide {
                springs: &kernels.springs,
                masses: &kernels.masses,
                motion: MotionView::new(&kernels.present),
                force,
                length,
            };
            right_side.fill(system, kernels.arch);
            system.solve(solution, kernels.arch);
        });
        Ok(())
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        let (stage, length) = ("torque_correct", substep.length);
        let Some(force) = self.force.take() else { return Ok(()) };
        let pieces = || FreePieces::new(self.model.connected_pieces(), self.model.particle_count());
        let mut free = self.semi_implicit.free.take().unwrap_or_else(pieces);
        if std::mem::take(&mut self.semi_implicit.free_changed) {
            free.held_update(|particle| self.masses.is_held(particle));
        }
        self.implicit_stage(stage, length, |kernels, implicit, length| {
            let vectors = implicit.vectors_mut();
            let mut solution = vectors.take(LinearVector::Solution);
            let position = &kernels.present.position;
            let (mass, length) = (&kernels.masses.mass, T::from_f64(length));
            let terms = TorqueTerms { mass, position, force: &force, length };
            terms.correct(&mut free, &mut solution, kernels.arch);
            vectors.put(LinearVector::Solution, solution);
        });
        self.semi_implicit.free = Some(free);
        self.force = Some(force);
        Ok(())
    }
}
