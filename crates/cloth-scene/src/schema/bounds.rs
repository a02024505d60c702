//! Compares the schema with what scenes say and with what the compiler refuses.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde_json::{Map, Value};

use crate::{CompileOptions, Scene, builtin_scenes};

use super::{
    everything,
    generate::{resolved, schema},
};

/// A number of a scene and its schema.
struct Leaf {
    /// Where it is in the scene.
    pointer: String,
    schema: Map<String, Value>,
}

/// A walk through a scene by its schema.
struct Walk<'a> {
    root: &'a Value,
    leaves: Vec<Leaf>,
    /// Keys that were found, by where they are in the schema.
    keys: BTreeSet<String>,
    problems: Vec<String>,
}

impl Walk<'_> {
    fn value(&mut self, value: &Value, schema: &Value, pointer: &str, at: &str) {
        let schema = resolved(self.root, schema);
        if let Some(choices) = schema.get("oneOf").or(schema.get("anyOf")).and_then(Value::as_array)
        {
            let fitting = choices.iter().find(|choice| fits(self.root, value, choice));
            match fitting {
                Some(choice) => self.value(value, choice, pointer, at),
                None => self.problems.push(format!("{pointer}: none of the choices fits {value}")),
            }
            return;
        }
        if let Some(words) = schema.get("enum").and_then(Value::as_array)
            && !words.contains(value)
        {
            self.problems.push(format!("{pointer}: {value} is not in the schema"));
        }
        let kind = schema.get("type").and_then(Value::as_str).unwrap_or_default();
        if !is_of(value, kind) {
            self.problems.push(format!("{pointer}: {value} is no {kind}"));
        }
        match value {
            Value::Number(_) => {
                self.leaves.push(Leaf { pointer: pointer.to_owned(), schema });
            }
            Value::Array(items) => {
                let count = items.len() as u64;
                let limit = |name: &str| schema.get(name).and_then(Value::as_u64);
                if limit("minItems").is_some_and(|least| count < least)
                    || limit("maxItems").is_some_and(|most| count > most)
                {
                    self.problems.push(format!("{pointer}: {count} elements"));
                }
                let Some(inner) = schema.get("items") else { return };
                for (number, item) in items.iter().enumerate() {
                    self.value(item, inner, &format!("{pointer}/{number}"), at);
                }
            }
            Value::Object(table) => {
                let empty = Map::new();
                let known = schema.get("properties").and_then(Value::as_object).unwrap_or(&empty);
                for (key, value) in table {
                    let Some(inner) = known.get(key) else {
                        self.problems.push(format!("{pointer}: `{key}` is not in the schema"));
                        continue;
                    };
                    let at = format!("{at}.{key}");
                    self.keys.insert(at.clone());
                    self.value(value, inner, &format!("{pointer}/{key}"), &at);
                }
                let required = schema.get("required").and_then(Value::as_array);
                for key in required.into_iter().flatten().filter_map(Value::as_str) {
                    if !table.contains_key(key) {
                        self.problems.push(format!("{pointer}: no `{key}`"));
                    }
                }
            }
            _ => {}
        }
    }
}

/// Whether `choice` is meant: the kind of value, and for tables the one key that they have.
fn fits(root: &Value, value: &Value, choice: &Value) -> bool {
    let choice = resolved(root, choice);
    if let Some(words) = choice.get("enum").and_then(Value::as_array) {
        return words.contains(value);
    }
    if let Some(word) = choice.get("const") {
        return word == value;
    }
    let kind = choice.get("type").and_then(Value::as_str).unwrap_or_default();
    let has = |keys: &Map<String, Value>| keys.keys().any(|key| value.get(key).is_some());
    is_of(value, kind) && choice.get("properties").and_then(Value::as_object).is_none_or(has)
}

fn is_of(value: &Value, kind: &str) -> bool {
    match kind {
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => true,
    }
}

fn walk<'a>(root: &'a Value, scene: &Value) -> Walk<'a> {
    let mut walk = Walk { root, leaves: Vec::new(), keys: BTreeSet::new(), problems: Vec::new() };
    walk.value(scene, root, "", "");
    walk
}

/// All keys of the schema, by where they are.
fn keys(root: &Value, schema: &Value, at: &str, found: &mut BTreeSet<String>) {
    let schema = resolved(root, schema);
    for choices in ["oneOf", "anyOf"].iter().filter_map(|name| schema.get(*name)) {
        for choice in choices.as_array().into_iter().flatten() {
            keys(root, choice, at, found);
        }
    }
    if let Some(items) = schema.get("items") {
        keys(root, items, at, found);
    }
    for (key, inner) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
        let at = format!("{at}.{key}");
        found.insert(at.clone());
        keys(root, inner, &at, found);
    }
}

#[test]
fn every_key_of_the_schema_is_tried_and_every_scene_follows_it() {
    let root = schema();
    let mut tried = BTreeSet::new();
    let builtin = builtin_scenes()
        .iter()
        .map(|scene| serde_json::to_value(Scene::builtin(scene.name).unwrap()).unwrap());
    for scene in everything::scenes().into_iter().chain(builtin) {
        let walk = walk(&root, &scene);
        assert!(walk.problems.is_empty(), "{}: {:#?}", scene["name"], walk.problems);
        tried.extend(walk.keys);
    }
    let mut known = BTreeSet::new();
    keys(&root, &root, "", &mut known);
    let untried: Vec<_> = known.difference(&tried).collect();
    assert!(untried.is_empty(), "{untried:#?}");
    assert!(known.len() > 150, "only {} keys", known.len());
}

#[test]
fn the_schema_tells_what_is_wrong_with_a_scene() {
    let root = schema();
    let mut scene = everything::scenes()[0].clone();
    let cloth = scene.pointer_mut("/cloth/0").and_then(Value::as_object_mut).unwrap();
    cloth.remove("geometry");
    cloth.insert("colur".into(), "red".into());
    scene["gravity"] = Value::from(vec![0.0; 4]);
    scene["simulation"]["solver"] = "euler".into();
    let problems = walk(&root, &scene).problems.join("\n");
    for problem in ["no `geometry`", "`colur` is not", "/gravity: 4 elements", "/simulation/solver"]
    {
        assert!(problems.contains(problem), "{problem} is not in:\n{problems}");
    }
}

/// Compiles a scene, or says why it cannot be.
fn accepted(scene: &Value, directory: &std::path::Path) -> Result<(), String> {
    let table = toml::Table::try_from(scene).unwrap();
    let mut scene = Scene::deserialize(table).map_err(|error| error.to_string())?;
    scene.origin.directory = directory.to_path_buf();
    scene.compile(&CompileOptions::default()).map(|_| ()).map_err(|error| error.to_string())
}

/// Just inside the bounds that the schema gives a scene is compiled, just outside it is refused; and where there are
/// no bounds, none is missing.
#[test]
fn bounds_are_those_of_the_compiler() {
    let folder = tempfile::tempdir().unwrap();
    everything::meshes_write(folder.path());
    let root = schema();
    // What lies within its bounds and is refused because of something else in the scene.
    let depends = |pointer: &str, value: f64| {
        // Counts of particles, vertices or files that the scene has not got, or more of them than fit.
        let counts = [
            "/width", "/height", "/depth", "/from", "/to", "/frames", "/first", "/columns", "/rows",
        ];
        // A step of no length to speak of, a release that comes before, a thing of the wrong size.
        let sizes = ["/halvings", "/time_step", "/rigidity", "/cells", "/ratio"];
        counts.iter().chain(&sizes).any(|end| pointer.ends_with(end))
            || (pointer.contains("/pins/") && value != 0.0)
            || (pointer.contains("/limits/"))
            // Times that come one after the other, and the ends of an edge that there is.
            || (pointer.contains("/rise/") || pointer.contains("/close/") || pointer.contains("/edge/"))
            || (pointer.contains("/vertices/")
                || pointer.contains("/faces/")
                || pointer.contains("/uv/")
                || pointer.contains("/uv_faces/")
                || pointer.contains("/positions/"))
            || (pointer.contains("axis/")
                || pointer.contains("/eye/")
                || pointer.contains("/target/"))
            || (pointer.contains("/half_extents/") || pointer.contains("/size/"))
            || pointer.ends_with("/stencil")
            // Girths that go together.
            || (pointer.contains("/mannequin/") && !pointer.contains("/pose/"))
            || pointer.contains("/normal/")
    };
    let mut edges = BTreeMap::new();
    let mut wrong = Vec::new();
    for scene in everything::scenes() {
        assert_eq!(accepted(&scene, folder.path()), Ok(()), "{}", scene["name"]);
        for Leaf { pointer, schema } in walk(&root, &scene).leaves {
            let whole = schema.get("type").and_then(Value::as_str) == Some("integer");
            let bound = |name: &str| schema.get(name).and_then(Value::as_f64);
            // Values, and whether the schema takes them.
            let mut trials: Vec<(f64, bool)> = Vec::new();
            match (bound("exclusiveMinimum"), bound("minimum")) {
                (Some(least), _) => trials.extend([(least, false), (least - 1.0, false)]),
                (None, Some(least)) => trials.extend([(least - 1.0, false), (least, true)]),
                (None, None) => trials.push((-1.0, true)),
            }
            match (bound("exclusiveMaximum"), bound("maximum")) {
                (Some(most), _) => trials.extend([(most, false), (most + 1.0, false)]),
                (None, Some(most)) => trials.extend([(most, true), (most + 1.0, false)]),
                (None, None) => {}
            }
            // What depends on the rest of the scene is not tried.
            trials.retain(|&(value, fits)| !(fits && depends(&pointer, value)));
            for (value, fits) in trials {
                let mut changed = scene.clone();
                *changed.pointer_mut(&pointer).unwrap() =
                    if whole { Value::from(value as i64) } else { Value::from(value) };
                let found = accepted(&changed, folder.path()).is_ok();
                edges.entry(pointer.clone()).and_modify(|count| *count += 1).or_insert(1);
                if found != fits {
                    let said =
                        if fits { "in bounds but refused" } else { "out of bounds but taken" };
                    wrong.push(format!("{} {pointer} = {value}: {said}", scene["name"]));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(edges.len() > 100, "only {} numbers were tried", edges.len());
}
