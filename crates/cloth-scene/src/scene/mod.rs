//! The description of a scene: plain data, the same for every file format.

mod attachment;
mod bounds;
mod cloth;
mod collider;
mod colour;
mod contact;
mod environment;
mod event;
mod fabric;
mod mannequin;
mod material;
mod named;
mod network;
mod origin;
mod panels;
mod pin;
mod rigid;
mod rotation;
mod seam;
mod simulation;
mod solid_mesh;
mod solver;
mod triangles;
mod view;

use serde::{Deserialize, Serialize};

pub use attachment::SceneAttachment;
pub use bounds::SceneBounds;
pub use cloth::{
    SceneCloth, SceneFold, SceneGeometry, SceneGrid, SceneInflation, SceneMesh, SceneStencil,
    SceneTear,
};
pub use collider::{SceneAnimation, SceneCollider, SceneKeyframe, SceneShape};
pub use colour::SceneColour;
pub use contact::{SceneContact, SceneContactResponse, SceneContactRule, ScenePinch};
pub use environment::{SceneField, SceneGust, SceneWind};
pub use event::{SceneAction, SceneEvent};
pub use fabric::{
    SceneFabricDamping, SceneMeshing, SceneModel, ScenePanel, ScenePattern, ScenePatternSource,
};
pub use mannequin::{SceneMannequin, SceneMannequinPose, SceneMannequinSwing};
pub use material::{
    SceneAerodynamics, SceneBend, SceneMap, SceneMapOf, SceneMass, SceneMaterial, SceneSpring,
};
pub use network::{SceneJoint, SceneNetwork, ScenePrototype};
pub use origin::SceneOrigin;
pub use panels::{ScenePanels, ScenePiece};
pub use pin::{ScenePin, ScenePinAttribute};
pub use rigid::{SceneRigid, SceneRigidJoint, SceneRigidJointKind, SceneRigidShape};
pub use rotation::SceneRotation;
pub use seam::{SceneElastic, ScenePhase, SceneSeam, SceneSeamEnd, SceneSeamPoint, SceneStart};
pub use simulation::{ScenePrecision, SceneSimulation, SceneSpringClass, SceneStrainLimit};
pub use solid_mesh::SceneSolidMesh;
pub use solver::{SceneAdaptive, SceneImplicit, SceneMidpoint, SceneSemiImplicit, SceneSolver};
pub use triangles::SceneTriangles;
pub use view::{SceneDust, SceneView};

/// All that a scene file says.
///
/// Nothing is checked here but the kinds of the values; [`Scene::compile`] checks the rest.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name of the scene; that of its file, without the extension, if not given.
    #[serde(default)]
    pub name: String,
    /// What it shows, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Gravity \[m/s^2\]; (0, 0, -9.81) if the file does not say.
    #[serde(default = "gravity_standard")]
    pub gravity: [f64; 3],
    /// Frames, time step, solver.
    #[serde(default)]
    pub simulation: SceneSimulation,
    /// What it starts from, if not from how its cloths are described.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<SceneStart>,
    /// The cloths, at least one.
    #[serde(default, rename = "cloth", skip_serializing_if = "Vec::is_empty")]
    pub cloths: Vec<SceneCloth>,
    /// Where they are sewn.
    #[serde(default, rename = "seam", skip_serializing_if = "Vec::is_empty")]
    pub seams: Vec<SceneSeam>,
    /// Elastic bands along their borders.
    #[serde(default, rename = "elastic", skip_serializing_if = "Vec::is_empty")]
    pub elastics: Vec<SceneElastic>,
    /// What holds them to colliders and to each other.
    #[serde(default, rename = "attachment", skip_serializing_if = "Vec::is_empty")]
    pub attachments: Vec<SceneAttachment>,
    /// Spans of time with settings of their own, from the start on.
    #[serde(default, rename = "phase", skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<ScenePhase>,
    /// Solid obstacles.
    #[serde(default, rename = "collider", skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<SceneCollider>,
    /// Solid bodies that move by themselves.
    #[serde(default, rename = "rigid", skip_serializing_if = "Vec::is_empty")]
    pub rigids: Vec<SceneRigid>,
    /// Constraints between these.
    #[serde(default, rename = "rigid_joint", skip_serializing_if = "Vec::is_empty")]
    pub rigid_joints: Vec<SceneRigidJoint>,
    /// Force fields beside gravity.
    #[serde(default, rename = "field", skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<SceneField>,
    /// The air and its wind; without it there is no aerodynamic force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<SceneWind>,
    /// Contact of cloths with themselves and each other. Without it fabrics have contact of triangles, but for the midpoint integrator, and springs pass through;
    /// `contact.response = "none"` leaves it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<SceneContact>,
    /// What happens to pins in the course of time.
    #[serde(default, rename = "event", skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<SceneEvent>,
    /// The part of space that the scene is about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<SceneBounds>,
    /// Camera for pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<SceneView>,
    /// Where the scene was read from.
    #[serde(skip)]
    pub origin: SceneOrigin,
}

impl Scene {
    /// A scene without cloth, under standard gravity.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            description: String::new(),
            gravity: gravity_standard(),
            simulation: SceneSimulation::default(),
            start: None,
            cloths: Vec::new(),
            seams: Vec::new(),
            elastics: Vec::new(),
            attachments: Vec::new(),
            phases: Vec::new(),
            colliders: Vec::new(),
            rigids: Vec::new(),
            rigid_joints: Vec::new(),
            fields: Vec::new(),
            wind: None,
            contact: None,
            events: Vec::new(),
            bounds: None,
            view: None,
            origin: SceneOrigin::default(),
        }
    }
}

const fn gravity_standard() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}
