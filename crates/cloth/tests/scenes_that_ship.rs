//! The scenes that ship, garments sewn and welded among them, without one intersection.
//!
//! `CLOTH_PICTURES=FOLDER` keeps pictures of every tenth frame, and runs the scenes to their end.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::path::Path;

use cloth::{
    SceneAudit, Simulation, backend_create,
    io::{Picture, PictureCloth, PictureScene},
    picture_shapes, picture_style,
    scene::{CompileOptions, Scene},
};

/// Runs a garment for so many frames; the simulation at its end.
fn run(file: &str, frames: u64) -> Simulation {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cloth-scene/scenes/garments");
    let path = std::env::var("CLOTH_GARMENT").map_or_else(|_| folder.join(file), Into::into);
    let options = CompileOptions { mesh_anywhere: true, ..CompileOptions::default() };
    audited((file, Scene::read(&path).unwrap()), &options, frames)
}

/// Runs a scene for so many frames, each of which is audited; the simulation at its end.
fn audited((file, scene): (&str, Scene), options: &CompileOptions, frames: u64) -> Simulation {
    let scene = scene.compile(options).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let pictures = std::env::var_os("CLOTH_PICTURES");
    let frames = if pictures.is_some() { u64::from(scene.frames) } else { frames };
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let audit = SceneAudit::new(simulation.model());
    while simulation.frame() < frames {
        if let Some(folder) = pictures.as_ref().filter(|_| simulation.frame().is_multiple_of(10)) {
            picture(&mut simulation, Path::new(folder), file);
            let seams = simulation.seam_report().unwrap();
            println!("{file} {}: {seams:?}", simulation.frame());
        }
        simulation.step().unwrap();
        let found = simulation.intersections(&audit).unwrap();
        let frame = simulation.frame();
        let counts = (found.within, found.between, found.bodies);
        assert_eq!(counts, (0, 0, 0), "{file} {frame}: {:?}", found.first);
    }
    simulation
}

fn picture(simulation: &mut Simulation, folder: &Path, file: &str) {
    let scene = simulation.scene().clone();
    let style = picture_style(&scene);
    let state = simulation.state().unwrap().clone();
    let time = simulation.frame() as f64 / scene.frames_per_second;
    let image = Picture::render(
        &PictureScene {
            positions: &state.positions,
            triangles: scene.model.triangles(),
            texture: None,
            cloths: vec![PictureCloth {
                triangles: 0..scene.model.triangles().len(),
                color: style.cloth_colors[0],
            }],
            shapes: &picture_shapes(&scene, simulation.colliders(), time),
            dust: &[],
            overlays: None,
        },
        style.camera.as_ref().unwrap(),
        &style,
    )
    .unwrap();
    let mut bytes = format!("P6\n{} {}\n255\n", image.width(), image.height()).into_bytes();
    bytes.extend_from_slice(image.as_raw());
    std::fs::write(folder.join(format!("{file}-{:03}.ppm", simulation.frame())), bytes).unwrap();
}

fn sewn(mut simulation: Simulation) -> Vec<[f64; 3]> {
    let (is_welded, gaps) = simulation.seams().unwrap();
    assert!(is_welded && gaps.iter().all(|gap| *gap == 0.0), "{gaps:?}");
    let audit = SceneAudit::new(simulation.model());
    let found = simulation.intersections(&audit).unwrap();
    assert_eq!(found.within, 0, "{:?}", found.first);
    simulation.state().unwrap().positions.clone()
}

/// As far as something lands on something; `cloth run NAME --audit` shows all frames.
#[test]
fn built_in_scenes_go_through_nothing() {
    for (name, frames) in [
        ("drape", 40),
        ("tablecloth", 30),
        ("napkins", 30),
        ("stack", 45),
        ("table", 30),
        ("flag", 40),
        ("curtain", 185),
    ] {
        audited((name, Scene::builtin(name).unwrap()), &CompileOptions::default(), frames);
    }
}

/// A storm tears seams open, and where they are torn nothing passes either.
#[test]
fn a_flag_tears_at_its_seams() {
    let mut simulation = run("torn-flag.toml", 45);
    let seams = simulation.seam_report().unwrap().unwrap();
    let stitches = simulation.model().seams().stitches().len();
    assert!(seams.broken > 5 && seams.broken < stitches / 2, "{seams:?} of {stitches}");
}

/// A ball breaks the threads of a sheet and is through, and the flaps around the hole are in no one's way.
#[test]
fn a_ball_goes_through_a_sheet() {
    let simulation = run("ball-through-sheet.toml", 16);
    let edges = simulation.model().tears().edges().len();
    let torn = simulation.torn_edges();
    assert!((20..edges / 4).contains(&torn), "{torn} of {edges}");
    let ball = simulation.colliders().last().unwrap().translation[2];
    assert!(ball < 0.7, "the ball is at {ball} m");
}

#[test]
fn a_pillow_is_sewn_and_bulges() {
    let positions = sewn(run("pillow.toml", 50));
    let height = |select: fn(f64, f64) -> f64, start| {
        let middle = positions.iter().filter(|x| x[0].hypot(x[1]) < 0.05);
        middle.map(|x| x[2]).fold(start, select)
    };
    let thick = height(f64::max, f64::MIN) - height(f64::min, f64::MAX);
    assert!((0.05..0.3).contains(&thick), "{thick} m");
}

/// The pleats of a skirt lie on the hips once it is sewn, and open as it flies out.
#[test]
fn a_skirt_opens_its_pleats() {
    let width = |simulation: &mut Simulation| {
        let x = &simulation.state().unwrap().positions;
        x.iter().map(|x| x[0].hypot(x[1])).fold(0.0, f64::max)
    };
    let mut simulation = run("skirt.toml", 50);
    let before = width(&mut simulation);
    assert!((0.2..0.27).contains(&before), "{before} m: folded around the hips");
    for _ in 50..90 {
        simulation.step().unwrap();
    }
    let after = width(&mut simulation);
    assert!(after > before + 0.08, "{after} m, {before} m before");
    sewn(simulation);
}

#[test]
fn a_shirt_is_sewn_around_its_wearer() {
    let positions = sewn(run("tshirt.toml", 40));
    let top = positions.iter().map(|x| x[2]).fold(f64::MIN, f64::max);
    assert!((1.3..1.6).contains(&top), "it hangs on the shoulders: {top} m");
}
