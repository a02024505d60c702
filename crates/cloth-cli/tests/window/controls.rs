//! Keys, the pointer and the panel.

use serde_json::Value;
use std::{
    fs,
    time::{Duration, Instant},
};

use crate::session::{Session, frame, held};

#[test]
fn keys_drive_the_simulation() {
    let mut session = Session::open(None, &["--paused"]);
    let start = session.wait("a paused start", |line| line["paused"] == true);
    assert_eq!((frame(&start), held(&start)), (0, 2));
    for expected in 1..=3 {
        session.key("Right");
        session.wait("a single step", |line| frame(line) == expected && line["paused"] == true);
    }
    session.key("Left");
    session.wait("the frame before", |line| frame(line) == 2 && line["past"] == true);
    session.key("Right");
    session.wait("the last one", |line| frame(line) == 3 && line["past"] == false);
    session.key("space");
    session.wait("it plays", |line| frame(line) > 5 && line["paused"] == false);
    session.key("space");
    session.wait("it waits", |line| line["paused"] == true);
    session.key("p");
    session.wait("it runs", |line| frame(line) > 12 && line["paused"] == false);
    session.key("p");
    session.wait("it waits", |line| line["paused"] == true);
    // All corners: the two at the top are held, the two at the bottom are not.
    for (key, expected) in [("0", 3), ("1", 4), ("2", 3), ("3", 2), ("0", 1), ("0", 2)] {
        session.key(key);
        session.wait("a corner", |line| held(line) == expected);
    }
    session.key("r");
    session.wait("the start", |line| frame(line) == 0 && held(line) == 2);
    session.key("h");
    session.wait("help", |line| line["help"] == true);
    session.key("h");
    session.wait("no help", |line| line["help"] == false);
    session.key("x");
    let start = Instant::now();
    while session.program.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(30), "X does not end it");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(session.program.wait().unwrap().success());
}

/// Without a window manager a window stays as large as it is: what is asked of it is seen, not what becomes of it.
#[test]
fn the_whole_screen_is_asked_for_and_given_back() {
    let mut session = Session::open(None, &["--paused"]);
    session.wait("a window", |line| line["fullscreen"] == false);
    session.key("f");
    session.wait("the whole screen", |line| line["fullscreen"] == true);
    session.key("f");
    session.wait("a window again", |line| line["fullscreen"] == false);
}

#[test]
fn numbers_of_the_panel_are_dragged() {
    let mut session = Session::open(None, &[]);
    let start = session.wait("it runs", |line| frame(line) > 2 && line["time_step"].is_f64());
    let step = |line: &Value| line["time_step"].as_f64().unwrap();
    assert!((step(&start) - 2e-3).abs() < 1e-12);
    session.click("Solver");
    // A longer one is more than this cloth bears when it moves.
    session.drag_widget("time step", 0.5, -40.0);
    let changed = session.wait("a shorter step", |line| step(line) < 1.9e-3);
    assert!(step(&changed) > 1e-4, "{changed}");
    assert!(changed["message"].is_null(), "{changed}");
    let later = frame(&changed) + 2;
    session.wait("it goes on, with the state kept", |line| frame(line) > later);
    session.click("World");
    session.click("air");
    session.drag_widget("wind z", 0.5, 40.0);
    let windy = session.wait("wind", |line| line["wind"][2].as_f64().unwrap() > 0.1);
    assert_eq!(windy["undo"], 3);
    session.drag_widget("gravity z", 0.5, 40.0);
    let gravity = |line: &Value| line["gravity"][2].as_f64().unwrap();
    session.wait("less gravity", |line| gravity(line) > -9.0);
    session.click("Cloth");
    session.drag_widget("stretch stiffness", 0.5, -30.0);
    let stretch = |line: &Value| line["stretch"][0].as_f64().unwrap();
    session.wait("softer cloth", |line| stretch(line) < 50.0 && line["undo"] == 5);

    // All of it back, and the last two again.
    for undone in 1..=5 {
        session.key("ctrl+z");
        session.wait("a change less", |line| line["redo"] == undone);
    }
    let back = session.wait("all as it was", |line| (step(line) - 2e-3).abs() < 1e-12);
    assert!((stretch(&back) - 60.0).abs() < 1e-9 && (gravity(&back) + 9.81).abs() < 1e-9);
    for key in ["ctrl+shift+z", "ctrl+y", "ctrl+y", "ctrl+y", "ctrl+y"] {
        session.key(key);
    }
    session.wait("all again", |line| line["redo"] == 0 && stretch(line) < 50.0);
    session.wait("with the wind", |line| line["wind"][2].as_f64().unwrap() > 0.1);
}

#[test]
fn a_changed_scene_is_saved_and_no_file_is_replaced_unasked() {
    let mut session = Session::open(None, &["--paused"]);
    // The first pictures of a window find its layout.
    std::thread::sleep(Duration::from_millis(500));
    session.drag_widget("stretch stiffness", 0.5, 30.0);
    let changed = session.wait("stiffer cloth", |line| line["stretch"][0].as_f64() > Some(61.0));
    session.key("ctrl+s");
    session.wait("a question", |line| line["widgets"]["save path"].is_array());
    session.wait("a line to type in", |line| line["typing"] == true);
    session.key("Return");
    let said = |line: &Value| line["message"].as_str().unwrap_or_default().to_owned();
    session.wait("it is saved", |line| said(line).starts_with("saved") && line["error"] == false);
    let path = session.folder.path().join("sheet-001.toml");
    let text = fs::read_to_string(&path).unwrap();
    let stiffness = changed["stretch"][0].as_f64().unwrap();
    assert!(text.contains(&format!("stiffness = {stiffness}")), "{text}");

    // The same name again: it asks, and does nothing without an answer.
    fs::write(&path, "mine").unwrap();
    session.key("ctrl+s");
    session.wait("a line to type in", |line| line["typing"] == true);
    session.key("ctrl+a");
    session.xdotool(&["type", &path.display().to_string()]);
    session.key("Return");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    session.click("save");
    session.wait("it is replaced", |line| !line["widgets"]["save path"].is_array());
    let start = Instant::now();
    while fs::read_to_string(&path).unwrap() != text {
        assert!(start.elapsed() < Duration::from_secs(30), "not replaced");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn kept_frames_are_scrubbed_while_the_simulation_stays_where_it_is() {
    let mut session = Session::open(None, &[]);
    session.wait("some frames", |line| frame(line) > 20);
    session.drag_widget("frame", 0.95, -120.0);
    let past = session.wait("an earlier frame", |line| line["past"] == true);
    let last = past["kept"][1].as_u64().unwrap();
    assert!(past["paused"] == true && frame(&past) < last && last > 20, "{past}");
    // The mouse is let go, and keys are keys again.
    session.key("space");
    session.wait("it goes on from the last one", |line| {
        frame(line) > last && line["past"] == false && line["paused"] == false
    });
    session.key("Home");
    session.wait("the first frame", |line| frame(line) == 0 && line["past"] == true);
    session.click("go on from here");
    session.wait("it goes on from there", |line| {
        line["past"] == false && frame(line) > 0 && line["kept"][1].as_u64() == Some(frame(line))
    });
}

#[test]
fn the_pointer_pulls_pins_and_turns() {
    let mut session = Session::open(None, &[]);
    session.wait("it runs", |line| frame(line) > 2);
    // The sheet is in the middle.
    session.pointer_to(0.5, 0.5);
    session.press("1", true);
    for step in 1..=6 {
        session.pointer_to(0.5 + 0.01 * f64::from(step), 0.5);
    }
    let pulled = session.wait("it is pulled towards the pointer", |line| {
        let place = |k: usize| -> Option<[f64; 3]> {
            let values = line["grabbed"][k].as_array()?;
            Some([0, 1, 2].map(|k| values[k].as_f64().unwrap()))
        };
        let (Some(at), Some(target)) = (place(1), place(2)) else { return false };
        // The cloth resists: more than half of the way from where it was is enough.
        target[0] > 0.1 && at[0] > 0.5 * target[0]
    });
    assert!(pulled["grabbed"][0].is_u64());
    session.press("1", false);
    session.wait("it is let go", |line| line["grabbed"].is_null());

    session.pointer_to(0.5, 0.5);
    session.xdotool(&["keydown", "ctrl"]);
    session.press("1", true);
    session.press("1", false);
    session.xdotool(&["keyup", "ctrl"]);
    session.wait("one more is held", |line| held(line) == 3);

    let eye = session.last().unwrap()["eye"].clone();
    session.pointer_to(0.2, 0.8);
    session.press("3", true);
    for step in 1..=5 {
        session.pointer_to(0.2 + 0.03 * f64::from(step), 0.8);
    }
    session.press("3", false);
    session.wait("the camera turned", |line| line["eye"] != eye);
}
