//! Arrays that are longer than what they stand for.
//!
//! Serde reads as many elements of an array as the type has and leaves the others, and the TOML reader does not
//! say so. What was understood, written down again, shows how long each array may be.

use std::fmt;

use toml::{
    Spanned, Table, Value,
    de::{DeTable, DeValue},
};

/// An array that is not what its key takes.
pub(super) struct Misfit {
    key: String,
    problem: String,
    /// Where the first element is that is too much \[byte\].
    pub(super) offset: usize,
}

impl fmt::Display for Misfit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "`{}` {}", self.key.trim_start_matches('.'), self.problem)
    }
}

/// The first array of `written` that is longer than the same one of `understood`, or stands where a table should.
pub(super) fn misfit(written: &DeTable<'_>, understood: &Table) -> Option<Misfit> {
    in_table(written, understood)
}

fn in_table(written: &DeTable<'_>, understood: &Table) -> Option<Misfit> {
    let found = written.iter().filter_map(|(name, value)| {
        let name = name.get_ref();
        // Keys of values that stand for nothing, such as an empty array, are not written.
        in_value(value, understood.get(name.as_ref())?)
            .map(|found| found.below(&format!(".{name}")))
    });
    found.min_by_key(|misfit| misfit.offset)
}

fn in_value(written: &Spanned<DeValue<'_>>, understood: &Value) -> Option<Misfit> {
    match (written.get_ref(), understood) {
        (DeValue::Table(written), Value::Table(understood)) => in_table(written, understood),
        (DeValue::Array(written), Value::Array(understood)) => {
            if let Some(first) = written.get(understood.len()) {
                let [found, expected] = [written.len(), understood.len()];
                let problem = format!("has {found} elements: give {expected}");
                return Some(Misfit { key: String::new(), problem, offset: first.span().start });
            }
            written.iter().zip(understood).enumerate().find_map(|(index, (written, understood))| {
                in_value(written, understood).map(|found| found.below(&format!("[{index}]")))
            })
        }
        // Serde takes the values of a table from an array, too, in the order of the type.
        (DeValue::Array(_), Value::Table(_)) => {
            let problem = "is an array: give a table with keys".to_owned();
            Some(Misfit { key: String::new(), problem, offset: written.span().start })
        }
        _ => None,
    }
}

impl Misfit {
    /// The same, seen from the value around it.
    fn below(mut self, step: &str) -> Self {
        self.key.insert_str(0, step);
        self
    }
}
