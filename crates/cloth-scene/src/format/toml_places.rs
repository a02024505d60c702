//! Where every key of a TOML text is, and whether its numbers are numbers.

use std::{collections::HashMap, ops::Range};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::lines::Lines;

/// A number that is NaN or infinite.
pub(super) struct NonFinite {
    /// The number as written.
    pub(super) text: String,
    /// The key that it belongs to.
    pub(super) key: String,
    /// Line and column.
    pub(super) position: (u32, u32),
}

/// Longest key that is looked into \[byte\].
const KEY_MAX: usize = 64;

/// Collects the places of all keys, and the first number that is not finite.
pub(super) struct Places<'a> {
    lines: &'a Lines<'a>,
    pub(super) keys: HashMap<String, (u32, u32)>,
    pub(super) non_finite: Option<NonFinite>,
}

impl<'a> Places<'a> {
    pub(super) fn of(table: &DeTable<'_>, lines: &'a Lines<'a>) -> Self {
        let mut places = Self { lines, keys: HashMap::new(), non_finite: None };
        places.table(table, "");
        places
    }

    fn table(&mut self, table: &DeTable<'_>, path: &str) {
        for (name, value) in table {
            let name_text = name.get_ref();
            // No key of a scene is so long. The path of each key below it would hold it once more.
            if name_text.len() > KEY_MAX {
                continue;
            }
            let key =
                if path.is_empty() { name_text.to_string() } else { format!("{path}.{name_text}") };
            self.keys.insert(key.clone(), self.lines.position(name.span().start));
            self.value(value, &key);
        }
    }

    fn value(&mut self, value: &Spanned<DeValue<'_>>, key: &str) {
        match value.get_ref() {
            DeValue::Table(table) => self.table(table, key),
            DeValue::Array(array) => {
                for (index, element) in array.iter().enumerate() {
                    let key = format!("{key}[{index}]");
                    // Only tables have keys of their own to point at; the elements of a long list
                    // of pins would fill memory for nothing.
                    if element.get_ref().is_table() {
                        let position = self.lines.position(element.span().start);
                        self.keys.insert(key.clone(), position);
                    }
                    self.value(element, &key);
                }
            }
            DeValue::Float(number) => {
                if number.as_str().parse().is_ok_and(f64::is_finite) {
                    return;
                }
                let position = self.lines.position(value.span().start);
                let earlier =
                    self.non_finite.as_ref().is_some_and(|found| found.position <= position);
                if !earlier {
                    self.non_finite = Some(NonFinite {
                        text: number.as_str().to_owned(),
                        key: key.to_owned(),
                        position,
                    });
                }
            }
            _ => {}
        }
    }
}

/// The key of the value at `span`: of the innermost value that covers it. `None` if only the text
/// as a whole does.
pub(super) fn key_at(table: &DeTable<'_>, span: &Range<usize>) -> Option<String> {
    let mut search = Search { span, path: String::new(), innermost: None };
    for (name, value) in table {
        search.below(name.get_ref(), value);
    }
    search.innermost.map(|(_, key)| key)
}

struct Search<'a> {
    span: &'a Range<usize>,
    /// Key of the value that is looked at. It grows and shrinks in place: a copy for each value would take the
    /// square of the text's length where one name is long.
    path: String,
    /// Length and key of the shortest value found that covers the span.
    innermost: Option<(usize, String)>,
}

impl Search<'_> {
    /// Looks at `value`, whose key is the path with `step` behind it.
    fn below(&mut self, step: &str, value: &Spanned<DeValue<'_>>) {
        let parent = self.path.len();
        self.path.push_str(step);
        self.value(value);
        self.path.truncate(parent);
    }

    /// Looks at `value` and all that it holds. A table spans its header alone when it has one, so what
    /// a table holds is looked at whether or not the table covers the span.
    fn value(&mut self, value: &Spanned<DeValue<'_>>) {
        match value.get_ref() {
            DeValue::Table(table) => {
                let parent = self.path.len();
                self.path.push('.');
                for (name, value) in table {
                    self.below(name.get_ref(), value);
                }
                self.path.truncate(parent);
            }
            DeValue::Array(array) => {
                for (index, element) in array.iter().enumerate() {
                    self.below(&format!("[{index}]"), element);
                }
            }
            _ => {}
        }
        let own = value.span();
        let closer = self.innermost.as_ref().is_none_or(|&(length, _)| own.len() < length);
        if own.start <= self.span.start && self.span.end <= own.end && closer {
            self.innermost = Some((own.len(), self.path.clone()));
        }
    }
}
