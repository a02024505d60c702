//! One cloth, from description to model.

use std::collections::HashSet;

use cloth_core::{Cloth, ClothMaterial, ContactMap, Geometry, Tear, TriangleMesh};

use crate::{Scene, SceneCloth, SceneError, SceneGeometry, SceneModel};

use super::{
    Check, CompileOptions, CompiledCloth, attachment, fabric, fold, grid, map, material, mesh,
    model_error, network, panels,
    pins::{MeshSets, NAMED_MAX, PinSets},
    seam::{self, Sewn},
};

/// A cloth for the model, and what else was said of it.
pub(super) struct DescribedCloth {
    pub(super) cloth: Cloth,
    /// Names of its sets of particles.
    pub(super) sets: PinSets,
    /// Its own stitches.
    pub(super) stitches: Sewn,
    /// What maps make of its contact.
    pub(super) contact: Option<ContactMap>,
    /// Where it tears.
    pub(super) tear: Option<Tear>,
}

/// The cloth for the model. What is worth knowing of it goes to `notes`.
pub(super) fn compile(
    (scene, check): (&Scene, &Check<'_>),
    index: usize,
    cloth: &SceneCloth,
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<DescribedCloth, SceneError> {
    let key = format!("cloth[{index}]");
    let is_fabric = cloth.model_chosen() == SceneModel::Fabric;
    if !is_fabric {
        fabric::fabric_alone(check, &key, cloth)?;
    }
    let place = |error| model_error::place(scene, error);
    // A mesh keeps the sets that pins and panels name until its fabric is known.
    let (mut geometry, mut sets) = match &cloth.geometry {
        SceneGeometry::Grid(described) => {
            let counts = [described.columns, described.rows];
            let patch = grid::compile(check, &format!("{key}.geometry.grid"), described)?;
            let geometry = if is_fabric {
                patch.validate(&cloth.name).map_err(place)?;
                Geometry::Mesh(patch.mesh(grid::meshing(described)))
            } else {
                Geometry::Grid(patch)
            };
            let particles = u32::try_from(geometry.particle_count()).unwrap_or(u32::MAX);
            (geometry, PinSets::Grid(counts, particles))
        }
        SceneGeometry::Mesh(mesh) => {
            let mesh = mesh::compile(check, &format!("{key}.geometry.mesh"), mesh, options)?;
            if mesh.polygons > 0 {
                notes.push(format!(
                    "cloth {:?}: {} faces of its mesh have more than three corners and became fans of triangles around their first corner",
                    cloth.name, mesh.polygons
                ));
            }
            // The model refuses more vertices than an index can name.
            let vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Mesh(mesh), PinSets::Mesh(vertices, MeshSets::default()))
        }
        SceneGeometry::Panels(described) => {
            let mesh = panels::compile(
                check,
                &format!("{key}.geometry.panels"),
                (described, &cloth.folds),
                options,
            )?;
            let vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Mesh(mesh), PinSets::Mesh(vertices, MeshSets::default()))
        }
        SceneGeometry::Triangles(triangles) => {
            let key = format!("{key}.geometry.triangles");
            let mesh = TriangleMesh {
                positions: triangles.vertices.clone(),
                triangles: triangles.faces.clone(),
                texture: fabric::texture(check, &key, triangles)?,
                ..TriangleMesh::default()
            };
            let vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Mesh(mesh), PinSets::Mesh(vertices, MeshSets::default()))
        }
        SceneGeometry::Network(network) => {
            if is_fabric {
                let problem = "has no triangles to be of fabric: give `model = \"springs\"`, or a grid or mesh";
                return Err(check.error(&format!("{key}.geometry.network"), problem));
            }
            let network = network::compile(check, &format!("{key}.geometry.network"), network)?;
            let particles = u32::try_from(network.positions.len()).unwrap_or(u32::MAX);
            (Geometry::Network(network), PinSets::Mesh(particles, MeshSets::default()))
        }
    };
    let stitches = match &mut geometry {
        Geometry::Mesh(mesh) => {
            let sewn = mesh.stitches.len();
            let stitches = seam::sew((scene, check), &cloth.name, mesh, notes)?;
            if sewn > 0 && mesh.stitches.len() == sewn {
                notes.push(format!(
                    "cloth {:?}: its mesh has {sewn} stitches; a `[[seam]]` with `file = true` sews them",
                    cloth.name
                ));
            }
            mesh.stitches.clear();
            if let PinSets::Mesh(vertices, _) = &mut sets {
                *vertices = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            }
            stitches
        }
        Geometry::Grid(_) | Geometry::Network(_) => Sewn::default(),
    };
    let mut contact = None;
    let material: ClothMaterial = match &mut geometry {
        Geometry::Mesh(mesh) if is_fabric => {
            mesh.folds = fold::compile(check, &key, cloth, (mesh, &sets))?;
            let material = fabric::compile(check, &key, cloth, options, mesh, notes)?;
            let maps = &cloth.material.maps;
            if !maps.is_empty() {
                mesh.panels = map::compile(check, &key, (maps, &material.fabric), (mesh, &sets))?;
                contact = map::contact(check, (&key, &cloth.name), maps, (mesh, &sets))?;
            }
            material.into()
        }
        other => {
            let key = format!("{key}.material");
            material::compile(check, &key, &cloth.material, other)?.into()
        }
    };
    if let (Geometry::Mesh(mesh), PinSets::Mesh(_, sets)) = (&mut geometry, &mut sets) {
        *sets = MeshSets::take(mesh);
    }
    let mut tear = None;
    if let (Geometry::Mesh(mesh), Some(asked)) = (&mut geometry, &cloth.tear) {
        check.positive(&format!("{key}.tear.strain"), asked.strain)?;
        let vertices = mesh.positions.len();
        let split = std::mem::take(mesh).split();
        let mut corners = vec![Vec::new(); vertices];
        (0..).zip(&split.origins).for_each(|(corner, &of)| corners[of as usize].push(corner));
        notes.push(format!(
            "cloth {:?} can tear: each of its triangles has vertices of its own, {} in all for the {vertices} that are simulated while nothing is torn",
            cloth.name,
            split.origins.len()
        ));
        if let Some(map) = &mut contact {
            for values in [&mut map.distance, &mut map.friction] {
                if !values.is_empty() {
                    *values = split.origins.iter().map(|&of| values[of as usize]).collect();
                }
            }
        }
        sets = PinSets::Split(Box::new(sets), corners);
        *mesh = split.mesh;
        tear = Some(Tear { cloth: cloth.name.clone(), strain: asked.strain, ..split.tear });
    }
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
    pins.extend(attachment::held(scene, check, &cloth.name, &sets)?);
    let name = cloth.name.clone();
    let cloth = Cloth { name, geometry, material, pins, velocity: cloth.velocity };
    Ok(DescribedCloth { cloth, sets, stitches, contact, tear })
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
                | SceneGeometry::Panels(_)
                | SceneGeometry::Network(_) => None,
            },
            material: compiled.material,
            spacing: compiled.geometry.spacing(),
        }
    }
}
