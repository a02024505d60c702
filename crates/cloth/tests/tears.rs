//! Cloth that tears: where threads break, without intersections, and as a run goes on that was interrupted.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    Checkpoint, Control, PinAction, PinControl, SceneAudit, Simulation, backend_create,
    scene::{CompileOptions, CompiledScene, Scene},
};
use tempfile::TempDir;

const COLUMNS: u32 = 25;
const ROWS: u32 = 9;

/// A strip held at its ends, of which the right one is drawn away by a third of its length in a second.
fn strip(solver: &str, tear: &str) -> String {
    format!(
        r#"
name = "strip"
gravity = [0, 0, 0]
contact = {{ distance = 0.002, response.triangles.friction = 0.2 }}
[simulation]
frames = 40
frames_per_second = 30
solver = "{solver}"
precision = "f64"
[[cloth]]
name = "strip"
model = "fabric"
material.preset = "cotton-broad"
geometry.grid = {{ columns = {COLUMNS}, rows = {ROWS}, spacing = 0.02, centre = [0, 0, 0] }}
pins = ["left", "right"]
{tear}
[[event]]
time = 0.1
cloth = "strip"
pins = ["right"]
action.move = {{ offset = [0.16, 0, 0], duration = 1.0 }}
"#
    )
}

fn compile(text: &str) -> Result<CompiledScene, String> {
    let scene = Scene::from_toml(text, "strip.toml").map_err(|error| error.to_string())?;
    scene.compile(&CompileOptions::default()).map_err(|error| error.to_string())
}

/// Largest elongation of threads.
fn elongation(scene: &CompiledScene, positions: &[[f64; 3]]) -> f64 {
    let gauge = cloth::StrainGauge::new(&scene.model);
    let length = |thread: [f64; 3]| thread.iter().map(|x| x * x).sum::<f64>().sqrt();
    let strains = gauge.measure(positions).flat_map(|triangle| triangle.threads.map(length));
    strains.fold(0.0, f64::max) - 1.0
}

/// How many pieces the cloth is in.
fn pieces(scene: &CompiledScene, positions: &[[f64; 3]]) -> usize {
    let open = scene.model.tears().open_in(positions);
    let weld =
        scene.welds.at(cloth::Welding { torn: &open, ..Default::default() }).unwrap().unwrap();
    let mut classes = cloth::VertexClasses::new(weld.model.particle_count());
    for &[a, b, c] in weld.model.triangles() {
        classes.join(a, b);
        classes.join(b, c);
    }
    let all = classes.all();
    (0..).zip(&all).filter(|(own, class)| own == *class).count()
}

/// It holds until its threads are longer than they bear, then parts in two, on every backend and by every way of stepping that fabric has.
#[test]
fn a_strip_that_is_drawn_out_tears_in_two() {
    let runs =
        [("implicit", "cpu"), ("explicit", "cpu"), ("implicit", "wgpu"), ("implicit", "cuda")];
    for (solver, name) in runs {
        let mut text = strip(solver, "tear = { strain = 0.15 }");
        if name == "wgpu" {
            text = text.replace("f64", "f32");
        }
        let backend = match backend_create(name, None) {
            Ok(backend) => backend,
            Err(error) if name != "cpu" => {
                println!("not run here: {name}: {error}");
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let scene = compile(&text).unwrap();
        let start = scene.simulated().clone();
        assert_eq!(start.particle_count(), (COLUMNS * ROWS) as usize);
        assert!(scene.notes.iter().any(|note| note.contains("can tear")), "{:?}", scene.notes);
        let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        let audit = SceneAudit::new(&scene.model);
        let mass: f64 = start.masses().iter().sum();
        let mut held_until = 0.0;
        while simulation.frame() < 40 {
            let before = simulation.torn_edges();
            let positions = simulation.state().unwrap().positions.clone();
            simulation.step().unwrap();
            assert!(simulation.torn_edges() >= before);
            if simulation.torn_edges() == 0 {
                held_until = elongation(&scene, &positions);
            } else if before == 0 {
                let found = elongation(&scene, &positions);
                assert!(found > 0.135, "{solver}: tears in the frame after {found}");
            }
            let found = simulation.intersections(&audit).unwrap();
            assert!(found.is_clean(), "{solver} frame {}: {found:?}", simulation.frame());
        }
        assert!((0.1..=0.15).contains(&held_until), "{solver}: {held_until}");
        let positions = simulation.state().unwrap().positions.clone();
        assert!(pieces(&scene, &positions) >= 2, "{solver}");
        // It is not in shreds.
        let torn = simulation.torn_edges();
        assert!(torn < 6 * ROWS as usize, "{solver}: {torn}");
        let torn: f64 = simulation.solver().model().masses().iter().sum();
        assert!((torn / mass - 1.0).abs() < 1e-12, "{torn} kg of {mass}");
        // Without load the threads are what they were.
        let left = elongation(&scene, &positions);
        assert!(left < 0.12, "{solver}: {left}");
    }
}

/// A cloth that can tear and does not is the cloth that cannot, but for the rounding of pins that move in parts of frames.
#[test]
fn what_does_not_tear_is_as_it_was() {
    let run = |tear: &str| {
        let scene = compile(&strip("implicit", tear)).unwrap();
        let backend = backend_create("cpu", None).unwrap();
        let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
        for _ in 0..8 {
            simulation.step().unwrap();
        }
        let state = simulation.state().unwrap();
        let count = (COLUMNS * ROWS) as usize;
        (state.positions[..count].to_vec(), state.velocities[..count].to_vec())
    };
    let (one, other) = (run(""), run("tear = { strain = 2.0 }"));
    let numbers = |(x, v): &(Vec<[f64; 3]>, Vec<[f64; 3]>)| [&x[..], &v[..]].concat();
    for (one, other) in numbers(&one).as_flattened().iter().zip(numbers(&other).as_flattened()) {
        assert!((one - other).abs() < 1e-7, "{one} {other}");
    }
}

#[test]
fn a_checkpoint_knows_what_is_torn() {
    let scene = compile(&strip("implicit", "tear = { strain = 0.15 }")).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    while simulation.torn_edges() == 0 {
        simulation.step().unwrap();
    }
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("state");
    simulation.checkpoint().unwrap().write(&path).unwrap();
    let read = Checkpoint::read(&path, &scene.model, scene.config.precision).unwrap();
    assert_eq!(read.torn.len(), simulation.torn_edges());
    let mut resumed = Simulation::resume(scene.clone(), backend.as_ref(), &read).unwrap();
    for _ in 0..6 {
        simulation.step().unwrap();
        resumed.step().unwrap();
    }
    assert_eq!(resumed.torn_edges(), simulation.torn_edges());
    assert_eq!(resumed.state().unwrap(), simulation.state().unwrap());
    // Another run that starts there finds it torn.
    let start = Checkpoint::read_start(&path, &scene.model).unwrap();
    let follower = Simulation::start_from(scene, backend.as_ref(), &start).unwrap();
    assert!(follower.torn_edges() > 0);
}

/// One control for a vertex that has six corners acts once.
#[test]
fn corners_that_are_one_are_held_as_one() {
    let text = strip("implicit", "tear = { strain = 2.0 }");
    let (still, _) = text.split_once("[[event]]").unwrap();
    let scene = compile(still).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    let middle = ROWS / 2 * COLUMNS + COLUMNS / 2;
    let at = scene.model.positions()[middle as usize];
    let corners: Vec<u32> = (0..scene.model.particle_count() as u32)
        .filter(|&corner| scene.model.positions()[corner as usize] == at)
        .collect();
    assert!(corners.len() >= 4, "{corners:?}");
    let to = [at[0], at[1], at[2] + 0.01];
    simulation
        .step_with(|control: &mut Control| {
            let pin = |&particle| PinControl { particle, action: PinAction::MoveTo(to) };
            control.pins.extend(corners.iter().map(pin));
        })
        .unwrap();
    let positions = &simulation.state().unwrap().positions;
    let places: Vec<_> = corners.iter().map(|&corner| positions[corner as usize]).collect();
    assert!(places.iter().all(|place| *place == to), "{places:?}");
}

#[test]
fn tears_that_make_no_sense_are_refused() {
    let refused = |tear: &str| compile(&strip("implicit", tear)).unwrap_err();
    for strain in ["0", "-0.1", "nan", "inf"] {
        let error = refused(&format!("tear = {{ strain = {strain} }}"));
        assert!(error.contains("strain"), "{error}");
    }
    let springs = strip("implicit", "tear = { strain = 0.1 }")
        .replace("\"fabric\"", "\"springs\"")
        .replace(", response.triangles.friction = 0.2", "");
    let error = compile(&springs).unwrap_err();
    assert!(error.contains("tear") && error.contains("is of fabric"), "{error}");
    let far = strip("implicit", "tear = { strain = 0.1 }").replace("[\"left\", ", "[500, ");
    let error = compile(&far).unwrap_err();
    assert!(error.contains("names vertex 500 of 225"), "{error}");
}
