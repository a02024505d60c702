//! The proof that the candidate list is still complete.
//!
//! A pair of groups that is not in the list was farther apart than reach = distance + skin when the
//! list was built. It can have come into contact only if one has moved by more than the skin
//! relative to the other. Falling or swinging cloth moves far, but neighbouring parts of it move
//! alike; so the bound is on relative motion, by clusters. Two clusters that were `gap` apart may
//! move by max(skin, gap - distance) relative to each other; every substep takes from that allowance
//! the most that the balls around their displacements permit, and when nothing is left the list is
//! built again. Clusters that were farther apart than `far` share one allowance, far - distance, from
//! which the largest relative displacement of any two particles is taken.

use cloth_core::Real;
use rayon::prelude::*;

use super::{
    bounds::Bounds,
    groups::{Groups, Step},
};

/// Skin in units of the contact distance.
const SKIN: f64 = 4.0;

/// Gap in units of the contact distance beyond which clusters are not compared one by one.
const FAR: f64 = 25.0;

/// Share of every allowance that is used. The rest, and a few units in the last place of the
/// coordinates in every substep, covers rounding in the displacements.
const SAFETY: f64 = 0.99;

/// What is left of the allowances since the list was built.
#[derive(Debug)]
pub(super) struct MotionBound<T> {
    distance: T,
    skin: T,
    far: T,
    far_left: T,
    /// For each cluster itself and the later ones nearer than `far`.
    pairs: Vec<Vec<ClusterPair<T>>>,
    built: bool,
}

#[derive(Clone, Copy, Debug)]
struct ClusterPair<T> {
    other: u32,
    /// Relative displacement that the pair may still have \[m\].
    left: T,
}

impl<T: Real> MotionBound<T> {
    pub(super) fn new(cluster_count: usize, distance: T) -> Self {
        Self {
            distance,
            skin: distance * T::from_f64(SKIN),
            far: distance * T::from_f64(FAR),
            far_left: T::ZERO,
            pairs: vec![Vec::new(); cluster_count],
            built: false,
        }
    }

    /// Gap of two groups up to which they must be in the list \[m\].
    pub(super) fn reach(&self) -> T {
        self.distance + self.skin
    }

    /// Books the displacements of the last refit; says whether no pair of groups outside the list
    /// can be in contact.
    pub(super) fn list_is_complete(&mut self, groups: &Groups<T>) -> bool {
        if !self.built {
            return false;
        }
        let clusters = groups.clusters();
        let mut everything = Bounds::empty();
        let mut magnitude = T::ZERO;
        for cluster in clusters {
            everything.merge(&cluster.step.bounds());
            magnitude = magnitude.maximum(cluster.position.magnitude());
        }
        let rounding = T::from_f64(32.0) * T::EPSILON * magnitude;
        let everything = Step::around(&everything);
        self.far_left -= everything.approach(&everything) + rounding;
        // Written so that a NaN counts as too far.
        let mut complete = self.far_left > T::ZERO;
        for (pairs, cluster) in self.pairs.iter_mut().zip(clusters) {
            for pair in pairs {
                let other = &clusters[pair.other as usize];
                pair.left -= cluster.step.approach(&other.step) + rounding;
                complete &= pair.left > T::ZERO;
            }
        }
        complete
    }

    /// Starts again with full allowances.
    pub(super) fn list_was_built(&mut self, groups: &Groups<T>) {
        let clusters = groups.clusters();
        let safety = T::from_f64(SAFETY);
        let far_squared = self.far * self.far;
        let [distance, skin] = [self.distance, self.skin];
        self.far_left = (self.far - distance) * safety;
        self.pairs.par_iter_mut().enumerate().for_each(|(i, pairs)| {
            pairs.clear();
            let position = &clusters[i].position;
            for (j, other) in clusters.iter().enumerate().skip(i) {
                let gap_squared = position.gap_squared(&other.position);
                if gap_squared < far_squared {
                    let left = skin.maximum(gap_squared.sqrt() - distance) * safety;
                    pairs.push(ClusterPair { other: j as u32, left });
                }
            }
        });
        self.built = true;
    }
}
