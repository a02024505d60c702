//! A virtual screen with the program on it, and what tests ask of both.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;
use tempfile::TempDir;

pub(crate) const SCENE: &str = r##"
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
pub(crate) struct Session {
    screen: Child,
    pub(crate) display: String,
    pub(crate) program: Child,
    pub(crate) window: String,
    pub(crate) folder: TempDir,
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

pub(crate) fn tool(name: &str) -> Command {
    let found =
        Command::new(name).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    assert!(found.is_ok(), "no `{name}`; run: sudo apt-get install --yes xvfb xdotool");
    Command::new(name)
}

impl Session {
    pub(crate) fn open(source: Option<&str>, arguments: &[&str]) -> Self {
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

    pub(crate) fn xdotool(&self, arguments: &[&str]) -> String {
        let output =
            tool("xdotool").args(arguments).env("DISPLAY", &self.display).output().unwrap();
        assert!(output.status.success(), "xdotool {arguments:?}: {output:?}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }

    pub(crate) fn key(&self, key: &str) {
        self.xdotool(&["key", key]);
    }

    pub(crate) fn last(&self) -> Option<Value> {
        let text = fs::read_to_string(self.folder.path().join("log.jsonl")).ok()?;
        // The last line may be half written.
        text.lines().rev().find_map(|line| serde_json::from_str(line).ok())
    }

    /// Waits until the window shows what is expected.
    pub(crate) fn wait(&mut self, what: &str, expected: impl Fn(&Value) -> bool) -> Value {
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
    pub(crate) fn pointer_to(&mut self, x: f64, y: f64) {
        let line = self.last().unwrap();
        let edge = |k: usize| line["picture"][k].as_f64().unwrap();
        let place = [edge(0) + x * (edge(2) - edge(0)), edge(1) + y * (edge(3) - edge(1))];
        self.go(place);
    }

    /// Presses the mouse on a widget of the panel, at this share of its width, and drags it to the right \[pixel\].
    pub(crate) fn drag_widget(&mut self, name: &str, share: f64, right: f64) {
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
    pub(crate) fn go(&mut self, place: [f64; 2]) {
        let place = place.map(f64::round);
        let [x, y] = place.map(|p| p.to_string());
        self.xdotool(&["mousemove", "--window", &self.window, &x, &y]);
        let is_near = |line: &Value, k: usize| {
            line["pointer"][k].as_f64().is_some_and(|found| (found - place[k]).abs() < 1.5)
        };
        self.wait("the pointer", |line| is_near(line, 0) && is_near(line, 1));
    }

    /// Presses a button of the mouse or lets it go, and waits until the window has seen it.
    pub(crate) fn press(&mut self, button: &str, down: bool) {
        self.xdotool(&[if down { "mousedown" } else { "mouseup" }, button]);
        self.wait("the button of the mouse", |line| line["pressed"] == down);
    }

    /// Clicks on a widget of the panel or a window.
    pub(crate) fn click(&mut self, name: &str) {
        let line = self.wait(name, |line| line["widgets"][name].is_array());
        let edge = |k: usize| line["widgets"][name][k].as_f64().unwrap();
        self.go([0.5 * (edge(0) + edge(2)), 0.5 * (edge(1) + edge(3))]);
        self.press("1", true);
        self.press("1", false);
    }

    pub(crate) fn screenshot(&mut self) -> image::RgbImage {
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

pub(crate) fn frame(line: &Value) -> u64 {
    line["frame"].as_u64().unwrap()
}

pub(crate) fn held(line: &Value) -> usize {
    line["held"].as_array().unwrap().len()
}

pub(crate) fn share(picture: &image::RgbImage, is: impl Fn([u8; 3]) -> bool) -> f64 {
    let count = picture.pixels().filter(|pixel| is(pixel.0)).count();
    count as f64 / f64::from(picture.width() * picture.height())
}

pub(crate) fn is_cloth([red, green, blue]: [u8; 3]) -> bool {
    red > 50 && f64::from(red) > 1.7 * f64::from(green) && f64::from(red) > 1.7 * f64::from(blue)
}

/// Number of pictures in a film, which the box of their sizes says.
pub(crate) fn mp4_frames(path: &Path) -> u32 {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[4..8], b"ftyp");
    let has = |name: &[u8]| bytes.windows(4).any(|word| word == name);
    assert!(has(b"moov") && has(b"av01") && has(b"mdat"));
    let sizes = bytes.windows(4).position(|word| word == b"stsz").unwrap();
    let count = &bytes[sizes + 12..sizes + 16];
    u32::from_be_bytes(count.try_into().unwrap())
}
