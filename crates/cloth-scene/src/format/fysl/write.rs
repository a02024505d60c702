//! From a scene to XML.

use toml::{Table, Value};

use crate::{Scene, SceneError};

use super::{
    FyslFeedback,
    schema::{Attribute, Element, Kind, ROOT, Target},
    value,
};

impl Scene {
    /// The scene as FYSL; [`Scene::from_fysl`] gives an equal scene back.
    ///
    /// # Errors
    /// [`SceneError::Write`] for names that XML cannot hold, or that contain a comma where they stand in
    /// a list.
    pub fn to_fysl(&self) -> Result<String, SceneError> {
        self.to_fysl_with(&FyslFeedback::default())
    }

    /// The scene as FYSL, with what the engine made of it.
    ///
    /// # Errors
    /// As [`Self::to_fysl`].
    pub fn to_fysl_with(&self, feedback: &FyslFeedback) -> Result<String, SceneError> {
        let fail = |problem: String| SceneError::Write { name: self.name.clone(), problem };
        let mut table = Table::try_from(self).map_err(|error| fail(error.to_string()))?;
        if !feedback.frames.is_empty() {
            let feedback = Table::try_from(feedback).map_err(|error| fail(error.to_string()))?;
            table.insert("feedback".into(), Value::Table(feedback));
        }
        let mut writer = Writer {
            text: String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"),
            root: table,
        };
        let mut root = std::mem::take(&mut writer.root);
        let arrays: Vec<_> = ["field", "event", "cloth", "rigid", "collider", "rigid_joint"]
            .map(str::to_owned)
            .to_vec();
        writer.root = arrays.into_iter().filter_map(|key| root.remove_entry(&key)).collect();
        writer.element(&ROOT, &mut root, 0, None).map_err(fail)?;
        root.extend(std::mem::take(&mut writer.root));
        leftover(&root)
            .map_or(Ok(writer.text), |key| Err(fail(format!("FYSL has no words for `{key}`"))))
    }
}

struct Writer {
    text: String,
    /// Arrays of the scene that elements anywhere take from.
    root: Table,
}

impl Writer {
    /// Writes an element with what it finds in `table`, and takes that out.
    fn element(
        &mut self,
        schema: &'static Element,
        table: &mut Table,
        depth: usize,
        id: Option<usize>,
    ) -> Result<(), String> {
        let before = self.text.len();
        let indent = "  ".repeat(depth);
        self.text += &format!("{indent}<{}", schema.tag);
        let opened = self.text.len();
        for attribute in schema.attributes {
            self.attribute(attribute, table, id)?;
        }
        if let Some((key, _)) = schema.constant {
            table.remove(key);
        }
        let empty = self.text.len() == opened && schema.constant.is_none();
        if let Some((key, kind)) = schema.text {
            let Some(text) = take(table, key) else {
                self.text.truncate(before);
                return Ok(());
            };
            let text = value::print(kind, &text).ok_or_else(|| unspeakable(key))?;
            let text = escaped(&text, false)?;
            self.text += &format!(">{text}</{}>\n", schema.tag);
            return Ok(());
        }
        self.text += ">\n";
        let inside = self.text.len();
        self.children(schema, table, depth + 1)?;
        if self.text.len() > inside {
            self.text += &format!("{indent}</{}>\n", schema.tag);
        } else if empty && matches!(schema.target, Target::Inline) {
            self.text.truncate(before);
        } else {
            self.text.truncate(inside - 2);
            self.text += "/>\n";
        }
        Ok(())
    }

    fn attribute(
        &mut self,
        attribute: &Attribute,
        table: &mut Table,
        id: Option<usize>,
    ) -> Result<(), String> {
        let text = match (attribute.kind, attribute.key) {
            (Kind::Id, _) => id.map(|id| id.to_string()),
            (Kind::Matrix, _) => None,
            (Kind::Word(words), "") if attribute.required => words.first().map(|&w| w.to_owned()),
            (_, "") => None,
            // A choice that a word does not name is written as a child.
            (Kind::Word(_), key) if table.get(key).is_some_and(Value::is_table) => None,
            (kind, key) => match take(table, key) {
                Some(value) => Some(value::print(kind, &value).ok_or_else(|| unspeakable(key))?),
                None => None,
            },
        };
        if let Some(text) = text {
            self.text += &format!(" {}=\"{}\"", attribute.name, escaped(&text, true)?);
        }
        Ok(())
    }

    fn children(
        &mut self,
        schema: &'static Element,
        table: &mut Table,
        depth: usize,
    ) -> Result<(), String> {
        let mut id = 0;
        for &child in schema.children {
            match child.target {
                Target::Inline => self.element(child, table, depth, None)?,
                Target::Table(key) => {
                    let Some(inner) = take(table, key) else { continue };
                    let Value::Table(mut inner) = inner else { return Err(unspeakable(key)) };
                    // A mesh has one element for a file and another one for vertices.
                    if !matches(child, "", &inner) {
                        put_back(table, key, inner);
                        continue;
                    }
                    self.element(child, &mut inner, depth, None)?;
                    // What other elements have words for goes back.
                    if !inner.is_empty() {
                        put_back(table, key, inner);
                    }
                }
                Target::Item(key, _) => {
                    let found = match key.strip_prefix('/') {
                        Some(key) => self.root.remove(key),
                        None => table.remove(key),
                    };
                    let Some(Value::Array(items)) = found else { continue };
                    for item in items {
                        let Value::Table(item) = item else { return Err(unspeakable(key)) };
                        id += 1;
                        self.item(schema, key, item, (depth, id))?;
                    }
                }
                Target::Value(key) => {
                    let Some(Value::Array(values)) = table.remove(key) else { continue };
                    for (index, value) in values.iter().enumerate() {
                        let text =
                            value::print(Kind::Vector, value).ok_or_else(|| unspeakable(key))?;
                        let indent = "  ".repeat(depth);
                        let number = index + 1;
                        self.text += &format!(
                            "{indent}<{} id=\"{number}\" position=\"{text}\"/>\n",
                            child.tag
                        );
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes a table of an array as that child of `schema` whose keys it has.
    fn item(
        &mut self,
        schema: &'static Element,
        key: &str,
        mut item: Table,
        (depth, id): (usize, usize),
    ) -> Result<(), String> {
        for &child in schema.children {
            let Target::Item(own, wrapper) = child.target else { continue };
            if own != key || !matches(child, wrapper, &item) {
                continue;
            }
            let mut inner = match item.remove(wrapper) {
                Some(Value::Table(inner)) => inner,
                _ => std::mem::take(&mut item),
            };
            self.element(child, &mut inner, depth, Some(id))?;
            item.extend(inner);
            return leftover(&item)
                .map_or(Ok(()), |key| Err(format!("FYSL has no words for `{key}`")));
        }
        Err(unspeakable(key))
    }
}

/// Whether an element has words for an item.
fn matches(schema: &Element, wrapper: &str, item: &Table) -> bool {
    let inner = match (wrapper, item.get(wrapper)) {
        ("", _) => item,
        (_, Some(Value::Table(inner))) => inner,
        _ => return false,
    };
    let required = schema.attributes.iter().filter(|attribute| attribute.required);
    required.map(|attribute| attribute.key).filter(|key| !key.is_empty()).all(|key| has(inner, key))
        && schema.text.is_none_or(|(key, _)| has(inner, key))
        && (!matches!(schema.target, Target::Table(_))
            || schema.needs.iter().all(|(key, _)| has(inner, key)))
        && schema
            .constant
            .is_none_or(|(key, value)| inner.get(key).and_then(Value::as_str) == Some(value))
}

fn has(table: &Table, path: &str) -> bool {
    match path.split_once('.') {
        Some((first, rest)) => {
            matches!(table.get(first), Some(Value::Table(inner)) if has(inner, rest))
        }
        None => table.contains_key(path),
    }
}

/// Takes the value at a path out, and the tables that are empty then.
fn take(table: &mut Table, path: &str) -> Option<Value> {
    let Some((first, rest)) = path.split_once('.') else { return table.remove(path) };
    let Some(Value::Table(inner)) = table.get_mut(first) else { return None };
    let value = take(inner, rest);
    if inner.is_empty() {
        table.remove(first);
    }
    value
}

fn put_back(table: &mut Table, path: &str, value: Table) {
    match path.split_once('.') {
        Some((first, rest)) => {
            let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                put_back(inner, rest, value);
            }
        }
        None => {
            table.insert(path.into(), Value::Table(value));
        }
    }
}

/// A key whose value was not written.
fn leftover(table: &Table) -> Option<String> {
    table.iter().find_map(|(key, value)| match value {
        Value::Table(inner) if inner.is_empty() => None,
        Value::Array(inner) if inner.is_empty() => None,
        Value::Table(inner) => leftover(inner).map(|rest| format!("{key}.{rest}")),
        _ => Some(key.clone()),
    })
}

fn unspeakable(key: &str) -> String {
    format!("FYSL has no words for this value of `{key}`")
}

/// Text as XML holds it; white space in attributes would be read as blanks.
fn escaped(text: &str, is_attribute: bool) -> Result<String, String> {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' if is_attribute => escaped += "&quot;",
            '\r' => escaped += "&#13;",
            '\n' if is_attribute => escaped += "&#10;",
            '\t' if is_attribute => escaped += "&#9;",
            '\n' | '\t' => escaped.push(character),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => {
                return Err(format!("XML cannot hold the character {character:?}"));
            }
            _ => escaped.push(character),
        }
    }
    Ok(escaped)
}
