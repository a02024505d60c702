//! Scenes: what to simulate, as a file says it.
//!
//! A [`Scene`] is plain data that no file format owns. [`Scene::read`] fills it from TOML or from
//! [FYSL](fysl), [`Scene::builtin`] from the scenes that come with the engine, code can fill it
//! directly. [`Scene::compile`] checks it and gives a [`CompiledScene`]: the model, the settings of
//! the solver, and a [`Timeline`] that knows the control of every frame.
//!
//! All quantities are in SI units, coordinates are right handed with z up.

mod builtin;
mod compile;
mod elsewhere;
mod error;
mod fabrics;
mod format;
mod panels;
mod scene;
mod schema;
mod suggestion;
mod timeline;

/// FYSL, the scene language in XML.
pub mod fysl {
    #![doc = include_str!("../FYSL.md")]

    pub use crate::format::fysl::{FyslFeedback, FyslFrame, FyslTransform, FyslVertices, fysl_xsd};
}

pub use builtin::{BenchKind, BuiltinScene, bench_scene, builtin_scenes};
pub use compile::{
    CompileOptions, CompileProgress, CompiledCloth, CompiledPhase, CompiledScene, CompiledSolid,
    HeldPoint, MemoryEstimate, RigidHold, SolverChoice, Welds,
};
pub use error::{SceneError, ScenePlace, SceneUnknown};
pub use fabrics::{FabricSource, MeasuredFabric, SheetError, fabric_sheet_read, measured_fabrics};
pub use scene::{
    Scene, SceneAction, SceneAdaptive, SceneAerodynamics, SceneAnimation, SceneAttachment,
    SceneBend, SceneBounds, SceneCloth, SceneCollider, SceneColour, SceneContact,
    SceneContactResponse, SceneContactRule, SceneDust, SceneElastic, SceneEvent,
    SceneFabricDamping, SceneField, SceneFold, SceneGeometry, SceneGrid, SceneGust, SceneImplicit,
    SceneInflation, SceneJoint, SceneKeyframe, SceneMannequin, SceneMannequinPose,
    SceneMannequinSwing, SceneMap, SceneMapOf, SceneMass, SceneMaterial, SceneMesh, SceneMeshing,
    SceneMidpoint, SceneModel, SceneNetwork, SceneOrigin, ScenePanel, ScenePanels, ScenePattern,
    ScenePatternSource, ScenePhase, ScenePiece, ScenePin, ScenePinAttribute, ScenePinch,
    ScenePrecision, ScenePrototype, SceneRigid, SceneRigidJoint, SceneRigidJointKind,
    SceneRigidShape, SceneRotation, SceneSeam, SceneSeamEnd, SceneSeamPoint, SceneSemiImplicit,
    SceneShape, SceneSimulation, SceneSolidMesh, SceneSolver, SceneSpring, SceneSpringClass,
    SceneStart, SceneStencil, SceneStrainLimit, SceneTear, SceneTriangles, SceneView, SceneWind,
};
pub use schema::{scene_reference, scene_schema};
pub use timeline::Timeline;
