//! Scenes that say nothing but what lies where: each fabric, at each usual spacing, with every solver
//! and response, falls over a ball and does not diverge.

#![expect(clippy::unwrap_used, reason = "a scene that does not run is a test that fails")]

use cloth::{
    Simulation, backend_create,
    scene::{CompileOptions, CompiledScene, Scene, SceneSolver, measured_fabrics},
};

/// Simulated time \[s\]; the longer ones are run by hand with `CLOTH_DRAPE_SECONDS=10`.
fn seconds() -> f64 {
    let given = std::env::var("CLOTH_DRAPE_SECONDS").ok();
    given.and_then(|text| text.parse().ok()).unwrap_or(0.2)
}

const PRESETS: [&str; 5] = ["jersey", "rib-knit", "ponte-roma", "jet-set", "denim"];
const SPACINGS: [f64; 4] = [0.005, 0.01, 0.02, 0.05];

/// A patch of `side` squared particles over a ball of a fifth of its width, for so many seconds.
fn drape_of(
    model: &str,
    preset: &str,
    side: u32,
    spacing: f64,
    contact: &str,
    solver: &str,
    seconds: f64,
) -> CompiledScene {
    let width = f64::from(side - 1) * spacing;
    let frames = (30.0 * seconds).ceil();
    let text = format!(
        "name = 'drape'\n[simulation]\nframes = {frames}\n{solver}\n[[cloth]]\nname = 'a'\n\
         {model}material.preset = '{preset}'\ngeometry.grid = {{ columns = {side}, rows = {side}, \
         spacing = {spacing}, centre = [{}, 0.0, {}] }}\n[[collider]]\nname = 'ball'\n\
         shape.sphere.radius = {}\n{contact}\n",
        0.05 * width,
        0.25 * width,
        0.2 * width,
    );
    let scene =
        Scene::from_toml(&text, "drape.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    scene.compile(&CompileOptions::default()).unwrap()
}

/// The largest strain of a run, or what became of it.
fn run(scene: CompiledScene) -> Result<f64, String> {
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let mut strain = 0.0_f64;
    while !simulation.is_finished() {
        match simulation.step() {
            Ok(report) => strain = strain.max(report.measures.strain_max),
            Err(error) => return Err(error.to_string()),
        }
    }
    Ok(strain)
}

/// A scene of [`drape_of`], and how it was made.
struct Case {
    scene: CompiledScene,
    what: String,
}

impl Case {
    /// What is wrong with its run.
    fn failure(self) -> Option<String> {
        let reason = self.scene.choice.reason.clone();
        assert!(!reason.is_empty());
        let failure = match run(self.scene) {
            // Ten times the strain at which these fabrics tear.
            Ok(strain) if strain < 2.0 => return None,
            Ok(strain) => format!("strain {strain:.2}"),
            Err(error) => error,
        };
        Some(format!("{}, {reason}: {failure}", self.what))
    }
}

/// Every response with every solver, for so many seconds.
fn cases(preset: &str, spacing: f64, side: u32, seconds: f64) -> Vec<Case> {
    let distance = 0.8 * spacing;
    let contacts = [
        String::new(),
        format!("[contact]\ndistance = {distance}"),
        format!("[contact]\ndistance = {distance}\nresponse.impulse.friction = 0.3"),
        format!(
            "[contact]\ndistance = {distance}\nresponse.penalty = {{ stiffness = 20, damping = 0.002 }}"
        ),
    ];
    let solvers = ["", "solver = 'explicit'", "solver = 'implicit'", "solver = 'semi-implicit'"];
    let case = |contact: &String, solver| Case {
        scene: drape_of("model = 'springs'\n", preset, side, spacing, contact, solver, seconds),
        what: format!("{preset}, {spacing} m, {contact:?}"),
    };
    // Triangles are proven apart in each step, thousands of times a second in explicit ones: in long runs with the solver that is chosen alone.
    let is_short = |contact: &String, solver: &str| {
        let is_of_triangles = !contact.is_empty() && !contact.contains("response");
        seconds <= 1.0 || solver.is_empty() || !is_of_triangles
    };
    let of = |contact| {
        let solvers = solvers.into_iter().filter(move |solver| is_short(contact, solver));
        solvers.map(move |solver| case(contact, solver))
    };
    contacts.iter().flat_map(of).collect()
}

fn every_solver(preset: &str, side: u32) -> Vec<String> {
    let cases = SPACINGS.into_iter().flat_map(|spacing| cases(preset, spacing, side, seconds()));
    cases.filter_map(Case::failure).collect()
}

#[test]
fn every_preset_drapes_with_every_solver_and_response() {
    let side = if seconds() > 1.0 { 24 } else { 12 };
    let failures: Vec<String> =
        PRESETS.iter().flat_map(|preset| every_solver(preset, side)).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Ten seconds, long after all lies still, with every solver and response: what grows slowly has grown by then. Finer cloths take steps that are
/// too short for a test; they are run by hand, as above.
#[test]
fn ten_seconds_of_drape_do_not_diverge() {
    let mut failures = Vec::new();
    for (number, preset) in PRESETS.iter().enumerate() {
        let spacing = SPACINGS[number % SPACINGS.len()];
        for case in cases(preset, spacing, 8, 10.0) {
            failures.extend(case.failure());
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The same for fabric of triangles, from knits to denim and the softest and stiffest that are listed; with each solver that has fabric.
#[test]
fn every_fabric_drapes_with_every_solver() {
    let mut failures = Vec::new();
    let is_long = seconds() > 1.0;
    for (number, fabric) in measured_fabrics().iter().enumerate() {
        for (place, spacing) in SPACINGS.into_iter().enumerate() {
            // In a short run each fabric has one spacing with each solver, and its neighbours the others.
            if !is_long && place != number % SPACINGS.len() {
                continue;
            }
            for solver in ["", "solver = 'explicit'", "solver = 'implicit'"] {
                let side = if is_long { 24 } else { 8 };
                // Triangles are proven apart in each of the many explicit steps, which takes minutes.
                let points = if solver.contains("explicit") { "response.impulse = {}" } else { "" };
                let contact = format!("[contact]\ndistance = {}\n{points}", 0.8 * spacing);
                let scene = drape_of(
                    "model = 'fabric'\n",
                    &fabric.name,
                    side,
                    spacing,
                    &contact,
                    solver,
                    seconds(),
                );
                let reason = scene.choice.reason.clone();
                let failure = match run(scene) {
                    Ok(strain) if strain < 2.0 => continue,
                    Ok(strain) => format!("strain {strain:.2}"),
                    Err(error) => error,
                };
                failures.push(format!("{}, {spacing} m, {reason}: {failure}", fabric.name));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The key that limits springs limits triangles.
#[test]
fn a_strain_limit_holds_for_fabric() {
    for solver in ["explicit", "implicit"] {
        let strain = |limit: &str| {
            let text = format!(
                "name = 't'\n[simulation]\nframes = 6\nsolver = '{solver}'\n{limit}[[cloth]]\nname = 'a'\nmodel = 'fabric'\n\
                 pins = ['top']\nmaterial = {{ preset = 'jersey', mass.per_area = 8 }}\n\
                 geometry.grid = {{ columns = 5, rows = 9, spacing = 0.05, row_axis = [0, 0, 1] }}\n"
            );
            let scene = Scene::from_toml(&text, "t.toml").unwrap();
            run(scene.compile(&CompileOptions::default()).unwrap()).unwrap()
        };
        let (free, limited) =
            (strain(""), strain("strain_limit = { ratio = 1.05, sweeps = 30 }\n"));
        assert!(free > 0.15, "{solver}: {free}");
        assert!(limited < 0.08, "{solver}: {limited}");
    }
}

/// The first scene of one's own: a patch, a ball, a distance of contact.
#[test]
fn a_first_scene_says_no_solver_and_no_time_step() {
    let text = "name = 'first'\n[simulation]\nframes = 2\n[[cloth]]\nname = 'a'\n\
                geometry.grid = { columns = 81, rows = 81, spacing = 0.0125, centre = [0, 0, 0.6] }\n\
                material.preset = 'denim'\n[[collider]]\nname = 'ball'\nshape.sphere.radius = 0.2\n\
                translation = [0, 0, 0.38]\n[contact]\ndistance = 0.01\n";
    let scene = Scene::from_toml(text, "first.toml").unwrap();
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert!(compiled.model.has_triangle_contact() && compiled.model.has_fabric());
    assert_eq!(compiled.choice.solver, SceneSolver::Implicit);
    assert!(compiled.choice.reason.contains("takes longer"), "{}", compiled.choice.reason);
    assert!(run(compiled).unwrap() < 0.5);

    // With springs and points each step is cheap.
    let springs = text.replace("name = 'a'\n", "name = 'a'\nmodel = 'springs'\n");
    let scene =
        Scene::from_toml(&format!("{springs}response.impulse = {{}}\n"), "first.toml").unwrap();
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!(compiled.choice.solver, SceneSolver::Explicit);
    assert!(compiled.choice.time_step < compiled.model.stable_time_step());
    assert!(compiled.choice.reason.contains("nine tenths"), "{}", compiled.choice.reason);
    assert!(run(compiled).unwrap() < 0.5);
}

/// What a scene says is kept.
#[test]
fn a_time_step_that_is_given_is_kept() {
    let given = drape_of("", "denim", 8, 0.02, "", "time_step = 1e-6", seconds());
    assert_eq!((given.choice.solver, given.config.time_step), (SceneSolver::Explicit, 1e-6));
    assert_eq!(given.choice.reason, "");
    // A step that explicit ones would diverge with is an implicit one, unless the scene says otherwise.
    let long = drape_of("", "denim", 8, 0.02, "", "time_step = 1e-3", seconds());
    assert_eq!((long.choice.solver, long.config.time_step), (SceneSolver::Implicit, 1e-3));
    assert!(long.choice.reason.contains("would diverge"), "{}", long.choice.reason);
    let explicit = "solver = 'explicit'\ntime_step = 1e-3";
    let explicit = drape_of("", "denim", 8, 0.02, "", explicit, seconds());
    assert_eq!((explicit.choice.solver, explicit.config.time_step), (SceneSolver::Explicit, 1e-3));
    let implicit = drape_of(
        "",
        "denim",
        8,
        0.02,
        "",
        "implicit.time_step = 0.01\nsolver = 'implicit'",
        seconds(),
    );
    assert_eq!((implicit.choice.solver, implicit.config.time_step), (SceneSolver::Implicit, 0.01));
    assert_eq!(implicit.choice.reason, "");
}

/// A ball goes through a sheet that hangs at 10 m/s, farther in a step than it is thick: steps are done again, shorter, unless the scene forbids it.
#[test]
fn a_body_that_comes_fast_gets_shorter_steps() {
    let scene = |adaptive: &str| {
        let text = format!(
            "name = 'shot'\n[simulation]\nframes = 10\n{adaptive}\n[[cloth]]\nmaterial.preset = 'jersey'\n\
             geometry.grid = {{ columns = 17, rows = 17, spacing = 0.05, centre = [0, 0, 1], \
             column_axis = [1, 0, 0], row_axis = [0, 0, 1] }}\npins = ['top']\n[[collider]]\n\
             shape.sphere.radius = 0.08\ntranslation = [0, -2, 1]\n\
             motion = [{{ time = 0.4, translation = [0, 2, 1] }}]\n"
        );
        let scene = Scene::from_toml(&text, "shot.toml").unwrap();
        scene.compile(&CompileOptions::default()).unwrap()
    };
    let strain = run(scene("")).unwrap();
    assert!(strain < 0.7, "{strain}");
    let error = run(scene("adaptive = { halvings = 0 }")).unwrap_err();
    assert!(error.contains("diverged"), "{error}");
}
