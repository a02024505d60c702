//! The proof that the candidate list is still complete.
//!
//! A pair of groups that is not in the list was farther apart than reach = distance + skin when the
//! list was built. It can have come into contact only if one has moved by more than the skin
//! relative to the other. Falling or swinging cloth moves far, but neighbouring parts of it move
//! alike; so the bound is on relative motion, by clusters. For two clusters that were `gap` apart the
//! largest relative displacement of their particles follows from the boxes around the displacements,
//! and must stay below max(skin, gap - distance). Clusters that were farther apart than `far` are
//! covered by one test for all of them: the largest relative displacement of any two particles must
//! stay below far - distance.

use cloth_core::Real;
use rayon::prelude::*;

use super::{bounds::Bounds, groups::Groups};

/// Skin in units of the contact distance.
const SKIN: f64 = 2.5;

/// Gap in units of the contact distance beyond which clusters are not compared one by one.
const FAR: f64 = 25.0;

/// Share of every allowance that is used; the rest, and a few units in the last place of the
/// coordinates, covers rounding in the displacements.
const SAFETY: f64 = 0.99;

/// What is known since the list was built.
#[derive(Debug)]
pub(super) struct MotionBound<T> {
    distance: T,
    skin: T,
    far: T,
    /// Positions by place when the list was built.
    reference: [Vec<T>; 3],
    /// Pairs of clusters nearer than `far`, with the relative displacement that each may have.
    pairs: Vec<ClusterPair<T>>,
    built: bool,
}

#[derive(Clone, Copy, Debug)]
struct ClusterPair<T> {
    clusters: [u32; 2],
    allowance: T,
}

impl<T: Real> MotionBound<T> {
    pub(super) fn new(groups: &Groups<T>, distance: T) -> Self {
        Self {
            distance,
            skin: distance * T::from_f64(SKIN),
            far: distance * T::from_f64(FAR),
            reference: std::array::from_fn(|_| vec![T::ZERO; groups.place_count()]),
            pairs: Vec::new(),
            built: false,
        }
    }

    /// Gap of two groups up to which they must be in the list \[m\].
    pub(super) fn reach(&self) -> T {
        self.distance + self.skin
    }

    /// Positions from which displacements are to be taken.
    pub(super) fn reference(&self) -> Option<&[Vec<T>; 3]> {
        self.built.then_some(&self.reference)
    }

    /// Whether no pair of groups outside the list can be in contact.
    pub(super) fn list_is_complete(&self, groups: &Groups<T>) -> bool {
        if !self.built {
            return false;
        }
        let clusters = groups.clusters();
        let mut everything = Bounds::empty();
        let mut magnitude = T::ZERO;
        for cluster in clusters {
            everything.merge(&cluster.displacement);
            magnitude = magnitude.maximum(cluster.position.magnitude());
        }
        let rounding = T::from_f64(32.0) * T::EPSILON * magnitude;
        let within = |span_squared: T, allowance: T| {
            let allowance = (allowance - rounding).maximum(T::ZERO);
            span_squared < allowance * allowance
        };
        let safety = T::from_f64(SAFETY);
        within(everything.span_squared(&everything), (self.far - self.distance) * safety)
            && self.pairs.par_iter().with_min_len(4096).all(|pair| {
                let [a, b] = pair.clusters.map(|index| &clusters[index as usize].displacement);
                within(a.span_squared(b), pair.allowance)
            })
    }

    /// Takes the present positions as the new reference.
    pub(super) fn list_was_built(&mut self, groups: &Groups<T>) {
        for (reference, position) in self.reference.iter_mut().zip(groups.positions()) {
            reference.copy_from_slice(position);
        }
        let clusters = groups.clusters();
        let safety = T::from_f64(SAFETY);
        let far_squared = self.far * self.far;
        self.pairs.clear();
        for (i, a) in clusters.iter().enumerate() {
            for (j, b) in clusters.iter().enumerate().skip(i) {
                let gap_squared = a.position.gap_squared(&b.position);
                if gap_squared < far_squared {
                    let allowance = self.skin.maximum(gap_squared.sqrt() - self.distance) * safety;
                    self.pairs.push(ClusterPair { clusters: [i as u32, j as u32], allowance });
                }
            }
        }
        self.built = true;
    }
}
