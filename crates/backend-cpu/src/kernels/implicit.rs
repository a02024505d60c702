//! The stages of the implicit integrator on the CPU.

use cloth_core::{
    ConstraintStatistics, ImplicitKernels, LinearOutcome, LinearSettings, LinearStart,
    LinearVector, MatrixBlock, MatrixForm, NewtonStart, Preconditioner, Real, Result,
    stepper::{
        Substep,
        linear::{self, Begin, Next},
    },
};

use super::CpuKernels;
use crate::{
    implicit::{ImplicitSystem, Surroundings},
    integrate_implicit,
    memory::{FieldView, Motion, VectorField},
};

impl<T: Real> CpuKernels<T> {
    /// Runs a stage of the linear system, whose memory is taken when it is first needed.
    pub(super) fn implicit_stage<R: Send>(
        &mut self,
        stage: &'static str,
        length: f64,
        work: impl FnOnce(&mut Self, &mut ImplicitSystem<T>, f64) -> R + Send,
    ) -> R {
        let mut system = self
            .implicit
            .take()
            .unwrap_or_else(|| Box::new(ImplicitSystem::new(&self.springs, &self.model)));
        let result = self.stage(stage, |kernels| work(kernels, &mut system, length));
        self.implicit = Some(system);
        result
    }

    /// Tells the preconditioner how well it did.
    fn solved(&mut self, outcome: &LinearOutcome) {
        if let Some(system) = &mut self.implicit {
            system.solved(outcome);
        }
    }

    fn surroundings(&self, length: f64) -> Surroundings<'_, T> {
        Surroundings {
            springs: &self.springs,
            masses: &self.masses,
            motion: &self.present,
            kept: &self.kept,
            fields: self.fields.sums(),
            length: T::from_f64(length),
            arch: self.arch,
        }
    }
}

impl<T: Real> ImplicitKernels for CpuKernels<T> {
    fn state_keep(&mut self) -> Result<()> {
        self.kept.copy_from(&self.present);
        self.impulses_kept.clone_from(&self.impulses);
        if let Some(triangles) = &mut self.triangles {
            triangles.keep();
        }
        Ok(())
    }

    fn velocity_keep(&mut self) -> Result<()> {
        let velocity = &self.present.velocity;
        if self.iterate.count() != velocity.count() {
            self.iterate = VectorField::new(velocity.count(), velocity.margin());
        }
        self.iterate.copy_from(FieldView::new(velocity));
        Ok(())
    }

    fn velocity_restore(&mut self) -> Result<()> {
        self.present.velocity.copy_from(FieldView::new(&self.iterate));
        Ok(())
    }

    fn state_restore(&mut self) -> Result<()> {
        self.present.copy_from(&self.kept);
        self.impulses.clone_from(&self.impulses_kept);
        if let Some(triangles) = &mut self.triangles {
            triangles.restore();
        }
        Ok(())
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.implicit_stage("spring_linearise", substep.length, |kernels, system, length| {
            system.spring_linearise(kernels.surroundings(length));
        });
        Ok(())
    }

    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stage("membrane_linearise", |kernels| {
            if let Some(fabric) = &mut kernels.fabric {
                let length = T::from_f64(substep.length);
                fabric.membrane_linearise(&kernels.present, length, start);
            }
        });
        Ok(())
    }

    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.stage("bending_linearise", |kernels| {
            if let Some(fabric) = &mut kernels.fabric {
                let length = T::from_f64(substep.length);
                fabric.bending_linearise(&kernels.present, (length, start), kernels.arch);
            }
        });
        Ok(())
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.implicit_stage("contact_linearise", substep.length, |kernels, system, length| {
            if let Some((contact, penalty)) = kernels.penalty() {
                system.contact_linearise(kernels.surroundings(length), contact, penalty);
            }
            if let Some(triangles) = &kernels.triangles {
                system.triangles_linearise(triangles.set(), T::from_f64(length));
            }
        });
        Ok(())
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        let Some(force) = self.force.take() else { return Ok(()) };
        let wind = substep.wind_velocity;
        if start == NewtonStart::Iterate && self.kept.is_empty() {
            self.state_keep()?;
        }
        self.implicit_stage("implicit_assemble", substep.length, |kernels, system, length| {
            if let Some(aerodynamics) = &mut kernels.aerodynamics {
                aerodynamics.linearise(&kernels.model, &kernels.present, wind);
            }
            let kernels = &*kernels;
            let aerodynamics = kernels.aerodynamics.as_ref();
            let forces = (&force, aerodynamics, kernels.fabric.as_ref());
            system.assemble(kernels.surroundings(length), forces, start);
        });
        self.force = Some(force);
        Ok(())
    }

    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        self.implicit_stage("control_forces", substep.length, |kernels, system, length| {
            let length = T::from_f64(length);
            let offset = substep.anchor_offset.map(T::from_f64);
            let Self { control_forces, masses, present, .. } = kernels;
            system.add(control_forces.terms((length, start), offset, masses, present));
        });
        Ok(())
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        let index = substep.index;
        self.implicit_stage("collider_constraints", substep.length, |kernels, system, length| {
            let colliders = kernels.colliders_at(index);
            system.collider_constraints(kernels.surroundings(length), colliders, &kernels.offsets);
        });
        Ok(())
    }

    fn constraint_release(&mut self) -> Result<u64> {
        Ok(self.implicit_stage("constraint_release", 0.0, |kernels, system, _| {
            if system.constraints_are_empty() {
                return 0;
            }
            let (from, to) = (LinearVector::Solution, LinearVector::Image);
            system.matrix_apply(&kernels.springs, from, to, kernels.arch);
            system.constraint_release(&kernels.masses, &kernels.present.velocity)
        }))
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        Ok(self
            .implicit
            .as_mut()
            .map_or_else(ConstraintStatistics::default, |system| system.constraint_statistics()))
    }

    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        if !self.model.collider_impulses() {
            return Ok(());
        }
        let mut impulses = std::mem::take(&mut self.impulses);
        self.implicit_stage("constraint_impulses", 0.0, |kernels, system, _| {
            if system.constraints_are_empty() {
                return;
            }
            if start == NewtonStart::StepStart {
                let (from, to) = (LinearVector::Solution, LinearVector::Image);
                system.matrix_apply(&kernels.springs, from, to, kernels.arch);
            }
            system.constraint_impulses(&kernels.present, start, &mut impulses);
        });
        self.impulses = impulses;
        Ok(())
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        self.implicit_stage("constraint_filter", 0.0, |kernels, system, _| {
            system.constraint_filter(vector, &kernels.masses);
        });
        Ok(())
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        self.implicit_stage("constraint_project", 0.0, |kernels, system, _| {
            system.constraint_project(vector, &kernels.masses, &kernels.present.velocity);
        });
        Ok(())
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        self.implicit_stage("matrix_apply", 0.0, |kernels, system, _| match form {
            MatrixForm::Assembled => {
                system.matrix_apply_assembled((&kernels.model, &kernels.springs), from, to);
            }
            _ => system.matrix_apply(&kernels.springs, from, to, kernels.arch),
        });
        Ok(())
    }

    fn preconditioner_forget(&mut self) {
        self.history_forget();
    }

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        self.implicit_stage("preconditioner_build", 0.0, |kernels, system, _| {
            let model = (&*kernels.model, &kernels.springs);
            let particles = (&kernels.masses, &kernels.present.position);
            let preconditioner = preconditioner.at_first();
            system.preconditioner_build(model, particles, preconditioner, kernels.arch);
        });
        Ok(())
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.implicit_stage("preconditioner_apply", 0.0, |kernels, system, _| {
            system.preconditioner_apply(from, to, &kernels.masses, kernels.arch);
        });
        Ok(())
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        Ok(self.implicit_stage("vector_dot", 0.0, |kernels, system, _| {
            system.vector_dot(a, b, kernels.arch)
        }))
    }

    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()> {
        self.implicit_stage("vector_combine", 0.0, |kernels, system, _| {
            system.vector_combine(from, to, kernels.arch);
        });
        Ok(())
    }

    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        self.implicit_stage("vector_fill", 0.0, |_, system, _| system.vector_fill(value, to));
        Ok(())
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        // What it changes is added to z.
        self.vector_combine((0.0, LinearVector::RightSide), (0.0, LinearVector::Solution))?;
        self.constraint_project(LinearVector::Solution)?;
        self.implicit_stage("direct_solve", 0.0, |kernels, system, _| {
            system.direct_solve((&kernels.model, &kernels.springs), &kernels.masses)
        })
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        self.implicit_stage("velocity_add", 0.0, |kernels, system, _| {
            let solution = system.vectors().get(LinearVector::Solution);
            integrate_implicit::add(solution, scale, &mut kernels.present.velocity, kernels.arch);
        });
        Ok(())
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.stage("position_advance", |kernels| {
            let Motion { position, velocity } = &mut kernels.present;
            integrate_implicit::add(velocity, length, position, kernels.arch);
        });
        Ok(())
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        self.present.position.copy_from(FieldView::new(&self.kept.position));
        if length == 0.0 { Ok(()) } else { self.position_advance(length) }
    }

    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        if let Some(system) = &self.implicit {
            system.matrix_read(&self.springs, out);
        }
        Ok(())
    }

    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.implicit_stage("vector_read", 0.0, |_, system, _| {
            system.vectors().get(vector).read(out);
        });
        Ok(())
    }

    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        self.implicit_stage("vector_write", 0.0, |_, system, _| {
            system.vectors_mut().get_mut(vector).write(values);
        });
        Ok(())
    }

    fn conjugate_gradient(
        &mut self,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        use LinearVector::{Preconditioned, Residual};
        let fuses = settings.matrix == MatrixForm::MatrixFree
            && settings.preconditioner != Preconditioner::IncompleteCholesky;
        if !fuses {
            let outcome = linear::conjugate_gradient(self, settings, start)?;
            self.solved(&outcome);
            return Ok(outcome);
        }
        let mut progress = match linear::begin(self, settings, start)? {
            Begin::Done(outcome) => return Ok(outcome),
            Begin::Iterate(progress) => progress,
        };
        self.preconditioner_apply(Residual, Preconditioned)?;
        let mut gamma = self.vector_dot(Residual, Preconditioned)?;
        loop {
            let next = self.implicit_stage("conjugate_gradient", 0.0, |kernels, system, _| {
                let at = (&kernels.springs, &kernels.masses, kernels.arch);
                system.conjugate_gradient(at, &mut progress, gamma)
            });
            match next {
                Next::Done(outcome) => {
                    self.solved(&outcome);
                    return Ok(outcome);
                }
                Next::Restart => gamma = linear::restart(self, settings, &mut progress)?,
                Next::Iterate => {}
            }
        }
    }
}
