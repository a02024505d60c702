//! Contact of cloths with themselves and each other.

use serde::{Deserialize, Serialize};

use super::{Scene, SceneGeometry, SceneModel, SceneSolver};

/// Contact of all cloths with themselves and each other.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneContact {
    /// Distance of two particles, or of two triangles, below which they are in contact \[m\]. If not given, that of triangles is 4 mm, in
    /// finer cloth less: three tenths of the distance of neighbouring particles, but at least the thickness of the thickest cloth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub distance: Option<f64>,
    /// What contact does; triangles with a friction of 0.3 if not given.
    #[serde(default)]
    pub response: SceneContactResponse,
    /// What becomes of cloth that bodies press on each other without room for it: `refuse` (the default) ends the run with the place and the name
    /// of the body; `ghost` leaves it inside of them, held between their faces, until they have parted, and counts it. For contact of
    /// triangles.
    #[serde(default, skip_serializing_if = "ScenePinch::is_default")]
    pub pinch: ScenePinch,
    /// Whether cloth that intersects at the start, itself, other cloth or bodies, is pulled apart before the first frame, as far as that can be done:
    /// contact keeps apart what is apart. `layer` of cloths helps. For contact of triangles.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub recover: bool,
    /// Objects that touch in another way than this; the last entry that is about two objects and says something of them counts. For contact of
    /// triangles.
    #[serde(default, rename = "rule", skip_serializing_if = "Vec::is_empty")]
    pub rules: Vec<SceneContactRule>,
}

/// How two objects touch. Whatever it says, they do not go through each other.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneContactRule {
    /// Names of two cloths or colliders, which may be one cloth; one name is for the contact of that object with everything.
    pub between: Vec<String>,
    /// Distance at which forces begin \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub distance: Option<f64>,
    /// Coulomb friction coefficient.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub friction: Option<f64>,
    /// Whether they push each other apart and rub, as they do if not given; without, they only stop where they would intersect.
    #[serde(default = "forces_default", skip_serializing_if = "Clone::clone")]
    pub forces: bool,
}

const fn forces_default() -> bool {
    true
}

impl SceneContact {
    /// No contact, which scenes of fabric have to say.
    pub const NONE: Self = Self {
        distance: None,
        response: SceneContactResponse::None,
        pinch: ScenePinch::Refuse,
        recover: false,
        rules: Vec::new(),
    };

    /// The distance of contact of triangles that is not given \[m\]: for cloths with this least distance of neighbouring particles and this
    /// largest thickness \[m\].
    #[must_use]
    pub const fn usual_distance(spacing: f64, thickness: f64) -> f64 {
        (SPACING_SHARE * spacing).min(LONGEST_DISTANCE).max(thickness)
    }
}

/// Distance of contact that is chosen at most \[m\]. It is seen as a gap from nearby; a shorter one takes more steps and iterations.
const LONGEST_DISTANCE: f64 = 4e-3;

/// Share of the distance of neighbouring particles that is chosen at most: folds stay possible between them.
const SPACING_SHARE: f64 = 0.3;

impl Scene {
    /// The contact that applies: what the scene says of it, or that of triangles in a scene of fabric that says nothing. `None` for none.
    #[must_use]
    pub fn contact_chosen(&self) -> Option<SceneContact> {
        let solver = self.simulation.solver_given();
        let has_fabric =
            || self.cloths.iter().any(|cloth| cloth.model_chosen() == SceneModel::Fabric);
        let is_network = |geometry: &SceneGeometry| matches!(geometry, SceneGeometry::Network(_));
        // A network has no triangles that could touch, and the midpoint integrator has no contact of triangles.
        let touches = || {
            solver != Some(SceneSolver::Midpoint)
                && has_fabric()
                && !self.cloths.iter().any(|cloth| is_network(&cloth.geometry))
        };
        match &self.contact {
            Some(contact) => {
                (contact.response != SceneContactResponse::None).then(|| contact.clone())
            }
            None => touches().then(SceneContact::default),
        }
    }
}

/// What becomes of cloth that bodies pinch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ScenePinch {
    /// The run ends with the place and the name of the body.
    #[default]
    Refuse,
    /// It is left inside of the bodies, held between their faces, until they have parted, and counted.
    Ghost,
}

impl ScenePinch {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// What cloth does to cloth that it touches. Impulses and penalties act between points, the particles, which what is thinner than they
/// are apart can slip through; triangles cannot be passed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneContactResponse {
    /// Nothing: cloth goes through itself and through other cloth, and acts on colliders by its particles alone.
    None,
    /// Approaching pairs exchange momentum, overlap is pushed apart. Pairs that are joined by a
    /// spring, or start closer than the contact distance, are left out.
    Impulse {
        /// Coefficient of restitution, 0 (the default) to 1.
        #[serde(default)]
        #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
        restitution: f64,
        /// Coulomb friction coefficient between cloths; 0 if not given.
        #[serde(default)]
        #[cfg_attr(test, schemars(range(min = 0.0)))]
        friction: f64,
    },
    /// A spring with a damper between each pair in contact, no pair left out.
    Penalty {
        /// Stiffness \[N/m\].
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        stiffness: f64,
        /// Damping along the normal \[N s/m\]; 0 if not given.
        #[serde(default)]
        #[cfg_attr(test, schemars(range(min = 0.0)))]
        damping: f64,
    },
    /// Triangles push each other apart, rub, and are proven in every substep not to have gone through each other. So are
    /// the faces of all colliders, and planes: meshes are then exact, may be open, and need no distances. What is closer than
    /// the contact distance within a cloth at the start, such as triangles next to each other, pushes only once it comes closer than nine
    /// tenths of that.
    Triangles {
        /// Coulomb friction coefficient between cloths; 0 if not given.
        #[serde(default)]
        #[cfg_attr(test, schemars(range(min = 0.0)))]
        friction: f64,
    },
}

impl Default for SceneContactResponse {
    /// Cotton on cotton slides less, polyester more.
    fn default() -> Self {
        Self::Triangles { friction: 0.3 }
    }
}
