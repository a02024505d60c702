//! The certificate of contact against exact arithmetic: no pair of features that meets is certified (NUMERICS §14).
//! `CLOTH_CERTIFICATE_PAIRS` sets the number of pairs; `cargo xtask test certificate` takes 10^8 of them.

mod filter;
mod judge;
mod pairs;
mod polynomial;

use std::{
    ops::AddAssign,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
};

use cloth_core::{
    Real,
    contact::{MARGIN, Split, certify, certify_with_margin},
};
use filter::{Known, look};
use harness::random::Random;
use pairs::{Kind, Pair};

/// Pairs of each precision in continuous integration.
const PAIRS: u64 = 500_000;
/// Pairs that follow from one seed.
const BATCH: u64 = 4_000;

/// What became of the pairs of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    pairs: u64,
    certified: u64,
    /// Certified, and they meet.
    wrong: u64,
    /// Known to meet.
    meet: u64,
    /// Known to be apart.
    apart: u64,
    /// Pairs that took exact arithmetic.
    exact: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.pairs += other.pairs;
        self.certified += other.certified;
        self.wrong += other.wrong;
        self.meet += other.meet;
        self.apart += other.apart;
        self.exact += other.exact;
    }
}

/// A pair in the precision of `T`, and what is stored of it.
struct Stored<T> {
    start: [[T; 3]; 4],
    end: [[T; 3]; 4],
    exact: [[[f64; 3]; 4]; 2],
    split: Split,
}

impl<T: Real> Stored<T> {
    fn new(pair: &Pair) -> Self {
        let round = |points: &[[f64; 3]; 4]| points.map(|point| point.map(T::from_f64));
        let (start, end) = (round(&pair.start), round(&pair.end));
        let back = |points: [[T; 3]; 4]| points.map(|point| point.map(T::to_f64));
        Self { start, end, exact: [back(start), back(end)], split: pair.split }
    }

    fn is_finite(&self) -> bool {
        self.exact.iter().flatten().flatten().all(|x| x.is_finite())
    }
}

/// Judges a pair; one that is not certified only if that is easy, or if `always` is given.
fn judged<T: Real>(pair: &Pair, margin: u8, always: bool, counts: &mut Counts) {
    let stored = Stored::<T>::new(pair);
    let certified = certify_with_margin(&stored.start, &stored.end, stored.split, T::ZERO, margin);
    counts.pairs += 1;
    counts.certified += u64::from(certified);
    if !stored.is_finite() {
        // What is not finite proves nothing.
        counts.wrong += u64::from(certified);
        return;
    }
    let [start, end] = &stored.exact;
    let known = match look(start, end, stored.split) {
        Known::Nothing if certified || always => {
            counts.exact += 1;
            if judge::meets(start, end, stored.split) { Known::Meet } else { Known::Apart }
        }
        known => known,
    };
    counts.meet += u64::from(known == Known::Meet);
    counts.apart += u64::from(known == Known::Apart);
    if certified && known == Known::Meet {
        counts.wrong += 1;
        if margin == MARGIN {
            println!("certified, and they meet: {:?} {start:?} {end:?}", stored.split);
        }
    }
}

/// So many pairs, by kind, on all cores; the same whatever their number is.
fn judge_all<T: Real>(pairs: u64, margin: u8, kind_of: fn(u64) -> Kind) -> [Counts; 6] {
    let next = AtomicU64::new(0);
    let sum = Mutex::new([Counts::default(); 6]);
    let work = || {
        let mut counts = [Counts::default(); 6];
        loop {
            let batch = next.fetch_add(1, Ordering::Relaxed);
            if batch * BATCH >= pairs {
                break;
            }
            let mut random = Random::new(batch);
            for number in 0..BATCH.min(pairs - batch * BATCH) {
                let kind = kind_of(number);
                let pair = Pair::new(kind, &mut random, T::IS_DOUBLE);
                let always = number % 1024 == 25;
                judged::<T>(&pair, margin, always, &mut counts[kind as usize]);
            }
        }
        let mut sum = sum.lock().expect("no thread panics while it adds");
        sum.iter_mut().zip(counts).for_each(|(sum, counts)| *sum += counts);
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, Into::into) {
            scope.spawn(work);
        }
    });
    sum.into_inner().expect("no thread panics while it adds")
}

fn pairs_wanted() -> u64 {
    let text = std::env::var("CLOTH_CERTIFICATE_PAIRS").ok();
    text.map_or(PAIRS, |text| {
        text.parse().unwrap_or_else(|_| panic!("CLOTH_CERTIFICATE_PAIRS: {text} is no number"))
    })
}

fn check<T: Real>() {
    let counts = judge_all::<T>(pairs_wanted(), MARGIN, Kind::of);
    let bits = if T::IS_DOUBLE { 64 } else { 32 };
    for (kind, counts) in Kind::ALL.into_iter().zip(&counts) {
        let share = counts.certified as f64 / counts.apart.max(1) as f64;
        println!(
            "f{bits} {kind:?}: {counts:?}, {:.1} % of those apart are certified",
            100.0 * share
        );
        assert_eq!(counts.wrong, 0, "{kind:?}");
    }
    let of = |kind: Kind| counts[kind as usize];
    let share = |kind: Kind| of(kind).certified as f64 / of(kind).apart as f64;
    // A certificate that certifies nothing is right, and of no use.
    assert!(share(Kind::Near) > 0.8, "{:?}", of(Kind::Near));
    assert!(share(Kind::Anywhere) > 0.5, "{:?}", of(Kind::Anywhere));
    assert!(of(Kind::LastBit).certified > of(Kind::LastBit).pairs / 100);
    // And pairs that never meet test nothing.
    for (kind, part) in [(Kind::Near, 10), (Kind::Anywhere, 100), (Kind::Degenerate, 10_000)] {
        assert!(of(kind).meet > of(kind).pairs / part, "{kind:?} {:?}", of(kind));
    }
    assert_eq!(of(Kind::Touching).certified, 0);
}

#[test]
fn none_that_meets_is_certified_in_single_precision() {
    check::<f32>();
}

#[test]
fn none_that_meets_is_certified_in_double_precision() {
    check::<f64>();
}

/// The negative control: without the margin features that touch are certified, and it is seen.
#[test]
fn a_margin_of_zero_is_caught() {
    let wrong = |counts: [Counts; 6]| counts.iter().map(|counts| counts.wrong).sum::<u64>();
    for counts in [
        judge_all::<f32>(40_000, 0, |_| Kind::Touching),
        judge_all::<f64>(40_000, 0, |_| Kind::Touching),
    ] {
        println!("without a margin {} of 40,000 pairs that touch are certified", wrong(counts));
        assert!(wrong(counts) > 100, "{counts:?}");
    }
}

/// The judge and its filter are of one mind wherever the filter has one.
#[test]
fn the_filter_agrees_with_exact_arithmetic() {
    let mut random = Random::new(5);
    let mut decided = 0;
    for number in 0..3000 {
        let pair = Pair::new(Kind::of(number), &mut random, true);
        let meets = judge::meets(&pair.start, &pair.end, pair.split);
        match look(&pair.start, &pair.end, pair.split) {
            Known::Nothing => continue,
            Known::Meet => assert!(meets, "{pair:?}"),
            Known::Apart => assert!(!meets, "{pair:?}"),
        }
        decided += 1;
    }
    assert!(decided > 1500, "{decided}");
}

#[test]
fn the_end_needs_its_distance() {
    let at = |height: f32| [[0.2, 0.2, height], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let delta = 2e-5;
    let certified = |from, to| certify(&at(from), &at(to), Split::VertexTriangle, delta);
    assert!(certified(1e-6, 3e-5), "any gap will do at the start");
    assert!(!certified(3e-5, 1e-5), "the end asks for more");
    assert!(!certified(3e-5, -3e-5) && !certified(f32::NAN, 1.0) && !certified(1.0, f32::INFINITY));
}
