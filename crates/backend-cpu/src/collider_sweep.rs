//! NUMERICS §7: particles that a collider would pass within a substep.

use cloth_core::Real;

use crate::{
    collider_response::SignedDistance,
    memory::Lanes,
    vector::{cross, dot, sub},
};

/// Looks at a path at most.
const LOOKS_MAX: u32 = 1024;

/// Where the particles of a packet were at the start of a substep, and its length.
#[derive(Clone, Copy)]
pub(crate) struct PathStart<'a, T> {
    pub(crate) position: [&'a Lanes<T>; 3],
    pub(crate) length: T,
}

/// How a collider moves.
#[derive(Clone, Copy)]
pub(crate) struct Carrier<T> {
    pub(crate) translation: [T; 3],
    pub(crate) linear_velocity: [T; 3],
    pub(crate) angular_velocity: [T; 3],
}

/// The way of a particle as the collider sees it, relative to its origin at the end of the substep.
#[derive(Clone, Copy)]
pub(crate) struct Path<T> {
    start: [T; 3],
    way: [T; 3],
    length_squared: T,
}

/// Where a path comes to a surface, relative to the origin of the collider.
pub(crate) struct Hit<T> {
    pub(crate) point: [T; 3],
    pub(crate) distance: T,
    pub(crate) normal: [T; 3],
    pub(crate) speed: T,
}

impl<T: Real> Carrier<T> {
    /// The path of a particle that is at `end` after `length` \[s\].
    #[inline(always)]
    pub(crate) fn path(&self, start: [T; 3], end: [T; 3], length: T) -> Path<T> {
        let half = T::from_f64(0.5) * length;
        let mut arm = sub(start, self.translation);
        for axis in 0..3 {
            arm[axis] += length * self.linear_velocity[axis];
        }
        let turning = cross(self.angular_velocity, arm);
        let again = cross(self.angular_velocity, turning);
        let mut way = sub(end, self.translation);
        for axis in 0..3 {
            arm[axis] += length * (turning[axis] + half * again[axis]);
            way[axis] -= arm[axis];
        }
        Path { start: arm, way, length_squared: dot(way, way) }
    }
}

impl<T: Real> Path<T> {
    /// Whether it is long enough to lead through a surface and on to `distance` from it.
    #[inline(always)]
    pub(crate) fn can_pass(&self, distance: T) -> bool {
        self.length_squared > distance * distance
    }

    /// Where it comes to a surface from outside, if it goes on through. `end` is the normal at its end if the particle
    /// touches there.
    #[cold]
    #[inline(never)]
    pub(crate) fn hit(
        &self,
        shape: &impl SignedDistance<T>,
        end: Option<[T; 3]>,
    ) -> Option<Hit<T>> {
        let share = shape.safe_share()?;
        let length = self.length_squared.sqrt();
        let inverse = T::ONE / length;
        let direction = self.way.map(|component| component * inverse);
        let near = length * T::from_f64(1.0 / 1024.0);
        let mut gone = T::ZERO;
        for look in 0..LOOKS_MAX {
            let mut point = self.start;
            for axis in 0..3 {
                point[axis] += gone * direction[axis];
            }
            let (distance, normal, speed) = shape.distance(point);
            // NaN is not outside.
            let is_outside = distance >= T::ZERO;
            if look == 0 && !is_outside {
                return None;
            }
            if distance <= near {
                let passes = end.is_none_or(|end| dot(end, normal) < T::ZERO);
                let is_hit = passes && dot(direction, normal) < T::ZERO;
                return is_hit.then_some(Hit { point, distance, normal, speed });
            }
            gone += share * distance;
            let is_on_the_way = gone < length;
            if !is_on_the_way {
                return None;
            }
        }
        None
    }
}
