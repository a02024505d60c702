//! The pairs of a run that may touch: those whose boxes are near each other first, then what is left side by side.

use cloth_core::{
    Real,
    contact::{Split, UnprovenPair, may_touch},
};
use pulp::NullaryFnOnce;

use super::{
    batch::{Batch, LANES, coordinates, points},
    bounds::{Padded, boxes},
    pairs::Run,
};

/// Finds the pairs that `ContactSurface::contact` has to look at, compiled for each instruction set.
pub(super) struct NearTask<'a, T> {
    pub(super) run: &'a Run,
    /// Positions of vertices \[m\].
    pub(super) places: &'a [[T; 3]],
    pub(super) padded: &'a [Padded<T>],
    /// The reach of the surface \[m\].
    pub(super) reach: T,
}

impl<T: Real> NullaryFnOnce for NearTask<'_, T> {
    type Output = Vec<UnprovenPair>;

    #[inline(always)]
    fn call(self) -> Vec<UnprovenPair> {
        let mut near = Vec::new();
        self.look(Split::VertexTriangle, &self.run.vertex_triangle, &mut near);
        self.look(Split::EdgeEdge, &self.run.edge_edge, &mut near);
        near
    }
}

impl<T: Real> NearTask<'_, T> {
    #[inline(always)]
    fn look(&self, split: Split, pairs: &[UnprovenPair], near: &mut Vec<UnprovenPair>) {
        let Some(&first) = pairs.first() else { return };
        let mut batch = Batch::new(first);
        for pair in pairs {
            let [own, other] = boxes(split, pair.particles, self.padded);
            if !own.is_apart(&other, self.reach) && batch.push(pair) {
                self.look_closer(split, &batch, near);
                batch.count = 0;
            }
        }
        self.look_closer(split, &batch, near);
    }

    #[inline(always)]
    fn look_closer(&self, split: Split, batch: &Batch, near: &mut Vec<UnprovenPair>) {
        if batch.count == 0 {
            return;
        }
        let coordinates = coordinates(&batch.pairs, self.places);
        let mut may = [false; LANES];
        for lane in 0..LANES {
            may[lane] = may_touch(&points(&coordinates, lane), split, self.reach);
        }
        for (pair, may) in batch.pairs[..batch.count].iter().zip(may) {
            if may {
                near.push(*pair);
            }
        }
    }
}
