//! `cargo xtask package`: whether every crate could be published, and how little a game must take of the facade.

use std::{
    collections::BTreeSet,
    fs,
    path::{Component, Path, PathBuf},
};

use crate::command::{self, cargo};

/// Packages that are tools of the repository and stay in it.
const KEPT: [&str; 3] = ["cloth-benches", "cloth-tests", "xtask"];

/// Crates that the facade may bring without its default features but with the backend for processors, itself included.
const CRATES_MAX: usize = 60;

/// Checks both.
///
/// # Errors
/// Why it failed.
pub(crate) fn check() -> Result<(), String> {
    let mut package = cargo(&["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"]);
    for name in KEPT {
        package.args(["--exclude", name]);
    }
    command::run(&mut package)?;
    for (name, folder) in published()? {
        let packed = lines(&["package", "--list", "--allow-dirty", "--package", &name])?;
        let packed: BTreeSet<PathBuf> = packed.into_iter().map(PathBuf::from).collect();
        for file in packed.iter().filter(|file| file.extension().is_some_and(|e| e == "rs")) {
            let path = folder.join(file);
            let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            if let Some(missing) = included(file, &text).find(|path| !packed.contains(path)) {
                let (file, missing) = (file.display(), missing.display());
                return Err(format!(
                    "{name}: {file} includes {missing}, which is not in the package"
                ));
            }
        }
    }
    for features in ["", "cpu"] {
        let count = crates_of(features)?;
        println!("cloth --no-default-features --features \"{features}\": {count} crates");
        if count > CRATES_MAX {
            return Err(format!("the facade brings {count} crates, more than {CRATES_MAX}"));
        }
    }
    Ok(())
}

/// Checks both; whether all is well.
pub(crate) fn run() -> bool {
    check().inspect_err(|reason| eprintln!("package: {reason}")).is_ok()
}

/// The packages that are published, and their folders.
fn published() -> Result<Vec<(String, PathBuf)>, String> {
    let text = lines(&["metadata", "--no-deps", "--format-version", "1"])?.concat();
    let metadata: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| error.to_string())?;
    let packages = metadata["packages"].as_array().ok_or("cargo metadata has no packages")?;
    let word = |package: &serde_json::Value, key: &str| package[key].as_str().map(str::to_owned);
    let found = packages.iter().filter_map(|package| {
        let manifest = PathBuf::from(word(package, "manifest_path")?);
        Some((word(package, "name")?, manifest.parent()?.to_owned()))
    });
    Ok(found.filter(|(name, _)| !KEPT.contains(&name.as_str())).collect())
}

/// Files that a source includes, relative to the folder of its package; those outside of it keep their `..`.
fn included<'a>(file: &'a Path, text: &'a str) -> impl Iterator<Item = PathBuf> + 'a {
    let names = ["include_str!(\"", "include_bytes!(\"", "include!(\""];
    let found = names.into_iter().flat_map(move |name| text.split(name).skip(1));
    found.filter_map(|rest| rest.split('"').next()).map(|path| {
        let mut place = file.parent().unwrap_or(Path::new("")).to_owned();
        for part in Path::new(path).components() {
            match part {
                Component::ParentDir if place.file_name().is_some() => {
                    place.pop();
                }
                Component::CurDir => {}
                part => place.push(part),
            }
        }
        place
    })
}

/// How many crates the facade and these features of it bring on this system.
fn crates_of(features: &str) -> Result<usize, String> {
    let tree = ["tree", "--package", "cloth", "--no-default-features", "--features", features];
    let form = ["--edges", "normal", "--prefix", "none", "--format", "{p}"];
    let lines = lines(&[&tree[..], &form[..]].concat())?;
    Ok(distinct(&lines))
}

/// Different crates in the lines of a tree; later sights of one are marked with a star.
fn distinct(lines: &[String]) -> usize {
    let names = lines.iter().map(|line| line.split(" (").next().unwrap_or(line).trim());
    names.filter(|name| !name.is_empty()).collect::<BTreeSet<_>>().len()
}

fn lines(arguments: &[&str]) -> Result<Vec<String>, String> {
    let output = cargo(arguments).output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn included_files_are_found_where_they_are() {
        let text =
            r#"include_str!("../a.md") include_bytes!("b.png") include_str!("../../../c.md")"#;
        let found: Vec<_> = included(Path::new("src/lib.rs"), text).collect();
        assert_eq!(found, ["a.md", "../../c.md", "src/b.png"].map(PathBuf::from));
    }

    #[test]
    fn a_crate_counts_once() {
        let lines = ["cloth v1 (/here)", "glam v2", "syn v2 (proc-macro)", "syn v3", "glam v2 (*)"];
        assert_eq!(distinct(&lines.map(str::to_owned)), 4);
    }

    /// A game takes the engine without file formats, rapier and pictures.
    #[test]
    fn the_facade_alone_is_small() {
        let [none, cpu] = ["", "cpu"].map(|features| crates_of(features).unwrap());
        assert!(none < cpu && cpu <= CRATES_MAX, "{none} and {cpu} crates");
        let tree = ["tree", "-p", "cloth", "--no-default-features", "--features", "cpu,wgpu,cuda"];
        let heavy = ["rapier3d-f64", "gltf", "image", "toml", "retrofire-core"];
        for line in lines(&tree).unwrap() {
            assert!(heavy.iter().all(|name| !line.contains(&format!(" {name} v"))), "{line}");
        }
    }
}
