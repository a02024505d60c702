//! Scenes with meshes from files.

use std::{fs, path::Path};

use cloth_scene::{
    CompileOptions, MemoryEstimate, Scene, SceneContact, SceneContactResponse, SceneError,
    SceneModel,
};

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
}

/// A square of `side` x `side` vertices as OBJ text and as binary PLY.
fn square_files(folder: &Path, side: u32) {
    let mut obj = String::new();
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        side * side,
        2 * (side - 1) * (side - 1),
    )
    .into_bytes();
    for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
        obj += &format!("v {column} {row} 0\n");
        for coordinate in [column as f32, row as f32, 0.0] {
            ply.extend(coordinate.to_le_bytes());
        }
    }
    for (row, column) in (1..side).flat_map(|row| (1..side).map(move |column| (row, column))) {
        let [above, below] = [row * side + column, (row - 1) * side + column];
        for [a, b, c] in [[below - 1, below, above], [below - 1, above, above - 1]] {
            obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
            ply.push(3);
            ply.extend([a, b, c].into_iter().flat_map(u32::to_le_bytes));
        }
    }
    fs::write(folder.join("square.obj"), obj).unwrap_or_else(|error| panic!("{error}"));
    fs::write(folder.join("square.ply"), ply).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn the_memory_of_a_mesh_is_estimated_from_its_vertices() {
    let folder = tempfile::tempdir().unwrap();
    square_files(folder.path(), 30);
    for file in ["square.obj", "square.ply"] {
        let mut scene = write(folder.path(), file);
        scene.cloths[0].model = Some(SceneModel::Springs);
        let compiled = scene.compile(&CompileOptions::default()).unwrap();
        scene.contact = Some(SceneContact {
            distance: Some(0.5),
            response: SceneContactResponse::Impulse { friction: 0.0, restitution: 0.0 },
            ..SceneContact::default()
        });
        scene.simulation.time_step = Some(1e-3);
        let estimate = scene.memory_estimate(&CompileOptions::default());
        assert_eq!(estimate.particles, compiled.model.particle_count() as u64, "{file}");
        let per_particle = estimate.bytes / estimate.particles;
        assert!((740..=820).contains(&per_particle), "{file}: {per_particle} bytes");
    }
    let missing = write(folder.path(), "none.obj");
    assert_eq!(missing.memory_estimate(&CompileOptions::default()), MemoryEstimate::default());
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

/// A tetrahedron of this size as OBJ text.
fn tetrahedron(size: f64) -> String {
    format!(
        "v 0 0 0\nv {size} 0 0\nv 0 {size} 0\nv 0 0 {size}\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
}

fn animated(animation: &str) -> String {
    format!(
        "name = \"growing\"\ncontact.response = \"none\"\n[[cloth]]\nname = \"patch\"\nmaterial.preset = \"denim\"\n\
         [cloth.geometry.grid]\ncolumns = 5\nrows = 5\nspacing = 0.1\n\
         [[collider]]\nname = \"body\"\n[collider.shape.animation]\n{animation}"
    )
}

/// The same, of each of these sizes, as a Point Cache 2.
fn point_cache(sizes: &[f32]) -> Vec<u8> {
    let mut bytes = b"POINTCACHE2\0".to_vec();
    bytes.extend([1_i32, 4].into_iter().flat_map(i32::to_le_bytes));
    bytes.extend([0.0_f32, 1.0].into_iter().flat_map(f32::to_le_bytes));
    bytes.extend((sizes.len() as i32).to_le_bytes());
    for &size in sizes {
        let corners = [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
        bytes.extend(corners.into_iter().flatten().flat_map(f32::to_le_bytes));
    }
    bytes
}

#[test]
fn an_animation_waits_starts_at_rest_has_a_skin_and_comes_from_a_point_cache() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("body.obj"), tetrahedron(0.2)).unwrap();
    fs::write(folder.path().join("body.pc2"), point_cache(&[0.2, 0.3, 0.5])).unwrap();
    fs::write(folder.path().join("rest.obj"), tetrahedron(0.1)).unwrap();
    let grid = |more: &str| {
        let text =
            format!("file = \"body.obj\"\ncache = \"body.pc2\"\nrate = 10\ncells = 16\n{more}");
        let path = folder.path().join("scene.toml");
        fs::write(&path, animated(&text)).unwrap();
        let compiled = Scene::read(&path).unwrap().compile(&CompileOptions::default()).unwrap();
        match &compiled.model.colliders()[0].shape {
            cloth_core::ColliderShape::Grid(grid) => std::sync::Arc::clone(grid),
            shape => panic!("{shape:?}"),
        }
    };
    let size = |grid: &cloth_core::DistanceGrid, time| grid.positions_at(time)[1][0];
    let plain = grid("");
    assert_eq!(plain.set_count(), 3);
    assert!((size(&plain, 0.15) - 0.4).abs() < 1e-7, "half way to the last one");
    assert!((size(&grid("first = 1\nframes = 1\n"), 0.0) - 0.3).abs() < 1e-7);
    let waiting = grid("start = 0.5\n");
    assert!((size(&waiting, 0.5) - 0.2).abs() < 1e-7 && (size(&waiting, 0.6) - 0.3).abs() < 1e-7);
    assert_eq!(waiting.sets_at(0.4).next, 0, "it is not on its way");
    // Four steps to the first key frame, that begin and end slowly.
    let blended = grid("rest = \"rest.obj\"\nblend = 0.4\nstart = 1.0\n");
    assert_eq!(blended.set_count(), 7);
    for (time, expected) in [(0.9, 0.1), (1.1, 0.115_625), (1.2, 0.15), (1.4, 0.2), (1.5, 0.3)] {
        assert!((size(&blended, time) - expected).abs() < 1e-7, "{time} s");
    }
    let skinned = grid("skin = 0.03\n");
    let point = [0.05, 0.05, -0.01];
    let change = plain.distance_at(point, 0.0) - skinned.distance_at(point, 0.0);
    assert!((change - 0.03).abs() < 1e-3 && skinned.skin == 0.03, "{change}");
    assert_eq!(skinned.surface.positions, plain.surface.positions);
    let far = [-0.06, 0.05, 0.05];
    assert!(skinned.distance_at(far, 0.0) > 0.0, "samples reach beyond the skin");
}

#[test]
fn a_collider_can_be_a_mesh_for_each_frame() {
    let folder = tempfile::tempdir().unwrap();
    for number in 3..6 {
        let file = folder.path().join(format!("body{number}.obj"));
        fs::write(file, tetrahedron(0.1 * f64::from(number))).unwrap();
    }
    let text = animated("file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 10\ncells = 16\n");
    let path = folder.path().join("scene.toml");
    fs::write(&path, &text).unwrap();
    let scene = Scene::read(&path).unwrap();
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    let shape = &compiled.model.colliders()[0].shape;
    let cloth_core::ColliderShape::Grid(grid) = shape else { panic!("{shape:?}") };
    assert!(shape.changes() && grid.set_count() == 3);
    assert!((grid.positions_at(0.15)[1][0] - 0.45).abs() < 1e-12, "half way to the last one");
    assert!((grid.positions_at(9.0)[1][0] - 0.5).abs() < 1e-12, "the last one holds");
    let fysl = scene.to_fysl().unwrap();
    assert!(fysl.contains("<animation file=\"body{}.obj\""), "{fysl}");
    let path = folder.path().join("scene.fysl");
    fs::write(&path, &fysl).unwrap();
    let again = Scene::read(&path).unwrap();
    assert_eq!(again.colliders, scene.colliders);
    // Another number of vertices, and another order of the faces.
    fs::write(folder.path().join("body2.obj"), format!("v 1 1 1\n{}", tetrahedron(0.2))).unwrap();
    let turned = tetrahedron(0.6).replace("f 1 3 2", "f 2 3 1");
    fs::write(folder.path().join("body6.obj"), turned).unwrap();
    fs::write(folder.path().join("body.pc2"), point_cache(&[0.1, 0.3])).unwrap();
    for (animation, words) in [
        ("file = \"body.obj\"\nframes = 3\nrate = 10\n", "no `{}`"),
        ("file = \"body{}.obj\"\nframes = 3\nrate = 10\n", "body0.obj"),
        ("file = \"body{}.obj\"\nframes = 0\nrate = 10\n", "give 1 to"),
        ("file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 0\n", "rate"),
        ("file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 1\ncells = 2\n", "give 4 to 400"),
        ("file = \"body{}.obj\"\nfirst = 3\nrate = 10\n", "needs `frames`"),
        ("file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 1\nskin = -1\n", "skin` is -1"),
        ("file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 1\nblend = 1\n", "give `rest`"),
        (
            "file = \"body{}.obj\"\nfirst = 3\nframes = 3\nrate = 1\nrest = \"body3.obj\"\n",
            "give `blend`",
        ),
        (
            "file = \"body{}.obj\"\nfirst = 2\nframes = 2\nrate = 1\n",
            "`body3.obj` has 4 vertices and 4 triangles, and body2.obj has 5 and 4",
        ),
        (
            "file = \"body{}.obj\"\nfirst = 3\nframes = 2\nrate = 1\nrest = \"body2.obj\"\nblend = 1\n",
            "`body2.obj` has 5 vertices and 4 triangles, and the first key frame has 4 and 4",
        ),
        (
            "file = \"body{}.obj\"\nfirst = 5\nframes = 2\nrate = 1\n",
            "has a triangle 0 of vertices [1, 2, 0], and body5.obj one of [0, 2, 1]",
        ),
        (
            "file = \"body3.obj\"\ncache = \"body.pc2\"\nrate = 1\nfirst = 2\n",
            "has 2 key frames, and those from 2",
        ),
        (
            "file = \"body2.obj\"\ncache = \"body.pc2\"\nrate = 1\n",
            "moves 4 vertices, and the mesh `body2.obj` has 5",
        ),
        ("file = \"body3.obj\"\ncache = \"none.pc2\"\nrate = 1\n", "none.pc2"),
        ("file = \"body3.obj\"\ncache = \"../none.pc2\"\nrate = 1\n", "not a plain path"),
    ] {
        let path = folder.path().join("wrong.toml");
        fs::write(&path, animated(animation)).unwrap();
        let error = Scene::read(&path).unwrap().compile(&CompileOptions::default()).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(error.to_string().contains("wrong.toml`, line"), "{error}");
    }
}

/// A square of four vertices with a weight, as PLY.
const WEIGHTED: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
    property float z\nproperty float pin\nelement face 2\nproperty list uchar int vertex_indices\n\
    end_header\n0 0 0 0.2\n1 0 0 0.5\n1 1 0 0.6\n0 1 0 1\n3 0 1 2\n3 0 2 3\n";

fn pinned(pins: &str, geometry: &str) -> String {
    format!(
        "name = \"pinned\"\n[[cloth]]\nname = \"square\"\npins = {pins}\n\
         material.preset = \"denim\"\ngeometry.{geometry}\n"
    )
}

#[test]
fn pins_are_chosen_by_an_attribute_of_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("square.ply"), WEIGHTED).unwrap();
    let path = folder.path().join("scene.toml");
    let compiled = |pins: &str, geometry: &str| {
        fs::write(&path, pinned(pins, geometry)).unwrap();
        let scene = Scene::read(&path)?;
        assert_eq!(Scene::from_toml(&scene.to_toml()?, "again.toml")?, scene);
        assert_eq!(Scene::from_fysl(&scene.to_fysl()?, "again.fysl")?.cloths, scene.cloths);
        scene.compile(&CompileOptions::default())
    };
    let mesh = "mesh.file = \"square.ply\"";
    let pins = |pins: &str| compiled(pins, mesh).unwrap().model.pins().to_vec();
    assert_eq!(pins("[{ attribute = \"pin\" }]"), [2, 3], "larger than a half");
    assert_eq!(pins("[0, { attribute = \"pin\", above = 0.7 }]"), [0, 3]);
    assert_eq!(pins("[{ attribute = \"pin\", above = -1 }]"), [0, 1, 2, 3]);
    let problem = |pins: &str, geometry: &str| compiled(pins, geometry).unwrap_err().to_string();
    for (pin, geometry, words) in [
        ("[{ attribute = \"pim\" }]", mesh, "unknown attribute `pim`; did you mean `pin`?"),
        (
            "[{ attribute = \"pin\", above = 1 }]",
            mesh,
            "no vertex whose `pin` is above 1: lower it",
        ),
        ("[{ attribute = \"pin\", over = 1 }]", mesh, "unknown key `over`"),
        ("[{ above = 1 }]", mesh, "missing field `attribute`"),
        (
            "[{ attribute = \"pin\" }]",
            "grid = { columns = 3, rows = 3, spacing = 0.1 }",
            "only meshes of PLY and glTF files",
        ),
    ] {
        let message = problem(pin, geometry);
        assert!(message.contains(words) && message.contains("line 4"), "{message}");
    }
}
