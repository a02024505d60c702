//! The tables of a model on the device: uploaded once and held.

use std::any::Any;

use cloth_core::{ColliderShape, DistanceGrid, Model, Result, fabric::FOLDS};

use crate::{
    layout::{CudaReal, GridData, Real4, SolverData},
    queue::{Buffer, Queue},
    tables::{FabricTables, SpringTables, StrainTables, TriangleTables, spring_kinds},
};

/// Device memory of the tables.
pub(crate) struct TableMemory<T> {
    pub(crate) springs: SpringTables<T>,
    spring_kinds: Buffer<Real4<T>>,
    /// Where the springs of each colour of the strain limit start, and the end; then the triangles.
    pub(crate) colours: [Vec<u32>; 2],
    /// For each collider the address of its distance grid, 0 for another shape.
    pub(crate) grids: Vec<u64>,
    triangles: Option<(Buffer<u32>, Buffer<[u32; 4]>)>,
    /// Held by `SolverData` through their addresses.
    _others: Vec<Box<dyn Any + Send>>,
}

/// A distance grid and its samples on the device.
fn grid_upload<T: CudaReal>(
    queue: &Queue,
    grid: &DistanceGrid,
) -> Result<(Buffer<GridData<T>>, Buffer<f32>)> {
    let distances = Buffer::of(queue, &grid.distances)?;
    let data = GridData {
        distances: distances.address(),
        size: grid.size,
        sets: grid.set_count() as u32,
        origin: grid.origin.map(T::from_f64),
        spacing: T::from_f64(grid.spacing),
        inverse_spacing: T::from_f64(grid.spacing.recip()),
        last: grid.size.map(|side| T::from_f64(f64::from(side - 1))),
        rate: T::from_f64(grid.rate),
        padding: T::ZERO,
    };
    Ok((Buffer::of(queue, &[data])?, distances))
}

/// How near each particle comes to colliders.
fn offsets<T: CudaReal>(model: &Model) -> Vec<T> {
    let mut offsets = vec![T::ZERO; model.particle_count()];
    for (particles, offset) in model.collider_offsets() {
        offsets[particles.start as usize..particles.end as usize].fill(T::from_f64(offset));
    }
    offsets
}

/// Pressure and friction of air for each cloth, with half the density.
fn air<T: CudaReal>(model: &Model) -> Vec<T> {
    let half_density = T::from_f64(model.air().map_or(0.0, |air| 0.5 * air.density));
    model
        .cloths()
        .iter()
        .flat_map(|cloth| [cloth.aerodynamics.pressure, cloth.aerodynamics.friction])
        .map(|coefficient| half_density * T::from_f64(coefficient))
        .collect()
}

impl<T: CudaReal> TableMemory<T> {
    /// Uploads the tables of a model, and tells kernels where they are. Triangles come later, if they are needed.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(
        queue: &Queue,
        model: &Model,
        springs: SpringTables<T>,
        strain: &StrainTables<T>,
        data: &mut SolverData<T>,
    ) -> Result<Self> {
        data.header_count = springs.headers.len() as u32;
        data.entry_count = springs.entries.len() as u32;
        data.kind_count = springs.kinds.len() as u32;
        data.can_buckle = u32::from(springs.can_buckle);
        let mut others: Vec<Box<dyn Any + Send>> = Vec::new();
        macro_rules! table {
            ($field:ident, $entries:expr) => {{
                let buffer = Buffer::of(queue, $entries)?;
                data.$field = buffer.address();
                others.push(Box::new(buffer));
            }};
        }
        table!(spring_row, &springs.rows);
        table!(spring_headers, &springs.headers);
        table!(spring_entries, &springs.entries);
        table!(spring_packed, &springs.packed);
        let spring_kinds = Buffer::of(queue, &springs.kinds)?;
        data.spring_kinds = spring_kinds.address();
        table!(spring_buckling, &springs.buckling);
        table!(offsets, &offsets::<T>(model));
        table!(air, &air::<T>(model));
        if model.has_inflation() {
            let gas = model.gas_table().into_iter();
            table!(gas, &gas.map(|gas| gas.map(T::from_f64)).collect::<Vec<_>>());
        }
        table!(limited_springs, &strain.springs);
        table!(limited_rows, &strain.colours);
        table!(longest, &strain.longest);
        table!(stretch_triangles, &strain.triangles);
        table!(stretch_rows, &strain.triangle_colours);
        data.limit_colours = strain.colours.len() as u32 - 1;
        data.limit_sweeps = strain.sweeps;
        data.stretch_colours = strain.triangle_colours.len() as u32 - 1;
        data.stretch_ratio = strain.ratio;
        if model.has_fabric() {
            let fabric = FabricTables::<T>::new(model);
            table!(fabric_laws, &fabric.laws);
            table!(membranes, &fabric.membranes);
            table!(plates, &fabric.plates);
            table!(membrane_rows, fabric.rows.offsets());
            table!(membrane_entries, fabric.rows.entries());
            table!(fold_particles, &fabric.folds.particles);
            table!(fold_angles, &fabric.folds.angles);
            table!(patch_folds, &fabric.folds.of_patches);
            table!(moment_places, &fabric.folds.moment_places);
            table!(fold_rows, fabric.folds.rows.offsets());
            table!(fold_entries, fabric.folds.rows.entries());
            let (count, folds) = (fabric.membranes.len(), fabric.folds.particles.len());
            for (address, length) in [
                (&mut data.membrane_forces, 4 * 3 * count),
                (&mut data.bending_forces, 4 * 4 * folds),
                (&mut data.fold_states, 2 * (folds + 1)),
                (&mut data.fold_apexes, 2 * 4 * (folds + 1)),
                (&mut data.fold_moments, FOLDS * count + 1),
            ] {
                let buffer = Buffer::<T>::zeros(queue, length)?;
                *address = buffer.address();
                others.push(Box::new(buffer));
            }
            data.element_count = count as u32;
            data.fold_count = folds as u32;
        }
        let mut grids = vec![0; model.colliders().len()];
        for (collider, address) in model.colliders().iter().zip(&mut grids) {
            if let ColliderShape::Grid(grid) = &collider.shape {
                let (grid, distances) = grid_upload::<T>(queue, grid)?;
                *address = grid.address();
                others.push(Box::new(grid));
                others.push(Box::new(distances));
            }
        }
        let colours = [strain.colours.clone(), strain.triangle_colours.clone()];
        Ok(Self { springs, spring_kinds, colours, grids, triangles: None, _others: others })
    }

    /// Uploads the triangles, which only air and normals need.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn triangles_prepare(
        &mut self,
        queue: &Queue,
        model: &Model,
        data: &mut SolverData<T>,
    ) -> Result<()> {
        if self.triangles.is_some() {
            return Ok(());
        }
        let tables = TriangleTables::new(model);
        let rows = Buffer::of(queue, &tables.rows)?;
        let triangles = Buffer::of(queue, &tables.triangles)?;
        data.triangle_rows = rows.address();
        data.triangles = triangles.address();
        self.triangles = Some((rows, triangles));
        Ok(())
    }

    /// Takes the lengths and stiffness of springs from another model.
    ///
    /// # Errors
    /// What the device reports.
    pub(crate) fn spring_kinds_write(&mut self, queue: &Queue, model: &Model) -> Result<()> {
        self.springs.kinds = spring_kinds(model);
        self.spring_kinds.write(queue, 0, &self.springs.kinds)
    }
}
