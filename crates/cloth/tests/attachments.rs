//! Cloths that are attached to bodies and to each other.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    Simulation, backend_create,
    scene::{CompileOptions, CompiledScene, Scene},
};
use tempfile::TempDir;

fn compile(folder: &TempDir, text: &str) -> Result<CompiledScene, String> {
    let mut scene = Scene::from_toml(text, "held.toml").map_err(|error| error.to_string())?;
    scene.origin.directory = folder.path().to_owned();
    scene.compile(&CompileOptions::default()).map_err(|error| error.to_string())
}

const CLOTH: &str = r#"
name = "held"
[simulation]
frames = 30
frames_per_second = 30
solver = "implicit"
precision = "f64"
implicit.time_step = 0.0020833333333333333
implicit.tolerance = 1e-8
implicit.iterations = 1000
[[cloth]]
name = "sheet"
model = "fabric"
material.preset = "cotton-broad"
geometry.grid = { columns = 5, rows = 4, spacing = 0.05, row_axis = [0, 0, 1] }
"#;

const BALL: &str = r#"
[[collider]]
name = "ball"
shape.sphere.radius = 0.05
translation = [0, 0.06, 0.075]
motion = [{ time = 1.0, translation = [0.2, 0.06, 0.275], rotation = { axis = [0, 1, 0], degrees = 90 } }]
[[attachment]]
name = "hand"
vertices = ["top"]
to = "ball"
reach = 0.15
"#;

/// The particles of the upper edge.
const TOP: std::ops::Range<usize> = 15..20;

fn run(scene: &CompiledScene, frames: u32, backend: &str) -> Vec<[f64; 3]> {
    let backend = backend_create(backend, None).unwrap();
    let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    for _ in 0..frames {
        simulation.step().unwrap();
    }
    simulation.state().unwrap().positions.clone()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_collider_carries_what_is_attached_to_it_until_it_lets_go() {
    let folder = TempDir::new().unwrap();
    let scene = compile(&folder, &format!("{CLOTH}{BALL}")).unwrap();
    let start = scene.model.positions().to_vec();
    for backend in ["cpu", "reference"] {
        let moved = run(&scene, 30, backend);
        for i in TOP {
            // A quarter turn about the y axis takes x to -z, and z to x.
            let [x, y, z] = start[i];
            let place = [0.2 + (z - 0.075), y, 0.275 - x];
            assert!(distance(moved[i], place) < 1e-9, "{backend}: {:?} {place:?}", moved[i]);
        }
    }
    let released = compile(&folder, &format!("{CLOTH}{BALL}release = 0.5\n")).unwrap();
    let fallen = run(&released, 30, "cpu");
    assert!(TOP.into_iter().all(|i| fallen[i][2] < start[i][2]), "{fallen:?}");
}

#[test]
fn a_body_that_changes_its_shape_carries_what_is_attached_to_a_face() {
    let folder = TempDir::new().unwrap();
    // A block whose front face goes to the left and shrinks.
    for (number, shift) in [(0, 0.0), (1, 0.1)] {
        let mut text = String::new();
        for y in [0.01, 0.2] {
            for [x, z] in [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]] {
                text += &format!("v {} {y} {z}\n", (1.0 - shift) * x - shift);
            }
        }
        let faces = "f 1 2 3\nf 1 3 4\nf 5 7 6\nf 5 8 7\nf 1 5 6\nf 1 6 2\nf 2 6 7\nf 2 7 3\nf 3 7 8\nf 3 8 4\nf 4 8 5\nf 4 5 1\n";
        std::fs::write(folder.path().join(format!("block{number}.obj")), text + faces).unwrap();
    }
    let body = "[[collider]]\nname = \"block\"\nshape.animation = { file = \"block{}.obj\", frames = 2, rate = 2, cells = 8, start = 0.5 }\n\
        [[attachment]]\nname = \"strap\"\nvertices = [\"top\"]\nto = \"block\"\nreach = 0.011\n";
    let scene = compile(&folder, &format!("{CLOTH}{body}")).unwrap();
    let start = scene.model.positions().to_vec();
    let waiting = run(&scene, 15, "cpu");
    let moved = run(&scene, 30, "cpu");
    for i in TOP {
        assert!(distance(waiting[i], start[i]) < 1e-12);
        let [x, y, z] = start[i];
        let place = [0.9 * x - 0.1, y, z];
        assert!(distance(moved[i], place) < 1e-9, "{:?} {place:?}", moved[i]);
    }
}

#[test]
fn soft_attachments_carry_the_weight() {
    let folder = TempDir::new().unwrap();
    let drag = "[[field]]\ndrag.rate = [20, 20, 20]\n";
    let body = BALL.replace("motion =", "# motion =");
    let text = format!("{CLOTH}{body}stiffness = 2.0\n{drag}");
    let scene = compile(&folder, &text).unwrap();
    let start = scene.model.positions().to_vec();
    let weight = 9.81 * scene.model.masses().iter().sum::<f64>();
    for backend in ["cpu", "reference"] {
        let hanging = run(&scene, 90, backend);
        let pull: f64 = TOP.map(|i| 2.0 * (start[i][2] - hanging[i][2])).sum();
        assert!((pull / weight - 1.0).abs() < 1e-3, "{backend}: {pull} N of {weight} N");
    }
    // A button hangs on two threads from a sheet that is held.
    let button = r#"
[[cloth]]
name = "button"
model = "fabric"
material.preset = "cotton-broad"
geometry.grid = { columns = 3, rows = 2, spacing = 0.02, row_axis = [0, 0, 1], centre = [0.01, 0.02, 0.01] }
[[attachment]]
name = "thread"
cloth = "button"
vertices = [0, 1]
to = "sheet"
reach = 0.03
stiffness = 3.0
"#;
    let pinned = CLOTH.replace("name = \"sheet\"\n", "name = \"sheet\"\npins = [\"all\"]\n");
    let scene = compile(&folder, &format!("{pinned}{button}{drag}")).unwrap();
    let seams = scene.model.seams();
    assert!(seams.stitches().len() >= 4, "to the corners of the triangles around them");
    let range = scene.model.cloths()[1].particles.clone();
    let weight: f64 = 9.81 * range.map(|i| scene.model.masses()[i as usize]).sum::<f64>();
    let hanging = run(&scene, 90, "cpu");
    let pull: f64 = (scene.model.springs().iter())
        .map(|spring| {
            let (particles, kind) =
                (spring.particles, scene.model.springs().kinds()[spring.kind as usize]);
            let [a, b] = particles.map(|i| hanging[i as usize]);
            let length = distance(a, b);
            kind.stiffness * (length - kind.rest_length) * (a[2] - b[2]) / length
        })
        .sum();
    assert!((pull / weight - 1.0).abs() < 1e-2, "{pull} N of {weight} N");
}

/// A load below the sheet, at the middle of its lower edge, held at three vertices.
fn with_load(keys: &str, rest: &str) -> String {
    format!(
        "{CLOTH}{rest}[contact]\n[[rigid]]\nname = \"load\"\nmass = 0.4\nshape.sphere.radius = 0.03\ntranslation = [0, 0, -0.115]\n{keys}\n\
         [[attachment]]\nname = \"strap\"\nvertices = [1, 2, 3]\nto = \"load\"\nreach = 0.07\n"
    )
}

/// Sums of momenta and angular momenta of cloth and bodies.
fn momentum(simulation: &mut Simulation) -> [[f64; 3]; 2] {
    let masses = simulation.model().masses().to_vec();
    let (linear, angular) = simulation.rigid().unwrap().momentum();
    let mut sums = [linear, angular];
    let state = simulation.state().unwrap();
    for ((m, x), v) in masses.iter().zip(&state.positions).zip(&state.velocities) {
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            sums[0][k] += m * v[k];
            sums[1][k] += m * (x[i] * v[j] - x[j] * v[i]);
        }
    }
    sums
}

#[test]
fn what_a_body_gives_the_cloth_that_it_holds_it_loses() {
    let folder = TempDir::new().unwrap();
    let still = CLOTH.replacen("[simulation]", "gravity = [0, 0, 0]\n[simulation]", 1);
    let text = with_load("velocity = [0.3, 0.8, -0.5]\nangular_velocity = [2, 0, 5]", "");
    // As light as the sheet is.
    let text = text.replace(CLOTH, &still).replace("mass = 0.4", "mass = 0.01");
    let scene = compile(&folder, &text).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    let before = momentum(&mut simulation);
    for _ in 0..15 {
        simulation.step().unwrap();
    }
    let after = momentum(&mut simulation);
    let [linear, angular] =
        [0, 1].map(|k| distance(before[k], after[k]) / distance(before[k], [0.0; 3]));
    // Implicit steps damp what turns.
    assert!(linear < 1e-7 && angular < 0.02, "{linear} {angular}: {before:?} {after:?}");
    let body = simulation.rigid().unwrap().motions()[0];
    assert!(body.velocity[2] > -0.45, "the cloth holds it back: {:?}", body.velocity);
    // Straps, of no length at rest, let nothing go.
    let state = simulation.state().unwrap();
    for vertex in [1, 2, 3] {
        let away = distance(state.positions[vertex], body.pose.translation);
        assert!((0.038..0.08).contains(&away), "{vertex}: {away} m");
    }
}

#[test]
fn a_body_hangs_from_the_cloth_that_it_holds_until_it_lets_go() {
    let folder = TempDir::new().unwrap();
    let pinned = CLOTH.replace("name = \"sheet\"\n", "name = \"sheet\"\npins = [\"top\"]\n");
    let drag = "[[field]]\ndrag.rate = [3, 3, 3]\n";
    let text = with_load("", drag).replace(CLOTH, &pinned);
    let scene = compile(&folder, &text).unwrap();
    let height = |scene: &CompiledScene, frames: u32| {
        let backend = backend_create("cpu", None).unwrap();
        let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        let mut heights = Vec::new();
        for _ in 0..frames {
            simulation.step().unwrap();
            let motion = simulation.rigid().unwrap().motions()[0];
            heights.push(motion.pose.translation[2]);
        }
        heights
    };
    let hanging = height(&scene, 90);
    // It swings up and down on what the sheet stretches, less and less.
    let swing = |heights: &[f64]| {
        let [low, high] =
            [f64::min, f64::max].map(|of| heights.iter().copied().reduce(of).unwrap());
        assert!(low > -0.15 && high < -0.11, "{low} {high}");
        high - low
    };
    let [first, last] = [&hanging[..12], &hanging[78..]].map(swing);
    assert!(last < 0.3 * first, "{first} m, then {last} m");
    let text = format!("{text}release = 0.5\n");
    let falling = height(&compile(&folder, &text).unwrap(), 30);
    assert!((falling[14] - hanging[14]).abs() < 1e-12, "{} {}", falling[14], hanging[14]);
    let fallen = hanging[14] - falling[29];
    assert!((fallen / (0.5 * 9.81 * 0.25) - 1.0).abs() < 0.1, "{fallen} m");
}

#[test]
fn bodies_hold_cloth_where_they_can() {
    let folder = TempDir::new().unwrap();
    let text = with_load("", "");
    let twice = format!(
        "{text}[[attachment]]\nname = \"knot\"\nvertices = [2]\nto = \"load\"\nreach = 0.07\n"
    );
    let explicit = text.replace("solver = \"implicit\"", "solver = \"explicit\"");
    for (text, words) in [
        (&twice, "names vertex 2, which another attachment holds"),
        (&explicit, "give `solver = \"implicit\"`"),
    ] {
        let message = compile(&folder, text).err().unwrap_or_else(|| "accepted".into());
        assert!(message.contains(words) && message.contains("line "), "{message}");
    }
    // A spring as stiff as nothing bears is one as stiff as the body does.
    let stiff = compile(&folder, &format!("{text}stiffness = 1e9\n")).unwrap();
    let free = compile(&folder, &text).unwrap();
    assert_eq!(run(&stiff, 5, "cpu"), run(&free, 5, "cpu"));
}

#[test]
fn slips_are_named_with_their_line() {
    let folder = TempDir::new().unwrap();
    let attach = |body: &str| {
        format!(
            "{CLOTH}[[attachment]]\nname = \"hook\"\n{body}\n[[collider]]\nname = \"ball\"\nshape.sphere.radius = 0.05\n"
        )
    };
    for (body, words) in [
        ("vertices = [\"top\"]\nto = \"bal\"", "unknown collider, rigid body or cloth"),
        ("vertices = [\"tip\"]\nto = \"ball\"", "tip"),
        ("vertices = [99]\nto = \"ball\"\nstiffness = 1", "names vertex 99"),
        ("vertices = []\nto = \"ball\"", "is empty"),
        ("vertices = [\"top\"]\nto = \"ball\"", "from \"ball\": move it there"),
        ("vertices = [\"top\"]\nto = \"ball\"\nreach = 0", "reach"),
        ("vertices = [\"top\"]\nto = \"sheet\"\nstiffness = 1", "itself"),
        ("vertices = [\"top\"]\nto = \"sheet\"", "give `stiffness`"),
        ("vertices = [\"top\"]\nto = \"ball\"\nreach = 1\nstiffness = -1", "stiffness"),
        ("vertices = [\"top\"]\nto = \"ball\"\nreach = 1\ndamping = 1", "give both"),
        ("cloth = \"shirt\"\nvertices = [\"top\"]\nto = \"ball\"", "shirt"),
    ] {
        let message = compile(&folder, &attach(body)).err().unwrap_or_else(|| "accepted".into());
        assert!(message.contains(words) && message.contains("line "), "{body}: {message}");
    }
    assert!(compile(&folder, &attach("vertices = [\"top\"]\nto = \"ball\"\nreach = 1")).is_ok());
}
