//! The stages on states in which much touches.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderShape, ContactStatistics, ImplicitSettings, Integrator, Kernels,
    LinearSettings, LinearStart, LinearVector, MatrixForm, Model, ModelBuilder, NewtonStart, Pose,
    Precision, Preconditioner, SolverConfig, State,
    contact::{ContactKind, Contacts},
    stepper::{self, Substep},
};
use harness::{backends::Candidate, random::Random};

use crate::rig::{contact, others, processor, sheet};

const SPACING: f64 = 0.01;

/// Two sheets across each other at this contact distance \[m\], the lower one on a plane.
fn model(distance: f64) -> Arc<Model> {
    let sheets = [("below", 9, 0.0, 0.0), ("above", 7, 0.6 * distance, 0.4)];
    let floor = Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::from_translation([0.3, 0.2, -0.45 * distance]),
        friction: 0.2,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new().collider(floor).self_contact(contact(distance, 0.4));
    let builder = sheets.into_iter().fold(builder, |builder, (name, side, height, angle)| {
        builder.cloth(sheet(name, side, SPACING, [0.0, 0.0, height], angle))
    });
    Arc::new(builder.build().expect("it is valid"))
}

/// Particles a little elsewhere, of which some are held, in numbers that single precision has.
fn state(model: &Model, distance: f64, seed: u64, candidate: &Candidate) -> State {
    let mut random = Random::new(seed);
    let mut state = model.initial_state();
    for (i, x) in state.positions.iter_mut().enumerate() {
        let by = random.vector(0.2 * distance);
        *x = std::array::from_fn(|k| x[k] + by[k]);
        // What is held rests: nothing else could be pinched.
        let is_held = random.chance(0.1);
        state.velocities[i] = if is_held { [0.0; 3] } else { random.vector(1.0) };
        state.held[i] = u8::from(is_held);
    }
    candidate.rounded(&state)
}

fn kernels(candidate: &Candidate, model: &Arc<Model>, config: &SolverConfig) -> Box<dyn Kernels> {
    let kernels = candidate.backend.create_kernels(Arc::clone(model), config);
    kernels.expect("it has contact of triangles")
}

fn config(integrator: Integrator) -> SolverConfig {
    SolverConfig { integrator, precision: Precision::F32, ..SolverConfig::default() }
}

fn substep(length: f64) -> Substep {
    Substep { length, step: 1, ..Substep::default() }
}

/// What contact does to a state within an explicit substep.
struct Seen {
    contacts: Contacts,
    forces: Vec<[f64; 3]>,
    end: State,
    statistics: ContactStatistics,
}

fn explicit(candidate: &Candidate, model: &Arc<Model>, start: &State) -> Seen {
    let mut kernels = kernels(candidate, model, &config(Integrator::Explicit));
    let substep = substep(4e-3);
    let mut seen = Seen {
        contacts: Contacts::default(),
        forces: vec![],
        end: State::default(),
        statistics: ContactStatistics::default(),
    };
    let mut all = || -> cloth_core::Result<()> {
        kernels.state_write(start)?;
        // Twice, as the first look at a state may exempt pairs.
        for _ in 0..2 {
            kernels.start_keep()?;
            kernels.field_forces()?;
            kernels.contact_pairs(&substep)?;
            kernels.contact_geometry(&substep, NewtonStart::StepStart)?;
            kernels.contact_forces()?;
            kernels.contacts_read(&mut seen.contacts)?;
            kernels.forces_read(&mut seen.forces)?;
            kernels.integrate_explicit(&substep)?;
            kernels.contact_certify(&substep)?;
        }
        kernels.state_read(&mut seen.end)?;
        seen.statistics = kernels.contact_statistics()?;
        Ok(())
    };
    all().expect("the stages can be done");
    seen
}

/// Largest difference of two fields, relative to the largest number of the first.
fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let numbers = |field: &[[f64; 3]]| field.iter().flatten().copied().collect::<Vec<_>>();
    let (a, b) = (numbers(a), numbers(b));
    let largest = a.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let apart = a.iter().zip(&b).fold(0.0, |apart: f64, (x, y)| apart.max((x - y).abs()));
    apart / largest.max(f64::MIN_POSITIVE)
}

/// Contacts, forces and shortened ways; the larger distances have more pairs than the first lists have room for.
#[test]
fn contacts_forces_and_ways_are_those_of_the_processor() {
    for candidate in others() {
        let _turn = candidate.turn();
        let mut truncated = 0;
        let mut kinds = vec![];
        for (seed, distance) in [(1, 0.002), (2, 0.004), (3, 0.008), (4, 0.03)] {
            let model = model(distance);
            let start = state(&model, distance, seed, candidate);
            let expected = explicit(processor(), &model, &start);
            let found = explicit(candidate, &model, &start);
            let what = format!("{} {distance} m", candidate.label);
            assert!(!expected.contacts.contacts.is_empty(), "{what}");
            let keys = |seen: &Seen| {
                seen.contacts.contacts.iter().map(|contact| contact.key).collect::<Vec<_>>()
            };
            assert_eq!(keys(&expected), keys(&found), "{what}");
            kinds.extend(keys(&expected).iter().map(|key| key.kind));
            let apart = difference(&expected.forces, &found.forces);
            assert!(apart < 1e-4, "{what}: forces differ by {apart}");
            for (a, b) in [
                (&expected.end.positions, &found.end.positions),
                (&expected.end.velocities, &found.end.velocities),
            ] {
                let apart = difference(a, b);
                assert!(apart < 1e-4, "{what}: motion differs by {apart}");
            }
            // Rounds of the certificate have a list of their own on the processor alone.
            let counts = |s: &ContactStatistics| (s.contacts, s.truncated, s.exempt);
            assert_eq!(counts(&expected.statistics), counts(&found.statistics), "{what}");
            truncated += found.statistics.truncated;
        }
        assert!(truncated > 0, "nothing was shortened");
        for kind in ContactKind::ALL {
            assert!(kinds.contains(&kind), "no contact of kind {kind:?}");
        }
    }
}

/// What the linear system has of contact.
struct System {
    right_side: Vec<[f64; 3]>,
    image: Vec<[f64; 3]>,
    preconditioned: Vec<[f64; 3]>,
    /// After some iterations.
    solution: Vec<[f64; 3]>,
    /// The most contacts that a particle is in.
    crowd: usize,
}

fn implicit(
    candidate: &Candidate,
    model: &Arc<Model>,
    (start, vector): (&State, &[[f64; 3]]),
) -> System {
    let settings = ImplicitSettings::default();
    let mut kernels = kernels(candidate, model, &config(Integrator::Implicit(settings)));
    let substep = substep(1.0 / 240.0);
    let mut system = System {
        right_side: vec![],
        image: vec![],
        preconditioned: vec![],
        solution: vec![],
        crowd: 0,
    };
    let mut all = || -> cloth_core::Result<()> {
        use LinearVector::{Image, RightSide, Solution};
        kernels.state_write(start)?;
        kernels.state_keep()?;
        kernels.start_keep()?;
        stepper::implicit::system(&mut *kernels, &substep, NewtonStart::StepStart)?;
        kernels.vector_write(Solution, vector)?;
        kernels.matrix_apply(MatrixForm::MatrixFree, Solution, Image)?;
        kernels.vector_read(Image, &mut system.image)?;
        kernels.vector_read(RightSide, &mut system.right_side)?;
        kernels.preconditioner_build(Preconditioner::Block)?;
        kernels.preconditioner_apply(Solution, Image)?;
        kernels.vector_read(Image, &mut system.preconditioned)?;
        let mut blocks = vec![];
        kernels.matrix_read(&mut blocks)?;
        let mut product = vec![[0.0; 3]; vector.len()];
        for block in blocks {
            let x = vector[block.column as usize];
            for (sum, row) in product[block.row as usize].iter_mut().zip(block.entries) {
                *sum += row.iter().zip(x).map(|(entry, x)| entry * x).sum::<f64>();
            }
        }
        let apart = difference(&system.image, &product);
        assert!(apart < 1e-5, "{}: the matrix as it is read differs by {apart}", candidate.label);
        let few =
            LinearSettings { iterations_max: 8, tolerance: 1e-9, ..LinearSettings::default() };
        kernels.conjugate_gradient(&few, LinearStart::Constraints)?;
        kernels.vector_read(Solution, &mut system.solution)?;
        let mut contacts = Contacts::default();
        kernels.contacts_read(&mut contacts)?;
        let mut crowds = vec![0; vector.len()];
        for contact in contacts.contacts {
            for (particle, weight) in contact.particles.into_iter().zip(contact.weights) {
                if let Some(crowd) = crowds.get_mut(particle as usize) {
                    *crowd += usize::from(weight != 0.0);
                }
            }
        }
        system.crowd = crowds.into_iter().max().unwrap_or(0);
        Ok(())
    };
    all().expect("the stages can be done");
    system
}

#[test]
fn the_matrix_has_the_rows_of_contacts() {
    for candidate in others() {
        let _turn = candidate.turn();
        // Solves have a form of their own where particles are in many contacts.
        for (seed, distance, is_crowded) in [(5, 0.002, false), (6, 0.006, false), (7, 0.012, true)]
        {
            let model = model(distance);
            let start = state(&model, distance, seed, candidate);
            let mut random = Random::new(seed);
            let vector: Vec<_> = model
                .positions()
                .iter()
                .map(|_| random.vector(1.0).map(|x| f64::from(x as f32)))
                .collect();
            let expected = implicit(processor(), &model, (&start, &vector));
            let found = implicit(candidate, &model, (&start, &vector));
            for (what, a, b) in [
                ("right side", &expected.right_side, &found.right_side),
                ("image", &expected.image, &found.image),
                ("preconditioner", &expected.preconditioned, &found.preconditioned),
                ("solution", &expected.solution, &found.solution),
            ] {
                let apart = difference(a, b);
                assert!(apart < 1e-4, "{}: {what} differs by {apart}", candidate.label);
            }
            assert_eq!(found.crowd > 32, is_crowded, "{distance}: {}", found.crowd);
            // Without contact it is another matrix: what is compared has contacts in it.
            let bare = ModelBuilder::new()
                .cloth(sheet("below", 9, SPACING, [0.0; 3], 0.0))
                .cloth(sheet("above", 7, SPACING, [0.0, 0.0, 0.6 * distance], 0.4));
            let bare = Arc::new(bare.build().expect("it is valid"));
            let start = State { colliders: vec![], ..start };
            let without = implicit(candidate, &bare, (&start, &vector));
            assert!(difference(&found.image, &without.image) > 1e-2);
        }
    }
}
