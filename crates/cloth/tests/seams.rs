//! Seams that close and are welded, phases, and what a checkpoint in the middle of that is worth.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    Checkpoint, STITCH_LENGTH, SceneAudit, Simulation, State, Welding, backend_create,
    scene::{CompileOptions, CompiledScene, Scene},
};
use tempfile::TempDir;

/// Two squares of 5 and 4 vertices along the sides that are sewn.
fn panels(folder: &TempDir) {
    let mut text = String::new();
    let mut faces = String::new();
    let mut first = 1;
    for (name, count, y, low) in [("left", 5_usize, 0.0, 0.0), ("right", 4, 0.25, 0.1)] {
        faces += &format!("g {name}\n");
        for j in 0..count {
            for i in 0..count {
                let step = 0.2 / (count - 1) as f64;
                let [u, v] = [i as f64 * step, j as f64 * step];
                // They lie apart in space and in the pattern.
                text += &format!("v {u} {} {low}\nvt {u} {}\n", v + y, v + 2.0 * y);
                if i + 1 < count && j + 1 < count {
                    let at = first + j * count + i;
                    let [b, c, d] = [at + 1, at + count + 1, at + count];
                    faces += &format!("f {at}/{at} {b}/{b} {c}/{c}\nf {at}/{at} {c}/{c} {d}/{d}\n");
                }
            }
        }
        let side = if name == "left" { count * (count - 1) } else { 0 };
        let points = (0..count).map(|i| format!(" {}", first + side + i)).collect::<String>();
        faces += &format!("g {name}-seam\np{points}\n");
        first += count * count;
    }
    std::fs::write(folder.path().join("panels.obj"), text + &faces).unwrap();
}

fn text(solver: &str, seam: &str, more: &str) -> String {
    format!(
        r#"
name = "seam"
gravity = [0, 0, 0]
[simulation]
frames = 20
frames_per_second = 30
solver = "{solver}"
time_step = 2e-5
precision = "f64"
implicit.time_step = 2e-3
implicit.tolerance = 1e-8
implicit.iterations = 1000
[[cloth]]
name = "shirt"
model = "fabric"
material.preset = "cotton-broad"
geometry.mesh.file = "panels.obj"
# Flat, so that contact shortens no way: momentum would not be kept.
pattern.imperfection = 0
pattern.from = "uv"
[[seam]]
name = "side"
close = [0.0, 0.3]
{seam}
{more}"#
    )
}

fn compile(folder: &TempDir, text: &str) -> Result<CompiledScene, String> {
    let mut scene = Scene::from_toml(text, "seam.toml").map_err(|error| error.to_string())?;
    scene.origin.directory = folder.path().to_owned();
    scene.compile(&CompileOptions::default()).map_err(|error| error.to_string())
}

const LINES: &str = "lines = [[\"left-seam\"], [\"right-seam\"]]";
const CONTACT: &str = "contact = { distance = 0.002, response.triangles.friction = 0.1 }\n";

fn momentum(scene: &CompiledScene, state: &State) -> [f64; 3] {
    std::array::from_fn(|k| {
        let of = |(m, v): (&f64, &[f64; 3])| m * v[k];
        scene.model.masses().iter().zip(&state.velocities).map(of).sum()
    })
}

fn bits(state: &State) -> Vec<u64> {
    let numbers = state.positions.iter().chain(&state.velocities).flatten();
    numbers.map(|number| number.to_bits()).collect()
}

#[test]
fn panels_with_unequal_edges_are_sewn_and_welded_on_every_way_of_stepping() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    for (solver, backend) in [("explicit", "cpu"), ("implicit", "cpu"), ("implicit", "reference")] {
        {
            let scene = compile(&folder, &(CONTACT.to_owned() + &text(solver, LINES, ""))).unwrap();
            // Vertices at 0, 1/4 .. 1 meet some at 0, 1/3, 2/3, 1. Near ones are taken for one, the middle needs one.
            let weld = scene.welds.sewn().cloned().unwrap();
            let stitches = scene.model.seams().stitches().len();
            assert_eq!(scene.model.particle_count() - weld.model.particle_count(), stitches);
            assert!(stitches >= 5, "{stitches}");
            let (one, other): (f64, f64) =
                (scene.model.masses().iter().sum(), weld.model.masses().iter().sum());
            assert!((one / other - 1.0).abs() < 1e-12, "welding keeps the mass");
            let backend = backend_create(backend, None).unwrap();
            let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
            let audit = SceneAudit::new(&scene.model);
            let start = simulation.state().unwrap().positions.clone();
            assert!(scene.model.seams().gaps(&start)[0] > 0.1);
            let mut welded = None;
            for frame in 0..20 {
                let before = momentum(&scene, simulation.state().unwrap());
                simulation.step().unwrap();
                let (is_welded, gaps) = simulation.seams().unwrap();
                if is_welded && welded.is_none() {
                    welded = Some(frame);
                    assert!(gaps[0] == 0.0);
                }
                let found = simulation.intersections(&audit).unwrap();
                // In explicit steps what closed stitches have in common is no obstacle.
                if solver != "explicit" || is_welded {
                    assert_eq!((found.within, found.between), (0, 0), "{solver}, frame {frame}");
                }
                let after = momentum(&scene, simulation.state().unwrap());
                let size = scene.model.masses().iter().sum::<f64>();
                let kept = (0..3).all(|k| (after[k] - before[k]).abs() < 1e-6 * size);
                assert!(kept, "{solver}, frame {frame}: {before:?} {after:?}");
            }
            // The seam is closed after nine frames; then the panels come to rest at it, within an eighth of a second.
            assert!(matches!(welded, Some(9..=12)), "{solver}: {welded:?}");
        }
    }
}

#[test]
fn a_weld_keeps_momentum_and_the_centre_of_mass_to_rounding() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    let scene = compile(&folder, &text("implicit", LINES, "")).unwrap();
    let weld = scene.welds.sewn().cloned().unwrap();
    let mut state = scene.model.initial_state();
    for (i, velocity) in state.velocities.iter_mut().enumerate() {
        *velocity = [1, 2, 3].map(|k| ((7 * i + k) as f64).sin());
    }
    let welded = weld.contract(scene.model.masses(), &state);
    let sums = |masses: &[f64], values: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|k| masses.iter().zip(values).map(|(m, v)| m * v[k]).sum())
    };
    for (before, after) in
        [(&state.velocities, &welded.velocities), (&state.positions, &welded.positions)]
    {
        let before = sums(scene.model.masses(), before);
        let after = sums(weld.model.masses(), after);
        for k in 0..3 {
            assert!((before[k] - after[k]).abs() <= 1e-16 * 50.0, "{before:?} {after:?}");
        }
    }
    // What is one already keeps its bits, as a run that is gone on with needs.
    let again = State {
        positions: weld.expand(&welded.positions),
        velocities: weld.expand(&welded.velocities),
        held: weld.expand(&welded.held),
        ..state
    };
    assert!(scene.model.seams().open_in(&again).is_empty());
    assert_eq!(bits(&weld.contract(scene.model.masses(), &again)), bits(&welded));
}

#[test]
fn a_run_goes_on_with_the_same_bits_before_and_after_the_weld() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    let phases = "[[phase]]\nname = \"sew\"\nduration = 0.4\n[[phase]]\nname = \"drape\"\nduration = 0.1\ngravity = [0, 0, -9.81]\n";
    let scene =
        || compile(&folder, &(CONTACT.to_owned() + &text("implicit", LINES, phases))).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut whole = Simulation::new(scene(), backend.as_ref()).unwrap();
    let mut kept = Vec::new();
    for frame in 1..=16 {
        whole.step().unwrap();
        if [4, 9, 11, 14].contains(&frame) {
            let path = folder.path().join(format!("checkpoint-{frame}"));
            whole.checkpoint().unwrap().write(&path).unwrap();
            kept.push(path);
        }
    }
    let wanted = whole.state().unwrap().clone();
    let falling: f64 = wanted.velocities.iter().map(|v| v[2]).sum();
    assert!(falling / (wanted.velocities.len() as f64) < -0.9, "gravity of the second phase");
    for path in kept {
        let scene = scene();
        let checkpoint = Checkpoint::read(&path, &scene.model, scene.config.precision).unwrap();
        let mut resumed = Simulation::resume(scene, backend.as_ref(), &checkpoint).unwrap();
        while resumed.frame() < 16 {
            resumed.step().unwrap();
        }
        assert_eq!(bits(resumed.state().unwrap()), bits(&wanted), "{}", path.display());
    }
}

/// Seams of a file close at their own times: those that one names, and all others together.
#[test]
fn seams_of_a_file_may_close_at_different_times() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    let path = folder.path().join("panels.obj");
    let mesh = std::fs::read_to_string(&path).unwrap();
    let stitches =
        "seam 2\nstitch 20 25\nstitch 21 26\nseam 1\nstitch 22 27\nseam 1\nstitch 24 28\n";
    std::fs::write(path, mesh + stitches).unwrap();
    let two = |first: &str, second: &str| {
        let second = format!("[[seam]]\nname = \"other\"\nclose = [0.3, 0.6]\n{second}\n");
        compile(&folder, &text("implicit", first, &second))
    };
    let scene = two("file = true\nfile_seams = [1]", "file = true").unwrap();
    let stitches = |seam: usize| {
        let range = &scene.model.seams().ranges()[seam];
        let stitches = &scene.model.seams().stitches();
        range.stitches.clone().map(|i| stitches[i as usize]).collect::<Vec<_>>()
    };
    assert_eq!(stitches(0), [[22, 27]]);
    assert_eq!(stitches(1), [[20, 25], [21, 26], [24, 28]]);
    for (first, second, words) in [
        ("file = true\nfile_seams = [3]", "file = true", "there are 3"),
        ("file = true\nfile_seams = [0, 1, 2]", "file = true", "remove one of them"),
        ("stitches = [[20, 25]]\nfile_seams = [0]", "file = true", "give `file = true`"),
    ] {
        let error = two(first, second).unwrap_err();
        assert!(error.contains(words) && error.contains("`seam.toml`, line"), "{first}: {error}");
    }
}

#[test]
fn what_cannot_be_sewn_is_refused_with_its_line_and_mend() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    for (seam, words) in [
        ("stitches = [[3, 99]]", "vertices count from 0"),
        ("stitches = [[3, 3]]", "to itself"),
        ("stitches = []", "by one of `stitches`"),
        ("stitches = [[0, 30]]\nfile = true", "which has none"),
        ("file = true", "has none"),
        ("stitches = [[0, 30]]\ncloth = \"skirt\"", "skirt"),
        ("stitches = [[0, 30]]\nto = \"skirt\"", "skirt"),
        ("stitches = [[0, 30]]\nstiffness = 0", "greater than zero"),
        ("stitches = [[0, 25], [1, 25]]", "finer"),
        ("points = [{ vertex = 3, edge = [0, 24], place = 0.5 }]", "no triangle has"),
        ("points = [{ vertex = 30, edge = [0, 1], place = 1.5 }]", "between 0 and 1"),
        ("lines = [[\"left-seam\"], [\"nothing\"]]", "nothing"),
        ("lines = [[\"left-seam\"], [\"right\"]]", "no way along the border"),
        ("lines = [[\"left-seam\"], [\"right-seam\"]]\ngather = 1.5", "gather = 1.0"),
    ] {
        let error = compile(&folder, &text("implicit", seam, "")).unwrap_err();
        assert!(error.contains(words), "{seam}: {error}");
        assert!(error.contains("`seam.toml`, line"), "{seam}: no line in {error}");
    }
    let springs = text("implicit", "stitches = [[0, 30]]", "").replace("fabric", "springs");
    let springs = springs
        .replace("pattern.imperfection = 0\npattern.from = \"uv\"", "")
        .replace("cotton-broad", "denim");
    let error = compile(&folder, &springs).unwrap_err();
    assert!(error.contains("that needs fabric"), "{error}");
    let time = text("implicit", LINES, "").replace("[0.0, 0.3]", "[0.3, 0.3]");
    let error = compile(&folder, &time).unwrap_err();
    assert!(error.contains("later than the first"), "{error}");
}

/// A strip hangs on a seam that springs hold, and is the load of the seam.
fn load(seam: &str) -> String {
    let scene = r#"
name = "load"
[simulation]
frames = 60
frames_per_second = 30
solver = "implicit"
precision = "f64"
implicit.time_step = 2e-3
[[cloth]]
name = "upper"
material.preset = "cotton-broad"
model = "fabric"
geometry.grid = { columns = 6, rows = 6, spacing = 0.02, origin = [0, 0, 1], row_axis = [0, 0, 1] }
pins = ["top"]
[[cloth]]
name = "lower"
material.preset = "cotton-broad"
model = "fabric"
geometry.grid = { columns = 6, rows = 6, spacing = 0.02, origin = [0, 0, 0.88], row_axis = [0, 0, 1] }
[[field]]
drag.rate = [20, 20, 20]
[[seam]]
name = "waist"
cloth = "upper"
to = "lower"
close = [0.0, 0.3]
stiffness = 20
stitches = [[0, 30], [1, 31], [2, 32], [3, 33], [4, 34], [5, 35]]
"#;
    format!("{scene}{seam}")
}

/// Weight of the strip \[N\].
fn weight(scene: &CompiledScene) -> f64 {
    let lower = scene.model.cloth("lower").unwrap().particles.clone();
    9.81 * lower.map(|i| scene.model.masses()[i as usize]).sum::<f64>()
}

#[test]
fn a_seam_carries_the_load() {
    let folder = TempDir::new().unwrap();
    let scene = load("");
    let scene = compile(&folder, &scene).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
    for _ in 0..60 {
        simulation.step().unwrap();
    }
    let state = simulation.state().unwrap();
    let tension = |&[a, b]: &[u32; 2]| {
        let [a, b] = [a, b].map(|i| state.positions[i as usize]);
        20.0 * ((a[2] - b[2]).hypot((a[0] - b[0]).hypot(a[1] - b[1])) - STITCH_LENGTH)
    };
    let sum: f64 = scene.model.seams().stitches().iter().map(tension).sum();
    let load = weight(&scene);
    assert!((sum / load - 1.0).abs() < 0.01, "{sum} N for {load} N");
}

/// Cloth that could tear and does not is sewn and welded as any other.
#[test]
fn what_can_tear_is_sewn_too() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    let text = CONTACT.to_owned() + &text("implicit", LINES, "");
    let run = |text: &str| {
        let scene = compile(&folder, text).unwrap();
        let audit = SceneAudit::new(&scene.model);
        let backend = backend_create("cpu", None).unwrap();
        let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
        for _ in 0..20 {
            simulation.step().unwrap();
            assert!(simulation.intersections(&audit).unwrap().is_clean());
        }
        let (is_welded, gaps) = simulation.seams().unwrap();
        assert!(is_welded && gaps == [0.0], "{gaps:?}");
        let model = simulation.solver().model();
        (model.triangles().to_vec(), model.masses().to_vec())
    };
    assert_eq!(
        run(&text),
        run(&text.replace("pattern.from", "tear = { strain = 1.0 }\npattern.from"))
    );
}

/// One stitch that cannot be welded keeps none of the others from it, and a run knows which it was.
#[test]
fn stitches_are_welded_without_those_that_are_caught() {
    let folder = TempDir::new().unwrap();
    panels(&folder);
    let scene = compile(&folder, &(CONTACT.to_owned() + &text("implicit", LINES, ""))).unwrap();
    let sewn = scene.welds.sewn().unwrap();
    let part = scene.welds.at(Welding { sews: true, open: &[2], torn: &[] }).unwrap().unwrap();
    assert_eq!(part.model.particle_count(), sewn.model.particle_count() + 1);
    assert_eq!(part.model.seams().stitches().len(), 1);
    let mass = |weld: &cloth::Weld| weld.model.masses().iter().sum::<f64>();
    assert!((mass(sewn) / mass(&part) - 1.0).abs() < 1e-12);
    let [a, b] = scene.model.seams().stitches()[2].map(|i| part.map[i as usize]);
    assert_eq!(part.model.seams().stitches(), [[a.min(b), a.max(b)]]);

    // All panels lie together but for that stitch, which is 2 mm wide.
    let mut state = scene.model.initial_state();
    for (number, stitch) in (0..).zip(scene.model.seams().stitches()) {
        let [a, b] = stitch.map(|i| i as usize);
        state.positions[b] = state.positions[a];
        if number == 2 {
            state.positions[b][2] -= 2e-3;
        }
    }
    assert_eq!(scene.model.seams().open_in(&state), [2]);
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::start_from(scene, backend.as_ref(), &state).unwrap();
    let report = simulation.seam_report().unwrap().unwrap();
    assert!(!report.is_welded && (report.gap - 2e-3).abs() < 1e-9, "{report:?}");
    assert_eq!(report.welded + 1, simulation.model().seams().stitches().len());
    // It is pulled shut, and welded then.
    for _ in 0..20 {
        simulation.step().unwrap();
    }
    let report = simulation.seam_report().unwrap().unwrap();
    assert!(report.is_welded && report.gap == 0.0, "{report:?}");
}

/// Six stitches, 2 cm from each other, bear a sixth of the weight each, those at the ends a little less or more.
#[test]
fn stitches_break_where_a_seam_bears_no_more() {
    let folder = TempDir::new().unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let share = weight(&compile(&folder, &load("")).unwrap()) / 6.0 / 0.02;
    let broken = |simulation: &mut Simulation| {
        simulation.seam_report().unwrap().map_or(6, |seams| seams.broken)
    };
    let height = |simulation: &mut Simulation| simulation.state().unwrap().positions[36][2];
    for (strength, breaks) in [(2.0 * share, false), (0.4 * share, true)] {
        let scene = compile(&folder, &load(&format!("strength = {strength}\n"))).unwrap();
        let mut simulation = Simulation::new(scene.clone(), backend.as_ref()).unwrap();
        let mut checkpoint = None;
        for frame in 1..=30 {
            simulation.step().unwrap();
            // Before the seam is closed nothing breaks.
            assert!(frame > 9 || broken(&mut simulation) == 0, "{frame}");
            if frame == 20 {
                checkpoint = Some(simulation.checkpoint().unwrap());
            }
        }
        assert_eq!(broken(&mut simulation), if breaks { 6 } else { 0 });
        // What hangs stays 12 cm below the upper strip, what is torn off falls.
        let found = height(&mut simulation);
        assert_eq!(found < 0.7, breaks, "{strength} N/m: {found} m");
        // A checkpoint knows what is broken.
        let path = folder.path().join("state");
        checkpoint.unwrap().write(&path).unwrap();
        let model = &scene.model;
        let read = Checkpoint::read(&path, model, scene.config.precision).unwrap();
        assert_eq!(read.broken.len(), if breaks { 6 } else { 0 });
        let mut resumed = Simulation::resume(scene, backend.as_ref(), &read).unwrap();
        while resumed.frame() < 30 {
            resumed.step().unwrap();
        }
        assert_eq!(resumed.state().unwrap(), simulation.state().unwrap());
    }
    let error = compile(&folder, &load("strength = 0\n")).unwrap_err();
    assert!(error.contains("strength"), "{error}");
    panels(&folder);
    let welded = text("implicit", LINES, "strength = 5\n");
    let error = compile(&folder, &welded).unwrap_err();
    assert!(error.contains("seams that are held"), "{error}");
}
