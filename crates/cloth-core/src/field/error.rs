//! What can be wrong with an expression.

/// An expression that cannot be used, with the place in its text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct FieldError {
    /// Line in the text of the expression, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// What is wrong there, and the mend.
    pub problem: String,
}

impl FieldError {
    /// An error at byte `offset` of `source`.
    pub(super) fn at(source: &str, offset: usize, problem: impl Into<String>) -> Self {
        let before = source.get(..offset).unwrap_or(source);
        let start = before.rfind('\n').map_or(0, |end| end + 1);
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        Self {
            line: count(before.matches('\n').count() + 1),
            column: count(before[start..].chars().count() + 1),
            problem: problem.into(),
        }
    }
}
