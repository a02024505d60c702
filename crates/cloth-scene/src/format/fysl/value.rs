//! Attributes and texts, from the words of the file to values of a scene and back.

use glam::{DMat3, DQuat, DVec3};
use toml::{Table, Value};

use super::schema::Kind;

/// The value of `text`, or what is wrong with it.
pub(super) fn parse(kind: Kind, text: &str) -> Result<Value, String> {
    match kind {
        Kind::Text => Ok(Value::String(text.into())),
        Kind::Word(known) => {
            let word = text.trim();
            known
                .contains(&word)
                .then(|| Value::String(word.into()))
                .ok_or_else(|| format!("is \"{}\": use {}", shown(word), known.join(" or ")))
        }
        Kind::Number => number(text.trim()).map(Value::Float),
        Kind::Count | Kind::Id | Kind::Particle => count(text.trim()).map(Value::Integer),
        Kind::Switch => match text.trim() {
            "true" => Ok(Value::Boolean(true)),
            "false" => Ok(Value::Boolean(false)),
            other => Err(format!("is \"{}\": use true or false", shown(other))),
        },
        Kind::Words => Ok(Value::Array(words(text).collect())),
        Kind::Numbers(length) => {
            let numbers = numbers(text, Some(length))?;
            Ok(Value::Array(numbers.into_iter().map(Value::Float).collect()))
        }
        Kind::Vector => Ok(vector(&numbers(text, Some(3))?)),
        Kind::Axis => Ok(axis(&numbers(text, Some(3))?)),
        Kind::Vectors => {
            let numbers = triples(numbers(text, None)?)?;
            Ok(Value::Array(numbers.iter().map(|triple| vector(triple)).collect()))
        }
        Kind::Corners => {
            let numbers = triples(numbers(text, Some(12))?)?;
            Ok(Value::Array(numbers.iter().map(|triple| vector(triple)).collect()))
        }
        Kind::Pairs => {
            let numbers = numbers(text, None)?;
            let (pairs, []) = numbers.as_chunks::<2>() else {
                return Err(format!("has {} numbers: give two for each entry", numbers.len()));
            };
            let pair = |pair: &[f64; 2]| Value::Array(pair.map(Value::Float).to_vec());
            Ok(Value::Array(pairs.iter().map(pair).collect()))
        }
        Kind::Faces => {
            let indices = text.split_whitespace().map(count).collect::<Result<Vec<_>, _>>()?;
            let faces = triples(indices)?;
            let face = |face: &[i64; 3]| Value::Array(face.map(Value::Integer).to_vec());
            Ok(Value::Array(faces.iter().map(face).collect()))
        }
        Kind::Matrix => matrix(&numbers(text, Some(9))?),
    }
}

/// The words of the file for `value`; `None` if the language has none.
pub(super) fn print(kind: Kind, value: &Value) -> Option<String> {
    match kind {
        Kind::Text | Kind::Word(_) => value.as_str().map(str::to_owned),
        Kind::Number => print_number(value),
        Kind::Count => value.as_integer().map(|number| number.to_string()),
        Kind::Particle => value.as_integer().map(|number| (number + 1).to_string()),
        Kind::Switch => value.as_bool().map(|switch| switch.to_string()),
        Kind::Words => {
            let words: Option<Vec<_>> = value.as_array()?.iter().map(print_word).collect();
            Some(words?.join(", "))
        }
        Kind::Numbers(_) => {
            let numbers: Option<Vec<_>> = value.as_array()?.iter().map(print_number).collect();
            Some(numbers?.join(" "))
        }
        Kind::Vector => print_vector(value, 1.0),
        Kind::Axis => print_vector(value, -1.0),
        Kind::Vectors | Kind::Corners => {
            let lines: Option<Vec<_>> =
                value.as_array()?.iter().map(|vector| print_vector(vector, 1.0)).collect();
            Some(lines?.join("\n"))
        }
        Kind::Pairs => {
            let line = |pair: &Value| print(Kind::Numbers(2), pair);
            let lines: Option<Vec<_>> = value.as_array()?.iter().map(line).collect();
            Some(lines?.join("\n"))
        }
        Kind::Faces => {
            let line = |face: &Value| {
                let indices: Option<Vec<_>> = face
                    .as_array()?
                    .iter()
                    .map(|index| index.as_integer().map(|index| index.to_string()))
                    .collect();
                Some(indices?.join(" "))
            };
            let lines: Option<Vec<_>> = value.as_array()?.iter().map(line).collect();
            Some(lines?.join("\n"))
        }
        Kind::Id | Kind::Matrix => None,
    }
}

/// The start of a word, for messages.
fn shown(word: &str) -> String {
    word.chars().take(40).collect()
}

fn number(word: &str) -> Result<f64, String> {
    // Rust also reads words such as `infinity`.
    let plain = word.bytes().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    match word.parse::<f64>() {
        Ok(value) if plain && value.is_finite() => Ok(value),
        _ => Err(format!("has \"{}\": give a finite number", shown(word))),
    }
}

fn count(word: &str) -> Result<i64, String> {
    word.parse::<u32>()
        .map(i64::from)
        .map_err(|_| format!("has \"{}\": give a whole number up to {}", shown(word), u32::MAX))
}

fn numbers(text: &str, length: Option<usize>) -> Result<Vec<f64>, String> {
    let numbers = text.split_whitespace().map(number).collect::<Result<Vec<_>, _>>()?;
    match length {
        Some(length) if length != numbers.len() => {
            Err(format!("has {} numbers: give {length}", numbers.len()))
        }
        _ => Ok(numbers),
    }
}

fn triples<T: Copy>(numbers: Vec<T>) -> Result<Vec<[T; 3]>, String> {
    if numbers.len().is_multiple_of(3) {
        Ok(numbers.as_chunks().0.to_vec())
    } else {
        Err(format!("has {} numbers: give three for each entry", numbers.len()))
    }
}

/// Indices, names, and attributes with a bound, such as `pin > 0.5`.
fn words(text: &str) -> impl Iterator<Item = Value> + '_ {
    text.split(',').map(str::trim).filter(|word| !word.is_empty()).map(|word| {
        if let Some(pin) = attribute(word) {
            return pin;
        }
        let is_index = word.bytes().all(|byte| byte.is_ascii_digit());
        match word.parse::<u32>() {
            Ok(index) if is_index => Value::Integer(index.into()),
            _ => Value::String(word.into()),
        }
    })
}

/// The table of `NAME > NUMBER`.
fn attribute(word: &str) -> Option<Value> {
    let (name, bound) = word.rsplit_once('>')?;
    let above = number(bound.trim()).ok()?;
    let mut table = Table::new();
    table.insert("attribute".into(), Value::String(name.trim().into()));
    table.insert("above".into(), Value::Float(above));
    Some(Value::Table(table))
}

/// y up and left handed, to z up and right handed.
fn exchanged(numbers: &[f64]) -> [f64; 3] {
    match *numbers {
        [x, y, z] => [x, z, y],
        _ => [0.0; 3],
    }
}

fn vector(numbers: &[f64]) -> Value {
    Value::Array(exchanged(numbers).map(Value::Float).to_vec())
}

/// Zeros stay without a sign.
fn axis(numbers: &[f64]) -> Value {
    Value::Array(exchanged(numbers).map(|number| Value::Float(0.0 - number)).to_vec())
}

/// A rotation matrix, row by row, as axis and angle.
fn matrix(numbers: &[f64]) -> Result<Value, String> {
    let rows: Vec<DVec3> =
        numbers.as_chunks().0.iter().map(|&row| DVec3::from_array(row)).collect();
    let [x, y, z] = rows[..] else { return Err("has no three rows".into()) };
    let matrix = DMat3::from_cols(x, y, z).transpose();
    let error = matrix.transpose() * matrix - DMat3::IDENTITY;
    let largest = error.to_cols_array().into_iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
    if largest > 1e-6 {
        return Err("is not orthogonal: give a rotation without scale or shear".into());
    }
    if matrix.determinant() < 0.0 {
        return Err("mirrors: give a rotation, with determinant 1".into());
    }
    let exchange = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
    let engine = exchange * matrix * exchange;
    let (axis, angle) = DQuat::from_mat3(&engine).normalize().to_axis_angle();
    let mut table = Table::new();
    let axis = axis.to_array().map(Value::Float).to_vec();
    table.insert("axis".into(), Value::Array(axis));
    table.insert("degrees".into(), Value::Float(angle.to_degrees()));
    Ok(Value::Table(table))
}

fn print_number(value: &Value) -> Option<String> {
    match value {
        // The shortest form that is read back as the same number.
        Value::Float(number) => Some(format!("{number:?}")),
        Value::Integer(number) => Some(number.to_string()),
        _ => None,
    }
}

fn print_vector(value: &Value, sign: f64) -> Option<String> {
    let numbers: Option<Vec<f64>> = value
        .as_array()?
        .iter()
        .map(|number| number.as_float().or(number.as_integer().map(|n| n as f64)))
        .collect();
    let [x, z, y] = numbers?[..] else { return None };
    let print = |number: f64| format!("{:?}", if sign < 0.0 { 0.0 - number } else { number });
    Some([x, y, z].map(print).join(" "))
}

/// Names that would be read as something else have no words.
fn print_word(value: &Value) -> Option<String> {
    match value {
        Value::Integer(number) => Some(number.to_string()),
        Value::String(name) => {
            let back: Vec<Value> = words(name).collect();
            (back == [value.clone()]).then(|| name.clone())
        }
        Value::Table(table) => {
            let name = table.get("attribute")?.as_str()?;
            let text = format!("{name} > {}", print_number(table.get("above")?)?);
            let back: Vec<Value> = words(&text).collect();
            (back == [value.clone()]).then_some(text)
        }
        _ => None,
    }
}
