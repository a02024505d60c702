//! Frames that are kept, and shown again.

use super::*;

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
        expected.push(cloth::picture_shapes(&compiled, &state.colliders, state.time));
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

/// A cloth that tears does so in the window, and is whole again where the user goes back to.
#[test]
fn what_is_torn_is_whole_in_the_past() {
    let text = r#"
        name = "strip"
        gravity = [0, 0, 0]
        contact = { distance = 0.002, response.triangles.friction = 0.2 }
        simulation = { frames = 30, frames_per_second = 30, solver = "implicit" }
        [[cloth]]
        name = "strip"
        model = "fabric"
        material.preset = "cotton-broad"
        tear.strain = 0.1
        geometry.grid = { columns = 13, rows = 5, spacing = 0.02 }
        pins = ["left", "right"]
        [[event]]
        time = 0.0
        cloth = "strip"
        pins = ["right"]
        action.move = { offset = [0.12, 0, 0], duration = 0.5 }
    "#;
    let scene = Scene::from_toml(text, "strip.toml").unwrap();
    let gpu = gpu();
    for backend in ["cpu", "wgpu"] {
        let mut engine =
            Engine::new(&gpu, scene.clone(), CompileOptions::default(), backend).unwrap();
        engine.keep_frames(KEEP).unwrap();
        let open = |engine: &mut Engine| {
            let positions = engine.state().unwrap().positions.clone();
            engine.scene().model.tears().open_in(&positions).len()
        };
        while open(&mut engine) == 0 {
            assert!(engine.frame() < 30, "{backend}");
            engine.step().unwrap();
        }
        let (frame, torn) = (engine.frame(), engine.state().unwrap().positions.clone());
        assert!(engine.restore(frame - 1).unwrap());
        assert_eq!(open(&mut engine), 0, "{backend}");
        engine.step().unwrap();
        assert_eq!(engine.state().unwrap().positions, torn, "{backend}");
        engine.reset().unwrap();
        assert_eq!((open(&mut engine), engine.frame()), (0, 0));
        engine.snapshot(Overlays::default()).unwrap();
    }
}

/// A change that tears the cloth apart costs the frames after it, not those before.
#[test]
fn a_divergence_goes_back_to_the_last_good_frame() {
    let gpu = gpu();
    // Left open, the solver would be the implicit one where this step is too long.
    let mut scene = scene();
    scene.simulation.solver = Some(SceneSolver::Explicit);
    let mut engine = Engine::new(&gpu, scene, CompileOptions::default(), "cpu").unwrap();
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
