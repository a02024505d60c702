//! NUMERICS §8: contact of the cloths with themselves and each other.
//!
//! Particles are sorted once, by recursive bisection of the rest shape, into [`groups`] that lie close
//! together on the cloth and so move together. The [`broad_phase`] puts the boxes around groups into
//! a spatial hash and lists, for each group, all groups that are near; the [`motion_bound`] proves
//! how long that list stays complete. The [`narrow_phase`] finds the pairs of particles in contact in
//! every substep, by a [`comparison`] of those groups of the list that can have come close enough
//! since they were last compared. [`response`] has the two answers to contact.

mod bounds;
mod broad_phase;
mod comparison;
mod groups;
mod motion_bound;
mod narrow_phase;
pub(crate) mod response;

use cloth_core::{ContactResponse, ContactStatistics, Model, Real};

use self::{
    broad_phase::BroadPhase, groups::Groups, motion_bound::MotionBound, narrow_phase::ContactList,
};
use crate::memory::VectorField;

/// Search for contacts, and the contacts found.
#[derive(Debug)]
pub(crate) struct Contact<T> {
    groups: Groups<T>,
    broad_phase: BroadPhase<T>,
    motion_bound: MotionBound<T>,
    contacts: ContactList,
    distance: T,
    response: ContactResponse,
    statistics: ContactStatistics,
}

impl<T: Real> Contact<T> {
    /// The search for a model, if it has self-contact.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let contact = model.self_contact().filter(|contact| !contact.is_of_triangles())?;
        let distance = T::from_f64(contact.distance);
        let groups = Groups::new(model, contact.excludes_neighbours());
        Some(Self {
            broad_phase: BroadPhase::new(groups.cluster_count()),
            motion_bound: MotionBound::new(groups.cluster_count(), distance),
            contacts: ContactList::new(model, &groups),
            groups,
            distance,
            response: contact.response,
            statistics: ContactStatistics::default(),
        })
    }

    /// Finds all pairs in contact at these positions.
    pub(crate) fn update(&mut self, model: &Model, position: &VectorField<T>, arch: pulp::Arch) {
        self.groups.refit(position, arch);
        if !self.motion_bound.list_is_complete(&self.groups) {
            let reach = self.motion_bound.reach();
            self.broad_phase.build(&self.groups, reach, arch);
            self.motion_bound.list_was_built(&self.groups);
            self.statistics.rebuilds += 1;
        }
        self.contacts.find(model, &self.groups, &mut self.broad_phase, self.distance, arch);
    }

    /// Whether any particle of the packet that starts at particle `first` is in contact.
    #[inline(always)]
    pub(crate) fn any_in_packet(&self, first: usize) -> bool {
        self.contacts.any_in_packet(first)
    }

    /// The particles in contact with `particle`, ascending.
    #[inline(always)]
    pub(crate) fn partners(&self, particle: usize) -> &[u32] {
        self.contacts.partners(self.groups.place(particle))
    }

    /// The contact distance \[m\].
    pub(crate) const fn distance(&self) -> T {
        self.distance
    }

    pub(crate) const fn response(&self) -> ContactResponse {
        self.response
    }

    /// Whether any pair is in contact.
    pub(crate) fn any(&self) -> bool {
        self.contacts.pair_count() > 0
    }

    /// Counts since the last call.
    pub(crate) fn statistics(&mut self) -> ContactStatistics {
        ContactStatistics {
            contacts: self.contacts.pair_count(),
            candidates: self.broad_phase.pair_count(),
            ..std::mem::take(&mut self.statistics)
        }
    }
}
