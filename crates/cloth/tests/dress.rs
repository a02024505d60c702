//! A real garment: the dress of "Codimensional Incremental Potential Contact" (Li, Kaufman and Jiang, SIGGRAPH 2021), 14 flat panels with 851 stitches
//! around a body. Its files are not part of this project: `CLOTH_TEST_DATA=FOLDER` names a folder with `dress/stage.obj` and `rumba/shell0.obj` to
//! `rumba/shell30.obj` of them, and without it the test says so and does nothing.
//!
//! `CLOTH_DRESS_FRAMES=N` also runs so many frames, none of which may have triangles that go through each other, and prints how far the seams are.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{path::Path, time::Instant};

use cloth::{
    SceneAudit, Simulation, backend_create,
    scene::{CompileOptions, Scene},
};

const DRESS: &str = include_str!("dress.toml");

#[test]
fn the_stitches_of_a_dress_can_be_welded() {
    let Some(folder) = std::env::var_os("CLOTH_TEST_DATA") else {
        println!(
            "CLOTH_TEST_DATA names no folder with dress/stage.obj and rumba/shell0.obj: nothing is tested"
        );
        return;
    };
    let frames = std::env::var("CLOTH_DRESS_FRAMES").ok().and_then(|text| text.parse().ok());
    let mut scene = Scene::from_toml(DRESS, "dress.toml").unwrap();
    scene.origin.directory = Path::new(&folder).to_owned();
    let begin = Instant::now();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let stitches = scene.model.seams().stitches().len();
    println!("{stitches} stitches, read and checked in {:.1} s", begin.elapsed().as_secs_f64());
    // One of 851 would take the length of an edge, and some are given twice where seams meet.
    assert!(scene.notes.iter().any(|note| note.contains("[990]")), "{:?}", scene.notes);
    let weld = scene.welds.sewn().cloned().unwrap();
    let [before, after] = [&*scene.model, &weld.model].map(|m| m.masses().iter().sum::<f64>());
    assert!((before / after - 1.0).abs() < 1e-12, "welding keeps the mass");
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let audit = SceneAudit::new(simulation.model());
    for frame in 1..=frames.unwrap_or(0) {
        simulation.step().unwrap();
        let found = simulation.intersections(&audit).unwrap();
        let report = simulation.seam_report().unwrap().unwrap();
        println!(
            "frame {frame}: {:.1} s, welded {}, widest stitch {:.6} m at {:.3?}",
            begin.elapsed().as_secs_f64(),
            report.is_welded,
            report.gap,
            report.place
        );
        assert_eq!((found.within, found.bodies), (0, 0), "frame {frame}: {found:?}");
    }
}
