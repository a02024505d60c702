//! The report tells the truth about cloth against cloth, and about springs pushed together.

use cloth::{
    Precision, Simulation,
    scene::{CompileOptions, Scene, ScenePrecision},
};
use harness::backends::{Candidate, candidates};

/// Two squares one above the other. All of the upper one is moved, into the plane of the lower one.
const LAYERS: &str = r#"
name = "layers"
simulation = { frames = 4, frames_per_second = 30, time_step = 5e-4 }

[[cloth]]
name = "low"
model = "springs"
geometry.grid = { columns = 8, rows = 8, spacing = 0.02 }
material = { preset = "jersey" }
pins = ["left", "right"]

[[cloth]]
name = "high"
model = "springs"
geometry.grid = { columns = 8, rows = 8, spacing = 0.02, centre = [0.001, 0, 0.05] }
material = { preset = "jersey" }
pins = ["all"]

[contact]
distance = 0.018
response.impulse.friction = 0.3

[[event]]
time = 0.0
cloth = "high"
pins = ["all"]
action.move = { offset = [0, 0, -0.05], duration = 0.06 }
"#;

/// A strip whose ends are pushed together, and which cannot buckle in its plane: it has no gravity.
const PUSHED: &str = r#"
name = "pushed"
gravity = [0, 0, 0]
simulation = { frames = 3, frames_per_second = 30, time_step = 5e-4 }

[[cloth]]
name = "strip"
model = "springs"
geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }
material = { preset = "jersey" }
pins = ["left", "right"]

[[event]]
time = 0.0
cloth = "strip"
pins = ["right"]
action.move = { offset = [-0.09, 0, 0], duration = 0.06 }
"#;

pub(crate) fn simulation(candidate: &Candidate, text: &str) -> Simulation {
    let mut scene = Scene::from_toml(text, "test.toml").unwrap();
    scene.simulation.precision = match candidate.precision {
        Precision::F32 => ScenePrecision::F32,
        Precision::F64 => ScenePrecision::F64,
    };
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    Simulation::new(scene, candidate.backend.as_ref()).unwrap()
}

/// The shipped stack ended with its lowest cloths in one plane, and the report had nothing to say.
#[test]
fn cloth_in_the_plane_of_another_is_reported() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        let mut simulation = simulation(candidate, LAYERS);
        let counts: Vec<u64> = (0..4)
            .map(|_| {
                simulation.step().unwrap();
                simulation.audit().unwrap().close_pairs
            })
            .collect();
        assert_eq!(counts[0], 0, "{}: still far apart", candidate.label);
        assert!(counts[3] > 8, "{}: {counts:?}", candidate.label);
    }
}

#[test]
fn compression_is_reported() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        let mut simulation = simulation(candidate, PUSHED);
        let audit = (0..3)
            .map(|_| {
                simulation.step().unwrap();
                simulation.audit().unwrap()
            })
            .last()
            .unwrap();
        assert!((audit.compression_max - 0.9).abs() < 1e-5, "{}: {audit:?}", candidate.label);
    }
}
