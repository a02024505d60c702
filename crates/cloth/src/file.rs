//! Output files that are either complete or absent.

use std::{
    io::{self, BufWriter},
    path::Path,
};

use tempfile::NamedTempFile;

/// Writes `path` through a temporary file in the same folder, which is renamed into place when it
/// is complete and on the disk: nobody ever sees half a file, and a file from before stays until
/// then.
///
/// # Errors
/// Those of `content` and of the operating system.
pub fn file_replace(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<NamedTempFile>) -> io::Result<()>,
) -> io::Result<()> {
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
    let mut writer = BufWriter::with_capacity(1 << 18, builder.tempfile_in(folder)?);
    content(&mut writer)?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_data()?;
    file.persist(path)?;
    Ok(())
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
}
