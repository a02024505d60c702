//! Which particles are in contact: comparison of near groups, particle by particle.

use cloth_core::{Model, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    broad_phase::BroadPhase,
    groups::{CLUSTER, CLUSTER_PARTICLES, GROUP, Groups},
};

/// For each particle, by place, the particles in contact with it, ascending.
#[derive(Debug)]
pub(super) struct ContactList {
    clusters: Vec<ClusterContacts>,
    entries: u64,
}

/// The contacts of the particles of one cluster.
#[derive(Clone, Debug)]
struct ClusterContacts {
    /// Where the partners of each place begin and end; not kept up to date while there is none.
    offsets: Vec<u32>,
    partners: Vec<u32>,
    /// Scratch: pairs of places at first, then place within the cluster and partner.
    pairs: Vec<(u32, u32)>,
}

impl ContactList {
    pub(super) fn new<T: Real>(groups: &Groups<T>) -> Self {
        let empty =
            ClusterContacts { offsets: Vec::new(), partners: Vec::new(), pairs: Vec::new() };
        Self { clusters: vec![empty; groups.cluster_count()], entries: 0 }
    }

    /// Finds all pairs closer than `distance`, less those that the model leaves out.
    pub(super) fn find<T: Real>(
        &mut self,
        model: &Model,
        groups: &Groups<T>,
        broad_phase: &BroadPhase<T>,
        distance: T,
        arch: pulp::Arch,
    ) {
        let distance_squared = distance * distance;
        self.clusters.par_iter_mut().enumerate().for_each(|(cluster, contacts)| {
            let pairs = &mut contacts.pairs;
            pairs.clear();
            arch.dispatch(FindTask { groups, broad_phase, cluster, distance_squared, pairs });
            let first = cluster * CLUSTER_PARTICLES;
            pairs.retain_mut(|(place, other)| {
                let rest = groups.rest_distance_squared(*place as usize, *other as usize);
                let [a, b] = [groups.particle(*place as usize), groups.particle(*other as usize)];
                *place -= first as u32;
                *other = b;
                !rest.is_some_and(|rest| rest < distance_squared || model.springs().joins(a, b))
            });
            contacts.sort();
        });
        self.entries = self.clusters.iter().map(|cluster| cluster.partners.len() as u64).sum();
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

/// Finds all pairs of places closer than the contact distance, the first in one cluster.
struct FindTask<'a, T> {
    groups: &'a Groups<T>,
    broad_phase: &'a BroadPhase<T>,
    cluster: usize,
    distance_squared: T,
    pairs: &'a mut Vec<(u32, u32)>,
}

impl<T: Real> NullaryFnOnce for FindTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let first = self.cluster * CLUSTER;
        for group in first..(first + CLUSTER).min(self.groups.group_count()) {
            let own = self.groups.bounds()[group];
            for &candidate in self.broad_phase.candidates(group) {
                let other = candidate as usize;
                if own.gap_squared(&self.groups.bounds()[other]) < self.distance_squared {
                    self.compare(group, other);
                }
            }
        }
    }
}

impl<T: Real> FindTask<'_, T> {
    /// Compares every particle of group `g` with every one of `other`.
    #[inline(always)]
    fn compare(&mut self, g: usize, other: usize) {
        let own = self.groups.bounds()[g];
        let [xi, yi, zi] = self.groups.group(g);
        let [xj, yj, zj] = self.groups.group(other);
        // First each particle of the other group against the box of this one.
        let mut gap_squared = [T::ZERO; GROUP];
        for lane in 0..GROUP {
            let dx = (own.low[0] - xj[lane]).maximum(xj[lane] - own.high[0]).maximum(T::ZERO);
            let dy = (own.low[1] - yj[lane]).maximum(yj[lane] - own.high[1]).maximum(T::ZERO);
            let dz = (own.low[2] - zj[lane]).maximum(zj[lane] - own.high[2]).maximum(T::ZERO);
            gap_squared[lane] = dx * dx + dy * dy + dz * dz;
        }
        for j in 0..GROUP {
            if gap_squared[j] >= self.distance_squared {
                continue;
            }
            let mut length_squared = [T::ZERO; GROUP];
            for i in 0..GROUP {
                let [dx, dy, dz] = [xi[i] - xj[j], yi[i] - yj[j], zi[i] - zj[j]];
                length_squared[i] = dx * dx + dy * dy + dz * dz;
            }
            for i in 0..GROUP {
                let [a, b] = [g * GROUP + i, other * GROUP + j];
                // A place without a particle has NaN coordinates, for which this is false.
                if length_squared[i] < self.distance_squared && a != b {
                    self.pairs.push((a as u32, b as u32));
                }
            }
        }
    }
}
