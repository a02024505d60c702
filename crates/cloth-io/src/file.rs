//! Output files that are either complete or absent.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Writes `path` through a temporary file in the same folder, which is renamed into place when it
/// is complete and on the disk: nobody ever sees half a file, and a file from before stays until
/// then, also if the power fails.
///
/// # Errors
///
/// Those of `content` and of the operating system.
pub fn file_replace(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    replace(path, content, File::sync_data, |error| error)
}

/// Like [`file_replace`] with errors that `error` makes, and without waiting for the disk, which
/// would cost the files of a run, that can be made again, more time than writing them.
pub(crate) fn replace_unsynced<E>(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    error: impl Fn(io::Error) -> E,
) -> Result<(), E> {
    replace(path, content, |_| Ok(()), error)
}

fn replace<E>(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    sync: impl FnOnce(&File) -> io::Result<()>,
    error: impl Fn(io::Error) -> E,
) -> Result<(), E> {
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
    let (file, temporary) = builder.tempfile_in(folder).map_err(&error)?.into_parts();
    let mut writer = BufWriter::with_capacity(1 << 18, file);
    content(&mut writer)?;
    let file = writer.into_inner().map_err(|failed| error(failed.into_error()))?;
    sync(&file).map_err(&error)?;
    // Some systems do not rename open files.
    drop(file);
    temporary.persist(path).map_err(|failed| error(failed.error))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        file_replace(&path, |writer| writer.write_all(b"old")).unwrap();
        let result = file_replace(&path, |writer| {
            writer.write_all(b"half of the ne")?;
            Err(io::Error::other("disk on fire"))
        });
        assert_eq!(result.unwrap_err().to_string(), "disk on fire");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_is_missing_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("file");
        let result = file_replace(&path, |writer| writer.write_all(b"new"));
        assert_eq!(result.unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
