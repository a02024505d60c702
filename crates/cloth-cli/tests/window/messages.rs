//! What is said, in the window and without one.

use serde_json::Value;
use std::{fs, process::Command, time::Duration};

use crate::{screen, session::Session};

/// What the window says is said on stderr, too, as loud as is asked for.
#[test]
fn messages_are_said_on_stderr_as_loud_as_is_asked_for() {
    for (level, info) in [("--quiet", false), ("--verbose", true)] {
        let mut session = Session::open(None, &["--paused", level]);
        session.key("s");
        session.wait("a screenshot", |line| {
            line["message"].as_str().is_some_and(|message| message.starts_with("screenshot"))
        });
        session.key("o");
        session.wait("a line to type in", |line| line["typing"] == true);
        session.xdotool(&["type", "nowhere"]);
        session.key("Return");
        session.wait("a refusal", |line| line["error"] == true);
        let said = fs::read_to_string(session.folder.path().join("stderr")).unwrap();
        let has = |start: &str| said.lines().any(|line| line.starts_with(start));
        assert!(has("error: ") && said.contains("nowhere"), "{level}: {said}");
        assert_eq!(has("screenshot "), info, "{level}: {said}");
        // Nothing else has a word there, unless it was asked for.
        assert!(info || said.lines().all(|line| line.starts_with("error: scene")), "{said}");
    }
}

/// Whatever is said, widgets stay where they are; and an error is red.
#[test]
fn messages_move_nothing_and_errors_look_like_errors() {
    let mut session = Session::open(None, &["--paused"]);
    session.wait("all widgets", |line| line["widgets"]["frame"].is_array());
    // The first pictures of a window find its layout.
    std::thread::sleep(Duration::from_millis(500));
    let before = session.last().unwrap();
    let places = |line: &Value| {
        let mut widgets = line["widgets"].as_object().unwrap().clone();
        // The message itself comes and goes.
        widgets.retain(|name, _| !["message", "dismiss"].contains(&name.as_str()));
        assert!(widgets.len() > 15, "{widgets:?}");
        (widgets, line["picture"].clone())
    };
    let red = |session: &Session| {
        let picture = screen::window_picture(&session.display, session.window.parse().unwrap());
        let bar = (picture.height() - 24..picture.height() - 4).step_by(2);
        let pixels = bar.map(|y| picture.get_pixel(picture.width() / 2, y).0);
        let is_red = |[r, g, b]: [u8; 3]| r > 120 && g < 60 && b < 60;
        pixels.filter(|&pixel| is_red(pixel)).count() as f64 / 10.0
    };
    assert_eq!(red(&session), 0.0);
    session.key("o");
    session.wait("a line to type in", |line| line["typing"] == true);
    session.xdotool(&["type", "nowhere"]);
    session.key("Return");
    let refused = session.wait("an error", |line| line["error"] == true && line["typing"] == false);
    assert_eq!(places(&refused), places(&before));
    std::thread::sleep(Duration::from_millis(300));
    assert!(red(&session) > 0.5, "{} of the bar is red", red(&session));
    session.key("Escape");
    let quiet = session.wait("it is put away", |line| line["message"].is_null());
    assert_eq!(places(&quiet), places(&before));
    session.key("s");
    let said = session.wait("a screenshot", |line| line["message"].is_string());
    assert!(said["error"] == false, "{said}");
    assert_eq!(places(&said), places(&before));
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(red(&session), 0.0);
}

#[test]
fn what_cannot_be_shown_is_said_without_a_window() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bad.toml"), "name = 3").unwrap();
    fs::write(folder.path().join("bad.pc2"), "nothing").unwrap();
    for (arguments, expected) in [
        (["view", "./bad.toml"], "bad.toml"),
        (["view", "bad.pc2"], "bad_mesh.obj"),
        (["view", "."], "frames.bin"),
        (["view", "nonsense"], "nonsense"),
        (["view", "--backend=abacus"], "abacus"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_cloth"))
            .args(arguments)
            .current_dir(folder.path())
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        assert!(matches!(output.status.code(), Some(1..=3)), "{arguments:?}: {output:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.starts_with("error: ") && text.contains(expected), "{text}");
    }
}

#[test]
fn no_display_is_said_in_one_line() {
    let output = Command::new(env!("CARGO_BIN_EXE_cloth"))
        .args(["view", "drape"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    let said: Vec<&str> =
        text.lines().filter(|line| line.contains("cannot open a window")).collect();
    assert_eq!(said.len(), 1, "{text}");
    assert!(said[0].contains("apt-get install xvfb"), "{text}");
}

#[test]
fn no_adapter_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_cloth"))
        .args(["render", "drape", "--out", "clip.gif"])
        .current_dir(folder.path())
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("mesa-vulkan-drivers"), "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("error:")).count(), 1, "{text}");
}
