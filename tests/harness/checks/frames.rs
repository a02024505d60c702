//! Whole frames against the reference backend.

use cloth_core::{
    Anchor, AnchorSpring, Backend, ColliderControl, Control, ForceControl, Frame, ImplicitSettings,
    Integrator, LinearMethod, MidpointSettings, NewtonSettings, PinAction, PinControl, Precision,
    SemiImplicitSettings, Solver, SolverConfig, State,
};

use super::{patch_frames::PatchFrames, scenario::Scenario};
use crate::{
    Verdict,
    backends::{Candidate, reference},
    models::{Case, Description},
    random::Random,
    verdict::{Failure, ensure},
};

/// How far two runs in double precision may be apart after a few frames, relative to the largest position and velocity: sums
/// in another order differ in the last digit.
const SHARE: f64 = 1e-10;

/// Where two runs are farther apart, the reference has to be as sensitive: started with positions and velocities this share off,
/// it ends a tenth as far from itself at least. So it is where rounding decides whether a contact slides.
const PERTURBATION: f64 = 1e-14;

/// Runs of the reference that are started elsewhere, at most: where one rounding in ten takes the other branch, four miss it often.
const PERTURBED_RUNS: u64 = 40;

/// The integrators, their systems solved to a few roundings.
fn integrators() -> Vec<Integrator> {
    let mut settings = ImplicitSettings::default();
    settings.linear.tolerance = 1e-14;
    settings.linear.iterations_max = 2000;
    let (mut direct, mut newton) = (settings, settings);
    direct.linear.method = LinearMethod::Direct;
    newton.newton = NewtonSettings { iterations_max: 3, tolerance: 1e-10 };
    vec![
        Integrator::Explicit,
        Integrator::Implicit(settings),
        Integrator::Implicit(direct),
        Integrator::Implicit(newton),
        Integrator::Midpoint(MidpointSettings { linear: settings.linear, weight: 0.6 }),
        Integrator::SemiImplicit(SemiImplicitSettings::default()),
    ]
}

/// What happens from outside in each frame: a pin moves, one is set, one let go; colliders move; the wind turns; a force pulls.
fn controls(case: &Case) -> [Control; 3] {
    let last = case.model.particle_count() as u32 - 1;
    let moved = |height: f64| {
        let [x, y, z] = case.state.positions[0];
        let action = PinAction::MoveTo([x, y, z + height]);
        let colliders = case.state.colliders.iter().zip(0..).map(|(pose, collider)| {
            let mut pose = *pose;
            pose.translation[2] += 0.5 * height;
            ColliderControl { collider, pose }
        });
        Control {
            pins: vec![PinControl { particle: 0, action }],
            colliders: colliders.collect(),
            wind_velocity: case.model.air().map(|_| [height, 2.0, -1.0]),
            ..Control::default()
        }
    };
    let spring =
        AnchorSpring { anchor: Anchor::Here, stiffness: 5.0, damping: 0.1, reach: f64::INFINITY };
    let force = ForceControl { particle: last / 2, force: [0.01, 0.0, 0.02], spring: Some(spring) };
    let mut second = moved(0.02);
    second.pins.push(PinControl { particle: last, action: PinAction::Hold });
    second.forces = Some(vec![force]);
    let released = PinControl { particle: last, action: PinAction::Release };
    let third = Control {
        pins: vec![released],
        anchor_offset: Some([0.0, 0.01, 0.0]),
        ..Control::default()
    };
    [moved(0.01), second, third]
}

/// Frames of a generated case with every integrator, under controls of every kind. Of candidates in double precision, as in
/// single precision rounding decides too much.
///
/// # Errors
/// What is wrong.
pub fn frames(candidate: &Candidate, description: &Description) -> Verdict {
    if candidate.precision != Precision::F64 {
        return Ok(());
    }
    let case = description.case(candidate);
    for integrator in integrators() {
        let factor = if integrator == Integrator::Explicit { 1.0 } else { 8.0 };
        let config = SolverConfig {
            integrator,
            time_step: factor * case.config.time_step,
            strain_bound: f64::MAX,
            ..case.config.clone()
        };
        let label = format!("{}, {:?}", candidate.label, config.integrator);
        let start = &case.state;
        let found = run(candidate, &case, &config, start)?;
        let expected = run(reference(), &case, &config, start)?;
        let again = |start: &State| run(reference(), &case, &config, start);
        near(&label, &found, (start, &expected), again)?;
    }
    Ok(())
}

/// The state with every number a little off.
fn perturbed(state: &State, seed: u64) -> State {
    let mut random = Random::new(seed);
    let mut state = state.clone();
    for number in state.positions.iter_mut().chain(&mut state.velocities).flatten() {
        *number *= 1.0 + random.between(-PERTURBATION, PERTURBATION);
    }
    state
}

fn run(
    candidate: &Candidate,
    case: &Case,
    config: &SolverConfig,
    start: &State,
) -> Result<State, Failure> {
    let mut solver = candidate.backend.create_solver(case.model.clone(), config)?;
    solver.upload(start)?;
    for control in &controls(case) {
        solver.set_control(control)?;
        solver.advance(Frame { duration: 2.5 * config.time_step })?;
        solver.synchronize()?;
    }
    let mut state = State::default();
    solver.download(&mut state)?;
    Ok(state)
}

/// Frames of a scenario with much contact.
///
/// # Errors
/// What is wrong.
pub fn scenario_frames(backends: [&dyn Backend; 2], scenario: &Scenario) -> Verdict {
    let start = Scenario::start(&scenario.model());
    let [found, expected] = [scenario.run(backends[0])?, scenario.run(backends[1])?];
    let again = |start: &State| scenario.run_from(backends[1], start);
    near(&format!("{scenario:?}"), &found, (&start, &expected), again)
}

/// Frames of a patch, which a backend may do in a way of its own.
///
/// # Errors
/// What is wrong.
pub fn patch_frames_near(backends: [&dyn Backend; 2], patch: &PatchFrames) -> Verdict {
    let start = patch.start(&*patch.model()?);
    let [found, expected] = [patch.run(backends[0])?, patch.run(backends[1])?];
    let again = |start: &State| Ok(patch.run_from(backends[1], start)?);
    near(&format!("{patch:?}"), &found, (&start, &expected), again)
}

/// The final states of the first backend in the precision of the patch, and of the second in double precision, differ by a share of their
/// largest numbers at most.
///
/// # Errors
/// What is wrong.
pub fn patch_frames_within(
    backends: [&dyn Backend; 2],
    patch: &PatchFrames,
    share: f64,
) -> Verdict {
    let double = PatchFrames { precision: Precision::F64, ..patch.clone() };
    let [found, expected] = [patch.run(backends[0])?, double.run(backends[1])?];
    let apart = distance(&found, &expected);
    ensure(apart[0] <= share && apart[1] <= share, || {
        format!("{patch:?}: positions and velocities are {apart:?} apart, not {share}")
    })
}

/// Largest difference of positions and of velocities, relative to the largest of either, or to 1.
fn distance(found: &State, expected: &State) -> [f64; 2] {
    let relative = |found: &[[f64; 3]], expected: &[[f64; 3]]| {
        let both = found.iter().flatten().zip(expected.iter().flatten());
        let largest = expected.iter().flatten().fold(1.0, |most: f64, c| most.max(c.abs()));
        // NaN is a difference.
        let most = both.fold(0.0, |most: f64, (a, b)| {
            let apart = (a - b).abs();
            if apart <= most { most } else { apart }
        });
        most / largest
    };
    [
        relative(&found.positions, &expected.positions),
        relative(&found.velocities, &expected.velocities),
    ]
}

/// Whether two states are the same but for rounding: [`SHARE`], or what rounding makes of it in another run from almost the same
/// start.
fn near(
    label: &str,
    found: &State,
    (start, expected): (&State, &State),
    again: impl Fn(&State) -> Result<State, Failure>,
) -> Verdict {
    ensure(found.held == expected.held, || format!("{label}: held particles differ"))?;
    let apart = distance(found, expected);
    // Written so that NaN fails.
    let within = |bounds: [f64; 2]| apart[0] <= bounds[0] && apart[1] <= bounds[1];
    let mut bounds = [SHARE; 2];
    for seed in 0..PERTURBED_RUNS {
        if within(bounds) {
            return Ok(());
        }
        let sensitivity = distance(&again(&perturbed(start, seed))?, expected);
        bounds = [0, 1].map(|k| bounds[k].max(10.0 * sensitivity[k]));
    }
    ensure(within(bounds), || {
        let [positions, velocities] = apart;
        format!(
            "{label}: positions are {positions:e} off, velocities {velocities:e}, of {bounds:?}"
        )
    })
}
