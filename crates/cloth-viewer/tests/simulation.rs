//! Everything that the window asks of the simulation, without a window, on every backend.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

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
fn wind_is_live_and_stiffness_rebuilds_with_the_state_kept() {
    for (backend, mut engine) in engines() {
        for _ in 0..3 {
            engine.step().unwrap();
        }
        let state = engine.state().unwrap().clone();
        let old = engine.settings().clone();
        assert_eq!(engine.apply(&old).unwrap(), SettingsChange::None);
        let air = SceneWind { velocity: [0.0, 8.0, 0.0], ..old.air.unwrap() };
        let windy = Settings { air: Some(air), ..old.clone() };
        assert_eq!(engine.apply(&windy).unwrap(), SettingsChange::Live, "{backend}");
        assert_eq!(engine.state().unwrap(), &state, "{backend}");
        let mut stiff = Settings { time_step: 1e-3, ..windy };
        stiff.cloths[0].material.stretch.stiffness = 120.0;
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
    let thread = SimulationThread::start(&gpu, source(), "cpu", true, KEEP, || {});
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
    wait(&thread, "a refusal", |shown| shown.settings_answered == 1);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Error);
    assert!((thread.shown().settings.unwrap().time_step - 2e-3).abs() < 1e-12);
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
        // Frames are kept on the device, too.
        engine.keep_frames(KEEP).unwrap();
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
        assert!(idle < 640, "{idle} bytes");
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
    assert!(found < parts * (640 + 192 * bodies), "{found} bytes in {parts} exchanges");
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
    let thread = SimulationThread::start(&gpu, first, "cpu", true, KEEP, || {});
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

/// What weighs nothing does not fall, what weighs more is blown less: each value of the panel acts on the cloth that runs.
#[test]
fn gravity_density_gusts_and_friction_act_on_a_running_scene() {
    let after = |change: &dyn Fn(&mut Settings)| {
        let text = SCENE.replace("pins = [\"top-left\", \"top-right\"]", "");
        let scene = Scene::from_toml(&text, "sheet.toml").unwrap();
        let gpu = gpu();
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "cpu").unwrap();
        engine.step().unwrap();
        let mut settings = engine.settings().clone();
        change(&mut settings);
        assert_ne!(engine.apply(&settings).unwrap(), SettingsChange::None);
        assert_eq!(engine.settings(), &settings);
        let before = engine.state().unwrap().positions[112];
        for _ in 0..8 {
            engine.step().unwrap();
        }
        let after = engine.state().unwrap().positions[112];
        [0, 1, 2].map(|k| after[k] - before[k])
    };
    let wind = |air: &mut Option<SceneWind>| {
        *air = Some(SceneWind { velocity: [0.0, 5.0, 0.0], density: 1.204, gust: None });
    };
    let plain = after(&|settings| wind(&mut settings.air));
    let thin = after(&|settings| {
        wind(&mut settings.air);
        settings.air.as_mut().unwrap().density = 0.3;
    });
    assert!(thin[1] < 0.6 * plain[1], "air: {} m, thin air: {} m", plain[1], thin[1]);
    let gusts = after(&|settings| {
        wind(&mut settings.air);
        let gust = SceneGust { amplitude: 0.9, frequency: 1.0 };
        settings.air.as_mut().unwrap().gust = Some(gust);
    });
    assert!(gusts[1] > 1.1 * plain[1], "{} m, in a gust {} m", plain[1], gusts[1]);
    let up = after(&|settings| settings.gravity = [0.0, 0.0, 9.81]);
    let down = after(&|settings| settings.gravity = [0.0, 0.0, -20.0]);
    assert!(up[2] > 0.05 && down[2] < -0.3, "{up:?}, {down:?}");
    let heavy = after(&|settings| {
        wind(&mut settings.air);
        settings.cloths[0].material.mass = cloth::Mass::PerParticle(5e-3);
    });
    assert!(heavy[1] < 0.5 * plain[1], "{} m, heavy: {} m", plain[1], heavy[1]);
}

#[test]
fn friction_of_a_collider_holds_a_sheet_on_a_slope() {
    let slide = |friction: f64| {
        let text = SCENE
            .replace("pins = [\"top-left\", \"top-right\"]", "")
            .replace(
                "centre = [0, 0, 0.36], row_axis = [0, 0, 1]",
                "centre = [0, 0, 0.002], row_axis = [0, 1, 0]",
            )
            .replace("wind.velocity = [0, 0, 0]", "gravity = [4, 0, -9]")
            + "\n[[collider]]\nname = \"floor\"\nshape.plane = {}\nfriction = 0.1\n";
        let scene = Scene::from_toml(&text, "sheet.toml").unwrap();
        let mut engine = Engine::new(&gpu(), scene, CompileOptions::default(), "cpu").unwrap();
        let mut settings = engine.settings().clone();
        assert_eq!(settings.surfaces[0].name, "floor");
        settings.surfaces[0].friction = friction;
        engine.apply(&settings).unwrap();
        for _ in 0..12 {
            engine.step().unwrap();
        }
        let positions = &engine.state().unwrap().positions;
        positions.iter().map(|x| x[0]).sum::<f64>() / positions.len() as f64
    };
    let (rough, smooth) = (slide(0.9), slide(0.05));
    assert!(rough < 0.02 && smooth > 0.15, "{rough} m, {smooth} m");
}

/// Each cloth has its own values: a change of one leaves the other alone.
#[test]
fn material_values_are_those_of_one_cloth() {
    let two = SCENE.to_owned()
        + &SCENE[SCENE.find("[[cloth]]").unwrap()..]
            .replace("\"sheet\"", "\"other\"")
            .replace("centre = [0, 0, 0.36]", "centre = [2, 0, 0.36]");
    let scene = Scene::from_toml(&two, "two.toml").unwrap();
    let gpu = gpu();
    let open = || Engine::new(&gpu, scene.clone(), CompileOptions::default(), "cpu").unwrap();
    let (mut engine, mut plain) = (open(), open());
    let mut settings = engine.settings().clone();
    assert_eq!(settings.cloths[1].name, "other");
    settings.cloths[1].material.stretch.stiffness = 10.0;
    assert_eq!(engine.apply(&settings).unwrap(), SettingsChange::Rebuilt);
    for engine in [&mut engine, &mut plain] {
        for _ in 0..5 {
            engine.step().unwrap();
        }
    }
    let (changed, plain) = (engine.state().unwrap(), plain.state().unwrap());
    assert_eq!(changed.positions[..225], plain.positions[..225], "the first cloth is as it was");
    let lowest = |x: &[[f64; 3]]| x.iter().map(|x| x[2]).fold(1e9, f64::min);
    let (soft, stiff) = (lowest(&changed.positions[225..]), lowest(&plain.positions[225..]));
    assert!(soft < stiff - 0.01, "{soft} m, {stiff} m");
    // What is saved says so of this cloth alone.
    let saved = engine.scene_present();
    assert_eq!(saved.cloths[0], scene.cloths[0]);
    assert_eq!(saved.cloths[1].material.stretch.unwrap().stiffness, Some(10.0));
}

/// Another integrator takes the step that the scene has for it.
#[test]
fn an_integrator_comes_with_its_own_time_step() {
    let mut scene = scene();
    scene.simulation.implicit.time_step = Some(1.0 / 90.0);
    let mut engine = Engine::new(&gpu(), scene, CompileOptions::default(), "cpu").unwrap();
    let old = engine.settings().clone();
    engine.apply(&Settings { solver: SceneSolver::Implicit, ..old.clone() }).unwrap();
    assert_eq!(engine.settings().time_step, 1.0 / 90.0);
    engine.apply(&old).unwrap();
    assert_eq!(engine.settings(), &old);
}

/// Looking back changes nothing, and going on from an earlier frame gives the bits that it gave the first time.
#[test]
fn frames_are_kept_shown_and_gone_on_from() {
    let gpu = gpu();
    for (backend, name) in [("cpu", "sheet"), ("wgpu", "sheet"), ("cpu", "ball-on-sheet")] {
        let scene = if name == "sheet" { scene() } else { Scene::builtin(name).unwrap() };
        let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), backend).unwrap();
        engine.keep_frames(KEEP).unwrap();
        let mut states = vec![engine.state().unwrap().clone()];
        for _ in 0..6 {
            engine.step().unwrap();
            states.push(engine.state().unwrap().clone());
        }
        assert_eq!(engine.kept().unwrap().range, Some([0, 6]), "{backend}, {name}");
        let overlays = Overlays { bins: true, ..Overlays::default() };
        let past = engine.snapshot_past(2, overlays).unwrap().unwrap();
        assert_eq!((past.frame, past.is_past, past.time), (2, true, states[2].time));
        assert!(!past.bins.is_empty());
        assert!(engine.snapshot_past(7, overlays).unwrap().is_none());
        assert_eq!(engine.state().unwrap(), &states[6], "{backend}, {name}: nothing moved");
        assert_eq!(engine.frame(), 6);

        assert!(engine.restore(3).unwrap());
        assert_eq!(engine.frame(), 3);
        assert_eq!(engine.state().unwrap().positions, states[3].positions, "{backend}, {name}");
        assert_eq!(engine.kept().unwrap().range, Some([0, 3]));
        engine.step().unwrap();
        if name == "sheet" {
            assert_eq!(engine.state().unwrap(), &states[4], "{backend}: the same bits");
        }
        assert!(!engine.restore(5).unwrap(), "that is no more");
        engine.reset().unwrap();
        assert_eq!(engine.kept().unwrap().range, Some([0, 0]));
    }
}

#[test]
fn frames_are_kept_within_their_budget() {
    let gpu = gpu();
    for backend in ["cpu", "wgpu"] {
        let mut engine = Engine::new(&gpu, scene(), CompileOptions::default(), backend).unwrap();
        let budget = 3 * 225 * 60;
        engine.keep_frames(budget).unwrap();
        for _ in 0..9 {
            engine.step().unwrap();
            assert!(engine.kept().unwrap().bytes <= budget);
        }
        assert_eq!(engine.kept().unwrap().range, Some([7, 9]), "{backend}");
        // With room for none nothing is kept, and all else works.
        engine.keep_frames(10).unwrap();
        engine.step().unwrap();
        assert_eq!(engine.kept().unwrap().range, None);
        assert!(engine.snapshot_past(10, Overlays::default()).unwrap().is_none());
        assert_eq!(engine.snapshot(Overlays::default()).unwrap().frame, 10);
    }
}

/// A change that tears the cloth apart costs the frames after it, not those before.
#[test]
fn a_divergence_goes_back_to_the_last_good_frame() {
    let gpu = gpu();
    let mut engine = Engine::new(&gpu, scene(), CompileOptions::default(), "cpu").unwrap();
    engine.keep_frames(KEEP).unwrap();
    for _ in 0..4 {
        engine.step().unwrap();
    }
    let good = engine.settings().clone();
    let mut wild = good.clone();
    wild.cloths[0].material.stretch.stiffness = 1e7;
    engine.apply(&wild).unwrap();
    while engine.step().is_ok() {
        assert!(engine.frame() < 50, "it holds");
    }
    let frame = engine.frame();
    assert!((4..50).contains(&frame));
    assert_eq!(engine.kept().unwrap().range, Some([0, frame]));
    assert!(engine.restore(4).unwrap());
    engine.apply(&good).unwrap();
    for _ in 0..4 {
        engine.step().unwrap();
    }
    assert_eq!(engine.frame(), 8);
}

#[test]
fn the_thread_looks_back_and_plays_on() {
    let gpu = gpu();
    let source = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source, "cpu", true, KEEP, || {});
    let view = |shown: &cloth_viewer::Shown| {
        shown.snapshot.as_ref().map(|s| (s.frame, s.is_past, s.paused))
    };
    for _ in 0..8 {
        thread.send(Command::Step);
    }
    wait(&thread, "eight frames", |shown| view(shown) == Some((8, false, true)));
    thread.send(Command::Seek(3));
    wait(&thread, "frame 3", |shown| view(shown) == Some((3, true, true)));
    thread.send(Command::CornerToggle(2));
    wait(&thread, "a refusal", |shown| shown.message.is_some());
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Info);
    thread.send(Command::StepBack);
    wait(&thread, "the one before", |shown| view(shown) == Some((2, true, true)));
    thread.send(Command::Step);
    thread.send(Command::Step);
    wait(&thread, "two later", |shown| view(shown) == Some((4, true, true)));
    thread.send(Command::Seek(u64::MAX));
    wait(&thread, "the last one", |shown| view(shown) == Some((8, false, true)));
    thread.send(Command::Seek(0));
    wait(&thread, "the first one", |shown| view(shown) == Some((0, true, true)));
    thread.send(Command::PauseToggle);
    wait(&thread, "it goes on from the last one", |shown| {
        view(shown).is_some_and(|(frame, is_past, paused)| frame > 8 && !is_past && !paused)
    });
    thread.send(Command::Seek(5));
    wait(&thread, "frame 5", |shown| view(shown) == Some((5, true, true)));
    thread.send(Command::GoOnFromHere);
    thread.send(Command::PauseToggle);
    wait(&thread, "it went on from there", |shown| {
        shown
            .snapshot
            .as_ref()
            .is_some_and(|s| s.paused && !s.is_past && s.kept.unwrap().range == Some([0, s.frame]))
    });
}

#[test]
fn the_thread_saves_the_scene_with_its_settings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.toml");
    let gpu = gpu();
    let source = Source::Scene(Box::new(scene()), CompileOptions::default());
    let thread = SimulationThread::start(&gpu, source, "cpu", true, KEEP, || {});
    wait(&thread, "a first picture", |shown| shown.settings.is_some());
    let mut settings = thread.shown().settings.unwrap();
    settings.gravity = [0.0, 0.0, -1.62];
    settings.cloths[0].material.bend.stiffness = 2.5;
    thread.send(Command::Settings(settings.clone()));
    let save = |replace| Command::Save { path: path.clone(), replace };
    thread.send(save(false));
    wait(&thread, "it is saved", |shown| shown.message_number == 1);
    let saved = Scene::read(&path).unwrap();
    let engine = Engine::new(&gpu, saved, CompileOptions::default(), "cpu").unwrap();
    assert_eq!(engine.settings(), &settings);
    thread.send(save(false));
    wait(&thread, "a refusal", |shown| shown.message_number == 2);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Error);
    thread.send(save(true));
    wait(&thread, "it is replaced", |shown| shown.message_number == 3);
    assert_eq!(thread.shown().message.unwrap().severity, Severity::Info);
}

/// Bodies go on where they are under another gravity, and with another friction.
#[test]
fn rigid_bodies_go_on_under_changed_settings() {
    let scene = Scene::builtin("ball-on-sheet").unwrap();
    let mut engine = Engine::new(&gpu(), scene, CompileOptions::default(), "cpu").unwrap();
    let height =
        |engine: &mut Engine| engine.state().unwrap().colliders.last().unwrap().translation[2];
    for _ in 0..3 {
        engine.step().unwrap();
    }
    let before = height(&mut engine);
    let mut settings = engine.settings().clone();
    settings.gravity = [0.0, 0.0, 40.0];
    settings.surfaces.iter_mut().for_each(|surface| surface.friction = 0.1);
    assert_eq!(engine.apply(&settings).unwrap(), SettingsChange::Rebuilt);
    assert_eq!(height(&mut engine), before);
    engine.step().unwrap();
    let next = height(&mut engine);
    assert!((next - before).abs() < 0.05, "it does not jump: {before} m, {next} m");
    for _ in 0..8 {
        engine.step().unwrap();
    }
    assert!(height(&mut engine) > before + 0.1, "it falls up");
}
