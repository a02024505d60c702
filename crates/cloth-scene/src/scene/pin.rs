//! How a scene names the particles that it holds.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

/// One particle by its index, or several by a name or by what their mesh says of them.
///
/// Any cloth has the name `all`. A mesh has the names of its vertex groups. A grid, seen with its
/// column axis to the right and its row axis up, has
///
/// - edges: `left`, `right`, `bottom` (row 0), `top`, and `border` for the four together;
/// - corners: `bottom-left` (particle 0), `bottom-right`, `top-left`, `top-right`, and `corners`
///   for the four together;
/// - lines: `column-7`, `row-7`, counted from 0.
///
/// A mesh file can give its vertices numbers, in PLY as properties of the vertices, in glTF as
/// attributes such as `_PIN`, which is called `pin` here, and in both as colours, `red`, `green`, `blue`
/// and `alpha` from 0 to 1. `{ attribute = "pin", above = 0.5 }` are all vertices whose number is larger
/// than that.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum ScenePin {
    /// Index of a particle within its cloth, from 0.
    Index(u32),
    /// Name of a set of particles.
    Name(String),
    /// The vertices of a mesh with a large number.
    Attribute(ScenePinAttribute),
}

/// The vertices of a mesh whose attribute is larger than a bound.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePinAttribute {
    /// Name of the attribute in the mesh file.
    pub attribute: String,
    /// The bound; 0.5 if not given.
    #[serde(default = "half")]
    pub above: f64,
}

const fn half() -> f64 {
    0.5
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
            Self::Attribute(ScenePinAttribute { attribute, above }) => {
                write!(formatter, "`{attribute}` above {above}")
            }
        }
    }
}

// By hand, because the derived code for untagged enums cannot say what it expected.
impl<'de> Deserialize<'de> for ScenePin {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PinVisitor;

        impl<'de> de::Visitor<'de> for PinVisitor {
            type Value = ScenePin;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(
                    "the index of a particle or the name of a set of particles, or a table such as \
                     { attribute = \"pin\", above = 0.5 }",
                )
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

            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<ScenePin, A::Error> {
                let table = de::value::MapAccessDeserializer::new(map);
                ScenePinAttribute::deserialize(table).map(ScenePin::Attribute)
            }
        }

        deserializer.deserialize_any(PinVisitor)
    }
}
