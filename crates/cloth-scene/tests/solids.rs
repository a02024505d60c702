//! Solids from mesh files, and when their distances are sampled.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{
    fs,
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};

use cloth_scene::{CompileOptions, CompileProgress, Scene, SceneShape, SceneSolidMesh};

/// A cube of side 2 around the origin, as OBJ.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

const SCENE: &str = "name = \"solid\"
contact.response = \"none\"
[[cloth]]
name = \"c\"
material.preset = \"denim\"
geometry.grid = { columns = 3, rows = 3, spacing = 0.1, centre = [0, 0, 5] }
[[collider]]
name = \"cube\"
shape.mesh = { file = \"cube.obj\", scale = 0.5, translation = [0, 0, 1], cells = 12 }
translation = [3, 0, 0]
";

fn folder(scene: &str) -> (tempfile::TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    let scene = scene_at(folder.path(), scene);
    (folder, scene)
}

fn scene_at(folder: &Path, text: &str) -> Scene {
    let path = folder.join("scene.toml");
    fs::write(&path, text).unwrap();
    Scene::read(&path).unwrap()
}

#[test]
fn a_collider_comes_from_a_mesh_file() {
    let (_folder, scene) = folder(SCENE);
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    let cloth_core::ColliderShape::Grid(grid) = &compiled.model.colliders()[0].shape else {
        panic!()
    };
    // A cube of side 1 around (0, 0, 1) of its own frame.
    for (point, distance) in
        [([0.0, 0.0, 1.0], -0.5), ([0.0, 0.0, 1.5], 0.0), ([0.0, 0.52, 1.0], 0.02)]
    {
        let found = grid.distance_at(point, 0.0);
        assert!((found - distance).abs() < 0.05, "{point:?}: {found}");
    }
    assert!((grid.spacing - 1.0 / 12.0).abs() < 1e-12, "12 samples along the side");
}

#[test]
fn a_rigid_body_comes_from_a_mesh_file() {
    let text = SCENE.replace("[[collider]]", "[[rigid]]\nmass = 2");
    let (_folder, scene) = folder(&text);
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!((compiled.rigids.len(), compiled.model.colliders().len()), (1, 1));
}

#[test]
fn both_languages_have_words_for_solids_from_files() {
    let (_folder, scene) = folder(SCENE);
    let SceneShape::Mesh(mesh) = &scene.colliders[0].shape else { panic!() };
    assert_eq!(
        *mesh,
        SceneSolidMesh {
            scale: Some(0.5),
            translation: Some([0.0, 0.0, 1.0]),
            cells: Some(12),
            ..SceneSolidMesh::file("cube.obj")
        }
    );
    let fysl = scene.to_fysl().unwrap();
    assert!(fysl.contains("<mesh_file file=\"cube.obj\""), "{fysl}");
    assert_eq!(Scene::from_fysl(&fysl, "s.fysl").unwrap(), scene, "{fysl}");
    let toml = scene.to_toml().unwrap();
    assert_eq!(Scene::from_toml(&toml, "s.toml").unwrap(), scene, "{toml}");
    // Vertices in the scene itself can be scaled, too.
    let inline = "shape.mesh = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], \
                  faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], scale = 2, \
                  rotation = { axis = [0, 0, 1], degrees = 90 } }";
    let line = SCENE.lines().find(|line| line.starts_with("shape")).unwrap();
    let scene = Scene::from_toml(&SCENE.replace(line, inline), "s.toml").unwrap();
    let fysl = scene.to_fysl().unwrap();
    assert_eq!(Scene::from_fysl(&fysl, "s.fysl").unwrap(), scene, "{fysl}");
    scene.compile(&CompileOptions::default()).unwrap();
}

#[test]
fn a_solid_has_a_file_or_vertices() {
    for (from, to, expected) in [
        ("file = \"cube.obj\", ", "", "has no `file`: give it, or `vertices` and `faces`"),
        ("cells = 12", "faces = [[0, 1, 2]]", "has a `file` and `vertices` or `faces`: remove one"),
        ("cells = 12", "cells = 3", "`collider[0].shape.mesh.cells` is 3: give 4 to 400"),
        ("cells = 12", "cells = 401", "is 401: give 4 to 400"),
        ("scale = 0.5", "scale = 0", "`collider[0].shape.mesh.scale` is 0"),
        ("cube.obj", "../cube.obj", "not a plain path below the folder of the scene"),
        ("cube.obj", "none.obj", "check the path"),
    ] {
        let (_folder, scene) = folder(&SCENE.replace(from, to));
        let message = scene.compile(&CompileOptions::default()).unwrap_err().to_string();
        assert!(message.contains("line 9, column ") && message.contains(expected), "{message}");
    }
}

#[test]
fn progress_counts_every_sample_once() {
    let (_folder, scene) = folder(SCENE);
    let [calls, most, total] = [(); 3].map(|()| AtomicU64::new(0));
    let progress = |now: CompileProgress| {
        calls.fetch_add(1, Ordering::Relaxed);
        most.fetch_max(now.done, Ordering::Relaxed);
        total.store(now.total, Ordering::Relaxed);
    };
    let watched = scene.compile_watched(&CompileOptions::default(), &progress).unwrap();
    let cloth_core::ColliderShape::Grid(grid) = &watched.model.colliders()[0].shape else {
        panic!()
    };
    let [calls, most, total] = [calls, most, total].map(AtomicU64::into_inner);
    assert_eq!((most, total), (grid.samples() as u64, grid.samples() as u64));
    assert!(calls >= 10, "told {calls} times only");
    let again = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!(again.model.fingerprint(), watched.model.fingerprint(), "the same bits");
}

/// What is wrong elsewhere in the scene is found before any distance is sampled.
#[test]
fn errors_are_found_before_distances_are_sampled() {
    let cases = [
        ("spacing = 0.1", "spacing = -0.1"),
        ("material.preset = \"denim\"", "material.preset = \"denim\"\npins = [\"nowhere\"]"),
        ("material.preset = \"denim\"", "material.preset = \"denim\"\npins = [99]"),
        (
            "geometry.grid = { columns = 3, rows = 3, spacing = 0.1, centre = [0, 0, 5] }",
            "geometry.mesh.file = \"open.obj\"\n",
        ),
        ("translation = [3, 0, 0]", "translation = [3, 0, 0]\nfriction = -1"),
        (
            "translation = [3, 0, 0]",
            "translation = [3, 0, 0]\n[[collider]]\nname = \"cube\"\nshape.sphere.radius = 1",
        ),
        (
            "translation = [3, 0, 0]",
            "translation = [3, 0, 0]\n[[collider]]\nname = \"lid\"\nshape.mesh.file = \"open.obj\"",
        ),
        (
            "translation = [3, 0, 0]",
            "translation = [3, 0, 0]\n[[event]]\ntime = 1\ncloth = \"c\"\npins = [0]\naction = \"release\"",
        ),
    ];
    for (from, to) in cases {
        let (folder, scene) = folder(&SCENE.replace(from, to));
        // Two triangles of one vertex alone: no cloth, and no solid.
        let open = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nf 1 2 3\nf 3 2 4\nf 2 3 5\n";
        fs::write(folder.path().join("open.obj"), open).unwrap();
        let watched =
            scene.compile_watched(&CompileOptions::default(), &|_| panic!("sampled: {to}"));
        assert!(watched.is_err(), "{to}");
    }
}
