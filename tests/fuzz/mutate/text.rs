//! Texts as tokens and lines.

use fastrand::Rng;

use super::{LENGTH, REAL, WHOLE, any, changes, times};

/// Numbers as texts may have them, and what looks like numbers.
const NUMBERS: [&str; 20] = [
    "1e400",
    "-1e400",
    "1e-400",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0x10",
    "1_000",
    "+1",
    ".5",
    "1.",
    "00",
    "-0",
    "1e",
    "--1",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999999",
    "1e308",
];
/// What opens a level of nesting.
const NESTING: [&str; 9] = ["(", "[", "{", "<a>", "-", "not ", "[[", "<!--", "\""];
/// Characters that texts seldom have.
const ODD: [char; 14] = [
    '\0', '\u{1b}', '"', '\'', '\\', '\r', '\t', '\u{a0}', '\u{2028}', '\u{feff}', 'é', '𝄞', '&',
    '#',
];

/// The tokens of a text: words, numbers, white space, line ends and single other characters. Together they are the text.
fn tokens(text: &str) -> Vec<String> {
    let class = |c: char| match c {
        '\n' => 0,
        c if c.is_whitespace() => 1,
        c if c.is_alphanumeric() || c == '_' => 2,
        '.' => 2,
        _ => 3,
    };
    let mut tokens: Vec<String> = Vec::new();
    let mut last = 3;
    for c in text.chars() {
        let this = class(c);
        match tokens.last_mut() {
            Some(token) if this == last && (1..3).contains(&this) => token.push(c),
            _ => tokens.push(c.into()),
        }
        last = this;
    }
    tokens
}

fn is_number(token: &str) -> bool {
    token.starts_with(|c: char| c.is_ascii_digit())
}

/// A number as text.
pub(crate) fn number(rng: &mut Rng) -> String {
    match rng.u8(..4) {
        0 => any(rng, &NUMBERS).to_string(),
        1 => any(rng, &WHOLE).to_string(),
        2 => format!("{:?}", any(rng, &REAL)),
        _ => format!("{}", (rng.f64() - 0.5) * 10_f64.powi(rng.i32(-6..7))),
    }
}

/// One of the texts `seeds`, changed; `words` are those of its language.
pub(crate) fn mutated(rng: &mut Rng, seeds: &[String], words: &[&str]) -> String {
    let seed = any(rng, seeds);
    changed(rng, seed, seeds, words)
}

/// A text with some changes.
pub(crate) fn changed(rng: &mut Rng, text: &str, seeds: &[String], words: &[&str]) -> String {
    let mut tokens = tokens(text);
    for _ in 0..changes(rng) {
        change(rng, &mut tokens, seeds, words);
        // The rest of a text that grew too long is cut off, which is a change as good as any.
        let mut length = 0;
        tokens.retain(|token| {
            length += token.len();
            length <= LENGTH
        });
    }
    tokens.concat()
}

fn change(rng: &mut Rng, tokens: &mut Vec<String>, seeds: &[String], words: &[&str]) {
    if tokens.is_empty() {
        tokens.push(number(rng));
        return;
    }
    let at = rng.usize(..tokens.len());
    let run = |rng: &mut Rng| at..(at + 1 + rng.usize(..12)).min(tokens.len());
    match rng.u8(..14) {
        0..4 => {
            // Most of what goes wrong goes wrong with numbers.
            let numbers: Vec<usize> =
                (0..tokens.len()).filter(|&index| is_number(&tokens[index])).collect();
            if !numbers.is_empty() {
                let at = *any(rng, &numbers);
                tokens[at] = number(rng);
            }
        }
        4 => tokens[at] = any(rng, words).to_string(),
        5 => {
            let other = &seeds[rng.usize(..seeds.len())];
            let other = self::tokens(other);
            tokens[at].clone_from(any(rng, &other));
        }
        6 => drop(tokens.drain(run(rng))),
        7 => {
            let part = tokens[run(rng)].to_vec();
            let most = LENGTH / part.concat().len().max(1);
            let copies = times(rng).min(most);
            tokens.splice(at..at, std::iter::repeat_n(part, copies).flatten());
        }
        8 => {
            let other = rng.usize(..tokens.len());
            tokens.swap(at, other);
        }
        9 => lines(rng, tokens, seeds),
        10 => tokens.insert(at, any(rng, &NESTING).repeat(times(rng))),
        11 => tokens.insert(at, any(rng, &ODD).to_string()),
        12 => {
            let longer = tokens[at].repeat(times(rng).min(LENGTH / tokens[at].len()));
            tokens[at] = longer;
        }
        _ => tokens.truncate(at),
    }
}

/// Leaves a line out, doubles it, or puts lines of another text there.
fn lines(rng: &mut Rng, tokens: &mut Vec<String>, seeds: &[String]) {
    let text = tokens.concat();
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let at = rng.usize(..lines.len());
    let other: &String = any(rng, seeds);
    let other: Vec<&str> = other.split_inclusive('\n').collect();
    match rng.u8(..4) {
        0 => drop(lines.remove(at)),
        1 => {
            let copies = times(rng).min(LENGTH / lines[at].len().max(1));
            lines.splice(at..at, std::iter::repeat_n(lines[at], copies));
        }
        2 => {
            let to = rng.usize(..lines.len());
            lines.swap(at, to);
        }
        _ if other.is_empty() => {}
        _ => {
            let from = rng.usize(..other.len());
            let to = (from + 1 + rng.usize(..8)).min(other.len());
            lines.splice(at..at, other[from..to].iter().copied());
        }
    }
    *tokens = self::tokens(&lines.concat());
}

/// At times with bytes that are no text.
pub(crate) fn bytes(rng: &mut Rng, text: String) -> Vec<u8> {
    let mut bytes = text.into_bytes();
    if rng.u8(..25) == 0 && !bytes.is_empty() {
        let at = rng.usize(..bytes.len());
        bytes[at] = rng.u8(..);
    }
    bytes
}
