//! Everything that the window asks of the simulation, without a window, on every backend.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod device;
mod past;
mod settings;
mod thread;

use std::time::{Duration, Instant};

use cloth::scene::{CompileOptions, Scene, SceneGust, SceneSolver, SceneWind};
use cloth_viewer::{
    Command, Engine, Gpu, OrbitCamera, Overlays, Playback, Ray, Settings, SettingsChange, Severity,
    SimulationThread, Source, ViewerError, corner_particles,
};

/// Memory for frames that are kept.
const KEEP: u64 = 64 << 20;

const SCENE: &str = r#"
    name = "sheet"
    simulation = { frames = 30, frames_per_second = 30, time_step = 2e-3 }
    wind.velocity = [0, 0, 0]
    [[cloth]]
    name = "sheet"
    geometry.grid = { columns = 15, rows = 15, spacing = 0.05, centre = [0, 0, 0.36], row_axis = [0, 0, 1] }
    material = { thickness = 2e-3, mass.per_particle = 1e-3, stretch = { stiffness = 40, damping = 0.01 }, shear = { stiffness = 20, damping = 0.01 }, bend = { stiffness = 4 } }
    pins = ["top-left", "top-right"]
"#;

fn scene() -> Scene {
    Scene::from_toml(SCENE, "sheet.toml").unwrap()
}

fn gpu() -> Gpu {
    let gpu = Gpu::headless(None).unwrap();
    let backend = gpu.device.adapter_info().backend;
    assert_eq!(backend, cloth::wgpu::wgpu::Backend::Vulkan, "{}", gpu.description());
    gpu
}

fn engines() -> impl Iterator<Item = (&'static str, Engine)> {
    let gpu = gpu();
    ["cpu", "wgpu"].into_iter().map(move |backend| {
        let engine = Engine::new(&gpu, scene(), CompileOptions::default(), backend).unwrap();
        (backend, engine)
    })
}

fn height(engine: &mut Engine, particle: u32) -> f64 {
    engine.state().unwrap().positions[particle as usize][2]
}

/// A ray that meets this point from the front.
fn ray_to(point: [f64; 3]) -> Ray {
    Ray { origin: [point[0], point[1] - 2.0, point[2]], direction: [0.0, 1.0, 0.0] }
}

#[test]
fn corners_are_let_go_and_held_again() {
    for (backend, mut engine) in engines() {
        let [_, _, left, right] = corner_particles(engine.scene());
        assert!(engine.is_held(left) && engine.is_held(right), "{backend}");
        let start = height(&mut engine, left);
        engine.step().unwrap();
        // The GPU has single precision.
        assert!((height(&mut engine, left) - start).abs() < 1e-6, "{backend}: it is held");
        assert!(!engine.corner_toggle(2), "{backend}");
        for _ in 0..4 {
            engine.step().unwrap();
        }
        let fallen = height(&mut engine, left);
        assert!(fallen < start - 0.01, "{backend}: {fallen}");
        assert_eq!(engine.state().unwrap().held[left as usize], 0, "{backend}");
        assert!(engine.corner_toggle(2), "{backend}");
        engine.step().unwrap();
        let caught = height(&mut engine, left);
        engine.step().unwrap();
        assert_eq!(height(&mut engine, left), caught, "{backend}: held where it was");
    }
}

#[test]
fn a_reset_gives_the_first_frames_again() {
    for (backend, mut engine) in engines() {
        let start = engine.state().unwrap().clone();
        for _ in 0..3 {
            engine.step().unwrap();
        }
        let third = engine.state().unwrap().clone();
        assert_ne!(third.positions, start.positions, "{backend}");
        engine.corner_toggle(2);
        engine.step().unwrap();
        engine.reset().unwrap();
        assert_eq!(engine.state().unwrap(), &start, "{backend}");
        assert_eq!(engine.frame(), 0);
        for _ in 0..3 {
            engine.step().unwrap();
        }
        assert_eq!(engine.state().unwrap(), &third, "{backend}: the same bits");
    }
}

#[test]
fn a_pull_brings_the_cloth_to_the_pointer_and_ends() {
    for (backend, mut engine) in engines() {
        engine.step().unwrap();
        // In the middle of the sheet.
        let middle = 7 * 15 + 7;
        let place = engine.state().unwrap().positions[middle];
        let particle = engine.grab_begin(&ray_to(place)).unwrap().unwrap();
        let start = engine.state().unwrap().positions[particle as usize];
        // Sideways, at the distance at which it was taken.
        let target = [start[0] + 0.2, start[1], start[2] + 0.1];
        engine.grab_move(&ray_to(target));
        for _ in 0..15 {
            engine.step().unwrap();
        }
        let pulled = engine.state().unwrap().positions[particle as usize];
        let distance =
            |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        let (before, after) = (distance(start, target), distance(pulled, target));
        assert!(after < 0.5 * before, "{backend}: {before} m, then {after} m");
        assert!(engine.report().measures.strain_max < 1.0, "{backend}: nothing is torn");
        let view = engine.snapshot(Overlays::default()).unwrap().grab.unwrap();
        assert_eq!(view.particle, particle);
        assert_eq!(
            view.position.is_some(),
            backend == "cpu",
            "{backend}: positions stay on the device"
        );

        engine.grab_end();
        for _ in 0..15 {
            engine.step().unwrap();
        }
        let released = engine.state().unwrap().positions[particle as usize];
        assert!(distance(released, target) > after + 0.02, "{backend}: it falls back");
        assert_eq!(engine.snapshot(Overlays::default()).unwrap().grab, None);
    }
}

#[test]
fn a_ray_beside_the_cloth_takes_nothing() {
    for (_, mut engine) in engines() {
        let away = Ray { origin: [9.0, -2.0, 0.0], direction: [0.0, 1.0, 0.0] };
        assert_eq!(engine.pick(&away).unwrap(), None);
        assert_eq!(engine.grab_begin(&away).unwrap(), None);
    }
}

#[test]
fn overlays_find_contacts_and_bins() {
    let text = SCENE.replace("pins = [\"top-left\", \"top-right\"]", "").replace(
        "wind.velocity",
        "contact = { distance = 0.03, response.impulse = {} }\nwind.velocity",
    ) + "
        [[collider]]
        name = \"floor\"
        shape.plane = {}
    ";
    let scene = Scene::from_toml(&text, "sheet.toml").unwrap();
    let gpu = gpu();
    let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "cpu").unwrap();
    let overlays = Overlays { contacts: true, bins: true, ..Overlays::default() };
    let lowest = engine.state().unwrap().positions.iter().map(|x| x[2]).fold(1e9, f64::min);
    let before = engine.snapshot(overlays).unwrap();
    assert!(lowest > 5e-3, "it begins above the floor");
    assert!(before.contacts.is_empty());
    assert_eq!(before.bins.len() % 12, 0);
    assert!(before.bins.len() >= 12 * 15);
    for _ in 0..20 {
        engine.step().unwrap();
    }
    assert!(!engine.snapshot(overlays).unwrap().contacts.is_empty());
}

#[test]
fn what_is_under_the_pointer_is_where_it_is_seen() {
    let (_, mut engine) = engines().next().unwrap();
    let mut style = engine.style().clone();
    let camera = OrbitCamera::from_camera(&style.camera.take().unwrap());
    for particle in [0_u32, 50, 112, 200] {
        let place = engine.state().unwrap().positions[particle as usize];
        let seen = camera.place(place, 1.5).unwrap();
        let ray = camera.ray(seen, 1.5);
        assert_eq!(engine.pick(&ray).unwrap(), Some(particle));
    }
}

#[test]
fn rigid_bodies_fall_are_drawn_where_they_are_and_start_again() {
    let gpu = gpu();
    for backend in ["cpu", "wgpu"] {
        let scene = Scene::builtin("ball-on-sheet").unwrap();
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), backend).unwrap();
        let start = engine.snapshot(Overlays::default()).unwrap().shapes;
        let place = |engine: &mut Engine| {
            engine.state().unwrap().colliders.last().map(|pose| pose.translation[2]).unwrap()
        };
        let before = place(&mut engine);
        for _ in 0..3 {
            engine.step().unwrap();
        }
        assert!(place(&mut engine) < before - 1e-3, "{backend}: the ball falls");
        assert_ne!(engine.snapshot(Overlays::default()).unwrap().shapes, start, "{backend}");
        engine.reset().unwrap();
        assert!((place(&mut engine) - before).abs() < 1e-6, "{backend}");
        engine.step().unwrap();
        assert!(place(&mut engine) > before - 1e-2, "{backend}: from rest again");
    }
}

/// What an error leaves is a scene at its start that nobody holds.
#[test]
fn a_reset_lets_go() {
    for (backend, mut engine) in engines() {
        engine.grab_begin(&ray_to([0.0, 0.0, 0.36])).unwrap().unwrap();
        engine.grab_move(&ray_to([0.3, 0.0, 0.5]));
        engine.step().unwrap();
        engine.reset().unwrap();
        engine.step().unwrap();
        let after = engine.state().unwrap().clone();
        engine.reset().unwrap();
        engine.step().unwrap();
        assert_eq!(engine.state().unwrap(), &after, "{backend}: no spring is left");
        let middle = after.positions[7 * 15 + 7];
        assert!(middle[0].abs() < 1e-3, "{backend}: {middle:?}");
    }
}

/// A sheet whose upper edge hangs on a ball by springs.
fn attached() -> Scene {
    let text = SCENE.replace("pins = [\"top-left\", \"top-right\"]", "")
        + r#"
        [[collider]]
        name = "ball"
        shape.sphere.radius = 0.02
        translation = [0, 0.05, 0.75]
        [[attachment]]
        name = "hand"
        vertices = ["top"]
        to = "ball"
        stiffness = 50
        reach = 0.5
    "#;
    Scene::from_toml(&text, "attached.toml").unwrap()
}

/// The springs of the scene, which it gives in each frame, and those of a hold act side by side.
#[test]
fn attachments_hold_with_and_without_a_pull() {
    let gpu = gpu();
    let top = 14 * 15..15 * 15;
    for backend in ["cpu", "wgpu"] {
        let options = CompileOptions::default();
        let mut engine = Engine::new(&gpu, attached(), options.clone(), backend).unwrap();
        let start = engine.state().unwrap().positions.clone();
        let scene = attached().compile(&options).unwrap();
        let alone = cloth::backend_create(backend, None).unwrap();
        let mut simulation = cloth::Simulation::new(scene, alone.as_ref()).unwrap();
        for _ in 0..10 {
            engine.step().unwrap();
            simulation.step().unwrap();
        }
        let x = engine.state().unwrap().positions.clone();
        assert_eq!(x, simulation.state().unwrap().positions, "{backend}: as without a window");
        let middle = ray_to(x[7 * 15 + 7]);
        engine.grab_begin(&middle).unwrap().unwrap();
        engine.grab_move(&Ray {
            origin: [middle.origin[0] + 0.2, middle.origin[1], middle.origin[2]],
            ..middle
        });
        for _ in 0..20 {
            engine.step().unwrap();
        }
        let pulled = engine.state().unwrap().positions.clone();
        assert!(pulled[7 * 15 + 7][0] > x[7 * 15 + 7][0] + 0.05, "{backend}: it is pulled");
        let falls = top.clone().map(|i| start[i][2] - pulled[i][2]);
        assert!(falls.fold(0.0, f64::max) < 0.05, "{backend}: the edge holds");
        engine.grab_end();
        engine.step().unwrap();
        let after = engine.state().unwrap().positions[top.start][2];
        assert!(start[top.start][2] - after < 0.05, "{backend}: and does when nobody pulls");
    }
}

/// Frames in parts, between which bodies and cloth exchange impulses: anchors go a part of their way in each.
#[test]
fn a_pull_acts_in_scenes_with_bodies() {
    let gpu = gpu();
    for backend in ["cpu", "wgpu"] {
        let scene = Scene::builtin("ball-on-sheet").unwrap();
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), backend).unwrap();
        let particle = engine.scene().model.particle_count() / 3;
        let [x, y, z] = engine.state().unwrap().positions[particle];
        let from = |x: f64, z: f64| Ray { origin: [x, y, z + 2.0], direction: [0.0, 0.0, -1.0] };
        let taken = engine.grab_begin(&from(x, z)).unwrap().unwrap() as usize;
        let before = engine.state().unwrap().positions[taken];
        // Upwards, as the eye goes up by so much.
        engine.grab_move(&from(x, z + 0.1));
        for _ in 0..6 {
            engine.step().unwrap();
        }
        let risen = engine.state().unwrap().positions[taken][2] - before[2];
        assert!((0.02..0.15).contains(&risen), "{backend}: {risen}");
    }
}
