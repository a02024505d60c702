//! Which particles are in contact: comparison of near groups, particle by particle.
//!
//! A comparison that finds two groups apart also tells by how much, their clearance. They need not
//! be compared again before their particles can have moved towards each other by that; each substep
//! takes from it the largest relative displacement that the balls around the displacements of both
//! groups allow. So neighbouring groups of a cloth that moves smoothly are compared every few
//! substeps, groups in contact in every one.

use cloth_core::{Model, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    broad_phase::{BroadPhase, ClusterList},
    comparison::{closest_squared, list_pairs},
    groups::{CLUSTER, CLUSTER_PARTICLES, Groups},
};
use crate::{
    memory::{LANES, packets},
    vector::{dot, sub},
};

/// For each particle, by place, the particles in contact with it, ascending.
#[derive(Debug)]
pub(super) struct ContactList {
    clusters: Vec<ClusterContacts>,
    entries: u64,
    /// For each packet of particles, in their own order, whether any is in contact: the many that
    /// are not need only this one look.
    packets: Vec<bool>,
    /// Square of the largest distance at the start of two particles joined by a spring \[m^2\]:
    /// pairs beyond it need not be looked up among the springs.
    joined_squared: f64,
}

/// Entries up to which one thread sorts them faster than several can be woken.
const SORT_ALONE: u64 = 2048;

/// The contacts of the particles of one cluster.
#[derive(Clone, Debug, Default)]
struct ClusterContacts {
    /// Where the partners of each place begin and end; not kept up to date while there is none.
    offsets: Vec<u32>,
    partners: Vec<u32>,
    /// Pairs of places found, each once, the first in this cluster.
    found: Vec<[u32; 2]>,
    /// Place within the cluster and partner, each pair from both sides.
    pairs: Vec<(u32, u32)>,
}

impl ContactList {
    pub(super) fn new<T: Real>(model: &Model, groups: &Groups<T>) -> Self {
        let springs = model.springs().iter().map(|spring| spring.particles);
        let joined = springs.chain(model.elements().edges().iter().copied());
        let lengths = joined.map(|pair| start_squared(model, pair));
        Self {
            joined_squared: lengths.fold(0.0, f64::max),
            clusters: vec![ClusterContacts::default(); groups.cluster_count()],
            entries: 0,
            packets: vec![false; packets(groups.particle_count())],
        }
    }

    /// Finds all pairs closer than `distance`, less those that the model leaves out.
    pub(super) fn find<T: Real>(
        &mut self,
        model: &Model,
        groups: &Groups<T>,
        broad_phase: &mut BroadPhase<T>,
        distance: T,
        arch: pulp::Arch,
    ) {
        let leaves_out = groups.has_rest();
        let joined_squared = self.joined_squared;
        let lists = broad_phase.lists_mut();
        let clusters = self.clusters.par_iter_mut().zip(lists).enumerate();
        clusters.for_each(|(cluster, (contacts, list))| {
            contacts.pairs.clear();
            let found = &mut contacts.found;
            found.clear();
            arch.dispatch(FindTask { groups, list, cluster, distance, found });
            if leaves_out {
                found.retain(|places| {
                    let [a, b] = places.map(|place| groups.particle(place as usize));
                    start_squared(model, [a, b]) > joined_squared || !model.joins(a, b)
                });
            }
        });
        self.share_out(groups);
        self.entries = self.clusters.iter().map(|cluster| cluster.pairs.len() as u64).sum();
        if self.entries > SORT_ALONE {
            self.clusters.par_iter_mut().for_each(ClusterContacts::sort);
        } else {
            self.clusters.iter_mut().for_each(ClusterContacts::sort);
        }
    }

    /// Hands each pair to the clusters of both its particles. Pairs are few, and this is short.
    fn share_out<T: Real>(&mut self, groups: &Groups<T>) {
        self.packets.fill(false);
        for cluster in 0..self.clusters.len() {
            let found = std::mem::take(&mut self.clusters[cluster].found);
            for &[a, b] in &found {
                for [own, other] in [[a, b], [b, a]] {
                    let own = own as usize;
                    let partner = groups.particle(other as usize);
                    self.packets[partner as usize / LANES] = true;
                    self.clusters[own / CLUSTER_PARTICLES]
                        .pairs
                        .push(((own % CLUSTER_PARTICLES) as u32, partner));
                }
            }
            self.clusters[cluster].found = found;
        }
    }

    /// Whether any particle of the packet that starts at `first` is in contact.
    #[inline(always)]
    pub(super) fn any_in_packet(&self, first: usize) -> bool {
        self.packets[first / LANES]
    }

    /// The partners of the particle at a place.
    #[inline(always)]
    pub(super) fn partners(&self, place: usize) -> &[u32] {
        let cluster = &self.clusters[place / CLUSTER_PARTICLES];
        if cluster.partners.is_empty() {
            return &[];
        }
        let local = place % CLUSTER_PARTICLES;
        &cluster.partners[cluster.offsets[local] as usize..cluster.offsets[local + 1] as usize]
    }

    /// Unordered pairs in contact.
    pub(super) fn pair_count(&self) -> u64 {
        self.entries / 2
    }
}

impl ClusterContacts {
    /// Turns the pairs into lists, in an order that does not depend on how they were found.
    fn sort(&mut self) {
        self.partners.clear();
        if self.pairs.is_empty() {
            return;
        }
        self.pairs.sort_unstable();
        self.offsets.clear();
        self.offsets.resize(CLUSTER_PARTICLES + 1, 0);
        for &(place, partner) in &self.pairs {
            self.offsets[place as usize + 1] += 1;
            self.partners.push(partner);
        }
        for place in 0..CLUSTER_PARTICLES {
            self.offsets[place + 1] += self.offsets[place];
        }
    }
}

/// Square of the distance of two particles at the start \[m^2\].
fn start_squared(model: &Model, particles: [u32; 2]) -> f64 {
    let [a, b] = particles.map(|particle| model.positions()[particle as usize]);
    dot(sub(a, b), sub(a, b))
}

/// Finds all pairs of places closer than the contact distance whose first group is in one cluster.
struct FindTask<'a, T> {
    groups: &'a Groups<T>,
    list: &'a mut ClusterList<T>,
    cluster: usize,
    distance: T,
    found: &'a mut Vec<[u32; 2]>,
}

/// Particles up to this multiple of the contact distance are compared, so that groups that are a
/// little farther apart get a clearance worth having.
const LOOK: f64 = 1.5;

/// Share of a clearance that is used; the rest covers rounding in its computation.
const SAFETY: f64 = 0.999;

impl<T: Real> NullaryFnOnce for FindTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { groups, list, cluster, distance, found } = self;
        let (bounds, steps) = (groups.bounds(), groups.steps());
        let look = distance * T::from_f64(LOOK);
        let look_squared = look * look;
        let safety = T::from_f64(SAFETY);
        // Displacements are differences of rounded coordinates.
        let magnitude = groups.clusters()[cluster].position.magnitude();
        let rounding = T::from_f64(8.0) * T::EPSILON * (magnitude + look);
        let first = cluster * CLUSTER;
        for group in first..(first + CLUSTER).min(bounds.len()) {
            for candidate in list.candidates_mut(group - first) {
                let other = candidate.group as usize;
                let approach = steps[group].approach(&steps[other]) + rounding;
                candidate.clearance -= approach;
                if candidate.clearance > T::ZERO {
                    continue;
                }
                let gap_squared = bounds[group].gap_squared(&bounds[other]);
                let closest_squared = if gap_squared >= look_squared {
                    gap_squared
                } else {
                    let closest = closest_squared(groups, group, other, [distance, look]);
                    if closest < distance * distance {
                        list_pairs(groups, group, other, distance * distance, found);
                    }
                    closest
                };
                candidate.clearance = (closest_squared.sqrt() - distance) * safety;
            }
        }
    }
}
