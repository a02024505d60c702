//! One solver's memory, and the recording of all stages on it.

mod confirm;
mod contact;
mod control_forces;
mod encode;
mod fabric;
mod feedback;
mod linear;
mod motion;
mod results;
mod semi_implicit;
mod triangle_contact;

use std::{collections::HashMap, sync::Arc};

use cloth_core::{
    Collider, ColliderShape, DeferredOutcome, Error, Integrator, LinearSettings, LinearStop, Model,
    Precision,
    Preconditioner::{self, Schwarz},
    Result, SlicedRows, SolverConfig, StageTime,
    contact::device::DeviceContact,
    stepper::FramePlan,
};
use wgpu::BindGroup;

use crate::{
    buffers::{Buffers, MOTIONS_MAX, uniform_array},
    contact::{
        OpenFrames,
        policy::{ContactPolicy, ContactSizes},
    },
    device::{DYNAMIC, DeviceContext, Kernel},
    dispatch::{Groups, MEASURE_BLOCK, WORKGROUP, groups, solve_blocks},
    fault::BACKEND,
    figures::Figures,
    layout,
    linear::{SolvePolicy, linear_check},
    procedural,
    readback::Readback,
    recorder::Recorder,
    slots::Slots,
    tables::{Tables, common_offset, distance_grids, springs},
};

use self::semi_implicit::SemiImplicit;

/// All that a solver has on a device.
#[derive(Debug)]
pub(crate) struct Stages {
    context: Arc<DeviceContext>,
    model: Arc<Model>,
    config: SolverConfig,
    buffers: Buffers,
    kernels: HashMap<&'static str, Arc<Kernel>>,
    /// The part of kernels that adds the forces of procedural fields, if there are any.
    procedural: Option<Arc<str>>,
    /// For each collider the number of its distance grid.
    grid_numbers: Vec<f32>,
    /// By kernel, motion that is read, motion that is written.
    bind_groups: HashMap<(&'static str, usize, usize), BindGroup>,
    recorder: Recorder,
    slots: Slots,
    /// Colours of the springs that are limited, then those of the triangles.
    colours: Vec<layout::Colour>,
    spring_colours: usize,
    /// The motion that holds the present state.
    present: usize,
    /// For each motion whether the boxes around its groups are known.
    has_boxes: [bool; MOTIONS_MAX],
    held: Vec<bool>,
    control_forces: control_forces::InEffect,
    /// Whether one kernel does the composite stage; false on a device that cannot bind enough buffers.
    is_fused: bool,
    has_force: bool,
    /// Whether it is known where the substep that is under way has started.
    has_start: bool,
    contact: Option<ContactPolicy>,
    /// Work that may have to be done again.
    open: Option<OpenFrames>,
    /// The present frame, where it may have to be done again.
    plan: Option<Arc<FramePlan>>,
    is_batch: bool,
    /// Parameters of single kernels that are on the device.
    calls: Vec<layout::Call>,
    /// How much of a solve is recorded, if the device decides how solves go on.
    solve_policy: Option<SolvePolicy>,
    /// Largest distance of the numbers of two particles that a spring joins, if an iteration of the conjugate
    /// gradient method is one kernel.
    solve_reach: Option<u32>,
    /// Iterations of the last solve that the host waited for: without and with `schwarz`.
    last_iterations: [u32; 2],
    /// The preconditioner that is there, and that of the name `schwarz` if it was ever built.
    preconditioner: Preconditioner,
    schwarz: Option<Box<linear::SchwarzTables>>,
    /// The pattern of what triangles of fabric add to the matrix, once its memory is there.
    element_rows: Option<SlicedRows>,
    semi_implicit: SemiImplicit,
    /// Contact of triangles, if there is any.
    triangles: Option<Box<DeviceContact<f32>>>,
    /// The table of its contacts as it was last written.
    contact_words: Vec<u32>,
    /// How many contacts of triangles there are, if solves work them out before they add up rows.
    crowd: Option<u32>,
    /// What came of recorded solves, for the next one who asks.
    deferred: DeferredOutcome,
    /// Particles that colliders constrain, if the host knows it.
    constrained: Option<u64>,
    /// Contacts with colliders that changed since somebody asked.
    released: u64,
    /// Fused substeps with contact since there had to be an opportunity to build the list of groups.
    list_uses: u32,
    /// The last results that were read.
    status: layout::Status,
    solve: layout::Solve,
    figures: Option<Figures>,
    rebuilds_reported: u32,
    /// What went wrong where no result could say so.
    failure: Option<Error>,
    small: Readback,
    large: Option<Readback>,
}

/// Where in the small readback the results of `measure`, the status and the solves are \[byte\].
const SMALL_STATUS: u64 = crate::buffers::MEASURE_SIZE;
const SMALL_SOLVE: u64 = SMALL_STATUS + size_of::<layout::Status>() as u64;
const SMALL_SIZE: u64 = SMALL_SOLVE + size_of::<layout::Solve>() as u64;

/// How solves are recorded; `None` where the host decides how each goes on, as Newton's method does.
fn solve_policy(model: &Model, config: &SolverConfig) -> Result<Option<SolvePolicy>> {
    let particles = model.particle_count();
    match &config.integrator {
        Integrator::Explicit => Ok(None),
        Integrator::Implicit(settings) => {
            linear_check(&settings.linear)?;
            let passes =
                if model.has_collider_constraints() { settings.constraint_passes } else { 1 };
            let policy = SolvePolicy::new(&settings.linear, particles, passes);
            Ok((settings.newton.iterations_max == 1).then_some(policy))
        }
        Integrator::Midpoint(settings) => linear_check(&settings.linear).map(|()| None),
        Integrator::SemiImplicit(settings) => {
            semi_implicit::solve_check(settings.solve)?;
            Ok(Some(SolvePolicy::new(&semi_implicit::LINEAR, particles, semi_implicit::PASSES)))
        }
        other => {
            let feature = format!("the integrator {other:?}");
            Err(Error::Unsupported { backend: BACKEND, feature })
        }
    }
}

impl Stages {
    pub(crate) fn new(
        context: Arc<DeviceContext>,
        model: Arc<Model>,
        config: &SolverConfig,
    ) -> Result<Self> {
        config.validate()?;
        if config.precision != Precision::F32 {
            return Err(Error::Unsupported {
                backend: BACKEND,
                feature: format!("precision {}", config.precision),
            });
        }
        // Contact of triangles is certified by the host in each substep; the host builds `schwarz`, and finds where solves by energy
        // begin.
        let by_energy = |linear: &LinearSettings| linear.stop == LinearStop::Energy;
        let needs_host = model.has_triangle_contact()
            || config.preconditioner() == Some(Schwarz)
            || config.integrator.linear().is_some_and(by_energy);
        let solve_policy = solve_policy(&model, config)?.filter(|_| !needs_host);
        context.faults.check()?;
        // No kernel is started for more: springs of a colour share no particle.
        let limit = context.limits.max_compute_workgroups_per_dimension;
        let tables = Tables::new(&model, config);
        let members = &tables.group_members;
        let contact = model
            .self_contact()
            .filter(|contact| !contact.is_of_triangles())
            .map(|contact| ContactPolicy::new(&model, contact, config.time_step, members));
        match &contact {
            Some(policy) => groups(policy.sizes.groups, 1, limit)?,
            None => groups(model.particle_count() as u32, WORKGROUP, limit)?,
        };
        let sizes = contact.as_ref().map(|policy| policy.sizes);
        let repeats = contact.is_some() || solve_policy.is_some();
        // Where a frame is short the device would stand still while the host learns how the last ones went.
        let is_short = sizes.as_ref().is_some_and(ContactSizes::is_small) && solve_policy.is_none();
        let motions = match (repeats, is_short && !model.collider_impulses()) {
            (_, true) => MOTIONS_MAX,
            (true, false) => 3,
            (false, false) => 2,
        };
        let buffers = Buffers::new(&context, &model, &tables, sizes.as_ref(), motions)?;
        let mut stages = Self {
            recorder: Recorder::new(&context, solve_policy.is_some()),
            small: Readback::new(&context, SMALL_SIZE),
            large: None,
            kernels: HashMap::new(),
            procedural: procedural::part(&model).map(Arc::from),
            grid_numbers: distance_grids::grid_numbers(&model),
            bind_groups: HashMap::new(),
            slots: Slots::new(),
            colours: tables.strain.colours,
            spring_colours: tables.strain.spring_colours,
            present: 0,
            has_boxes: [false; MOTIONS_MAX],
            held: vec![false; model.particle_count()],
            control_forces: control_forces::InEffect::default(),
            is_fused: true,
            has_force: false,
            has_start: false,
            contact,
            open: None,
            plan: None,
            is_batch: false,
            calls: Vec::new(),
            solve_policy,
            solve_reach: None,
            last_iterations: [0; 2],
            preconditioner: Preconditioner::Block,
            schwarz: None,
            element_rows: None,
            semi_implicit: SemiImplicit::default(),
            triangles: DeviceContact::new(&model, config.pinch).map(Box::new),
            contact_words: Vec::new(),
            crowd: None,
            deferred: DeferredOutcome::default(),
            constrained: None,
            released: 0,
            list_uses: 0,
            status: layout::Status::default(),
            solve: layout::Solve::default(),
            figures: None,
            rebuilds_reported: 0,
            failure: None,
            config: config.clone(),
            buffers,
            model,
            context,
        };
        if stages.solve_policy.is_some() {
            stages.linear_prepare()?;
        }
        stages.triangles_prepare()?;
        stages.kernels_prepare()?;
        stages.model_write();
        stages.slots.ticks();
        stages.slots_write()?;
        let state = stages.model.initial_state();
        stages.state_write(&state)?;
        Ok(stages)
    }

    /// Compiles what every frame needs, so that what a device cannot do shows at once.
    fn kernels_prepare(&mut self) -> Result<()> {
        self.is_fused = self.triangles.is_none()
            && match self.kernel("explicit_substep") {
                Err(Error::LimitExceeded { .. }) => false,
                other => other.map(|_| true)?,
            };
        if !self.is_fused {
            for name in ["field_forces", "spring_forces", "integrate_explicit"] {
                self.kernel(name)?;
            }
        }
        if self.model.has_fabric() {
            let others: &[_] = if self.is_fused {
                &["explicit_substep_fabric"]
            } else {
                &["membrane_forces", "bending_forces_moments"]
            };
            for &name in ["bending_forces_folds", "bending_forces"].iter().chain(others) {
                self.kernel(name)?;
            }
            self.kernel("measure_fabric")?;
        }
        self.kernel("measure")?;
        self.kernel("measure_total")?;
        Ok(())
    }

    pub(crate) fn model(&self) -> &Arc<Model> {
        &self.model
    }

    pub(crate) fn config(&self) -> &SolverConfig {
        &self.config
    }

    pub(crate) fn stage_times(&mut self) -> Vec<StageTime> {
        self.recorder.stage_times()
    }

    pub(crate) const fn strain_limit_colours(&self) -> usize {
        self.spring_colours
    }

    pub(crate) fn stretch_limit_colours(&self) -> usize {
        self.colours.len() - self.spring_colours
    }

    /// Whether one kernel does the composite stage.
    pub(crate) const fn is_fused(&self) -> bool {
        self.is_fused
    }

    fn particle_count(&self) -> u32 {
        self.model.particle_count() as u32
    }

    /// Triangles of fabric.
    fn element_count(&self) -> u32 {
        self.model.elements().triangles().len() as u32
    }

    /// Folds between them.
    fn fold_count(&self) -> u32 {
        self.model.elements().folds().len() as u32
    }

    /// The options of a module for this model.
    fn options(&self, name: &str) -> Vec<&'static str> {
        let contact = self.model.self_contact().filter(|contact| !contact.is_of_triangles());
        let triangles = self.triangles.is_some().then_some("triangles");
        let is_penalty = self.is_penalty();
        let colliders = (!self.model.colliders().is_empty()).then_some("colliders");
        let buckling = springs::may_buckle(&self.model).then_some("buckling");
        let is_grid = |collider: &Collider| matches!(collider.shape, ColliderShape::Grid(_));
        let grids = self.model.colliders().iter().any(is_grid).then_some("grids");
        let feedback = self.model.collider_impulses().then_some("feedback");
        let fabric = self.model.has_fabric().then_some("fabric");
        match name {
            "explicit_substep" => {
                let air = self.model.air().is_some().then_some("air");
                let general = [is_penalty.then_some("penalty"), fabric].into_iter().flatten();
                let forces = air.into_iter().chain(buckling).chain(general);
                forces.chain(grids).chain(feedback).collect()
            }
            "collider_response" => {
                let start = self.model.has_passable_colliders().then_some("start");
                grids.into_iter().chain(feedback).chain(start).collect()
            }
            "collider_constraints" => grids.into_iter().collect(),
            "semi_implicit_factorise" | "semi_implicit_solve" => {
                buckling.into_iter().chain(fabric).collect()
            }
            "spring_forces" | "spring_linearise" => buckling.into_iter().collect(),
            "implicit_assemble" => {
                let air = self.model.air().is_some().then_some("air");
                let penalty = is_penalty.then_some("penalty");
                let others = [colliders, fabric, penalty, triangles].into_iter().flatten();
                air.into_iter().chain(buckling).chain(others).collect()
            }
            "conjugate_gradient_image" | "linear_residual" => {
                let penalty = is_penalty.then_some("penalty");
                colliders.into_iter().chain(fabric).chain(penalty).chain(triangles).collect()
            }
            "conjugate_gradient_image_crowded" => colliders.into_iter().chain(fabric).collect(),
            "matrix_apply" => {
                let contact = [is_penalty.then_some("penalty"), triangles];
                fabric.into_iter().chain(contact.into_iter().flatten()).collect()
            }
            "conjugate_gradient_iteration"
            | "conjugate_gradient_step"
            | "constraint_filter"
            | "constraint_project"
            | "linear_start"
            | "preconditioner_apply"
            | "preconditioner_apply_end"
            | "preconditioner_build" => colliders.into_iter().collect(),
            "measure" => {
                buckling.into_iter().chain(contact.map(|_| "contact")).chain(grids).collect()
            }
            "contact_candidates_list" => {
                let excludes = contact.is_some_and(cloth_core::SelfContact::excludes_neighbours);
                excludes.then_some("exclusions").into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether contact between cloths acts through forces.
    fn is_penalty(&self) -> bool {
        let is_penalty = |contact: &cloth_core::SelfContact| {
            !(contact.excludes_neighbours() || contact.is_of_triangles())
        };
        self.model.self_contact().is_some_and(is_penalty)
    }

    fn kernel(&mut self, name: &'static str) -> Result<Arc<Kernel>> {
        if let Some(kernel) = self.kernels.get(name) {
            return Ok(Arc::clone(kernel));
        }
        let has_procedural = ["explicit_substep", "procedural_forces"].contains(&name);
        let procedural = self.procedural.as_ref().filter(|_| has_procedural);
        let kernel = self.context.kernel(name, &self.options(name), procedural)?;
        self.kernels.insert(name, Arc::clone(&kernel));
        Ok(kernel)
    }

    /// Whether colliders come at the end of the fused substep, with nothing between.
    pub(crate) fn colliders_in_pass(&self) -> bool {
        let impulses =
            self.model.self_contact().is_some_and(cloth_core::SelfContact::excludes_neighbours);
        !impulses && self.colours.is_empty()
    }

    fn model_write(&self) {
        let contact = self.model.self_contact();
        let [stiffness, damping, restitution, friction] =
            match contact.map(|contact| contact.response) {
                Some(cloth_core::ContactResponse::Penalty { stiffness, damping }) => {
                    [stiffness, damping, 0.0, 0.0]
                }
                Some(cloth_core::ContactResponse::Impulse { restitution, friction }) => {
                    [0.0, 0.0, restitution, friction]
                }
                // That of triangles has a law of its own.
                Some(cloth_core::ContactResponse::Triangles { .. }) | None => [0.0; 4],
            };
        let [solve_blocks, solve_repeats] = solve_blocks(self.particle_count());
        let data = layout::Model {
            acceleration: self.model.uniform_acceleration().map(|component| component as f32),
            particle_count: self.particle_count(),
            drag_rate: self.model.drag_rate().map(|component| component as f32),
            offset: common_offset(&self.model).unwrap_or(-1.0),
            contact_distance: contact.map_or(0.0, |contact| contact.distance) as f32,
            contact_stiffness: stiffness as f32,
            contact_damping: damping as f32,
            contact_restitution: restitution as f32,
            contact_friction: friction as f32,
            colliders_in_pass: u32::from(self.colliders_in_pass()),
            measure_blocks: self.particle_count().div_ceil(MEASURE_BLOCK)
                + self.element_count().div_ceil(MEASURE_BLOCK),
            element_count: self.element_count(),
            fold_count: self.fold_count(),
            solve_blocks,
            solve_repeats,
            ..layout::Model::default()
        };
        if let Ok(buffer) = self.buffers.get("model", 0, 0) {
            self.context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&data));
        }
    }

    /// Writes to a buffer. Work recorded before is handed over first: it must not see the new contents.
    fn write(&mut self, name: &str, offset: u64, contents: &[u8]) -> Result<()> {
        self.context.faults.check()?;
        if !self.recorder.is_empty() {
            self.recorder.submit(&self.context)?;
        }
        let buffer = self.buffers.get(name, 0, 0)?;
        self.context.queue.write_buffer(buffer, offset, contents);
        Ok(())
    }

    /// Writes to a buffer that grows when it must.
    fn write_growing(&mut self, name: &'static str, contents: &[u8]) -> Result<()> {
        self.write_growing_to(name, contents, contents.len() as u64)
    }

    /// The same; where the buffer grows, it gets this size.
    fn write_growing_to(&mut self, name: &'static str, contents: &[u8], room: u64) -> Result<()> {
        let size = self.buffers.get(name, 0, 0).map_or(0, wgpu::Buffer::size);
        if size < contents.len() as u64 {
            self.recorder.submit(&self.context)?;
            self.buffers.create(&self.context, name, room, None)?;
            self.bind_groups.clear();
        }
        self.write(name, 0, contents)
    }

    /// Hands the parameters of all substeps to the device.
    fn slots_write(&mut self) -> Result<()> {
        let bytes = uniform_array(&self.context.limits, self.slots.data());
        self.write_growing("substep", &bytes)
    }

    fn slot_write(&mut self, index: usize) -> Result<()> {
        let stride =
            crate::buffers::uniform_stride(&self.context.limits, size_of::<layout::Substep>());
        let entry = self.slots.data()[index];
        self.write("substep", index as u64 * stride, bytemuck::bytes_of(&entry))
    }

    pub(crate) fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.schwarz_forget();
        self.frame_admit()?;
        self.slots.fill(plan);
        self.slots.ticks();
        self.slots_write()?;
        self.colliders_write(plan)?;
        if let Some(triangles) = &mut self.triangles {
            triangles.frame_begin(plan);
        }
        self.contact_constants_write()?;
        if self.may_repeat() {
            self.plan = Some(Arc::new(plan.clone()));
        }
        let frame = self.open.is_some().then(|| self.frame_open());
        if let (Some(open), Some(frame)) = (&mut self.open, frame) {
            open.frames.push(frame);
        }
        Ok(())
    }

    fn colliders_write(&mut self, plan: &FramePlan) -> Result<()> {
        if plan.collider_count == 0 {
            return Ok(());
        }
        let shapes = self.model.colliders().iter().cycle();
        let data: Vec<layout::Collider> = shapes
            .zip(self.grid_numbers.iter().cycle())
            .zip(&plan.colliders)
            .enumerate()
            .map(|(number, ((collider, &grid), at))| {
                match self.model.is_contact_body(number % plan.collider_count) {
                    true => motion::body(),
                    false => motion::collider(collider, grid, at),
                }
            })
            .collect();
        self.write_growing("colliders", bytemuck::cast_slice(&data))
    }

    /// Records a kernel over `items`, reading the present motion and writing motion `output`.
    fn dispatch(
        &mut self,
        stage: &'static str,
        name: &'static str,
        (items, per_group): (u32, u32),
        output: usize,
        (slot, colour): (usize, usize),
    ) -> Result<()> {
        let limit = self.context.limits.max_compute_workgroups_per_dimension;
        let groups: Groups = groups(items, per_group, limit)?;
        let kernel = self.kernel(name)?;
        let key = (name, self.present, output);
        if !self.bind_groups.contains_key(&key) {
            let group = self.bind_group(&kernel, output)?;
            self.bind_groups.insert(key, group);
        }
        let limits = &self.context.limits;
        let mut offsets = [0_u32; 2];
        let mut used = 0;
        for binding in &kernel.bindings {
            let (size, index) = match binding.name.as_str() {
                "substep" => (size_of::<layout::Substep>(), slot),
                "colour" => (size_of::<layout::Colour>(), colour),
                "call" => (size_of::<layout::Call>(), colour),
                _ => continue,
            };
            let stride = crate::buffers::uniform_stride(limits, size);
            offsets[used] = (stride * index as u64) as u32;
            used += 1;
        }
        let group = &self.bind_groups[&key];
        self.recorder.dispatch(&self.context, stage, &kernel, group, &offsets[..used], groups)
    }

    fn bind_group(&self, kernel: &Kernel, output: usize) -> Result<BindGroup> {
        let mut entries = Vec::with_capacity(kernel.bindings.len());
        for binding in &kernel.bindings {
            let buffer = self.buffers.get(&binding.name, self.present, output)?;
            let size = match binding.name.as_str() {
                name if !DYNAMIC.contains(&name) => None,
                "substep" => Some(size_of::<layout::Substep>() as u64),
                "call" => Some(size_of::<layout::Call>() as u64),
                _ => Some(size_of::<layout::Colour>() as u64),
            };
            let size = size.and_then(std::num::NonZeroU64::new);
            entries.push(wgpu::BindGroupEntry {
                binding: binding.number,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset: 0,
                    size,
                }),
            });
        }
        Ok(self.context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &kernel.layout,
            entries: &entries,
        }))
    }
}
