//! What is left behind: results.json to compare with and to make a README of, results.csv (and linear.csv) for other tools, and one
//! page with everything, that needs no other file.

pub(crate) mod compare;
mod csv;
mod linear;
mod page;
mod plots;
pub(crate) mod readme;
pub(crate) mod summary;
mod tables;

use std::{error::Error, fs, path::Path};

use crate::record::{FORMAT, Results};

/// Makes the folder, and tries whether it can be written.
///
/// # Errors
/// If it cannot, with its path.
pub(crate) fn prepare(folder: &Path) -> Result<(), Box<dyn Error>> {
    let attempt = || {
        fs::create_dir_all(folder)?;
        let probe = folder.join(".writable");
        fs::write(&probe, b"")?;
        fs::remove_file(probe)
    };
    attempt().map_err(|error| {
        format!(
            "{}: results cannot be written there ({error}); choose another --out",
            folder.display()
        )
        .into()
    })
}

/// Writes all files.
///
/// # Errors
/// If one cannot be written.
pub(crate) fn write(folder: &Path, results: &Results) -> Result<(), Box<dyn Error>> {
    fs::write(folder.join("results.json"), serde_json::to_vec_pretty(results)?)?;
    fs::write(folder.join("results.csv"), csv::text(results)?)?;
    if !results.linear.is_empty() {
        fs::write(folder.join("linear.csv"), linear::csv(results)?)?;
    }
    fs::write(folder.join("index.html"), page::html(results)?)?;
    Ok(())
}

/// Reads a results.json.
///
/// # Errors
/// If there is none, or it is of another program.
pub(crate) fn read(path: &Path) -> Result<Results, Box<dyn Error>> {
    let with_path = |error: &dyn Error| format!("{}: {error}", path.display());
    let text = fs::read_to_string(path).map_err(|error| with_path(&error))?;
    let results: Results = serde_json::from_str(&text).map_err(|error| {
        format!("{} (a results.json of this program is needed)", with_path(&error))
    })?;
    if results.format != FORMAT {
        let found = results.format;
        return Err(format!("{}: format {found}, but {FORMAT} is needed", path.display()).into());
    }
    Ok(results)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_below_a_file_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let error = prepare(&file.join("out")).unwrap_err().to_string();
        assert!(error.contains("file/out") && error.contains("--out"), "{error}");
    }

    #[test]
    fn what_is_not_results_is_refused_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.json");
        assert!(read(&path).unwrap_err().to_string().contains("results.json"));
        fs::write(&path, "{\"format\": 1").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("results.json"));
    }
}
