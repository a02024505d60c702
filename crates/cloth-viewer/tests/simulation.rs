//! Everything that the window asks of the simulation, without a window, on every backend.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::time::{Duration, Instant};

use cloth::scene::{CompileOptions, Scene, SceneSolver};
use cloth_viewer::{
    Command, Engine, Gpu, OrbitCamera, Overlays, Playback, Ray, Settings, SettingsChange,
    SimulationThread, Source, ViewerError, corner_particles,
};

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
fn wind_is_live_and_stiffness_rebuilds_with_the_state_kept() {
    for (backend, mut engine) in engines() {
        for _ in 0..3 {
            engine.step().unwrap();
        }
        let state = engine.state().unwrap().clone();
        let old = engine.settings().clone();
        assert_eq!(engine.apply(&old).unwrap(), SettingsChange::None);
        let windy = Settings { wind: [0.0, 8.0, 0.0], ..old.clone() };
        assert_eq!(engine.apply(&windy).unwrap(), SettingsChange::Live, "{backend}");
        assert_eq!(engine.state().unwrap(), &state, "{backend}");
        let stiff = Settings { stiffness: [3.0, 2.0, 1.5], time_step: 1e-3, ..windy };
        assert_eq!(engine.apply(&stiff).unwrap(), SettingsChange::Rebuilt, "{backend}");
        assert_eq!(engine.state().unwrap().positions, state.positions, "{backend}: kept");
        assert_eq!(engine.state().unwrap().velocities, state.velocities, "{backend}: kept");
        let kinds = engine.scene().model.springs().kinds();
        assert!(kinds.iter().any(|kind| (kind.stiffness - 120.0).abs() < 1e-9), "{kinds:?}");
        for _ in 0..6 {
            engine.step().unwrap();
        }
        let middle = engine.state().unwrap().positions[7 * 15 + 7];
        assert!(middle[1] > state.positions[7 * 15 + 7][1] + 0.02, "{backend}: it is blown away");
    }
}

#[test]
fn a_change_that_cannot_be_had_changes_nothing() {
    for (backend, mut engine) in engines() {
        engine.step().unwrap();
        let state = engine.state().unwrap().clone();
        let old = engine.settings().clone();
        let error = engine.apply(&Settings { backend: "abacus".into(), ..old.clone() });
        assert!(matches!(error, Err(ViewerError::Backend(_))), "{backend}");
        let error = engine.apply(&Settings { time_step: -1.0, ..old.clone() });
        assert!(matches!(error, Err(ViewerError::Scene(_))), "{backend}");
        assert_eq!(engine.settings(), &old);
        assert_eq!(engine.state().unwrap(), &state);
        engine.step().unwrap();
    }
}

#[test]
fn a_running_scene_moves_to_another_backend_and_integrator() {
    let (_, mut engine) = engines().nth(1).unwrap();
    for _ in 0..3 {
        engine.step().unwrap();
    }
    let state = engine.state().unwrap().clone();
    let settings = Settings {
        backend: "cpu".into(),
        solver: SceneSolver::Implicit,
        time_step: 1.0 / 60.0,
        ..engine.settings().clone()
    };
    assert_eq!(engine.apply(&settings).unwrap(), SettingsChange::Rebuilt);
    assert_eq!(engine.state().unwrap().positions, state.positions);
    engine.step().unwrap();
    assert!(engine.report().solver.iterations > 0);
}

/// Waits until what is shown is as expected.
fn wait(thread: &SimulationThread, what: &str, expected: impl Fn(&cloth_viewer::Shown) -> bool) {
    let start = Instant::now();
    while !expected(&thread.shown()) {
        assert!(start.elapsed() < Duration::from_secs(60), "never: {what}");
        assert!(thread.is_alive());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_thread_obeys_and_never_keeps_the_caller_waiting() {
    let gpu = gpu();
    let source = || Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source(), "cpu", true, || {});
    let frame = |shown: &cloth_viewer::Shown| shown.snapshot.as_ref().map(|s| s.frame);
    wait(&thread, "a first picture", |shown| frame(shown) == Some(0));
    thread.send(Command::Step);
    wait(&thread, "one step", |shown| frame(shown) == Some(1));
    assert!(thread.shown().snapshot.unwrap().paused);
    thread.send(Command::PauseToggle);
    wait(&thread, "it runs", |shown| frame(shown) > Some(3));
    thread.send(Command::PauseToggle);
    wait(&thread, "it waits", |shown| shown.snapshot.as_ref().unwrap().paused);
    thread.send(Command::CornerToggle(2));
    wait(&thread, "a pin less", |shown| shown.snapshot.as_ref().unwrap().held.len() == 1);
    thread.send(Command::Reset);
    wait(&thread, "the start", |shown| {
        frame(shown) == Some(0) && shown.snapshot.as_ref().unwrap().held.len() == 2
    });
    let wrong = Settings { time_step: -1.0, ..thread.shown().settings.unwrap() };
    thread.send(Command::Settings(wrong));
    wait(&thread, "a refusal", |shown| shown.message.is_some());
    thread.send(Command::Open(source(), "abacus".into()));
    wait(&thread, "another refusal", |shown| shown.message_number == 2);
    thread.send(Command::Step);
    wait(&thread, "it still works", |shown| frame(shown) == Some(1));
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

/// Bytes that come back from the device in a frame, on average over `frames` that are drawn.
fn bytes_of_frames(gpu: &Gpu, engine: &mut Engine, frames: u64) -> u64 {
    let before = gpu.backend().bytes_read();
    for _ in 0..frames {
        engine.step().unwrap();
        engine.snapshot(Overlays::default()).unwrap();
    }
    (gpu.backend().bytes_read() - before) / frames
}

/// Of a cloth of nine times as many particles no byte more comes back, with and without a pull.
#[test]
fn positions_never_leave_the_device() {
    let gpu = gpu();
    let fine = SCENE
        .replace(
            "columns = 15, rows = 15, spacing = 0.05",
            "columns = 45, rows = 45, spacing = 0.016",
        )
        .replace("time_step = 2e-3", "time_step = 1e-3");
    for text in [SCENE, &fine] {
        let scene = Scene::from_toml(text, "sheet.toml").unwrap();
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "wgpu").unwrap();
        let idle = bytes_of_frames(&gpu, &mut engine, 5);
        let ray = ray_to([0.0, 0.0, 0.36]);
        let before = gpu.backend().bytes_read();
        assert!(engine.grab_begin(&ray).unwrap().is_some());
        assert!(engine.pick(&ray).unwrap().is_some());
        assert_eq!(gpu.backend().bytes_read(), before, "solvers are not asked");
        for number in 0..6 {
            engine.grab_move(&ray_to([0.02 * f64::from(number), 0.0, 0.36]));
            let pulled = bytes_of_frames(&gpu, &mut engine, 10);
            assert_eq!(pulled, idle, "a pull brings nothing back");
        }
        assert!(idle < 600, "{idle} bytes");
        // What is asked for is counted: position and velocity of every particle.
        let before = gpu.backend().bytes_read();
        let state = engine.state().unwrap();
        assert!(state.positions.iter().all(|x| x[0].is_finite()));
        let size = 32 * state.positions.len() as u64;
        assert_eq!(gpu.backend().bytes_read() - before, size);
        engine.step().unwrap();
        let before = gpu.backend().bytes_read();
        engine.snapshot(Overlays { contacts: true, ..Overlays::default() }).unwrap();
        assert_eq!(gpu.backend().bytes_read() - before, size, "an overlay that the host computes");
    }
}

#[test]
fn bodies_exchange_impulses_alone() {
    let gpu = gpu();
    let scene = Scene::builtin("ball-on-sheet").unwrap();
    let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "wgpu").unwrap();
    let particles = engine.scene().model.particle_count() as u64;
    let bodies = engine.scene().model.colliders().len() as u64;
    let found = bytes_of_frames(&gpu, &mut engine, 2);
    let parts = (500.0 / engine.scene().frames_per_second).ceil() as u64;
    // The results of each exchange: figures, and an impulse of each body.
    assert!(found < parts * (600 + 64 * bodies), "{found} bytes in {parts} exchanges");
    assert!(found < 16 * particles, "{found} bytes, {particles} particles");
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

/// What a file dialog gives, or what is dropped, is opened by its path; a path that is nothing is refused and changes nothing.
#[test]
fn what_is_chosen_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let scene_file = folder.path().join("chosen.toml");
    std::fs::write(
        &scene_file,
        SCENE.replace("name = \"sheet\"\n    sim", "name = \"chosen\"\n    sim"),
    )
    .unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for number in 0..3 {
        std::fs::write(folder.path().join(format!("leaf_{number:06}.obj")), mesh).unwrap();
    }
    let gpu = gpu();
    let first = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, first, "cpu", true, || {});
    let name = |shown: &cloth_viewer::Shown| shown.subject.as_ref().map(|s| s.name.clone());
    wait(&thread, "the first scene", |shown| name(shown).as_deref() == Some("sheet"));
    thread.send(Command::Open(Source::open_path(&scene_file).unwrap(), "cpu".into()));
    wait(&thread, "the scene", |shown| name(shown).as_deref() == Some("chosen"));
    for path in [folder.path().join("leaf_000001.obj"), folder.path().to_owned()] {
        thread.send(Command::Open(Source::open_path(&path).unwrap(), "cpu".into()));
        wait(&thread, "three frames", |shown| {
            shown.snapshot.as_ref().is_some_and(|snapshot| snapshot.recorded == Some(3))
        });
        thread.send(Command::Open(Source::open_path(&scene_file).unwrap(), "cpu".into()));
        wait(&thread, "the scene again", |shown| {
            shown.snapshot.as_ref().is_some_and(|snapshot| snapshot.recorded.is_none())
        });
    }
    assert!(Source::open_path(&folder.path().join("nothing.toml")).is_err());
    assert!(thread.is_alive());
}

/// A run with bodies that is kept as `cloth run` keeps it; without its poses bodies stay where they began.
#[test]
fn recorded_bodies_are_shown_where_they_were() {
    let scene = Scene::builtin("ball-on-sheet").unwrap();
    let options = CompileOptions::default();
    let compiled = scene.compile(&options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let [file, poses] = ["frames.bin", "poses.txt"].map(|name| folder.path().join(name));
    let backend = cloth::backend_create("cpu", None).unwrap();
    let mut simulation = cloth::Simulation::new(compiled.clone(), backend.as_ref()).unwrap();
    let mut store = cloth::io::FrameStore::create(&file, &cloth::topology(&compiled)).unwrap();
    let mut lines = String::new();
    let mut expected = Vec::new();
    for frame in 0..4 {
        if frame > 0 {
            simulation.step().unwrap();
        }
        let state = simulation.state().unwrap();
        store.append(state.time, &state.positions).unwrap();
        lines += &cloth::pose_line(&state.colliders);
        expected.push(cloth::picture_shapes(&compiled.model, &state.colliders, state.time));
    }
    drop(store);
    std::fs::write(&poses, lines).unwrap();
    let gpu = gpu();
    let open = || Playback::of_store(&gpu, &scene, &options, &file);
    let shapes = |playback: &mut Playback, frame: usize| {
        playback.seek(frame);
        playback.snapshot(Overlays::default()).unwrap().shapes
    };
    let mut playback = open().unwrap();
    for frame in [0, 3, 1] {
        assert_eq!(shapes(&mut playback, frame), expected[frame], "frame {frame}");
    }
    assert_ne!(expected[3], expected[0], "the ball falls");
    std::fs::write(&poses, "nothing\n").unwrap();
    assert!(matches!(open(), Err(ViewerError::Poses(_))));
    std::fs::remove_file(&poses).unwrap();
    assert_eq!(shapes(&mut open().unwrap(), 3), expected[0]);
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
