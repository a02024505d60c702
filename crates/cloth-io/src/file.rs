//! Input files that are files, and output files that are either complete or absent.

use std::fs::File;
use std::io::{self, BufWriter, Read};
use std::path::Path;

/// Opens `path` for reading if it is a regular file, or a link that leads to one.
///
/// A scene from elsewhere can name what it likes: reading from a pipe waits for ever, and a device such as
/// `/dev/zero` has no end.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] for what is not a regular file, and those of the operating system.
pub fn file_open(path: &Path) -> io::Result<File> {
    // Asked before it is opened, as opening a pipe waits for its writer, and again for what was put in its place.
    regular(path.metadata()?.is_file())?;
    let file = File::open(path)?;
    regular(file.metadata()?.is_file())?;
    Ok(file)
}

/// The first `limit` bytes of the regular file `path`, or all of it if it is shorter.
///
/// # Errors
///
/// As [`file_open`], and [`io::ErrorKind::OutOfMemory`] if there is no memory for so many bytes.
pub fn file_read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = file_open(path)?;
    let length = file.metadata()?.len().min(limit);
    let mut bytes = Vec::new();
    // Asked for at once: memory that is short is an error here, and the end of the program later on.
    let room = usize::try_from(length).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(room).map_err(|_| io::ErrorKind::OutOfMemory)?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn regular(is_file: bool) -> io::Result<()> {
    let problem = "it is a folder, a pipe or a device and not a regular file";
    if is_file { Ok(()) } else { Err(io::Error::new(io::ErrorKind::InvalidInput, problem)) }
}

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
    fn no_more_of_a_file_is_read_than_was_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, b"content").unwrap();
        assert_eq!(file_read(&path, 4).unwrap(), b"cont");
        assert_eq!(file_read(&path, u64::MAX).unwrap(), b"content");
    }

    #[test]
    fn only_regular_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| {
            let error = file_read(path, 100).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
            assert!(error.to_string().contains("not a regular file"), "{error}");
        };
        refused(folder.path());
        #[cfg(unix)]
        {
            let link = folder.path().join("zero.obj");
            std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
            refused(&link);
            let pipe = folder.path().join("pipe");
            let made = std::process::Command::new("mkfifo").arg(&pipe).status();
            assert!(made.unwrap().success());
            refused(&pipe);
            // A link to a file is as good as the file.
            let file = folder.path().join("file");
            std::fs::write(&file, b"content").unwrap();
            let link = folder.path().join("link");
            std::os::unix::fs::symlink(&file, &link).unwrap();
            assert_eq!(file_read(&link, 100).unwrap(), b"content");
        }
    }

    #[test]
    fn a_folder_that_is_missing_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("file");
        let result = file_replace(&path, |writer| writer.write_all(b"new"));
        assert_eq!(result.unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
