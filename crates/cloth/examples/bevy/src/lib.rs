//! A cloth in bevy: a component that holds a simulation, and a system that steps it and hands its positions and normals
//! to the mesh of the same entity.
//!
//! In a game with a window:
//!
//! ```ignore
//! App::new()
//!     .add_plugins((DefaultPlugins, ClothPlugin))
//!     .insert_resource(Time::<Fixed>::from_hz(FRAMES_PER_SECOND))
//!     .add_systems(Startup, |mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>| {
//!         let cloth = ClothSheet::new().expect("a sheet");
//!         let mesh = Mesh3d(meshes.add(cloth.mesh()));
//!         commands.spawn((cloth, mesh, MeshMaterial3d::<StandardMaterial>::default()));
//!     })
//!     .run();
//! ```

use std::sync::Mutex;

use bevy_app::{App, FixedUpdate, Plugin};
use bevy_asset::{Assets, RenderAssetUsages};
use bevy_ecs::prelude::*;
use bevy_mesh::{Indices, Mesh, Mesh3d, PrimitiveTopology};
use cloth::{
    Cloth, Control, GridPatch, ImplicitSettings, Integrator, MaterialPreset, ModelBuilder,
    ModelSimulation, SolverConfig, backend_create,
};

/// Frames of the simulation in a second \[Hz\]: the rate of the schedule `FixedUpdate`.
pub const FRAMES_PER_SECOND: f64 = 60.0;
/// Particles along a side.
const SIDE: u32 = 31;

/// A sheet of a metre that hangs from two corners.
#[derive(Component)]
pub struct ClothSheet {
    // Components are shared between threads; a simulation is one thread's at a time.
    simulation: Mutex<ModelSimulation>,
    triangles: Vec<[u32; 3]>,
}

impl ClothSheet {
    /// The sheet at its start.
    ///
    /// # Errors
    /// What is wrong with the model, or with the backend.
    pub fn new() -> Result<Self, Box<dyn std::error::Error>> {
        let patch =
            GridPatch::new([SIDE, SIDE], 1.0 / f64::from(SIDE - 1)).with_centre([0.0, 0.0, 1.0]);
        let corners = [patch.particle(0, 0), patch.particle(SIDE - 1, 0)];
        let sheet = Cloth::grid("sheet", patch, &MaterialPreset::JERSEY).with_pins(corners);
        let model = ModelBuilder::new().cloth(sheet).build()?;
        let triangles = model.triangles().to_vec();
        let config = SolverConfig {
            integrator: Integrator::Implicit(ImplicitSettings::default()),
            time_step: 1.0 / FRAMES_PER_SECOND,
            ..SolverConfig::default()
        };
        let backend = backend_create("cpu", None)?;
        let simulation = ModelSimulation::new(model, &config, FRAMES_PER_SECOND, backend.as_ref())?;
        Ok(Self { simulation: Mutex::new(simulation), triangles })
    }

    /// A mesh with the triangles of the sheet; [`cloth_step`] fills in where they are.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        let particles = self.triangles.iter().flatten().max().map_or(0, |last| *last as usize + 1);
        let indices = self.triangles.iter().flatten().copied().collect();
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0_f32; 3]; particles])
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0_f32, 1.0, 0.0]; particles])
            .with_inserted_indices(Indices::U32(indices))
    }
}

/// Steps all sheets of a game.
pub struct ClothPlugin;

impl Plugin for ClothPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(FixedUpdate, cloth_step);
    }
}

/// Steps each sheet by a frame and updates its mesh.
///
/// # Errors
/// [`cloth::Error`] of a simulation, such as its divergence.
pub fn cloth_step(
    mut sheets: Query<(&mut ClothSheet, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) -> Result {
    for (mut sheet, handle) in &mut sheets {
        let Ok(simulation) = sheet.simulation.get_mut() else { continue };
        simulation.step(&Control::default())?;
        let (state, normals) = simulation.state_and_normals()?;
        let Some(mut mesh) = meshes.get_mut(&handle.0) else { continue };
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, upright(&state.positions));
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, upright(normals));
    }
    Ok(())
}

/// From z up to y up, both right handed.
fn upright(vectors: &[[f64; 3]]) -> Vec<[f32; 3]> {
    vectors.iter().map(|&[x, y, z]| [x as f32, z as f32, -y as f32]).collect()
}

#[cfg(test)]
mod tests {
    use bevy_mesh::VertexAttributeValues;

    use super::*;

    #[test]
    fn a_mesh_sinks_between_its_corners() {
        let mut app = App::new();
        app.init_resource::<Assets<Mesh>>().add_plugins(ClothPlugin);
        let sheet = ClothSheet::new().unwrap();
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(sheet.mesh());
        app.world_mut().spawn((sheet, Mesh3d(mesh.clone())));
        for _ in 0..10 {
            app.world_mut().run_schedule(FixedUpdate);
        }
        let meshes = app.world().resource::<Assets<Mesh>>();
        let mesh = meshes.get(&mesh).unwrap();
        let Some(VertexAttributeValues::Float32x3(places)) =
            mesh.attribute(Mesh::ATTRIBUTE_POSITION)
        else {
            panic!("no positions")
        };
        let last = places.len() - 1;
        assert!((places[0][1] - 1.0).abs() < 1e-6, "a pinned corner: {:?}", places[0]);
        assert!(places[last][1] < 0.95, "a free one: {:?}", places[last]);
    }
}
