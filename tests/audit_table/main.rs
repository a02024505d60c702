//! The table of audits: triangles that intersect in every frame of scenes that drive cloth through cloth, by integrator and backend.
//! `CLOTH_TEST_FULL` runs all of it, from ten starts each.

mod scenes;

use std::{fmt, sync::Arc};

use cloth::SceneAudit;
use cloth_core::{
    ContactResponse, Error, Frame, ImplicitSettings, Integrator, Precision, SelfContact,
    SemiImplicitSettings, SolverConfig, State,
};
use harness::backends::{Candidate, candidates};
use scenes::{DISTANCE, SCENES, Scene};

/// Contact between points, which lets triangles pass: the negative control of the table.
const POINTS: ContactResponse = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };

/// How cloth is advanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Explicit,
    Implicit,
    SemiImplicit,
}

impl Way {
    const ALL: [Self; 3] = [Self::Explicit, Self::Implicit, Self::SemiImplicit];

    fn integrator(self) -> Integrator {
        match self {
            Self::Explicit => Integrator::Explicit,
            Self::Implicit => Integrator::Implicit(ImplicitSettings::default()),
            Self::SemiImplicit => Integrator::SemiImplicit(SemiImplicitSettings::default()),
        }
    }
}

/// What the audit found in the frames of a scene.
struct Row {
    scene: &'static str,
    way: Way,
    backend: String,
    /// Frames with any, of all.
    frames: [u32; 2],
    /// Most pairs in a frame.
    pairs_max: u64,
    /// Where the first was.
    first: String,
    /// Why it came to no end.
    error: Option<Error>,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scene, way, backend, frames: [bad, all], pairs_max, first, error } = self;
        write!(
            f,
            "| {scene:<25} | {:<12} | {backend:<10} | {bad:>3} of {all:<3} | {pairs_max:>6} | {first}",
            format!("{way:?}")
        )?;
        match error {
            Some(error) => write!(f, " ended: {error} |"),
            None => write!(f, " |"),
        }
    }
}

/// Runs a scene from the start of a seed and looks at every frame.
fn audited(
    scene: &Scene,
    response: ContactResponse,
    way: Way,
    candidate: &Candidate,
    seed: u64,
) -> Row {
    let _turn = candidate.turn();
    let model = scene.model(SelfContact { distance: DISTANCE, response }, seed);
    let audit = SceneAudit::new(&model);
    let integrator = way.integrator();
    let stable = model.stable_time_step_of(&integrator).unwrap_or(1.0);
    let time_step = (0.9 * stable).min(1.0 / 240.0);
    let precision = candidate.precision;
    let config = SolverConfig { precision, time_step, integrator, ..SolverConfig::default() };
    let mut row = Row {
        scene: scene.name,
        way,
        backend: candidate.label.clone(),
        frames: [0, 0],
        pairs_max: 0,
        first: String::new(),
        error: None,
    };
    let mut run = || -> Result<(), Error> {
        let mut solver = candidate.backend.create_solver(Arc::clone(&model), &config)?;
        let mut state = State::default();
        solver.download(&mut state)?;
        let start = audit.at(&state.positions, &state.colliders, 0.0);
        assert!(start.is_clean(), "{} intersects at the start: {start:?}", scene.name);
        for frame in 1..=scene.frames {
            let time = f64::from(frame) / scene.rate;
            solver.set_control(&scene.control(&model, time))?;
            solver.advance(Frame::per_second(scene.rate))?;
            solver.synchronize()?;
            solver.download(&mut state)?;
            let found = audit.at(&state.positions, &state.colliders, time);
            row.frames[1] += 1;
            row.frames[0] += u32::from(!found.is_clean());
            row.pairs_max = row.pairs_max.max(found.pairs());
            if let Some(pair) = found.first.filter(|_| row.first.is_empty()) {
                row.first = format!("frame {frame}: {}", audit.describe(&pair));
                if response == POINTS && !is_full() {
                    break; // It has been seen to let triangles pass.
                }
            }
        }
        Ok(())
    };
    row.error = run().err();
    println!("{row}");
    row
}

fn is_full() -> bool {
    std::env::var_os("CLOTH_TEST_FULL").is_some()
}

/// Single precision on the processor, or everything.
fn chosen() -> impl Iterator<Item = &'static Candidate> {
    let is_first = |candidate: &Candidate| candidate.label == "cpu f32";
    let chosen = candidates().iter().filter(move |candidate| is_full() || is_first(candidate));
    chosen.filter(|candidate| candidate.precision == Precision::F32 || is_full())
}

/// One row for each scene, integrator, backend and start.
fn table(response: ContactResponse) -> Vec<Row> {
    println!("{response:?}, distance {DISTANCE} m");
    println!(
        "| scene | integrator | backend | frames | pairs | first |\n|---|---|---|---|---|---|"
    );
    let seeds = if is_full() { 0..10 } else { 0..1 };
    let mut rows = vec![];
    for candidate in chosen() {
        for scene in &SCENES {
            for way in Way::ALL {
                // Small steps take their time, and the large ones of the semi-implicit integrator are those of the implicit one.
                let is_short = way == Way::Implicit || scene.rate > 100.0;
                if !is_full() && (way == Way::SemiImplicit || !is_short) {
                    continue;
                }
                let starts = seeds.clone();
                rows.extend(starts.map(|seed| audited(scene, response, way, candidate, seed)));
            }
        }
    }
    rows
}

/// Contact of points lets cloth through, in every scene, and the audit sees it: the scenes are hard enough for the zeros of others to
/// mean something.
#[test]
fn points_let_triangles_pass() {
    let rows = table(POINTS);
    for scene in &SCENES {
        let of_scene = rows.iter().filter(|row| row.scene == scene.name);
        let pairs = of_scene.map(|row| row.pairs_max).max();
        assert!(pairs > Some(0), "{}: nothing passed through", scene.name);
    }
}

/// Contact of triangles lets nothing through.
#[test]
fn triangles_let_nothing_pass() {
    let rows = table(ContactResponse::Triangles { friction: 0.3 });
    for row in &rows {
        assert!(row.error.is_none() && row.frames[0] == 0, "{row}");
    }
}
