//! The constraint of one particle.

use cloth_core::Real;

use super::matrix::Symmetric;
use crate::vector::dot;

/// A normal that has less than this outside of the directions constrained already adds nothing.
const DIRECTION_MIN: f64 = 1e-3;

/// Contacts that a particle can have at a time: no more directions are left.
const TOUCHES_MAX: usize = 3;

/// Contact with one collider.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Touch<T> {
    pub(super) normal: [T; 3],
    /// Velocity along the normal \[m/s\].
    pub(super) speed: T,
    /// Velocity of the collider \[m/s\].
    pub(super) surface: [T; 3],
    pub(super) friction: T,
    /// Whether friction holds the particle.
    pub(super) sticks: bool,
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
    /// Of the constraint, from the last solve \[N s\].
    impulse: [T; 3],
}

impl<T: Real> Constraint<T> {
    pub(super) fn new(particle: u32, touch: Touch<T>) -> Self {
        let mut constraint = Self {
            particle,
            touches: [Touch::default(); TOUCHES_MAX],
            count: 0,
            filter: identity(),
            target: [T::ZERO; 3],
            impulse: [T::ZERO; 3],
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

    fn touches(&self) -> &[Touch<T>] {
        &self.touches[..usize::from(self.count)]
    }

    /// Adds a contact. A fourth one finds all directions taken.
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

    /// Releases the last contact that pulls, or lets the last one slide that slips, under this
    /// impulse. Returns whether there was one.
    pub(super) fn release(&mut self, impulse: [T; 3]) -> bool {
        self.impulse = impulse;
        for index in (0..usize::from(self.count)).rev() {
            let touch = self.touches[index];
            let push = dot(impulse, touch.normal);
            if push < T::ZERO {
                self.touches.copy_within(index + 1.., index);
                self.count -= 1;
                self.update();
                return true;
            }
            let across: [T; 3] =
                std::array::from_fn(|axis| impulse[axis] - push * touch.normal[axis]);
            if touch.sticks && dot(across, across).sqrt() > touch.friction * push {
                self.touches[index].sticks = false;
                self.update();
                return true;
            }
        }
        false
    }

    /// The velocity after friction at the contacts that slide.
    pub(super) fn friction(&self, mut velocity: [T; 3], inverse_mass: T) -> [T; 3] {
        for touch in self.touches().iter().filter(|touch| !touch.sticks) {
            let push = dot(self.impulse, touch.normal).maximum(T::ZERO);
            let relative: [T; 3] = std::array::from_fn(|axis| velocity[axis] - touch.surface[axis]);
            let across = dot(relative, touch.normal);
            let slip: [T; 3] =
                std::array::from_fn(|axis| relative[axis] - across * touch.normal[axis]);
            let speed = dot(slip, slip).sqrt();
            let lost = (touch.friction * push * inverse_mass).minimum(speed)
                / speed.maximum(T::LENGTH_MIN);
            for axis in 0..3 {
                velocity[axis] -= lost * slip[axis];
            }
        }
        velocity
    }

    /// Filter and target from the contacts.
    fn update(&mut self) {
        let mut span = Span { directions: [[T::ZERO; 3]; 3], count: 0, target: [T::ZERO; 3] };
        for touch in self.touches() {
            span.add(touch.normal, touch.speed);
            if touch.sticks {
                let extra = touch.speed - dot(touch.surface, touch.normal);
                for axis in 0..3 {
                    let mut direction = [T::ZERO; 3];
                    direction[axis] = T::ONE;
                    span.add(direction, touch.surface[axis] + extra * touch.normal[axis]);
                }
            }
        }
        self.target = span.target;
        self.filter = span.complement();
    }
}

/// Directions that are constrained, orthonormal, and the velocity in them.
struct Span<T> {
    directions: [[T; 3]; 3],
    count: usize,
    target: [T; 3],
}

impl<T: Real> Span<T> {
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
