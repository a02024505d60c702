//! What is said to the user.

use std::{fmt, sync::Arc};

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

/// Who is told what the window says, such as a program with a terminal; nobody by default.
#[derive(Clone, Default)]
pub struct Listener(Option<Arc<Hear>>);

type Hear = dyn Fn(&Message) + Send + Sync;

impl Listener {
    /// Tells every message to `hear`.
    pub fn new(hear: impl Fn(&Message) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(hear)))
    }

    pub(crate) fn tell(&self, message: &Message) {
        if let Some(hear) = &self.0 {
            hear(message);
        }
    }
}

impl fmt::Debug for Listener {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Listener").finish_non_exhaustive()
    }
}
