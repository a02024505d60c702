//! A model that several tests are about.

use crate::{
    Aerodynamics, Cloth, FabricMaterial, Geometry, GridPatch, Model, ModelBuilder, RestSource,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
};

/// A square sheet of fabric of so many columns, 2 cm apart, with a largest stretch.
pub(crate) fn sheet(columns: u32, stretch_limit: f64) -> Model {
    ModelBuilder::new().cloth(sheet_cloth("sheet", columns, stretch_limit)).build().unwrap()
}

/// The same before it becomes part of a model.
pub(crate) fn sheet_cloth(name: &str, columns: u32, stretch_limit: f64) -> Cloth {
    let fabric = fabric(stretch_limit);
    let rest = RestSource::Pattern { scale: 1.0 };
    let material =
        FabricMaterial { fabric, rest, aerodynamics: Aerodynamics::default(), imperfection: 0.0 };
    Cloth {
        name: name.into(),
        geometry: Geometry::Grid(GridPatch::horizontal(columns, 0.02, 0.0)),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

/// The fabric of these sheets.
pub(crate) fn fabric(stretch_limit: f64) -> Fabric {
    Fabric {
        area_density: 0.2,
        thickness: 1e-3,
        warp: TensileCurve::linear(100.0),
        weft: TensileCurve::linear(100.0),
        coupling: 0.0,
        shear: 10.0,
        bending: BendingRigidity::isotropic(1e-6),
        friction: InternalFriction::default(),
        damping: [0.0; 2],
        stretch_limit,
    }
}
