//! All stages on the memory of one solver.

mod implicit;
mod semi_implicit;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use cloth_core::{
    ColliderImpulse, ContactResponse, ContactStatistics, FieldProgram, ForceControl, Integrator,
    Kernels, Measures, Model, NewtonStart, PinWrite, Real, Result, SelfContact, SolverConfig,
    StageTime, State,
    contact::{Candidate, Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};
use rayon::{ThreadPool, prelude::*};

use crate::{
    aerodynamic_forces::Aerodynamics,
    block_impulses::BlockImpulses,
    collider_response::{self, ColliderAt},
    contact::{
        Contact,
        response::{self, Impulse, Penalty},
    },
    control_forces::ControlForces,
    explicit_substep::ExplicitPass,
    fabric::{Fabric, StretchLimiter},
    field_forces::{self, FieldSum},
    implicit::ImplicitSystem,
    integrate_explicit,
    kernels::semi_implicit::SemiImplicitMemory,
    measure::Measure,
    memory::{
        BLOCK, FieldView, LANES, Lanes, Masses, Motion, PacketMotion, VectorField, lanes,
        lanes_mut, packets,
    },
    procedural_forces::{self, Programs},
    spring_forces::{self, MotionView},
    springs::SpringColumns,
    strain_limit::StrainLimiter,
    triangle_contact::TriangleContact,
    triangles::TriangleRows,
    vertex_normals,
};

/// Particles of fabric from which on the preconditioner `schwarz` was measured to be faster.
const SCHWARZ_MIN: usize = 40_000;

/// The stages on the CPU.
pub(crate) struct CpuKernels<T> {
    model: Arc<Model>,
    config: SolverConfig,
    pool: Arc<ThreadPool>,
    arch: pulp::Arch,
    springs: SpringColumns<T>,
    control_forces: ControlForces<T>,
    fields: FieldSum<T>,
    programs: Vec<Arc<FieldProgram>>,
    masses: Masses<T>,
    /// Half the thickness of the cloth at each particle \[m\].
    offsets: Vec<T>,
    present: Motion<T>,
    next: Motion<T>,
    /// The copy of `state_keep`.
    kept: Motion<T>,
    /// Velocities of an iterate of Newton's method.
    iterate: VectorField<T>,
    /// Positions of the last `start_keep`.
    start: VectorField<T>,
    /// Those of the last `iterate_keep`, if one has come after it.
    proven: Option<VectorField<T>>,
    /// Whether they are those of the substep that is under way.
    has_start: bool,
    /// Memory of the linear system, once it is needed.
    implicit: Option<Box<ImplicitSystem<T>>>,
    /// Memory of the single force stages; the fused substep does without.
    force: Option<VectorField<T>>,
    aerodynamics: Option<Aerodynamics<T>>,
    fabric: Option<Fabric<T>>,
    contact: Option<Contact<T>>,
    triangles: Option<TriangleContact<T>>,
    strain_limiter: Option<StrainLimiter<T>>,
    stretch_limiter: Option<StretchLimiter<T>>,
    colliders: Vec<ColliderAt<T>>,
    impulses: BlockImpulses,
    /// Those of the last `state_keep`.
    impulses_kept: BlockImpulses,
    triangle_rows: Option<TriangleRows>,
    semi_implicit: SemiImplicitMemory<T>,
    non_finite_step: Option<u64>,
    stage_times: Vec<StageTime>,
}

impl<T: Real> CpuKernels<T> {
    pub(crate) fn new(
        model: Arc<Model>,
        config: &SolverConfig,
        pool: Arc<ThreadPool>,
    ) -> Result<Self> {
        config.validate()?;
        let count = model.particle_count();
        let springs = SpringColumns::new(model.springs(), count);
        let margin = springs.margin();
        let mut offsets = vec![T::ZERO; packets(count) * LANES];
        for cloth in model.cloths() {
            offsets[cloth.particles.start as usize..cloth.particles.end as usize]
                .fill(T::from_f64(0.5 * cloth.thickness));
        }
        let mut kernels = Self {
            control_forces: ControlForces::default(),
            fields: FieldSum::new(&model),
            programs: procedural_forces::programs(&model),
            masses: Masses::new(model.masses()),
            offsets,
            present: Motion::new(count, margin),
            next: Motion::new(count, margin),
            kept: Motion::new(0, 0),
            iterate: VectorField::empty(),
            proven: None,
            start: VectorField::new(0, 0),
            has_start: false,
            implicit: None,
            force: None,
            aerodynamics: Aerodynamics::new(&model),
            fabric: Fabric::new(&model)?,
            contact: Contact::new(&model),
            triangles: TriangleContact::new(&model, config.pinch),
            strain_limiter: StrainLimiter::new(&model, config.strain_limit.as_ref()),
            stretch_limiter: StretchLimiter::new(&model, config.strain_limit.as_ref()),
            colliders: Vec::new(),
            impulses: BlockImpulses::new(&model),
            impulses_kept: BlockImpulses::new(&model),
            triangle_rows: None,
            semi_implicit: SemiImplicitMemory::new(),
            non_finite_step: None,
            stage_times: Vec::new(),
            springs,
            config: config.resolved(&model, Some(SCHWARZ_MIN)),
            pool,
            arch: pulp::Arch::new(),
            model,
        };
        let state = kernels.model.initial_state();
        kernels.state_write(&state)?;
        Ok(kernels)
    }

    /// Forgets what a linear solver has kept of matrices before.
    fn history_forget(&mut self) {
        if let Some(system) = &mut self.implicit {
            system.history_forget();
        }
    }

    /// Colliders at the end of a substep.
    fn colliders_at(&self, index: usize) -> &[ColliderAt<T>] {
        let count = self.model.colliders().len();
        let sets = self.colliders.len() / count.max(1);
        let set = index.min(sets.saturating_sub(1));
        &self.colliders[set * count..((set + 1) * count).min(self.colliders.len())]
    }

    /// Runs `work` in the thread pool and books its time.
    fn stage<R: Send>(
        &mut self,
        stage: &'static str,
        work: impl FnOnce(&mut Self) -> R + Send,
    ) -> R {
        let start = Instant::now();
        let pool = Arc::clone(&self.pool);
        let result = pool.install(|| work(self));
        self.book(stage, start.elapsed());
        result
    }

    fn book(&mut self, stage: &'static str, time: Duration) {
        match self.stage_times.iter_mut().find(|entry| entry.stage == stage) {
            Some(entry) => entry.time += time,
            None => self.stage_times.push(StageTime { stage, time }),
        }
    }

    /// Runs `change` on the force of every packet, given its first particle.
    fn force_stage(
        &mut self,
        stage: &'static str,
        change: impl Fn(&Self, usize, &mut [Lanes<T>; 3]) + Sync + Send,
    ) {
        let count = self.model.particle_count();
        let mut force =
            self.force.take().unwrap_or_else(|| VectorField::new(count, self.springs.margin()));
        self.stage(stage, |kernels| {
            let kernels = &*kernels;
            force.chunks_mut(BLOCK).enumerate().for_each(|(block, mut chunk)| {
                for local in (0..chunk[0].len()).step_by(LANES) {
                    let mut packet = chunk.each_ref().map(|values| *lanes(values, local));
                    change(kernels, block * BLOCK + local, &mut packet);
                    for (values, packet) in chunk.iter_mut().zip(packet) {
                        *lanes_mut(values, local) = packet;
                    }
                }
            });
        });
        self.force = Some(force);
    }

    /// Adds `sum` to the force of single particles.
    fn force_stage_by_particle(
        &mut self,
        stage: &'static str,
        sum: impl Fn(&Self, usize) -> Option<[T; 3]> + Sync + Send,
    ) {
        self.force_stage(stage, |kernels, first, force| {
            for lane in 0..LANES.min(kernels.model.particle_count() - first) {
                if let Some(sum) = sum(kernels, first + lane) {
                    for axis in 0..3 {
                        force[axis][lane] += sum[axis];
                    }
                }
            }
        });
    }

    fn penalty(&self) -> Option<(&Contact<T>, Penalty<T>)> {
        let contact = self.contact.as_ref()?;
        match contact.response() {
            ContactResponse::Penalty { stiffness, damping } => Some((
                contact,
                Penalty { stiffness: T::from_f64(stiffness), damping: T::from_f64(damping) },
            )),
            _ => None,
        }
    }

    /// The impulse response for a substep of `length` \[s\], if it is the one in use.
    fn impulse(&self, length: f64) -> Option<(&Contact<T>, Impulse<T>)> {
        let contact = self.contact.as_ref()?;
        match contact.response() {
            ContactResponse::Impulse { restitution, friction } => Some((
                contact,
                Impulse {
                    restitution: T::from_f64(restitution),
                    friction: T::from_f64(friction),
                    recovery: T::from_f64(SelfContact::recovery(length)),
                },
            )),
            _ => None,
        }
    }

    fn swap(&mut self) {
        std::mem::swap(&mut self.present, &mut self.next);
    }
}

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
        let pool = Arc::clone(&self.pool);
        pool.install(|| work(self))
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Air, BendModel, Cloth, Collider, ColliderShape, Frame, Geometry, GridPatch, MaterialPreset,
        ModelBuilder, Pose, SelfContact, Solver, stepper::SteppedSolver,
    };

    use super::*;

    /// A patch with springs that buckle, which falls folded onto a ball, in wind, with contact.
    fn model(response: ContactResponse) -> Arc<Model> {
        let spacing = 0.02;
        let preset = &MaterialPreset::ALL[0];
        let rigidity = 0.5 * preset.bending * spacing;
        let mut material = preset.material(spacing);
        material.bend.stiffness *= 20.0;
        material.bend_model = BendModel::ImmediateBuckling { rigidity };
        let patch =
            GridPatch { column_axis: [0.6, 0.0, 0.8], ..GridPatch::horizontal(19, spacing, 0.05) };
        let cloth = Cloth {
            name: "patch".into(),
            geometry: Geometry::Grid(patch),
            material: material.into(),
            pins: vec![3],
            velocity: [0.0, 0.0, -2.0],
        };
        let ball = Collider {
            name: "ball".into(),
            shape: ColliderShape::Sphere { radius: 0.1 },
            pose: Pose::from_translation([0.0, 0.0, -0.08]),
            friction: 0.3,
            restitution: 0.2,
        };
        let builder = ModelBuilder::new()
            .cloth(cloth)
            .collider(ball)
            .air(Air::with_wind([3.0, 1.0, 0.0]))
            .self_contact(SelfContact { distance: 0.019, response });
        Arc::new(builder.build().unwrap())
    }

    fn run<T: Real>(model: &Arc<Model>, arch: pulp::Arch) -> State {
        let config = SolverConfig { time_step: 2e-4, ..SolverConfig::default() };
        let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap());
        let mut kernels = CpuKernels::<T>::new(Arc::clone(model), &config, pool).unwrap();
        kernels.arch = arch;
        let mut solver = SteppedSolver::new(kernels).unwrap();
        for _ in 0..10 {
            solver.advance(Frame { duration: 0.01 }).unwrap();
            let report = solver.synchronize().unwrap();
            assert!(report.measures.strain_max > 1e-3, "it moves");
        }
        let mut state = State::default();
        solver.download(&mut state).unwrap();
        state
    }

    #[test]
    fn the_width_of_the_vector_units_does_not_change_the_bits() {
        let penalty = ContactResponse::Penalty { stiffness: 10.0, damping: 1e-3 };
        let impulse = ContactResponse::Impulse { restitution: 0.1, friction: 0.2 };
        for response in [penalty, impulse] {
            let model = model(response);
            let arch = pulp::Arch::new();
            assert_eq!(run::<f32>(&model, arch), run::<f32>(&model, pulp::Arch::Scalar));
            assert_eq!(run::<f64>(&model, arch), run::<f64>(&model, pulp::Arch::Scalar));
        }
    }
}
