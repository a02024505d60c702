//! All bodies of a scene.

use cloth_core::{Collider, ColliderImpulse, ColliderShape, Pose};
use rapier3d_f64::prelude::{
    ColliderBuilder, PhysicsWorld, RigidBody as Body, RigidBodyBuilder, RigidBodyHandle,
    SharedShape, Vector,
};

use rapier3d_f64::{parry::bounding_volume::BoundingVolume, utils::AngularInertiaOps};

use crate::{
    RigidBody, RigidError, RigidJoint, RigidMotion,
    mesh::vector,
    shape::{self, pose, solid, within_reach},
    snapshot,
};

/// Longest step of the bodies \[s\].
pub(crate) const STEP_MAX: f64 = 1.0 / 240.0;

/// What a body turns in a step at most \[rad\]; the library has it as a constant.
pub(crate) const ROTATION_MAX: f64 = std::f64::consts::FRAC_PI_4;

/// How far a body and cloth are from each other at least that are not likely to meet \[m\], beside the ways that both go.
const APART: f64 = 0.02;

/// Fastest start of a body \[m/s\]: the limit that the library has by default.
pub(crate) const SPEED_MAX: f64 = 400.0;

/// Bodies that collide with each other and with the colliders of a scene. Deterministic: the same
/// calls give the same bits.
pub struct RigidWorld {
    pub(crate) world: PhysicsWorld,
    pub(crate) bodies: Vec<RigidBodyHandle>,
    /// The colliders of the scene, moved from outside, with where they are.
    kinematic: Vec<(RigidBodyHandle, Pose)>,
    /// Stands for everything that the world was made of.
    start: u128,
}

impl RigidWorld {
    /// Puts `bodies` among `colliders` under `gravity` \[m/s^2\].
    ///
    /// # Errors
    /// [`RigidError`] for shapes that are not closed, and numbers that make no sense.
    pub fn new(
        bodies: &[RigidBody],
        colliders: &[Collider],
        gravity: [f64; 3],
    ) -> Result<Self, RigidError> {
        let mut world = PhysicsWorld { gravity: vector(gravity), ..PhysicsWorld::default() };
        let mut handles = Vec::with_capacity(bodies.len());
        for body in bodies {
            body.validate()?;
            let (collider, properties) = body.build()?;
            let builder = RigidBodyBuilder::dynamic()
                .pose(pose(&body.pose))
                .linvel(vector(body.velocity))
                .angvel(vector(body.angular_velocity))
                .additional_mass_properties(properties)
                .ccd_enabled(true)
                // Cloth can push a body at any time.
                .can_sleep(false);
            let collider = within_reach(&body.name, collider, &body.pose)?;
            let collider = collider.friction(body.friction).restitution(body.restitution);
            let (handle, _) = world.insert(builder, collider);
            let inserted = &mut world.bodies[handle];
            inserted.recompute_mass_properties_from_colliders(&world.colliders);
            inserted.add_force(vector(body.force), true);
            inserted.add_torque(vector(body.torque), true);
            handles.push(handle);
        }
        let mut kinematic = Vec::with_capacity(colliders.len());
        for collider in colliders {
            if collider.shape.changes() {
                return Err(RigidError::Changes { name: collider.name.clone() });
            }
            let shape = match &collider.shape {
                ColliderShape::Plane => {
                    ColliderBuilder::new(SharedShape::halfspace(vector([0.0, 0.0, 1.0])))
                }
                ColliderShape::Sphere { radius } => ColliderBuilder::ball(*radius),
                // Ours lie along z, and so do these.
                ColliderShape::Capsule { half_length, radius } => {
                    ColliderBuilder::capsule_z(*half_length, *radius)
                }
                ColliderShape::Box { half_extents: [x, y, z] } => {
                    ColliderBuilder::cuboid(*x, *y, *z)
                }
                ColliderShape::Grid(grid) => {
                    solid(&collider.name, &grid.surface, &grid.surface.triangles)?
                }
                ColliderShape::Surface(surface) => shape::surface(&collider.name, surface)?,
            };
            // A half space has no end.
            let shape = match collider.shape {
                ColliderShape::Plane => shape,
                _ => within_reach(&collider.name, shape, &collider.pose)?,
            };
            let shape = shape.friction(collider.friction).restitution(collider.restitution);
            let builder = RigidBodyBuilder::kinematic_position_based().pose(pose(&collider.pose));
            kinematic.push((world.insert(builder, shape).0, collider.pose));
        }
        let start = snapshot::digest(&world)?;
        Ok(Self { world, bodies: handles, kinematic, start })
    }

    /// Adds joints between `bodies`, those of this world, to be called before the first step.
    ///
    /// # Errors
    /// [`RigidError::Joint`] for bodies that do not exist and numbers that make no sense.
    pub fn join(&mut self, bodies: &[RigidBody], joints: &[RigidJoint]) -> Result<(), RigidError> {
        for (index, joint) in joints.iter().enumerate() {
            let built = joint.build(index, bodies)?;
            let to = match joint.to.and_then(|to| self.bodies.get(to)) {
                Some(&to) => to,
                None => self.world.insert_body(RigidBodyBuilder::fixed()),
            };
            if let Some(&from) = self.bodies.get(joint.from) {
                self.world.insert_impulse_joint(to, from, built);
            }
        }
        self.start = snapshot::digest(&self.world)?;
        Ok(())
    }

    /// Moves all bodies on by `duration` \[s\], while the colliders go to `targets`; a collider without
    /// one stays.
    pub fn advance(&mut self, duration: f64, targets: &[Option<Pose>]) {
        let steps = (duration / STEP_MAX).ceil().clamp(1.0, 1e6);
        self.world.integration_parameters.dt = duration / steps;
        for step in 1..=steps as u32 {
            let fraction = f64::from(step) / steps;
            for ((handle, from), target) in self.kinematic.iter().zip(targets) {
                if let Some(target) = target {
                    let way = from.interpolate(target, fraction);
                    self.world.bodies[*handle].set_next_kinematic_position(pose(&way));
                }
            }
            self.world.step();
        }
        for ((_, at), target) in self.kinematic.iter_mut().zip(targets) {
            *at = target.unwrap_or(*at);
        }
    }

    /// Number of bodies that are as fast as their solver lets them be: 400 m/s, and an eighth of a turn in a step. Without this limit
    /// they would be faster.
    #[must_use]
    pub fn at_speed_limit(&self) -> usize {
        let parameters = &self.world.integration_parameters;
        let angular = ROTATION_MAX / parameters.dt.min(STEP_MAX);
        let limits = [parameters.max_linear_velocity(), angular].map(|limit| 0.999 * limit);
        let is_fast = |&&handle: &&RigidBodyHandle| {
            let body = &self.world.bodies[handle];
            body.linvel().length() >= limits[0] || body.angvel().length() >= limits[1]
        };
        self.bodies.iter().filter(is_fast).count()
    }

    /// Gives a body the reaction to what it did to the cloth.
    pub fn apply(&mut self, body: usize, impulse: &ColliderImpulse) {
        let Some(&handle) = self.bodies.get(body) else { return };
        let body = &mut self.world.bodies[handle];
        let [linear, angular] = reaction(body, impulse);
        body.apply_impulse(linear, true);
        body.apply_torque_impulse(angular, true);
    }

    /// How fast at most a point of a body, which is at `place` \[m\], is after an impulse there of 1 kg m/s, in whatever direction \[1/kg\]: the inverse of its
    /// mass, and the sum over three directions of what turning adds. Zero without such a body.
    #[must_use]
    pub fn inverse_mass(&self, body: usize, place: [f64; 3]) -> f64 {
        let Some(&handle) = self.bodies.get(body) else { return 0.0 };
        let body = &self.world.bodies[handle];
        let arm = vector(place) - body.center_of_mass();
        let inertia = body.mass_properties().effective_world_inv_inertia;
        let turns = [Vector::X, Vector::Y, Vector::Z].map(|direction| {
            let moment = arm.cross(direction);
            moment.dot(inertia.transform_vector(moment))
        });
        1.0 / body.mass() + turns.iter().sum::<f64>()
    }

    /// Whether no body is likely to meet cloth within `duration` \[s\]: particles are at `positions` \[m\] and go with `velocities` \[m/s\].
    #[must_use]
    pub fn is_apart(&self, positions: &[[f64; 3]], velocities: &[[f64; 3]], duration: f64) -> bool {
        let boxes: Vec<_> = (self.bodies.iter())
            .flat_map(|&handle| {
                let body = &self.world.bodies[handle];
                body.colliders().iter().map(move |&collider| {
                    let own = self.world.colliders[collider].compute_aabb();
                    let size = own.half_extents().length();
                    let speed = body.linvel().length() + size * body.angvel().length();
                    own.loosened(APART + speed * duration)
                })
            })
            .collect();
        !positions.iter().zip(velocities).any(|(&x, &v)| {
            let way = vector(v) * duration;
            let (start, end) = (vector(x), vector(x) + way);
            boxes.iter().any(|own| {
                start.min(end).cmple(own.maxs).all() && start.max(end).cmpge(own.mins).all()
            })
        })
    }

    /// All that the bodies need to go on with the same bits, contacts and their impulses included, for [`Self::resume`].
    ///
    /// # Errors
    /// [`RigidError::Snapshot`] if the library cannot put its state down.
    pub fn snapshot(&self) -> Result<Vec<u8>, RigidError> {
        snapshot::write(&self.world, &self.kinematic, self.start)
    }

    /// Goes on from what [`Self::snapshot`] has put down of a world with the same bodies, joints and colliders at the start.
    ///
    /// # Errors
    /// [`RigidError::Snapshot`] if `bytes` are not what was put down, or were put down for other bodies. The world
    /// then stays as it is.
    pub fn resume(&mut self, bytes: &[u8]) -> Result<(), RigidError> {
        let (world, poses) = snapshot::read(bytes, self.start, self.kinematic.len())?;
        self.world = world;
        for ((_, at), pose) in self.kinematic.iter_mut().zip(poses) {
            *at = pose;
        }
        Ok(())
    }

    /// Where the bodies are and how they move, for [`Self::motions_take`].
    #[must_use]
    pub fn motions(&self) -> Vec<RigidMotion> {
        let of = |&handle: &RigidBodyHandle| {
            let body = &self.world.bodies[handle];
            let pose = body.position();
            RigidMotion {
                pose: Pose {
                    translation: pose.translation.to_array(),
                    rotation: pose.rotation.to_array(),
                },
                velocity: body.linvel().to_array(),
                angular_velocity: body.angvel().to_array(),
            }
        };
        self.bodies.iter().map(of).collect()
    }

    /// Goes on from `motions`, one for each body, with the colliders at `colliders`: those of a world of as many bodies whose gravity and
    /// friction may be others, where [`Self::resume`] wants the same. Bodies that touch each other find the forces between them anew.
    pub fn motions_take(&mut self, colliders: &[Pose], motions: &[RigidMotion]) {
        for ((handle, at), collider) in self.kinematic.iter_mut().zip(colliders) {
            self.world.bodies[*handle].set_position(pose(collider), true);
            *at = *collider;
        }
        for (&handle, motion) in self.bodies.iter().zip(motions) {
            let body = &mut self.world.bodies[handle];
            body.set_position(pose(&motion.pose), true);
            body.set_linvel(vector(motion.velocity), true);
            body.set_angvel(vector(motion.angular_velocity), true);
        }
    }

    /// Where the local frames of the bodies are.
    #[must_use]
    pub fn poses(&self) -> Vec<Pose> {
        let at = |&handle: &RigidBodyHandle| {
            let pose = self.world.bodies[handle].position();
            Pose {
                translation: pose.translation.to_array(),
                rotation: pose.rotation.normalize().to_array(),
            }
        };
        self.bodies.iter().map(at).collect()
    }

    /// Sum of the momenta of all bodies \[kg m/s\], and of their angular momenta about the origin
    /// \[kg m^2/s\].
    #[must_use]
    pub fn momentum(&self) -> ([f64; 3], [f64; 3]) {
        let mut linear = vector([0.0; 3]);
        let mut angular = vector([0.0; 3]);
        for &handle in &self.bodies {
            let body = &self.world.bodies[handle];
            let momentum = body.mass() * body.linvel();
            let inverse = body.mass_properties().effective_world_inv_inertia;
            linear += momentum;
            angular += body.center_of_mass().cross(momentum);
            angular += inverse.inverse().transform_vector(body.angvel());
        }
        (linear.to_array(), angular.to_array())
    }
}

/// What a body feels of an impulse that it gave, about its own centre.
fn reaction(body: &Body, impulse: &ColliderImpulse) -> [Vector; 2] {
    let linear = -vector(impulse.linear);
    [linear, -vector(impulse.angular) - body.center_of_mass().cross(linear)]
}
