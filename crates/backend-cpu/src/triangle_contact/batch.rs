//! Pairs side by side, for what is asked of many of them.

use cloth_core::{Real, contact::UnprovenPair};

/// Pairs side by side.
pub(super) const LANES: usize = 16;

/// A coordinate of four particles of each pair.
pub(super) type Coordinates<T> = [[[T; LANES]; 3]; 4];

/// Pairs that are looked at side by side; those behind the first `count` are there to fill it up.
pub(super) struct Batch {
    pub(super) pairs: [UnprovenPair; LANES],
    pub(super) count: usize,
}

impl Batch {
    /// Without pairs: lanes that are not filled have this one.
    #[inline(always)]
    pub(super) fn new(pair: UnprovenPair) -> Self {
        Self { pairs: [pair; LANES], count: 0 }
    }

    /// Adds a pair. Returns whether it is full.
    #[inline(always)]
    pub(super) fn push(&mut self, pair: &UnprovenPair) -> bool {
        self.pairs[self.count] = *pair;
        self.count += 1;
        self.count == LANES
    }
}

#[inline(always)]
pub(super) fn coordinates<T: Real>(
    batch: &[UnprovenPair; LANES],
    places: &[[T; 3]],
) -> Coordinates<T> {
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
pub(super) fn points<T: Real>([a, b, c, d]: &Coordinates<T>, lane: usize) -> [[T; 3]; 4] {
    [
        [a[0][lane], a[1][lane], a[2][lane]],
        [b[0][lane], b[1][lane], b[2][lane]],
        [c[0][lane], c[1][lane], c[2][lane]],
        [d[0][lane], d[1][lane], d[2][lane]],
    ]
}
