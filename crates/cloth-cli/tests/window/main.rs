//! A real window on a virtual screen: keys and the pointer, as a hand would use them, and what they do
//! to the simulation and to the picture.

#![cfg(all(target_os = "linux", feature = "viewer"))]
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod drop_source;
mod screen;

use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = r##"
    name = "sheet"
    simulation = { frames = 30, frames_per_second = 30, time_step = 2e-3 }
    [[cloth]]
    name = "sheet"
    colour = "#c43a3e"
    geometry.grid = { columns = 21, rows = 21, spacing = 0.05, centre = [0, 0, 0.7], row_axis = [0, 0, 1] }
    material = { thickness = 2e-3, mass.per_particle = 1e-3, stretch = { stiffness = 60, damping = 0.02 }, shear = { stiffness = 30, damping = 0.02 }, bend = { stiffness = 6 } }
    pins = ["top-left", "top-right"]
    [[field]]
    drag.rate = [1, 1, 1]
    [[collider]]
    name = "floor"
    shape.plane = {}
    [view]
    eye = [0.6, -3.2, 1.3]
    target = [0, 0, 0.6]
    field_of_view = 40
"##;

/// A screen without a screen, and `cloth view` on it.
struct Session {
    screen: Child,
    display: String,
    program: Child,
    window: String,
    folder: TempDir,
}

impl Drop for Session {
    fn drop(&mut self) {
        // Both may have ended on their own.
        let _ = self.program.kill();
        let _ = self.program.wait();
        let _ = self.screen.kill();
        let _ = self.screen.wait();
    }
}

fn tool(name: &str) -> Command {
    let found =
        Command::new(name).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    assert!(found.is_ok(), "no `{name}`; run: sudo apt-get install --yes xvfb xdotool");
    Command::new(name)
}

impl Session {
    fn open(source: Option<&str>, arguments: &[&str]) -> Self {
        let mut screen = tool("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1100x700x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(screen.stdout.take().unwrap()).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim());
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("sheet.toml");
        fs::write(&scene, SCENE).unwrap();
        let program = Command::new(env!("CARGO_BIN_EXE_cloth"))
            .arg("view")
            .arg(source.map_or(scene, PathBuf::from))
            .args(["--backend", "cpu", "--window-size", "900x600", "--log", "log.jsonl"])
            .args(arguments)
            .current_dir(folder.path())
            .env("DISPLAY", &display)
            // Drivers complain where there is none.
            .env_remove("XDG_RUNTIME_DIR")
            .env_remove("NODEVICE_SELECT")
            .env_remove("WAYLAND_DISPLAY")
            .stderr(fs::File::create(folder.path().join("stderr")).unwrap())
            .spawn()
            .unwrap();
        let mut session = Self { screen, display, program, window: String::new(), folder };
        session.wait("a first frame", |_| true);
        // It waits until the window is there, which may be after the first frame was made.
        let found = session.xdotool(&["search", "--sync", "--onlyvisible", "--name", "cloth"]);
        session.window = found.lines().next().unwrap().to_owned();
        // No window manager gives it the keyboard.
        session.xdotool(&["windowfocus", "--sync", &session.window]);
        session
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let output =
            tool("xdotool").args(arguments).env("DISPLAY", &self.display).output().unwrap();
        assert!(output.status.success(), "xdotool {arguments:?}: {output:?}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }

    fn key(&self, key: &str) {
        self.xdotool(&["key", key]);
    }

    fn last(&self) -> Option<Value> {
        let text = fs::read_to_string(self.folder.path().join("log.jsonl")).ok()?;
        // The last line may be half written.
        text.lines().rev().find_map(|line| serde_json::from_str(line).ok())
    }

    /// Waits until the window shows what is expected.
    fn wait(&mut self, what: &str, expected: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            match self.last() {
                Some(line) if expected(&line) => return line,
                last => {
                    assert!(start.elapsed() < Duration::from_secs(90), "never: {what}; {last:?}");
                }
            }
            assert_eq!(self.program.try_wait().unwrap(), None, "the window is gone: {what}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Goes to a place of the picture: 0 to 1 from left to right and from top to bottom.
    fn pointer_to(&mut self, x: f64, y: f64) {
        let line = self.last().unwrap();
        let edge = |k: usize| line["picture"][k].as_f64().unwrap();
        let place = [edge(0) + x * (edge(2) - edge(0)), edge(1) + y * (edge(3) - edge(1))];
        self.go(place);
    }

    /// Presses the mouse on a widget of the panel, at this share of its width, and drags it to the right \[pixel\].
    fn drag_widget(&mut self, name: &str, share: f64, right: f64) {
        let line = self.wait(name, |line| line["widgets"][name].is_array());
        let edge = |k: usize| line["widgets"][name][k].as_f64().unwrap();
        let place = [edge(0) + share * (edge(2) - edge(0)), 0.5 * (edge(1) + edge(3))];
        self.go(place);
        self.press("1", true);
        for part in 1..=6 {
            self.go([place[0] + right * f64::from(part) / 6.0, place[1]]);
        }
        self.press("1", false);
    }

    /// Moves the pointer, and waits until the window has seen it there: a window that is slow must not find a whole drag
    /// in one picture.
    fn go(&mut self, place: [f64; 2]) {
        let place = place.map(f64::round);
        let [x, y] = place.map(|p| p.to_string());
        self.xdotool(&["mousemove", "--window", &self.window, &x, &y]);
        let is_near = |line: &Value, k: usize| {
            line["pointer"][k].as_f64().is_some_and(|found| (found - place[k]).abs() < 1.5)
        };
        self.wait("the pointer", |line| is_near(line, 0) && is_near(line, 1));
    }

    /// Presses a button of the mouse or lets it go, and waits until the window has seen it.
    fn press(&mut self, button: &str, down: bool) {
        self.xdotool(&[if down { "mousedown" } else { "mouseup" }, button]);
        self.wait("the button of the mouse", |line| line["pressed"] == down);
    }

    /// Clicks on a widget of the panel or a window.
    fn click(&mut self, name: &str) {
        let line = self.wait(name, |line| line["widgets"][name].is_array());
        let edge = |k: usize| line["widgets"][name][k].as_f64().unwrap();
        self.go([0.5 * (edge(0) + edge(2)), 0.5 * (edge(1) + edge(3))]);
        self.press("1", true);
        self.press("1", false);
    }

    fn screenshot(&mut self) -> image::RgbImage {
        let count = |folder: &TempDir| {
            let files = fs::read_dir(folder.path()).unwrap();
            files
                .filter(|file| {
                    file.as_ref().unwrap().path().extension().is_some_and(|e| e == "png")
                })
                .count()
        };
        let before = count(&self.folder);
        self.key("s");
        let path = self.folder.path().join(format!("sheet-{:03}.png", before + 1));
        let start = Instant::now();
        loop {
            // It may be half written.
            if let Ok(picture) = image::open(&path) {
                return picture.into_rgb8();
            }
            assert!(start.elapsed() < Duration::from_secs(60), "no screenshot");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

fn frame(line: &Value) -> u64 {
    line["frame"].as_u64().unwrap()
}

fn held(line: &Value) -> usize {
    line["held"].as_array().unwrap().len()
}

fn share(picture: &image::RgbImage, is: impl Fn([u8; 3]) -> bool) -> f64 {
    let count = picture.pixels().filter(|pixel| is(pixel.0)).count();
    count as f64 / f64::from(picture.width() * picture.height())
}

fn is_cloth([red, green, blue]: [u8; 3]) -> bool {
    red > 50 && f64::from(red) > 1.7 * f64::from(green) && f64::from(red) > 1.7 * f64::from(blue)
}

/// Number of pictures in a film, which the box of their sizes says.
fn mp4_frames(path: &Path) -> u32 {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[4..8], b"ftyp");
    let has = |name: &[u8]| bytes.windows(4).any(|word| word == name);
    assert!(has(b"moov") && has(b"av01") && has(b"mdat"));
    let sizes = bytes.windows(4).position(|word| word == b"stsz").unwrap();
    let count = &bytes[sizes + 12..sizes + 16];
    u32::from_be_bytes(count.try_into().unwrap())
}

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
fn the_whole_screen_is_asked_for_and_given_back() {
    let mut session = Session::open(None, &["--paused"]);
    session.wait("a window", |line| line["fullscreen"] == false);
    session.key("f");
    session.wait("the whole screen", |line| line["fullscreen"] == true);
    session.key("f");
    session.wait("a window again", |line| line["fullscreen"] == false);
}

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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

/// What the window says is said on stderr, too, as loud as is asked for.
#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
fn the_picture_shows_what_the_keys_do() {
    let mut session = Session::open(None, &["--paused"]);
    let plain = session.screenshot();
    let cloth = share(&plain, is_cloth);
    assert!((0.03..0.6).contains(&cloth), "{cloth} of the picture is cloth");

    session.key("w");
    session.wait("wires", |line| line["wires"] == true);
    let wires = session.screenshot();
    let brightness = |picture: &image::RgbImage| {
        let pixels = picture.pixels().filter(|pixel| is_cloth(pixel.0));
        let (sum, count) =
            pixels.fold((0.0, 0.0), |(sum, count), p| (sum + f64::from(p[0]), count + 1.0));
        sum / count
    };
    let (before, after) = (brightness(&plain), brightness(&wires));
    assert!(after < 0.97 * before, "wires cover the cloth: {before}, then {after}");

    // A recording of ten frames.
    session.key("v");
    session.wait("it records", |line| line["recording"] == true);
    session.key("p");
    session.wait("ten frames", |line| frame(line) > 10);
    session.key("p");
    let last = frame(&session.wait("it waits", |line| line["paused"] == true));
    session.key("v");
    let recorded = session.wait("a clip", |line| {
        line["message"].as_str().is_some_and(|text| text.starts_with("recorded"))
    });
    assert_eq!(recorded["recording"], false);
    let frames = mp4_frames(&session.folder.path().join("sheet-001.mp4"));
    assert_eq!(u64::from(frames), last + 1, "every frame is in the clip, however slow the window");
}

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
fn what_is_dropped_is_opened() {
    let mut session = Session::open(Some("flag"), &["--paused"]);
    assert_eq!(session.last().unwrap()["scene"], "flag");
    let scene = session.folder.path().join("sheet.toml");
    drop_source::drop_file(&session.display, session.window.parse().unwrap(), &scene).unwrap();
    session.wait("the sheet", |line| line["scene"] == "sheet");
}

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
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

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
fn clips_are_rendered_without_a_window() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.toml"), SCENE).unwrap();
    let render = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_cloth"))
            .args(["render", "./sheet.toml", "--picture-size", "160x90"])
            .args(arguments)
            .current_dir(folder.path())
            .env_remove("DISPLAY")
            .output()
            .unwrap()
    };
    for name in ["clip.gif", "clip.png", "clip.mp4"] {
        let output = render(&["--frames", "4", "--frame-stride", "2", "--out", name]);
        assert!(output.status.success(), "{output:?}");
        let bytes = fs::read(folder.path().join(name)).unwrap();
        assert!(bytes.len() > 1000, "{name}");
    }
    assert_eq!(mp4_frames(&folder.path().join("clip.mp4")), 3);
    let output = render(&["--frames", "2", "--still", "--out", "still.png"]);
    assert!(output.status.success(), "{output:?}");
    let still = image::open(folder.path().join("still.png")).unwrap().into_rgb8();
    assert_eq!(still.dimensions(), (160, 90));
    assert!(share(&still, is_cloth) > 0.03);
    for (arguments, expected) in [
        (["--out", "clip.avi", "--frames", "1"], "none of mp4, gif, png"),
        (["--out", "still.gif", "--still", ""], "a still picture is a PNG"),
        (["--out", "/nonexistent/a.mp4", "--frames", "1"], "cannot write"),
    ] {
        let output = render(arguments.strip_suffix(&[""]).unwrap_or(&arguments));
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
#[cfg_attr(not(feature = "viewer"), ignore = "needs the feature viewer")]
fn a_run_is_drawn_through_the_gpu() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.toml"), SCENE).unwrap();
    let run = |name: &str, arguments: &[&str], driver: Option<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cloth"));
        command.args(["run", "./sheet.toml", "--frames", "2", "--picture-size", "160x90"]);
        command.args(["--backend", "cpu", "--out", name]).args(arguments);
        if let Some(driver) = driver {
            command.env("VK_DRIVER_FILES", driver).env("VK_ICD_FILENAMES", driver);
        }
        let output = command.current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let picture = |path: &str| image::open(folder.path().join(path)).unwrap().into_rgb8();
    run("plain", &["--format", "png,gif"], None);
    run("drawn", &["--format", "png", "--render"], None);
    run("clip", &["--format", "gif", "--render"], None);
    let said = run("missing", &["--format", "png", "--render"], Some("/nonexistent"));
    assert!(said.contains("mesa-vulkan-drivers"), "{said}");
    let [plain, drawn, missing] =
        ["plain", "drawn", "missing"].map(|name| picture(&format!("{name}/png/sheet_000002.png")));
    assert!(plain == missing, "without an adapter the processor draws");
    assert_eq!(drawn.dimensions(), plain.dimensions());
    assert!(drawn != plain && share(&drawn, is_cloth) > 0.03);
    // The clip shows what the GPU drew, in fewer colours.
    let difference = |a: &image::RgbImage, b: &image::RgbImage| {
        let pairs = a.as_raw().iter().zip(b.as_raw());
        let sum: f64 = pairs.map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
        sum / a.as_raw().len() as f64
    };
    let first = |name: &str| picture(&format!("{name}/png/sheet_000000.png"));
    let clip = gif_first(&folder.path().join("clip/sheet.gif"));
    let (same, other) = (difference(&clip, &first("drawn")), difference(&clip, &first("plain")));
    assert!(same < 0.5 * other, "{same}, {other}");
}

/// The first picture of an animated GIF.
fn gif_first(path: &Path) -> image::RgbImage {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(fs::File::open(path).unwrap()).unwrap();
    let (width, height) = (reader.width().into(), reader.height().into());
    let frame = reader.read_next_frame().unwrap().unwrap();
    let bytes = frame.buffer.chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
    image::RgbImage::from_raw(width, height, bytes).unwrap()
}
