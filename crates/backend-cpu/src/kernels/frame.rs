//! The stages of a frame: state in and out, forces, contact, motion, measures.

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, ContactStatistics, ForceControl, Integrator, Kernels, Measures, Model,
    NewtonStart, PinWrite, Real, Result, SolverConfig, StageTime, State,
    contact::{Candidate, Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};
use rayon::prelude::*;

use crate::{
    collider_response::{self, ColliderAt},
    contact::{
        Contact,
        response::{self},
    },
    control_forces::ControlForces,
    explicit_substep::ExplicitPass,
    fabric::StretchLimiter,
    field_forces::{self},
    integrate_explicit,
    measure::Measure,
    memory::{BLOCK, FieldView, LANES, Motion, PacketMotion, VectorField, lanes},
    procedural_forces::{self, Programs},
    spring_forces::{self, MotionView},
    springs::SpringColumns,
    strain_limit::StrainLimiter,
    triangle_contact::TriangleContact,
    triangles::TriangleRows,
    vertex_normals,
};

use super::CpuKernels;

impl<T: Real> Kernels for CpuKernels<T> {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn config(&self) -> &SolverConfig {
        &self.config
    }

    fn state_write(&mut self, state: &State) -> Result<()> {
        state.validate(&self.model)?;
        self.present.position.write(&state.positions);
        self.present.velocity.write(&state.velocities);
        for (particle, &held) in state.held.iter().enumerate() {
            self.masses.hold(particle, held != 0);
        }
        self.semi_implicit.pins_changed = true;
        self.semi_implicit.free_changed = true;
        self.non_finite_step = None;
        self.has_start = false;
        if let Some(triangles) = &mut self.triangles {
            triangles.state_write(&self.model, state);
        }
        self.history_forget();
        Ok(())
    }

    fn state_read(&mut self, out: &mut State) -> Result<()> {
        self.present.position.read(&mut out.positions);
        self.present.velocity.read(&mut out.velocities);
        out.held.clear();
        let count = self.model.particle_count();
        out.held.extend((0..count).map(|particle| u8::from(self.masses.is_held(particle))));
        if let Some(triangles) = &self.triangles {
            triangles.slips_read(&mut out.slips);
        }
        self.ghosts_read(&mut out.ghosts);
        Ok(())
    }

    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        match &self.force {
            Some(force) => force.read(out),
            None => {
                out.clear();
                out.resize(self.model.particle_count(), [0.0; 3]);
            }
        }
        Ok(())
    }

    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        self.semi_implicit.pins_changed = true;
        self.semi_implicit.free_changed = true;
        for pin in pins {
            let particle = pin.particle as usize;
            self.masses.hold(particle, pin.held);
            if let Some(position) = pin.position {
                self.present.position.set(particle, position.map(T::from_f64));
            }
            if let Some(velocity) = pin.velocity {
                self.present.velocity.set(particle, velocity.map(T::from_f64));
            }
        }
        Ok(())
    }

    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.history_forget();
        ColliderAt::fill(&mut self.colliders, &self.model, plan);
        if let Some(triangles) = &mut self.triangles {
            triangles.frame_begin(plan);
        }
        Ok(())
    }

    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        self.control_forces = ControlForces::new(forces, &self.present);
        Ok(())
    }

    fn has_control_forces(&self) -> bool {
        !self.control_forces.is_empty()
    }

    fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        if self.non_finite_step.is_none() {
            let (length, offset) =
                (T::from_f64(substep.length), substep.anchor_offset.map(T::from_f64));
            self.stage("control_forces", |kernels| {
                let Self { control_forces, masses, present, .. } = kernels;
                control_forces.kick(length, offset, masses, present);
            });
        }
        Ok(())
    }

    fn control_forces_restore(&mut self) -> Result<()> {
        self.control_forces.restore(&mut self.present);
        Ok(())
    }

    fn field_forces(&mut self) -> Result<()> {
        self.force_stage("field_forces", |kernels, first, force| {
            let motion = MotionView::new(&kernels.present);
            let mass = lanes(&kernels.masses.mass, first);
            *force = field_forces::packet(&kernels.fields, mass, motion.velocity(first));
        });
        Ok(())
    }

    fn procedural_forces(&mut self, substep: &Substep) -> Result<()> {
        let Some(mut force) = self.force.take() else { return Ok(()) };
        self.stage("procedural_forces", |kernels| {
            let (kernels, arch) = (&*kernels, kernels.arch);
            force.chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
                arch.dispatch(procedural_forces::BlockTask {
                    programs: Programs::new(&kernels.programs, substep),
                    masses: &kernels.masses,
                    motion: MotionView::new(&kernels.present),
                    start: block * BLOCK,
                    force: chunk,
                });
            });
        });
        self.force = Some(force);
        Ok(())
    }

    fn spring_forces(&mut self) -> Result<()> {
        self.force_stage("spring_forces", |kernels, first, force| {
            let motion = MotionView::new(&kernels.present);
            spring_forces::packet(&kernels.springs, motion, first, force);
        });
        Ok(())
    }

    fn membrane_forces(&mut self) -> Result<()> {
        self.stage("membrane_forces", |kernels| {
            if let Some(fabric) = &mut kernels.fabric {
                fabric.membrane_forces(&kernels.present);
            }
        });
        self.force_stage_by_particle("membrane_forces", |kernels, particle| {
            kernels.fabric.as_ref().map(|fabric| fabric.membrane_force(particle))
        });
        Ok(())
    }

    fn bending_forces(&mut self) -> Result<()> {
        self.stage("bending_forces", |kernels| {
            if let Some(fabric) = &mut kernels.fabric {
                fabric.bending_forces(&kernels.present, kernels.arch);
            }
        });
        self.force_stage_by_particle("bending_forces", |kernels, particle| {
            kernels.fabric.as_ref().map(|fabric| fabric.bending_force(particle))
        });
        Ok(())
    }

    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()> {
        self.stage("aerodynamic_forces", |kernels| {
            if let Some(aerodynamics) = &mut kernels.aerodynamics {
                aerodynamics.update(&kernels.model, &kernels.present, substep);
            }
        });
        self.force_stage_by_particle("aerodynamic_forces", |kernels, particle| {
            kernels.aerodynamics.as_ref().map(|aerodynamics| aerodynamics.force(particle))
        });
        Ok(())
    }

    fn contact_candidates(&mut self) -> Result<()> {
        self.stage("contact_candidates", |kernels| {
            if let Some(contact) = &mut kernels.contact {
                contact.update(&kernels.model, &kernels.present.position, kernels.arch);
            }
        });
        Ok(())
    }

    fn contact_pairs(&mut self, substep: &Substep) -> Result<()> {
        self.stage("contact_pairs", |kernels| {
            let Some(triangles) = &mut kernels.triangles else { return Ok(()) };
            let step = (substep.index, T::from_f64(substep.length));
            triangles.pairs(&kernels.model, &kernels.present, step)
        })
    }

    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        if self.start.is_empty() {
            self.start_keep()?;
        }
        self.stage("contact_geometry", |kernels| {
            let Some(triangles) = &mut kernels.triangles else { return };
            triangles.geometry(
                (&kernels.present, &kernels.start),
                (&kernels.masses.inverse, substep.length),
                (&kernels.model, &kernels.config),
                start,
            );
        });
        Ok(())
    }

    fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        self.stage("contact_certify", |kernels| {
            let Some(triangles) = &mut kernels.triangles else { return Ok(()) };
            let starts = (&kernels.start, kernels.proven.as_ref());
            let motion = (&mut kernels.present, starts);
            let step = (substep.index, T::from_f64(substep.length));
            triangles.certify(&kernels.model, motion, &kernels.masses, step)
        })
    }

    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.stage("contact_certify", |kernels| {
            let Some(triangles) = &mut kernels.triangles else { return Ok(0) };
            let starts = (&kernels.start, kernels.proven.as_ref());
            let motion = (&mut kernels.present, starts);
            let step = (substep.index, T::from_f64(substep.length));
            triangles.ways_shorten(&kernels.model, motion, &kernels.masses, step, false)
        })
    }

    fn iterate_keep(&mut self) -> Result<()> {
        let position = &self.present.position;
        let mut kept = (self.proven.take())
            .unwrap_or_else(|| VectorField::new(position.count(), position.margin()));
        kept.copy_from(FieldView::new(position));
        self.proven = Some(kept);
        Ok(())
    }

    fn triangles_touch(&self) -> bool {
        self.triangles.as_ref().is_some_and(TriangleContact::any)
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        out.contacts.clear();
        if let Some(triangles) = &self.triangles {
            triangles.contacts_read(out);
        }
        Ok(())
    }

    fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        out.clear();
        if let Some(triangles) = &self.triangles {
            triangles.list_read(out);
        }
        Ok(())
    }

    fn contact_forces(&mut self) -> Result<()> {
        if self.triangles.is_some() {
            self.force_stage_by_particle("contact_forces", |kernels, particle| {
                kernels.triangles.as_ref()?.force(particle)
            });
            return Ok(());
        }
        self.force_stage_by_particle("contact_forces", |kernels, particle| {
            let (contact, penalty) = kernels.penalty()?;
            response::force(contact, penalty, MotionView::new(&kernels.present), particle)
        });
        Ok(())
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        let Some(force) = self.force.take() else { return Ok(()) };
        let length = T::from_f64(substep.length);
        self.stage("integrate_explicit", |kernels| {
            let motion = MotionView::new(&kernels.present);
            let masses = &kernels.masses;
            let (forces, margin) = (force.padded(), force.margin());
            kernels.next.chunks_mut(BLOCK).enumerate().for_each(|(block, mut chunk)| {
                for local in (0..chunk.position[0].len()).step_by(LANES) {
                    let first = block * BLOCK + local;
                    let force = forces.map(|values| *lanes(values, margin + first));
                    let moved = integrate_explicit::packet(
                        length,
                        lanes(&masses.inverse, first),
                        &force,
                        motion.position(first),
                        motion.velocity(first),
                    );
                    chunk.store(local, &moved);
                }
            });
        });
        self.force = Some(force);
        self.swap();
        Ok(())
    }

    fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        if !self.contact.as_ref().is_some_and(Contact::any) {
            return Ok(());
        }
        let mut next = std::mem::replace(&mut self.next, Motion::new(0, 0));
        self.stage("contact_impulses", |kernels| {
            let Some((contact, impulse)) = kernels.impulse(substep.length) else { return };
            let motion = MotionView::new(&kernels.present);
            let inverse_mass = &kernels.masses.inverse;
            let count = kernels.model.particle_count();
            next.chunks_mut(BLOCK).enumerate().for_each(|(block, mut chunk)| {
                for local in (0..chunk.position[0].len()).step_by(LANES) {
                    let first = block * BLOCK + local;
                    let mut moved = PacketMotion {
                        position: motion.position(first).map(|lanes| *lanes),
                        velocity: motion.velocity(first).map(|lanes| *lanes),
                    };
                    for lane in 0..LANES.min(count - first) {
                        let particle = first + lane;
                        if let Some(change) =
                            response::impulse(contact, impulse, motion, inverse_mass, particle)
                        {
                            for axis in 0..3 {
                                moved.position[axis][lane] += change.position[axis];
                                moved.velocity[axis][lane] += change.velocity[axis];
                            }
                        }
                    }
                    chunk.store(local, &moved);
                }
            });
        });
        self.next = next;
        self.swap();
        Ok(())
    }

    fn strain_limit_colours(&self) -> usize {
        self.strain_limiter.as_ref().map_or(0, StrainLimiter::colour_count)
    }

    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        let length = T::from_f64(substep.length);
        self.stage("strain_limit", |kernels| {
            if let Some(limiter) = &kernels.strain_limiter {
                limiter.apply(colour, length, &kernels.masses, &mut kernels.present);
            }
        });
        Ok(())
    }

    fn stretch_limit_colours(&self) -> usize {
        self.stretch_limiter.as_ref().map_or(0, StretchLimiter::colour_count)
    }

    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        let length = T::from_f64(substep.length);
        self.stage("stretch_limit", |kernels| {
            if let Some(limiter) = &mut kernels.stretch_limiter {
                limiter.apply(colour, length, &kernels.masses, &mut kernels.present);
            }
        });
        Ok(())
    }

    fn start_keep(&mut self) -> Result<()> {
        self.proven = None;
        let count = self.model.particle_count();
        if self.start.is_empty() {
            self.start = VectorField::new(count, self.springs.margin());
        }
        self.stage("collider_response", |kernels| {
            let from = FieldView::new(&kernels.present.position);
            kernels.start.chunks_mut(BLOCK).enumerate().for_each(|(block, mut chunk)| {
                let from = from.range((block * BLOCK) as isize, chunk[0].len());
                for (to, from) in chunk.iter_mut().zip(from) {
                    to.copy_from_slice(from);
                }
            });
        });
        self.has_start = true;
        Ok(())
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        let has_start = std::mem::take(&mut self.has_start);
        let mut present = std::mem::replace(&mut self.present, Motion::new(0, 0));
        let mut impulses = std::mem::take(&mut self.impulses);
        self.stage("collider_response", |kernels| {
            let (kernels, arch) = (&*kernels, kernels.arch);
            let colliders = kernels.colliders_at(substep.index);
            let start = has_start.then(|| FieldView::new(&kernels.start));
            let blocks = present.chunks_mut(BLOCK).zip(impulses.blocks_mut());
            blocks.enumerate().for_each(|(block, (mut chunk, impulses))| {
                arch.dispatch(collider_response::BlockTask {
                    colliders,
                    offsets: &kernels.offsets[block * BLOCK..],
                    inverse_mass: &kernels.masses.inverse[block * BLOCK..],
                    chunk: &mut chunk,
                    start,
                    length: T::from_f64(substep.length),
                    first: block * BLOCK,
                    impulses,
                });
            });
        });
        self.present = present;
        self.impulses = impulses;
        Ok(())
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.impulses.take(out);
        if let Some(triangles) = &mut self.triangles {
            triangles.impulses_take(out);
        }
        Ok(())
    }

    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.stage("vertex_normals", |kernels| {
            let rows =
                kernels.triangle_rows.get_or_insert_with(|| TriangleRows::new(&kernels.model));
            vertex_normals::run(&kernels.model, rows, &kernels.present.position, out);
        });
        Ok(())
    }

    fn measure(&mut self) -> Result<Measures> {
        Ok(self.stage("measure", |kernels| Measures {
            non_finite_step: kernels.non_finite_step,
            ..Measure {
                model: &kernels.model,
                springs: &kernels.springs,
                masses: &kernels.masses,
                colliders: kernels.colliders_at(usize::MAX),
                offsets: &kernels.offsets,
                motion: MotionView::new(&kernels.present),
                acceleration: kernels.model.uniform_acceleration(),
            }
            .run(
                kernels.arch,
                kernels.fabric.as_ref().map(|f| f.figures(&kernels.present, kernels.arch)),
            )
        }))
    }

    fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        if let Some(triangles) = &mut self.triangles {
            return Ok(triangles.statistics());
        }
        Ok(self.contact.as_mut().map_or_else(ContactStatistics::default, Contact::statistics))
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        let has_constant_matrix = matches!(self.config.integrator, Integrator::SemiImplicit(_));
        let triangles = self.triangles.as_mut();
        if has_constant_matrix || !triangles.is_none_or(|all| all.stitches_set(model)) {
            return Ok(false);
        }
        self.springs = SpringColumns::new(model.springs(), model.particle_count());
        self.model = Arc::clone(model);
        Ok(true)
    }

    fn ghosts_read(&mut self, out: &mut Vec<Ghost>) {
        out.clear();
        out.extend(self.triangles.iter().flat_map(|triangles| triangles.ghosts()).cloned());
    }

    fn ghosts_write(&mut self, ghosts: &[Ghost]) {
        if let Some(triangles) = &mut self.triangles {
            triangles.ghosts_set(ghosts);
        }
    }

    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        self.contact_candidates()?;
        out.clear();
        if let Some(contact) = &self.contact {
            for particle in 0..self.model.particle_count() {
                let partners = contact.partners(particle).iter();
                let later = partners.filter(|&&partner| partner as usize > particle);
                out.extend(later.map(|&partner| [particle as u32, partner]));
            }
        }
        Ok(())
    }

    fn stage_times(&mut self) -> Vec<StageTime> {
        std::mem::take(&mut self.stage_times)
    }

    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        if self.non_finite_step.is_some() {
            return Ok(());
        }
        let interrupted = stepper::explicit::has_work_after_integration(self);
        if interrupted {
            stepper::collider_start(self)?;
        }
        stepper::contact_find(self, substep, NewtonStart::StepStart)?;
        let mut next = std::mem::replace(&mut self.next, Motion::new(0, 0));
        let mut impulses = std::mem::take(&mut self.impulses);
        let finite = self.stage("explicit_substep", |kernels| {
            if let Some(aerodynamics) = &mut kernels.aerodynamics {
                aerodynamics.update(&kernels.model, &kernels.present, substep);
            }
            if let Some(fabric) = &mut kernels.fabric {
                fabric.membrane_forces(&kernels.present);
                fabric.bending_forces(&kernels.present, kernels.arch);
            }
            let colliders = kernels.colliders_at(substep.index);
            ExplicitPass {
                count: kernels.model.particle_count(),
                springs: &kernels.springs,
                fields: &kernels.fields,
                programs: Programs::new(&kernels.programs, substep),
                masses: &kernels.masses,
                aerodynamics: kernels.aerodynamics.as_ref(),
                fabric: kernels.fabric.as_ref(),
                contact: kernels.penalty().filter(|(contact, _)| contact.any()),
                triangles: kernels.triangles.as_ref().filter(|triangles| triangles.any()),
                colliders: if interrupted { &[] } else { colliders },
                offsets: &kernels.offsets,
                motion: MotionView::new(&kernels.present),
                length: T::from_f64(substep.length),
            }
            .run(&mut next, &mut impulses, kernels.arch)
        });
        self.next = next;
        self.impulses = impulses;
        self.swap();
        if !finite {
            self.non_finite_step = Some(substep.step);
            return Ok(());
        }
        if interrupted {
            stepper::explicit::after_integration(self, substep)?;
            stepper::colliders_and_certificate(self, substep)?;
        }
        Ok(())
    }

    fn batch<R: Send>(&mut self, work: impl FnOnce(&mut Self) -> R + Send) -> R {
        let team = Arc::clone(&self.team);
        team.install_awake(|| work(self))
    }
}
