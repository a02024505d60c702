//! Scenes in TOML and FYSL: read, written, compiled, and computed for a frame if that is little work.

use std::sync::LazyLock;

use cloth::{
    Simulation, picture_style,
    scene::{CompileOptions, CompiledScene, Scene, builtin_scenes, fysl::FyslFeedback},
    topology,
};
use fastrand::Rng;
use serde_json::Value;

use super::{FOLDER, backend};
use crate::mutate::{any, elements, text, tree};

/// Memory that a scene may say that it needs \[byte\]; an input may take more than this, but by its length.
const MEMORY: u64 = 24 << 20;
/// Particles, and particles times substeps, up to which a frame is computed.
const PARTICLES: usize = 400;
const WORK: f64 = 3e5;

const TOML_WORDS: [&str; 34] = [
    "name = ",
    "[[cloth]]\n",
    "[[collider]]\n",
    "[[rigid]]\n",
    "[[event]]\n",
    "[[field]]\n",
    "[simulation]\n",
    "[contact]\n",
    "frames",
    "frames_per_second",
    "time_step",
    "solver = \"implicit\"",
    "solver = \"semi-implicit\"",
    "precision = \"f64\"",
    "geometry.grid",
    "columns",
    "rows",
    "spacing",
    "pins",
    "\"corners\"",
    "\"all\"",
    "motion",
    "rotation",
    "radius",
    "stiffness",
    "damping",
    "distance",
    "response.penalty",
    "response.impulse",
    "true",
    "false",
    "1979-05-27",
    "\"\"\"",
    "'''",
];
const FYSL_WORDS: [&str; 24] = [
    "<group ",
    "<particles ",
    "<particle ",
    "<joint ",
    "<fabric ",
    "<rigidbody ",
    "<scene ",
    "<actors>",
    "</actors>",
    "id=\"1\"",
    "width=\"2\"",
    "height=\"2\"",
    "position=\"0 0 0\"",
    "type=\"stretch\"",
    "preset=\"denim\"",
    "mass=\"1\"",
    "&lt;",
    "&#0;",
    "&x;",
    "<![CDATA[",
    "]]>",
    "<!-- ",
    "-->",
    "xmlns=\"a\"",
];

/// Scenes that together use every key: those that the tests of their schema keep, as Rust has raw strings.
static EVERYTHING: LazyLock<Vec<String>> = LazyLock::new(|| {
    let source = include_str!("../../../crates/cloth-scene/src/schema/everything.rs");
    let parts = source.split("r##\"").skip(1);
    let texts: Vec<String> =
        parts.filter_map(|part| Some(part.split_once("\"##,")?.0.to_owned())).collect();
    assert!(texts.len() >= 4, "the scenes of the schema are kept in another way");
    texts
});

static TOML: LazyLock<Vec<String>> = LazyLock::new(|| {
    let built_in = builtin_scenes().iter().filter(|scene| scene.extension == "toml");
    built_in.map(|scene| scene.text.to_owned()).chain(EVERYTHING.iter().cloned()).collect()
});

/// The same as trees.
static TREES: LazyLock<Vec<Value>> = LazyLock::new(|| {
    let table = |text: &String| toml::from_str::<toml::Table>(text).ok();
    TOML.iter().filter_map(|text| serde_json::to_value(table(text)?).ok()).collect()
});

static FYSL: LazyLock<Vec<String>> = LazyLock::new(|| {
    let built_in = builtin_scenes().iter().filter(|scene| scene.extension == "fysl");
    let written = EVERYTHING.iter().filter_map(|text| {
        let mut scene = Scene::from_toml(text, "seed.toml").ok()?;
        // What FYSL cannot say is left out, rather than the whole scene.
        scene.simulation.adaptive = None;
        scene.to_fysl().ok()
    });
    built_in.map(|scene| scene.text.to_owned()).chain(written).collect()
});

pub(crate) fn toml_make(rng: &mut Rng) -> Vec<u8> {
    let made = if rng.bool() {
        without_null(tree::mutated(rng, &TREES))
    } else {
        text::mutated(rng, &TOML, &TOML_WORDS)
    };
    text::bytes(rng, made)
}

/// A tree as TOML, which knows no nothing; what cannot be written is left as JSON, which is no TOML.
fn without_null(mut tree: Value) -> String {
    fn replace(value: &mut Value) {
        match value {
            Value::Null => *value = Value::from("nan"),
            Value::Array(values) => values.iter_mut().for_each(replace),
            Value::Object(map) => map.iter_mut().for_each(|(_, value)| replace(value)),
            _ => {}
        }
    }
    replace(&mut tree);
    toml::to_string(&tree).unwrap_or_else(|_| tree.to_string()).replace("\"nan\"", "nan")
}

pub(crate) fn fysl_make(rng: &mut Rng) -> Vec<u8> {
    let made = match rng.u8(..3) {
        0 => {
            let seed = any(rng, FYSL.as_slice());
            elements::changed(rng, seed)
        }
        1 => {
            let changed = {
                let seed = any(rng, FYSL.as_slice());
                elements::changed(rng, seed)
            };
            text::changed(rng, &changed, &FYSL, &FYSL_WORDS)
        }
        _ => text::mutated(rng, &FYSL, &FYSL_WORDS),
    };
    text::bytes(rng, made)
}

pub(crate) fn toml_run(input: &[u8]) -> bool {
    let Some(text) = text_of(input, "input.toml") else { return false };
    is_sound(Scene::from_toml(text, "input.toml").ok())
}

pub(crate) fn fysl_run(input: &[u8]) -> bool {
    let Some(text) = text_of(input, "input.fysl") else { return false };
    // Whatever it says of frames that came back, it says in an error or not at all.
    let _ = FyslFeedback::from_fysl(text, "input.fysl");
    is_sound(Scene::from_fysl(text, "input.fysl").ok())
}

/// The input as text; what is none is refused where files are read.
fn text_of<'a>(input: &'a [u8], name: &str) -> Option<&'a str> {
    let text = std::str::from_utf8(input).ok();
    if text.is_none() {
        let path = FOLDER.path().join(name);
        let written = std::fs::write(&path, input);
        assert!(written.is_err() || Scene::read(&path).is_err(), "read what is no text");
    }
    text
}

/// Checks what is promised of scenes that are read, and computes a frame.
fn is_sound(scene: Option<Scene>) -> bool {
    let Some(mut scene) = scene else { return false };
    written_and_read(&scene);
    scene.origin.directory = FOLDER.path().to_owned();
    let options = CompileOptions { memory_limit: MEMORY, ..CompileOptions::default() };
    let Ok(compiled) = scene.compile(&options) else { return false };
    if let Ok(text) = scene.to_fysl() {
        let again = Scene::from_fysl(&text, "again.fysl");
        again.unwrap_or_else(|error| panic!("written as FYSL and not read: {error}"));
    }
    let topology = topology(&compiled);
    topology.check().unwrap_or_else(|error| panic!("its topology: {error}"));
    let style = picture_style(&compiled);
    let shown = compiled.solids.iter().filter(|solid| !solid.hidden).count();
    assert_eq!(style.shapes.at(0.0).len(), shown, "solids in pictures");
    assert_eq!(compiled.solids.len(), compiled.model.colliders().len(), "solids of the scene");
    let _ = compiled.timeline.control(0);
    if is_little_work(&compiled) {
        lessened(&mut scene);
        if let Ok(compiled) = scene.compile(&options)
            && let Ok(mut simulation) = Simulation::new(compiled, backend())
        {
            let _ = simulation.step();
            let _ = simulation.audit();
        }
    }
    true
}

/// A run keeps its scene in its folder, and goes on with what it reads there.
fn written_and_read(scene: &Scene) {
    if let Ok(text) = scene.to_toml() {
        let again = Scene::from_toml(&text, "again.toml");
        let again = again.unwrap_or_else(|error| panic!("written and not read: {error}"));
        assert_eq!(again.to_toml().ok().as_ref(), Some(&text), "another scene comes back");
    }
}

fn is_little_work(compiled: &CompiledScene) -> bool {
    let particles = compiled.model.particle_count();
    let substeps = 1.0 / (compiled.frames_per_second * compiled.config.time_step);
    particles <= PARTICLES && compiled.rigids.len() <= 20 && substeps * particles as f64 <= WORK
}

/// Takes back the iterations that a scene asks for: who asks for many waits for them.
fn lessened(scene: &mut Scene) {
    let simulation = &mut scene.simulation;
    let implicit = &mut simulation.implicit;
    implicit.iterations = implicit.iterations.min(50);
    implicit.newton_iterations = implicit.newton_iterations.min(3);
    implicit.constraint_passes = implicit.constraint_passes.min(3);
    if let Some(limit) = &mut simulation.strain_limit {
        limit.sweeps = limit.sweeps.min(10);
    }
    if let Some(adaptive) = &mut simulation.adaptive {
        adaptive.halvings = adaptive.halvings.min(3);
    }
}
