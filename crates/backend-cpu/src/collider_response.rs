//! NUMERICS §7: colliders as signed distances.

use cloth_core::{
    ColliderShape, Model, Real,
    stepper::{ColliderState, FramePlan},
};
use pulp::NullaryFnOnce;

use crate::{
    memory::{LANES, Lanes, MotionChunk, PacketMotion, lanes},
    vector::dot,
};

/// A collider at one time, in the precision of the solver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColliderAt<T> {
    shape: Shape<T>,
    translation: [T; 3],
    rotation: [[T; 3]; 3],
    linear_velocity: [T; 3],
    angular_velocity: [T; 3],
    friction: T,
    restitution: T,
}

#[derive(Clone, Copy, Debug)]
enum Shape<T> {
    Plane,
    Sphere { radius: T },
    Capsule { half_length: T, radius: T },
    Box { half_extents: [T; 3] },
}

impl<T: Real> ColliderAt<T> {
    /// All colliders of all substeps of a frame, in the order of the plan.
    pub(crate) fn fill(out: &mut Vec<Self>, model: &Model, plan: &FramePlan) {
        out.clear();
        for states in plan.colliders.chunks(plan.collider_count.max(1)) {
            out.extend(model.colliders().iter().zip(states).map(|(collider, state)| {
                let ColliderState { translation, rotation, linear_velocity, angular_velocity } =
                    *state;
                Self {
                    shape: Shape::new(collider.shape),
                    translation: translation.map(T::from_f64),
                    rotation: rotation.map(|row| row.map(T::from_f64)),
                    linear_velocity: linear_velocity.map(T::from_f64),
                    angular_velocity: angular_velocity.map(T::from_f64),
                    friction: T::from_f64(collider.friction),
                    restitution: T::from_f64(collider.restitution),
                }
            }));
        }
    }

    /// Signed distance and normal (in the world) at a point relative to the origin of the frame.
    #[inline(always)]
    fn distance(&self, point: [T; 3]) -> (T, [T; 3]) {
        let [x, y, z] = self.rotation;
        let along_x = [x[0], y[0], z[0]];
        let along_z = [x[2], y[2], z[2]];
        match self.shape {
            Shape::Plane => (dot(point, along_z), along_z),
            Shape::Sphere { radius } => {
                let (length, normal) = normalise(point, along_z);
                (length - radius, normal)
            }
            Shape::Capsule { half_length, radius } => {
                let place = dot(point, along_z).maximum(-half_length).minimum(half_length);
                let mut across = [T::ZERO; 3];
                for k in 0..3 {
                    across[k] = point[k] - place * along_z[k];
                }
                let (length, normal) = normalise(across, along_x);
                (length - radius, normal)
            }
            Shape::Box { half_extents } => box_distance(half_extents, point, &self.rotation),
        }
    }
}

impl<T: Real> Shape<T> {
    fn new(shape: ColliderShape) -> Self {
        match shape {
            ColliderShape::Plane => Self::Plane,
            ColliderShape::Sphere { radius } => Self::Sphere { radius: T::from_f64(radius) },
            ColliderShape::Capsule { half_length, radius } => {
                Self::Capsule { half_length: T::from_f64(half_length), radius: T::from_f64(radius) }
            }
            ColliderShape::Box { half_extents } => {
                Self::Box { half_extents: half_extents.map(T::from_f64) }
            }
        }
    }
}

/// Outside, the distance to the nearest point of the box; inside, minus the distance to the nearest
/// face. At equal distances the earlier axis wins.
#[inline(always)]
fn box_distance<T: Real>(
    half_extents: [T; 3],
    point: [T; 3],
    rotation: &[[T; 3]; 3],
) -> (T, [T; 3]) {
    let mut local = [T::ZERO; 3];
    for k in 0..3 {
        local[k] =
            rotation[0][k] * point[0] + rotation[1][k] * point[1] + rotation[2][k] * point[2];
    }
    let mut beyond = [T::ZERO; 3];
    let mut sign = [T::ONE; 3];
    for k in 0..3 {
        sign[k] = if local[k] < T::ZERO { -T::ONE } else { T::ONE };
        beyond[k] = local[k].abs() - half_extents[k];
    }
    let [ox, oy, oz] = beyond;
    let outside = [ox.maximum(T::ZERO), oy.maximum(T::ZERO), oz.maximum(T::ZERO)];
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
    (if is_outside { length } else { nearest }, world)
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
/// the cloth at each particle \[m\]; particles with inverse mass zero are left alone.
#[inline(always)]
pub(crate) fn packet<T: Real>(
    colliders: &[ColliderAt<T>],
    offsets: &Lanes<T>,
    inverse_mass: &Lanes<T>,
    motion: &mut PacketMotion<T>,
) {
    for collider in colliders {
        let mut depth = [T::ZERO; LANES];
        let mut normals = [[T::ZERO; LANES]; 3];
        for lane in 0..LANES {
            let mut point = [T::ZERO; 3];
            for axis in 0..3 {
                point[axis] = motion.position[axis][lane] - collider.translation[axis];
            }
            let (distance, normal) = collider.distance(point);
            depth[lane] = offsets[lane] - distance;
            for axis in 0..3 {
                normals[axis][lane] = normal[axis];
            }
        }
        let mut touches = false;
        for lane in 0..LANES {
            touches |= depth[lane] > T::ZERO && inverse_mass[lane] != T::ZERO;
        }
        if touches {
            respond(collider, &depth, &normals, inverse_mass, motion);
        }
    }
}

/// The stage on one block, compiled for each instruction set.
pub(crate) struct BlockTask<'a, 'b, T> {
    pub(crate) colliders: &'a [ColliderAt<T>],
    pub(crate) offsets: &'a [T],
    pub(crate) inverse_mass: &'a [T],
    pub(crate) chunk: &'a mut MotionChunk<'b, T>,
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for local in (0..self.chunk.position[0].len()).step_by(LANES) {
            let mut motion = self.chunk.load(local);
            let offsets = lanes(self.offsets, local);
            packet(self.colliders, offsets, lanes(self.inverse_mass, local), &mut motion);
            self.chunk.store(local, &motion);
        }
    }
}

#[inline(always)]
fn respond<T: Real>(
    collider: &ColliderAt<T>,
    depth: &Lanes<T>,
    normals: &[Lanes<T>; 3],
    inverse_mass: &Lanes<T>,
    motion: &mut PacketMotion<T>,
) {
    let [ax, ay, az] = collider.angular_velocity;
    let rebound = T::ONE + collider.restitution;
    for lane in 0..LANES {
        let touches = depth[lane] > T::ZERO && inverse_mass[lane] != T::ZERO;
        let mut normal = [T::ZERO; 3];
        let mut position = [T::ZERO; 3];
        let mut velocity = [T::ZERO; 3];
        for axis in 0..3 {
            normal[axis] = normals[axis][lane];
            velocity[axis] = motion.velocity[axis][lane];
            position[axis] = motion.position[axis][lane] + depth[lane] * normal[axis];
        }
        let mut arm = [T::ZERO; 3];
        for axis in 0..3 {
            arm[axis] = position[axis] - collider.translation[axis];
        }
        let turning =
            [ay * arm[2] - az * arm[1], az * arm[0] - ax * arm[2], ax * arm[1] - ay * arm[0]];
        let mut surface = [T::ZERO; 3];
        let mut relative = [T::ZERO; 3];
        for axis in 0..3 {
            surface[axis] = collider.linear_velocity[axis] + turning[axis];
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

/// Deepest intrusion into the thickness around any collider \[m\]; 0 if there is none.
pub(crate) fn penetration<T: Real>(colliders: &[ColliderAt<T>], offset: T, position: [T; 3]) -> T {
    let mut deepest = T::ZERO;
    for collider in colliders {
        let point = std::array::from_fn(|axis| position[axis] - collider.translation[axis]);
        deepest = deepest.maximum(offset - collider.distance(point).0);
    }
    deepest
}
