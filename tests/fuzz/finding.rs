//! Inputs that did harm, and the files that keep them.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// How an input did harm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Harm {
    /// With the place in the code and the message.
    Panic(String),
    /// The process ended; with its status and last words. Memory that is refused ends so, too.
    Crash(String),
    /// It took longer than its deadline.
    Hang,
}

impl Harm {
    /// What findings of one cause have in common.
    pub(crate) fn key(&self) -> String {
        match self {
            // A place in the code, without the message, which often has numbers of the input.
            Self::Panic(text) => text.split(": ").next().unwrap_or_default().to_owned(),
            Self::Crash(text) => text.replace(|c: char| c.is_ascii_digit(), ""),
            Self::Hang => "hang".to_owned(),
        }
    }
}

impl std::fmt::Display for Harm {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Panic(text) => write!(formatter, "panic at {text}"),
            Self::Crash(text) => write!(formatter, "crash: {text}"),
            Self::Hang => write!(formatter, "hang"),
        }
    }
}

/// Keeps an input below `folder`, named after its content, and returns where.
pub(crate) fn keep(folder: &Path, target: &str, input: &[u8]) -> io::Result<PathBuf> {
    let folder = folder.join(target);
    fs::create_dir_all(&folder)?;
    let path = folder.join(format!("{:08x}.{target}", crc32fast::hash(input)));
    fs::write(&path, input)?;
    Ok(path)
}
