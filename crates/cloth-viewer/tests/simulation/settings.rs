//! Changed settings of a scene that runs.

use super::*;

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
