//! Model, state and solver contract of the cloth engine.
//!
//! A [`Model`] says what is simulated and never changes; [`ModelBuilder`] makes and checks it. A
//! [`Backend`] turns a model into a [`Solver`], which owns all memory, advances a [`State`] by
//! frames under a [`Control`], and gives a [`StepReport`] of each. Integrators are written once, in
//! [`stepper`], over the stages of [`Kernels`]; a backend is an implementation of that trait.
//!
//! All quantities are in SI units, coordinates are right handed with z up. Which of the integrators
//! suits what, [`integrators`] says.
//!
//! The formulas that all backends implement:
#![doc = include_str!("../NUMERICS.md")]

mod audit;
mod backend;
mod config;
pub mod contact;
mod control;
mod divergence;
mod error;
#[cfg(test)]
mod example;
pub mod fabric;
mod field;
/// Which integrator suits what.
pub mod integrators {
    #![doc = include_str!("../INTEGRATORS.md")]
}
mod kernels;
mod mesh;
mod model;
mod real;
mod report;
pub mod schwarz;
mod state;
pub mod stepper;
mod team;

pub use audit::Audit;
pub use backend::{Backend, BackendInfo, FormChoice, Frame, Solver};
pub use config::{
    AdaptiveSettings, AutoPreconditioner, ImplicitSettings, Integrator, LinearMethod,
    LinearSettings, LinearStop, MatrixForm, MidpointSettings, NewtonSettings, Pinch, Precision,
    Preconditioner, SemiImplicitSettings, SemiImplicitSolve, SolverConfig, StrainLimit,
    TimeStepControl,
};
pub use control::{
    Anchor, AnchorSpring, ColliderControl, Control, ControlStart, ForceControl, PinAction,
    PinControl,
};
pub use divergence::divergence_origin;
pub use error::{Divergence, DivergenceCause, DivergenceOrigin, Error, ModelError, Result};
pub use field::{FieldAxes, FieldError, FieldInputs, FieldProgram, FieldRegisters};
pub use kernels::{
    ColliderImpulse, ConstraintStatistics, ContactStatistics, DeferredOutcome, ImplicitKernels,
    Kernels, LinearOutcome, LinearStart, LinearVector, MatrixBlock, NewtonStart, PinWrite,
    SemiImplicitKernels,
};
pub use mesh::{
    MeshFold, MeshStitch, PanelFabrics, TextureMap, TriangleMesh, VertexAttribute, VertexGroup,
};
pub use model::{
    Aerodynamics, Air, BROKEN, BUCKLING_COEFFICIENTS, BendModel, BlockDependencies, BodySurface,
    Buckling, Cloth, ClothMaterial, ClothRange, Collider, ColliderShape, ColourRegion,
    ColourRegions, Colouring, ContactFeature, ContactMap, ContactResponse, ContactRule,
    DistanceGrid, FOLD_PLACES_MAX, FabricAudit, FabricElements, FabricFold, FabricMaterial,
    FabricMatrix, FabricTerms, FabricTriangle, Feature, FeatureSet, Field, Geometry, GridPatch,
    GridSets, GroupHierarchy, Gust, Incidence, Inflation, InteractionKind, InteractionList,
    Interactions, Mass, Material, MaterialPreset, Meshing, Model, ModelBuilder, ModelFeatures,
    ModelShape, NONE, Neighbours, NetworkSpring, OF_FOLD, PieceBlocks, Pose, Pulls, RegularPatch,
    RestSource, STITCH_LENGTH, ScalarEntry, Seam, SeamError, SeamRange, SeamTie, Seams,
    SelfContact, SlicedRows, SplitMesh, Spring, SpringClass, SpringCoefficients, SpringColouring,
    SpringKind, SpringNetwork, SpringRows, Springs, Stencil, Stitching, StrainGauge, StrainMeasure,
    TERM_SHIFT, Tear, TearEdge, Tears, TriangleStrain, VertexClasses, Weld, Welding, WingedEdge,
    WingedEdges,
};
pub use real::Real;
pub use report::{Measures, SolverReport, StageTime, StepReport, TimeStepChange, TimeStepReason};
pub use state::State;
pub use team::Team;
