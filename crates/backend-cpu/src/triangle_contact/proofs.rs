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

/// Pairs that are looked at side by side; those behind the first `count` are there to fill it up.
struct Batch {
    pairs: [UnprovenPair; LANES],
    count: usize,
}

impl Batch {
    /// Adds a pair. Returns whether it is full.
    #[inline(always)]
    fn push(&mut self, pair: &UnprovenPair) -> bool {
        self.pairs[self.count] = *pair;
        self.count += 1;
        self.count == LANES
    }
}

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
        let mut unproven = Batch { pairs: [first; LANES], count: 0 };
        if self.marked.is_none() {
            for pairs in pairs.chunks(LANES) {
                let mut batch = Batch { pairs: [first; LANES], count: pairs.len() };
                batch.pairs[..pairs.len()].copy_from_slice(pairs);
                self.compare(split, &batch, &mut unproven, left);
            }
        } else {
            // Few have a mark: coordinates of others are not looked at.
            let mut asked = Batch { pairs: [first; LANES], count: 0 };
            for pair in pairs.iter().filter(|pair| self.is_asked(pair)) {
                if asked.push(pair) {
                    self.compare(split, &asked, &mut unproven, left);
                    asked.count = 0;
                }
            }
            self.compare(split, &asked, &mut unproven, left);
        }
        self.prove(split, &unproven, left);
    }

    /// Most pairs are proven by an axis of space; the others wait until there are enough of them.
    #[inline(always)]
    fn compare(
        &self,
        split: Split,
        batch: &Batch,
        unproven: &mut Batch,
        left: &mut Vec<UnprovenPair>,
    ) {
        let is_proven = self.each::<AlongAxes>(split, &batch.pairs);
        for (pair, is_proven) in batch.pairs[..batch.count].iter().zip(is_proven) {
            if !is_proven && unproven.push(pair) {
                self.prove(split, unproven, left);
                unproven.count = 0;
            }
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

    /// Looks at the pairs of a batch that no axis of space proves.
    #[inline(always)]
    fn prove(&self, split: Split, batch: &Batch, left: &mut Vec<UnprovenPair>) {
        if batch.count == 0 {
            return;
        }
        let Ways { start, end, delta, is_new, follows: _ } = self.ways;
        let is_proven = self.each::<AtStart>(split, &batch.pairs);
        for (pair, is_proven) in batch.pairs.iter().zip(is_proven).take(batch.count) {
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
