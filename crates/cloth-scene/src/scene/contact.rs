//! Contact of cloths with themselves and each other.

use serde::{Deserialize, Serialize};

/// Contact between the particles of all cloths.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneContact {
    /// Distance of two particles below which they are in contact \[m\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub distance: f64,
    /// What contact does; impulses with a friction of 0.3 if not given.
    #[serde(default)]
    pub response: SceneContactResponse,
}

/// What two particles in contact do to each other.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneContactResponse {
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
}

impl Default for SceneContactResponse {
    /// Cotton on cotton slides less, polyester more.
    fn default() -> Self {
        Self::Impulse { restitution: 0.0, friction: 0.3 }
    }
}
