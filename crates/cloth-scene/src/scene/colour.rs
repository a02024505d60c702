//! Colours for pictures.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// An sRGB colour, in files as `"#c0392b"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(extend("pattern" = "^#[0-9a-fA-F]{6}$")))]
#[serde(try_from = "String", into = "String")]
pub struct SceneColour {
    /// Red, green and blue, 0 to 255.
    pub rgb: [u8; 3],
}

impl FromStr for SceneColour {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.strip_prefix('#')
            .filter(|digits| digits.len() == 6 && digits.bytes().all(|d| d.is_ascii_hexdigit()))
            .and_then(|digits| u32::from_str_radix(digits, 16).ok())
            .map(|value| {
                let [_, rgb @ ..] = value.to_be_bytes();
                Self { rgb }
            })
            .ok_or_else(|| format!("colour {text:?} is not understood: write it as \"#c0392b\""))
    }
}

impl fmt::Display for SceneColour {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.rgb;
        write!(formatter, "#{red:02x}{green:02x}{blue:02x}")
    }
}

impl TryFrom<String> for SceneColour {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<SceneColour> for String {
    fn from(colour: SceneColour) -> Self {
        colour.to_string()
    }
}
