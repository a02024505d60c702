//! Work in phases of some microseconds. Handing each to the pool of threads takes 10 to 15 us, which is longer than the work if there are many
//! threads; here they join once, and see the next phase by looking for it.
//!
//! Nobody waits for a thread that has not begun with something: the one that leads does all alone if no other one comes.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering},
    thread,
};

/// Phases that follow each other, of chunks that any thread may do, in any order.
pub(crate) trait Phased: Sync {
    /// How many phases there are: always as many.
    fn phases(&self) -> u32;

    /// Chunks of a phase: always as many.
    fn chunks(&self, phase: u32) -> usize;

    /// Does a chunk: once in each turn of the phase, all before the next phase begins.
    fn work(&self, phase: u32, chunk: usize);
}

/// The turn after the last one.
const OVER: u32 = u32::MAX;

/// Looks at what it waits for before a thread lets others have its processor: some microseconds.
const LOOKS: u32 = 100;

fn wait_until(mut is_there: impl FnMut() -> bool) {
    let mut looks = 0;
    while !is_there() {
        if looks < LOOKS {
            looks += 1;
            std::hint::spin_loop();
        } else {
            thread::yield_now();
        }
    }
}

/// How many of the chunks of one thread are taken, below the turn in which they were. Lines of the cache of its own.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Cursor(AtomicU64);

/// Where each thread is in its chunks: kept by whoever leads often, who takes no memory then.
#[derive(Debug, Default)]
pub(crate) struct Seats(Vec<Cursor>);

impl Cursor {
    /// Takes the next one of `count` chunks, if there is one left and the turn is not over.
    fn take(&self, turn: u32, count: usize) -> Option<usize> {
        let mut seen = self.0.load(Ordering::Relaxed);
        loop {
            let (of_turn, taken) = ((seen >> 32) as u32, seen as u32);
            let taken = match of_turn.cmp(&turn) {
                std::cmp::Ordering::Less => 0,
                std::cmp::Ordering::Equal => taken,
                std::cmp::Ordering::Greater => return None,
            };
            if taken as usize >= count {
                return None;
            }
            let next = u64::from(turn) << 32 | u64::from(taken + 1);
            let order = Ordering::Relaxed;
            match self.0.compare_exchange_weak(seen, next, order, order) {
                Ok(_) => return Some(taken as usize),
                Err(other) => seen = other,
            }
        }
    }
}

struct Shared<'a, P> {
    work: &'a P,
    /// Counts phases, those that are left out included: what is left of it by [`Phased::phases`] is the phase.
    turn: AtomicU32,
    /// Chunks of this turn that are not done.
    left: AtomicUsize,
    /// One for each thread.
    cursors: &'a [Cursor],
    is_broken: AtomicBool,
}

/// Tells the others that this thread will not finish its chunks.
struct Breaks<'a>(&'a AtomicBool);

impl Drop for Breaks<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(true, Ordering::Release);
        }
    }
}

impl<P: Phased> Shared<'_, P> {
    /// Does chunks of a turn until none is left: first those of thread number `own`, whose data are near it since the last time.
    fn help(&self, turn: u32, own: usize) {
        let _breaks = Breaks(&self.is_broken);
        let phase = turn % self.work.phases();
        let (chunks, threads) = (self.work.chunks(phase), self.cursors.len());
        for thread in (own..threads).chain(0..own) {
            let [first, end] = [thread, thread + 1].map(|thread| thread * chunks / threads);
            let mut done = 0;
            while let Some(chunk) = self.cursors[thread].take(turn, end - first) {
                self.work.work(phase, first + chunk);
                done += 1;
            }
            // Looking at what others have takes them time, too: not if nothing is left.
            let left = match done {
                0 => self.left.load(Ordering::Relaxed),
                _ => self.left.fetch_sub(done, Ordering::AcqRel) - done,
            };
            if left == 0 {
                return;
            }
        }
    }

    /// Helps in every turn up to the last one.
    fn follow(&self, own: usize) {
        let mut turn = 0;
        loop {
            let last = turn;
            wait_until(|| {
                turn = self.turn.load(Ordering::Acquire);
                turn != last
            });
            if turn == OVER {
                return;
            }
            self.help(turn, own);
        }
    }
}

/// The thread that says which phase is next.
pub(crate) struct Leader<'a, P> {
    shared: &'a Shared<'a, P>,
    turn: u32,
}

impl<P: Phased> Leader<'_, P> {
    /// Does all chunks of a phase.
    pub(crate) fn run(&mut self, phase: u32) {
        let phases = self.shared.work.phases();
        self.turn += 1 + (phase + phases - (self.turn + 1) % phases) % phases;
        self.shared.left.store(self.shared.work.chunks(phase), Ordering::Relaxed);
        self.shared.turn.store(self.turn, Ordering::Release);
        self.shared.help(self.turn, 0);
        wait_until(|| {
            let is_broken = self.shared.is_broken.load(Ordering::Acquire);
            assert!(!is_broken, "another thread has panicked");
            self.shared.left.load(Ordering::Acquire) == 0
        });
    }
}

impl<P> Drop for Leader<'_, P> {
    fn drop(&mut self) {
        self.shared.turn.store(OVER, Ordering::Release);
    }
}

/// Calls `lead`, which says what phases come when, with up to so many threads of the pool to help.
pub(crate) fn lead<P: Phased, R: Send>(
    work: &P,
    (seats, helpers): (&mut Seats, usize),
    lead: impl FnOnce(&mut Leader<'_, P>) -> R + Send,
) -> R {
    let Seats(cursors) = seats;
    cursors.clear();
    cursors.resize_with(helpers + 1, Cursor::default);
    let shared = Shared {
        work,
        turn: AtomicU32::new(0),
        left: AtomicUsize::new(0),
        cursors,
        is_broken: AtomicBool::new(false),
    };
    let led = || lead(&mut Leader { shared: &shared, turn: 0 });
    rayon::join(led, || follow(&shared, 1..helpers + 1)).0
}

/// Threads of these numbers follow. Each that comes hands half of those that it has to the next one.
fn follow<P: Phased>(shared: &Shared<'_, P>, seats: Range<usize>) {
    let Range { start, end } = seats;
    match end - start {
        0 => {}
        1 => shared.follow(start),
        count => {
            let middle = start + count / 2;
            rayon::join(|| follow(shared, start..middle), || follow(shared, middle..end));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Adds up what each chunk of a phase was given.
    struct Counted {
        sizes: [usize; 3],
        counts: [Vec<AtomicUsize>; 3],
    }

    impl Phased for Counted {
        fn phases(&self) -> u32 {
            3
        }

        fn chunks(&self, phase: u32) -> usize {
            self.sizes[phase as usize]
        }

        fn work(&self, phase: u32, chunk: usize) {
            // All of the phase before are done, and none of the next one.
            let before = (phase + 2) % 3;
            let own = self.counts[phase as usize][chunk].fetch_add(1, Ordering::Relaxed);
            for count in &self.counts[before as usize] {
                let count = count.load(Ordering::Relaxed);
                assert!(count == own + 1 || phase == 0 && count == own, "{phase}: {count}, {own}");
            }
        }
    }

    /// With fewer threads in the pool than are asked for, too.
    #[test]
    fn every_chunk_is_done_once_in_every_turn() {
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for sizes in [[1, 1, 1], [40, 0, 7], [3, 100, 2]] {
                let counts = sizes.map(|size| (0..size).map(|_| AtomicUsize::new(0)).collect());
                let counted = Counted { sizes, counts };
                pool.install(|| {
                    lead(&counted, (&mut Seats::default(), 4), |leader| {
                        for _ in 0..1000 {
                            (0..3).for_each(|phase| leader.run(phase));
                        }
                    });
                });
                for count in counted.counts.iter().flatten() {
                    assert_eq!(count.load(Ordering::Relaxed), 1000);
                }
            }
        }
    }

    struct Fails;

    impl Phased for Fails {
        fn phases(&self) -> u32 {
            1
        }

        fn chunks(&self, _: u32) -> usize {
            64
        }

        fn work(&self, _: u32, chunk: usize) {
            assert_ne!(chunk, 63, "the last one fails");
        }
    }

    /// Nobody waits for ever.
    #[test]
    fn a_panic_ends_all() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
        let run =
            || pool.install(|| lead(&Fails, (&mut Seats::default(), 3), |leader| leader.run(0)));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).is_err());
    }
}
