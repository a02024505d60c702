//! Every scene that comes with the engine runs on the reference backend, and on the CPU to the same end.

use cloth::{
    Integrator, Precision, Simulation,
    scene::{CompileOptions, Scene, builtin_scenes},
};
use harness::{
    backends::{cpu, reference},
    scenes,
};

use crate::resume::{FRAMES_PER_SECOND, SLOW};

/// How far the two may be apart \[m\] after a frame.
const DISTANCE_MAX: f64 = 1e-6;

/// Particles along a side of a patch at most: plain loops take minutes for the largest scenes, and compare no other numbers there.
const SIDE: u32 = 24;
/// The same for scenes whose substeps look at all pairs of triangles.
const SIDE_OF_TRIANGLES: u32 = 10;

#[test]
fn a_frame_of_every_scene() {
    let cpu = cpu(2);
    for builtin in builtin_scenes() {
        let side = if SLOW.contains(&builtin.name) { SIDE_OF_TRIANGLES } else { SIDE };
        let [found, expected] = [&*reference().backend, &cpu].map(|backend| {
            let mut scene = scenes::small(builtin.name, side).unwrap();
            scene.simulation.frames_per_second = FRAMES_PER_SECOND;
            let mut compiled = scene.compile(&CompileOptions::default()).unwrap();
            compiled.config.precision = Precision::F64;
            // By default systems are solved to a share where triangles touch, and both differ by what is left.
            if let Integrator::Implicit(settings) = &mut compiled.config.integrator {
                settings.linear.tolerance = 1e-9;
            }
            let start = compiled.model.initial_state();
            let mut simulation = Simulation::new(compiled, backend).unwrap();
            simulation.step().unwrap();
            let state = simulation.state().unwrap().clone();
            assert_ne!(state.positions, start.positions, "{}: nothing moves", builtin.name);
            state
        });
        let both = found.positions.iter().flatten().zip(expected.positions.iter().flatten());
        let distance = both.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        assert!(distance <= DISTANCE_MAX, "{}: {distance:e} m", builtin.name);
    }
}

#[test]
fn single_precision_is_refused_by_name() {
    let compiled = Scene::builtin("drape").unwrap().compile(&CompileOptions::default()).unwrap();
    assert_eq!(compiled.config.precision, Precision::F32);
    let error = Simulation::new(compiled, &*reference().backend).err().unwrap().to_string();
    let expected = "the reference backend does not support precision f32 (it has f64)";
    assert!(error.starts_with(expected), "{error}");
}
