//! Trees of values: what TOML and JSON have in common.

use fastrand::Rng;
use serde_json::{Map, Value};

use super::{LENGTH, REAL, WHOLE, any, changes, times};

/// Texts that are keys or names at other places, or odd.
const TEXTS: [&str; 12] = [
    "",
    "all",
    "corners",
    "row-1",
    "denim",
    "explicit",
    "implicit",
    "../../etc/passwd",
    "/dev/zero",
    "a\u{0}b",
    "sheet.ply",
    "\u{1b}[31m",
];
/// Most copies of an element \[values\]: a file with more is no small file.
const COPIES: usize = 20_000;

/// One of the trees `seeds`, changed.
pub(crate) fn mutated(rng: &mut Rng, seeds: &[Value]) -> Value {
    let mut tree = any(rng, seeds).clone();
    for _ in 0..changes(rng) {
        let place = rng.usize(..count(&tree));
        // A part of another tree fits better than anything that is made up.
        let other = any(rng, seeds);
        let part = part(rng, other).clone();
        change(rng, nth(&mut tree, place), part);
    }
    tree
}

/// Values in a tree, itself included.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(values) => values.iter().map(count).sum(),
        Value::Object(map) => map.values().map(count).sum::<usize>(),
        _ => 0,
    }
}

/// Bytes of all texts in a tree: what repeats them has to know, or a few changes fill the memory.
fn text_length(value: &Value) -> usize {
    match value {
        Value::String(text) => text.len(),
        Value::Array(values) => values.iter().map(text_length).sum(),
        Value::Object(map) => map.values().map(text_length).sum(),
        _ => 0,
    }
}

/// Value number `place` of a tree, in the order in which they are written.
fn nth(value: &mut Value, mut place: usize) -> &mut Value {
    if place == 0 {
        return value;
    }
    place -= 1;
    let children: Vec<&mut Value> = match value {
        Value::Array(values) => values.iter_mut().collect(),
        Value::Object(map) => map.iter_mut().map(|(_, value)| value).collect(),
        _ => Vec::new(),
    };
    for child in children {
        let size = count(child);
        if place < size {
            return nth(child, place);
        }
        place -= size;
    }
    unreachable!("a place beyond the last value")
}

fn part<'a>(rng: &mut Rng, tree: &'a Value) -> &'a Value {
    let children: Vec<&Value> = match tree {
        Value::Array(values) => values.iter().collect(),
        Value::Object(map) => map.values().collect(),
        _ => Vec::new(),
    };
    if children.is_empty() || rng.u8(..4) == 0 {
        return tree;
    }
    let child = any(rng, &children);
    part(rng, child)
}

fn change(rng: &mut Rng, value: &mut Value, part: Value) {
    match value {
        Value::Array(values) => array(rng, values, part),
        Value::Object(map) => object(rng, map, part),
        _ => *value = if rng.u8(..4) == 0 { part } else { scalar(rng, value) },
    }
}

/// Something in the place of a number or text: of the same kind, in most cases.
fn scalar(rng: &mut Rng, value: &Value) -> Value {
    match value {
        Value::Number(number) if rng.u8(..8) > 0 => match rng.u8(..5) {
            0 => Value::from(*any(rng, &WHOLE)),
            // What is not finite is no value of a tree: nothing, then.
            1 => Value::from(*any(rng, &REAL)),
            2 => Value::from(-number.as_f64().unwrap_or_default()),
            3 => Value::from(number.as_f64().unwrap_or_default() * 10_f64.powi(rng.i32(-12..13))),
            _ => Value::from(number.as_i64().unwrap_or_default().wrapping_add(rng.i64(-2..3))),
        },
        Value::String(text) if rng.u8(..8) > 0 => match rng.u8(..3) {
            0 => Value::from(text.repeat(times(rng).min(LENGTH / text.len().max(1)))),
            _ => Value::from(*any(rng, &TEXTS)),
        },
        _ => match rng.u8(..4) {
            0 => Value::from(rng.bool()),
            1 => Value::from(*any(rng, &WHOLE)),
            2 => Value::from(*any(rng, &TEXTS)),
            _ => Value::Array(Vec::new()),
        },
    }
}

fn array(rng: &mut Rng, values: &mut Vec<Value>, part: Value) {
    let at = rng.usize(..values.len() + 1);
    match rng.u8(..5) {
        0 => values.clear(),
        1 => values.insert(at, part),
        2 if at < values.len() => drop(values.remove(at)),
        _ if at < values.len() => {
            let copies = times(rng).min(COPIES.min(LENGTH / text_length(&values[at]).max(1)));
            let copies = copies.min(COPIES / count(&values[at]));
            let copy = values[at].clone();
            values.splice(at..at, std::iter::repeat_n(copy, copies));
        }
        _ => values.push(part),
    }
}

fn object(rng: &mut Rng, map: &mut Map<String, Value>, part: Value) {
    let keys: Vec<String> = map.keys().cloned().collect();
    if keys.is_empty() {
        map.insert(any(rng, &TEXTS).to_string(), part);
        return;
    }
    let key = any(rng, &keys);
    match (rng.u8(..5), part) {
        (0, _) => drop(map.remove(key)),
        (1, part) => drop(map.insert(key.clone(), part)),
        (2, Value::Object(other)) => map.extend(other),
        (3, _) => {
            let value = map.remove(key).unwrap_or_default();
            map.insert(any(rng, &keys).clone(), value);
        }
        (_, part) => drop(map.insert(any(rng, &TEXTS).to_string(), part)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts that are repeated twice would take as much memory as there is.
    #[test]
    fn trees_stay_small() {
        let seed = serde_json::json!({ "uri": ["x".repeat(200)] });
        let mut rng = Rng::with_seed(3);
        for _ in 0..2000 {
            let mut tree = mutated(&mut rng, std::slice::from_ref(&seed));
            for _ in 0..4 {
                tree = mutated(&mut rng, &[tree]);
            }
            assert!(text_length(&tree) < 100 * LENGTH, "{}", text_length(&tree));
        }
    }
}
