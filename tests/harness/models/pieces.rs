//! Cloths from their descriptions.

use cloth_core::{
    Aerodynamics, BendModel, Cloth, FabricMaterial, Geometry, GridPatch, Mass, Material,
    RestSource, SpringCoefficients, Stencil, TextureMap, TriangleMesh,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
};
use glam::DQuat;

use super::{description::Piece, mesh::irregular_mesh, network::random_network};
use crate::random::Random;

/// A material with all springs alike and no damping, `mass` \[kg\] for each particle.
#[must_use]
pub fn material(mass: f64, stiffness: f64, thickness: f64) -> Material {
    let springs = SpringCoefficients { stiffness, damping: 0.0 };
    Material {
        mass: Mass::PerParticle(mass),
        stretch: springs,
        shear: springs,
        bend: springs,
        bend_model: BendModel::Linear,
        aerodynamics: Aerodynamics::default(),
        thickness,
    }
}

/// A patch as a cloth.
#[must_use]
pub fn grid_cloth(name: &str, patch: GridPatch, material: Material) -> Cloth {
    Cloth {
        name: name.into(),
        geometry: Geometry::Grid(patch),
        material: material.into(),
        pins: Vec::new(),
        velocity: [0.0; 3],
    }
}

/// The cloth that a piece describes, within a few spacings of `centre` \[m\].
pub(super) fn cloth(
    piece: Piece,
    name: String,
    spacing: f64,
    centre: [f64; 3],
    pinned: bool,
    random: &mut Random,
) -> Cloth {
    let origin = {
        let [dx, dy, dz] = random.vector(3.0 * spacing);
        [centre[0] + dx, centre[1] + dy, centre[2] + dz]
    };
    let geometry = match piece {
        Piece::Grid { columns, rows, stencil } => {
            Geometry::Grid(grid([columns, rows], stencil, spacing, origin, random))
        }
        Piece::Mesh { columns, rows, holes } => {
            let mut mesh = irregular_mesh([columns, rows], spacing, holes, random);
            shift(&mut mesh.positions, origin);
            Geometry::Mesh(mesh)
        }
        Piece::Fabric { columns, rows, holes } => {
            let mut mesh = irregular_mesh([columns, rows], spacing, holes, random);
            shift(&mut mesh.positions, origin);
            mesh.texture = Some(pattern(&mesh, random));
            Geometry::Mesh(mesh)
        }
        Piece::Network { particles, springs } => {
            let mut network = random_network(particles, springs, spacing, random);
            shift(&mut network.positions, origin);
            Geometry::Network(network)
        }
    };
    let particles = geometry.particle_count() as u32;
    let is_network = matches!(geometry, Geometry::Network(_));
    Cloth {
        name,
        geometry,
        material: if matches!(piece, Piece::Fabric { .. }) {
            random_fabric(random).into()
        } else {
            random_material(is_network, random).into()
        },
        pins: (0..particles).filter(|_| pinned && random.chance(0.1)).collect(),
        velocity: random.vector(1.0),
    }
}

fn shift(positions: &mut [[f64; 3]], origin: [f64; 3]) {
    for position in positions {
        *position = std::array::from_fn(|k| position[k] + origin[k]);
    }
}

fn grid(
    [columns, rows]: [u32; 2],
    stencil: Stencil,
    spacing: f64,
    origin: [f64; 3],
    random: &mut Random,
) -> GridPatch {
    let turn = DQuat::from_axis_angle(random.direction().into(), random.between(0.0, 6.0));
    GridPatch {
        columns,
        rows,
        spacing: [spacing, spacing * random.between(0.7, 1.4)],
        origin,
        column_axis: (turn * glam::DVec3::X).into(),
        row_axis: (turn * glam::DVec3::Y).into(),
        stencil,
    }
}

/// A pattern of a sheet that lies along the plane z = 0, turned and a little smaller or larger.
fn pattern(mesh: &TriangleMesh, random: &mut Random) -> TextureMap {
    let (sine, cosine) = random.between(0.0, 6.0).sin_cos();
    let size = random.between(0.9, 1.1);
    let turned =
        |&[x, y, _]: &[f64; 3]| [size * (cosine * x - sine * y), size * (sine * x + cosine * y)];
    TextureMap {
        coordinates: mesh.positions.iter().map(turned).collect(),
        triangles: mesh.triangles.clone(),
    }
}

fn random_fabric(random: &mut Random) -> FabricMaterial {
    let mut curve = || TensileCurve {
        linear: random.logarithmic(2.0, 20.0),
        cubic: random.logarithmic(1.0, 300.0),
        end: random.between(0.02, 0.2),
    };
    let [warp, weft] = [curve(), curve()];
    let fabric = Fabric {
        area_density: random.between(0.1, 0.4),
        thickness: random.logarithmic(1e-3, 2e-2),
        coupling: random.between(-0.9, 0.9) * Fabric::largest_coupling(&warp, &weft),
        warp,
        weft,
        shear: random.logarithmic(1.0, 10.0),
        bending: BendingRigidity {
            warp: random.logarithmic(1e-6, 1e-4),
            weft: random.logarithmic(1e-6, 1e-4),
            bias: None,
        },
        friction: InternalFriction::default(),
        damping: if random.chance(0.5) { [0.0; 2] } else { [1e-4, 2e-4] },
        stretch_limit: [f64::INFINITY, random.between(1.1, 1.5)][usize::from(random.chance(0.5))],
    };
    let rest = if random.chance(0.5) {
        RestSource::Pattern { scale: 1.0 }
    } else {
        RestSource::Start { warp: Some([1.0, random.between(-2.0, 2.0), 0.0]) }
    };
    let aerodynamics = Aerodynamics { pressure: random.between(0.0, 1.5), friction: 0.05 };
    FabricMaterial { fabric, rest, aerodynamics, imperfection: 0.0 }
}

fn random_material(is_network: bool, random: &mut Random) -> Material {
    let mut springs = || SpringCoefficients {
        stiffness: random.logarithmic(1.0, 100.0),
        damping: random.between(0.0, 0.05),
    };
    let [stretch, shear, bend] = [springs(), springs(), springs()];
    let mass = if is_network || random.chance(0.3) {
        Mass::PerParticle(random.logarithmic(1e-3, 1e-2))
    } else {
        Mass::PerArea(random.between(0.1, 0.4))
    };
    Material {
        mass,
        stretch,
        shear,
        bend,
        bend_model: BendModel::Linear,
        aerodynamics: Aerodynamics {
            pressure: random.between(0.0, 1.5),
            friction: random.between(0.0, 0.1),
        },
        thickness: random.logarithmic(1e-3, 2e-2),
    }
}

/// Bend springs that buckle: most at once, some late, some never, and some only between two
/// compressions, for which B / (k L^3) has to be within a narrow range.
pub(super) fn random_bend_model(stiffness: f64, spacing: f64, random: &mut Random) -> BendModel {
    let ratio = match random.index(4) {
        0 => random.between(0.0255, 0.0318),
        _ => random.logarithmic(1e-4, 0.05),
    };
    // Bend springs of a grid are about two spacings long.
    BendModel::ImmediateBuckling { rigidity: ratio * stiffness * (2.0 * spacing).powi(3) }
}
