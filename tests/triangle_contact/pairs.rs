//! Lists of pairs against all pairs there are, in models large enough for every level of the search.

use std::{collections::BTreeSet, sync::Arc};

use cloth::SceneAudit;
use cloth_core::{
    Cloth, Collider, ColliderShape, ImplicitSettings, Integrator, Kernels, Model, ModelBuilder,
    Pose, Precision, SolverConfig, SolverReport, State,
    contact::{Candidate, ContactSurface},
    stepper::{FramePlan, FrameSpan, Substep},
};
use harness::{backends::Candidate as Backend, random::Random};

use crate::rig::{contact, others, processor, sheet};

const SPACING: f64 = 0.01;
const DISTANCE: f64 = 2e-3;

/// `layers` sheets of `side` x `side` particles above each other, or, `scattered`, turned and moved anywhere near.
fn model(layers: u32, side: u32, scattered: bool) -> Arc<Model> {
    let mut random = Random::new(u64::from(layers * side));
    let mut builder = ModelBuilder::new().self_contact(contact(DISTANCE, 0.3));
    for layer in 0..layers {
        let height = 0.9 * DISTANCE * f64::from(layer);
        let (centre, angle) = if scattered {
            let [x, y, z] = random.vector(0.5 * SPACING * f64::from(side));
            ([x, y, 0.2 * z], 3.0 * random.vector(1.0)[0])
        } else {
            ([1e-3 * f64::from(layer), 0.0, height], 0.0)
        };
        builder = builder.cloth(sheet(&format!("{layer}"), side, SPACING, centre, angle));
    }
    Arc::new(builder.build().expect("it is valid"))
}

fn kernels(candidate: &Backend, model: &Arc<Model>, integrator: &Integrator) -> Box<dyn Kernels> {
    let (precision, integrator) = (Precision::F32, integrator.clone());
    let config = SolverConfig { integrator, precision, ..SolverConfig::default() };
    let kernels = candidate.backend.create_kernels(Arc::clone(model), &config);
    kernels.expect("it has contact of triangles")
}

/// The list for particles at rest at `positions`.
fn list(kernels: &mut dyn Kernels, positions: &[[f64; 3]]) -> BTreeSet<Candidate> {
    let mut state = kernels.model().initial_state();
    state.positions.copy_from_slice(positions);
    let mut found = vec![];
    let mut all = || -> cloth_core::Result<()> {
        kernels.state_write(&state)?;
        kernels.contact_pairs(&Substep { length: 1e-3, step: 1, ..Substep::default() })?;
        kernels.contact_list_read(&mut found)
    };
    all().expect("the stages can be done");
    let set: BTreeSet<_> = found.iter().copied().collect();
    assert_eq!(set.len(), found.len(), "a pair is there twice");
    set
}

/// All pairs of features that are closer than the list reaches along each axis.
fn brute_force(model: &Model, positions: &[[f64; 3]]) -> BTreeSet<Candidate> {
    let surface = ContactSurface::new(model, model.self_contact().expect("it has contact"));
    let reach = (2.0 * DISTANCE) as f32;
    let x: Vec<_> = positions.iter().map(|x| x.map(|x| x as f32)).collect();
    let range = |of: &[u32], axis: usize| {
        let numbers = of.iter().map(|&i| x[i as usize][axis]);
        numbers.fold([f32::MAX, f32::MIN], |[low, high], x| [low.min(x), high.max(x)])
    };
    let is_near = |candidate: &Candidate| {
        let particles = surface.particles(*candidate);
        let (first, second) = particles.split_at(match candidate {
            Candidate::VertexTriangle(_) => 1,
            Candidate::EdgeEdge(_) => 2,
        });
        (0..3).all(|axis| {
            let [a, b] = [range(first, axis), range(second, axis)];
            a[0] - b[1] < reach && b[0] - a[1] < reach
        })
    };
    surface.candidates().filter(is_near).collect()
}

#[test]
fn pair_sets_are_those_of_brute_force() {
    // From one group of triangles to 1024, full and not.
    let sizes = [
        (1, 3, false),
        (4, 6, false),
        (3, 29, false),
        (10, 16, true),
        (9, 17, false),
        (10, 21, true),
    ];
    for (layers, side, scattered) in sizes {
        let model = model(layers, side, scattered);
        let groups = model.triangles().len().div_ceil(8);
        let mut random = Random::new(7);
        let shaken = |random: &mut Random, size: f64, by: [f64; 3]| -> Vec<[f64; 3]> {
            let moved = model.positions().iter().map(|x| {
                let own = random.vector(size);
                std::array::from_fn(|k| f64::from((x[k] + by[k] + own[k]) as f32))
            });
            moved.collect()
        };
        // One after the other by the same kernels: what is left of a list must not be seen in the next one.
        let states = [
            shaken(&mut random, 0.0, [0.0; 3]),
            shaken(&mut random, DISTANCE, [0.0; 3]),
            shaken(&mut random, DISTANCE, [1.0, -2.0, 0.5]),
        ];
        let expected = states.each_ref().map(|positions| brute_force(&model, positions));
        for candidate in std::iter::once(processor()).chain(others()) {
            let _turn = candidate.turn();
            let mut kernels = kernels(candidate, &model, &Integrator::Explicit);
            for (number, (positions, expected)) in states.iter().zip(&expected).enumerate() {
                let found = list(&mut *kernels, positions);
                let what = format!("{} {layers} x {side}, list {number}", candidate.label);
                let lacks: Vec<_> = expected.difference(&found).collect();
                let surplus: Vec<_> = found.difference(expected).collect();
                println!("{what}: {} pairs of {groups} groups", expected.len());
                assert!(lacks.is_empty(), "{what}: {} missing, {:?}", lacks.len(), lacks[0]);
                assert!(surplus.is_empty(), "{what}: {} surplus, {:?}", surplus.len(), surplus[0]);
                // A pair that is missing would be seen.
                let less: BTreeSet<_> = found.iter().skip(1).copied().collect();
                assert_eq!(expected.difference(&less).count(), 1);
            }
        }
    }
}

/// Layers above a floor, in more groups of triangles than a workgroup has threads.
pub(crate) fn seven_layers() -> ModelBuilder {
    let mut builder = ModelBuilder::new().self_contact(contact(DISTANCE, 0.3)).collider(Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::default(),
        friction: 0.5,
        restitution: 0.0,
    });
    for layer in 0..7 {
        let height = 2.5e-3 * f64::from(layer + 1);
        let (centre, angle) = ([0.0, 0.0, height], 0.1 * f64::from(layer));
        builder = builder.cloth(sheet(&format!("{layer}"), 15, SPACING, centre, angle));
    }
    builder
}

/// Whether the boxes around the features of a pair are closer than a little more than they have to be at the end of a substep.
fn is_close(surface: &ContactSurface, candidate: Candidate, x: &[[f64; 3]]) -> bool {
    let points = surface.particles(candidate).map(|i| x[i as usize]);
    let (first, second) = points.split_at(match candidate {
        Candidate::VertexTriangle(_) => 1,
        Candidate::EdgeEdge(_) => 2,
    });
    let range = |points: &[[f64; 3]], axis: usize| {
        let numbers = points.iter().map(|x| x[axis]);
        numbers.fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)])
    };
    (0..3).all(|axis| {
        let [a, b] = [range(first, axis), range(second, axis)];
        a[0] - b[1] < 4e-5 && b[0] - a[1] < 4e-5
    })
}

/// Seven layers that fall on a floor, substep by substep: no list lacks a pair that is close at the end of a substep, and nothing passes.
#[test]
fn lists_stay_complete_while_layers_fall() {
    let model = Arc::new(seven_layers().build().expect("it is valid"));
    assert!(model.triangles().len().div_ceil(8) > 256);
    let surface = ContactSurface::new(&model, model.self_contact().expect("it has contact"));
    let mut oracle = kernels(processor(), &model, &Integrator::Explicit);
    for candidate in others() {
        let _turn = candidate.turn();
        let integrator = Integrator::Implicit(ImplicitSettings::default());
        let [built, _] = fall(candidate, &model, (integrator, 8), |kernels, state, what| {
            let mut listed = vec![];
            kernels.contact_list_read(&mut listed).expect("the list can be read");
            let close = list(&mut *oracle, &state.positions);
            let lacks = close.iter().filter(|pair| listed.binary_search(pair).is_err());
            let lacks: Vec<_> =
                lacks.filter(|&&pair| is_close(&surface, pair, &state.positions)).collect();
            assert!(lacks.is_empty(), "{what}: {} of {} are missing", lacks.len(), listed.len());
        });
        assert!(built > 1, "{built}");
    }
}

/// Layers that hit the floor fast: each stops the one above it, round by round, and ways are far longer than lists reach, so that what is stopped has lists of
/// its own.
#[test]
fn nothing_passes_where_layers_stop_each_other() {
    let mut builder = seven_layers();
    builder = (7..10).fold(builder, |builder, layer| {
        let centre = [0.0, 0.0, 2.5e-3 * f64::from(layer + 1)];
        let thrown = sheet(&format!("thrown {layer}"), 15, SPACING, centre, 0.1 * f64::from(layer));
        builder.cloth(Cloth { velocity: [0.0, 0.0, -3.0], ..thrown })
    });
    let model = Arc::new(builder.build().expect("it is valid"));
    for candidate in std::iter::once(processor()).chain(others()) {
        let _turn = candidate.turn();
        // One step, as the forces of a second one would be too large.
        let [built, stopped] = fall(candidate, &model, (Integrator::Explicit, 1), |_, _, _| {});
        assert!(
            built <= 2 && stopped > 450,
            "{}: {built} lists, {stopped} stopped",
            candidate.label
        );
    }
}

/// Lets a model fall for some substeps of 1/120 s, nothing through anything else, and has a look at each. Returns how often the list was built, and how many
/// particles were stopped in the end.
fn fall(
    candidate: &Backend,
    model: &Arc<Model>,
    (integrator, substeps): (Integrator, u32),
    mut look: impl FnMut(&mut dyn Kernels, &State, &str),
) -> [u64; 2] {
    let audit = SceneAudit::new(model);
    let length = 1.0 / 120.0;
    let mut kernels = kernels(candidate, model, &integrator);
    let mut state = model.initial_state();
    kernels.state_write(&state).expect("it is valid");
    let poses = [Pose::default()];
    let span = FrameSpan {
        time: 0.0,
        duration: f64::from(substeps) * length,
        wind_velocity: [0.0; 3],
        anchor_offset: [[0.0; 3]; 2],
        from: &poses,
        to: &poses,
    };
    let mut plan = FramePlan::default();
    plan.refill(model, &span, (0.0, 0), length);
    kernels.frame_begin(&plan).expect("colliders can be written");
    let mut report = SolverReport::default();
    let mut counts = [0; 2];
    for substep in &plan.substeps {
        let what = format!("{} substep {}", candidate.label, substep.step);
        let mut all = || -> cloth_core::Result<()> {
            match &integrator {
                Integrator::Implicit(settings) => {
                    kernels.implicit_substep(substep, settings, &mut report)?;
                }
                _ => kernels.explicit_substep(substep)?,
            }
            kernels.state_read(&mut state)?;
            let found = kernels.contact_statistics()?;
            counts[0] += u64::from(found.rebuilds);
            counts[1] += found.truncated;
            Ok(())
        };
        all().expect("the stages can be done");
        look(&mut *kernels, &state, &what);
        let found = audit.at(&state.positions, &state.colliders, 0.0);
        assert_eq!(found.pairs(), 0, "{what}");
    }
    println!("{}: {counts:?} rebuilds and truncated", candidate.label);
    assert!(counts[0] > 0, "{counts:?}");
    counts
}
