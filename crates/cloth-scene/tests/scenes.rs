//! The built-in scenes: all compile, all are stable, and the benchmarks are what they say.

use std::sync::LazyLock;

use cloth_core::{
    AdaptiveSettings, ContactResponse, ImplicitSettings, Integrator, LinearMethod, MatrixForm,
    PinAction, Preconditioner, TimeStepControl,
};
use cloth_scene::{
    BenchKind, CompileOptions, CompiledScene, Scene, SceneError, SceneSolver, bench_scene,
    builtin_scenes,
};

fn compiled(name: &str) -> CompiledScene {
    Scene::builtin(name)
        .and_then(|scene| scene.compile(&CompileOptions::default()))
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_builtin_scene_is_stable_and_has_its_name() {
    for builtin in builtin_scenes() {
        let scene = compiled(builtin.name);
        assert_eq!(scene.name, builtin.name);
        // Their steps were chosen for the cloth as it lies, and are tried out; some are beyond what would be
        // stable in any shape.
        let ratio = scene.config.time_step / scene.model.stable_time_step_at_rest();
        let any = scene.config.time_step / scene.model.stable_time_step();
        eprintln!("{}: {ratio:.2} of the limit at rest, {any:.2} in any shape", builtin.name);
        let is_explicit = scene.config.integrator == Integrator::Explicit;
        assert!(
            ratio < 1.0 || !is_explicit,
            "{}: the time step is {ratio:.2} of the limit",
            builtin.name
        );
        assert_eq!(scene.choice.reason, "", "{} says what it wants", builtin.name);
    }
}

/// The same file for each solver, every one with a time step of its own.
#[test]
fn every_builtin_scene_compiles_for_each_solver() {
    for builtin in builtin_scenes() {
        for &solver in SceneSolver::ALL {
            let mut scene = Scene::builtin(builtin.name).unwrap();
            let explicit = scene.simulation.time_step;
            scene.simulation.solver = Some(solver);
            let config = scene.compile(&CompileOptions::default()).unwrap().config;
            let name = match config.integrator {
                Integrator::Explicit => "explicit",
                Integrator::Implicit(_) => "implicit",
                Integrator::SemiImplicit(_) => "semi-implicit",
                Integrator::Midpoint(_) => "midpoint",
                _ => "?",
            };
            assert_eq!(name, solver.name(), "{}", builtin.name);
            assert_eq!(Some(config.time_step) == explicit, solver == SceneSolver::Explicit);
            let given = scene.simulation.time_step_given(solver);
            assert!(given.is_none_or(|given| given == config.time_step));
        }
    }
}

#[test]
fn settings_of_a_solver_reach_the_engine() {
    let text = "name = \"t\"\n[simulation]\nsolver = \"implicit\"\nadaptive = {}\n\
                [simulation.implicit]\nlinear = \"jacobi\"\niterations = 7\ntolerance = 0\n\
                newton_iterations = 3\n[[cloth]]\nname = \"a\"\nmaterial.preset = \"denim\"\n\
                geometry.grid = { columns = 2, rows = 2, spacing = 1 }\n";
    let scene = Scene::from_toml(text, "t.toml").unwrap();
    let config = scene.compile(&CompileOptions::default()).unwrap().config;
    let Integrator::Implicit(settings) = &config.integrator else { panic!("{config:?}") };
    let default = ImplicitSettings::default();
    assert_eq!(settings.linear.method, LinearMethod::Jacobi);
    assert_eq!((settings.linear.iterations_max, settings.linear.tolerance), (7, 0.0));
    assert_eq!(settings.linear.preconditioner, Preconditioner::Auto);
    assert_eq!(settings.newton.iterations_max, 3);
    assert_eq!(settings.newton.tolerance, default.newton.tolerance);
    assert_eq!(config.time_step, 1.0 / 60.0);
    assert_eq!(config.time_step_control, TimeStepControl::Adaptive(AdaptiveSettings::default()));
}

#[test]
fn every_builtin_scene_says_at_its_end_what_to_see() {
    for builtin in builtin_scenes() {
        assert!(builtin.text.contains(" What to see: "), "{}", builtin.name);
        let sight = builtin.sight();
        assert!(sight.len() > 80 && sight.ends_with('.'), "{}: {sight}", builtin.name);
        assert!(
            !sight.contains("What to see") && !sight.contains("  "),
            "{}: {sight}",
            builtin.name
        );
    }
}

#[test]
fn every_builtin_scene_survives_a_round_trip() {
    for builtin in builtin_scenes() {
        let scene = Scene::builtin(builtin.name).unwrap();
        let text = scene.to_toml().unwrap();
        assert_eq!(Scene::from_toml(&text, "again.toml").unwrap(), scene, "{text}");
    }
}

#[test]
fn a_wrong_name_has_a_suggestion() {
    let error = Scene::builtin("drap").unwrap_err();
    assert_eq!(error.to_string(), "scene: unknown built-in scene `drap`; did you mean `drape`?");
}

#[test]
fn the_benchmark_files_say_what_the_function_makes() {
    for (kind, name) in [(BenchKind::Hang, "bench-hang"), (BenchKind::Sphere, "bench-sphere")] {
        let mut from_file = Scene::builtin(name).unwrap();
        from_file.description.clear();
        assert_eq!(from_file, bench_scene(kind, 160, true));
    }
}

#[test]
fn the_benchmark_has_the_physics_of_the_workload() {
    static HANG: LazyLock<CompiledScene> = LazyLock::new(|| compiled("bench-hang"));
    assert_eq!(HANG.model.particle_count(), 160 * 160);
    assert_eq!(HANG.model.pins(), [0, 159]);
    assert!(HANG.model.masses().iter().all(|&mass| mass == 1e-4));
    assert_eq!(HANG.model.drag_rate(), [0.5; 3]);
    assert_eq!(HANG.config.time_step, 1.0 / 1020.0);
    let last = HANG.model.positions()[160 * 160 - 1];
    assert!((last[0] - 3.18).abs() < 1e-12 && (last[1] - 3.18).abs() < 1e-12 && last[2] == 0.0);
    let contact = HANG.model.self_contact().unwrap();
    assert_eq!(contact.distance, 0.016);
    assert_eq!(contact.response, ContactResponse::Penalty { stiffness: 10.0, damping: 0.002 });
    assert_eq!(HANG.model.cloths()[0].thickness, 0.016);
    let mut classes: Vec<_> =
        HANG.model.springs().kinds().iter().map(|k| (k.class, k.stiffness, k.damping)).collect();
    classes.sort_by(|a, b| a.partial_cmp(b).unwrap());
    classes.dedup();
    let expected = [10.0, 10.0, 2.0].map(|stiffness| (stiffness, 0.005));
    assert_eq!(classes.iter().map(|c| (c.1, c.2)).collect::<Vec<_>>(), expected);

    let small = bench_scene(BenchKind::Sphere, 40, false);
    let small = small.compile(&CompileOptions::default()).unwrap();
    assert_eq!(small.model.self_contact(), None);
    let ball = &small.model.colliders()[0];
    let [side, radius] = [39.0 * 0.02, 0.25 * 39.0 * 0.02];
    assert_eq!(ball.shape, cloth_core::ColliderShape::Sphere { radius });
    assert_eq!(ball.pose.translation, [0.5 * side, 0.5 * side, -(radius + 0.01)]);
    assert_eq!([ball.friction, ball.restitution], [0.3, 0.0]);
}

#[test]
fn the_curtain_lets_go_hook_by_hook() {
    let scene = compiled("curtain");
    let mut held = scene.model.pins().len();
    let mut releases = Vec::new();
    for frame in 0..u64::from(scene.frames) {
        let released = scene
            .timeline
            .control(frame)
            .pins
            .iter()
            .filter(|pin| pin.action == PinAction::Release)
            .count();
        if released > 0 {
            releases.push(released);
        }
        held -= released;
    }
    assert_eq!(held, 0, "nothing holds it at the end");
    assert_eq!(releases, [3; 5], "one hook of three particles at a time");
}

#[test]
fn a_scene_beyond_its_memory_is_refused_before_it_is_built() {
    let scene = bench_scene(BenchKind::Hang, u32::MAX, true);
    let error = scene.compile(&CompileOptions::default()).unwrap_err();
    assert!(matches!(error, SceneError::Memory { .. }), "{error}");
    let estimate =
        bench_scene(BenchKind::Hang, 100, true).memory_estimate(&CompileOptions::default());
    assert_eq!(estimate.particles, 10_000);
    let per_particle = estimate.bytes / estimate.particles;
    assert!((480..=540).contains(&per_particle), "{per_particle} bytes");
}

#[test]
fn the_memory_of_a_solver_is_in_the_estimate() {
    let estimate = |change: &dyn Fn(&mut Scene)| {
        let mut scene = bench_scene(BenchKind::Sphere, 256, false);
        change(&mut scene);
        let estimate = scene.memory_estimate(&CompileOptions::default());
        estimate.bytes / estimate.particles
    };
    let implicit = |change: fn(&mut cloth_scene::SceneImplicit)| {
        estimate(&|scene| {
            scene.simulation.solver = Some(SceneSolver::Implicit);
            change(&mut scene.simulation.implicit);
        })
    };
    let semi_implicit = estimate(&|scene| {
        scene.simulation.solver = Some(SceneSolver::SemiImplicit);
    });
    // Bytes per particle at the peak of the program, without its own; the last two at 250 x 250 particles.
    for (found, measured) in [
        (estimate(&|_| {}), 451.0),
        (implicit(|_| {}), 669.0),
        (implicit(|implicit| implicit.matrix = MatrixForm::Assembled), 968.0),
        (implicit(|implicit| implicit.preconditioner = Preconditioner::IncompleteCholesky), 1659.0),
        (semi_implicit, 3389.0),
    ] {
        let ratio = found as f64 / measured;
        assert!((0.9..1.1).contains(&ratio), "{found} bytes, measured {measured}");
    }
}

#[test]
fn the_midpoint_integrator_warns_where_cloth_meets_colliders() {
    let warns = |name: &str, solver: SceneSolver| {
        let mut scene = Scene::builtin(name).unwrap();
        scene.simulation.solver = Some(solver);
        let scene = scene.compile(&CompileOptions::default()).unwrap();
        scene.warnings.iter().any(|warning| warning.contains("midpoint"))
    };
    assert!(warns("tablecloth", SceneSolver::Midpoint));
    assert!(!warns("tablecloth", SceneSolver::Implicit));
    assert!(!warns("bench-hang", SceneSolver::Midpoint), "there is nothing to hit");
}
