//! Driving a scene frame by frame.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    Error, PinAction, PinControl, Simulation, backend_create,
    scene::{CompileOptions, Scene},
};

const SCENE: &str = r#"
name = "step"
simulation = { frames = 3, frames_per_second = 50, precision = "f64" }
[[cloth]]
name = "patch"
geometry.grid = { columns = 4, rows = 4, spacing = 0.1 }
material = { mass.per_area = 0.2, thickness = 0.001, stretch.stiffness = 20, shear.stiffness = 10, bend.stiffness = 1 }
pins = [0]
[[event]]
time = 0.02
cloth = "patch"
pins = [0]
action = "release"
"#;

fn simulation(time_step: f64) -> Simulation {
    let mut scene = Scene::from_toml(SCENE, "step.toml").unwrap();
    scene.simulation.time_step = time_step;
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    Simulation::new(scene, backend_create("cpu", None).unwrap().as_ref()).unwrap()
}

#[test]
fn frames_are_counted_and_the_timeline_is_applied() {
    let mut simulation = simulation(1e-3);
    let start = simulation.state().clone();
    assert_eq!((simulation.frame(), simulation.is_finished()), (0, false));
    assert_eq!(simulation.normals()[5], [0.0, 0.0, 1.0]);

    let outcome = simulation.step().unwrap();
    assert_eq!((outcome.frame, outcome.report.substeps), (1, 20));
    assert_eq!(outcome.state.positions[0], start.positions[0], "still held");
    assert!(outcome.state.positions[15][2] < start.positions[15][2], "nothing falls");
    assert_eq!(outcome.state.held[0], 1);
    let outcome = simulation.step().unwrap();
    assert_eq!(outcome.state.held[0], 0, "released by the event");
    assert!(outcome.state.positions[0] != start.positions[0]);
    simulation.step().unwrap();
    assert!(simulation.is_finished());
    assert!((simulation.state().time - 0.06).abs() < 1e-12);
    assert_eq!(simulation.state().step, 60);
}

#[test]
fn a_control_from_outside_is_obeyed_or_refused() {
    let mut simulation = simulation(1e-3);
    let pull = |particle| PinControl { particle, action: PinAction::MoveTo([0.25, 0.25, 0.125]) };
    let outcome = simulation.step_with(|control| control.pins.push(pull(15))).unwrap();
    assert_eq!(outcome.state.positions[15], [0.25, 0.25, 0.125]);
    let refused = simulation.step_with(|control| control.pins.push(pull(16)));
    assert!(matches!(refused, Err(Error::Invalid(_))));
    assert_eq!(simulation.frame(), 1);
}

#[test]
fn a_diverged_frame_leaves_the_state_of_the_frame_before() {
    let mut simulation = simulation(2e-2);
    let mut before = simulation.state().clone();
    let divergence = loop {
        match simulation.step() {
            Ok(outcome) => before = outcome.state.clone(),
            Err(Error::Diverged(divergence)) => break divergence,
            Err(other) => panic!("{other}"),
        }
        assert!(simulation.frame() < 1000, "does not diverge");
    };
    assert!(divergence.stable_time_step.is_some_and(|stable| stable < 2e-2));
    assert_eq!(simulation.state(), &before);
    assert_eq!(divergence.step, before.step + 1);
}

/// A ball falls into a sheet under gravity, without drag: it bounces, and never as high as it was. A
/// reaction of the cloth that came late would lift it higher each time.
#[test]
fn a_ball_on_a_sheet_gains_no_energy() {
    let explicit = trampoline("time_step = 4e-4", 85);
    // The steps of the implicit integrator end when ball and sheet tell each other.
    let implicit = trampoline("solver = 'implicit', implicit.time_step = 0.01", 17);
    // It falls as deep; backward Euler takes some energy, so that it does not come back as high.
    let lowest = |heights: &[f64]| heights[..15].iter().copied().fold(f64::INFINITY, f64::min);
    let highest = |heights: &[f64]| heights[15..30].iter().copied().fold(0.0, f64::max);
    assert!((lowest(&explicit) - lowest(&implicit)).abs() < 0.03, "{explicit:?} {implicit:?}");
    let [top, other] = [highest(&implicit), highest(&explicit)];
    assert!(top > 0.7 * other && top < other, "{top} m, explicit {other} m");
}

/// The heights of the ball on a sheet of these settings, which take so many substeps for a frame.
fn trampoline(settings: &str, substeps: u32) -> Vec<f64> {
    let text = r#"
        name = "trampoline"
        simulation = { frames = 60, frames_per_second = 30, SETTINGS }
        [[cloth]]
        name = "sheet"
        pins = ["border"]
        geometry.grid = { columns = 21, rows = 21, spacing = 0.05 }
        material = { mass.per_area = 0.2, thickness = 0.008, stretch = { stiffness = 100, damping = 0.02 }, shear = { stiffness = 40, damping = 0.01 }, bend.stiffness = 5 }
        [[rigid]]
        name = "ball"
        shape.sphere.radius = 0.12
        translation = [0, 0, 0.4]
        mass = 0.2
    "#;
    let text = text.replace("SETTINGS", settings);
    let scene = Scene::from_toml(&text, "trampoline.toml").unwrap();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let mut simulation =
        Simulation::new(scene, backend_create("cpu", None).unwrap().as_ref()).unwrap();
    let mut heights = vec![0.4];
    while !simulation.is_finished() {
        let outcome = simulation.step().unwrap();
        assert_eq!(outcome.report.substeps, substeps, "17 parts");
        heights.push(outcome.state.colliders[0].translation[2]);
    }
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((-0.4..0.11).contains(&lowest), "the sheet gives way, and holds: {lowest}");
    assert!(heights[1..].iter().all(|&height| height < 0.4), "{heights:?}");
    assert!(heights.windows(3).any(|h| h[1] < h[0] && h[1] < h[2]), "it comes back: {heights:?}");
    assert_eq!(simulation.poses().at(60)[0], simulation.state().colliders[0]);
    heights
}
