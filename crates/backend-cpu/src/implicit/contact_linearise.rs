//! NUMERICS §5, `contact_linearise`: the pairs in contact as part of the matrix.

use cloth_core::Real;

use crate::{
    contact::{
        Contact,
        response::{Penalty, pair_normal},
    },
    spring_forces::MotionView,
};

/// Direction and weight of each pair in contact, kept for both of its particles.
#[derive(Debug)]
pub(super) struct ContactFactors<T> {
    /// Where the pairs of each particle start, length n + 1; empty while no pair is in contact.
    offsets: Vec<u32>,
    partners: Vec<u32>,
    u: Vec<[T; 3]>,
    /// The share of u u^T that comes from the stiffness, rho.
    stiffness_share: T,
}

/// One pair, seen from one of its particles.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactFactor<T> {
    pub(super) partner: usize,
    pub(super) u: [T; 3],
}

impl<T: Real> ContactFactors<T> {
    pub(super) const fn new() -> Self {
        Self { offsets: Vec::new(), partners: Vec::new(), u: Vec::new(), stiffness_share: T::ZERO }
    }

    /// Forgets all pairs.
    pub(super) fn clear(&mut self) {
        self.offsets.clear();
        self.partners.clear();
        self.u.clear();
    }

    /// Takes in the pairs in contact now, for a substep of `length` \[s\].
    pub(super) fn fill(
        &mut self,
        contact: &Contact<T>,
        penalty: Penalty<T>,
        motion: MotionView<'_, T>,
        particles: usize,
        length: T,
    ) {
        self.clear();
        if !contact.any() {
            return;
        }
        let stiffness = length * penalty.stiffness;
        self.stiffness_share = stiffness / (stiffness + penalty.damping);
        let root = (length * (stiffness + penalty.damping)).sqrt();
        for particle in 0..particles {
            self.offsets.push(self.partners.len() as u32);
            for &partner in contact.partners(particle) {
                if let Some(normal) = pair_normal(motion, particle, partner as usize) {
                    self.partners.push(partner);
                    self.u.push(normal.map(|component| root * component));
                }
            }
        }
        self.offsets.push(self.partners.len() as u32);
    }

    /// Whether there is no pair.
    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.partners.is_empty()
    }

    pub(super) const fn stiffness_share(&self) -> T {
        self.stiffness_share
    }

    /// The pairs of a particle, partners ascending.
    #[inline(always)]
    pub(super) fn of(&self, particle: usize) -> impl Iterator<Item = ContactFactor<T>> + '_ {
        let range = if self.is_empty() {
            0..0
        } else {
            self.offsets[particle] as usize..self.offsets[particle + 1] as usize
        };
        range.map(|pair| ContactFactor { partner: self.partners[pair] as usize, u: self.u[pair] })
    }
}
