//! What the program says on stderr. A terminal that went away or a disk that is full never ends it.

use std::{
    fmt::Display,
    fs::File,
    io::{Write, stderr},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU8, Ordering},
    },
};

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Level {
    /// Errors alone.
    Quiet,
    /// What a user should know.
    Normal,
    /// Each frame, each file, and what drivers have to say.
    Verbose,
}

static LEVEL: AtomicU8 = AtomicU8::new(Level::Normal as u8);

/// Stderr itself, while the stderr of libraries leads nowhere.
static OWN: Mutex<Option<File>> = Mutex::new(None);

pub(crate) fn level_set(level: Level) {
    LEVEL.store(level as u8, Ordering::Relaxed);
}

/// Whether what belongs to `level` is said.
pub(crate) fn is_at(level: Level) -> bool {
    LEVEL.load(Ordering::Relaxed) >= level as u8
}

/// Where messages go while stderr leads elsewhere; `None` for stderr.
pub(crate) fn own_set(own: Option<File>) {
    *OWN.lock().unwrap_or_else(PoisonError::into_inner) = own;
}

pub(crate) fn error(message: impl Display) {
    line(&format!("error: {message}"));
}

pub(crate) fn warning(message: impl Display) {
    if is_at(Level::Normal) {
        line(&format!("warning: {message}"));
    }
}

pub(crate) fn note(message: impl Display) {
    if is_at(Level::Normal) {
        line(&message.to_string());
    }
}

pub(crate) fn detail(message: impl Display) {
    if is_at(Level::Verbose) {
        line(&message.to_string());
    }
}

/// Writes a line, or nothing where that is not possible.
pub(crate) fn line(text: &str) {
    let text = shown(text) + "\n";
    let own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    let _ = match own.as_ref() {
        Some(mut file) => file.write_all(text.as_bytes()),
        None => stderr().write_all(text.as_bytes()),
    };
}

/// `text` with everything escaped that a terminal would obey instead of showing it, such as colours, or
/// letters that run backwards: names in messages come from files that others wrote.
pub(crate) fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        let is_direction = matches!(letter, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if is_direction || (letter.is_control() && letter != '\n' && letter != '\t') {
            shown.extend(letter.escape_unicode());
        } else {
            shown.push(letter);
        }
    }
    shown
}

/// A writer for text of which parts come from elsewhere, as [`shown`] has it. Each write must end with whole letters.
pub(crate) struct Shown<W>(pub(crate) W);

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.0.write_all(shown(&String::from_utf8_lossy(buffer)).as_bytes())?;
        Ok(buffer.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown_escaped() {
        assert_eq!(shown("a\u{1b}[31mb\r\u{9b}c"), "a\\u{1b}[31mb\\u{d}\\u{9b}c");
        assert_eq!(shown("x\u{202e}y"), "x\\u{202e}y");
        assert_eq!(shown("größe\tis\nfine"), "größe\tis\nfine");
        let mut bytes = Vec::new();
        write!(Shown(&mut bytes), "\u{7}bell {}", 2).unwrap();
        assert_eq!(bytes, b"\\u{7}bell 2");
    }

    #[test]
    fn levels_are_ordered() {
        assert!(Level::Quiet < Level::Normal && Level::Normal < Level::Verbose);
        assert!(is_at(Level::Normal) && !is_at(Level::Verbose));
    }
}
