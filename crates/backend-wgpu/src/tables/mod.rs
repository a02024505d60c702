//! What a model is made of, as kernels read it: computed once on the host, never changed.

pub(crate) mod distance_grids;
mod exclusions;
mod fabric;
mod groups;
pub(crate) mod links;
mod rows;
pub(crate) mod springs;
mod strain_limit;
mod triangles;

use cloth_core::{ClothRange, Model, SolverConfig};

use crate::layout::AirCloth;

use strain_limit::StrainTables;

/// Contents of the buffers that depend on the model alone. An empty one stays unused.
#[derive(Debug, Default)]
pub(crate) struct Tables {
    pub(crate) spring_rows: Vec<[u32; 2]>,
    pub(crate) spring_entries: Vec<[u32; 4]>,
    pub(crate) triangle_rows: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 4]>,
    pub(crate) air_cloths: Vec<AirCloth>,
    /// How near each particle comes to colliders \[m\]; empty if it is the same everywhere.
    pub(crate) offsets: Vec<f32>,
    pub(crate) strain: StrainTables,
    pub(crate) exclusions: Vec<u32>,
    /// Particles by groups, if there is contact between cloths.
    pub(crate) group_members: Vec<u32>,
    pub(crate) distance_grids: Vec<u32>,
    pub(crate) fabric: fabric::FabricTables,
}

impl Tables {
    pub(crate) fn new(model: &Model, config: &SolverConfig) -> Self {
        let (spring_rows, spring_entries) = springs::tables(model);
        let (triangle_rows, triangles) = triangles::tables(model);
        let exclusions = match model.self_contact() {
            Some(contact) if contact.excludes_neighbours() => exclusions::table(model, contact),
            _ => Vec::new(),
        };
        let group_members = match model.self_contact() {
            Some(contact) if !contact.is_of_triangles() => groups::members(model),
            _ => Vec::new(),
        };
        Self {
            spring_rows,
            spring_entries,
            triangle_rows,
            triangles,
            air_cloths: air_cloths(model),
            offsets: if common_offset(model).is_some() { Vec::new() } else { offsets(model) },
            strain: StrainTables::new(model, config.strain_limit.as_ref()),
            fabric: fabric::FabricTables::new(model),
            exclusions,
            group_members,
            distance_grids: distance_grids::distance_grids(model),
        }
    }
}

/// What `shared/air.wgsl` knows of each cloth.
fn air_cloths(model: &Model) -> Vec<AirCloth> {
    let half_density = model.air().map_or(0.0, |air| 0.5 * air.density);
    let of = |(cloth, gas): (&ClothRange, [f64; 3])| {
        let [gas, gas_start, gas_end] = gas.map(|number| number as f32);
        AirCloth {
            pressure: (half_density * cloth.aerodynamics.pressure) as f32,
            friction: (half_density * cloth.aerodynamics.friction) as f32,
            gas,
            gas_start,
            gas_end,
            padding: 0.0,
        }
    };
    model.cloths().iter().zip(model.gas_table()).map(of).collect()
}

/// All springs.
pub(crate) fn spring_entries(model: &Model) -> Vec<[u32; 4]> {
    springs::tables(model).1
}

/// All kinds of springs, for the linear system.
pub(crate) fn spring_kinds(model: &Model) -> Vec<[u32; 4]> {
    springs::kinds(model)
}

/// How near all cloths come to colliders \[m\], if it is the same.
pub(crate) fn common_offset(model: &Model) -> Option<f32> {
    let mut offsets = model.collider_offsets().map(|(_, offset)| offset);
    let first = offsets.next()?;
    offsets.all(|other| other == first).then_some(first as f32)
}

fn offsets(model: &Model) -> Vec<f32> {
    let mut offsets = Vec::with_capacity(model.particle_count());
    for (particles, offset) in model.collider_offsets() {
        offsets.resize(particles.end as usize, offset as f32);
    }
    offsets
}
