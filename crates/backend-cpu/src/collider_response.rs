//! NUMERICS §7: colliders as signed distances.

use cloth_core::{
    ColliderImpulse, ColliderShape, Model, Real,
    stepper::{ColliderState, FramePlan},
};
use pulp::NullaryFnOnce;

use crate::{
    collider_sweep::{Carrier, PathStart},
    distance_grid::GridSolid,
    memory::{FieldView, LANES, Lanes, MotionChunk, PacketMotion, lanes},
    vector::{cross, dot, sub},
};

/// A collider at one time, in the precision of the solver.
#[derive(Clone, Debug)]
pub(crate) struct ColliderAt<T> {
    shape: Shape<T>,
    translation: [T; 3],
    linear_velocity: [T; 3],
    angular_velocity: [T; 3],
    friction: T,
    restitution: T,
}

#[derive(Clone, Debug)]
enum Shape<T> {
    Plane(Plane<T>),
    Sphere(Sphere<T>),
    Capsule(Capsule<T>),
    Box(OrientedBox<T>),
    Grid(GridSolid<T>),
    /// Nothing: it is triangles in contact of triangles.
    Body,
}

/// Signed distance, normal (in the world) and velocity of the surface along it, beside that of the collider as a whole,
/// at a point relative to the origin of the collider.
pub(crate) trait SignedDistance<T> {
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T);

    /// The share of the distance that is free of the surface in any direction, a little less than all, so that a path ends where
    /// there is a normal; `None` where nothing can come out on the other side.
    fn safe_share(&self) -> Option<T>;
}

#[derive(Clone, Copy, Debug)]
struct Plane<T> {
    normal: [T; 3],
}

#[derive(Clone, Copy, Debug)]
struct Sphere<T> {
    radius: T,
    /// Normal at the centre.
    fallback: [T; 3],
}

#[derive(Clone, Copy, Debug)]
struct Capsule<T> {
    axis: [T; 3],
    half_length: T,
    radius: T,
    /// Normal on the axis.
    fallback: [T; 3],
}

#[derive(Clone, Copy, Debug)]
struct OrientedBox<T> {
    half_extents: [T; 3],
    /// Local to world, row by row.
    rotation: [[T; 3]; 3],
}

impl<T: Real> ColliderAt<T> {
    /// All colliders of all substeps of a frame, in the order of the plan.
    pub(crate) fn fill(out: &mut Vec<Self>, model: &Model, plan: &FramePlan) {
        out.clear();
        for states in plan.colliders.chunks(plan.collider_count.max(1)) {
            let all = model.colliders().iter().zip(states).enumerate();
            out.extend(all.map(|(number, (collider, state))| Self {
                shape: match model.is_contact_body(number) {
                    true => Shape::Body,
                    false => Shape::new(&collider.shape, state),
                },
                translation: state.translation.map(T::from_f64),
                linear_velocity: state.linear_velocity.map(T::from_f64),
                angular_velocity: state.angular_velocity.map(T::from_f64),
                friction: T::from_f64(collider.friction),
                restitution: T::from_f64(collider.restitution),
            }));
        }
    }
}

impl<T: Real> ColliderAt<T> {
    /// How deep a packet is in the collider.
    #[inline(always)]
    pub(crate) fn depths(
        &self,
        offsets: &Lanes<T>,
        inverse_mass: &Lanes<T>,
        position: [&Lanes<T>; 3],
    ) -> Depths<T> {
        let mut depths = Depths::zero();
        let at = self.translation;
        match &self.shape {
            Shape::Plane(shape) => depths.fill(shape, at, offsets, inverse_mass, position),
            Shape::Sphere(shape) => depths.fill(shape, at, offsets, inverse_mass, position),
            Shape::Capsule(shape) => depths.fill(shape, at, offsets, inverse_mass, position),
            Shape::Box(shape) => depths.fill(shape, at, offsets, inverse_mass, position),
            Shape::Grid(shape) => depths.fill(shape, at, offsets, inverse_mass, position),
            Shape::Body => {}
        }
        depths
    }

    /// Velocity of the collider at a point \[m/s\].
    #[inline(always)]
    pub(crate) fn velocity_at(&self, point: [T; 3]) -> [T; 3] {
        let [ax, ay, az] = self.angular_velocity;
        let arm = sub(point, self.translation);
        let turning =
            [ay * arm[2] - az * arm[1], az * arm[0] - ax * arm[2], ax * arm[1] - ay * arm[0]];
        let mut velocity = [T::ZERO; 3];
        for axis in 0..3 {
            velocity[axis] = self.linear_velocity[axis] + turning[axis];
        }
        velocity
    }

    pub(crate) const fn friction(&self) -> T {
        self.friction
    }

    pub(crate) const fn restitution(&self) -> T {
        self.restitution
    }
}

impl<T: Real> Shape<T> {
    fn new(shape: &ColliderShape, state: &ColliderState) -> Self {
        let rotation = state.rotation.map(|row| row.map(T::from_f64));
        let [x_axis, _, z_axis] =
            [0, 1, 2].map(|axis| [rotation[0][axis], rotation[1][axis], rotation[2][axis]]);
        match *shape {
            ColliderShape::Plane => Self::Plane(Plane { normal: z_axis }),
            ColliderShape::Sphere { radius } => {
                Self::Sphere(Sphere { radius: T::from_f64(radius), fallback: z_axis })
            }
            ColliderShape::Capsule { half_length, radius } => Self::Capsule(Capsule {
                axis: z_axis,
                half_length: T::from_f64(half_length),
                radius: T::from_f64(radius),
                fallback: x_axis,
            }),
            ColliderShape::Box { half_extents } => {
                Self::Box(OrientedBox { half_extents: half_extents.map(T::from_f64), rotation })
            }
            ColliderShape::Grid(ref grid) => Self::Grid(GridSolid::new(grid, rotation, state.sets)),
            ColliderShape::Surface(_) => Self::Body,
        }
    }
}

impl<T: Real> SignedDistance<T> for Plane<T> {
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T) {
        (dot(point, self.normal), self.normal, T::ZERO)
    }

    #[inline(always)]
    fn safe_share(&self) -> Option<T> {
        None
    }
}

impl<T: Real> SignedDistance<T> for Sphere<T> {
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T) {
        let (length, normal) = normalise(point, self.fallback);
        (length - self.radius, normal, T::ZERO)
    }

    #[inline(always)]
    fn safe_share(&self) -> Option<T> {
        Some(T::from_f64(0.875))
    }
}

impl<T: Real> SignedDistance<T> for Capsule<T> {
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T) {
        let along = dot(point, self.axis).maximum(-self.half_length).minimum(self.half_length);
        let mut across = [T::ZERO; 3];
        for k in 0..3 {
            across[k] = point[k] - along * self.axis[k];
        }
        let (length, normal) = normalise(across, self.fallback);
        (length - self.radius, normal, T::ZERO)
    }

    #[inline(always)]
    fn safe_share(&self) -> Option<T> {
        Some(T::from_f64(0.875))
    }
}

impl<T: Real> SignedDistance<T> for OrientedBox<T> {
    /// Outside, the distance to the nearest point of the box; inside, minus the distance to the
    /// nearest face. At equal distances the earlier axis wins.
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T) {
        let rotation = &self.rotation;
        let mut beyond = [T::ZERO; 3];
        let mut sign = [T::ONE; 3];
        let mut outside = [T::ZERO; 3];
        for k in 0..3 {
            let local =
                rotation[0][k] * point[0] + rotation[1][k] * point[1] + rotation[2][k] * point[2];
            sign[k] = if local < T::ZERO { -T::ONE } else { T::ONE };
            beyond[k] = local.abs() - self.half_extents[k];
            outside[k] = beyond[k].maximum(T::ZERO);
        }
        let (length, direction) = normalise(outside, [T::ZERO; 3]);
        let is_outside = length > T::ZERO;
        let nearest = beyond[0].maximum(beyond[1]).maximum(beyond[2]);
        let first = beyond[0] == nearest;
        let second = !first && beyond[1] == nearest;
        let face = [first, second, !first && !second];
        let mut normal = [T::ZERO; 3];
        for k in 0..3 {
            let inside = if face[k] { T::ONE } else { T::ZERO };
            normal[k] = sign[k] * if is_outside { direction[k] } else { inside };
        }
        let world = [dot(rotation[0], normal), dot(rotation[1], normal), dot(rotation[2], normal)];
        (if is_outside { length } else { nearest }, world, T::ZERO)
    }

    #[inline(always)]
    fn safe_share(&self) -> Option<T> {
        Some(T::from_f64(0.875))
    }
}

impl<T: Real> SignedDistance<T> for GridSolid<T> {
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3], T) {
        let rotation = &self.rotation;
        let mut local = [T::ZERO; 3];
        for k in 0..3 {
            local[k] =
                rotation[0][k] * point[0] + rotation[1][k] * point[1] + rotation[2][k] * point[2];
        }
        let (distance, gradient, speed) = self.sample(local);
        let (_, normal) = normalise(gradient, [T::ZERO, T::ZERO, T::ONE]);
        let world = [dot(rotation[0], normal), dot(rotation[1], normal), dot(rotation[2], normal)];
        (distance, world, speed)
    }

    /// Beyond the grid the distance can be three times too large.
    #[inline(always)]
    fn safe_share(&self) -> Option<T> {
        Some(T::from_f64(0.25))
    }
}

/// Length and direction of a vector, `fallback` if it has none.
#[inline(always)]
fn normalise<T: Real>(vector: [T; 3], fallback: [T; 3]) -> (T, [T; 3]) {
    let length = dot(vector, vector).sqrt();
    let inverse = T::ONE / length.maximum(T::LENGTH_MIN);
    let mut direction = [T::ZERO; 3];
    for k in 0..3 {
        direction[k] = if length > T::LENGTH_MIN { vector[k] * inverse } else { fallback[k] };
    }
    (length, direction)
}

/// Contact of a packet with all colliders, one after the other. `offsets` is half the thickness of
/// the cloth at each particle \[m\]; particles with inverse mass zero are left alone. `start` is where the packet was at the
/// start of the substep, if that is known.
#[inline(always)]
pub(crate) fn packet<T: Real>(
    colliders: &[ColliderAt<T>],
    offsets: &Lanes<T>,
    inverse_mass: &Lanes<T>,
    start: Option<PathStart<'_, T>>,
    motion: &mut PacketMotion<T>,
    mut impulses: Option<&mut [ColliderImpulse]>,
) {
    let particles = (offsets, inverse_mass, start);
    for (index, collider) in colliders.iter().enumerate() {
        let sum = impulses.as_mut().and_then(|impulses| impulses.get_mut(index));
        match &collider.shape {
            Shape::Plane(shape) => collide(collider, shape, particles, motion, sum),
            Shape::Sphere(shape) => collide(collider, shape, particles, motion, sum),
            Shape::Capsule(shape) => collide(collider, shape, particles, motion, sum),
            Shape::Box(shape) => collide(collider, shape, particles, motion, sum),
            Shape::Grid(shape) => collide(collider, shape, particles, motion, sum),
            Shape::Body => {}
        }
    }
}

#[inline(always)]
fn collide<T: Real>(
    collider: &ColliderAt<T>,
    shape: &impl SignedDistance<T>,
    (offsets, inverse_mass, start): (&Lanes<T>, &Lanes<T>, Option<PathStart<'_, T>>),
    motion: &mut PacketMotion<T>,
    impulse: Option<&mut ColliderImpulse>,
) {
    let [x, y, z] = &motion.position;
    let mut contact = Depths::zero();
    contact.fill(shape, collider.translation, offsets, inverse_mass, [x, y, z]);
    let mut touches = false;
    for lane in 0..LANES {
        touches |= contact.depth[lane] > T::ZERO;
    }
    if let (Some(start), Some(_)) = (start, shape.safe_share()) {
        touches |= sweep(collider, shape, (offsets, inverse_mass, start), &mut contact, motion);
    }
    if touches {
        let before = motion.velocity;
        respond(collider, &contact, motion);
        if let Some(impulse) = impulse {
            add_impulses(impulse, inverse_mass, &before, motion);
        }
    }
}

/// Puts particles that have passed a collider within the substep back to where they met it. Returns whether there
/// are any.
#[inline(always)]
fn sweep<T: Real>(
    collider: &ColliderAt<T>,
    shape: &impl SignedDistance<T>,
    (offsets, inverse_mass, start): (&Lanes<T>, &Lanes<T>, PathStart<'_, T>),
    contact: &mut Depths<T>,
    motion: &mut PacketMotion<T>,
) -> bool {
    let carrier = Carrier {
        translation: collider.translation,
        linear_velocity: collider.linear_velocity,
        angular_velocity: collider.angular_velocity,
    };
    let [from_x, from_y, from_z] = start.position;
    let path_of = |position: &[Lanes<T>; 3], lane: usize| {
        let from = [from_x[lane], from_y[lane], from_z[lane]];
        let to = [position[0][lane], position[1][lane], position[2][lane]];
        carrier.path(from, to, start.length)
    };
    let mut any = false;
    for lane in 0..LANES {
        let path = path_of(&motion.position, lane);
        any |= path.can_pass(contact.distances[lane]) & (inverse_mass[lane] > T::ZERO);
    }
    if !any {
        return false;
    }
    let mut swept = false;
    for lane in 0..LANES {
        let path = path_of(&motion.position, lane);
        if !(path.can_pass(contact.distances[lane]) && inverse_mass[lane] > T::ZERO) {
            continue;
        }
        let normal = contact.normals.each_ref().map(|components| components[lane]);
        let end = (contact.depth[lane] > T::ZERO).then_some(normal);
        if let Some(hit) = path.hit(shape, end) {
            swept = true;
            contact.swept[lane] = true;
            contact.depth[lane] = offsets[lane] - hit.distance;
            contact.speeds[lane] = hit.speed;
            for axis in 0..3 {
                contact.normals[axis][lane] = hit.normal[axis];
                motion.position[axis][lane] = hit.point[axis] + collider.translation[axis];
            }
        }
    }
    swept
}

/// Adds the change of momentum of a packet, and its moment about the origin.
fn add_impulses<T: Real>(
    sum: &mut ColliderImpulse,
    inverse_mass: &Lanes<T>,
    before: &[Lanes<T>; 3],
    motion: &PacketMotion<T>,
) {
    for lane in 0..LANES {
        if inverse_mass[lane] > T::ZERO {
            let mass = 1.0 / inverse_mass[lane].to_f64();
            let mut linear = [0.0; 3];
            let mut at = [0.0; 3];
            for axis in 0..3 {
                let change = motion.velocity[axis][lane].to_f64() - before[axis][lane].to_f64();
                linear[axis] = mass * change;
                at[axis] = motion.position[axis][lane].to_f64();
            }
            *sum += ColliderImpulse { linear, angular: cross(at, linear) };
        }
    }
}

/// How deep the particles of a packet are in a collider.
pub(crate) struct Depths<T> {
    /// Intrusion into the thickness \[m\]; not positive for particles that are outside or held.
    pub(crate) depth: Lanes<T>,
    pub(crate) normals: [Lanes<T>; 3],
    /// Velocity of the surface along the normal, beside that of the collider as a whole \[m/s\].
    pub(crate) speeds: Lanes<T>,
    /// Signed distances \[m\].
    distances: Lanes<T>,
    /// Those that are at a surface which they would have passed.
    swept: [bool; LANES],
}

impl<T: Real> Depths<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            depth: [T::ZERO; LANES],
            normals: [[T::ZERO; LANES]; 3],
            speeds: [T::ZERO; LANES],
            distances: [T::ZERO; LANES],
            swept: [false; LANES],
        }
    }

    #[inline(always)]
    fn fill(
        &mut self,
        shape: &impl SignedDistance<T>,
        [cx, cy, cz]: [T; 3],
        offsets: &Lanes<T>,
        inverse_mass: &Lanes<T>,
        [x, y, z]: [&Lanes<T>; 3],
    ) {
        for lane in 0..LANES {
            let (distance, [nx, ny, nz], speed) =
                shape.distance([x[lane] - cx, y[lane] - cy, z[lane] - cz]);
            let depth = offsets[lane] - distance;
            self.depth[lane] = if inverse_mass[lane] > T::ZERO { depth } else { T::ZERO };
            self.distances[lane] = distance;
            self.normals[0][lane] = nx;
            self.normals[1][lane] = ny;
            self.normals[2][lane] = nz;
            self.speeds[lane] = speed;
        }
    }
}

/// Deepest intrusion of the free particles of a packet into the thickness around any collider
/// \[m\]; 0 if there is none.
#[inline(always)]
pub(crate) fn penetration<T: Real>(
    colliders: &[ColliderAt<T>],
    offsets: &Lanes<T>,
    inverse_mass: &Lanes<T>,
    position: [&Lanes<T>; 3],
) -> T {
    let mut deepest = T::ZERO;
    for collider in colliders {
        let contact = collider.depths(offsets, inverse_mass, position);
        for lane in 0..LANES {
            deepest = contact.depth[lane].maximum(deepest);
        }
    }
    deepest
}

/// The stage on one block, compiled for each instruction set.
pub(crate) struct BlockTask<'a, 'b, T> {
    pub(crate) colliders: &'a [ColliderAt<T>],
    pub(crate) offsets: &'a [T],
    pub(crate) inverse_mass: &'a [T],
    pub(crate) chunk: &'a mut MotionChunk<'b, T>,
    /// Where all particles were at the start of the substep, if somebody knows, and its length \[s\]; the block begins at `first`.
    pub(crate) start: Option<FieldView<'a, T>>,
    pub(crate) length: T,
    pub(crate) first: usize,
    /// Sums of the block, one for each collider.
    pub(crate) impulses: Option<&'a mut [ColliderImpulse]>,
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for local in (0..self.chunk.position[0].len()).step_by(LANES) {
            let mut motion = self.chunk.load(local);
            let offsets = lanes(self.offsets, local);
            let inverse_mass = lanes(self.inverse_mass, local);
            let impulses = self.impulses.as_deref_mut();
            let now = motion.position;
            let position = match self.start {
                Some(positions) => positions.packet((self.first + local) as isize),
                None => now.each_ref(),
            };
            let start = Some(PathStart { position, length: self.length });
            packet(self.colliders, offsets, inverse_mass, start, &mut motion, impulses);
            self.chunk.store(local, &motion);
        }
    }
}

#[inline(always)]
fn respond<T: Real>(
    collider: &ColliderAt<T>,
    Depths { depth, normals, speeds, swept, .. }: &Depths<T>,
    motion: &mut PacketMotion<T>,
) {
    let rebound = T::ONE + collider.restitution;
    for lane in 0..LANES {
        let touches = swept[lane] || depth[lane] > T::ZERO;
        let mut normal = [T::ZERO; 3];
        let mut position = [T::ZERO; 3];
        let mut velocity = [T::ZERO; 3];
        for axis in 0..3 {
            normal[axis] = normals[axis][lane];
            velocity[axis] = motion.velocity[axis][lane];
            position[axis] = motion.position[axis][lane] + depth[lane] * normal[axis];
        }
        let mut surface = collider.velocity_at(position);
        let mut relative = [T::ZERO; 3];
        for axis in 0..3 {
            surface[axis] += speeds[lane] * normal[axis];
        }
        for axis in 0..3 {
            relative[axis] = velocity[axis] - surface[axis];
        }
        let approach = dot(relative, normal);
        let mut tangential = [T::ZERO; 3];
        for axis in 0..3 {
            tangential[axis] = relative[axis] - approach * normal[axis];
        }
        let speed = dot(tangential, tangential).sqrt();
        let lost = collider.friction * (rebound * approach.abs()) / speed.maximum(T::LENGTH_MIN);
        let kept = (T::ONE - lost).maximum(T::ZERO);
        let bounce = -(collider.restitution * approach);
        let impact = touches && approach < T::ZERO;
        for axis in 0..3 {
            let after = surface[axis] + (bounce * normal[axis] + kept * tangential[axis]);
            motion.position[axis][lane] =
                if touches { position[axis] } else { motion.position[axis][lane] };
            motion.velocity[axis][lane] = if impact { after } else { velocity[axis] };
        }
    }
}
