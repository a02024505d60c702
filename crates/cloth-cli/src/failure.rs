//! What a command can end with, and the exit code of each.

use std::{
    error::Error as StdError,
    io,
    path::{Path, PathBuf},
    process::ExitCode,
};

use crate::signals;
use cloth::{
    BackendError, CheckpointError, Error, PoseLogError, io::FrameError, io::MeshError,
    scene::SceneError,
};

/// Exit code for input that cannot be used.
pub(crate) const EXIT_INPUT: u8 = 3;

/// A command that did not do what was asked. The exit code says whose turn it is.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// Exit code 2: arguments that contradict each other; single ones are checked by `clap`.
    #[error("{0}")]
    Usage(String),
    /// Exit code 3: a scene, mesh, checkpoint or folder that cannot be used.
    #[error(transparent)]
    Input(Box<dyn StdError + Send + Sync>),
    /// Exit code 4: the simulation diverged.
    #[error(transparent)]
    Diverged(Box<dyn StdError + Send + Sync>),
    /// Exit code 5: triangles that intersect.
    #[error("{0}")]
    Intersects(String),
    /// Exit code 128 and the number of the signal that asked for the end, which is not an error.
    #[error("ended by signal {0}")]
    Interrupted(i32),
    /// Exit code 1: anything else.
    #[error(transparent)]
    Other(Box<dyn StdError + Send + Sync>),
}

/// A file of the command itself that could not be written.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot write `{}` ({source}); check free space and permissions or choose another folder",
    file.display()
)]
pub(crate) struct WriteError {
    file: PathBuf,
    source: io::Error,
}

/// Stdout could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to stdout ({0}); files that were written before are complete")]
struct StdoutError(io::Error);

/// A file that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read `{}` ({source}); check the path and the permissions", file.display())]
pub(crate) struct ReadError {
    file: PathBuf,
    source: io::Error,
}

impl WriteError {
    pub(crate) fn of(file: &Path) -> impl FnOnce(io::Error) -> Self {
        let file = file.to_owned();
        move |source| Self { file, source }
    }
}

impl ReadError {
    pub(crate) fn of(file: &Path) -> impl FnOnce(io::Error) -> Self {
        let file = file.to_owned();
        move |source| Self { file, source }
    }
}

impl Failure {
    pub(crate) fn input(error: impl Into<Box<dyn StdError + Send + Sync>>) -> Self {
        Self::Input(error.into())
    }

    pub(crate) fn other(error: impl Into<Box<dyn StdError + Send + Sync>>) -> Self {
        Self::Other(error.into())
    }

    /// What is asked for is not in this build; a Cargo feature adds it.
    #[cfg(not(all(feature = "viewer", feature = "cpu")))]
    pub(crate) fn absent(what: &str, feature: &str) -> Self {
        Self::Usage(format!(
            "{what} is not in this build; the Cargo feature `{feature}` adds it: `cargo install cloth-cli --features {feature}`, or in a \
             clone `cargo run --release --features {feature} --`"
        ))
    }

    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Usage(_) => 2,
            Self::Input(_) => EXIT_INPUT,
            Self::Diverged(_) => 4,
            Self::Intersects(_) => 5,
            Self::Interrupted(signal) => signals::exit_code(*signal) as u8,
            Self::Other(_) => 1,
        })
    }

    /// The message with its causes in one sentence; causes that a message already has in it are not
    /// said again.
    pub(crate) fn sentence(&self) -> String {
        let mut sentence = self.to_string();
        let mut cause = self.source();
        while let Some(error) = cause {
            let message = error.to_string();
            if !sentence.contains(&message) {
                sentence = format!("{sentence}: {message}");
            }
            cause = error.source();
        }
        sentence
    }

    /// Whether the reader of the output went away.
    pub(crate) fn is_broken_pipe(&self) -> bool {
        match self {
            Self::Other(error) => error
                .downcast_ref::<StdoutError>()
                .is_some_and(|error| error.0.kind() == io::ErrorKind::BrokenPipe),
            _ => false,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::input(error)
    }
}

impl From<MeshError> for Failure {
    fn from(error: MeshError) -> Self {
        Self::input(error)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::input(error)
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::input(error)
    }
}

/// Commands read and write files with errors that name them; what is left is stdout.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::other(StdoutError(error))
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Self {
        match error {
            BackendError::Unknown { .. } | BackendError::Absent { .. } => {
                Self::Usage(error.to_string())
            }
            BackendError::Unusable(error) => error.into(),
        }
    }
}

impl From<CheckpointError> for Failure {
    fn from(error: CheckpointError) -> Self {
        Self::input(error)
    }
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        match error {
            FrameError::Position { .. } | FrameError::Vector { .. } => Self::Diverged(error.into()),
            error => Self::input(error),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Diverged(_) => Self::Diverged(error.into()),
            Error::Invalid(_)
            | Error::Checkpoint { .. }
            | Error::OutOfMemory { .. }
            | Error::LimitExceeded { .. }
            | Error::Unsupported { .. } => Self::input(error),
            error => Self::other(error),
        }
    }
}

impl From<PoseLogError> for Failure {
    fn from(error: PoseLogError) -> Self {
        Self::input(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("outer")]
    struct Outer(#[source] WriteError);

    #[test]
    fn causes_are_said_once() {
        let cause = WriteError::of(Path::new("a/b"))(io::Error::other("disk on fire"));
        assert_eq!(
            Failure::other(Outer(cause)).sentence(),
            "outer: cannot write `a/b` (disk on fire); check free space and permissions or choose \
             another folder"
        );
    }
}
