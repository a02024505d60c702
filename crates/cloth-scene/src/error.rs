//! What can be wrong with a scene.

use std::{fmt, io};

use cloth_core::ModelError;
use cloth_io::MeshError;

use crate::{
    elsewhere::{self, Mend},
    suggestion::suggestion,
};

/// A scene that cannot be used. Each case names the place and the mend.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The operating system could not read the file.
    #[error("cannot read scene file `{file}` ({source}); check the path and the permissions")]
    Read {
        /// The file.
        file: String,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The file is larger than any scene is.
    #[error(
        "scene file `{file}` is larger than {limit} bytes; keep meshes in files of their own and \
         name them in the scene"
    )]
    Size {
        /// The file.
        file: String,
        /// Bytes that are read at most.
        limit: u64,
    },
    /// The text does not follow the format, or a value is of the wrong kind.
    #[error("{place}: {problem}; correct the text there")]
    Syntax {
        /// Where.
        place: ScenePlace,
        /// What is wrong there, in the words of the parser.
        problem: String,
    },
    /// A word that is none of those allowed at this place.
    #[error(transparent)]
    Unknown(Box<SceneUnknown>),
    /// A value makes no sense.
    #[error("{place}: {problem}")]
    Value {
        /// Where.
        place: ScenePlace,
        /// What is wrong and the mend.
        problem: String,
    },
    /// The model that the scene describes makes no sense.
    #[error("{place}: {source}")]
    Model {
        /// Where.
        place: ScenePlace,
        /// What is wrong and the mend.
        source: ModelError,
    },
    /// A mesh cannot be read.
    #[error("{place}: {source}")]
    Mesh {
        /// Where the scene names it.
        place: ScenePlace,
        /// What is wrong and the mend.
        source: MeshError,
    },
    /// A mesh is outside the folders that the scene may read from.
    #[error(
        "{place}: mesh file `{file}` is not a plain path below the folder of the scene; keep it \
         there, or allow its folder as a mesh root"
    )]
    MeshOutside {
        /// Where the scene names it.
        place: ScenePlace,
        /// The path as the scene gives it.
        file: String,
    },
    /// The scene needs more memory than it may have.
    #[error(
        "scene `{name}` with {particles} particles needs about {needed} bytes of memory and may use \
         {limit}; use fewer particles or allow more"
    )]
    Memory {
        /// Name of the scene.
        name: String,
        /// Particles of all cloths.
        particles: u64,
        /// Bytes that it needs, estimated.
        needed: u64,
        /// Bytes that it may use.
        limit: u64,
    },
    /// A scene that a format cannot hold.
    #[error("scene `{name}` cannot be written ({problem}); change that value")]
    Write {
        /// Name of the scene.
        name: String,
        /// What is wrong, in the words of the writer.
        problem: String,
    },
}

/// A word that is none of those allowed at its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: unknown {what} `{name}`; {}", self.mend())]
pub struct SceneUnknown {
    /// Where.
    pub place: ScenePlace,
    /// Kind of word.
    pub what: &'static str,
    /// The word.
    pub name: String,
    /// What to do, where that is not one of the words that are known.
    pub note: Option<String>,
    /// The known word that is most like it, if any is.
    pub suggestion: Option<String>,
    /// All that are known here.
    pub known: Vec<String>,
}

impl SceneUnknown {
    /// The error for `name`, with the most similar of the `known` words as suggestion.
    pub(crate) fn error(
        place: ScenePlace,
        what: &'static str,
        name: &str,
        known: Vec<String>,
    ) -> SceneError {
        let (note, suggestion) = match elsewhere::mend(name, &known).filter(|_| what == "key") {
            Some(Mend::Key(key)) => (None, Some(key.to_owned())),
            Some(Mend::Note(note)) => (Some(note.to_owned()), None),
            None => (None, suggestion(name, known.iter().map(String::as_str))),
        };
        let name = name.into();
        SceneError::Unknown(Box::new(Self { place, what, name, note, suggestion, known }))
    }

    fn mend(&self) -> String {
        let Self { note, suggestion, known, .. } = self;
        match (note, suggestion) {
            (Some(note), _) => note.clone(),
            (None, Some(suggestion)) => format!("did you mean `{suggestion}`?"),
            (None, None) if known.is_empty() => "remove it".into(),
            (None, None) => {
                let shown = &known[..known.len().min(SHOWN)];
                let more = match known.len() - shown.len() {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                format!("known here: `{}`{more}", shown.join("`, `"))
            }
        }
    }
}

/// How many known words an error shows.
const SHOWN: usize = 24;

/// A place in a scene file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScenePlace {
    /// The file, empty for a scene made by code.
    pub file: String,
    /// Line and column, from 1, where they are known.
    pub position: Option<(u32, u32)>,
}

impl fmt::Display for ScenePlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.file.as_str(), self.position) {
            ("", None) => formatter.write_str("scene"),
            ("", Some((line, column))) => write!(formatter, "scene, line {line}, column {column}"),
            (file, None) => write!(formatter, "scene file `{file}`"),
            (file, Some((line, column))) => {
                write!(formatter, "scene file `{file}`, line {line}, column {column}")
            }
        }
    }
}
