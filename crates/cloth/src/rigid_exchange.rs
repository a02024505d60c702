//! Rigid bodies and cloth, step by step together.

use std::collections::BTreeMap;

use cloth_core::{
    ColliderControl, ColliderImpulse, Control, ControlStart, Error, Frame, Model, PinAction, Pose,
    Result, Solver, State, StepReport, StrainGauge, contact::EXCHANGE_INTERVAL,
};
use cloth_rigid::{RigidError, RigidMotion, RigidWorld, Stop};
use cloth_scene::CompiledScene;

use crate::rigid_holds::{self, RigidHolds};

/// How much farther than its limit a triangle that a body stretches may be stretched.
const OVERSTRETCH: f64 = 1.02;

/// How much further than before that is in a part of a frame.
const GROWTH: f64 = 1.0005;

/// Places that are found to stop bodies in a part of a frame at most.
const STOPS_MAX: usize = 24;
/// As many of these show that a body lies flat.
const STOPS_BROAD: usize = 4;

/// Where the particles are that a control moves \[m\], for a frame that is done in parts.
pub(crate) fn moved_from(
    solver: &mut dyn Solver,
    control: &Control,
) -> Result<BTreeMap<u32, [f64; 3]>> {
    let moves = control.pins.iter().filter(|pin| pin.action.moves());
    moves.map(|pin| Ok((pin.particle, solver.particle_position(pin.particle)?))).collect()
}

fn poses_of(bodies: &[RigidMotion]) -> Vec<Pose> {
    bodies.iter().map(|body| body.pose).collect()
}

/// How fast pins and colliders are moved in a part of a frame \[m/s\], each that is.
fn velocities_held(control: &Control, start: &State, part: Frame) -> Vec<[f64; 3]> {
    let velocity = |from: [f64; 3], to: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| (to[k] - from[k]) / part.duration)
    };
    let pins = control.pins.iter().filter_map(|pin| match pin.action {
        PinAction::MoveTo(target) => {
            Some(velocity(*start.positions.get(pin.particle as usize)?, target))
        }
        PinAction::MoveBy(way) => Some(velocity([0.0; 3], way)),
        PinAction::Hold | PinAction::Release => None,
    });
    let colliders = control.colliders.iter().filter_map(|control| {
        let start = start.colliders.get(control.collider as usize)?;
        Some(velocity(start.translation, control.pose.translation))
    });
    pins.chain(colliders).collect()
}

/// The rigid bodies of a scene, which are the last of its colliders, and what the cloth does to them.
pub struct RigidExchange {
    world: RigidWorld,
    /// Colliders that are no bodies.
    own: usize,
    impulses: Vec<ColliderImpulse>,
    holds: RigidHolds,
    /// Offset of the anchors of forces \[m\].
    anchor_offset: [f64; 3],
}

/// What a part of a frame that may be done again goes by: the state before and after it, and the fabric.
#[derive(Default)]
struct Part {
    start: State,
    end: State,
    gauge: StrainGauge,
}

impl RigidExchange {
    /// The bodies of a scene at its start, or `None` if it has none.
    ///
    /// # Errors
    /// What [`Solver::collider_impulses`] reports: a backend that cannot take part says so before the first
    /// frame. [`Error::Unsupported`] for bodies that cannot be made, which compiling the scene excludes.
    pub fn new(scene: &CompiledScene, solver: &mut dyn Solver) -> Result<Option<Self>> {
        if scene.rigids.is_empty() {
            return Ok(None);
        }
        let mut impulses = Vec::new();
        solver.collider_impulses(&mut impulses)?;
        let own = scene.model.colliders().len() - scene.rigids.len();
        let colliders = &scene.model.colliders()[..own];
        let world = RigidWorld::new(&scene.rigids, colliders, scene.model.gravity())
            .and_then(|mut world| world.join(&scene.rigids, &scene.rigid_joints).map(|()| world))
            .map_err(|error| Error::Unsupported {
                backend: "rigid body",
                feature: error.to_string(),
            })?;
        let holds = RigidHolds::new(scene, &world);
        Ok(Some(Self { world, own, impulses, holds, anchor_offset: [0.0; 3] }))
    }

    /// Goes on with bodies as they were. See [`RigidWorld::resume`].
    ///
    /// # Errors
    /// Those of [`RigidWorld::resume`].
    pub fn resume(&mut self, snapshot: &[u8]) -> Result<(), RigidError> {
        self.world.resume(snapshot)
    }

    /// Goes on with colliders and bodies as they were, though gravity or friction may be others now. See
    /// [`RigidWorld::motions_take`].
    pub fn motions_take(&mut self, colliders: &[Pose], bodies: &[RigidMotion]) {
        self.world.motions_take(&colliders[..self.own.min(colliders.len())], bodies);
    }

    /// The bodies.
    #[must_use]
    pub const fn world(&self) -> &RigidWorld {
        &self.world
    }

    /// Advances bodies and cloth, where they are near each other in parts short enough that each feels the other in time. The state of the cloth is read
    /// before and after each part where its triangles touch or bodies hold some of it, and else only if a pin moves that was not held before.
    ///
    /// # Errors
    /// Those of the solver.
    pub fn step(
        &mut self,
        solver: &mut dyn Solver,
        control: &Control,
        frame: Frame,
    ) -> Result<StepReport> {
        let positions = moved_from(solver, control)?;
        let poses = solver.colliders().to_vec();
        let start = ControlStart {
            positions: &positions,
            colliders: &poses,
            anchor_offset: self.anchor_offset,
        };
        if control.forces.is_some() {
            self.anchor_offset = [0.0; 3];
        }
        self.anchor_offset = control.anchor_offset.unwrap_or(self.anchor_offset);
        let parts = (frame.duration / EXCHANGE_INTERVAL).ceil().clamp(1.0, 1e4);
        let part = Frame { duration: frame.duration / parts };
        let mut report = StepReport::default();
        let mut stops = Vec::new();
        let mut states = Part::default();
        self.holds.forces_take(solver, control)?;
        let touches = solver.model().has_triangle_contact();
        if touches || !self.holds.is_empty() {
            solver.download(&mut states.start)?;
        }
        if touches {
            if let Some(report) = self.apart(solver, control, frame, &states.start)? {
                return Ok(report);
            }
            states.gauge = StrainGauge::new(solver.model());
        }
        for number in 1..=parts as u32 {
            let control = control.part(&start, f64::from(number) / parts, number == 1);
            report.add_part(self.part(solver, &control, part, (&mut states, &mut stops))?);
            self.react();
        }
        report.bodies_at_speed_limit = self.world.at_speed_limit() as u32;
        Ok(report)
    }

    /// Advances bodies and cloth by a whole frame, where they are not likely to meet; nothing, and all as it was, if they do.
    fn apart(
        &mut self,
        solver: &mut dyn Solver,
        control: &Control,
        frame: Frame,
        state: &State,
    ) -> Result<Option<StepReport>> {
        if self.holds.any(state.time)
            || !self.world.is_apart(&state.positions, &state.velocities, frame.duration)
        {
            return Ok(None);
        }
        let bodies = self.world.motions();
        let control = self.advance((state.time, frame), control, (&bodies, &mut Vec::new()), false);
        let moved = solver.set_control(&control).and_then(|()| solver.advance(frame));
        let outcome = moved.and_then(|()| solver.synchronize());
        if let Ok(mut report) = outcome {
            solver.collider_impulses(&mut self.impulses)?;
            let nothing = ColliderImpulse::default();
            if self.impulses[self.own..].iter().all(|impulse| *impulse == nothing) {
                report.bodies_at_speed_limit = self.world.at_speed_limit() as u32;
                return Ok(Some(report));
            }
        }
        self.world.motions_take(&state.colliders, &bodies);
        solver.upload(state)?;
        Ok(None)
    }

    /// Advances bodies and cloth by a part of a frame. Where a body would pinch cloth, or stretch it beyond its limit, it is stopped, and the part is done again.
    fn part(
        &mut self,
        solver: &mut dyn Solver,
        control: &Control,
        part: Frame,
        (Part { start, end, gauge }, stops): (&mut Part, &mut Vec<Stop>),
    ) -> Result<StepReport> {
        let bodies = self.world.motions();
        // Contact of points lets cloth through instead.
        let pinches = solver.model().has_triangle_contact();
        let held = velocities_held(control, start, part);
        let (mut found, mut halts) = (0, false);
        loop {
            let control = self.advance((start.time, part), control, (&bodies, stops), halts);
            let moved = solver.set_control(&control).and_then(|()| solver.advance(part));
            let outcome = moved.and_then(|()| solver.synchronize());
            let stop = match &outcome {
                Ok(_) => {
                    solver.collider_impulses(&mut self.impulses)?;
                    if pinches || !self.holds.is_empty() {
                        solver.download(end)?;
                    }
                    self.overstretched(gauge, solver.model(), ([start, end], &held))
                }
                Err(Error::Pinched { place, .. } | Error::PinchedByBody { place, .. })
                    if pinches =>
                {
                    // What bodies did before that is of no account.
                    solver.collider_impulses(&mut self.impulses)?;
                    self.world.stop_at(*place, part.duration)
                }
                Err(_) => None,
            };
            let is_pinched = outcome.is_err();
            let is_stopped = |stop: &Stop| stops.iter().any(|other| other.body() == stop.body());
            match stop {
                Some(stop) if found < STOPS_MAX => {
                    stops.push(stop);
                    found += 1;
                    if found % STOPS_BROAD == 0 {
                        stops.extend(self.world.stop_broadly(&stop));
                    }
                }
                // Between bodies that are pressed against each other each of them has many places: then they stand still, and so do others that come there.
                Some(stop) if is_pinched && !(halts && is_stopped(&stop)) => {
                    stops.push(stop);
                    halts = true;
                }
                None if is_pinched && found == STOPS_MAX && !halts => halts = true,
                // If none is there that moves it is a matter of others.
                _ => {
                    if outcome.is_ok() {
                        let (from, to) = (poses_of(&bodies), self.world.poses());
                        let span = rigid_holds::Part::new((start.time, part), [&from, &to]);
                        self.holds.impulses(span, end, &mut self.impulses[self.own..]);
                    }
                    std::mem::swap(start, end);
                    return outcome;
                }
            }
            self.world.motions_take(&start.colliders, &bodies);
            solver.upload(start)?;
        }
    }

    /// Where the body is to go along with cloth that works most against it, if a triangle is stretched further beyond its limit than it was: that is as hard as
    /// what holds the cloth, and no force tells the body of it.
    fn overstretched(
        &self,
        gauge: &StrainGauge,
        model: &Model,
        ([start, state], held): ([&State; 2], &[[f64; 3]]),
    ) -> Option<Stop> {
        let elements = model.elements();
        let [before, after] = [start, state].map(|state| gauge.measure(&state.positions));
        let beyond = elements.triangles().iter().zip(before.zip(after));
        let beyond = beyond.filter_map(|(element, (before, after))| {
            let limit = elements.fabrics()[element.fabric as usize].stretch_limit;
            let most = (OVERSTRETCH * limit).max(GROWTH * before.stretches[0]);
            let stretch = after.stretches[0];
            (stretch > most).then_some((stretch / limit, after.particles))
        });
        let (_, corners) = beyond.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let places = corners.map(|corner| state.positions[corner as usize]);
        let middle =
            std::array::from_fn(|k| places.iter().map(|place| place[k]).sum::<f64>() / 3.0);
        let cloth = (middle, corners.map(|corner| state.velocities[corner as usize]));
        let stops = self.impulses[self.own..].iter().enumerate();
        let stops =
            stops.filter_map(|(body, impulse)| self.world.stop_against(body, impulse, cloth, held));
        stops.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, stop)| stop)
    }

    /// Moves the bodies on from `time` \[s\], and tells the cloth of their way and of what holds it. Those that were stopped stand still if it `halts` them.
    fn advance(
        &mut self,
        (time, frame): (f64, Frame),
        control: &Control,
        (before, stops): (&[RigidMotion], &mut Vec<Stop>),
        halts: bool,
    ) -> Control {
        let mut control = control.clone();
        let mut targets: Vec<Option<Pose>> = vec![None; self.own];
        for control in &control.colliders {
            if let Some(target) = targets.get_mut(control.collider as usize) {
                *target = Some(control.pose);
            }
        }
        self.world.advance(frame.duration, &targets);
        if !stops.is_empty() {
            self.world.stop(stops, before, frame.duration);
        }
        if halts {
            self.world.halt(stops, before);
        }
        let (from, poses) = (poses_of(before), self.world.poses());
        let span = rigid_holds::Part::new((time, frame), [&from, &poses]);
        let offset = control.anchor_offset.unwrap_or(self.anchor_offset);
        self.holds.control(span, offset, &mut control);
        for (index, pose) in (self.own..).zip(poses) {
            control.colliders.push(ColliderControl { collider: index as u32, pose });
        }
        control
    }

    /// Gives the bodies what the cloth took from them.
    fn react(&mut self) {
        for (body, impulse) in self.impulses[self.own..].iter().enumerate() {
            self.world.apply(body, impulse);
        }
    }
}
