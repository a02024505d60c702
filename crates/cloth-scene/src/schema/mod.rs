//! What scene files can say, for editors and for people.
//!
//! Both are generated from the types of a scene by a test of this module, which fails when they are no longer what
//! the types say; `CLOTH_UPDATE=1 cargo test -p cloth-scene --lib schema` writes them anew. Programs that read
//! scenes need nothing of what generates them.

#[cfg(test)]
mod bounds;
#[cfg(test)]
mod everything;
#[cfg(test)]
mod generate;
#[cfg(test)]
mod markdown;

/// The JSON Schema (draft 7) of scene files in TOML: keys, kinds, defaults, bounds and descriptions.
#[must_use]
pub const fn scene_schema() -> &'static str {
    include_str!("../../scene.schema.json")
}

/// The reference of scene files in TOML, as Markdown: the same in tables.
#[must_use]
pub const fn scene_reference() -> &'static str {
    include_str!("../../SCENES.md")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{generate, markdown, scene_reference, scene_schema};

    /// Compares a kept file with what it should be, or writes it if that is wished.
    fn kept(file: &str, found: &str, wanted: &str) {
        if std::env::var_os("CLOTH_UPDATE").is_some() {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
            std::fs::write(path, wanted).unwrap();
        } else {
            let different = found.lines().zip(wanted.lines()).position(|(a, b)| a != b);
            assert!(
                found == wanted,
                "{file} is not what the types say, from line {} on: CLOTH_UPDATE=1 cargo test \
                 -p cloth-scene --lib schema",
                different.unwrap_or(found.lines().count().min(wanted.lines().count())) + 1
            );
        }
    }

    #[test]
    fn the_schema_is_that_of_the_types() {
        let schema = serde_json::to_string_pretty(&generate::schema()).unwrap() + "\n";
        kept("scene.schema.json", scene_schema(), &schema);
    }

    #[test]
    fn the_reference_is_that_of_the_types() {
        kept("SCENES.md", scene_reference(), &markdown::reference(&generate::schema()));
    }
}
