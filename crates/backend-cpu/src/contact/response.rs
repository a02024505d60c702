//! What contact does: `contact_forces` and `contact_impulses`.

use cloth_core::Real;

use super::Contact;
use crate::{spring_forces::MotionView, vector::dot};

/// Pairs closer than this square \[m^2\] have no normal.
const LENGTH_SQUARED_MIN: f64 = 1e-14;

/// Coefficients of the penalty response.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Penalty<T> {
    /// \[N/m\]
    pub(crate) stiffness: T,
    /// \[N s/m\]
    pub(crate) damping: T,
}

/// Coefficients of the impulse response.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Impulse<T> {
    pub(crate) restitution: T,
    pub(crate) friction: T,
    /// Share of an overlap that is taken back in this substep.
    pub(crate) recovery: T,
}

/// Penalty force on a particle \[N\], `None` if it is not in contact.
#[inline(always)]
pub(crate) fn force<T: Real>(
    contact: &Contact<T>,
    penalty: Penalty<T>,
    motion: MotionView<'_, T>,
    particle: usize,
) -> Option<[T; 3]> {
    let partners = contact.partners(particle);
    if partners.is_empty() {
        return None;
    }
    let mut sum = [T::ZERO; 3];
    for &partner in partners {
        let pair = Pair::new(motion, particle, partner as usize);
        if let Some(normal) = pair.normal() {
            let scale = penalty.stiffness * (contact.distance() - pair.length)
                - penalty.damping * dot(pair.velocity, normal);
            for axis in 0..3 {
                sum[axis] += scale * normal[axis];
            }
        }
    }
    Some(sum)
}

/// Change of velocity \[m/s\] and of position \[m\] of a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Change<T> {
    pub(crate) velocity: [T; 3],
    pub(crate) position: [T; 3],
}

/// Change of a particle by all its contacts, `None` if it is not in contact.
#[inline(always)]
pub(crate) fn impulse<T: Real>(
    contact: &Contact<T>,
    coefficients: Impulse<T>,
    motion: MotionView<'_, T>,
    inverse_mass: &[T],
    particle: usize,
) -> Option<Change<T>> {
    let partners = contact.partners(particle);
    if partners.is_empty() {
        return None;
    }
    let own = inverse_mass[particle];
    let rebound = T::ONE + coefficients.restitution;
    let mut change = Change::default();
    for &partner in partners {
        let partner = partner as usize;
        let pair = Pair::new(motion, particle, partner);
        let (Some(normal), total) = (pair.normal(), own + inverse_mass[partner]) else { continue };
        if total == T::ZERO {
            continue;
        }
        let crowd = partners.len().max(contact.partners(partner).len());
        let share = own / total / T::from_f64(crowd as f64);
        let approach = dot(pair.velocity, normal);
        let overlap = coefficients.recovery * (contact.distance() - pair.length);
        let mut tangential = [T::ZERO; 3];
        for axis in 0..3 {
            tangential[axis] = pair.velocity[axis] - approach * normal[axis];
        }
        let speed = dot(tangential, tangential).sqrt();
        let lost =
            coefficients.friction * (rebound * approach.abs()) / speed.maximum(T::LENGTH_MIN);
        let lost = lost.minimum(T::ONE);
        for axis in 0..3 {
            if approach < T::ZERO {
                change.velocity[axis] -=
                    share * (rebound * approach * normal[axis] + lost * tangential[axis]);
            }
            change.position[axis] += share * overlap * normal[axis];
        }
    }
    Some(change)
}

/// Unit vector from `j` to `i`, if they are not at the same place.
#[inline(always)]
pub(crate) fn pair_normal<T: Real>(
    motion: MotionView<'_, T>,
    i: usize,
    j: usize,
) -> Option<[T; 3]> {
    Pair::new(motion, i, j).normal()
}

/// Two particles in contact, seen from the first.
struct Pair<T> {
    difference: [T; 3],
    velocity: [T; 3],
    length_squared: T,
    length: T,
}

impl<T: Real> Pair<T> {
    #[inline(always)]
    fn new(motion: MotionView<'_, T>, i: usize, j: usize) -> Self {
        let [i, j] = [motion.margin + i, motion.margin + j];
        let difference = motion.x.map(|component| component[i] - component[j]);
        let velocity = motion.v.map(|component| component[i] - component[j]);
        let length_squared = dot(difference, difference);
        Self { difference, velocity, length_squared, length: length_squared.sqrt() }
    }

    #[inline(always)]
    fn normal(&self) -> Option<[T; 3]> {
        let inverse = T::ONE / self.length;
        (self.length_squared > T::from_f64(LENGTH_SQUARED_MIN))
            .then(|| self.difference.map(|component| component * inverse))
    }
}
