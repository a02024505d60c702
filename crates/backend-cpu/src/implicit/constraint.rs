//! The constraint of one particle.

use cloth_core::Real;

use super::matrix::Symmetric;
use crate::vector::{dot, sub};

/// A normal that has less than this outside of the directions constrained already adds nothing.
const DIRECTION_MIN: f64 = 1e-3;

/// Slower slip \[m/s\] counts as this much, so that drags stay finite.
pub(super) const SLIP_MIN: f64 = 1e-4;

/// Friction this far from its value, relative to it, is corrected ...
const DRAG_ERROR: f64 = 0.1;

/// ... if that is more than a free particle needs for this change of velocity \[m/s\].
const SLIP_ERROR: f64 = 3e-4;

/// Contacts that count for a particle. Three are not enough: normals that nearly agree leave a direction
/// for a fourth.
const TOUCHES_MAX: usize = 4;

/// Contact with one collider.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Touch<T> {
    /// Which one.
    pub(super) collider: u32,
    pub(super) normal: [T; 3],
    /// Velocity along the normal \[m/s\].
    pub(super) speed: T,
    /// Velocity of the collider \[m/s\].
    pub(super) surface: [T; 3],
    pub(super) friction: T,
    /// Whether friction holds the particle.
    pub(super) sticks: bool,
    /// Friction as a drag along the surface \[kg\], if the contact slides.
    pub(super) drag: T,
}

/// A particle after a solve.
pub(super) struct SolvedParticle<T> {
    /// Of the constraint, lambda \[N s\].
    pub(super) impulse: [T; 3],
    /// At the end of the substep \[m/s\].
    pub(super) velocity: [T; 3],
    /// \[kg\]
    pub(super) mass: T,
    /// D \[kg\].
    pub(super) inertia: Symmetric<T>,
}

/// What a solve says of a contact.
enum Verdict<T> {
    Stands,
    /// It slides with this drag.
    Drag(T),
    /// It does not stick any more, but slides with this drag.
    Slips(T),
    Pulls,
}

impl<T: Real> Touch<T> {
    fn verdict(&self, solved: &SolvedParticle<T>) -> Verdict<T> {
        let push = dot(solved.impulse, self.normal);
        if push < T::ZERO {
            return Verdict::Pulls;
        }
        let grip = self.friction * push;
        if self.sticks {
            let (along, direction) = self.tangential(solved.impulse);
            if along <= grip {
                return Verdict::Stands;
            }
            // What the drag is if nothing but this particle starts to move.
            let inertia = dot(direction, symmetric_apply(&solved.inertia, direction));
            return Verdict::Slips(grip * inertia / (along - grip));
        }
        let (slip, _) = self.tangential(sub(solved.velocity, self.surface));
        let slip = slip.maximum(T::from_f64(SLIP_MIN));
        let drag = grip / slip;
        let error = (drag - self.drag).abs() * slip;
        let negligible = solved.mass * T::from_f64(SLIP_ERROR);
        if error > (T::from_f64(DRAG_ERROR) * grip).maximum(negligible) {
            Verdict::Drag(drag)
        } else {
            Verdict::Stands
        }
    }

    /// c P, for the drag c of a contact that slides and P the projector on its plane.
    pub(super) fn drag_block(&self) -> Symmetric<T> {
        let (drag, [x, y, z]) = (self.drag, self.normal);
        [
            drag * (T::ONE - x * x),
            drag * (T::ONE - y * y),
            drag * (T::ONE - z * z),
            -(drag * (x * y)),
            -(drag * (x * z)),
            -(drag * (y * z)),
        ]
    }

    /// The part of an impulse that is this contact's, which was the last to add directions, and added
    /// these.
    fn share(&self, directions: &[[T; 3]], impulse: [T; 3]) -> [T; 3] {
        let mut share = [T::ZERO; 3];
        if self.sticks {
            for direction in directions {
                let along = dot(impulse, *direction);
                for axis in 0..3 {
                    share[axis] += along * direction[axis];
                }
            }
        } else if let [direction] = directions {
            let push = dot(impulse, *direction) / dot(self.normal, *direction);
            let across = dot(impulse, self.normal);
            let push = push.minimum(across + across).maximum(T::ZERO);
            share = self.normal.map(|component| push * component);
        }
        share
    }

    /// Length and direction of what a vector has along the surface.
    fn tangential(&self, vector: [T; 3]) -> (T, [T; 3]) {
        let across = dot(vector, self.normal);
        let along: [T; 3] = std::array::from_fn(|axis| vector[axis] - across * self.normal[axis]);
        let length = dot(along, along).sqrt();
        (length, along.map(|component| component / length.maximum(T::LENGTH_MIN)))
    }
}

/// The filter S and the target velocity of one particle, and the contacts they come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constraint<T> {
    particle: u32,
    touches: [Touch<T>; TOUCHES_MAX],
    count: u8,
    /// S, as xx, yy, zz, xy, xz, yz.
    filter: Symmetric<T>,
    /// The velocity in the constrained directions \[m/s\].
    target: [T; 3],
}

impl<T: Real> Constraint<T> {
    pub(super) fn new(particle: u32, touch: Touch<T>) -> Self {
        let mut constraint = Self {
            particle,
            touches: [Touch::default(); TOUCHES_MAX],
            count: 0,
            filter: identity(),
            target: [T::ZERO; 3],
        };
        constraint.add(touch);
        constraint
    }

    pub(super) const fn particle(&self) -> usize {
        self.particle as usize
    }

    pub(super) const fn particle_index(&self) -> u32 {
        self.particle
    }

    /// S, as xx, yy, zz, xy, xz, yz.
    pub(super) const fn filter(&self) -> Symmetric<T> {
        self.filter
    }

    pub(super) const fn is_free(&self) -> bool {
        self.count == 0
    }

    pub(super) fn touches(&self) -> &[Touch<T>] {
        &self.touches[..usize::from(self.count)]
    }

    /// Adds a contact, if there is a place for it.
    pub(super) fn add(&mut self, touch: Touch<T>) {
        if usize::from(self.count) < TOUCHES_MAX {
            self.touches[usize::from(self.count)] = touch;
            self.count += 1;
            self.update();
        }
    }

    /// S y.
    #[inline(always)]
    pub(super) fn apply(&self, y: [T; 3]) -> [T; 3] {
        symmetric_apply(&self.filter, y)
    }

    /// S y + z, for a particle with this velocity.
    pub(super) fn project(&self, y: [T; 3], velocity: [T; 3]) -> [T; 3] {
        let change = std::array::from_fn(|axis| self.target[axis] - velocity[axis]);
        let (free, filtered) = (self.apply(y), self.apply(change));
        std::array::from_fn(|axis| free[axis] + (change[axis] - filtered[axis]))
    }

    /// Releases the last contact that pulls, or lets the last one slide that slips, or corrects the
    /// drag of those that slide. Returns whether anything changed.
    pub(super) fn release(&mut self, solved: &SolvedParticle<T>) -> bool {
        let mut changed = false;
        for index in (0..usize::from(self.count)).rev() {
            let touch = &mut self.touches[index];
            match touch.verdict(solved) {
                Verdict::Stands => {}
                Verdict::Drag(drag) => {
                    touch.drag = drag;
                    changed = true;
                }
                Verdict::Slips(drag) => {
                    touch.sticks = false;
                    touch.drag = drag;
                    self.update();
                    return true;
                }
                Verdict::Pulls => {
                    self.touches.copy_within(index + 1.., index);
                    self.count -= 1;
                    self.update();
                    return true;
                }
            }
        }
        changed
    }

    /// Filter and target from the contacts.
    fn update(&mut self) {
        let mut span = Span::new();
        for touch in self.touches() {
            span.add_touch(touch);
        }
        self.target = span.target;
        self.filter = span.complement();
    }

    /// What each contact does to a particle that ends the substep with this velocity, from A y - b
    /// (NUMERICS §5, `constraint_impulses`).
    pub(super) fn impulses(&self, excess: [T; 3], velocity: [T; 3]) -> [[T; 3]; TOUCHES_MAX] {
        let touches = self.touches();
        // Where the directions of each contact begin.
        let mut first = [0; TOUCHES_MAX + 1];
        let mut span = Span::new();
        if touches.len() > 1 {
            for (index, touch) in touches.iter().enumerate() {
                span.add_touch(touch);
                first[index + 1] = span.count;
            }
        }
        let mut rest = excess;
        let mut impulses = [[T::ZERO; 3]; TOUCHES_MAX];
        for index in (1..touches.len()).rev() {
            let own = &span.directions[first[index]..first[index + 1]];
            impulses[index] = touches[index].share(own, rest);
            rest = sub(rest, impulses[index]);
        }
        impulses[0] = rest;
        for (impulse, touch) in impulses.iter_mut().zip(touches) {
            if touch.drag > T::ZERO {
                let slip = sub(velocity, touch.surface);
                *impulse = sub(*impulse, symmetric_apply(&touch.drag_block(), slip));
            }
        }
        impulses
    }
}

/// Directions that are constrained, orthonormal, and the velocity in them.
struct Span<T> {
    directions: [[T; 3]; 3],
    count: usize,
    target: [T; 3],
}

impl<T: Real> Span<T> {
    const fn new() -> Self {
        Self { directions: [[T::ZERO; 3]; 3], count: 0, target: [T::ZERO; 3] }
    }

    /// Constrains what a contact constrains.
    fn add_touch(&mut self, touch: &Touch<T>) {
        self.add(touch.normal, touch.speed);
        if touch.sticks {
            let extra = touch.speed - dot(touch.surface, touch.normal);
            for axis in 0..3 {
                let mut direction = [T::ZERO; 3];
                direction[axis] = T::ONE;
                self.add(direction, touch.surface[axis] + extra * touch.normal[axis]);
            }
        }
    }

    /// Constrains the velocity along a direction as far as it is free.
    fn add(&mut self, direction: [T; 3], speed: T) {
        if self.count == 3 {
            return;
        }
        let mut rest = direction;
        for taken in &self.directions[..self.count] {
            let along = dot(*taken, direction);
            for axis in 0..3 {
                rest[axis] -= along * taken[axis];
            }
        }
        let length = dot(rest, rest).sqrt();
        if length < T::from_f64(DIRECTION_MIN) {
            return;
        }
        let unit = rest.map(|component| component / length);
        let missing = (speed - dot(direction, self.target)) / length;
        for axis in 0..3 {
            self.target[axis] += missing * unit[axis];
        }
        self.directions[self.count] = unit;
        self.count += 1;
    }

    /// The projector on what is free.
    fn complement(&self) -> Symmetric<T> {
        if self.count == 3 {
            return [T::ZERO; 6];
        }
        let mut filter = identity();
        for [x, y, z] in &self.directions[..self.count] {
            let (x, y, z) = (*x, *y, *z);
            let outer = [x * x, y * y, z * z, x * y, x * z, y * z];
            for (entry, outer) in filter.iter_mut().zip(outer) {
                *entry -= outer;
            }
        }
        filter
    }
}

fn identity<T: Real>() -> Symmetric<T> {
    [T::ONE, T::ONE, T::ONE, T::ZERO, T::ZERO, T::ZERO]
}

/// Product of a symmetric 3 x 3 matrix with a vector.
#[inline(always)]
pub(super) fn symmetric_apply<T: Real>(
    [xx, yy, zz, xy, xz, yz]: &Symmetric<T>,
    [x, y, z]: [T; 3],
) -> [T; 3] {
    [*xx * x + *xy * y + *xz * z, *xy * x + *yy * y + *yz * z, *xz * x + *yz * y + *zz * z]
}
