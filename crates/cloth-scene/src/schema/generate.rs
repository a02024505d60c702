//! From the types of a scene to a JSON Schema.

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

use crate::Scene;

/// The schema of a scene.
pub(super) fn schema() -> Value {
    // The draft that editors of TOML know.
    let generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.into_root_schema_for::<Scene>().to_value();
    tidy(&mut schema);
    schema
}

/// Takes out what TOML does not have, and what is said for readers of the code.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Object(object) => {
            nothing_is_no_value(object);
            if let Some(Value::String(description)) = object.get_mut("description") {
                *description = plain(description);
            }
            // Names of number types of other languages.
            object.remove("format");
            // Whole numbers are written without a point, in bounds, too.
            for bound in ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"] {
                if let Some(number) = object.get(bound).and_then(Value::as_f64)
                    && number.fract() == 0.0
                {
                    object.insert(bound.into(), Value::from(number as i64));
                }
            }
            object.values_mut().for_each(tidy);
        }
        Value::Array(array) => array.iter_mut().for_each(tidy),
        _ => {}
    }
}

/// A key of TOML is absent, never null.
fn nothing_is_no_value(object: &mut Map<String, Value>) {
    if object.get("default") == Some(&Value::Null) {
        object.remove("default");
    }
    if let Some(Value::Array(kinds)) = object.get_mut("type") {
        kinds.retain(|kind| kind != "null");
        if let [kind] = &kinds[..] {
            let kind = kind.clone();
            object.insert("type".into(), kind);
        }
    }
    if let Some(Value::Array(words)) = object.get_mut("enum") {
        words.retain(|word| !word.is_null());
    }
    if let Some(Value::Array(mut choices)) = object.remove("anyOf") {
        choices.retain(|choice| choice["type"] != "null");
        if choices.len() == 1 {
            // With what is said beside it, a reference has to stand in a list of its own in this draft.
            object.insert("allOf".into(), Value::Array(choices));
        } else {
            object.insert("anyOf".into(), Value::Array(choices));
        }
    }
}

/// A comment of the code as text: links keep their words, brackets lose their backslashes, lines are joined.
fn plain(comment: &str) -> String {
    let mut text = String::with_capacity(comment.len());
    let mut rest = comment;
    while let Some(start) = rest.find("[`") {
        text += &rest[..start];
        rest = &rest[start + 1..];
        let Some(end) = rest.find("`]") else { break };
        text += &rest[..=end];
        rest = &rest[end + 2..];
        if let Some(target) = rest.strip_prefix('(') {
            rest = target.split_once(')').map_or("", |(_, rest)| rest);
        }
    }
    text += rest;
    let text = text.replace("\\[", "[").replace("\\]", "]");
    let paragraphs = text.split("\n\n").map(|paragraph| {
        let lines = paragraph.lines();
        let is_list = paragraph.contains("\n- ") || paragraph.starts_with("- ");
        lines.collect::<Vec<_>>().join(if is_list { "\n" } else { " " })
    });
    paragraphs.collect::<Vec<_>>().join("\n\n")
}

/// The schema that stands behind references, with what is said where they stand.
pub(super) fn resolved(root: &Value, schema: &Value) -> Map<String, Value> {
    let mut found = schema.as_object().cloned().unwrap_or_default();
    let mut behind = Vec::new();
    if let Some(reference) = found.remove("$ref") {
        behind.push(reference);
    }
    if let Some(Value::Array(all)) = found.remove("allOf") {
        behind.extend(all.into_iter().filter_map(|one| one.get("$ref").cloned()));
    }
    for reference in behind {
        let pointer = reference.as_str().unwrap_or_default().trim_start_matches('#');
        let target = root.pointer(pointer).unwrap_or_else(|| panic!("{pointer} leads nowhere"));
        for (key, value) in resolved(root, target) {
            found.entry(key).or_insert(value);
        }
    }
    found
}

#[test]
fn comments_become_plain_text() {
    let comment = "Mass \\[kg\\], see\n[`Mass`](a::b).\n\n- one\n- two [`B`]";
    assert_eq!(plain(comment), "Mass [kg], see `Mass`.\n\n- one\n- two `B`");
}
