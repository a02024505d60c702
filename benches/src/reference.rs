//! Reference programs: one C++ source each, in the folder `reference`, compiled and run beside ours.

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

/// The program that ours is measured beside, compiled in `folder`: that of this name, such as `explicit`, or the source that
/// the variable `CLOTH_REFERENCE` names; `None` if it says `none`.
///
/// # Errors
/// As [`reference_build`].
pub fn reference_chosen(name: &str, folder: &Path) -> Result<Option<PathBuf>, Box<dyn Error>> {
    match env::var_os("CLOTH_REFERENCE") {
        Some(word) if word == "none" => Ok(None),
        Some(source) => reference_build(Path::new(&source), folder).map(Some),
        None => reference_build(&reference_source(name), folder).map(Some),
    }
}

/// The source of a program of this repository.
#[must_use]
pub fn reference_source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference").join(format!("{name}.cpp"))
}

/// A source, compiled in `folder` by the compiler that `CXX` names, or `c++`.
///
/// # Errors
/// If there is no such file, no compiler, or it does not compile.
pub fn reference_build(source: &Path, folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    if !source.is_file() {
        return Err(format!("there is no reference program {}", source.display()).into());
    }
    fs::create_dir_all(folder)?;
    let program = folder.join(source.file_stem().unwrap_or(source.as_os_str()));
    let compiler = env::var_os("CXX").unwrap_or_else(|| "c++".into());
    let status = Command::new(&compiler)
        .args(["-std=c++17", "-O3", "-march=native", "-o"])
        .arg(&program)
        .arg(source)
        .status()
        .map_err(|error| {
            let name = compiler.display();
            format!("{name} cannot be started ({error}): install a C++ compiler, or set CLOTH_REFERENCE=none")
        })?;
    if !status.success() {
        return Err(format!("{} could not compile {}", compiler.display(), source.display()).into());
    }
    Ok(program)
}

/// Positions \[m\] that a program of this repository ends with, when it is given these words.
///
/// # Errors
/// If it cannot be run, or prints something else.
pub fn reference_state(program: &Path, words: &[&str]) -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let output = Command::new(program).arg("state").args(words).output()?;
    if !output.status.success() {
        return Err(format!("{} ended with {}", program.display(), output.status).into());
    }
    let number = |word: Option<&str>| -> Result<f64, Box<dyn Error>> {
        Ok(word.ok_or("the reference prints too few numbers")?.parse()?)
    };
    let text = String::from_utf8(output.stdout)?;
    text.lines()
        .map(|line| {
            let mut words = line.split(' ');
            Ok([number(words.next())?, number(words.next())?, number(words.next())?])
        })
        .collect()
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
