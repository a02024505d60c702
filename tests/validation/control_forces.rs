//! Forces on single particles, given from outside.

use std::collections::BTreeMap;

use cloth_core::{
    AdaptiveSettings, Anchor, AnchorSpring, Control, ControlStart, Field, ForceControl, Frame,
    GridPatch, ImplicitSettings, Integrator, Model, ModelBuilder, Precision, SemiImplicitSettings,
    Solver, SolverConfig, State, TimeStepControl,
};
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
};

use crate::rig::{GRAVITY, advance, build, chain, download, integrators, particles, solver_of};

fn push(particle: u32, force: [f64; 3]) -> ForceControl {
    ForceControl { particle, force, spring: None }
}

fn pull(particle: u32, force: [f64; 3], spring: AnchorSpring) -> ForceControl {
    ForceControl { particle, force, spring: Some(spring) }
}

fn give(solver: &mut dyn Solver, forces: Vec<ForceControl>) {
    solver.set_control(&Control { forces: Some(forces), ..Control::default() }).unwrap();
}

fn all_integrators(candidate: &harness::backends::Candidate) -> Vec<Integrator> {
    let mut all = integrators(candidate);
    all.push(Integrator::SemiImplicit(SemiImplicitSettings::default()));
    all
}

/// With springs far too stiff and far too damped for the step, and from anywhere within their reach or beyond it.
#[test]
fn a_particle_alone_comes_to_rest_at_the_anchor_plus_the_force_over_the_stiffness() {
    let model = build(
        ModelBuilder::new()
            .gravity([0.0; 3])
            .cloth(particles(&[[0.3, -0.2, 0.5]], [4.0, 0.0, -3.0])),
    );
    let anchor = [0.1, 0.25, -0.4];
    for candidate in candidates() {
        for integrator in all_integrators(candidate) {
            for (stiffness, damping, reach) in
                [(1e9, 0.0, f64::INFINITY), (50.0, 14.0, f64::INFINITY), (1e4, 1e2, 0.02)]
            {
                let time_step = 1.0 / 60.0;
                let mut solver = solver_of(candidate, &model, time_step, integrator.clone());
                let force = [0.1 * stiffness, -0.005 * stiffness, 0.0].map(|f| f * 0.1);
                let spring = AnchorSpring { anchor: Anchor::At(anchor), stiffness, damping, reach };
                give(&mut *solver, vec![pull(0, force, spring)]);
                // In steps of a tenth of its period the loose spring gains a digit in some twenty.
                let steps = if candidate.precision == Precision::F64 { 480 } else { 160 };
                let state = advance(&mut *solver, steps, time_step);
                let tolerance = 40.0 * candidate.epsilon();
                for axis in 0..3 {
                    let rest = anchor[axis] + force[axis] / stiffness;
                    let error = (state.positions[0][axis] - rest).abs();
                    let label = &candidate.label;
                    assert!(error < tolerance, "{label} {integrator:?} k = {stiffness}: {error:e}");
                    assert!(state.velocities[0][axis].abs() * time_step < tolerance, "{label}");
                }
            }
        }
    }
}

/// Momentum grows by F t, to the rounding of one sum for each substep; a held particle feels nothing, and an empty list ends it.
#[test]
fn a_constant_force_gives_its_impulse() {
    let time_step = 1e-3;
    let mut cloth = particles(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [0.0; 3]);
    cloth.pins = vec![1];
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
    let force = [0.3, -0.02, 0.7];
    for candidate in candidates() {
        for integrator in all_integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let steps = candidate.work(500);
            // The last entry of a particle counts.
            give(&mut *solver, vec![push(0, [9.0; 3]), push(1, force), push(0, force)]);
            let early = advance(&mut *solver, steps / 2, time_step);
            assert!(early.velocities[0][0] > 0.0);
            let state = advance(&mut *solver, steps - steps / 2, time_step);
            for (axis, component) in force.into_iter().enumerate() {
                let momentum = model.masses()[0] * state.velocities[0][axis];
                let expected = component * f64::from(steps) * time_step;
                let tolerance = f64::from(steps + 10) * candidate.epsilon() * expected.abs();
                let label = &candidate.label;
                assert!((momentum - expected).abs() <= tolerance, "{label}: {momentum} {expected}");
            }
            assert_eq!(state.velocities[1], [0.0; 3], "it is held");
            assert_eq!(state.velocities[2], [0.0; 3], "nobody pushes it");
            give(&mut *solver, vec![]);
            let after = advance(&mut *solver, 5, time_step);
            assert_eq!(after.velocities[0], state.velocities[0], "{}", candidate.label);
        }
    }
}

/// A cloth that hangs by its first row, with a force on a particle of the last one: the springs of the pins carry both.
#[test]
fn pins_carry_the_weight_and_the_force() {
    let patch = GridPatch::horizontal(5, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.02, 40.0, 2e-3));
    cloth.pins = (0..5).collect();
    let rate = 4.0;
    let drag = Field::Drag { rate: [rate; 3] };
    let model = build(ModelBuilder::new().field(drag).cloth(cloth));
    let force = [0.4, 0.3, -1.0];
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let is_explicit = integrator == Integrator::Explicit;
            if is_explicit && candidate.case_divisor > 1 {
                continue; // It would take long to come to rest; the implicit one does not.
            }
            let (time_step, count) = if is_explicit { (5e-4, 16_000) } else { (2e-2, 400) };
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            give(&mut *solver, vec![push(22, force)]);
            let state = advance(&mut *solver, count, time_step);
            let reaction = reaction(&model, &state);
            let weight: f64 = model.masses()[5..].iter().sum::<f64>() * GRAVITY;
            // In the explicit step the drag brakes the kick.
            let share = if is_explicit { 1.0 - rate * time_step } else { 1.0 };
            let expected = [share * force[0], share * force[1], share * force[2] - weight];
            for axis in 0..3 {
                let error = (reaction[axis] - expected[axis]).abs();
                let tolerance = 1e-4_f64.max(3e4 * candidate.epsilon());
                let label = &candidate.label;
                assert!(error < tolerance, "{label} axis {axis}: {reaction:?} {expected:?}");
            }
        }
    }
}

/// A cloth whose first row hangs on springs of its own is lower by its weight over the sum of their stiffness: in implicit steps they are part of the system,
/// however short the time in which a particle alone would follow them.
#[test]
fn springs_hold_a_cloth_by_their_stiffness() {
    let patch = GridPatch::horizontal(5, 0.1, 0.0);
    let cloth = grid_cloth("patch", patch, material(0.02, 40.0, 2e-3));
    let drag = Field::Drag { rate: [4.0; 3] };
    let model = build(ModelBuilder::new().field(drag).cloth(cloth));
    let weight: f64 = model.masses().iter().sum::<f64>() * GRAVITY;
    let (stiffness, damping) = (20.0, 0.4);
    let sag = weight / (5.0 * stiffness);
    for candidate in candidates() {
        let time_step = 2e-2;
        let integrator = Integrator::Implicit(ImplicitSettings::default());
        let mut solver = solver_of(candidate, &model, time_step, integrator);
        let spring =
            AnchorSpring { anchor: Anchor::Here, stiffness, damping, reach: f64::INFINITY };
        give(&mut *solver, (0..5).map(|particle| pull(particle, [0.0; 3], spring)).collect());
        let before = download(&mut *solver);
        let state = advance(&mut *solver, 300, time_step);
        let heights = (0..5).map(|i| state.positions[i][2] - before.positions[i][2]);
        let mean = -heights.sum::<f64>() / 5.0;
        let label = &candidate.label;
        assert!((mean / sag - 1.0).abs() < 1e-3, "{label}: {mean} for {sag}");
    }
}

/// The force of all springs on the particles that are held.
fn reaction(model: &Model, state: &State) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for spring in model.springs().iter() {
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let kind = model.springs().kinds()[spring.kind as usize];
        let d: [f64; 3] = std::array::from_fn(|k| state.positions[j][k] - state.positions[i][k]);
        let length = d.map(|c| c * c).iter().sum::<f64>().sqrt();
        let share = kind.stiffness * (length - kind.rest_length) / length;
        let ends = f64::from(state.held[i]) - f64::from(state.held[j]);
        (0..3).for_each(|k| sum[k] += ends * share * d[k]);
    }
    sum
}

/// Springs are anchored where their particles are, and all anchors move along; the way of a frame is travelled evenly.
#[test]
fn particles_follow_anchors_that_begin_where_they_are() {
    let places = [[0.0; 3], [0.3, 0.1, -0.2]];
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(particles(&places, [0.0; 3])));
    let spring =
        AnchorSpring { anchor: Anchor::Here, stiffness: 1e6, damping: 0.0, reach: f64::INFINITY };
    for candidate in candidates() {
        let mut solver = solver_of(candidate, &model, 1e-3, Integrator::Explicit);
        let offset = [0.05, 0.0, -0.1];
        let control = Control {
            forces: Some((0..2).map(|particle| pull(particle, [0.0; 3], spring)).collect()),
            anchor_offset: Some(offset),
            ..Control::default()
        };
        solver.set_control(&control).unwrap();
        let state = advance(&mut *solver, 100, 1e-3);
        for (x, (v, place)) in state.positions.iter().zip(state.velocities.iter().zip(places)) {
            for axis in 0..3 {
                let label = &candidate.label;
                assert!((x[axis] - place[axis] - offset[axis]).abs() < 1e-5, "{label}: {x:?}");
                assert!((v[axis] - offset[axis] / 0.1).abs() < 1e-2, "{label}: {v:?}");
            }
        }
        let rests = advance(&mut *solver, 100, 1e-3);
        let error = (rests.positions[1][2] - state.positions[1][2]).abs();
        assert!(error < 1e-5, "{}: anchors stay where they were put", candidate.label);
    }
}

/// Substeps that are tried at a length that stretches a spring too far, and taken back: the momentum is that of the time that has
/// passed, as no kick counts twice.
#[test]
fn what_is_taken_back_takes_the_kick_along() {
    let row = vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]];
    let model =
        build(ModelBuilder::new().gravity([0.0; 3]).cloth(chain(row, &[0.1, 0.1], 0.01, 100.0)));
    let time_step = 4e-3;
    let force = [0.8, 0.1, 0.0];
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let adaptive = AdaptiveSettings {
                strain_max: 0.03,
                halvings_max: 2,
                ..AdaptiveSettings::default()
            };
            let config = SolverConfig {
                precision: candidate.precision,
                time_step,
                time_step_control: TimeStepControl::Adaptive(adaptive),
                integrator,
                ..SolverConfig::default()
            };
            let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
            give(&mut *solver, vec![push(2, force)]);
            let mut halvings = 0;
            let mut time = 0.0;
            for _ in 0..5 {
                solver.advance(Frame { duration: 2.5 * time_step }).unwrap();
                let report = solver.synchronize().unwrap();
                time += 2.5 * time_step;
                let changes = report.solver.time_step_changes;
                halvings += changes.iter().filter(|change| change.to < change.from).count();
            }
            assert!(halvings > 0, "{}: nothing was taken back", candidate.label);
            let state = download(&mut *solver);
            for axis in 0..2 {
                let momenta = model.masses().iter().zip(&state.velocities);
                let momentum: f64 = momenta.map(|(mass, v)| mass * v[axis]).sum();
                let expected = force[axis] * time;
                let tolerance = 1e-9 + 1e3 * candidate.epsilon() * expected;
                let label = &candidate.label;
                assert!((momentum - expected).abs() < tolerance, "{label}: {momentum} {expected}");
            }
        }
    }
}

/// Parts of a control: forces are given in the first one, and anchors go a part of the way, from where they are or, with forces given anew,
/// from where those begin.
#[test]
fn a_part_of_a_control_moves_anchors_a_part_of_the_way() {
    let start = ControlStart {
        positions: &BTreeMap::new(),
        colliders: &[],
        anchor_offset: [1.0, 0.0, -2.0],
    };
    let control = Control { anchor_offset: Some([3.0, 4.0, -2.0]), ..Control::default() };
    let part = control.part(&start, 0.25, false);
    assert_eq!(part, Control { anchor_offset: Some([1.5, 1.0, -2.0]), ..Control::default() });
    let forces = Some(vec![push(0, [1.0; 3])]);
    let given = Control { forces: forces.clone(), ..control };
    let first = given.part(&start, 0.5, true);
    assert_eq!((first.forces, first.anchor_offset), (forces, Some([1.5, 2.0, -1.0])));
    let second = given.part(&start, 1.0, false);
    assert_eq!((second.forces, second.anchor_offset), (None, Some([3.0, 4.0, -2.0])));
}
