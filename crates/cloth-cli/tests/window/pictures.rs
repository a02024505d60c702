//! What is to be seen, in the window and in files.

use std::{fs, path::Path, process::Command};

use crate::session::{SCENE, Session, frame, is_cloth, mp4_frames, share};

#[test]
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
