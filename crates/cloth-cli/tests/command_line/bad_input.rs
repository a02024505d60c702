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

/// Whatever is left of the address space, the run succeeds or says what it lacks; it never dies of it.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_on_address_space_is_answered_in_a_sentence() {
    let patch = TINY
        .replace("columns = 6, rows = 6", "columns = 400, rows = 400")
        .replace("frames_per_second = 30", "frames_per_second = 1000")
        .replace("frames = 3", "frames = 1");
    let place = Place::with("scene.toml", patch);
    let program = env!("CARGO_BIN_EXE_cloth");
    let run = |kilobytes: u32| {
        let script = format!(
            "ulimit -v {kilobytes}; exec '{program}' run scene.toml --out o --overwrite --threads 2 --format none"
        );
        let mut shell = std::process::Command::new("sh");
        let output = shell.args(["-c", &script]).current_dir(place.path("")).output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        let code = output.status.code();
        let told = code == Some(3) && errors.contains("memory") && !errors.contains("panicked");
        assert!(code == Some(0) || told, "{kilobytes} kB: {:?} {errors}", output.status);
        (code, errors)
    };
    let outcomes: Vec<_> = [120_000, 160_000, 200_000, 250_000, 2_000_000].map(run).into();
    assert_eq!(outcomes[0].0, Some(3), "{}", outcomes[0].1);
    assert_eq!(outcomes[4].0, Some(0), "{}", outcomes[4].1);
}

/// What `check` names for a scene, and the peak of the resident memory of its run \[MiB\].
#[cfg(target_os = "linux")]
fn memory(scene: String) -> [f64; 2] {
    let place = Place::with("scene.toml", scene);
    let said = place.succeeds(&["check", "scene.toml"]);
    let named = said.lines().find_map(|line| line.strip_prefix("memory       about ")).unwrap();
    let run = ["run", "scene.toml", "--backend", "cpu", "--format", "none", "--out", "o", "-q"];
    let mut child = place.start(&run);
    let mut peak = 0.0_f64;
    // The high-water mark only grows: the last one that is seen is that of the run, but for its end.
    while child.try_wait().unwrap().is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        let mark = status.unwrap_or_default();
        let mark = mark.lines().find_map(|line| {
            line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse::<f64>().ok()
        });
        peak = peak.max(mark.unwrap_or(0.0) / 1024.0);
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    [named.strip_suffix(" MiB").unwrap().parse().unwrap(), peak]
}

/// What a large scene takes beside a small one is what `check` names for it, whatever solves it. What the program takes by itself depends on how
/// it was built.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_named_is_the_memory_taken() {
    let contact =
        "[contact]\ndistance = 0.04\nresponse.penalty = { stiffness = 10, damping = 0.01 }\n";
    for (solver, contact) in [("explicit", ""), ("explicit", contact), ("implicit", "")] {
        let [small, large] = [6, 450].map(|side| {
            let scene = TINY
                .replace("columns = 6, rows = 6", &format!("columns = {side}, rows = {side}"))
                .replace("frames_per_second = 30", "frames_per_second = 1000")
                .replace("time_step = 1e-3", &format!("time_step = 5e-4\nsolver = \"{solver}\""))
                .replace("frames = 3", "frames = 2");
            memory(scene + contact)
        });
        let [named, taken] = [0, 1].map(|which| large[which] - small[which]);
        let ratio = taken / named;
        assert!((0.85..1.15).contains(&ratio), "{solver} {contact}: {taken:.0} of {named:.0} MiB");
    }
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
    not_finite[112 + 24 * 7..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
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

/// A pipe in the place of a file of the run is no reason to wait for ever, and a device none to read without end.
#[cfg(unix)]
#[test]
fn what_a_run_reads_back_must_be_a_regular_file() {
    for file in ["checkpoint.bin", "frames.bin", "scene.toml", "run.json", "report.jsonl"] {
        for is_pipe in [true, false] {
            let place = checkpointed();
            let path = place.path("o").join(file);
            std::fs::remove_file(&path).unwrap();
            if is_pipe {
                let made = std::process::Command::new("mkfifo").arg(&path).status();
                assert!(made.unwrap().success());
            } else {
                std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
            }
            let run = ["run", "tiny.toml", "--out", "o", "--format", "none", "--resume"];
            let message = place.fails(3, &run);
            assert!(message.contains(file), "{message}");
        }
    }
    // Converting reads them, too.
    let place = checkpointed();
    let path = place.path("o/frames.bin");
    std::fs::remove_file(&path).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    let message = place.fails(3, &["convert", "o", "o.npz"]);
    assert!(message.contains("not a regular file"), "{message}");
}

#[test]
fn checkpoints_of_other_runs() {
    let place = checkpointed();
    let accepted = |more: &[&'static str]| [&["--accept-changes"][..], more].concat();
    let other = accepted(&["--precision", "f64"]);
    resume_refused(&place, &other, &["checkpoint.bin", "precision f32"]);
    place.write("tiny.toml", TINY.replace("stiffness = 20", "stiffness = 21"));
    resume_refused(&place, &accepted(&[]), &["checkpoint.bin", "another model"]);
    place.write("tiny.toml", TINY.replace("columns = 6", "columns = 7"));
    resume_refused(&place, &accepted(&[]), &["checkpoint.bin", "36 particles", "the scene has 42"]);
    place.write("tiny.toml", TINY.replace("sphere.radius = 0.1", "sphere.radius = 0.11"));
    resume_refused(&place, &accepted(&[]), &["checkpoint.bin", "other colliders"]);
    place.write("tiny.toml", TINY.replace("frames_per_second = 30", "frames_per_second = 25"));
    resume_refused(&place, &accepted(&[]), &["frames.bin", "30 frames per second", "25"]);
}

#[test]
fn a_scene_that_changed_is_not_continued_and_the_change_is_named() {
    let place = checkpointed();
    for (from, to, words) in [
        ("radius = 0.1", "radius = 0.2", "`collider.ball.shape.sphere.radius` was 0.1 and is 0.2"),
        ("[0, 0, 0.35]", "[0, 0, 0.3]", "`collider.ball.translation` was [0.0, 0.0, 0.35]"),
        ("time_step = 1e-3", "time_step = 2e-3", "`simulation.time_step` was 0.001 and is 0.002"),
        ("spacing = 0.05", "spacing = 0.06", "`cloth.patch.geometry.grid.spacing` was 0.05"),
    ] {
        assert!(TINY.contains(from), "{from}");
        place.write("tiny.toml", TINY.replace(from, to));
        resume_refused(&place, &[], &["the scene changed", words, "--accept-changes"]);
    }
    place.write("tiny.toml", TINY);
    resume_refused(&place, &["--solver", "implicit"], &["`simulation.solver` is new"]);
    let more = ["--solver", "implicit", "--accept-changes", "--frames", "4"];
    let run = ["run", "tiny.toml", "--out", "o", "--format", "none", "--resume"];
    place.succeeds(&[&run[..], &more].concat());
}

/// A folder from elsewhere that names a mesh outside of it.
#[test]
fn the_folder_of_a_run_cannot_have_files_read_outside_of_it() {
    let place = Place::with("mine/mesh.obj", SQUARE);
    place.write("mine/scene.toml", MESH);
    place.succeeds(&["run", "mine/scene.toml", "--out", "o", "--format", "none"]);
    // It goes on to be complete wherever the mesh is.
    std::fs::rename(place.path("mine/mesh.obj"), place.path("mine/secret.obj")).unwrap();
    place.succeeds(&["convert", "o", "o.npz"]);
    let scene = String::from_utf8(place.read("o/scene.toml")).unwrap();
    assert!(scene.contains("\"meshes/0/mesh.obj\""), "{scene}");
    let secret = place.path("mine").display().to_string().replace('\\', "/");
    place.write("o/meshes.json", format!("{{ \"directory\": \"{secret}\", \"roots\": [\"/\"] }}"));
    for (file, part) in [
        ("secret.obj", "secret.obj"),
        ("../mine/secret.obj", "not a plain path"),
        (&format!("{secret}/secret.obj"), "mesh root"),
    ] {
        place.write("o/scene.toml", scene.replace("meshes/0/mesh.obj", file));
        let message = place.fails(3, &["convert", "o", "stolen.npz"]);
        assert!(message.contains(part), "{message}");
    }
    place.succeeds(&["convert", "o", "asked.npz", "--mesh-root", "mine"]);
}

#[cfg(unix)]
#[test]
fn outputs_that_are_no_plain_files_are_refused() {
    use std::os::unix::fs::symlink;

    let run = ["run", "tiny.toml", "--out", "o", "--format", "obj,npz", "--overwrite"];
    for (name, is_folder) in [
        ("frames.bin", false),
        ("checkpoint.bin", false),
        ("report.jsonl", false),
        ("scene.toml", false),
        ("tiny.npz", false),
        ("obj", true),
    ] {
        let place = Place::with("tiny.toml", TINY);
        place.write("o/notes.txt", "mine");
        place.write("elsewhere/mine", "mine");
        let target = if is_folder { "elsewhere" } else { "elsewhere/mine" };
        symlink(place.path(target), place.path(&format!("o/{name}"))).unwrap();
        let message = place.fails(3, &run);
        assert!(message.contains(name) && message.contains("leads out of"), "{message}");
        assert_eq!(place.read("elsewhere/mine"), b"mine");
        if !is_folder {
            std::fs::remove_file(place.path(&format!("o/{name}"))).unwrap();
            symlink("/dev/null", place.path(&format!("o/{name}"))).unwrap();
            place.fails(3, &run);
            std::fs::remove_file(place.path(&format!("o/{name}"))).unwrap();
            let pipe = place.path(&format!("o/{name}"));
            assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            let message = place.fails(3, &run);
            assert!(message.contains("a pipe"), "{message}");
        }
    }
}

#[test]
fn feedback_never_replaces_its_own_scene() {
    let place = Place::with("tiny.toml", TINY);
    place.succeeds(&["convert", "tiny.toml", "scene.fysl"]);
    let scene = place.read("scene.fysl");
    let run = |file: &str| {
        let message = place.fails(
            3,
            &["run", "scene.fysl", "--format", "none", "--overwrite", "--feedback", file],
        );
        assert!(message.contains("is the scene itself"), "{message}");
    };
    run("scene.fysl");
    run("./scene.fysl");
    std::fs::hard_link(place.path("scene.fysl"), place.path("again.fysl")).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("scene.fysl", place.path("link.fysl")).unwrap();
        run("link.fysl");
        run("again.fysl");
    }
    place.write("mine.fysl", "mine");
    let message =
        place.fails(3, &["run", "scene.fysl", "--format", "none", "--feedback", "mine.fysl"]);
    assert!(message.contains("--overwrite replaces it"), "{message}");
    assert_eq!((place.read("scene.fysl"), place.read("mine.fysl")), (scene, b"mine".to_vec()));
    assert!(!place.path("out").exists());
}

#[test]
fn keys_with_terminal_escapes_are_shown_escaped() {
    let place = Place::with("scene.toml", TINY.replace("thickness", "\"\\u001b[31mred\\u0007\""));
    let output = place.output(&["run", "scene.toml"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(!output.stderr.contains(&0x1b) && !output.stderr.contains(&7));
    let place = Place::with("scene.toml", TINY.replace("\"patch\"", "\"\\u001b]0;title\""));
    let output = place.output(&["check", "scene.toml"]);
    assert!(output.status.success());
    assert!(!output.stdout.contains(&0x1b), "{}", String::from_utf8_lossy(&output.stdout));
    assert!(String::from_utf8(output.stdout).unwrap().contains("\\u{1b}]0;title"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_stderr_or_stdout_is_no_panic() {
    let place = Place::with("tiny.toml", TINY);
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for (arguments, code) in [
        (&["run", "tiny.toml", "--out", "a", "--format", "npz", "-v"][..], 0),
        (&["run", "missing.toml"], 3),
        (&["run", "tiny.toml", "--backend", "abacus"], 2),
        (&["backends"], 0),
    ] {
        let status = place.command(arguments).stderr(full()).output().unwrap().status;
        assert_eq!(status.code(), Some(code), "{arguments:?}");
    }
    for arguments in [
        &["run", "tiny.toml", "--out", "b", "--format", "npz"][..],
        &["run", "tiny.toml", "--out", "c", "--format", "npz", "--json"],
        &["scenes"],
        &["check", "tiny.toml"],
        &["man"],
    ] {
        let output = place.command(arguments).stdout(full()).output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(errors.contains("error: cannot write to stdout"), "{errors}");
        assert!(!errors.contains("panicked"), "{errors}");
    }
    assert!(place.path("b/tiny.npz").exists());
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
