//! The meshes of a scene in the folder of its run. With them the folder is complete: it can be moved, converted after the
//! meshes have changed, and nobody has to read what lies outside of it.

use std::{
    collections::BTreeSet,
    fs,
    path::{Component, Path, PathBuf},
};

use cloth::{
    io::file_read,
    scene::{CompileOptions, Scene},
};
use percent_encoding::percent_decode_str;
use toml::{Table, Value};

use super::{text_read, text_write};
use crate::failure::{Failure, ReadError, WriteError};

/// Keys that name a file.
const FILE_KEYS: [&str; 4] = ["file", "sheet", "cache", "rest"];

/// Folder of the meshes.
const FOLDER: &str = "meshes";

/// A file and where its copy goes, below the folder of the run.
pub(super) type Copy = (PathBuf, PathBuf);

/// The text of a scene with all its values whose meshes are in the folder of its run, and the files that must be copied there.
pub(super) fn rewritten(
    scene: &Scene,
    options: &CompileOptions,
) -> Result<(String, Vec<Copy>), Failure> {
    let mut table: Table = scene.to_toml()?.parse().map_err(Failure::other)?;
    let mut files = Vec::new();
    let mut number = 0;
    for (_, value) in &mut table {
        visit(value, &mut |mesh| {
            let to = Path::new(FOLDER).join(number.to_string());
            number += 1;
            mesh_rewrite(mesh, &to, &scene.origin.directory, options, &mut files);
        });
    }
    Ok((toml::to_string(&table).map_err(Failure::other)?, files))
}

/// Calls `found` with every table that names a mesh file, or the sheet of a laboratory.
fn visit(value: &mut Value, found: &mut impl FnMut(&mut Table)) {
    match value {
        Value::Table(table) => {
            if FILE_KEYS.iter().any(|key| matches!(table.get(*key), Some(Value::String(_)))) {
                found(table);
            }
            table.iter_mut().for_each(|(_, value)| visit(value, found));
        }
        Value::Array(values) => values.iter_mut().for_each(|value| visit(value, found)),
        _ => {}
    }
}

/// Names the copy below `to` in place of the file; an animation has a file for each of its numbers.
fn mesh_rewrite(
    mesh: &mut Table,
    to: &Path,
    directory: &Path,
    options: &CompileOptions,
    files: &mut Vec<Copy>,
) {
    for key in FILE_KEYS {
        if let Some(file) = mesh.get(key).and_then(Value::as_str).map(str::to_owned) {
            // Files of one name may lie in different folders.
            let to = if ["cache", "rest"].contains(&key) { to.join(key) } else { to.into() };
            file_rewrite(mesh, (key, &file), &to, &|file| place(directory, file, options), files);
        }
    }
}

fn file_rewrite(
    mesh: &mut Table,
    (key, file): (&str, &str),
    to: &Path,
    place: &dyn Fn(&str) -> PathBuf,
    files: &mut Vec<Copy>,
) {
    let Some(name) = Path::new(file).file_name().and_then(|name| name.to_str()) else { return };
    let integer = |key: &str| mesh.get(key).and_then(Value::as_integer);
    let numbers: Vec<Option<i64>> = match (integer("first"), integer("frames")) {
        (Some(first), Some(frames)) if file.contains("{}") => {
            (first..first.saturating_add(frames)).map(Some).collect()
        }
        _ => vec![None],
    };
    for number in numbers {
        let numbered = |text: &str| match number {
            Some(number) => text.replace("{}", &number.to_string()),
            None => text.to_owned(),
        };
        files.push((place(&numbered(file)), to.join(numbered(name))));
    }
    // A path of the scene has strokes on every system.
    let parts: Vec<_> = to.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    mesh.insert(key.into(), Value::String(format!("{}/{name}", parts.join("/"))));
}

/// Where compiling the scene finds the mesh `file`, which it did.
fn place(directory: &Path, file: &str, options: &CompileOptions) -> PathBuf {
    let roots = options.mesh_roots.iter().map(|root| root.join(file));
    let mut places = std::iter::once(directory.join(file)).chain(roots);
    places.find(|path| path.exists()).unwrap_or_else(|| directory.join(file))
}

/// Copies meshes and what they refer to into the folder of a run. A copy that is there already is that of this run.
pub(super) fn copy(files: &[Copy], root: &Path) -> Result<(), Failure> {
    for (from, to) in files {
        let to = root.join(to);
        if to.exists() {
            continue;
        }
        let folder = to.parent().unwrap_or(root);
        fs::create_dir_all(folder).map_err(WriteError::of(folder))?;
        fs::copy(from, &to).map_err(ReadError::of(from))?;
        for buffer in buffers(from) {
            let to = folder.join(&buffer);
            let below = to.parent().unwrap_or(folder);
            fs::create_dir_all(below).map_err(WriteError::of(below))?;
            let from = from.with_file_name("").join(&buffer);
            fs::copy(&from, &to).map_err(ReadError::of(&from))?;
        }
    }
    Ok(())
}

/// Removes the meshes of an earlier run, which its scene names.
pub(super) fn remove(root: &Path) -> Result<(), WriteError> {
    let Ok(text) = text_read(&root.join("scene.toml")) else { return Ok(()) };
    let Ok(mut table) = text.parse::<Table>() else { return Ok(()) };
    let mut folders = BTreeSet::new();
    for (_, value) in &mut table {
        visit(value, &mut |mesh| {
            let file = FILE_KEYS.iter().find_map(|key| mesh.get(*key)?.as_str()).map(Path::new);
            // Nothing else but a folder with a number, as `rewritten` gives it.
            if let Some(folder) = file.and_then(Path::parent)
                && folder.parent() == Some(Path::new(FOLDER))
                && folder.file_name().is_some_and(|n| n.to_string_lossy().parse::<u32>().is_ok())
            {
                folders.insert(root.join(folder));
            }
        });
    }
    let real = |folder: &PathBuf| fs::symlink_metadata(folder).is_ok_and(|m| m.is_dir());
    for folder in folders.iter().filter(|folder| real(folder)) {
        fs::remove_dir_all(folder).map_err(WriteError::of(folder))?;
    }
    Ok(())
}

/// Files beside a glTF mesh with its numbers, or beside a laboratory sheet with its curves, by their relative paths; other meshes are in
/// one file.
fn buffers(mesh: &Path) -> Vec<PathBuf> {
    let is_sheet = mesh.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if is_sheet {
        return curves(mesh);
    }
    let is_gltf = mesh.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gltf"));
    let text = if is_gltf { file_read(mesh, u64::MAX).unwrap_or_default() } else { Vec::new() };
    let Ok(json) = serde_json::from_slice::<serde_json::Value>(&text) else { return Vec::new() };
    let buffers = json["buffers"].as_array().into_iter().flatten();
    let names = buffers.filter_map(|buffer| {
        let uri = buffer["uri"].as_str().filter(|uri| !uri.starts_with("data:"))?;
        Some(PathBuf::from(percent_decode_str(uri).decode_utf8().ok()?.into_owned()))
    });
    let is_below = |path: &PathBuf| {
        path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
    };
    names.filter(is_below).collect()
}

/// The curves that a laboratory sheet names.
fn curves(sheet: &Path) -> Vec<PathBuf> {
    let Ok(text) = text_read(sheet) else { return Vec::new() };
    let Ok(table) = text.parse::<Table>() else { return Vec::new() };
    let curve = |thread: &str| table.get(thread)?.get("curve")?.as_str();
    let names = ["warp", "weft"].into_iter().filter_map(curve).map(PathBuf::from);
    let is_plain =
        |path: &PathBuf| path.components().all(|part| matches!(part, Component::Normal(_)));
    names.filter(is_plain).collect()
}

/// Writes `text`, the scene of a run that continues another.
pub(super) fn scene_text_write(path: &Path, text: &str) -> Result<(), Failure> {
    text_write(path, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
        name = "meshed"
        [[cloth]]
        name = "shirt"
        geometry.mesh.file = "models/shirt.gltf"
        material.sheet = "lab/sheet.toml"
        [[collider]]
        name = "body"
        shape.animation = { file = "walk/body-{}.obj", first = 3, frames = 2, rate = 30, rest = "rest.obj", blend = 1.0 }
    "#;

    #[test]
    fn meshes_are_named_and_copied_into_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let gltf = r#"{ "buffers": [{ "uri": "a%20b.bin" }, { "uri": "data:,x" }, { "uri": "../c.bin" }] }"#;
        for (name, content) in [
            ("models/shirt.gltf", gltf),
            ("models/a b.bin", "numbers"),
            ("walk/body-3.obj", "three"),
            ("walk/body-4.obj", "four"),
            ("rest.obj", "rest"),
            (
                "lab/sheet.toml",
                "W = 12\n[warp]\ncurve = \"warp.csv\"\n[weft]\ncurve = \"../weft.csv\"\n",
            ),
            ("lab/warp.csv", "0.0, 0.0"),
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), content).unwrap();
        }
        let mut scene = Scene::from_toml(SCENE, "scene.toml").unwrap();
        scene.origin.directory = place.path().to_owned();
        let (text, files) = rewritten(&scene, &CompileOptions::default()).unwrap();
        assert!(text.contains("\"meshes/0/shirt.gltf\""), "{text}");
        assert!(text.contains("\"meshes/1/sheet.toml\""), "{text}");
        assert!(text.contains("\"meshes/2/body-{}.obj\""), "{text}");
        let run = at("run");
        copy(&files, &run).unwrap();
        let read = |name: &str| fs::read_to_string(run.join("meshes").join(name)).unwrap();
        assert_eq!(read("0/shirt.gltf"), gltf);
        let copies = ["0/a b.bin", "1/warp.csv", "2/body-3.obj", "2/body-4.obj", "2/rest/rest.obj"]
            .map(read);
        assert_eq!(copies, ["numbers", "0.0, 0.0", "three", "four", "rest"]);
        fs::write(run.join("scene.toml"), text).unwrap();
        fs::write(run.join("meshes/mine.obj"), "mine").unwrap();
        remove(&run).unwrap();
        assert!(!run.join("meshes/0").exists() && !run.join("meshes/1").exists());
        assert!(run.join("meshes/mine.obj").exists());
    }
}
