//! Scenes that come with the engine.

mod bench;

pub use bench::{BenchKind, bench_scene};

use crate::{Scene, SceneError, ScenePlace, error::SceneUnknown};

/// A scene that comes with the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinScene {
    /// Name by which it is chosen.
    pub name: &'static str,
    /// What it shows, in one line.
    pub summary: &'static str,
    /// Its text, with comments: the place to start for a scene of one's own.
    pub toml: &'static str,
}

const BUILTIN: &[BuiltinScene] = &[
    BuiltinScene {
        name: "flag",
        summary: "a flag on a pole in gusts of wind",
        toml: include_str!("../../scenes/flag.toml"),
    },
    BuiltinScene {
        name: "curtain",
        summary: "a curtain whose hooks let go one after the other",
        toml: include_str!("../../scenes/curtain.toml"),
    },
    BuiltinScene {
        name: "drape",
        summary: "a cloth falls over a ball and onto the floor",
        toml: include_str!("../../scenes/drape.toml"),
    },
    BuiltinScene {
        name: "stack",
        summary: "four cloths of different fabrics fall onto a box, one on top of the other",
        toml: include_str!("../../scenes/stack.toml"),
    },
    BuiltinScene {
        name: "patch-160",
        summary: "160 x 160 particles with self-contact over a ball, for work on performance",
        toml: include_str!("../../scenes/patch-160.toml"),
    },
    BuiltinScene {
        name: "bench-hang",
        summary: "benchmark: a patch of 160 x 160 particles hangs from two corners",
        toml: include_str!("../../scenes/bench-hang.toml"),
    },
    BuiltinScene {
        name: "bench-sphere",
        summary: "benchmark: a patch of 160 x 160 particles falls on a ball",
        toml: include_str!("../../scenes/bench-sphere.toml"),
    },
];

/// All scenes that come with the engine.
#[must_use]
pub const fn builtin_scenes() -> &'static [BuiltinScene] {
    BUILTIN
}

impl Scene {
    /// The built-in scene called `name`.
    ///
    /// # Errors
    /// [`SceneError::Unknown`] with the most similar name.
    pub fn builtin(name: &str) -> Result<Self, SceneError> {
        match BUILTIN.iter().find(|scene| scene.name == name) {
            Some(scene) => Self::from_toml(scene.toml, &format!("{name}.toml")),
            None => {
                let known = BUILTIN.iter().map(|scene| scene.name.to_owned()).collect();
                Err(SceneUnknown::error(ScenePlace::default(), "built-in scene", name, known))
            }
        }
    }
}
