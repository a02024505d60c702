//! Free bodies under cloth: what the cloth does to them is what they do to it, whatever the integrator.

use std::sync::Arc;

use cloth_core::{
    AdaptiveSettings, Backend, Cloth, Collider, ColliderControl, ColliderImpulse, ColliderShape,
    Control, Frame, Geometry, GridPatch, ImplicitSettings, Integrator, MaterialPreset, Model,
    ModelBuilder, NewtonSettings, Pose, Precision, SemiImplicitSettings, Solver, SolverConfig,
    State, TimeStepControl,
};
use cloth_rigid::{RigidBody, RigidShape, RigidWorld};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates, cpu},
    perturbed::{Defect, PerturbedBackend},
};

use crate::rig::{GRAVITY, assert_close, build, implicit};

/// Time after which bodies and cloth tell each other \[s\].
const INTERVAL: f64 = 2e-3;

/// Several iterations of Newton's method.
const NEWTON: NewtonSettings = NewtonSettings { iterations_max: 3, tolerance: 0.0 };

const HALF_EXTENTS: [f64; 3] = [0.12, 0.08, 0.05];

/// Bodies, cloth, and the solver of the cloth.
struct Scene {
    model: Arc<Model>,
    solver: Box<dyn Solver>,
    world: RigidWorld,
    /// Substeps that were taken back.
    failed: u32,
}

/// What changed while a scene went on.
struct Change {
    linear: f64,
    angular: f64,
    /// Sum of |impulse| of all bodies and steps.
    exchanged: f64,
}

fn body(name: &str, place: [f64; 3], velocity: [f64; 3]) -> RigidBody {
    RigidBody {
        name: name.into(),
        shape: RigidShape::Box { half_extents: HALF_EXTENTS },
        pose: Pose::from_translation(place),
        mass: 0.3,
        centre_of_mass: None,
        velocity,
        angular_velocity: [0.3, -0.2, 0.5],
        force: [0.0; 3],
        torque: [0.0; 3],
        friction: 0.4,
        restitution: 0.0,
    }
}

fn collider(body: &RigidBody) -> Collider {
    Collider {
        name: body.name.clone(),
        shape: ColliderShape::Box { half_extents: HALF_EXTENTS },
        pose: body.pose,
        friction: body.friction,
        restitution: 0.0,
    }
}

fn patch(side: u32, height: f64, velocity: [f64; 3]) -> Cloth {
    Cloth {
        name: "patch".into(),
        geometry: Geometry::Grid(GridPatch::horizontal(side, 0.03, height)),
        material: MaterialPreset::ALL[0].material(0.03).into(),
        pins: vec![],
        velocity,
    }
}

impl Scene {
    fn new(
        backend: &dyn Backend,
        (precision, integrator): (Precision, Integrator),
        (cloth, bodies): (Cloth, &[RigidBody]),
        gravity: [f64; 3],
    ) -> Self {
        let mut builder = ModelBuilder::new().gravity(gravity).cloth(cloth).collider_impulses(true);
        for body in bodies {
            builder = builder.collider(collider(body));
        }
        let model = build(builder);
        let explicit = integrator == Integrator::Explicit;
        let time_step = if explicit { 2e-4 } else { INTERVAL };
        let config = SolverConfig { precision, time_step, integrator, ..SolverConfig::default() };
        let solver = backend.create_solver(Arc::clone(&model), &config).unwrap();
        let world = RigidWorld::new(bodies, &[], gravity).unwrap();
        Self { model, solver, world, failed: 0 }
    }

    /// Goes on for an interval; gives the impulses on the cloth.
    fn step(&mut self) -> Vec<ColliderImpulse> {
        self.world.advance(INTERVAL, &[]);
        let poses = (0..).zip(self.world.poses());
        let colliders = poses.map(|(collider, pose)| ColliderControl { collider, pose }).collect();
        self.solver.set_control(&Control { colliders, ..Control::default() }).unwrap();
        self.solver.advance(Frame { duration: INTERVAL }).unwrap();
        self.failed += self.solver.synchronize().unwrap().solver.substeps_failed;
        let mut impulses = Vec::new();
        self.solver.collider_impulses(&mut impulses).unwrap();
        for (body, impulse) in impulses.iter().enumerate() {
            self.world.apply(body, impulse);
        }
        impulses
    }

    /// Momentum of everything, and angular momentum about the origin.
    fn momentum(&mut self) -> [DVec3; 2] {
        let mut state = State::default();
        self.solver.download(&mut state).unwrap();
        let (linear, angular) = self.world.momentum();
        let mut sums = [DVec3::from(linear), DVec3::from(angular)];
        for (i, (x, v)) in state.positions.iter().zip(&state.velocities).enumerate() {
            let momentum = self.model.masses()[i] * DVec3::from(*v);
            sums[0] += momentum;
            sums[1] += DVec3::from(*x).cross(momentum);
        }
        sums
    }

    fn change(&mut self, steps: u32) -> Change {
        let before = self.momentum();
        let mut exchanged = 0.0;
        for _ in 0..steps {
            let impulses = self.step();
            exchanged += impulses.iter().map(|sum| DVec3::from(sum.linear).length()).sum::<f64>();
        }
        let after = self.momentum();
        Change {
            linear: before[0].distance(after[0]),
            angular: before[1].distance(after[1]),
            exchanged,
        }
    }
}

/// A cloth is thrown at two bricks that float side by side, turning, and wraps itself around them.
fn thrown(backend: &dyn Backend, precision: Precision, integrator: Integrator) -> Scene {
    let bodies = [
        body("left", [-0.16, 0.01, 0.0], [0.2, 0.0, 0.3]),
        body("right", [0.16, -0.02, 0.01], [-0.1, 0.05, 0.0]),
    ];
    let cloth = patch(21, 0.09, [0.4, -0.3, -3.0]);
    Scene::new(backend, (precision, integrator), (cloth, &bodies), [0.0; 3])
}

/// Each integrator with what it may lose of the momentum that is exchanged. Explicit and semi-implicit steps lose what
/// rounding takes; an implicit step what its solvers leave as well: with linear systems solved as well as the precision
/// allows, with three Newton iterations, and with the tolerance of a thousandth that is the default.
fn integrators(candidate: &Candidate) -> [(Integrator, f64); 5] {
    let rounding = match candidate.precision {
        Precision::F32 => 1e-6,
        Precision::F64 => 1e-13,
    };
    let exact = implicit(candidate, 1e-12);
    let mut newton = exact.clone();
    if let Integrator::Implicit(settings) = &mut newton {
        settings.newton = NEWTON;
    }
    [
        (Integrator::Explicit, rounding),
        (Integrator::SemiImplicit(SemiImplicitSettings::default()), 50.0 * rounding),
        (exact, 50.0 * rounding),
        (newton, 2e-4),
        (Integrator::Implicit(ImplicitSettings::default()), 5e-3),
    ]
}

#[test]
fn cloth_and_bodies_together_keep_their_momentum() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        for (integrator, lost) in integrators(candidate) {
            let what = format!("{} {integrator:?}", candidate.label);
            let backend = candidate.backend.as_ref();
            let mut scene = thrown(backend, candidate.precision, integrator);
            let Change { linear, angular, exchanged } = scene.change(candidate.work(100));
            let share = linear / exchanged;
            println!("{what}: {share:e} of {exchanged} N s is lost; {angular:e} N s m");
            assert!(exchanged > 0.01, "{what}: they have met: {exchanged} N s");
            assert!(share < lost, "{what}: {linear:e} of {exchanged} N s is lost");
            // Bodies turn by steps of their library, and particles are pushed out of them, which moves them without an
            // impulse: both change angular momentum a little.
            let arm = 0.3;
            assert!(angular < 0.01 * arm * exchanged, "{what}: {angular} N s m");
        }
    }
}

/// What a substep did to the bodies is forgotten if the substep is taken back.
#[test]
fn momentum_is_kept_when_substeps_are_taken_back() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        let backend = candidate.backend.as_ref();
        let integrator = implicit(candidate, 1e-12);
        let mut scene = thrown(backend, candidate.precision, integrator.clone());
        let settings =
            AdaptiveSettings { strain_max: 0.012, halvings_max: 2, ..AdaptiveSettings::default() };
        let config = SolverConfig {
            precision: candidate.precision,
            time_step: INTERVAL,
            integrator,
            time_step_control: TimeStepControl::Adaptive(settings),
            ..SolverConfig::default()
        };
        scene.solver = backend.create_solver(Arc::clone(&scene.model), &config).unwrap();
        let Change { linear, exchanged, .. } = scene.change(candidate.work(60));
        let share = linear / exchanged;
        println!("{}: {} taken back, {share:e} lost", candidate.label, scene.failed);
        assert!(scene.failed > 0, "{}: nothing is taken back", candidate.label);
        let lost = match candidate.precision {
            Precision::F32 => 5e-5,
            Precision::F64 => 5e-12,
        };
        assert!(share < lost, "{}: {linear:e} of {exchanged} N s is lost", candidate.label);
    }
}

/// The negative control of the tests above.
#[test]
fn without_the_impulses_of_constraints_momentum_is_lost() {
    for precision in [Precision::F64, Precision::F32] {
        let backend = PerturbedBackend::new(cpu(1), Defect::ConstraintImpulsesDropped);
        let real = Candidate::new("cpu", Box::new(cpu(1)), precision);
        let change = thrown(&backend, precision, implicit(&real, 1e-12)).change(50);
        assert!(change.linear > 0.1 * change.exchanged, "{:e} N s is lost", change.linear);
    }
}

/// A force holds up a brick and the cloth on top of it: the brick stays where it is, and what it gives to the cloth in
/// the mean is the weight of the cloth.
#[test]
fn a_cloth_at_rest_on_a_body_weighs_on_it() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        let settings = ImplicitSettings::default();
        for integrator in [
            Integrator::Explicit,
            implicit(candidate, 1e-9),
            Integrator::Implicit(settings),
            Integrator::Implicit(ImplicitSettings { newton: NEWTON, ..settings }),
        ] {
            let what = format!("{} {integrator:?}", candidate.label);
            let cloth = patch(5, HALF_EXTENTS[2] + 2e-3, [0.0; 3]);
            let weight = GRAVITY
                * build(ModelBuilder::new().cloth(cloth.clone())).masses().iter().sum::<f64>();
            let mut brick = body("brick", [0.0; 3], [0.0; 3]);
            brick.angular_velocity = [0.0; 3];
            brick.force = [0.0, 0.0, GRAVITY * brick.mass + weight];
            let kind = (candidate.precision, integrator);
            let gravity = [0.0, 0.0, -GRAVITY];
            let mut scene =
                Scene::new(candidate.backend.as_ref(), kind, (cloth, &[brick]), gravity);
            let (settling, steps) = (50, candidate.work(200));
            let mut given = 0.0;
            let mut speeds = Vec::new();
            for step in 0..settling + steps {
                let impulse = scene.step()[0].linear[2];
                if step >= settling {
                    given += impulse;
                    speeds.push(scene.world.momentum().0[2]);
                }
            }
            let force = given / (f64::from(steps) * INTERVAL);
            assert_close(&what, force, weight, 5e-3);
            let gained = speeds[speeds.len() - 1] - speeds[0];
            let of_weight = weight * f64::from(steps) * INTERVAL;
            assert!(gained.abs() < 0.02 * of_weight, "{what}: the brick gains {gained:e} N s");
        }
    }
}
