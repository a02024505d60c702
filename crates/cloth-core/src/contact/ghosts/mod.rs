//! Pinched cloth that is left inside of bodies (NUMERICS §15).

mod anchor;
mod guide;

pub use anchor::GhostAnchor;
pub(super) use anchor::anchors;
pub use guide::GhostGuide;

use crate::Real;

use super::{ContactStencil, UnprovenPair};

/// A particle that bodies have pinched. Its triangles are in nobody's way but that of cloth, until they are outside of all bodies again.
#[derive(Clone, Debug, PartialEq)]
pub struct Ghost {
    /// The particle.
    pub particle: u32,
    /// Whether it is held between the bodies, not free or where its owner has pinned it.
    pub is_guided: bool,
    /// Where it was between the bodies when they pinched it: one face, and one on the other side if there is any near.
    pub anchors: Vec<GhostAnchor>,
}

/// All ghosts.
#[derive(Clone, Debug, Default)]
pub(super) struct Ghosts {
    /// Ascending by particle.
    list: Vec<Ghost>,
    kept: Vec<Ghost>,
    /// For each particle; empty where there have never been any.
    is_ghost: Vec<bool>,
    particles: u32,
}

impl Ghosts {
    pub(super) fn new(particles: usize) -> Self {
        Self { particles: particles as u32, ..Self::default() }
    }

    pub(super) fn list(&self) -> &[Ghost] {
        &self.list
    }

    pub(super) fn set(&mut self, mut ghosts: Vec<Ghost>) {
        ghosts.sort_by_key(|ghost| ghost.particle);
        ghosts.dedup_by_key(|ghost| ghost.particle);
        self.list = ghosts;
        self.flags_set();
    }

    fn flags_set(&mut self) {
        self.is_ghost.clear();
        if !self.list.is_empty() {
            self.is_ghost.resize(self.particles as usize, false);
            for ghost in &self.list {
                if let Some(flag) = self.is_ghost.get_mut(ghost.particle as usize) {
                    *flag = true;
                }
            }
        }
    }

    pub(super) fn keep(&mut self) {
        self.kept.clone_from(&self.list);
    }

    pub(super) fn restore(&mut self) {
        self.list.clone_from(&self.kept);
        self.flags_set();
    }

    pub(super) fn is_ghost(&self, particle: u32) -> bool {
        self.is_ghost.get(particle as usize).copied().unwrap_or_default()
    }

    fn leave_out(&self, mut particles: impl Iterator<Item = u32> + Clone) -> bool {
        !self.list.is_empty()
            && particles.clone().any(|i| i >= self.particles)
            && particles.any(|i| self.is_ghost(i))
    }

    /// Whether a pair is one of a body and a ghost.
    pub(super) fn leave_out_pair(&self, pair: &UnprovenPair) -> bool {
        self.leave_out(pair.particles.into_iter())
    }

    /// Whether a contact is one of a body and a ghost.
    pub(super) fn leave_out_contact<T: Real>(&self, stencil: &ContactStencil<T>) -> bool {
        let all = stencil.particles.into_iter().zip(stencil.weights);
        self.leave_out(all.filter(|(_, weight)| *weight != T::ZERO).map(|(i, _)| i))
    }

    /// Makes ghosts of those that are particles, and none yet. Returns whether there was one.
    pub(super) fn add(
        &mut self,
        mut new: Vec<u32>,
        anchors: impl Fn(u32) -> Vec<GhostAnchor>,
    ) -> bool {
        new.retain(|&i| i < self.particles && !self.is_ghost(i));
        new.sort_unstable();
        new.dedup();
        let grows = !new.is_empty();
        let ghost = |particle| Ghost { particle, is_guided: false, anchors: anchors(particle) };
        let mut list = std::mem::take(&mut self.list);
        list.extend(new.into_iter().map(ghost));
        self.set(list);
        grows
    }
}
