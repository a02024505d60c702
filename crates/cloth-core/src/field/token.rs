//! The words of an expression.

use super::FieldError;

/// A word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// An operator, bracket or separator.
    Symbol(&'static str),
    End,
}

/// Longer ones first, so that `<=` is not read as `<`.
const SYMBOLS: &[&str] =
    &["<=", ">=", "==", "!=", "<", ">", "=", "+", "-", "*", "/", "^", "(", ")", ",", ".", ";"];

/// Splits `source` into words, each with its offset in bytes; the last one is the end.
pub(super) fn tokens(source: &str) -> Result<Vec<(Token<'_>, usize)>, FieldError> {
    let mut tokens = Vec::new();
    let mut offset = 0;
    while let Some(first) = source[offset..].chars().next() {
        let rest = &source[offset..];
        let (token, length) = if first.is_whitespace() {
            offset += first.len_utf8();
            continue;
        } else if first.is_ascii_digit() || starts_fraction(rest) {
            number(source, offset)?
        } else if first.is_ascii_alphabetic() || first == '_' {
            let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            (Token::Name(&rest[..length]), length)
        } else if let Some(symbol) = SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol)) {
            (Token::Symbol(symbol), symbol.len())
        } else {
            let problem = format!("{first:?} has no meaning in an expression: remove it");
            return Err(FieldError::at(source, offset, problem));
        };
        tokens.push((token, offset));
        offset += length;
    }
    tokens.push((Token::End, source.len()));
    Ok(tokens)
}

/// Whether a number like `.5` starts here; `x.x` does not.
fn starts_fraction(rest: &str) -> bool {
    let mut characters = rest.chars();
    characters.next() == Some('.') && characters.next().is_some_and(|c| c.is_ascii_digit())
}

fn number(source: &str, offset: usize) -> Result<(Token<'_>, usize), FieldError> {
    let rest = &source.as_bytes()[offset..];
    let digits = |from: usize| rest[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if rest.get(length) == Some(&b'.') {
        length += 1 + digits(length + 1);
    }
    if matches!(rest.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(rest.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    let text = &source[offset..offset + length];
    let value = text.parse().unwrap_or(f64::NAN);
    if value > f64::from(f32::MAX) || value.is_nan() {
        let problem = "the number is too large: use one below 3.4e38".to_owned();
        return Err(FieldError::at(source, offset, problem));
    }
    Ok((Token::Number(value), length))
}
