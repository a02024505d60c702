//! A run that is stopped and continued is the same run.

use cloth::{
    Error, Simulation, State,
    scene::{CompileOptions, CompiledScene, Scene, SceneGeometry, SceneSolver, builtin_scenes},
};
use harness::{
    backends::{Candidate, candidates},
    scenes,
};

/// Particles along a side of a patch at most: several blocks of every backend, and no more than it takes.
const SIDE: u32 = 24;
/// The same where a frame takes hundreds of substeps of fabric or of triangles that touch, and for plain loops, which compare all triangles with all others.
const SIDE_OF_SLOW: u32 = 10;
/// The scenes of fabric, and those of contact of triangles.
pub(crate) const SLOW: [&str; 8] =
    ["tablecloth", "napkins", "stack", "table", "layers", "drape", "flag", "curtain"];

/// Frames \[1/s\] where all scenes run: a short one has all stages of a long one in fewer substeps.
pub(crate) const FRAMES_PER_SECOND: f64 = 240.0;

fn compiled(mut scene: Scene, solver: SceneSolver) -> CompiledScene {
    scene.simulation.solver = Some(solver);
    scene.compile(&CompileOptions::default()).unwrap()
}

fn bits(state: &State) -> Vec<u64> {
    let numbers = state.positions.iter().chain(&state.velocities).flatten();
    let poses =
        state.colliders.iter().flat_map(|pose| pose.translation.iter().chain(&pose.rotation));
    let slips = state.slips.iter().flat_map(|slip| &slip.slip);
    numbers.chain(poses).chain(slips).map(|number| number.to_bits()).collect()
}

/// Runs `frames` frames, and again from every frame on. Scenes that a backend says it cannot run are passed over.
fn stops_at_every_frame(candidate: &Candidate, scene: &CompiledScene, frames: usize, what: &str) {
    let _turn = candidate.turn();
    let scene = &mut scene.clone();
    scene.config.precision = candidate.precision;
    let mut whole = match Simulation::new(scene.clone(), candidate.backend.as_ref()) {
        Ok(simulation) => simulation,
        Err(Error::Unsupported { feature, .. }) => {
            let known = [
                "triangles of fabric with the semi-implicit",
                "contact of triangles with the midpoint",
            ];
            let is_known = known.iter().any(|known| feature.contains(known));
            assert!(candidate.label.starts_with("wgpu") || is_known, "{what}: {feature}");
            return;
        }
        Err(error) => panic!("{what}: {error}"),
    };
    let mut stops = vec![whole.checkpoint().unwrap()];
    let mut wanted = vec![bits(whole.state().unwrap())];
    for frame in 1..=frames {
        whole.step().unwrap_or_else(|error| panic!("{what}, frame {frame}: {error}"));
        wanted.push(bits(whole.state().unwrap()));
        stops.push(whole.checkpoint().unwrap());
    }
    assert_ne!(wanted[0], wanted[frames], "{what}: nothing happens");
    for (stop, checkpoint) in stops.iter().enumerate().take(frames) {
        let backend = candidate.backend.as_ref();
        let mut resumed = Simulation::resume(scene.clone(), backend, checkpoint).unwrap();
        for (frame, wanted) in wanted.iter().enumerate().skip(stop + 1) {
            resumed.step().unwrap();
            // Not assert_eq, which would print all the numbers.
            assert!(
                bits(resumed.state().unwrap()) == *wanted,
                "{what}: stopped at {stop}, frame {frame} differs"
            );
        }
    }
}

#[test]
fn every_scene_resumes_with_the_same_bits() {
    let is_plain = |candidate: &&Candidate| candidate.label.starts_with("reference");
    let (plain, others): (Vec<_>, Vec<_>) = candidates().iter().partition(is_plain);
    for entry in builtin_scenes() {
        for &solver in SceneSolver::ALL {
            // What takes long to compile is compiled once for all backends.
            let side = if SLOW.contains(&entry.name) { SIDE_OF_SLOW } else { SIDE };
            // Plain loops take minutes for all pairs with the triangles of tables, stands and of four cloths; `layers` has the same stages.
            // And the others of fabric have no stage that these do not have in explicit steps, of which a frame has hundreds.
            let is_like_others = matches!(entry.name, "drape" | "flag" | "curtain" | "table");
            let has_bodies = matches!(entry.name, "tablecloth" | "napkins" | "stack");
            if is_like_others && solver != SceneSolver::Implicit {
                continue;
            }
            let plain = if has_bodies || is_like_others { &vec![] } else { &plain };
            for (candidates, side) in [(&others, side), (plain, SIDE_OF_SLOW)] {
                let mut scene = scenes::small(entry.name, side).unwrap();
                scene.simulation.frames_per_second = FRAMES_PER_SECOND;
                let scene = compiled(scene, solver);
                for candidate in candidates {
                    let what = format!("{} {} {}", entry.name, solver.name(), candidate.label);
                    stops_at_every_frame(candidate, &scene, 2, &what);
                }
            }
        }
    }
}

/// Stopped at frame 5, it differed from frame 13 on by 12 cm.
#[test]
fn rigid_bodies_that_collide_after_a_resume_fly_on_with_the_same_bits() {
    for candidate in candidates().iter().filter(|candidate| candidate.label.starts_with("cpu")) {
        let mut pair = Scene::builtin("rigid-pair").unwrap();
        for cloth in &mut pair.cloths {
            if let SceneGeometry::Grid(grid) = &mut cloth.geometry {
                (grid.columns, grid.rows) = (14, 10);
            }
        }
        let scene = compiled(pair, SceneSolver::Explicit);
        stops_at_every_frame(candidate, &scene, 24, &candidate.label);
    }
}
