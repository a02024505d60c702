//! NUMERICS §5: what colliders demand of velocities, `collider_constraints`, how contacts come and go,
//! `constraint_release`, and what they do, `constraint_impulses`.

use cloth_core::{ColliderImpulse, ConstraintStatistics, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    constraint::{Constraint, SLIP_MIN, SolvedParticle, Touch, symmetric_apply},
    matrix::Matrix,
};
use crate::{
    block_impulses::BlockImpulses,
    collider_response::ColliderAt,
    memory::{BLOCK, FieldView, LANES, Masses, VectorField, lanes},
    vector::{dot, sub},
};

/// All constraints, by blocks of [`BLOCK`] particles, particles ascending.
#[derive(Debug)]
pub(crate) struct Constraints<T> {
    blocks: Vec<Vec<Constraint<T>>>,
    statistics: ConstraintStatistics,
}

/// A solve, as contacts look at it.
pub(super) struct Solve<'a, T> {
    /// A y.
    pub(super) image: FieldView<'a, T>,
    pub(super) solution: FieldView<'a, T>,
    /// The velocities that the solution changes.
    pub(super) velocity: FieldView<'a, T>,
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

    /// Adds the drag of the contacts that slide to matrix and right-hand side.
    pub(super) fn drag(
        &self,
        velocity: FieldView<'_, T>,
        matrix: &mut Matrix<T>,
        right_side: &mut VectorField<T>,
    ) {
        for constraint in self.iter() {
            let velocity = velocity.get(constraint.particle());
            drag_add(constraint, T::ONE, velocity, matrix, right_side);
        }
    }

    /// Changes the contacts that pull, slip, or slide with a drag that is not theirs. Returns how many.
    pub(super) fn release(
        &mut self,
        solve: &Solve<'_, T>,
        masses: &Masses<T>,
        matrix: &mut Matrix<T>,
        right_side: &mut VectorField<T>,
    ) -> u64 {
        let mut changed = 0;
        for constraint in self.blocks.iter_mut().flatten() {
            let particle = constraint.particle();
            let velocity = solve.velocity.get(particle);
            let (image, right) = (solve.image.get(particle), right_side.get(particle));
            let (change, before) = (solve.solution.get(particle), *constraint);
            let outcome = SolvedParticle {
                impulse: std::array::from_fn(|axis| image[axis] - right[axis]),
                velocity: std::array::from_fn(|axis| velocity[axis] + change[axis]),
                mass: masses.mass[particle],
                inertia: matrix.diagonal.get(particle),
            };
            if constraint.release(&outcome) {
                drag_add(&before, -T::ONE, velocity, matrix, right_side);
                drag_add(constraint, T::ONE, velocity, matrix, right_side);
                changed += 1;
            }
        }
        self.blocks.iter_mut().for_each(|block| block.retain(|constraint| !constraint.is_free()));
        self.statistics.released += changed;
        changed
    }

    /// Adds what the contacts did to the sums of colliders, block by block. Without an image the
    /// solution is zero.
    pub(super) fn impulses(
        &self,
        (image, right_side): (Option<FieldView<'_, T>>, FieldView<'_, T>),
        (position, velocity): (FieldView<'_, T>, FieldView<'_, T>),
        sums: &mut BlockImpulses,
    ) {
        let blocks = self.blocks.par_iter().zip(sums.blocks_mut());
        blocks.for_each(|(constraints, sums)| {
            let Some(sums) = sums else { return };
            for constraint in constraints {
                let particle = constraint.particle();
                let image = image.map_or([T::ZERO; 3], |image| image.get(particle));
                let excess = sub(image, right_side.get(particle));
                let impulses = constraint.impulses(excess, velocity.get(particle));
                let at = position.get(particle).map(T::to_f64);
                for (touch, impulse) in constraint.touches().iter().zip(impulses) {
                    let linear = impulse.map(T::to_f64);
                    sums[touch.collider as usize] += ColliderImpulse::at(at, linear);
                }
            }
        });
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
            for number in 0..detection.colliders.len() {
                detection.packet(number, first, constraints);
            }
        }
    }
}

impl<T: Real> Detection<'_, T> {
    #[inline(always)]
    fn packet(&self, number: usize, first: usize, constraints: &mut Vec<Constraint<T>>) {
        let collider = &self.colliders[number];
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
                let mass = self.masses.mass[first + lane];
                let contact = (depths.depth[lane], normal, depths.speeds[lane]);
                let touch = self.touch(number, contact, mass, x, v);
                add(constraints, (first + lane) as u32, touch);
            }
        }
    }

    /// The contact of a particle of some mass at x with velocity v.
    fn touch(
        &self,
        number: usize,
        (depth, normal, speed): (T, [T; 3], T),
        mass: T,
        x: [T; 3],
        v: [T; 3],
    ) -> Touch<T> {
        let collider = &self.colliders[number];
        let mut surface = collider.velocity_at(x);
        for axis in 0..3 {
            surface[axis] += speed * normal[axis];
        }
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
        let friction = collider.friction();
        let (slip, grip) = (dot(slip, slip).sqrt(), friction * push);
        let sticks = slip <= grip;
        // The fields may pull it off, which no friction resists.
        let left = (slip - grip).maximum(T::from_f64(SLIP_MIN));
        let drag = if sticks { T::ZERO } else { (mass * grip / left).maximum(T::ZERO) };
        Touch { collider: number as u32, normal, speed, surface, friction, sticks, drag }
    }
}

/// Adds c P to B and D and -c P (v - u) to b, for the drag c of each contact times `sign` and P the
/// projector on its plane.
fn drag_add<T: Real>(
    constraint: &Constraint<T>,
    sign: T,
    velocity: [T; 3],
    matrix: &mut Matrix<T>,
    right_side: &mut VectorField<T>,
) {
    let particle = constraint.particle();
    for touch in constraint.touches().iter().filter(|touch| touch.drag > T::ZERO) {
        let plane = touch.drag_block().map(|entry| sign * entry);
        matrix.base.add(particle, plane);
        matrix.diagonal.add(particle, plane);
        let slip = symmetric_apply(&plane, sub(velocity, touch.surface));
        right_side.set(particle, sub(right_side.get(particle), slip));
    }
}

/// Adds a contact; the list is sorted by particles.
fn add<T: Real>(constraints: &mut Vec<Constraint<T>>, particle: u32, touch: Touch<T>) {
    match constraints.binary_search_by_key(&particle, Constraint::particle_index) {
        Ok(place) => constraints[place].add(touch),
        Err(place) => constraints.insert(place, Constraint::new(particle, touch)),
    }
}
