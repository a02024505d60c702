//! Reference programs: one C++ source each, compiled and run beside ours.

use std::{
    collections::HashMap,
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// A row of the table that a reference prints: column to value.
pub type ReferenceRow = HashMap<String, String>;

/// The source that the variable `CLOTH_REFERENCE` names, compiled in `folder`; `None` without the
/// variable.
///
/// # Errors
/// If there is no such file, no compiler, or it does not compile.
pub fn reference_build(folder: &Path) -> Result<Option<PathBuf>, Box<dyn Error>> {
    let Some(source) = env::var_os("CLOTH_REFERENCE").map(PathBuf::from) else { return Ok(None) };
    if !source.is_file() {
        return Err(format!("CLOTH_REFERENCE: there is no file {}", source.display()).into());
    }
    fs::create_dir_all(folder)?;
    let program = folder.join("reference");
    let status = Command::new("c++")
        .args(["-O3", "-march=native", "-o"])
        .arg(&program)
        .arg(&source)
        .status()
        .map_err(|error| format!("c++ cannot be started ({error}): install a C++ compiler"))?;
    if !status.success() {
        return Err(format!("c++ could not compile {}", source.display()).into());
    }
    Ok(Some(program))
}

/// Runs the reference with `seconds` for each of its cases, and reads the CSV table it prints.
///
/// # Errors
/// If it cannot be run, or a column of `columns` is missing in what it prints.
pub fn reference_run(
    program: &Path,
    seconds: u32,
    columns: &[&str],
) -> Result<Vec<ReferenceRow>, Box<dyn Error>> {
    let output = Command::new(program).arg(seconds.to_string()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    if let Some(missing) = columns.iter().find(|column| !names.contains(column)) {
        return Err(format!("the reference prints no column {missing}").into());
    }
    let row = |line: &str| {
        names
            .iter()
            .zip(line.split(','))
            .map(|(name, value)| ((*name).into(), value.into()))
            .collect()
    };
    Ok(lines.map(row).collect())
}
