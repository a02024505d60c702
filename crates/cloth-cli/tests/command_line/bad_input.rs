//! Input that cannot be used ends with exit code 3 and one sentence that names the place and the
//! mend, before anything is written.

use crate::place::{MESH, Place, SQUARE, TINY};

/// Runs the scene in `place`, which must be refused with all of `parts` in the message.
#[track_caller]
fn refused(place: &Place, parts: &[&str]) {
    let message = place.fails(3, &["run", "scene.toml", "--format", "none"]);
    for part in parts {
        assert!(message.contains(part), "{message}\nshould say: {part}");
    }
    assert!(!place.path("out").exists(), "something was written");
}

/// `TINY` with `to` in place of `from`.
#[track_caller]
fn scene_refused(from: &str, to: &str, parts: &[&str]) {
    assert_eq!(TINY.matches(from).count(), 1, "{from} must be there once");
    let place = Place::with("scene.toml", TINY.replace(from, to));
    let line = 1 + TINY[..TINY.find(from).unwrap()].matches('\n').count();
    let line = format!("line {line}");
    refused(&place, &[&["scene.toml", &line], parts].concat());
}

#[test]
fn numbers_that_are_not_finite() {
    for word in ["nan", "inf", "-inf"] {
        let step = format!("time_step = {word}");
        scene_refused("time_step = 1e-3", &step, &["time_step", "give a finite number"]);
        let centre = format!("centre = [0, {word}, 0.5]");
        scene_refused("centre = [0, 0, 0.5]", &centre, &["centre", "give a finite number"]);
        let thickness = format!("thickness = {word}");
        scene_refused("thickness = 0.002", &thickness, &["thickness", "give a finite number"]);
    }
}

#[test]
fn numbers_that_must_be_positive() {
    for value in ["0", "0.0", "-0.0", "-1"] {
        for (from, key) in [
            ("time_step = 1e-3", "time_step"),
            ("thickness = 0.002", "thickness"),
            ("mass.per_area = 0.2", "mass.per_area"),
            ("spacing = 0.05", "spacing"),
            ("stiffness = 20", "stiffness"),
            ("shape.sphere.radius = 0.1", "shape.sphere.radius"),
        ] {
            let to = format!("{key} = {value}");
            let name = key.rsplit(['.', '_']).next().unwrap();
            scene_refused(from, &to, &[name, "must be greater than zero"]);
        }
    }
}

#[test]
fn texts_that_are_no_scene() {
    scene_refused("thickness", "thikness", &["did you mean `thickness`?"]);
    scene_refused("frames = 3", "frames = \"three\"", &["expected u32", "correct the text"]);
    scene_refused("frames = 3", "frames = ", &["correct the text"]);
    refused(&Place::with("scene.toml", [0xff, 0xfe, 0x00]), &["scene.toml", "UTF-8"]);
    refused(&Place::with("scene.toml", "name = \"empty\""), &["no cloth", "add at least one"]);
    refused(&Place::new(), &["cannot read scene file `scene.toml`", "check the path"]);
    let place = Place::new();
    let message = place.fails(3, &["run", "drappe"]);
    assert!(message.contains("did you mean `drape`?"), "{message}");
}

#[test]
fn a_scene_larger_than_the_memory() {
    let place = Place::with(
        "scene.toml",
        TINY.replace("columns = 6, rows = 6", "columns = 4000000000, rows = 4000000000"),
    );
    refused(&place, &["scene `tiny` with 16000000000000000000 particles", "are missing"]);
}

/// A scene whose mesh is the text of an OBJ file.
#[track_caller]
fn mesh_refused(mesh: &str, parts: &[&str]) {
    let place = Place::with("scene.toml", MESH);
    place.write("mesh.obj", mesh);
    refused(&place, parts);
}

#[test]
fn the_mesh_of_these_tests_is_good() {
    let place = Place::with("scene.toml", MESH);
    place.write("mesh.obj", SQUARE);
    place.succeeds(&["run", "scene.toml", "--format", "none"]);
}

#[test]
fn meshes_with_coordinates_that_are_not_finite() {
    for word in ["nan", "inf", "1e999"] {
        let mesh = SQUARE.replace("v 1 1 1", &format!("v 1 {word} 1"));
        mesh_refused(&mesh, &["mesh.obj", "vertex 2", "finite"]);
    }
}

#[test]
fn meshes_with_bad_faces() {
    let faces = |faces: &str| SQUARE.replace("f 1 3 4\n", faces);
    mesh_refused(&faces("f 1 3 9\n"), &["mesh.obj", "line 6", "vertex 9", "correct the index"]);
    mesh_refused(&faces("f 1 3 0\n"), &["mesh.obj", "line 6"]);
    mesh_refused(&faces("f 1 3 3\n"), &["mesh.obj", "line 6", "vertex 2", "remove"]);
    let duplicate = faces("f 1 3 4\nf 2 3 1\n");
    mesh_refused(&duplicate, &["shirt", "triangles 0 and 2 have the same vertices", "remove one"]);
    let degenerate = faces("f 1 3 4\n").replace("v 1 1 1", "v 2 0 1");
    mesh_refused(&degenerate, &["shirt", "triangle 0 has no area", "remove it"]);
    let isolated = SQUARE.replace("f 1 2 3", "v 5 5 5\nf 1 2 3");
    mesh_refused(&isolated, &["shirt", "vertex 4 belongs to no triangle", "remove it"]);
    let flipped = faces("f 1 4 3\n");
    mesh_refused(&flipped, &["shirt", "triangles 0 and 1", "flip one of them"]);
    let fins = faces("f 1 3 4\nv 0 0 2\nf 3 1 5\n");
    mesh_refused(&fins, &["shirt", "belongs to 3 triangles", "split the mesh"]);
}

#[test]
fn meshes_without_content() {
    mesh_refused("", &["mesh.obj", "has no vertices"]);
    mesh_refused("v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["mesh.obj", "has no"]);
    refused(&Place::with("scene.toml", MESH), &["scene.toml", "mesh.obj", "check the path"]);
    let place = Place::with("scene.toml", MESH.replace("mesh.obj", "mesh.ply"));
    place.write("mesh.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n");
    refused(&place, &["mesh.ply", "export it again"]);
}

#[test]
fn meshes_outside_the_folder_of_the_scene() {
    let place = Place::with("inner/scene.toml", MESH.replace("mesh.obj", "../mesh.obj"));
    place.write("mesh.obj", SQUARE);
    let run = ["run", "inner/scene.toml", "--format", "none"];
    let message = place.fails(3, &run);
    assert!(message.contains("line 9") && message.contains("../mesh.obj"), "{message}");
    assert!(message.contains("not a plain path below the folder of the scene"), "{message}");

    let absolute = place.path("mesh.obj").display().to_string().replace('\\', "/");
    place.write("inner/scene.toml", MESH.replace("mesh.obj", &absolute));
    let message = place.fails(3, &run);
    assert!(message.contains("allow its folder as a mesh root"), "{message}");
    let root = place.path("").display().to_string();
    place.succeeds(&[&run[..], &["--mesh-root", &root]].concat());
    place.write("inner/scene.toml", MESH);
    place.succeeds(&[&run[..], &["--mesh-root", "."]].concat());
}

#[test]
fn folders_that_cannot_be_written() {
    let place = Place::with("tiny.toml", TINY);
    place.write("file", "");
    for folder in ["file", "file/below"] {
        let message = place.fails(3, &["run", "tiny.toml", "--out", folder]);
        assert!(message.contains("cannot write `file"), "{message}");
        assert!(message.contains("choose another folder"), "{message}");
    }
    place.write("o/png", "a file where a folder is needed");
    let message = place.fails(3, &["run", "tiny.toml", "--out", "o"]);
    assert!(message.contains("png") && message.contains("choose another folder"), "{message}");
}

/// A folder with a run of two frames, and the arguments to continue it.
fn checkpointed() -> Place {
    let place = Place::with("tiny.toml", TINY);
    place.succeeds(&["run", "tiny.toml", "--out", "o", "--format", "none", "--frames", "2"]);
    place
}

/// Continues the run in `place` with `more`, which must be refused and leave the frames alone.
#[track_caller]
fn resume_refused(place: &Place, more: &[&str], parts: &[&str]) {
    let frames = place.read("o/frames.bin");
    let run = ["run", "tiny.toml", "--out", "o", "--format", "none", "--resume"];
    let message = place.fails(3, &[&run[..], more].concat());
    for part in parts {
        assert!(message.contains(part), "{message}\nshould say: {part}");
    }
    assert!(place.read("o/frames.bin") == frames, "the frames were touched");
}

#[test]
fn damaged_checkpoints() {
    let place = checkpointed();
    let good = place.read("o/checkpoint.bin");
    let mend = "start again without it";
    place.write("o/checkpoint.bin", &good[..good.len() / 2]);
    resume_refused(&place, &[], &["checkpoint.bin", "truncated", mend]);
    let mut bad = good.clone();
    bad[200] ^= 4;
    place.write("o/checkpoint.bin", &bad);
    resume_refused(&place, &[], &["checkpoint.bin", "checksum", mend]);
    let mut version = good.clone();
    version[8] = 99;
    place.write("o/checkpoint.bin", &version);
    resume_refused(&place, &[], &["checkpoint.bin", "version 99", "program that wrote it"]);
    let mut not_finite = good.clone();
    not_finite[88 + 24 * 7..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
    let end = not_finite.len() - 4;
    let checksum = crc32fast::hash(&not_finite[..end]);
    not_finite[end..].copy_from_slice(&checksum.to_le_bytes());
    place.write("o/checkpoint.bin", &not_finite);
    resume_refused(&place, &[], &["checkpoint.bin", "particle 7", mend]);
    place.write("o/checkpoint.bin", TINY);
    resume_refused(&place, &[], &["checkpoint.bin", "is not a checkpoint"]);
    std::fs::remove_file(place.path("o/checkpoint.bin")).unwrap();
    resume_refused(&place, &[], &["cannot read checkpoint", mend]);
    place.write("o/checkpoint.bin", &good);
    place.succeeds(&["run", "tiny.toml", "--out", "o", "--format", "none", "--resume"]);
}

#[test]
fn checkpoints_of_other_runs() {
    let place = checkpointed();
    resume_refused(&place, &["--precision", "f64"], &["checkpoint.bin", "precision f32"]);
    place.write("tiny.toml", TINY.replace("stiffness = 20", "stiffness = 21"));
    resume_refused(&place, &[], &["checkpoint.bin", "another model"]);
    place.write("tiny.toml", TINY.replace("columns = 6", "columns = 7"));
    resume_refused(&place, &[], &["checkpoint.bin", "36 particles", "the scene has 42"]);
    place.write("tiny.toml", TINY.replace("frames_per_second = 30", "frames_per_second = 25"));
    resume_refused(&place, &[], &["frames.bin", "30 frames per second", "25"]);
}

#[test]
fn a_checkpoint_ahead_of_the_frames() {
    let place = checkpointed();
    let frames = place.read("o/frames.bin");
    place.write("o/frames.bin", &frames[..frames.len() - 100]);
    let run = ["run", "tiny.toml", "--out", "o", "--format", "none", "--resume"];
    let message = place.fails(3, &run);
    assert!(message.contains("has 2 frames but the checkpoint needs 3"), "{message}");
}
