//! Scenes with meshes from files.

use std::{fs, path::Path};

use cloth_scene::{CompileOptions, Scene, SceneError};

const SQUARE: &str = "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

fn scene(file: &str) -> String {
    format!(
        "name = \"mesh\"\n[[cloth]]\nname = \"square\"\npins = [3]\nmaterial.preset = \"denim\"\n\
         [cloth.geometry.mesh]\nfile = {file:?}\nscale = 2\ntranslation = [0, 0, 5]\n\
         rotation = {{ axis = [1, 0, 0], degrees = 90 }}\n"
    )
}

fn write(folder: &Path, file: &str) -> Scene {
    let path = folder.join("scene.toml");
    fs::write(&path, scene(file)).unwrap_or_else(|error| panic!("{error}"));
    Scene::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_mesh_is_scaled_turned_and_moved() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("meshes")).unwrap();
    fs::write(folder.path().join("meshes/square.obj"), SQUARE).unwrap();
    let scene = write(folder.path(), "meshes/square.obj");
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    let far = compiled.model.positions()[2];
    for (found, wanted) in far.iter().zip([2.0, 0.0, 7.0]) {
        assert!((found - wanted).abs() < 1e-12, "{far:?}");
    }
    assert_eq!(compiled.model.pins(), [3]);
    assert_eq!(compiled.texture(0).unwrap().coordinates[2], [1.0, 1.0]);
    assert!(scene.memory_estimate(&CompileOptions::default()).particles > 0);
}

#[test]
fn meshes_stay_below_the_folder_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let [scenes, meshes] = ["scenes", "meshes"].map(|name| folder.path().join(name));
    fs::create_dir(&scenes).unwrap();
    fs::create_dir(&meshes).unwrap();
    let mesh = meshes.join("square.obj");
    fs::write(&mesh, SQUARE).unwrap();
    let absolute = mesh.display().to_string();
    let rooted = CompileOptions { mesh_roots: vec![meshes.clone()], ..CompileOptions::default() };
    let anywhere = CompileOptions { mesh_anywhere: true, ..CompileOptions::default() };
    let climbing = meshes.join("../meshes/square.obj").display().to_string();

    for file in ["../meshes/square.obj", "a/../../meshes/square.obj", &absolute, &climbing] {
        let error = write(&scenes, file).compile(&CompileOptions::default()).unwrap_err();
        assert!(matches!(error, SceneError::MeshOutside { .. }), "{file}: {error}");
        assert!(error.to_string().contains("line 7, "), "{error}");
    }
    assert!(write(&scenes, "square.obj").compile(&rooted).is_ok(), "found in the root");
    assert!(write(&scenes, &absolute).compile(&rooted).is_ok(), "absolute, below the root");
    assert!(write(&scenes, &climbing).compile(&rooted).is_err(), "climbs out of the root");
    assert!(write(&scenes, "../meshes/square.obj").compile(&anywhere).is_ok());
}

#[test]
fn errors_of_a_mesh_name_both_files() {
    let folder = tempfile::tempdir().unwrap();
    let missing = write(folder.path(), "none.obj").compile(&CompileOptions::default()).unwrap_err();
    let message = missing.to_string();
    assert!(message.contains("scene.toml`, line 7, "), "{message}");
    assert!(message.contains("none.obj"), "{message}");

    let folded = format!("{SQUARE}f 3/3 1/1 2/2\n");
    fs::write(folder.path().join("folded.obj"), folded).unwrap();
    let error = write(folder.path(), "folded.obj").compile(&CompileOptions::default()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("triangles 0 and 2 have the same vertices"), "{message}");
    assert!(message.contains("line 6, "), "the table of the geometry: {message}");
}
