//! Driving a scene frame by frame.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::sync::Arc;

use cloth::{
    ColliderImpulse, Control, Error, Frame, Model, PinAction, PinControl, Pose, Simulation, Solver,
    State, StepReport, backend_create,
    scene::{CompileOptions, CompiledScene, Scene, SceneSolver},
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

fn scene(time_step: f64) -> CompiledScene {
    let mut scene = Scene::from_toml(SCENE, "step.toml").unwrap();
    scene.simulation.time_step = Some(time_step);
    scene.simulation.solver = Some(SceneSolver::Explicit);
    scene.compile(&CompileOptions::default()).unwrap()
}

fn simulation(time_step: f64) -> Simulation {
    Simulation::new(scene(time_step), backend_create("cpu", None).unwrap().as_ref()).unwrap()
}

#[test]
fn frames_are_counted_and_the_timeline_is_applied() {
    let mut simulation = simulation(1e-3);
    let start = simulation.state().unwrap().clone();
    assert_eq!((simulation.frame(), simulation.is_finished()), (0, false));
    assert_eq!(simulation.normals().unwrap()[5], [0.0, 0.0, 1.0]);

    assert_eq!(simulation.step().unwrap().substeps, 20);
    assert_eq!(simulation.frame(), 1);
    let state = simulation.state().unwrap();
    assert_eq!(state.positions[0], start.positions[0], "still held");
    assert!(state.positions[15][2] < start.positions[15][2], "nothing falls");
    assert_eq!(state.held[0], 1);
    simulation.step().unwrap();
    let state = simulation.state().unwrap();
    assert_eq!(state.held[0], 0, "released by the event");
    assert!(state.positions[0] != start.positions[0]);
    simulation.step().unwrap();
    assert!(simulation.is_finished());
    let state = simulation.state().unwrap();
    assert!((state.time - 0.06).abs() < 1e-12);
    assert_eq!(state.step, 60);
}

#[test]
fn a_control_from_outside_is_obeyed_or_refused() {
    let mut simulation = simulation(1e-3);
    let pull = |particle| PinControl { particle, action: PinAction::MoveTo([0.25, 0.25, 0.125]) };
    simulation.step_with(|control| control.pins.push(pull(15))).unwrap();
    assert_eq!(simulation.state().unwrap().positions[15], [0.25, 0.25, 0.125]);
    let refused = simulation.step_with(|control| control.pins.push(pull(16)));
    assert!(matches!(refused, Err(Error::Invalid(_))));
    assert_eq!(simulation.frame(), 1);
    simulation.step().unwrap();
    assert_eq!(simulation.frame(), 2, "a control that was refused has done nothing");
}

#[test]
fn a_diverged_frame_leaves_the_state_of_the_frame_before() {
    let mut simulation = simulation(2e-2);
    let (before, divergence) = loop {
        let before = simulation.state().unwrap().clone();
        match simulation.step() {
            Ok(_) => {}
            Err(Error::Diverged(divergence)) => break (before, divergence),
            Err(other) => panic!("{other}"),
        }
        assert!(simulation.frame() < 1000, "does not diverge");
    };
    assert!(divergence.stable_time_step.is_some_and(|stable| stable < 2e-2));
    assert_eq!(simulation.state().unwrap(), &before);
    assert_eq!(divergence.step, before.step + 1);
    // What was not fetched is gone, and there is no frame after this one.
    let again = Error::Diverged(divergence);
    assert_eq!(simulation.normals().unwrap_err(), again);
    assert_eq!(simulation.step().unwrap_err(), again);
    simulation.solver_mut().upload(&before).unwrap();
    assert_eq!(simulation.state().unwrap(), &before, "a state to go on from");
}

/// A solver that counts what is read from it.
struct Counting {
    solver: Box<dyn Solver>,
    downloads: u32,
    normals: u32,
}

impl Solver for Counting {
    fn model(&self) -> &Arc<Model> {
        self.solver.model()
    }

    fn colliders(&self) -> &[Pose] {
        self.solver.colliders()
    }

    fn upload(&mut self, state: &State) -> cloth::Result<()> {
        self.solver.upload(state)
    }

    fn set_control(&mut self, control: &Control) -> cloth::Result<()> {
        self.solver.set_control(control)
    }

    fn advance(&mut self, frame: Frame) -> cloth::Result<()> {
        self.solver.advance(frame)
    }

    fn synchronize(&mut self) -> cloth::Result<StepReport> {
        self.solver.synchronize()
    }

    fn download(&mut self, out: &mut State) -> cloth::Result<()> {
        self.downloads += 1;
        self.solver.download(out)
    }

    fn particle_position(&mut self, particle: u32) -> cloth::Result<[f64; 3]> {
        self.solver.particle_position(particle)
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> cloth::Result<()> {
        self.solver.collider_impulses(out)
    }

    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> cloth::Result<()> {
        self.normals += 1;
        self.solver.normals(out)
    }
}

#[test]
fn nothing_is_read_from_the_solver_but_what_is_asked_for() {
    let scene = scene(1e-3);
    let backend = backend_create("cpu", None).unwrap();
    let solver = backend.create_solver(Arc::clone(&scene.model), &scene.config).unwrap();
    let mut simulation =
        Simulation::of_solver(scene, Counting { solver, downloads: 0, normals: 0 }).unwrap();
    let reads = |simulation: &Simulation<Counting>| {
        [simulation.solver().downloads, simulation.solver().normals]
    };
    for _ in 0..3 {
        simulation.step().unwrap();
        assert_eq!(simulation.colliders(), []);
    }
    assert_eq!(reads(&simulation), [0, 0]);
    let height = simulation.state().unwrap().positions[15][2];
    assert_eq!(simulation.state().unwrap().positions[15][2], height);
    assert_eq!(reads(&simulation), [1, 0], "once for each frame");
    simulation.state_and_normals().unwrap();
    assert_eq!(reads(&simulation), [1, 1]);
    simulation.step().unwrap();
    assert!(simulation.state().unwrap().positions[15][2] < height);
    simulation.checkpoint().unwrap();
    assert_eq!(reads(&simulation), [2, 1]);
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
        assert_eq!(simulation.step().unwrap().substeps, substeps, "17 parts");
        heights.push(simulation.colliders()[0].translation[2]);
    }
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((-0.4..0.11).contains(&lowest), "the sheet gives way, and holds: {lowest}");
    assert!(heights[1..].iter().all(|&height| height < 0.4), "{heights:?}");
    assert!(heights.windows(3).any(|h| h[1] < h[0] && h[1] < h[2]), "it comes back: {heights:?}");
    let last = simulation.colliders()[0];
    assert_eq!(simulation.state().unwrap().colliders[0], last);
    heights
}

/// Each substep at the impact takes cloth around the bar by more than a certificate along one straight line can prove.
const BAR: &str = r#"
name = "bar"
simulation = { frames = 14, frames_per_second = 30, solver = "implicit", implicit.time_step = 0.016666666666666666 }
contact.distance = 0.003
[[cloth]]
name = "scarf"
model = "fabric"
material.preset = "denim"
geometry.grid = { columns = 21, rows = 9, spacing = 0.02, centre = [0.02, 0.01, 0.5] }
[[collider]]
name = "bar"
shape.capsule = { half_length = 0.2, radius = 0.01 }
translation = [0, 0, 0.41]
rotation = { axis = [1, 0, 0], degrees = 90 }
"#;

#[test]
fn fabric_that_lands_on_a_thin_bar_is_not_drawn_out() {
    let scene = Scene::from_toml(BAR, "bar.toml").unwrap();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let (mut largest, mut touched) = (0.0_f64, 0);
    for _ in 0..14 {
        simulation.step().unwrap();
        largest = largest.max(simulation.audit().unwrap().fabric.unwrap().stretches[1]);
        touched = touched.max(simulation.report().contacts);
    }
    assert!(touched > 20, "{touched} contacts");
    assert!(largest < 1.05, "stretched {largest} times");
}
