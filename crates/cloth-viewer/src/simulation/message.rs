//! What is said to the user.

/// How grave a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Something that was done, or that is to be known.
    Info,
    /// Something that went wrong.
    Error,
}

/// Something to say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// How grave it is.
    pub severity: Severity,
    /// The words, in one line.
    pub text: String,
}

impl Message {
    /// Something that was done.
    pub fn info(text: impl Into<String>) -> Self {
        Self { severity: Severity::Info, text: text.into() }
    }

    /// Something that went wrong.
    pub fn error(error: &impl ToString) -> Self {
        Self { severity: Severity::Error, text: error.to_string() }
    }
}
