//! The certificate of a run of pairs: comparisons along the axes of space first, then what is left side by side.

use cloth_core::{
    Real,
    contact::{Split, UnprovenPair, Ways, certify_at_start},
};
use pulp::NullaryFnOnce;

use super::pairs::Run;

/// Pairs side by side.
const LANES: usize = 16;

/// A coordinate of four particles of each pair.
type Coordinates<T> = [[[T; LANES]; 3]; 4];

/// The pairs of a run that nothing proves, compiled for each instruction set.
pub(super) struct ProofTask<'a, T> {
    pub(super) run: &'a Run,
    pub(super) ways: Ways<'a, T>,
    /// If there are any, pairs without a marked particle are left out.
    pub(super) marked: Option<&'a [bool]>,
}

impl<T: Real> NullaryFnOnce for ProofTask<'_, T> {
    type Output = Vec<UnprovenPair>;

    #[inline(always)]
    fn call(self) -> Vec<UnprovenPair> {
        let mut left = Vec::new();
        self.look(Split::VertexTriangle, &self.run.vertex_triangle, &mut left);
        self.look(Split::EdgeEdge, &self.run.edge_edge, &mut left);
        left
    }
}

impl<T: Real> ProofTask<'_, T> {
    /// The pairs of one kind.
    #[inline(always)]
    fn look(&self, split: Split, pairs: &[UnprovenPair], left: &mut Vec<UnprovenPair>) {
        let Some(&first) = pairs.first() else { return };
        let mut batch = [first; LANES];
        let mut count = 0;
        for pairs in pairs.chunks(LANES) {
            // Most pairs are proven by an axis of space.
            let mut chunk = [first; LANES];
            chunk[..pairs.len()].copy_from_slice(pairs);
            let is_proven = self.each::<AlongAxes>(split, &chunk);
            for (pair, is_proven) in pairs.iter().zip(is_proven) {
                if is_proven || !self.is_asked(pair) {
                    continue;
                }
                batch[count] = *pair;
                count += 1;
                if count == LANES {
                    self.prove(split, &batch, count, left);
                    count = 0;
                }
            }
        }
        if count > 0 {
            self.prove(split, &batch, count, left);
        }
    }

    /// A proof of each pair of a batch.
    #[inline(always)]
    fn each<P: Proof>(&self, split: Split, batch: &[UnprovenPair; LANES]) -> [bool; LANES] {
        let from = coordinates(batch, self.ways.start);
        let to = coordinates(batch, self.ways.end);
        let mut holds = [false; LANES];
        for lane in 0..LANES {
            let (from, to) = (points(&from, lane), points(&to, lane));
            holds[lane] = P::holds(&from, &to, split, self.ways.delta);
        }
        holds
    }

    /// Whether a pair has a marked particle, where marks matter.
    #[inline(always)]
    fn is_asked(&self, pair: &UnprovenPair) -> bool {
        let Some(marked) = self.marked else { return true };
        let [a, b, c, d] = pair.particles;
        let [a, b] = [marked[a as usize], marked[b as usize]];
        a | b | marked[c as usize] | marked[d as usize]
    }

    /// Looks at the first `count` pairs of a batch.
    #[inline(always)]
    fn prove(
        &self,
        split: Split,
        batch: &[UnprovenPair; LANES],
        count: usize,
        left: &mut Vec<UnprovenPair>,
    ) {
        let Ways { start, end, delta, is_new } = self.ways;
        let is_proven = self.each::<AtStart>(split, batch);
        for (pair, is_proven) in batch.iter().zip(is_proven).take(count) {
            if !is_proven && pair.is_unproven(start, end, (delta, is_new)) {
                left.push(*pair);
            }
        }
    }
}

/// A proof that two features do not meet on their ways, without a branch. (A closure would be a call of its own.)
trait Proof {
    fn holds<T: Real>(from: &[[T; 3]; 4], to: &[[T; 3]; 4], split: Split, delta: T) -> bool;
}

/// Along an axis of space, as `is_proven` has it.
struct AlongAxes;

impl Proof for AlongAxes {
    #[inline(always)]
    fn holds<T: Real>(from: &[[T; 3]; 4], to: &[[T; 3]; 4], split: Split, delta: T) -> bool {
        let mut is_proven = false;
        for axis in 0..3 {
            let [a, b] = ranges(from, split, axis);
            let [c, d] = ranges(to, split, axis);
            let above = (a[0] > b[1]) & (c[0] - d[1] > delta);
            let below = (b[0] > a[1]) & (d[0] - c[1] > delta);
            is_proven |= above | below;
        }
        is_proven
    }
}

/// Along the closest vector at the start.
struct AtStart;

impl Proof for AtStart {
    #[inline(always)]
    fn holds<T: Real>(from: &[[T; 3]; 4], to: &[[T; 3]; 4], split: Split, delta: T) -> bool {
        certify_at_start(from, to, split, delta)
    }
}

#[inline(always)]
fn coordinates<T: Real>(batch: &[UnprovenPair; LANES], places: &[[T; 3]]) -> Coordinates<T> {
    let mut coordinates = [[[T::ZERO; LANES]; 3]; 4];
    for lane in 0..LANES {
        for corner in 0..4 {
            let place = places[batch[lane].particles[corner] as usize];
            for axis in 0..3 {
                coordinates[corner][axis][lane] = place[axis];
            }
        }
    }
    coordinates
}

/// The particles of one pair. No array is mapped: that is a call of its own.
#[inline(always)]
fn points<T: Real>([a, b, c, d]: &Coordinates<T>, lane: usize) -> [[T; 3]; 4] {
    [
        [a[0][lane], a[1][lane], a[2][lane]],
        [b[0][lane], b[1][lane], b[2][lane]],
        [c[0][lane], c[1][lane], c[2][lane]],
        [d[0][lane], d[1][lane], d[2][lane]],
    ]
}

/// The least and the largest coordinate of each feature.
#[inline(always)]
fn ranges<T: Real>([a, b, c, d]: &[[T; 3]; 4], split: Split, axis: usize) -> [[T; 2]; 2] {
    let (a, b, c, d) = (a[axis], b[axis], c[axis], d[axis]);
    let [low, high] = [c.minimum(d), c.maximum(d)];
    match split {
        Split::VertexTriangle => [[a, a], [b.minimum(low), b.maximum(high)]],
        Split::EdgeEdge => [[a.minimum(b), a.maximum(b)], [low, high]],
    }
}
