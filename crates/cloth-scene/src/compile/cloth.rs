//! One cloth, from description to model.

use std::collections::HashSet;

use cloth_core::{Cloth, Geometry, TriangleMesh};

use crate::{SceneCloth, SceneError, SceneGeometry};

use super::{
    Check, CompileOptions, CompiledCloth, grid, material, mesh, network,
    pins::{MeshSets, NAMED_MAX, PinSets},
};

/// The cloth for the model, and the names of its sets of particles.
pub(super) fn compile(
    check: &Check<'_>,
    index: usize,
    cloth: &SceneCloth,
    options: &CompileOptions,
) -> Result<(Cloth, PinSets), SceneError> {
    let key = format!("cloth[{index}]");
    let (geometry, sets) = match &cloth.geometry {
        SceneGeometry::Grid(patch) => {
            let counts = [patch.columns, patch.rows];
            let patch = grid::compile(check, &format!("{key}.geometry.grid"), patch)?;
            (Geometry::Grid(patch), PinSets::Grid(counts))
        }
        SceneGeometry::Mesh(mesh) => {
            let mut mesh = mesh::compile(check, &format!("{key}.geometry.mesh"), mesh, options)?;
            let sets = MeshSets::take(&mut mesh);
            // The model refuses more vertices than an index can name.
            let vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Mesh(mesh), PinSets::Mesh(vertices, sets))
        }
        SceneGeometry::Triangles(triangles) => {
            let mesh = TriangleMesh {
                positions: triangles.vertices.clone(),
                triangles: triangles.faces.clone(),
                ..TriangleMesh::default()
            };
            let vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Mesh(mesh), PinSets::Mesh(vertices, MeshSets::default()))
        }
        SceneGeometry::Network(network) => {
            let network = network::compile(check, &format!("{key}.geometry.network"), network)?;
            let particles = u32::try_from(network.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Network(network), PinSets::Mesh(particles, MeshSets::default()))
        }
    };
    let material =
        material::compile(check, &format!("{key}.material"), &cloth.material, geometry.spacing())?;
    let mut pins = Vec::new();
    let mut seen = HashSet::new();
    // A set that is named again holds nothing new.
    for pin in cloth.pins.iter().filter(|pin| seen.insert(pin.to_string())) {
        let key = format!("{key}.pins");
        pins.extend(sets.resolve(check, &key, pin)?);
        if pins.len() as u64 > NAMED_MAX {
            let problem = format!("name more than {NAMED_MAX} particles in all: name fewer sets");
            return Err(check.error(&key, &problem));
        }
    }
    let name = cloth.name.clone();
    Ok((Cloth { name, geometry, material: material.into(), pins, velocity: cloth.velocity }, sets))
}

impl CompiledCloth {
    /// What is left of `cloth` beside what the model takes of `compiled`.
    pub(super) fn new(cloth: &SceneCloth, compiled: &Cloth) -> Self {
        Self {
            name: cloth.name.clone(),
            colour: cloth.colour,
            grid: match &cloth.geometry {
                SceneGeometry::Grid(grid) => Some([grid.columns, grid.rows]),
                SceneGeometry::Mesh(_)
                | SceneGeometry::Triangles(_)
                | SceneGeometry::Network(_) => None,
            },
            material: compiled.material,
            spacing: compiled.geometry.spacing(),
        }
    }
}
