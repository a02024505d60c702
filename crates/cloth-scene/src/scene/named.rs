//! Values of the engine that scene files know by name, for `serde(with)`.

use cloth_core::{LinearMethod, LinearStop, MatrixForm, Preconditioner, SemiImplicitSolve};
use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// A value with a name.
pub(super) trait Named: Copy + 'static {
    const NAMED: &'static [Self];

    fn word(self) -> &'static str;
}

macro_rules! named {
    ($($type:ty),+) => {
        $(impl Named for $type {
            const NAMED: &'static [Self] = Self::ALL;

            fn word(self) -> &'static str {
                self.name()
            }
        })+
    };
}

named!(LinearMethod, LinearStop, Preconditioner, MatrixForm, SemiImplicitSolve);

pub(super) fn serialize<T: Named, S: Serializer>(
    value: &T,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(value.word())
}

pub(super) fn deserialize<'de, T: Named, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<T, D::Error> {
    let word = String::deserialize(deserializer)?;
    T::NAMED.iter().copied().find(|value| value.word() == word).ok_or_else(|| {
        let known: Vec<_> = T::NAMED.iter().map(|value| format!("`{}`", value.word())).collect();
        // In the words that serde has for enums, so that it is answered in the same way.
        D::Error::custom(format!("unknown variant `{word}`, expected one of {}", known.join(", ")))
    })
}

/// The names of all values, for the schema.
#[cfg(test)]
pub(super) fn schema<T: Named>(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let names: Vec<_> = T::NAMED.iter().map(|value| value.word()).collect();
    schemars::json_schema!({ "type": "string", "enum": names })
}
