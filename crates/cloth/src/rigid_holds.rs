//! Cloth that rigid bodies hold: springs whose forces both feel.

use cloth_core::{
    Anchor, AnchorSpring, ColliderImpulse, Control, ForceControl, Frame, Pose, Result, Solver,
    State, contact::EXCHANGE_INTERVAL,
};
use cloth_rigid::RigidWorld;
use cloth_scene::CompiledScene;

/// What springs on a body add up to, relative to its mass over the square of the time between two exchanges (NUMERICS §15): stable below 4, and this
/// follows without a tremble.
const STIFFNESS_SHARE: f64 = 0.25;

/// Damping of a spring, relative to its stiffness, where none is given \[s\].
const DAMPING_TIME: f64 = EXCHANGE_INTERVAL;

/// One spring.
struct Hold {
    body: usize,
    particle: u32,
    /// In the local frame of the body \[m\].
    place: [f64; 3],
    stiffness: f64,
    damping: f64,
    /// When it lets go \[s\].
    release: f64,
}

/// All such springs of a scene.
pub(crate) struct RigidHolds {
    holds: Vec<Hold>,
    /// Forces that were given from outside, which hold on.
    given: Vec<ForceControl>,
}

/// A part of a frame: when it ends and how long it is \[s\], and where bodies are at its start and at its end.
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    end: f64,
    duration: f64,
    poses: [&'a [Pose]; 2],
}

impl<'a> Part<'a> {
    /// The part of a frame that begins at `time` \[s\].
    pub(crate) const fn new((time, frame): (f64, Frame), poses: [&'a [Pose]; 2]) -> Self {
        Self { end: time + frame.duration, duration: frame.duration, poses }
    }
}

impl RigidHolds {
    /// Those of a scene whose bodies are at their start.
    pub(crate) fn new(scene: &CompiledScene, world: &RigidWorld) -> Self {
        let poses = world.poses();
        let inverse_mass =
            |body: usize, place: [f64; 3]| world.inverse_mass(body, poses[body].point(place));
        let mut yields = vec![0.0; poses.len()];
        for hold in &scene.rigid_holds {
            for point in &hold.points {
                yields[hold.body] += point.weight * inverse_mass(hold.body, point.place);
            }
        }
        let holds = scene.rigid_holds.iter().flat_map(|hold| {
            let borne = STIFFNESS_SHARE / (EXCHANGE_INTERVAL.powi(2) * yields[hold.body]);
            let stiffness = hold.stiffness.map_or(borne, |stiffness| stiffness.min(borne));
            let damping = hold.damping.unwrap_or(DAMPING_TIME * stiffness);
            // As much as that of the stiffest.
            let damping = damping.min(DAMPING_TIME * borne);
            hold.points.iter().map(move |point| Hold {
                body: hold.body,
                particle: point.particle,
                place: point.place,
                stiffness: point.weight * stiffness,
                damping: point.weight * damping,
                release: hold.release.unwrap_or(f64::INFINITY),
            })
        });
        Self { holds: holds.collect(), given: Vec::new() }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.holds.is_empty()
    }

    /// Whether some of them hold after `time` \[s\].
    pub(crate) fn any(&self, time: f64) -> bool {
        self.holds.iter().any(|hold| time < hold.release)
    }

    /// Takes in the forces that a control gives, before they are given to the solver together with these springs.
    pub(crate) fn forces_take(&mut self, solver: &mut dyn Solver, control: &Control) -> Result<()> {
        let Some(forces) = control.forces.as_ref().filter(|_| !self.is_empty()) else {
            return Ok(());
        };
        self.given.clone_from(forces);
        for force in &mut self.given {
            if let Some(spring) = &mut force.spring
                && spring.anchor == Anchor::Here
            {
                spring.anchor = Anchor::At(solver.particle_position(force.particle)?);
            }
        }
        Ok(())
    }

    /// Makes a control one that gives all forces of a part, with `offset` \[m\] the way of the anchors of those from outside at its end.
    pub(crate) fn control(&self, part: Part<'_>, offset: [f64; 3], control: &mut Control) {
        if self.is_empty() {
            return;
        }
        let moved = |mut force: ForceControl| {
            if let Some(AnchorSpring { anchor: Anchor::At(place), .. }) = &mut force.spring {
                *place = std::array::from_fn(|k| place[k] + offset[k]);
            }
            force
        };
        let own = self.held(part).map(|(hold, place, velocity)| ForceControl {
            particle: hold.particle,
            force: velocity.map(|v| hold.damping * v),
            spring: Some(AnchorSpring {
                anchor: Anchor::At(place),
                stiffness: hold.stiffness,
                damping: hold.damping,
                reach: f64::INFINITY,
            }),
        });
        control.forces = Some(self.given.iter().copied().map(moved).chain(own).collect());
        control.anchor_offset = None;
    }

    /// Adds what the springs gave to cloth, which is in `state` after a part, to the impulses of the bodies.
    pub(crate) fn impulses(&self, part: Part<'_>, state: &State, bodies: &mut [ColliderImpulse]) {
        for (hold, place, velocity) in self.held(part) {
            let (x, v) =
                (state.positions[hold.particle as usize], state.velocities[hold.particle as usize]);
            let impulse = std::array::from_fn(|k| {
                let pull = hold.stiffness * (place[k] - x[k]) + hold.damping * (velocity[k] - v[k]);
                part.duration * pull
            });
            bodies[hold.body] += ColliderImpulse::at(x, impulse);
        }
    }

    /// The springs of a part, where their anchors are at its end \[m\], and how fast these go \[m/s\].
    fn held<'a>(
        &'a self,
        Part { end, duration, poses: [from, to] }: Part<'a>,
    ) -> impl Iterator<Item = (&'a Hold, [f64; 3], [f64; 3])> {
        let start = end - duration;
        // What rounding does to the time is no reason to hold on for a part.
        let holds = self.holds.iter().filter(move |hold| start < hold.release - 1e-6 * duration);
        holds.map(move |hold| {
            let [from, to] = [from, to].map(|poses| poses[hold.body].point(hold.place));
            (hold, to, std::array::from_fn(|k| (to[k] - from[k]) / duration))
        })
    }
}
