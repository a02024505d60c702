//! Fabric: triangles that stretch and bend as measured in the laboratory, however a cloth is meshed.
//!
//! A [`Fabric`] says what a cloth is made of, a [`RestShape`] what shape it has without forces; a [`FabricSheet`] makes the first
//! from what a laboratory reports. [`membrane`] and [`hinge`] are the elements, written once over [`Real`](crate::Real) with IEEE
//! operations alone in a fixed order, so that every backend that does the same operations gets the same bits (NUMERICS §11, §12).

pub mod arctangent;
pub mod bending;
mod curvature;
mod error;
mod friction;
pub mod hinge;
mod law;
pub mod membrane;
mod rest;
mod rest_warning;
mod sheet;
pub mod stretch_limit;
mod tensile_fit;
pub mod units;
mod vector;

pub use curvature::{CurvatureStiffness, FOLDS, HingeGeometry};
pub use error::FabricError;
pub use friction::InternalFriction;
pub use law::{
    BendingRigidity, COUPLING_SHARE, Fabric, FabricScale, Locking, PlateRigidity, TensileCurve,
    USUAL_DAMPING,
};
pub use rest::{RestHinge, RestShape, RestTriangle};
pub use rest_warning::RestWarning;
pub use sheet::{BendingSheet, FabricSheet, FitReport, TensileSheet, overhang_rigidity};
pub use tensile_fit::{TensileFit, TensileSample};

#[cfg(test)]
mod tests;
