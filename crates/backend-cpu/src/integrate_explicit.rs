//! NUMERICS §4: symplectic Euler.

use cloth_core::Real;

use crate::memory::{LANES, Lanes, PacketMotion};

/// Advances a packet by `length` \[s\].
#[inline(always)]
pub(crate) fn packet<T: Real>(
    length: T,
    inverse_mass: &Lanes<T>,
    force: &[Lanes<T>; 3],
    position: [&Lanes<T>; 3],
    velocity: [&Lanes<T>; 3],
) -> PacketMotion<T> {
    let mut result =
        PacketMotion { position: [[T::ZERO; LANES]; 3], velocity: [[T::ZERO; LANES]; 3] };
    for axis in 0..3 {
        for lane in 0..LANES {
            let rate = velocity[axis][lane] + length * inverse_mass[lane] * force[axis][lane];
            result.velocity[axis][lane] = rate;
            result.position[axis][lane] = position[axis][lane] + length * rate;
        }
    }
    result
}
