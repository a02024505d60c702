//! All stages on the memory of one solver.

mod frame;
mod implicit;
mod semi_implicit;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use cloth_core::{
    ContactResponse, FieldProgram, Kernels, Model, Preconditioner, Real, Result, SelfContact,
    SolverConfig, StageTime, Team,
};
use rayon::prelude::*;

use crate::{
    aerodynamic_forces::Aerodynamics,
    block_impulses::BlockImpulses,
    collider_response::ColliderAt,
    contact::{
        Contact,
        response::{Impulse, Penalty},
    },
    control_forces::ControlForces,
    fabric::{Fabric, StretchLimiter},
    field_forces::FieldSum,
    implicit::ImplicitSystem,
    kernels::semi_implicit::SemiImplicitMemory,
    memory::{BLOCK, LANES, Lanes, Masses, Motion, VectorField, lanes, lanes_mut, packets},
    procedural_forces::{self},
    springs::SpringColumns,
    strain_limit::StrainLimiter,
    triangle_contact::TriangleContact,
    triangles::TriangleRows,
};

/// The stages on the CPU.
pub(crate) struct CpuKernels<T> {
    model: Arc<Model>,
    config: SolverConfig,
    team: Arc<Team>,
    arch: pulp::Arch,
    springs: SpringColumns<T>,
    control_forces: ControlForces<T>,
    fields: FieldSum<T>,
    programs: Vec<Arc<FieldProgram>>,
    masses: Masses<T>,
    /// How near each particle comes to colliders \[m\].
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
        team: Arc<Team>,
        arch: pulp::Arch,
    ) -> Result<Self> {
        config.validate()?;
        let count = model.particle_count();
        let springs = SpringColumns::new(model.springs(), count);
        let margin = springs.margin();
        let mut offsets = vec![T::ZERO; packets(count) * LANES];
        for (particles, offset) in model.collider_offsets() {
            offsets[particles.start as usize..particles.end as usize].fill(T::from_f64(offset));
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
            triangles: TriangleContact::new(&model, config.pinch, arch),
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
            config: config.resolved(&model, Some(Preconditioner::SCHWARZ_MIN)),
            team,
            arch,
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

    /// Runs `work` in the pool of threads and books its time.
    fn stage<R: Send>(
        &mut self,
        stage: &'static str,
        work: impl FnOnce(&mut Self) -> R + Send,
    ) -> R {
        let start = Instant::now();
        let team = Arc::clone(&self.team);
        let result = team.install(|| work(self));
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
