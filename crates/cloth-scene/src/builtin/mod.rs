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
    pub text: &'static str,
    /// Language of the text, as the extension of a file: `toml` or `fysl`.
    pub extension: &'static str,
}

impl BuiltinScene {
    /// What one should see when it runs: the comment at the end of its text, as one paragraph.
    #[must_use]
    pub fn sight(&self) -> String {
        let comment = if self.extension == "fysl" {
            let end = self.text.rsplit_once("<!--").map_or("", |(_, end)| end);
            end.split("-->").next().unwrap_or_default().to_owned()
        } else {
            let lines: Vec<_> = self
                .text
                .trim_end()
                .lines()
                .rev()
                .map_while(|line| line.strip_prefix('#'))
                .collect();
            lines.into_iter().rev().collect::<Vec<_>>().join(" ")
        };
        let text = comment.split_whitespace().collect::<Vec<_>>().join(" ");
        text.strip_prefix("What to see: ").unwrap_or(&text).to_owned()
    }
}

const BUILTIN: &[BuiltinScene] = &[
    BuiltinScene {
        name: "flag",
        summary: "a flag on a pole in gusts of wind",
        extension: "toml",
        text: include_str!("../../scenes/flag.toml"),
    },
    BuiltinScene {
        name: "curtain",
        summary: "a curtain whose hooks let go one after the other",
        extension: "toml",
        text: include_str!("../../scenes/curtain.toml"),
    },
    BuiltinScene {
        name: "drape",
        summary: "a cloth falls over a ball and onto the floor",
        extension: "toml",
        text: include_str!("../../scenes/drape.toml"),
    },
    BuiltinScene {
        name: "tablecloth",
        summary: "a cotton tablecloth, of fabric as measured, on a round table",
        extension: "toml",
        text: include_str!("../../scenes/tablecloth.toml"),
    },
    BuiltinScene {
        name: "napkins",
        summary: "three napkins of different fabrics, as measured, over round stands",
        extension: "toml",
        text: include_str!("../../scenes/napkins.toml"),
    },
    BuiltinScene {
        name: "stack",
        summary: "four cloths of different fabrics fall onto a box, one on top of the other",
        extension: "toml",
        text: include_str!("../../scenes/stack.toml"),
    },
    BuiltinScene {
        name: "table",
        summary: "a table set with a tablecloth, a square and a runner, one on top of the other",
        extension: "toml",
        text: include_str!("../../scenes/table.toml"),
    },
    BuiltinScene {
        name: "layers",
        summary: "sheets fall on each other over a ball, and none goes through another",
        extension: "toml",
        text: include_str!("../../scenes/layers.toml"),
    },
    BuiltinScene {
        name: "patch-160",
        summary: "160 x 160 particles with self-contact over a ball, for work on performance",
        extension: "toml",
        text: include_str!("../../scenes/patch-160.toml"),
    },
    BuiltinScene {
        name: "bench-hang",
        summary: "benchmark: a patch of 160 x 160 particles hangs from two corners",
        extension: "toml",
        text: include_str!("../../scenes/bench-hang.toml"),
    },
    BuiltinScene {
        name: "bench-sphere",
        summary: "benchmark: a patch of 160 x 160 particles falls on a ball",
        extension: "toml",
        text: include_str!("../../scenes/bench-sphere.toml"),
    },
    BuiltinScene {
        name: "rigid-pair",
        summary: "two wedges of wood collide in the air and fall onto a sheet",
        extension: "fysl",
        text: include_str!("../../scenes/rigid-pair.fysl"),
    },
    BuiltinScene {
        name: "quad",
        summary: "a group of 2 x 2 particles swings from one corner",
        extension: "fysl",
        text: include_str!("../../scenes/quad.fysl"),
    },
    BuiltinScene {
        name: "ball-on-sheet",
        summary: "a ball falls into a sheet that hangs from its corners, and lifts its hem",
        extension: "fysl",
        text: include_str!("../../scenes/ball-on-sheet.fysl"),
    },
    BuiltinScene {
        name: "tornado",
        summary: "four flags in a procedural tornado that wanders between them",
        extension: "fysl",
        text: include_str!("../../scenes/tornado.fysl"),
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
            Some(BuiltinScene { text, extension: extension @ "fysl", .. }) => {
                Self::from_fysl(text, &format!("{name}.{extension}"))
            }
            Some(scene) => Self::from_toml(scene.text, &format!("{name}.toml")),
            None => {
                let known = BUILTIN.iter().map(|scene| scene.name.to_owned()).collect();
                Err(SceneUnknown::error(ScenePlace::default(), "built-in scene", name, known))
            }
        }
    }
}
