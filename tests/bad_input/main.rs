//! Input that makes no sense is refused, with the case and the index that is wrong.

#![expect(clippy::unwrap_used, reason = "what is valid here must be accepted")]

mod config;
mod control_and_state;
mod fields;
mod implicit;
mod mesh;
mod model;
mod solver;

use cloth_core::{Cloth, Geometry, GridPatch, Material, ModelBuilder};
use harness::models::{grid_cloth, material};

/// A valid patch of 3 x 3 particles.
fn patch() -> Cloth {
    grid_cloth("patch", GridPatch::horizontal(3, 0.1, 0.0), material(1e-3, 10.0, 1e-3))
}

/// The springs of [`patch`].
fn springs(cloth: &mut Cloth) -> &mut Material {
    match cloth.material.springs_mut() {
        Some(material) => material,
        None => unreachable!("a patch is made of springs"),
    }
}

/// The grid of [`patch`].
fn grid_of(cloth: &mut Cloth) -> &mut GridPatch {
    match &mut cloth.geometry {
        Geometry::Grid(grid) => grid,
        Geometry::Mesh(_) | Geometry::Network(_) => unreachable!("a patch is a grid"),
    }
}

fn builder() -> ModelBuilder {
    ModelBuilder::new().cloth(patch())
}
