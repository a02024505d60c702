//! Rigid bodies and cloth, step by step together.

use std::collections::BTreeMap;

use cloth_core::{
    ColliderControl, ColliderImpulse, Control, ControlStart, Error, Frame, PinAction, Pose, Result,
    Solver, StepReport,
};
use cloth_rigid::{RigidError, RigidMotion, RigidWorld};
use cloth_scene::CompiledScene;

/// Longest time that a body waits for the reaction of the cloth \[s\]. A body on a cloth is a mass on a
/// spring, and a force that comes late feeds its swing: this is a small part of its period.
const EXCHANGE_INTERVAL: f64 = 2e-3;

/// Where the particles are that a control moves \[m\], for a frame that is done in parts.
pub(crate) fn moved_from(
    solver: &mut dyn Solver,
    control: &Control,
) -> Result<BTreeMap<u32, [f64; 3]>> {
    let moves = control.pins.iter().filter(|pin| matches!(pin.action, PinAction::MoveTo(_)));
    moves.map(|pin| Ok((pin.particle, solver.particle_position(pin.particle)?))).collect()
}

/// The rigid bodies of a scene, which are the last of its colliders, and what the cloth does to them.
pub struct RigidExchange {
    world: RigidWorld,
    /// Colliders that are no bodies.
    own: usize,
    impulses: Vec<ColliderImpulse>,
    /// Offset of the anchors of forces \[m\].
    anchor_offset: [f64; 3],
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
        Ok(Some(Self { world, own, impulses, anchor_offset: [0.0; 3] }))
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

    /// Advances bodies and cloth, in parts short enough that each feels the other in time. The state of the cloth is read
    /// only if a pin moves that was not held before.
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
        let (mut substeps, mut wall_time) = (0, std::time::Duration::ZERO);
        for number in 1..=parts as u32 {
            let mut control = control.part(&start, f64::from(number) / parts, number == 1);
            self.advance(part, &mut control);
            solver.set_control(&control)?;
            solver.advance(part)?;
            report = solver.synchronize()?;
            self.react(solver)?;
            substeps += report.substeps;
            wall_time += report.wall_time;
        }
        report.bodies_at_speed_limit = self.world.at_speed_limit() as u32;
        report.substeps = substeps;
        report.wall_time = wall_time;
        Ok(report)
    }

    /// Moves the bodies, and lets the cloth feel them on their way.
    fn advance(&mut self, frame: Frame, control: &mut Control) {
        let mut targets: Vec<Option<Pose>> = vec![None; self.own];
        for control in &control.colliders {
            if let Some(target) = targets.get_mut(control.collider as usize) {
                *target = Some(control.pose);
            }
        }
        self.world.advance(frame.duration, &targets);
        for (index, pose) in (self.own..).zip(self.world.poses()) {
            control.colliders.push(ColliderControl { collider: index as u32, pose });
        }
    }

    /// Gives the bodies what the cloth took from them.
    fn react(&mut self, solver: &mut dyn Solver) -> Result<()> {
        solver.collider_impulses(&mut self.impulses)?;
        for (body, impulse) in self.impulses[self.own..].iter().enumerate() {
            self.world.apply(body, impulse);
        }
        Ok(())
    }
}
