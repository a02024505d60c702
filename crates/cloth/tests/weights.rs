//! Rigid bodies that press cloth against what does not give way are stopped by it.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    SceneAudit, Simulation, backend_create,
    scene::{CompileOptions, Scene},
};

/// A weight \[kg\] that falls some millimetres onto a mat on a table. What it sways after that, by a millimetre on what it sticks to, dies away within a second.
fn scene(mass: f64) -> String {
    format!(
        r#"
name = "weight"
simulation = {{ frames = 30, frames_per_second = 30 }}
[[cloth]]
name = "mat"
material.preset = "denim"
geometry.grid = {{ columns = 13, rows = 13, spacing = 0.015, centre = [0, 0, 0.102] }}
[contact]
[[collider]]
name = "table"
shape.box.half_extents = [0.2, 0.2, 0.05]
translation = [0, 0, 0.05]
[[rigid]]
name = "weight"
shape.box.half_extents = [0.05, 0.05, 0.05]
mass = {mass}
translation = [0, 0, 0.156]
"#
    )
}

/// Each of them once ended the run: the cloth below was pinched. With wgpu if `CLOTH_TEST_FULL` is set: a processor that stands for a GPU takes minutes.
#[test]
fn a_weight_on_cloth_comes_to_rest() {
    let is_full = std::env::var_os("CLOTH_TEST_FULL").is_some();
    for name in ["cpu", "cuda", "wgpu"].into_iter().filter(|&name| is_full || name != "wgpu") {
        let backend = match backend_create(name, None) {
            Ok(backend) => backend,
            Err(error) => {
                println!("not run here: {name}: {error}");
                continue;
            }
        };
        let masses = if name == "cpu" { &[1.0, 10.0][..] } else { &[10.0] };
        for mass in masses {
            let scene = Scene::from_toml(&scene(*mass), "weight.toml").unwrap();
            let scene = scene.compile(&CompileOptions::default()).unwrap();
            let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
            let audit = SceneAudit::new(simulation.model());
            let mut places = Vec::new();
            while !simulation.is_finished() {
                simulation.step().unwrap();
                let found = simulation.intersections(&audit).unwrap();
                assert_eq!(found.pairs(), 0, "{name} {mass} kg: {found:?}");
                places.push(simulation.rigid().unwrap().motions()[0].pose.translation);
            }
            let motion = simulation.rigid().unwrap().motions()[0];
            // It swayed by half a millimetre in each frame while contact was as soft as suits frames, not bodies.
            let [.., before, after] = places[..] else { panic!("it has 30 frames") };
            let moved = (0..3).fold(0.0_f64, |most, k| most.max((after[k] - before[k]).abs()));
            assert!(moved < 3e-4, "{name} {mass} kg: {moved} m in a frame");
            let [height, upright] = [motion.pose.translation[2], motion.pose.rotation[3]];
            assert!((0.15..0.155).contains(&height), "{name} {mass} kg: at {height} m");
            assert!(upright.abs() > 0.9999, "{name} {mass} kg: {:?}", motion.pose);
            let speed = motion.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!(speed < 0.02, "{name} {mass} kg: {speed} m/s");
        }
    }
}

/// A scene on the processor, at its start.
fn begun(text: &str) -> (Simulation, SceneAudit) {
    let scene = Scene::from_toml(text, "scene.toml").unwrap();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let audit = SceneAudit::new(simulation.model());
    (simulation, audit)
}

/// A ball that falls onto a mat on the ground, which is a plane: the ball itself would rest on that, with no room for the mat.
const ON_THE_GROUND: &str = r#"
name = "ground"
simulation = { frames = 15, frames_per_second = 30 }
[[cloth]]
name = "mat"
material.preset = "denim"
geometry.grid = { columns = 13, rows = 13, spacing = 0.015, centre = [0, 0, 0.002] }
[[collider]]
shape.plane = {}
[[rigid]]
name = "ball"
shape.sphere.radius = 0.05
mass = 3
translation = [0.004, 0.003, 0.056]
"#;

/// Cloth below the ball was pressed into the ground by a millimetre, without a word.
#[test]
fn nothing_is_pressed_into_the_ground() {
    let (mut simulation, audit) = begun(ON_THE_GROUND);
    while !simulation.is_finished() {
        simulation.step().unwrap();
        assert_eq!(simulation.intersections(&audit).unwrap().pairs(), 0);
        let lowest = simulation.state().unwrap().positions.iter().map(|x| x[2]).fold(1.0, f64::min);
        assert!(lowest > -5e-6, "at {lowest} m in frame {}", simulation.frame());
        let ball = simulation.rigid().unwrap().motions()[0].pose.translation[2];
        // Its polyhedron is a little smaller than the ball.
        assert!(ball > 0.0498 && ball < 0.057, "the ball is at {ball} m");
    }
}

/// A foot on a hem goes its way whatever is below: cloth goes into the ground as far as it must, rather than end the run, and comes out again.
#[test]
fn what_nothing_can_stop_presses_cloth_into_the_ground() {
    let foot = "[[collider]]\nshape.sphere.radius = 0.05\ntranslation = [0.004, 0.003, 0.08]\n\
                motion = [{ time = 0.2, translation = [0.004, 0.003, 0.05] }, { time = 0.3, translation = [0.004, 0.003, 0.08] }]\n";
    let (mat, _) = ON_THE_GROUND.split_once("[[rigid]]").unwrap();
    let (mut simulation, audit) = begun(&format!("{mat}{foot}"));
    let mut lowest = Vec::new();
    while !simulation.is_finished() {
        simulation.step().unwrap();
        assert_eq!(simulation.intersections(&audit).unwrap().pairs(), 0);
        let heights = simulation.state().unwrap().positions.iter().map(|x| x[2]);
        lowest.push(heights.fold(1.0, f64::min));
    }
    let deepest = lowest.iter().copied().fold(1.0, f64::min);
    assert!((-1e-3..0.0).contains(&deepest), "{lowest:?}");
    assert!(lowest[14] > 0.0, "{lowest:?}");
}

/// A block that falls into a sling, whose corners rise from then on.
const SLING: &str = r#"
name = "sling"
simulation = { frames = 20, frames_per_second = 30 }
[[cloth]]
name = "sling"
material.preset = "denim"
geometry.grid = { columns = 15, rows = 15, size = [0.36, 0.36], centre = [0, 0, 0.1] }
pins = ["corners"]
[[rigid]]
name = "block"
shape.box.half_extents = [0.05, 0.03, 0.03]
rotation = { axis = [1, 1, 0], degrees = 30 }
mass = 1
translation = [0.01, 0.005, 0.16]
[[event]]
time = 0.2
cloth = "sling"
pins = ["corners"]
action.move = { offset = [0, 0, 0.2], duration = 0.5 }
"#;

/// It stayed where it was, stopped against the way up, and the sling was drawn out to five times its length.
#[test]
fn what_lies_in_cloth_is_lifted_with_it() {
    let (mut simulation, audit) = begun(SLING);
    let mut fastest = 0.0_f64;
    while !simulation.is_finished() {
        simulation.step().unwrap();
        assert_eq!(simulation.intersections(&audit).unwrap().pairs(), 0);
        fastest = fastest.max(simulation.rigid().unwrap().motions()[0].velocity[2]);
    }
    let height = simulation.rigid().unwrap().motions()[0].pose.translation[2];
    assert!((0.1..0.2).contains(&height), "at {height} m");
    // It comes down at 1.5 m/s, and the sling, which it stretches to its limit, throws it up from there.
    assert!(fastest < 1.3, "thrown up at {fastest} m/s, of corners at .4 m/s");
    let stretch = simulation.audit().unwrap().fabric.unwrap().stretches[1];
    assert!(stretch < 1.5, "stretched to {stretch}");
}

/// A ball \[kg\] that falls from a metre and a half onto a cloth held at its border: many times as heavy as what it lands on.
fn trampoline(mass: f64) -> String {
    format!(
        r#"
name = "trampoline"
simulation = {{ frames = 20, frames_per_second = 30 }}
[[cloth]]
name = "sheet"
material.preset = "spandex"
pins = ["border"]
geometry.grid = {{ columns = 21, rows = 21, size = [1, 1] }}
[[rigid]]
name = "ball"
shape.sphere.radius = 0.1
mass = {mass}
translation = [0.08, 0.03, 0.3]
velocity = [0, 0, -4.8]
"#
    )
}

/// Each of them once ended the run: cloth went down with the ball and was stretched to ten times its length, as the ball felt nothing of that. The light
/// one is thrown back; the weight of the heavy one alone stretches the sheet to its limit, which stops it: it goes up again by a tenth of a metre at most.
#[test]
fn a_ball_is_caught_by_a_cloth_that_is_held() {
    for (mass, back) in [(0.3, 1.0..5.0), (3.0, 0.0..1.5)] {
        let (mut simulation, audit) = begun(&trampoline(mass));
        let limit = simulation.model().elements().fabrics()[0].stretch_limit;
        let (mut lowest, mut stretch, mut upwards) = (f64::INFINITY, 1.0_f64, 0.0_f64);
        // Nothing waits for a reaction while the ball flies.
        assert_eq!(simulation.step().unwrap().substeps, 2, "{mass} kg");
        let mut most = 0;
        while !simulation.is_finished() {
            most = most.max(simulation.step().unwrap().substeps);
            assert_eq!(simulation.intersections(&audit).unwrap().pairs(), 0, "{mass} kg");
            let motion = simulation.rigid().unwrap().motions()[0];
            lowest = lowest.min(motion.pose.translation[2]);
            upwards = upwards.max(motion.velocity[2]);
            let fabric = simulation.audit().unwrap().fabric.unwrap();
            stretch = stretch.max(fabric.stretches[1]);
        }
        assert_eq!(most, 17, "{mass} kg");
        assert!((-0.3..-0.1).contains(&lowest), "{mass} kg: down to {lowest} m");
        assert!(stretch < 1.15 * limit, "{mass} kg: stretched to {stretch} of {limit}");
        assert!(back.contains(&upwards), "{mass} kg: thrown back at {upwards} m/s");
    }
}

/// Bodies that meet with cloth between them: the one that lies below was stopped again and again, and the one that came not at all.
#[test]
fn cloth_between_bodies_that_meet_stops_both() {
    let scene = r#"
name = "between"
simulation = { frames = 8, frames_per_second = 30 }
[[cloth]]
name = "cover"
material.preset = "cotton"
geometry.grid = { columns = 13, rows = 13, spacing = 0.025, centre = [0, 0, 0.206] }
[[collider]]
shape.plane = {}
[[rigid]]
name = "ball"
mass = 1.2
shape.sphere.radius = 0.1
translation = [0, 0, 0.1]
[[rigid]]
name = "brick"
mass = 2
shape.box.half_extents = [0.1, 0.05, 0.03]
translation = [0.02, 0, 0.26]
velocity = [0, 0, -5]
"#;
    let (mut simulation, audit) = begun(scene);
    while !simulation.is_finished() {
        simulation.step().unwrap();
        assert_eq!(simulation.intersections(&audit).unwrap().pairs(), 0);
        let [ball, brick] = simulation.rigid().unwrap().motions()[..] else { panic!("two bodies") };
        let apart: [f64; 3] =
            std::array::from_fn(|k| brick.pose.translation[k] - ball.pose.translation[k]);
        let apart = apart.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Rigid bodies may sink into each other by half a millimetre.
        assert!(apart > 0.1295, "{apart} m in frame {}", simulation.frame());
    }
}
