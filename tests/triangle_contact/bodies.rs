//! Cloth on the faces of bodies: CUDA has the bits of the CPU, wgpu comes close, and nothing goes through on either.

use std::sync::Arc;

use cloth::SceneAudit;
use cloth_core::{
    BodySurface, Collider, ColliderControl, ColliderImpulse, ColliderShape, Control, Frame,
    Integrator, Model, ModelBuilder, Pose, SolverConfig, State,
};
use harness::{backends::Candidate, bits::first_difference};

use crate::{
    bits::pairs,
    rig::{contact, integrators, others, processor, sheet},
};

const SPACING: f64 = 0.0153;
const FRAMES: u32 = 6;

/// A sheet that falls onto a box, which turns and rises, onto a leaf without an inside, and onto the floor; a second sheet on the first.
fn model() -> Arc<Model> {
    let corners =
        vec![[-0.05, -0.05, -0.004], [0.05, -0.05, 0.0], [0.05, 0.05, 0.004], [-0.05, 0.05, 0.0]];
    let leaf = BodySurface::rigid(corners, vec![[0, 1, 2], [0, 2, 3]]);
    let body = |name: &str, shape: ColliderShape, translation: [f64; 3]| Collider {
        name: name.into(),
        shape,
        pose: Pose::from_translation(translation),
        friction: 0.3,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new()
        .self_contact(contact(2e-3, 0.3))
        .cloth(sheet("below", 11, SPACING, [0.003, 0.002, 0.0135], 0.0))
        .cloth(sheet("above", 8, SPACING, [0.0, 0.001, 0.0165], 0.4))
        .collider(body("box", ColliderShape::Box { half_extents: [0.032, 0.03, 0.01] }, [0.0; 3]))
        .collider(body("leaf", ColliderShape::Surface(Arc::new(leaf)), [0.11, 0.0, 0.004]))
        .collider(body("floor", ColliderShape::Plane, [0.0, 0.0, -0.015]))
        .collider_impulses(true);
    Arc::new(builder.build().expect("it is valid"))
}

fn pose(frame: u32) -> Pose {
    let turn = 0.02 * f64::from(frame);
    Pose {
        translation: [0.0, 0.0, 4e-4 * f64::from(frame)],
        rotation: [0.0, 0.0, turn.sin(), turn.cos()],
    }
}

struct Outcome {
    state: State,
    impulses: Vec<ColliderImpulse>,
    counts: [u64; 3],
    intersecting: u64,
}

fn run(
    candidate: &Candidate,
    model: &Arc<Model>,
    (integrator, time_step): (Integrator, f64),
) -> Outcome {
    let precision = candidate.precision;
    let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
    let solver = candidate.backend.create_solver(Arc::clone(model), &config);
    let mut solver = solver.expect("it has contact with bodies");
    let audit = SceneAudit::new(model);
    let mut outcome =
        Outcome { state: State::default(), impulses: vec![], counts: [0; 3], intersecting: 0 };
    for frame in 1..=FRAMES {
        let colliders = vec![ColliderControl { collider: 0, pose: pose(frame) }];
        solver.set_control(&Control { colliders, ..Control::default() }).expect("it can turn");
        solver.advance(Frame::per_second(60.0)).expect("frames can be computed");
        let report = solver.synchronize().expect("frames can be computed");
        let found = [report.contacts, report.contact_truncated, report.contact_exempt];
        for (sum, found) in outcome.counts.iter_mut().zip(found) {
            *sum += found;
        }
        let mut impulses = vec![];
        solver.collider_impulses(&mut impulses).expect("they can be read");
        outcome.impulses.extend(impulses);
        solver.download(&mut outcome.state).expect("the state can be read");
        let state = &outcome.state;
        let found = audit.at(&state.positions, &state.colliders, f64::from(frame) / 60.0);
        outcome.intersecting = outcome.intersecting.max(found.pairs());
    }
    outcome
}

#[test]
fn cuda_has_the_bits_of_the_cpu_on_bodies() {
    let model = model();
    for [cuda, cpu] in pairs() {
        let is_exact = |way: &&(Integrator, f64)| !matches!(way.0, Integrator::SemiImplicit(_));
        for way in integrators(&model).iter().filter(is_exact) {
            let what = format!("{} {:?}", cuda.label, way.0);
            let [expected, found] = [cpu, cuda].map(|one| run(one, &model, way.clone()));
            assert_eq!(first_difference(&expected.state, &found.state), None, "{what}");
            assert_eq!(expected.state.slips, found.state.slips, "{what}");
            assert_eq!(expected.counts, found.counts, "{what}");
            impulses_agree(&expected.impulses, &found.impulses, &what);
            assert_eq!(found.intersecting, 0, "{what}");
            assert!(found.counts[0] > 0, "{what}: they have not met");
        }
    }
}

/// Those of contacts are summed on the host, with the same bits; what is stopped at the floor beside them, in trees.
fn impulses_agree(expected: &[ColliderImpulse], found: &[ColliderImpulse], what: &str) {
    assert_eq!(expected.len(), found.len(), "{what}");
    for (number, (a, b)) in expected.iter().zip(found).enumerate() {
        if number % 3 < 2 {
            assert_eq!(a, b, "{what}");
        }
        for (a, b) in [(a.linear, b.linear), (a.angular, b.angular)] {
            let apart = a.iter().zip(b).fold(0.0, |apart: f64, (a, b)| apart.max((a - b).abs()));
            assert!(apart < 1e-12, "{what}: {a:?} {b:?}");
        }
    }
}

#[test]
fn nothing_goes_through_bodies() {
    let model = model();
    for candidate in others() {
        let _turn = candidate.turn();
        for way in integrators(&model) {
            let what = format!("{} {:?}", candidate.label, way.0);
            let [expected, found] =
                [processor(), candidate].map(|one| run(one, &model, way.clone()));
            assert_eq!((found.intersecting, found.counts[2]), (0, 0), "{what}");
            assert!(found.counts[0] > 0, "{what}: they have not met");
            // In implicit steps the last bits decide who is stopped, and how far a linear system is solved in its last iteration.
            let is_implicit = matches!(way.0, Integrator::Implicit(_));
            let (most, share) = if is_implicit { (3e-3, 0.2) } else { (4e-4, 0.1) };
            for cloth in model.cloths() {
                let centre = |outcome: &Outcome| -> [f64; 3] {
                    let range = cloth.particles.start as usize..cloth.particles.end as usize;
                    let (all, count) = (&outcome.state.positions[range.clone()], range.len());
                    std::array::from_fn(|k| all.iter().map(|x| x[k]).sum::<f64>() / count as f64)
                };
                let [a, b] = [&expected, &found].map(centre);
                let apart = a.iter().zip(b).fold(0.0_f64, |apart, (a, b)| apart.max((a - b).abs()));
                println!("{what}: {apart:e} m apart, {:?}", found.counts);
                assert!(apart < most, "{what}: {apart} m");
            }
            let pushed = |outcome: &Outcome| -> f64 {
                outcome.impulses.chunks(3).map(|all| all[0].linear[2]).sum()
            };
            let [a, b] = [&expected, &found].map(pushed);
            assert!(a > 0.0 && (a - b).abs() < share * a, "{what}: {a} {b} kg m/s");
        }
    }
}
