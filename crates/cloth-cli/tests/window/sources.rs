//! What a window shows: scenes, runs, what is dropped on it.

use std::{
    fs,
    process::{Command, Stdio},
};

use crate::{
    drop_source,
    session::{SCENE, Session, frame, share},
};

#[test]
fn frames_of_a_run_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("sheet.toml");
    fs::write(&scene, SCENE).unwrap();
    let ran = Command::new(env!("CARGO_BIN_EXE_cloth"))
        .arg("run")
        .arg(&scene)
        .args(["--frames", "5", "--format", "obj,ply,pc2,mdd", "--out", "run"])
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .status()
        .unwrap();
    assert!(ran.success());
    let run = folder.path().join("run");
    // Sequences and caches show the same as the frame store.
    let still = |source: &str| {
        let picture = folder.path().join("still.png");
        let output = Command::new(env!("CARGO_BIN_EXE_cloth"))
            .args(["render", source, "--still", "--picture-size", "96x54", "--out", "still.png"])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{source}: {output:?}");
        share(&image::open(picture).unwrap().into_rgb8(), |p| {
            p.iter().max().unwrap() - p.iter().min().unwrap() > 60
        })
    };
    let all = ["run/obj", "run/ply/sheet_000002.ply", "run/sheet.pc2", "run/sheet.mdd"].map(still);
    assert!(all[0] > 0.02 && all.iter().all(|share| (share - all[0]).abs() < 1e-3), "{all:?}");
    let mut session = Session::open(run.to_str(), &["--paused"]);
    session.wait("six frames", |line| line["recorded"] == 6);
    session.key("Right");
    let line = session.wait("the next one", |line| frame(line) == 1);
    assert!((line["time"].as_f64().unwrap() - 1.0 / 30.0).abs() < 1e-6);
    session.key("r");
    session.wait("the first one", |line| frame(line) == 0);
    // The slider: far to the right is the last frame, and back is the first.
    session.drag_widget("frame", 0.05, 260.0);
    let line = session.wait("the last one", |line| frame(line) == 5);
    assert!((line["time"].as_f64().unwrap() - 5.0 / 30.0).abs() < 1e-6);
    session.drag_widget("frame", 0.3, -200.0);
    session.wait("the first one again", |line| frame(line) == 0 && line["paused"] == true);
}

#[test]
fn another_scene_is_opened_by_its_name() {
    let mut session = Session::open(None, &["--paused"]);
    let open = |session: &mut Session, word: &str| {
        session.key("o");
        session.wait("a line to type in", |line| line["typing"] == true);
        session.xdotool(&["type", word]);
        session.key("Return");
    };
    open(&mut session, "flag");
    session.wait("the flag", |line| line["scene"] == "flag" && line["typing"] == false);
    // Letters that are typed are no keys, as X would be.
    open(&mut session, "xyz");
    let line = session.wait("a refusal", |line| line["message"].is_string());
    let message = line["message"].as_str().unwrap();
    assert!(message.contains("xyz") && !message.contains('\n'), "{message}");
    assert_eq!(line["scene"], "flag");
}

#[test]
fn what_is_dropped_is_opened() {
    let mut session = Session::open(Some("flag"), &["--paused"]);
    assert_eq!(session.last().unwrap()["scene"], "flag");
    let scene = session.folder.path().join("sheet.toml");
    drop_source::drop_file(&session.display, session.window.parse().unwrap(), &scene).unwrap();
    session.wait("the sheet", |line| line["scene"] == "sheet");
}
