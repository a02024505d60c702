//! The stages of the implicit integrator.

use cloth_core::{
    ConstraintStatistics, GroupHierarchy, ImplicitKernels, LinearOutcome, LinearVector,
    MatrixBlock, MatrixForm, NewtonStart, Preconditioner, Result, stepper::Substep,
};

use super::{Controls, Kept, Linear, ReferenceKernels};
use crate::{
    Linearisation, Schwarz, Vector, bending_linearise, check_preconditioner, collider_constraints,
    constraint_impulses, constraint_release, contact_linearise, control_forces_assemble,
    implicit::direct_solve, implicit_assemble, membrane_linearise, preconditioner_apply,
    spring_linearise, unsupported, vector_combine, vector_dot,
};

/// Particles that dense matrices are made for at most.
const SCHWARZ_MAX: usize = 2000;

impl Linear {
    fn vector(&self, vector: LinearVector) -> &[Vector<f64>] {
        &self.vectors[vector as usize]
    }

    /// Gives the system b as it is now, which may have been written.
    fn right_side_update(&mut self) {
        self.system.right_side.clone_from(&self.vectors[LinearVector::RightSide as usize]);
    }

    pub(super) fn vector_mut(&mut self, vector: LinearVector) -> &mut Vec<Vector<f64>> {
        &mut self.vectors[vector as usize]
    }
}

impl ReferenceKernels {
    /// x = from + length v.
    fn positions_advance(&mut self, length: f64) {
        let particles = &mut self.particles;
        for (x, v) in particles.positions.iter_mut().zip(&particles.velocities) {
            *x += v.scaled(length);
        }
    }
}

impl ImplicitKernels for ReferenceKernels {
    fn state_keep(&mut self) -> Result<()> {
        let particles = &self.particles;
        self.kept = Kept {
            positions: particles.positions.clone(),
            velocities: particles.velocities.clone(),
            iterate: Vec::new(),
            impulses: self.impulses.clone(),
        };
        if let Some(triangles) = &mut self.triangles {
            triangles.certifier.keep();
            triangles.set.keep();
            triangles.bodies.keep();
            triangles.impulses.keep();
        }
        Ok(())
    }

    fn velocity_keep(&mut self) -> Result<()> {
        self.kept.iterate.clone_from(&self.particles.velocities);
        Ok(())
    }

    fn velocity_restore(&mut self) -> Result<()> {
        self.particles.velocities.clone_from(&self.kept.iterate);
        Ok(())
    }

    fn state_restore(&mut self) -> Result<()> {
        let Kept { positions, velocities, impulses, .. } = self.kept.clone();
        self.particles.positions = positions;
        self.particles.velocities = velocities;
        self.impulses = impulses;
        if let Some(triangles) = &mut self.triangles {
            triangles.certifier.restore();
            triangles.set.restore();
            triangles.bodies.restore();
            triangles.impulses.restore();
        }
        Ok(())
    }

    fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.linear.springs = spring_linearise(&self.model, &mut self.particles, substep.length);
        self.linear.elements.clear();
        Ok(())
    }

    fn membrane_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        let (model, length) = (&self.model, substep.length);
        self.linear.elements.push(membrane_linearise(model, &self.particles, length, start));
        Ok(())
    }

    fn bending_linearise(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        let (model, length) = (&self.model, substep.length);
        self.linear.elements.push(bending_linearise(model, &self.particles, length, start));
        Ok(())
    }

    fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        if let Some(triangles) = &self.triangles {
            self.linear.elements.push(triangles.linearise(&self.particles, substep.length));
            return Ok(());
        }
        self.linear.contacts =
            contact_linearise(&self.model, &mut self.particles, &self.pairs, substep.length);
        Ok(())
    }

    fn implicit_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        if self.kept.velocities.is_empty() {
            self.state_keep()?;
        }
        let Linear { springs, contacts, elements, system, constraints, vectors, .. } =
            &mut self.linear;
        let about = Linearisation {
            length: substep.length,
            wind_velocity: substep.wind_velocity,
            start,
            velocities_start: &self.kept.velocities,
        };
        let terms = [&springs[..], contacts].concat();
        let parts = (terms, &elements[..]);
        *system = implicit_assemble(&self.model, &self.particles, parts, &self.forces, &about);
        constraints.add_drags(&self.particles.velocities, system);
        vectors[LinearVector::RightSide as usize].clone_from(&system.right_side);
        Ok(())
    }

    fn control_forces_assemble(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        let Controls { forces, given, .. } = &self.controls;
        let Linear { system, vectors, .. } = &mut self.linear;
        control_forces_assemble(&self.particles, (forces, given), substep, start, system);
        vectors[LinearVector::RightSide as usize].clone_from(&system.right_side);
        Ok(())
    }

    fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        let colliders = self.plan.colliders_at(substep.index);
        let (model, particles) = (&self.model, &mut self.particles);
        let constraints = collider_constraints(model, particles, colliders, substep.length);
        let is_constrained = |c: &&crate::Constraint<f64>| !(c.is_free() || c.is_held());
        self.linear.constrained = constraints.0.iter().filter(is_constrained).count() as u64;
        self.linear.constraints = constraints;
        Ok(())
    }

    fn constraint_release(&mut self) -> Result<u64> {
        self.linear.right_side_update();
        let Linear { system, constraints, vectors, released, .. } = &mut self.linear;
        let solution = &vectors[LinearVector::Solution as usize];
        let changed =
            constraint_release(&self.model, &mut self.particles, constraints, system, solution);
        *released += changed;
        vectors[LinearVector::RightSide as usize].clone_from(&system.right_side);
        Ok(changed)
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        let Linear { constrained, released, .. } = &mut self.linear;
        Ok(ConstraintStatistics {
            constrained: std::mem::take(constrained),
            released: std::mem::take(released),
        })
    }

    fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        self.linear.right_side_update();
        let Linear { system, constraints, .. } = &self.linear;
        let solution = self.linear.vector(LinearVector::Solution);
        let solution = (start == NewtonStart::StepStart).then_some(solution);
        constraint_impulses(&self.particles, constraints, system, solution, &mut self.impulses);
        Ok(())
    }

    fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        let Linear { constraints, vectors, .. } = &mut self.linear;
        constraints.filter(&mut vectors[vector as usize]);
        Ok(())
    }

    fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        let Linear { constraints, vectors, .. } = &mut self.linear;
        constraints.project(&mut vectors[vector as usize], &self.particles.velocities);
        Ok(())
    }

    fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        let (system, vector) = (&self.linear.system, self.linear.vector(from));
        let image = match form {
            MatrixForm::MatrixFree => system.apply(vector),
            MatrixForm::Assembled => system.apply_blocks(vector),
            other => return unsupported(format!("the matrix form {other}")),
        };
        *self.linear.vector_mut(to) = image;
        Ok(())
    }

    /// It is made anew each time.
    fn preconditioner_forget(&mut self) {}

    fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        check_preconditioner(preconditioner)?;
        self.linear.preconditioner = (self.linear.system.diagonal(), preconditioner);
        self.linear.schwarz = None;
        if preconditioner == Preconditioner::Schwarz {
            if self.particles.len() > SCHWARZ_MAX {
                return unsupported(format!(
                    "the preconditioner schwarz for more than {SCHWARZ_MAX} particles (its matrices are dense)"
                ));
            }
            let hierarchy = GroupHierarchy::new(&self.model);
            let Linear { system, constraints, schwarz, .. } = &mut self.linear;
            let positions = &self.particles.positions;
            *schwarz = Some(Schwarz::new(&hierarchy, system, constraints, positions));
        }
        Ok(())
    }

    fn preconditioner_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        let (diagonal, kind) = &self.linear.preconditioner;
        let blocks = *kind != Preconditioner::Diagonal;
        let each = diagonal.iter().zip(&self.linear.constraints.0).zip(self.linear.vector(from));
        let applied = each.map(|((diagonal, constraint), r)| {
            preconditioner_apply(*diagonal, constraint, blocks, *r, f64::EPSILON)
        });
        let mut applied: Vec<_> = applied.collect();
        if let Some(schwarz) = &self.linear.schwarz {
            let mut moved = schwarz.apply(self.linear.vector(from));
            self.linear.constraints.filter(&mut moved);
            applied.iter_mut().zip(moved).for_each(|(applied, moved)| *applied += moved);
        }
        *self.linear.vector_mut(to) = applied;
        Ok(())
    }

    fn vector_dot(&mut self, a: LinearVector, b: LinearVector) -> Result<f64> {
        Ok(vector_dot(self.linear.vector(a), self.linear.vector(b)))
    }

    fn vector_combine(&mut self, from: (f64, LinearVector), to: (f64, LinearVector)) -> Result<()> {
        let mut sum = std::mem::take(self.linear.vector_mut(to.1));
        vector_combine((from.0, self.linear.vector(from.1)), (to.0, &mut sum));
        *self.linear.vector_mut(to.1) = sum;
        Ok(())
    }

    fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        self.linear.vector_mut(to).fill(Vector(value));
        Ok(())
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        self.linear.right_side_update();
        let Linear { system, constraints, vectors, .. } = &mut self.linear;
        let solution = &mut vectors[LinearVector::Solution as usize];
        solution.fill(Vector::ZERO);
        constraints.project(solution, &self.particles.velocities);
        Ok(direct_solve(system, constraints, solution))
    }

    fn velocity_add(&mut self, scale: f64) -> Result<()> {
        let solution = &self.linear.vectors[LinearVector::Solution as usize];
        for (v, y) in self.particles.velocities.iter_mut().zip(solution) {
            *v += y.scaled(scale);
        }
        Ok(())
    }

    fn position_advance(&mut self, length: f64) -> Result<()> {
        self.positions_advance(length);
        Ok(())
    }

    fn position_from_kept(&mut self, length: f64) -> Result<()> {
        self.particles.positions.clone_from(&self.kept.positions);
        if length != 0.0 {
            self.positions_advance(length);
        }
        Ok(())
    }

    fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        let blocks = self.linear.system.blocks().into_iter();
        *out = blocks
            .map(|([row, column], block)| MatrixBlock {
                row: row as u32,
                column: column as u32,
                entries: block.0.map(|row| row.0),
            })
            .collect();
        Ok(())
    }

    fn vector_read(&mut self, vector: LinearVector, out: &mut Vec<[f64; 3]>) -> Result<()> {
        *out = self.linear.vector(vector).iter().map(|vector| vector.0).collect();
        Ok(())
    }

    fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        *self.linear.vector_mut(vector) = values.iter().copied().map(Vector).collect();
        Ok(())
    }
}
