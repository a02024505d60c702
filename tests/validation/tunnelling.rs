//! Nothing passes a collider unseen, however long the step.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, Frame, GridPatch, Integrator, Model,
    ModelBuilder, Pose, SemiImplicitSettings, Solver, State, TriangleMesh,
};
use cloth_rigid::distance_grid;
use harness::{
    backends::{Candidate, candidates},
    feature::Feature,
    models::{grid_cloth, material},
};

use crate::rig::{THICKNESS, build, download, implicit, particles, solver_of};

/// Steps of the integrators unless a scene says otherwise \[s\].
const STEP: f64 = 1e-3;
const LARGE_STEP: f64 = 1.0 / 60.0;

/// Every integrator with its usual step.
fn integrators(candidate: &Candidate) -> Vec<(Integrator, f64)> {
    let mut all = vec![(Integrator::Explicit, STEP)];
    if candidate.offers(Feature::Implicit) {
        all.push((implicit(candidate, 1e-3), LARGE_STEP));
        all.push((Integrator::SemiImplicit(SemiImplicitSettings::default()), LARGE_STEP));
    }
    all
}

fn collider(shape: ColliderShape, translation: [f64; 3]) -> Collider {
    Collider {
        name: "solid".into(),
        shape,
        pose: Pose::from_translation(translation),
        friction: 0.2,
        restitution: 0.0,
    }
}

fn solver(
    candidate: &Candidate,
    model: &Arc<Model>,
    (integrator, time_step): &(Integrator, f64),
) -> Box<dyn Solver> {
    solver_of(candidate, model, *time_step, integrator.clone())
}

fn frame(solver: &mut dyn Solver, pose: Option<Pose>) -> State {
    let colliders = pose.map(|pose| ColliderControl { collider: 0, pose }).into_iter().collect();
    solver.set_control(&Control { colliders, ..Control::default() }).unwrap();
    solver.advance(Frame { duration: LARGE_STEP }).unwrap();
    solver.synchronize().unwrap();
    download(solver)
}

/// The surface of a box.
fn block(half_extents: [f64; 3]) -> TriangleMesh {
    let corner = |n: usize| {
        std::array::from_fn(|k| if n >> k & 1 == 1 { half_extents[k] } else { -half_extents[k] })
    };
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh { positions: (0..8).map(corner).collect(), triangles, ..TriangleMesh::default() }
}

/// A wall of 1 cm, as a box and as samples of its distance, in the way of cloth at 2 m/s, and of fast particles that
/// are not even cloth.
#[test]
fn cloth_does_not_pass_a_thin_wall() {
    let half_extents = [0.15, 0.15, 0.005];
    let grid = distance_grid("wall", &block(half_extents), 120, 0.01).unwrap();
    for shape in [ColliderShape::Box { half_extents }, ColliderShape::Grid(Arc::new(grid))] {
        let wall = || collider(shape.clone(), [0.0; 3]);
        let patch = GridPatch::horizontal(12, 0.02, 0.05);
        let mut cloth = grid_cloth("patch", patch, material(1e-4, 20.0, THICKNESS));
        cloth.velocity = [0.0, 0.0, -2.0];
        let sheet = build(ModelBuilder::new().cloth(cloth).collider(wall()));
        let shots = [[0.0, 0.0, 0.4], [0.1, 0.0, 0.5], [0.07, 0.1, 0.45]];
        let shots = particles(&shots, [0.0, 0.0, -20.0]);
        let shots = build(ModelBuilder::new().cloth(shots).collider(wall()));
        for candidate in candidates() {
            for settings in integrators(candidate) {
                for model in [&sheet, &shots] {
                    let _turn = candidate.turn();
                    let mut solver = solver(candidate, model, &settings);
                    for number in 1..=6 {
                        let state = frame(&mut *solver, None);
                        let lowest =
                            state.positions.iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
                        assert!(
                            lowest > 0.005 + 0.5 * THICKNESS - 1e-3,
                            "{} {:?}, frame {number}: a particle is at {lowest} m, {} {:?}",
                            candidate.label,
                            settings.0,
                            matches!(shape, ColliderShape::Grid(_)),
                            state.positions
                        );
                    }
                    let state = download(&mut *solver);
                    let below = |x: &[f64; 3]| x[2] < 0.03;
                    assert!(state.positions.iter().all(below), "it has not got there");
                }
            }
        }
    }
}

/// A ball of 5 cm pushes a sheet that is held around: what it meets stays in front of it.
#[test]
fn a_moving_ball_does_not_pass_a_pinned_sheet() {
    let (radius, side) = (0.05, 17_u32);
    let patch = GridPatch::horizontal(side, 0.02, 0.0);
    let mut cloth = grid_cloth("sheet", patch, material(2e-4, 50.0, THICKNESS));
    cloth.pins = (0..side * side)
        .filter(|i| [i % side, i / side].iter().any(|place| [0, side - 1].contains(place)))
        .collect();
    let middle = (side * side / 2) as usize;
    for speed in [0.5, 5.0] {
        let start = -radius - 0.5 * THICKNESS - 1e-3;
        let ball = collider(ColliderShape::Sphere { radius }, [0.0, 0.0, start]);
        let model =
            build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth.clone()).collider(ball));
        for candidate in candidates() {
            for settings in integrators(candidate) {
                let _turn = candidate.turn();
                let mut solver = solver(candidate, &model, &settings);
                let mut z = start;
                while z < 0.03 {
                    z += speed * LARGE_STEP;
                    let state = frame(&mut *solver, Some(Pose::from_translation([0.0, 0.0, z])));
                    let height = state.positions[middle][2] - z;
                    assert!(
                        height > radius,
                        "{} {:?} at {speed} m/s: the middle is {height} m above the middle of the ball",
                        candidate.label,
                        settings.0
                    );
                }
            }
        }
    }
}

/// A thin blade that turns takes a particle along that rests in its way.
#[test]
fn a_turning_blade_does_not_pass_a_particle() {
    let rate: f64 = 12.0;
    let shape = ColliderShape::Box { half_extents: [0.4, 0.003, 0.1] };
    let cloth = particles(&[[0.3, 0.1, 0.0]], [0.0; 3]);
    let blade = collider(shape, [0.0; 3]);
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth).collider(blade));
    for candidate in candidates() {
        for settings in integrators(candidate) {
            let _turn = candidate.turn();
            let mut solver = solver(candidate, &model, &settings);
            let mut angle: f64 = 0.0;
            for number in 1..=4 {
                angle += rate * LARGE_STEP;
                let half = 0.5 * angle;
                let rotation = [0.0, 0.0, half.sin(), half.cos()];
                let pose = Pose { translation: [0.0; 3], rotation };
                let state = frame(&mut *solver, Some(pose));
                let [x, y, _] = state.positions[0];
                // Across the blade, on the side that it turns to.
                let across = y * angle.cos() - x * angle.sin();
                assert!(
                    across > 0.003,
                    "{} {:?}, frame {number}: {across} m",
                    candidate.label,
                    settings.0
                );
            }
            let speed = download(&mut *solver).velocities[0];
            assert!(speed[1].hypot(speed[0]) > 1.0, "the blade has not met it: {speed:?}");
        }
    }
}

/// A path that comes near a solid and does not go through is left alone, bit for bit.
#[test]
fn a_particle_that_flies_past_is_not_touched() {
    let reach = 0.1 + 0.5 * THICKNESS;
    for shape in [
        ColliderShape::Sphere { radius: 0.1 },
        ColliderShape::Capsule { half_length: 0.05, radius: 0.05 },
        ColliderShape::Box { half_extents: [0.1, 0.3, 0.1] },
    ] {
        let cloth = particles(&[[-0.5, 0.0, reach + 1e-4]], [30.0, 0.0, 0.0]);
        let free = ModelBuilder::new().gravity([0.0; 3]).cloth(cloth);
        let near = build(free.clone().collider(collider(shape, [0.0; 3])));
        let free = build(free);
        for candidate in candidates() {
            // The constraints of the implicit step look ahead along the surface at the start.
            let is_plain =
                |settings: &(Integrator, f64)| !matches!(settings.0, Integrator::Implicit(_));
            for settings in integrators(candidate).into_iter().filter(is_plain) {
                let _turn = candidate.turn();
                let ends = [&free, &near].map(|model| {
                    let mut solver = solver(candidate, model, &settings);
                    let states: Vec<_> = (0..3).map(|_| frame(&mut *solver, None)).collect();
                    states.iter().map(|state| state.positions[0]).collect::<Vec<_>>()
                });
                assert_eq!(ends[0], ends[1], "{} {:?}", candidate.label, settings.0);
            }
        }
    }
}
