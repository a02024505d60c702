//! From XML to a scene.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use roxmltree::{Document, Node, ParsingOptions};
use toml::{Table, Value};

use crate::{Scene, SceneError, SceneOrigin, ScenePlace, error::SceneUnknown};

use super::{
    schema::{Element, Kind, ROOT, Target},
    value,
};
use crate::format::lines::Lines;

/// More than the largest mesh that belongs into a scene file.
const NODES_MAX: u32 = 4_000_000;
/// The language has five levels; more are refused before a parser sees them.
const DEPTH_MAX: usize = 64;

/// The tables of a text, and where their keys are.
pub(super) struct Tables {
    pub(super) scene: Table,
    pub(super) feedback: Table,
    pub(super) places: HashMap<String, (u32, u32)>,
}

impl Scene {
    /// Reads a scene from FYSL text. `file` is its name in messages, and meshes are looked for in the
    /// folder of that name.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] for text that is not XML, or uses more of XML than FYSL allows,
    /// [`SceneError::Unknown`] for elements and attributes that do not exist, [`SceneError::Value`] for
    /// values that make no sense; each with line and column.
    pub fn from_fysl(text: &str, file: &str) -> Result<Self, SceneError> {
        let tables = tables(text, file)?;
        let origin = SceneOrigin {
            file: file.into(),
            directory: Path::new(file).parent().map(Path::to_path_buf).unwrap_or_default(),
            places: tables.places,
        };
        let scene: Result<Self, _> = serde_path_to_error::deserialize(tables.scene);
        let mut scene = scene.map_err(|error| {
            let problem = error.inner().message().trim_end().replace('\n', ", ");
            // The words are those of the tables; the element that holds the value is named.
            let mut place = origin.place(&error.path().to_string());
            place.position = place.position.or(Some((1, 1)));
            SceneError::Syntax { place, problem }
        })?;
        scene.origin = origin;
        Ok(scene)
    }
}

/// Reads the text by the schema.
pub(super) fn tables(text: &str, file: &str) -> Result<Tables, SceneError> {
    let syntax = |position: (u32, u32), problem: String| SceneError::Syntax {
        place: ScenePlace { file: file.into(), position: Some(position) },
        problem,
    };
    let lines = Lines::new(text);
    if let Some(offset) = too_deep(text) {
        let problem = format!("elements are nested deeper than {DEPTH_MAX} levels");
        return Err(syntax(lines.position(offset), problem));
    }
    if let Some((offset, name)) = foreign_encoding(text) {
        let problem = format!("the text says that it is `{name}`, but is read as UTF-8");
        return Err(syntax(lines.position(offset), problem));
    }
    let options = ParsingOptions { allow_dtd: false, nodes_limit: NODES_MAX, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let at = error.pos();
        let message = error.to_string();
        // The position is said once, in our own form.
        let problem = message.split(" at ").next().unwrap_or(&message).replace('\n', " ");
        syntax((at.row, at.col), problem)
    })?;
    let mut reader = Reader { lines: &lines, file, rooted: Table::new(), places: HashMap::new() };
    let root = document.root_element();
    if root.tag_name().name() != ROOT.tag || root.tag_name().namespace().is_some() {
        let place = reader.place(root.range().start);
        let known = vec![ROOT.tag.to_owned()];
        return Err(SceneUnknown::error(place, "element", root.tag_name().name(), known));
    }
    let mut scene = reader.element(root, &ROOT, "", &Ids::new())?;
    let start = root.range().start;
    if !root.children().any(|child| child.has_tag_name("scene")) {
        return Err(reader.error(start, "<fysl> has no <scene>: add one"));
    }
    let rooted = std::mem::take(&mut reader.rooted);
    merge(&mut scene, rooted).map_err(|key| reader.twice(start, "fysl", &key))?;
    let feedback = match scene.remove("feedback") {
        Some(Value::Table(feedback)) => feedback,
        _ => Table::new(),
    };
    Ok(Tables { scene, feedback, places: reader.places })
}

/// Where an element is nested too deep, found without recursion and in one pass. Of text that is no XML it may
/// say anything, as the parser stops at the first error.
fn too_deep(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    let mut at = 0;
    while let Some(start) = text[at..].find('<').map(|step| at + step) {
        let tag = &text[start..];
        let after =
            |end: &str| tag.find(end).map_or(text.len(), |length| start + length + end.len());
        at = if tag.starts_with("<!--") {
            after("-->")
        } else if tag.starts_with("<![CDATA[") {
            after("]]>")
        } else if tag.starts_with("<?") {
            after("?>")
        } else if tag.starts_with("</") {
            depth = depth.saturating_sub(1);
            start + 2
        } else {
            let length = tag_length(tag);
            if !tag[..length].ends_with("/>") {
                depth += 1;
            }
            if depth > DEPTH_MAX {
                return Some(start);
            }
            start + length
        };
    }
    None
}

/// Bytes of a tag up to its `>`, or to the next `<`, which no tag holds. A `>` in quotes is part of a value.
fn tag_length(tag: &str) -> usize {
    let mut quote = None;
    for (offset, byte) in tag.bytes().enumerate().skip(1) {
        match (byte, quote) {
            (b'<', _) => return offset,
            (b'>', None) => return offset + 1,
            (b'"' | b'\'', None) => quote = Some(byte),
            (_, Some(open)) if open == byte => quote = None,
            _ => {}
        }
    }
    tag.len()
}

/// The encoding that the declaration names, if it is not UTF-8.
fn foreign_encoding(text: &str) -> Option<(usize, &str)> {
    let declaration = text.strip_prefix("<?xml")?.split("?>").next()?;
    let (_, value) = declaration.split_once("encoding")?;
    let value = value.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|quote| ['"', '\''].contains(quote))?;
    let name = value[1..].split(quote).next()?;
    let offset = name.as_ptr() as usize - text.as_ptr() as usize;
    let is_utf8 = name.eq_ignore_ascii_case("utf-8") || name.eq_ignore_ascii_case("us-ascii");
    (!is_utf8).then_some((offset, name))
}

/// The values of an element on the way into tables.
struct Reader<'a> {
    lines: &'a Lines<'a>,
    file: &'a str,
    /// Arrays of the scene that elements anywhere add to.
    rooted: Table,
    places: HashMap<String, (u32, u32)>,
}

/// Children of an element that are actors: the place among those of the same tag, by id.
type Ids = HashMap<i64, usize>;

impl Reader<'_> {
    fn position(&self, offset: usize) -> (u32, u32) {
        self.lines.position(offset)
    }

    fn place(&self, offset: usize) -> ScenePlace {
        ScenePlace { file: self.file.into(), position: Some(self.position(offset)) }
    }

    fn error(&self, offset: usize, problem: impl Into<String>) -> SceneError {
        SceneError::Value { place: self.place(offset), problem: problem.into() }
    }

    /// The table of an element whose keys will be at `path`. `ids` are those of its siblings.
    fn element(
        &mut self,
        node: Node<'_, '_>,
        schema: &'static Element,
        path: &str,
        ids: &Ids,
    ) -> Result<Table, SceneError> {
        let start = node.range().start;
        let tag = schema.tag;
        let mut table = Table::new();
        self.attributes(node, schema, path, ids, &mut table)?;
        if let Some((key, value)) = schema.constant {
            table.insert(key.into(), Value::String(value.into()));
        }
        let text: String =
            node.children().filter(Node::is_text).filter_map(|child| child.text()).collect();
        if let Some((key, kind)) = schema.text {
            let value = value::parse(kind, &text)
                .map_err(|problem| self.error(start, format!("<{tag}> {problem}")))?;
            self.places.insert(joined(path, key), self.position(start));
            table.insert(key.into(), value);
        } else if let Some(child) = node
            .children()
            .find(|child| child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()))
        {
            let problem = format!("text has no meaning in <{tag}>: remove it");
            return Err(self.error(child.range().start, problem));
        }
        self.children(node, schema, path, &mut table)?;
        for &(key, words) in schema.needs {
            match table.get(key) {
                None => return Err(self.error(start, format!("<{tag}> has no {words}: add one"))),
                Some(Value::Table(choice)) if is_choice(key) && choice.len() != 1 => {
                    let problem = format!("<{tag}> has more than one of {words}: keep one");
                    return Err(self.error(start, problem));
                }
                Some(_) => {}
            }
        }
        Ok(table)
    }

    fn attributes(
        &mut self,
        node: Node<'_, '_>,
        schema: &'static Element,
        path: &str,
        ids: &Ids,
        table: &mut Table,
    ) -> Result<(), SceneError> {
        let tag = schema.tag;
        for attribute in node.attributes() {
            if attribute.namespace() == Some("http://www.w3.org/2001/XMLSchema-instance") {
                continue;
            }
            let start = attribute.range().start;
            let name = attribute.name();
            let known = schema.attributes.iter().find(|known| known.name == name);
            let Some(known) = known.filter(|_| attribute.namespace().is_none()) else {
                let known = schema.attributes.iter().map(|known| known.name.to_owned()).collect();
                return Err(SceneUnknown::error(self.place(start), "attribute", name, known));
            };
            let mut value = value::parse(known.kind, attribute.value())
                .map_err(|problem| self.error(start, format!("`{name}` of <{tag}> {problem}")))?;
            if known.kind == Kind::Particle {
                let id = value.as_integer().unwrap_or_default();
                let Some(&index) = ids.get(&id) else {
                    let problem = format!(
                        "`{name}` names particle {id}, which is not in this group: correct the id"
                    );
                    return Err(self.error(start, problem));
                };
                value = Value::Integer(index as i64);
            }
            if tag == "particle" && known.kind == Kind::Vector {
                table.insert("position".into(), value);
            } else if !known.key.is_empty() {
                self.places.insert(joined(path, known.key), self.position(start));
                if insert(table, known.key, value).is_err() {
                    let problem = format!("`{name}` of <{tag}> is given twice: remove one");
                    return Err(self.error(start, problem));
                }
            }
        }
        for known in schema.attributes.iter().filter(|known| known.required) {
            if !node.has_attribute(known.name) {
                let problem = format!("<{tag}> has no `{}`: add it", known.name);
                return Err(self.error(node.range().start, problem));
            }
        }
        if tag == "joint" && table.get("from").is_some() && table.get("from") == table.get("to") {
            let problem = "joins a particle to itself: correct one of the ids";
            return Err(self.error(node.range().start, format!("<{tag}> {problem}")));
        }
        Ok(())
    }

    fn children(
        &mut self,
        node: Node<'_, '_>,
        schema: &'static Element,
        path: &str,
        table: &mut Table,
    ) -> Result<(), SceneError> {
        let ids = self.ids(node)?;
        let mut seen = HashSet::new();
        for child in node.children().filter(Node::is_element) {
            let start = child.range().start;
            let name = child.tag_name().name();
            let known = schema.children.iter().copied().find(|known| known.tag == name);
            let Some(inner) = known.filter(|_| child.tag_name().namespace().is_none()) else {
                let known = schema.children.iter().map(|known| known.tag.to_owned()).collect();
                return Err(SceneUnknown::error(self.place(start), "element", name, known));
            };
            let is_single = matches!(inner.target, Target::Inline | Target::Table(_));
            if is_single && !seen.insert(name) {
                return Err(self.error(start, format!("a second <{name}>: remove one")));
            }
            let position = self.position(start);
            match inner.target {
                Target::Inline => {
                    let more = self.element(child, inner, path, &ids)?;
                    merge(table, more).map_err(|key| self.twice(start, name, &key))?;
                }
                Target::Table(key) => {
                    let path = joined(path, key);
                    self.places.insert(path.clone(), position);
                    let more = Value::Table(self.element(child, inner, &path, &ids)?);
                    insert(table, key, more).map_err(|key| self.twice(start, name, &key))?;
                }
                Target::Item(key, wrapper) => {
                    let (key, base, array) = match key.strip_prefix('/') {
                        Some(key) => (key, "", &self.rooted),
                        None => (key, path, &*table),
                    };
                    let index = array.get(key).and_then(Value::as_array).map_or(0, Vec::len);
                    let path = format!("{}[{index}]", joined(base, key));
                    self.places.insert(path.clone(), position);
                    let path = joined(&path, wrapper);
                    let mut item = self.element(child, inner, &path, &ids)?;
                    if !wrapper.is_empty() {
                        item = Table::from_iter([(wrapper.to_owned(), Value::Table(item))]);
                    }
                    let is_rooted = !matches!(inner.target, Target::Item(own, _) if own == key);
                    let owner = if is_rooted { &mut self.rooted } else { &mut *table };
                    push(owner, key, Value::Table(item));
                }
                Target::Value(key) => {
                    let mut item = self.element(child, inner, path, &ids)?;
                    if let Some(value) = item.remove("position") {
                        push(table, key, value);
                    }
                }
            }
        }
        Ok(())
    }

    fn twice(&self, start: usize, tag: &str, key: &str) -> SceneError {
        self.error(start, format!("<{tag}> gives `{key}` a second time: remove one"))
    }

    /// The ids of all children; all positive, no two the same.
    fn ids(&self, node: Node<'_, '_>) -> Result<Ids, SceneError> {
        let mut ids = Ids::new();
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for child in node.children().filter(Node::is_element) {
            let count = counts.entry(child.tag_name().name()).or_default();
            let index = *count;
            *count += 1;
            let Some(attribute) = child.attribute_node("id") else { continue };
            let start = attribute.range().start;
            // What is not a number is told where the element is read.
            let Ok(id) = attribute.value().trim().parse::<i64>() else { continue };
            if id <= 0 {
                let problem = format!("`id` is {id}: give a positive whole number");
                return Err(self.error(start, problem));
            }
            if ids.insert(id, index).is_some() {
                let problem =
                    format!("id {id} is taken by an actor beside this one: choose another");
                return Err(self.error(start, problem));
            }
        }
        Ok(ids)
    }
}

/// Keys under which exactly one table says which kind of thing it is.
fn is_choice(key: &str) -> bool {
    matches!(key, "shape" | "geometry" | "response")
}

fn joined(path: &str, key: &str) -> String {
    match (path, key) {
        ("", key) => key.to_owned(),
        (path, "") => path.to_owned(),
        (path, key) => format!("{path}.{key}"),
    }
}

fn push(table: &mut Table, key: &str, value: Value) {
    match table.entry(key).or_insert_with(|| Value::Array(Vec::new())) {
        Value::Array(array) => array.push(value),
        other => *other = Value::Array(vec![value]),
    }
}

/// Puts `value` at a path; the key if something is there that is no table.
fn insert(table: &mut Table, path: &str, value: Value) -> Result<(), String> {
    match path.split_once('.') {
        Some((first, rest)) => {
            let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
            match inner {
                Value::Table(inner) => insert(inner, rest, value),
                _ => Err(path.to_owned()),
            }
        }
        None => match (table.get_mut(path), value) {
            (None, value) => {
                table.insert(path.to_owned(), value);
                Ok(())
            }
            (Some(Value::Table(there)), Value::Table(more)) => merge(there, more),
            _ => Err(path.to_owned()),
        },
    }
}

fn merge(table: &mut Table, more: Table) -> Result<(), String> {
    more.into_iter().try_for_each(|(key, value)| insert(table, &key, value))
}

#[cfg(test)]
mod tests {
    use super::{DEPTH_MAX, too_deep};

    #[test]
    fn only_what_is_nested_counts_as_depth() {
        let many = |piece: &str| piece.repeat(2 * DEPTH_MAX);
        for flat in [
            many("<a/>"),
            many("<a></a>"),
            many("<a b='>'/>"),
            many("<a b=\">\"></a>"),
            many("<!-- <a> -->"),
            many("<![CDATA[<a>]]>"),
            many("<?a <b> ?>"),
        ] {
            assert_eq!(too_deep(&flat), None, "{flat}");
        }
        for deep in [many("<a>"), many("<a b='/>'>"), many("<a><?a </a> ?>"), many("<a"), many("<")]
        {
            assert!(too_deep(&deep).is_some(), "{deep}");
        }
        assert_eq!(too_deep(&"<a>".repeat(DEPTH_MAX)), None);
    }
}
