//! Input files that are files, and output files that are either complete or absent, and never in the place of what is no file.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, BufWriter, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// How the name of a file begins that is not complete yet.
const PART_PREFIX: &str = ".cloth-";
/// How it ends.
const PART_SUFFIX: &str = ".part";

/// The files that this process is writing and has not renamed yet.
static PARTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Opens `path` for reading if it is a regular file, or a link that leads to one.
///
/// A scene from elsewhere can name what it likes: reading from a pipe waits for ever, and a device such as
/// `/dev/zero` has no end.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] for what is not a regular file, and those of the operating system.
pub fn file_open(path: &Path) -> io::Result<File> {
    file_open_with(path, OpenOptions::new().read(true))
}

/// Like [`file_open`], for more than reading: a file that is there, as `options` have it.
///
/// # Errors
///
/// As [`file_open`].
pub fn file_open_with(path: &Path, options: &OpenOptions) -> io::Result<File> {
    // Asked before it is opened, as opening a pipe waits for its writer, and again for what was put in its place.
    regular(path.metadata()?.is_file())?;
    let file = options.open(path)?;
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
/// then, also if the power fails. The new file has the permissions of that one.
///
/// # Errors
///
/// Those of `content`, of [`output_check`] and of the operating system.
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

/// Checks that an output may be written to `path`: nothing is there, or a file that can be written, in the same folder if the path
/// is a symbolic link. Returns the file that is meant, and its permissions if it is there.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] for a device, a pipe, a socket, or a link that leads out of its folder;
/// [`io::ErrorKind::IsADirectory`], [`io::ErrorKind::PermissionDenied`] for a file that is write-protected, and those of
/// the operating system.
pub fn output_check(path: &Path) -> io::Result<(PathBuf, Option<Permissions>)> {
    let refused = |problem: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    let mut target = path.to_owned();
    let mut metadata = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((target, None)),
        metadata => metadata?,
    };
    if metadata.is_symlink() {
        target = match fs::canonicalize(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return refused("it is a symbolic link that leads nowhere");
            }
            target => target?,
        };
        if !target.starts_with(fs::canonicalize(folder_of(path))?) {
            return refused("it is a symbolic link that leads out of its folder");
        }
        metadata = fs::metadata(&target)?;
    }
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    if !metadata.is_file() {
        return refused("it is a device, a pipe or a socket, not a file");
    }
    let permissions = metadata.permissions();
    if permissions.readonly() {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, "it is write-protected"));
    }
    Ok((target, Some(permissions)))
}

/// Removes the files in `folder` that processes which have ended left half written. Those that are being written are left alone.
///
/// # Errors
///
/// That of reading the folder, unless it is not there.
pub fn parts_remove(folder: &Path) -> io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        let is_part = path
            .file_name()
            .and_then(|name| name.to_str())
            .is_some_and(|name| name.starts_with(PART_PREFIX) && name.ends_with(PART_SUFFIX));
        if !is_part || !fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_file()) {
            continue;
        }
        // Whoever writes it holds a lock on it. What cannot be opened or removed is none of ours.
        let is_left = File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        if is_left {
            let _ = fs::remove_file(&path);
        }
    }
    Ok(())
}

/// Removes what this process is writing; for its end in the midst of that.
pub fn parts_abandon() {
    let mut parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
    for part in std::mem::take(&mut *parts) {
        let _ = fs::remove_file(part);
    }
}

/// A file that is being written, in the list of them.
struct Part(PathBuf);

impl Part {
    fn new(path: &Path) -> Self {
        PARTS.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        PARTS.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.0);
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn replace<E>(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    sync: impl FnOnce(&File) -> io::Result<()>,
    error: impl Fn(io::Error) -> E,
) -> Result<(), E> {
    let (target, permissions) = output_check(path).map_err(&error)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(PART_PREFIX).suffix(PART_SUFFIX);
    // Temporary files are private by default, but outputs follow the permissions of the folder.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(Permissions::from_mode(0o666));
    }
    let temporary = builder.tempfile_in(folder_of(&target)).map_err(&error)?;
    let _part = Part::new(temporary.path());
    let (file, temporary) = temporary.into_parts();
    // Tells `parts_remove` that somebody writes it; a file system without locks is no reason to refuse.
    let _ = file.try_lock();
    if let Some(permissions) = permissions {
        // Where that cannot be done the file is still worth having.
        let _ = file.set_permissions(permissions);
    }
    let mut writer = BufWriter::with_capacity(1 << 18, file);
    content(&mut writer)?;
    let file = writer.into_inner().map_err(|failed| error(failed.into_error()))?;
    sync(&file).map_err(&error)?;
    // Some systems do not rename open files.
    drop(file);
    temporary.persist(&target).map_err(|failed| error(failed.error))
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

    #[test]
    fn parts_of_the_dead_are_removed_and_those_of_the_living_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let dead = folder.path().join(".cloth-dead.part");
        let other = folder.path().join(".other.part");
        for path in [&dead, &other] {
            fs::write(path, "half").unwrap();
        }
        let path = folder.path().join("file");
        file_replace(&path, |writer| {
            parts_remove(folder.path())?;
            writer.write_all(b"whole")
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert!(!dead.exists() && other.exists());
        parts_remove(&folder.path().join("missing")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_plain_file_is_never_replaced() {
        use std::os::unix::{fs::symlink, net::UnixListener};

        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("runs")).unwrap();
        fs::write(at("mine"), "mine").unwrap();
        symlink(at("mine"), at("runs/out")).unwrap();
        symlink(at("nothing"), at("runs/nowhere")).unwrap();
        let _socket = UnixListener::bind(at("socket")).unwrap();
        let write = |path: &Path| file_replace(path, |writer| writer.write_all(b"new"));
        for (path, problem) in [
            (at("runs/out"), "leads out of its folder"),
            (at("runs/nowhere"), "leads nowhere"),
            (at("socket"), "a device, a pipe or a socket"),
            (at("runs"), "it is a folder"),
            ("/dev/null".into(), "a device, a pipe or a socket"),
        ] {
            let error = write(&path).unwrap_err().to_string();
            assert!(error.contains(problem), "{}: {error}", path.display());
        }
        assert_eq!(fs::read(at("mine")).unwrap(), b"mine");
        // A link within the folder goes on to lead to its file.
        fs::write(at("runs/there"), "old").unwrap();
        symlink("there", at("runs/here")).unwrap();
        write(&at("runs/here")).unwrap();
        assert!(fs::symlink_metadata(at("runs/here")).unwrap().is_symlink());
        assert_eq!(fs::read(at("runs/there")).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn modes_are_kept_and_protected_files_too() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let write = || file_replace(&path, |writer| writer.write_all(b"new"));
        for mode in [0o600, 0o640, 0o664, 0o755] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            write().unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, Permissions::from_mode(0o444)).unwrap();
        assert_eq!(write().unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }
}
