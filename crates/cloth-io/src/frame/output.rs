//! Output files that are either complete or absent.

use std::io::{BufWriter, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use super::FrameError;

/// Writes `path` through a temporary file in the same folder, which is renamed into place when it
/// is complete: a reader or a later run never sees half a file.
///
/// # Errors
///
/// The error of `content`, or [`FrameError::Write`].
pub(super) fn output_write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<(), FrameError>,
) -> Result<(), FrameError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cloth-").suffix(".part");
    // Temporary files are private by default, but outputs follow the permissions of the folder.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(FrameError::write(path))?;
    let mut writer = BufWriter::with_capacity(1 << 18, file);
    content(&mut writer)?;
    writer.flush().map_err(FrameError::write(path))?;
    let file = writer.into_inner().map_err(|error| FrameError::write(path)(error.into_error()))?;
    file.persist(path).map_err(|error| FrameError::write(path)(error.error))?;
    Ok(())
}
