//! From the schema to a page for people.

use std::{
    collections::HashSet,
    fmt::{Display, Write},
};

use serde_json::{Map, Value};

use super::generate::resolved;

const INTRODUCTION: &str = "\
# Scene files

Every key of a scene file in TOML, with its unit, default and bounds. This page is generated from the types that read \
the files; `cloth scenes --reference` prints it.

All quantities are in SI units, coordinates are right handed with z up. `cloth[]` is a table of which there can be \
several, `[[cloth]]` in the file. A key whose default is - can be left out. Where tables are called a choice, exactly \
one of their keys is given.

Editors complete and check the keys by the JSON schema that `cloth scenes --schema` prints. For those that use Taplo, \
such as the extension Even Better TOML, keep it in a file and name that in the first line of a scene:

```toml
#:schema ./scene.schema.json
```

[FYSL](FYSL.md) has the same in XML.
";

/// The page.
pub(super) fn reference(schema: &Value) -> String {
    let mut page = Page { root: schema, text: INTRODUCTION.to_owned(), seen: HashSet::new() };
    page.table("", &resolved(schema, schema));
    page.text
}

struct Page<'a> {
    root: &'a Value,
    text: String,
    /// Types that are on the page.
    seen: HashSet<String>,
}

impl Page<'_> {
    fn say(&mut self, text: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{text}");
    }

    /// A table at `path`, and all tables below it.
    fn table(&mut self, path: &str, schema: &Map<String, Value>) {
        let heading =
            if path.is_empty() { "The top of the file".into() } else { format!("`{path}`") };
        self.say(format!("\n## {heading}\n\n{}", description(schema)));
        self.keys(path, schema);
    }

    /// The keys of a table, in the order of the types, and the tables below.
    fn keys(&mut self, path: &str, schema: &Map<String, Value>) {
        let Some(keys) = schema.get("properties").and_then(Value::as_object) else { return };
        let required = |key: &str| {
            let list = schema.get("required").and_then(Value::as_array);
            list.is_some_and(|list| list.iter().any(|one| one == key))
        };
        self.say("\n| key | takes | unit | default | bounds | |\n|---|---|---|---|---|---|");
        let mut below = Vec::new();
        for (key, schema) in keys {
            let whole = resolved(self.root, schema);
            let default = match whole.get("default") {
                _ if required(key) => "must be given".to_owned(),
                Some(default) => printed(default),
                None => "-".to_owned(),
            };
            let (unit, text) = unit(&description(&whole));
            let row = [
                format!("`{key}`"),
                self.kind(&whole),
                unit,
                default,
                bounds(&whole),
                text.replace("\n\n", " ").replace("\n- ", " - ").replace('|', "\\|"),
            ];
            self.say(format!("| {} |", row.join(" | ")));
            below.push((key.clone(), schema.clone(), whole));
        }
        for (key, schema, whole) in below {
            let dot = if path.is_empty() { "" } else { "." };
            self.below(&format!("{path}{dot}{key}"), &schema, &whole);
        }
    }

    /// The tables that a key leads to.
    fn below(&mut self, path: &str, schema: &Value, whole: &Map<String, Value>) {
        if let Some(items) = whole.get("items").filter(|items| items.is_object()) {
            let inner = resolved(self.root, items);
            self.below(&format!("{path}[]"), items, &inner);
            return;
        }
        let choices = whole.get("oneOf").or(whole.get("anyOf")).and_then(Value::as_array);
        let tables = choices
            .is_some_and(|choices| choices.iter().any(|choice| choice.get("properties").is_some()));
        if whole.get("properties").is_none() && !tables {
            return;
        }
        let name = name_of(schema);
        if !name.is_empty() && !self.seen.insert(name) {
            return;
        }
        if whole.get("properties").is_some() {
            self.table(path, whole);
            return;
        }
        let choices = choices.cloned().unwrap_or_default();
        self.say(format!("\n## `{path}`: a choice\n\n{}", description(whole)));
        for choice in choices {
            let choice = resolved(self.root, &choice);
            if choice.contains_key("properties") {
                if !description(&choice).is_empty() {
                    self.say(format!("\n{}", description(&choice)));
                }
                self.keys(path, &choice);
            } else {
                let words = self.kind(&choice);
                self.say(format!("\n{words}: {}", description(&choice)));
            }
        }
    }

    /// What a key takes, in words.
    fn kind(&self, schema: &Map<String, Value>) -> String {
        if let Some(words) = schema.get("enum").and_then(Value::as_array) {
            return words.iter().map(printed).collect::<Vec<_>>().join(" or ");
        }
        if let Some(word) = schema.get("const") {
            return printed(word);
        }
        if let Some(choices) = schema.get("oneOf").or(schema.get("anyOf")).and_then(Value::as_array)
        {
            let kinds = choices.iter().map(|choice| match choice.get("properties") {
                Some(Value::Object(keys)) => {
                    let keys: Vec<_> = keys.keys().map(|key| format!("`{key}`")).collect();
                    format!("a table with {}", keys.join(", "))
                }
                _ => self.kind(&resolved(self.root, choice)),
            });
            return kinds.collect::<Vec<_>>().join(" or ");
        }
        match schema.get("type").and_then(Value::as_str).unwrap_or_default() {
            "number" => "number".into(),
            "integer" => "whole number".into(),
            "string" => "text".into(),
            "boolean" => "`true` or `false`".into(),
            "array" => {
                let items = resolved(self.root, schema.get("items").unwrap_or(&Value::Null));
                let kind = self.kind(&items);
                match schema.get("maxItems").and_then(Value::as_u64) {
                    Some(count) => format!("{count} x {kind}"),
                    None => format!("list of: {kind}"),
                }
            }
            _ => "table".into(),
        }
    }
}

/// The type that a schema refers to.
fn name_of(schema: &Value) -> String {
    let reference = schema.get("$ref").or_else(|| schema.pointer("/allOf/0/$ref"));
    reference.and_then(Value::as_str).unwrap_or_default().to_owned()
}

fn description(schema: &Map<String, Value>) -> String {
    schema.get("description").and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// The unit in brackets at the end of the words for a quantity, and the text without it.
fn unit(text: &str) -> (String, String) {
    let found = text.split_once(" [").and_then(|(before, rest)| {
        let (unit, after) = rest.split_once(']')?;
        Some((unit.to_owned(), format!("{before}{after}")))
    });
    found.unwrap_or_else(|| (String::new(), text.to_owned()))
}

/// A value as it stands in TOML.
fn printed(value: &Value) -> String {
    match value {
        Value::Object(_) => "its own".to_owned(),
        Value::Array(list) if list.is_empty() => "none".to_owned(),
        Value::Array(list) => {
            let list: Vec<_> = list.iter().map(|one| one.to_string().replace('"', "")).collect();
            format!("({})", list.join(", "))
        }
        Value::String(text) if text.is_empty() => "none".to_owned(),
        Value::String(text) => format!("`{text}`"),
        other => other.to_string(),
    }
}

fn bounds(schema: &Map<String, Value>) -> String {
    let words = [
        ("exclusiveMinimum", "above"),
        ("minimum", "at least"),
        ("exclusiveMaximum", "below"),
        ("maximum", "at most"),
    ];
    let said = words.iter().filter_map(|(key, word)| Some(format!("{word} {}", schema.get(*key)?)));
    said.collect::<Vec<_>>().join(", ")
}
