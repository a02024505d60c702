//! Memory of the preconditioner `schwarz`, as `shared/schwarz.cuh` lays it out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    Error, GroupHierarchy, Model, Result,
    schwarz::{Arch, CoarseLevel, GroupPattern, Matrix6, NodeMatrix, Reuse, Schwarz},
};

use crate::{
    fault::BACKEND,
    queue::{Buffer, Queue},
};

/// Levels above the particles at most.
const LEVELS_MAX: usize = 8;
/// Teams of a block that each work on a block of unknowns, as in `shared/schwarz.cuh`.
pub(crate) const TEAMS: usize = 4;
/// Numbers of the factor of a whole block; so many are read from where one starts.
const FACTOR: usize = 5376;

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
    group_of: u64,
    inverse: u64,
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
    places: u64,
    group_of: u64,
    prolongation: u64,
    group_count: u32,
    level_count: u32,
    levels: [LevelData; LEVELS_MAX],
}

/// The preconditioner: the device builds what groups of particles have, the host the levels above.
pub(crate) struct SchwarzMemory {
    pub(crate) schwarz: Schwarz,
    pub(crate) reuse: Reuse,
    data: Buffer<SchwarzData>,
    order: Buffer<u32>,
    group_starts: Buffer<u32>,
    places: Buffer<u32>,
    group_of: Buffer<u32>,
    prolongation: Buffer<f32>,
    levels: Vec<LevelMemory>,
    pattern: GroupPattern,
    built: Option<BuiltMemory>,
}

/// What the device builds beside the prolongation.
struct BuiltMemory {
    diagonals: Buffer<f64>,
    centres: Buffer<f64>,
    unknowns: Buffer<f64>,
    rows: Buffer<u32>,
    columns: Buffer<u32>,
    blocks: Buffer<f64>,
    turned: Buffer<f64>,
    /// Starts and columns of the rows.
    pattern: (Vec<u32>, Vec<u32>),
}

/// The third argument of the kernels that build, as in `preconditioner_build_schwarz.cu`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct SchwarzBuild {
    diagonals: u64,
    centres: u64,
    unknowns: u64,
    rows: u64,
    columns: u64,
    blocks: u64,
    turned: u64,
    group_count: u64,
}

struct LevelMemory {
    matrix: Option<MatrixMemory>,
    factors: Buffer<f32>,
    scale: Buffer<f64>,
    prolongation: Buffer<f64>,
    groups: Buffer<u32>,
    group_of: Buffer<u32>,
    inverse: Buffer<f64>,
    right_side: Buffer<f64>,
    solution: [Buffer<f64>; 2],
}

impl SchwarzMemory {
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
        Ok(Self {
            data: Buffer::zeros(queue, 1)?,
            order: Buffer::of(queue, schwarz.order())?,
            group_starts: Buffer::of(queue, schwarz.group_starts())?,
            places: Buffer::of(queue, schwarz.places())?,
            group_of: Buffer::of(queue, schwarz.group_of())?,
            prolongation: Buffer::zeros(queue, 18 * schwarz.len())?,
            levels: Vec::new(),
            pattern: GroupPattern::new(
                schwarz.group_of(),
                schwarz.group_starts().len() - 1,
                &model.interactions().in_matrix(),
            ),
            built: None,
            reuse: Reuse::default(),
            schwarz,
        })
    }

    /// Groups of particles.
    pub(crate) fn group_count(&self) -> usize {
        self.schwarz.group_starts().len() - 1
    }

    /// Blocks that have something to do.
    pub(crate) fn blocks_wanted(&self) -> u32 {
        self.group_count().div_ceil(TEAMS) as u32
    }

    /// The address of all of it.
    pub(crate) const fn address(&self) -> u64 {
        self.data.address()
    }

    /// What the kernels that build it are given, with room for what they make. `pairs` of groups are coupled beside those that always are.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn build_data(
        &mut self,
        queue: &Queue,
        pairs: impl Iterator<Item = [u32; 2]>,
    ) -> Result<SchwarzBuild> {
        let groups = self.group_count();
        let (starts, columns) = self.pattern.with(pairs);
        let built = match &mut self.built {
            Some(built) => built,
            None => self.built.insert(BuiltMemory {
                diagonals: Buffer::zeros(queue, 9 * self.schwarz.len())?,
                centres: Buffer::zeros(queue, 3 * groups)?,
                unknowns: Buffer::zeros(queue, 36 * groups)?,
                rows: Buffer::zeros(queue, groups + 1)?,
                columns: Buffer::zeros(queue, 0)?,
                blocks: Buffer::zeros(queue, 0)?,
                turned: Buffer::zeros(queue, 0)?,
                pattern: (Vec::new(), Vec::new()),
            }),
        };
        built.rows.write(queue, 0, &starts)?;
        built.columns.write_growing(queue, &columns)?;
        if built.blocks.len() < 36 * columns.len() {
            queue.synchronize()?;
            let length = 36 * (columns.len() + columns.len() / 4);
            built.blocks = Buffer::zeros(queue, length)?;
            built.turned = Buffer::zeros(queue, length)?;
        }
        built.pattern = (starts, columns);
        let data = SchwarzBuild {
            diagonals: built.diagonals.address(),
            centres: built.centres.address(),
            unknowns: built.unknowns.address(),
            rows: built.rows.address(),
            columns: built.columns.address(),
            blocks: built.blocks.address(),
            turned: built.turned.address(),
            group_count: groups as u64,
        };
        // Kernels find groups there.
        self.data_write(queue, &[])?;
        Ok(data)
    }

    /// Reads what the kernels have made, builds the levels above, and hands them to the device.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn build_above(
        &mut self,
        queue: &Queue,
        filter: impl Fn(u32) -> [f32; 6],
    ) -> Result<()> {
        let Some(built) = &mut self.built else { return Ok(()) };
        let (starts, columns) = std::mem::take(&mut built.pattern);
        let (mut centres, mut unknowns, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        built.centres.read(queue, &mut centres)?;
        built.unknowns.read(queue, &mut unknowns)?;
        built.blocks.read_first(queue, 36 * columns.len(), &mut blocks)?;
        let nodes = (centres.as_chunks::<3>().0.to_vec(), matrices(&unknowns));
        let matrix = NodeMatrix::new(starts, columns, matrices(&blocks));
        self.schwarz.build_above(matrix, nodes, filter, Arch::new());
        if self.levels.is_empty() {
            for level in self.schwarz.levels() {
                self.levels.push(LevelMemory::new(queue, level, self.levels.is_empty())?);
            }
        }
        let levels = self.levels.iter_mut().zip(self.schwarz.levels());
        let mut data: Vec<LevelData> =
            levels.map(|(memory, level)| memory.upload(queue, level)).collect::<Result<_>>()?;
        if let Some(first) = data.first_mut() {
            first.rows = built.rows.address();
            first.columns = built.columns.address();
            first.blocks = built.turned.address();
        }
        self.data_write(queue, &data)
    }

    fn data_write(&mut self, queue: &Queue, levels: &[LevelData]) -> Result<()> {
        let mut data = SchwarzData {
            order: self.order.address(),
            group_starts: self.group_starts.address(),
            places: self.places.address(),
            group_of: self.group_of.address(),
            prolongation: self.prolongation.address(),
            group_count: self.group_count() as u32,
            level_count: levels.len() as u32,
            levels: [LevelData::default(); LEVELS_MAX],
        };
        data.levels[..levels.len()].copy_from_slice(levels);
        self.data.write(queue, 0, &[data])
    }
}

/// A matrix between nodes, each block column by column.
struct MatrixMemory {
    rows: Buffer<u32>,
    columns: Buffer<u32>,
    blocks: Buffer<f64>,
}

impl MatrixMemory {
    fn new(queue: &Queue, count: usize) -> Result<Self> {
        Ok(Self {
            rows: Buffer::zeros(queue, count + 1)?,
            columns: Buffer::zeros(queue, 0)?,
            blocks: Buffer::zeros(queue, 0)?,
        })
    }

    /// Hands it to the device; where it is.
    fn upload(&mut self, queue: &Queue, matrix: &NodeMatrix) -> Result<[u64; 3]> {
        self.rows.write(queue, 0, matrix.starts())?;
        self.columns.write_growing(queue, matrix.columns())?;
        self.blocks.write_growing(queue, matrix.turned().as_flattened().as_flattened())?;
        Ok([self.rows.address(), self.columns.address(), self.blocks.address()])
    }
}

/// Matrices of 6 x 6, one after the other.
fn matrices(numbers: &[f64]) -> Vec<Matrix6> {
    numbers.as_chunks::<6>().0.as_chunks::<6>().0.to_vec()
}

impl LevelMemory {
    /// For a level whose size and groups stay what they are, as nothing else does. The device has the matrix of the first one.
    fn new(queue: &Queue, level: &CoarseLevel, is_first: bool) -> Result<Self> {
        let count = level.matrix().len();
        let vector = || Buffer::zeros(queue, 6 * count);
        Ok(Self {
            matrix: (!is_first).then(|| MatrixMemory::new(queue, count)).transpose()?,
            factors: Buffer::zeros(queue, level.factors().rows().len() + FACTOR)?,
            scale: Buffer::zeros(queue, level.factors().scale().len())?,
            prolongation: Buffer::zeros(queue, 36 * level.prolongation().len())?,
            groups: Buffer::of(queue, level.starts())?,
            group_of: Buffer::of(queue, level.group_of())?,
            inverse: Buffer::zeros(queue, level.inverse().len())?,
            right_side: vector()?,
            solution: [vector()?, vector()?],
        })
    }

    fn upload(&mut self, queue: &Queue, level: &CoarseLevel) -> Result<LevelData> {
        let matrix = level.matrix();
        let [rows, columns, blocks] = match &mut self.matrix {
            Some(memory) => memory.upload(queue, matrix)?,
            None => [0; 3],
        };
        if level.inverse().is_empty() {
            self.factors.write(queue, 0, level.factors().rows())?;
            self.scale.write(queue, 0, level.factors().scale())?;
        } else {
            self.inverse.write(queue, 0, level.inverse())?;
        }
        let prolongation = level.prolongation().as_flattened().as_flattened();
        self.prolongation.write(queue, 0, prolongation)?;
        Ok(LevelData {
            rows,
            columns,
            blocks,
            factors: self.factors.address(),
            scale: self.scale.address(),
            prolongation: self.prolongation.address(),
            groups: self.groups.address(),
            group_of: self.group_of.address(),
            inverse: self.inverse.address(),
            right_side: self.right_side.address(),
            solution: self.solution.each_ref().map(Buffer::address),
            weight: level.weight(),
            count: matrix.len() as u32,
            group_count: level.starts().len().saturating_sub(1) as u32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The CUDA sources assert the same.
    #[test]
    fn kernels_are_given_as_many_bytes_as_they_take() {
        assert_eq!(size_of::<LevelData>(), 112);
        assert_eq!(size_of::<SchwarzData>(), 48 + LEVELS_MAX * 112);
        assert_eq!(size_of::<SchwarzBuild>(), 64);
    }
}
