//! `cloth run` with each of the solvers, and with an adaptive time step.

use crate::place::{Place, TINY};

fn report_lines(place: &Place) -> Vec<serde_json::Value> {
    let text = String::from_utf8(place.read("o/report.jsonl")).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn run(place: &Place, more: &[&str]) -> String {
    let arguments = ["run", "tiny.toml", "--out", "o", "--format", "none", "--overwrite"];
    place.succeeds(&[&arguments, more].concat())
}

#[test]
fn an_explicit_run_says_nothing_of_linear_solvers() {
    let place = Place::with("tiny.toml", TINY);
    let text = run(&place, &["--solver", "explicit"]);
    assert!(!text.contains("iterations") && !text.contains("time step"), "{text}");
    for line in report_lines(&place) {
        assert_eq!((&line["solver_solves"], &line["newton_iterations"]), (&0.into(), &0.into()));
        assert_eq!(line["time_step_changes"], serde_json::json!([]));
    }
}

#[test]
fn an_implicit_run_reports_its_solver() {
    let place = Place::with("tiny.toml", TINY);
    for more in [
        &["--linear", "cg", "--preconditioner", "diagonal"][..],
        &["--linear", "jacobi", "--iterations", "500"],
        &["--newton", "3"],
    ] {
        let text = run(&place, &[&["--solver", "implicit", "--tolerance", "1e-2"], more].concat());
        assert!(text.starts_with("3 frames, 6 substeps of 36 particles in "), "{text}");
        let line = text.lines().find(|line| line.contains("iterations per substep")).unwrap();
        assert!(line.contains("worst residual") && line.contains(" unconverged"), "{text}");
        for line in report_lines(&place) {
            assert_eq!(line["substeps"], 2, "a sixtieth of a second each");
            assert!(line["solver_solves"].as_u64() >= Some(2), "{line}");
            assert!(line["solver_iterations"].as_u64() >= line["solver_solves"].as_u64());
            assert!(line["solver_residual"].as_f64().unwrap() <= 1e-2, "{line}");
            assert_eq!(line["solver_unconverged"], 0);
            assert!(line["newton_iterations"].as_u64() >= Some(2), "{line}");
        }
    }
}

#[test]
fn a_semi_implicit_run_factorises_once() {
    let place = Place::with("tiny.toml", TINY);
    let text = run(&place, &["--solver", "semi-implicit"]);
    let lines: Vec<_> = text.lines().collect();
    assert!(lines.contains(&"24 solves, none of them iterative, 1 factorisation"), "{text}");
    let counts: Vec<_> =
        report_lines(&place).iter().map(|line| line["solver_factorisations"].clone()).collect();
    assert_eq!(counts, [1, 0, 0]);
}

#[test]
fn the_scene_in_the_folder_has_the_settings_of_the_command_line() {
    let place = Place::with("tiny.toml", TINY);
    let settings = ["--linear", "jacobi", "--tolerance", "0.05", "--iterations", "77"];
    let more = ["--solver", "implicit", "--newton", "2", "--time-step", "0.01", "--adaptive"];
    run(&place, &[&settings[..], &more].concat());
    let scene = cloth::scene::Scene::read(&place.path("o/scene.toml")).unwrap();
    let simulation = scene.simulation;
    assert_eq!(simulation.solver, Some(cloth::scene::SceneSolver::Implicit));
    assert_eq!(simulation.time_step, Some(1e-3), "that of the explicit solver");
    assert_eq!(simulation.implicit.time_step, Some(0.01));
    assert_eq!(simulation.implicit.linear, cloth::LinearMethod::Jacobi);
    assert_eq!((simulation.implicit.tolerance, simulation.implicit.iterations), (0.05, 77));
    assert_eq!(simulation.implicit.newton_iterations, 2);
    assert_eq!(simulation.adaptive, Some(cloth::scene::SceneAdaptive::default()));
    // It is a scene like any other: the same run again, without a word on the solver.
    let first = place.read("o/frames.bin");
    place.succeeds(&["run", "o/scene.toml", "--out", "again", "--format", "none"]);
    assert!(place.read("again/frames.bin") == first);
    place.succeeds(&["convert", "o", "o/tiny.pc2"]);
}

/// A time step that diverges when it is fixed.
#[test]
fn an_adaptive_run_succeeds_where_a_fixed_one_diverges() {
    let place = Place::with("tiny.toml", TINY);
    let unstable = ["--solver", "explicit", "--time-step", "1.6e-2", "--frames", "30"];
    let fixed = ["run", "tiny.toml", "--out", "o", "--format", "none"];
    place.fails(4, &[&fixed[..], &unstable].concat());
    let text = run(&place, &[&unstable[..], &["--adaptive"]].concat());
    let line = text.lines().find(|line| line.starts_with("time step halved ")).unwrap();
    assert!(line.contains(" and doubled "), "{text}");
    let lines = report_lines(&place);
    assert_eq!(lines.len(), 30);
    let changes = lines.iter().flat_map(|line| line["time_step_changes"].as_array().unwrap());
    let first = changes.take(1).next().unwrap();
    assert_eq!((&first["from"], &first["to"]), (&1.6e-2.into(), &0.8e-2.into()));
    assert_eq!(first["reason"], "strain");
    assert!(first["value"].as_f64() > Some(0.5), "{first}");
}

#[test]
fn a_resumed_adaptive_run_equals_an_uninterrupted_one() {
    let place = Place::with("tiny.toml", TINY);
    for solver in ["explicit", "implicit", "semi-implicit"] {
        let run = |folder: &str, more: &[&str]| {
            let arguments = ["run", "tiny.toml", "--out", folder, "--format", "none", "--adaptive"];
            let solver = ["--time-step", "1.6e-2", "--solver", solver];
            place.succeeds(&[&arguments, &solver[..], more].concat())
        };
        let folders = ["whole", "parts"].map(|folder| format!("{folder}-{solver}"));
        run(&folders[0], &["--frames", "24"]);
        run(&folders[1], &["--frames", "13"]);
        run(&folders[1], &["--frames", "24", "--resume"]);
        for name in ["frames.bin", "checkpoint.bin"] {
            let [whole, parts] =
                folders.each_ref().map(|folder| place.read(&format!("{folder}/{name}")));
            assert!(whole == parts, "{solver}: {name} differs");
        }
    }
}
