//! NUMERICS §5: what colliders demand of velocities, `collider_constraints`, and how contacts come
//! and go, `constraint_release` and `constraint_friction`.

use cloth_core::{ConstraintStatistics, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::constraint::{Constraint, Touch};
use crate::{
    collider_response::ColliderAt,
    memory::{BLOCK, FieldView, LANES, Masses, MotionChunk, lanes},
    vector::dot,
};

/// All constraints, by blocks of [`BLOCK`] particles, particles ascending.
#[derive(Debug)]
pub(crate) struct Constraints<T> {
    blocks: Vec<Vec<Constraint<T>>>,
    statistics: ConstraintStatistics,
}

/// What the detection reads.
pub(super) struct Detection<'a, T> {
    pub(super) colliders: &'a [ColliderAt<T>],
    pub(super) masses: &'a Masses<T>,
    pub(super) offsets: &'a [T],
    pub(super) position: FieldView<'a, T>,
    pub(super) velocity: FieldView<'a, T>,
    pub(super) acceleration: [T; 3],
    pub(super) drag_rate: [T; 3],
    pub(super) length: T,
    pub(super) count: usize,
}

impl<T: Real> Constraints<T> {
    pub(super) fn new(count: usize) -> Self {
        Self {
            blocks: (0..count.div_ceil(BLOCK)).map(|_| Vec::new()).collect(),
            statistics: ConstraintStatistics::default(),
        }
    }

    /// Forgets all constraints.
    pub(super) fn clear(&mut self) {
        self.blocks.iter_mut().for_each(Vec::clear);
    }

    /// Finds the constraints of a substep.
    pub(super) fn detect(&mut self, detection: &Detection<'_, T>, arch: pulp::Arch) {
        self.blocks.par_iter_mut().enumerate().for_each(|(block, constraints)| {
            constraints.clear();
            arch.dispatch(DetectionTask { detection, start: block * BLOCK, constraints });
        });
        self.statistics.constrained = self.blocks.iter().map(|block| block.len() as u64).sum();
    }

    /// The constraints of a block.
    #[inline(always)]
    pub(super) fn block(&self, block: usize) -> &[Constraint<T>] {
        &self.blocks[block]
    }

    /// All of them, particles ascending.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Constraint<T>> {
        self.blocks.iter().flatten()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.blocks.iter().all(Vec::is_empty)
    }

    /// Changes the contacts that pull or slip, given A y and b. Returns how many.
    pub(super) fn release(&mut self, image: FieldView<'_, T>, right: FieldView<'_, T>) -> u64 {
        let released = self
            .blocks
            .par_iter_mut()
            .map(|constraints| {
                let mut released = 0;
                for constraint in constraints.iter_mut() {
                    let particle = constraint.particle();
                    let (image, right) = (image.get(particle), right.get(particle));
                    let impulse = std::array::from_fn(|axis| image[axis] - right[axis]);
                    released += u64::from(constraint.release(impulse));
                }
                constraints.retain(|constraint| !constraint.is_free());
                released
            })
            .sum();
        self.statistics.released += released;
        released
    }

    /// Friction of the contacts that slide, on the velocities of a block.
    pub(super) fn friction(
        &self,
        block: usize,
        masses: &Masses<T>,
        chunk: &mut MotionChunk<'_, T>,
    ) {
        for constraint in &self.blocks[block] {
            let particle = constraint.particle();
            let local = particle - block * BLOCK;
            let velocity = chunk.velocity.each_ref().map(|component| component[local]);
            let slowed = constraint.friction(velocity, masses.inverse[particle]);
            for axis in 0..3 {
                chunk.velocity[axis][local] = slowed[axis];
            }
        }
    }

    /// Counts since the last call.
    pub(super) fn statistics(&mut self) -> ConstraintStatistics {
        std::mem::take(&mut self.statistics)
    }
}

/// One block, compiled for each instruction set.
struct DetectionTask<'a, 'b, T> {
    detection: &'a Detection<'a, T>,
    start: usize,
    constraints: &'b mut Vec<Constraint<T>>,
}

impl<T: Real> NullaryFnOnce for DetectionTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { detection, start, constraints } = self;
        let end = (start + BLOCK).min(detection.count);
        for first in (start..end).step_by(LANES) {
            for collider in detection.colliders {
                detection.packet(collider, first, constraints);
            }
        }
    }
}

impl<T: Real> Detection<'_, T> {
    #[inline(always)]
    fn packet(&self, collider: &ColliderAt<T>, first: usize, constraints: &mut Vec<Constraint<T>>) {
        let position = self.position.packet(first as isize);
        let velocity = self.velocity.packet(first as isize);
        let inverse_mass = lanes(&self.masses.inverse, first);
        let depths = collider.depths(lanes(self.offsets, first), inverse_mass, position);
        let mut approach = [T::ZERO; LANES];
        for axis in 0..3 {
            for lane in 0..LANES {
                let v = velocity[axis][lane];
                let predicted =
                    v + self.length * (self.acceleration[axis] - self.drag_rate[axis] * v);
                approach[lane] += depths.normals[axis][lane] * predicted;
            }
        }
        let mut touches = false;
        for lane in 0..LANES {
            touches |= depths.depth[lane] > self.length * approach[lane];
        }
        if !touches {
            return;
        }
        for lane in 0..LANES.min(self.count - first) {
            let inside = depths.depth[lane] > self.length * approach[lane];
            if inside && inverse_mass[lane] > T::ZERO {
                let normal = depths.normals.map(|component| component[lane]);
                let x = position.map(|component| component[lane]);
                let v = velocity.map(|component| component[lane]);
                let touch = self.touch(collider, (depths.depth[lane], normal), x, v);
                add(constraints, (first + lane) as u32, touch);
            }
        }
    }

    /// The contact of a particle at x with velocity v.
    fn touch(
        &self,
        collider: &ColliderAt<T>,
        (depth, normal): (T, [T; 3]),
        x: [T; 3],
        v: [T; 3],
    ) -> Touch<T> {
        let surface = collider.velocity_at(x);
        let surface_speed = dot(surface, normal);
        let approach = dot(v, normal) - surface_speed;
        let mut speed = (depth / self.length).minimum(surface_speed);
        if approach < T::ZERO && collider.restitution() > T::ZERO {
            speed = speed.maximum(surface_speed - collider.restitution() * approach);
        }
        let mut relative = [T::ZERO; 3];
        for axis in 0..3 {
            let predicted =
                v[axis] + self.length * (self.acceleration[axis] - self.drag_rate[axis] * v[axis]);
            relative[axis] = predicted - surface[axis];
        }
        let across = dot(relative, normal);
        let mut slip = [T::ZERO; 3];
        for axis in 0..3 {
            slip[axis] = relative[axis] - across * normal[axis];
        }
        let push = speed - (across + surface_speed);
        let sticks = dot(slip, slip).sqrt() <= collider.friction() * push;
        Touch { normal, speed, surface, friction: collider.friction(), sticks }
    }
}

/// Adds a contact; the list is sorted by particles.
fn add<T: Real>(constraints: &mut Vec<Constraint<T>>, particle: u32, touch: Touch<T>) {
    match constraints.binary_search_by_key(&particle, Constraint::particle_index) {
        Ok(place) => constraints[place].add(touch),
        Err(place) => constraints.insert(place, Constraint::new(particle, touch)),
    }
}
