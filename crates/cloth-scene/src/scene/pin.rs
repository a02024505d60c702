//! How a scene names the particles that it holds.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

/// One particle by its index, or several by a name.
///
/// Any cloth has the name `all`. A mesh has the names of its vertex groups. A grid, seen with its
/// column axis to the right and its row axis up, has
///
/// - edges: `left`, `right`, `bottom` (row 0), `top`, and `border` for the four together;
/// - corners: `bottom-left` (particle 0), `bottom-right`, `top-left`, `top-right`, and `corners`
///   for the four together;
/// - lines: `column-7`, `row-7`, counted from 0.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum ScenePin {
    /// Index of a particle within its cloth, from 0.
    Index(u32),
    /// Name of a set of particles.
    Name(String),
}

impl From<u32> for ScenePin {
    fn from(index: u32) -> Self {
        Self::Index(index)
    }
}

impl From<&str> for ScenePin {
    fn from(name: &str) -> Self {
        Self::Name(name.into())
    }
}

impl fmt::Display for ScenePin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => index.fmt(formatter),
            Self::Name(name) => write!(formatter, "`{name}`"),
        }
    }
}

// By hand, because the derived code for untagged enums cannot say what it expected.
impl<'de> Deserialize<'de> for ScenePin {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PinVisitor;

        impl de::Visitor<'_> for PinVisitor {
            type Value = ScenePin;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the index of a particle or the name of a set of particles")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<ScenePin, E> {
                u32::try_from(value)
                    .map(ScenePin::Index)
                    .map_err(|_| E::invalid_value(de::Unexpected::Signed(value), &self))
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<ScenePin, E> {
                u32::try_from(value)
                    .map(ScenePin::Index)
                    .map_err(|_| E::invalid_value(de::Unexpected::Unsigned(value), &self))
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<ScenePin, E> {
                Ok(ScenePin::Name(name.into()))
            }
        }

        deserializer.deserialize_any(PinVisitor)
    }
}
