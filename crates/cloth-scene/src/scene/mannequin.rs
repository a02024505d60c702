//! Mannequins, which wear garments.

use serde::{Deserialize, Serialize};

/// A mannequin of given measures, as in the shop of a tailor: a closed smooth mesh of a body with a head, arms and legs. It stands with its soles on
/// z = 0 and looks along -y, so that its left is at positive x. Girths are what a tape reads. A measure that is not given is in proportion to the height.
/// Not in poses beside rigid bodies, which would not feel it change.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMannequin {
    /// From the soles to the crown \[m\]; 1.72 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 1.4, max = 2.1)))]
    pub height: Option<f64>,
    /// Girth of the neck \[m\]; 0.36 of a height of 1.72.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.28, max = 0.5)))]
    pub neck: Option<f64>,
    /// Girth of the chest \[m\]; 0.92 of a height of 1.72.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.7, max = 1.4)))]
    pub chest: Option<f64>,
    /// Girth of the waist \[m\], at most 1.2 times that of the chest and 1.15 times that of the hips; 0.76 of a height of 1.72.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.55, max = 1.4)))]
    pub waist: Option<f64>,
    /// Girth of the hips \[m\]; 0.96 of a height of 1.72.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.75, max = 1.5)))]
    pub hips: Option<f64>,
    /// Breadth of the shoulders, from one acromion to the other \[m\]; 0.38 of a height of 1.72.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.3, max = 0.5)))]
    pub shoulders: Option<f64>,
    /// Mean length of the edges of its triangles \[m\]; 0.02 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.005, max = 0.03)))]
    pub edge: Option<f64>,
    /// Its poses, times ascending. Until the first one it is as there, after the last one it keeps still; between two, angles begin and end at rest. If there
    /// are none it stands with its arms 45 degrees from the vertical.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pose: Vec<SceneMannequinPose>,
    /// Meshes for a second of its motion \[1/s\], between which vertices go in straight lines; 30 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub rate: Option<f64>,
    /// Samples of the distance along the longest side, 4 to 400, where contact is not of triangles; 64 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 4, max = 400)))]
    pub cells: Option<u32>,
}

/// The angles of the joints of a mannequin at one time \[degrees\]. Those that are not given are those of the pose before, at first of the one at rest.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMannequinPose {
    /// When \[s\]; 0 if not given.
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub time: f64,
    /// Where the left upper arm points; at rest raised by 45 degrees, sideways.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shoulder_left: Option<SceneMannequinSwing>,
    /// Where the right upper arm points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shoulder_right: Option<SceneMannequinSwing>,
    /// How far the left forearm is bent to the front; 0 is straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 140.0)))]
    pub elbow_left: Option<f64>,
    /// How far the right forearm is bent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 140.0)))]
    pub elbow_right: Option<f64>,
    /// Where the left thigh points; at rest straight down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hip_left: Option<SceneMannequinSwing>,
    /// Where the right thigh points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hip_right: Option<SceneMannequinSwing>,
    /// How far the left shin is bent to the back; 0 is straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 140.0)))]
    pub knee_left: Option<f64>,
    /// How far the right shin is bent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 140.0)))]
    pub knee_right: Option<f64>,
    /// How far the head is turned to the left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = -90.0, max = 90.0)))]
    pub head: Option<f64>,
}

/// The direction of a limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMannequinSwing {
    /// Angle from hanging straight down \[degrees\].
    #[cfg_attr(test, schemars(range(min = 0.0, max = 170.0)))]
    pub raise: f64,
    /// The plane in which it is raised \[degrees\]: 0 sideways, 90 forwards, -90 backwards; 0 if not given.
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = -90.0, max = 135.0)))]
    pub forwards: f64,
}
