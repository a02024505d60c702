//! Memory of the preconditioner `schwarz`, as `shared/schwarz.cuh` lays it out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    Error, GroupHierarchy, Model, Result,
    schwarz::{CoarseLevel, Reuse, Schwarz},
};

use crate::{
    fault::BACKEND,
    layout::CudaReal,
    queue::{Buffer, Queue},
};

/// Levels above the particles at most.
const LEVELS_MAX: usize = 8;
/// Threads that work on a block of 96 unknowns.
const TEAM: u32 = 96;

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct LevelData {
    rows: u64,
    columns: u64,
    blocks: u64,
    factors: u64,
    scale: u64,
    prolongation: u64,
    groups: u64,
    right_side: u64,
    solution: [u64; 2],
    weight: f64,
    count: u32,
    group_count: u32,
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct SchwarzData {
    order: u64,
    group_starts: u64,
    row_starts: u64,
    places: u64,
    group_of: u64,
    factors: u64,
    scale: u64,
    prolongation: u64,
    group_count: u32,
    level_count: u32,
    levels: [LevelData; LEVELS_MAX],
}

/// The preconditioner, which the host builds, and where the device has it.
pub(crate) struct SchwarzMemory<T> {
    pub(crate) schwarz: Schwarz<T>,
    pub(crate) reuse: Reuse,
    data: Buffer<SchwarzData>,
    order: Buffer<u32>,
    group_starts: Buffer<u32>,
    row_starts: Buffer<u64>,
    places: Buffer<u32>,
    group_of: Buffer<u32>,
    factors: Buffer<f32>,
    scale: Buffer<T>,
    prolongation: Buffer<f32>,
    levels: Vec<LevelMemory>,
}

struct LevelMemory {
    rows: Buffer<u32>,
    columns: Buffer<u32>,
    blocks: Buffer<f64>,
    factors: Buffer<f32>,
    scale: Buffer<f64>,
    prolongation: Buffer<f64>,
    groups: Buffer<u32>,
    right_side: Buffer<f64>,
    solution: [Buffer<f64>; 2],
}

impl<T: CudaReal> SchwarzMemory<T> {
    /// Memory for the groups of a model, nothing built yet.
    ///
    /// # Errors
    /// `OutOfMemory`; `Unsupported` for more particles than there are levels for.
    pub(crate) fn new(queue: &Queue, model: &Model) -> Result<Self> {
        let hierarchy = GroupHierarchy::new(model);
        if hierarchy.levels().len() > LEVELS_MAX {
            let feature = format!("the preconditioner schwarz with more than {LEVELS_MAX} levels");
            return Err(Error::Unsupported { backend: BACKEND, feature });
        }
        let schwarz = Schwarz::new(hierarchy);
        let factors = schwarz.factors();
        let row_starts: Vec<u64> = factors.row_starts().iter().map(|&at| at as u64).collect();
        Ok(Self {
            data: Buffer::zeros(queue, 1)?,
            order: Buffer::of(queue, schwarz.order())?,
            group_starts: Buffer::of(queue, schwarz.group_starts())?,
            row_starts: Buffer::of(queue, &row_starts)?,
            places: Buffer::of(queue, schwarz.places())?,
            group_of: Buffer::of(queue, schwarz.group_of())?,
            factors: Buffer::zeros(queue, factors.rows().len())?,
            scale: Buffer::zeros(queue, factors.scale().len())?,
            prolongation: Buffer::zeros(queue, 18 * schwarz.len())?,
            levels: Vec::new(),
            reuse: Reuse::default(),
            schwarz,
        })
    }

    /// Blocks of so many threads that have something to do.
    pub(crate) fn blocks_wanted(&self, threads: u32) -> u32 {
        (self.schwarz.group_starts().len() as u32 - 1).div_ceil(threads / TEAM)
    }

    /// The address of all of it.
    pub(crate) const fn address(&self) -> u64 {
        self.data.address()
    }

    /// Hands what was built to the device.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn upload(&mut self, queue: &Queue) -> Result<()> {
        let Self { schwarz, factors, scale, prolongation, levels, .. } = self;
        factors.write(queue, 0, schwarz.factors().rows())?;
        scale.write(queue, 0, schwarz.factors().scale())?;
        prolongation.write(queue, 0, schwarz.prolongation().as_flattened().as_flattened())?;
        if levels.is_empty() {
            for level in schwarz.levels() {
                levels.push(LevelMemory::new(queue, level)?);
            }
        }
        let mut data = SchwarzData {
            order: self.order.address(),
            group_starts: self.group_starts.address(),
            row_starts: self.row_starts.address(),
            places: self.places.address(),
            group_of: self.group_of.address(),
            factors: factors.address(),
            scale: scale.address(),
            prolongation: prolongation.address(),
            group_count: schwarz.group_starts().len() as u32 - 1,
            level_count: schwarz.levels().len() as u32,
            levels: [LevelData::default(); LEVELS_MAX],
        };
        let all = levels.iter_mut().zip(schwarz.levels());
        for ((memory, level), data) in all.zip(&mut data.levels) {
            *data = memory.upload(queue, level)?;
        }
        self.data.write(queue, 0, &[data])
    }
}

impl LevelMemory {
    /// For a level whose size and groups stay what they are, as nothing else does.
    fn new(queue: &Queue, level: &CoarseLevel) -> Result<Self> {
        let count = level.matrix().len();
        let vector = || Buffer::zeros(queue, 6 * count);
        Ok(Self {
            rows: Buffer::zeros(queue, count + 1)?,
            columns: Buffer::zeros(queue, 0)?,
            blocks: Buffer::zeros(queue, 0)?,
            factors: Buffer::zeros(queue, level.factors().rows().len())?,
            scale: Buffer::zeros(queue, level.factors().scale().len())?,
            prolongation: Buffer::zeros(queue, 36 * level.prolongation().len())?,
            groups: Buffer::of(queue, level.starts())?,
            right_side: vector()?,
            solution: [vector()?, vector()?],
        })
    }

    fn upload(&mut self, queue: &Queue, level: &CoarseLevel) -> Result<LevelData> {
        let matrix = level.matrix();
        self.rows.write(queue, 0, matrix.starts())?;
        self.columns.write_growing(queue, matrix.columns())?;
        self.blocks.write_growing(queue, matrix.blocks().as_flattened().as_flattened())?;
        self.factors.write(queue, 0, level.factors().rows())?;
        self.scale.write(queue, 0, level.factors().scale())?;
        let prolongation = level.prolongation().as_flattened().as_flattened();
        self.prolongation.write(queue, 0, prolongation)?;
        Ok(LevelData {
            rows: self.rows.address(),
            columns: self.columns.address(),
            blocks: self.blocks.address(),
            factors: self.factors.address(),
            scale: self.scale.address(),
            prolongation: self.prolongation.address(),
            groups: self.groups.address(),
            right_side: self.right_side.address(),
            solution: self.solution.each_ref().map(Buffer::address),
            weight: level.weight(),
            count: matrix.len() as u32,
            group_count: level.starts().len().saturating_sub(1) as u32,
        })
    }
}
