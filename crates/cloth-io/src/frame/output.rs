//! Output files of frames.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use super::FrameError;
use crate::file::replace_unsynced;

/// Writes `path` so that it is either complete or as it was.
///
/// # Errors
///
/// The error of `content`, or [`FrameError::Write`].
pub(super) fn output_write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), FrameError>,
) -> Result<(), FrameError> {
    replace_unsynced(path, content, |error| FrameError::write(path)(error))
}
