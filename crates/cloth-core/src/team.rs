//! The threads of a pool, kept awake while a step is made: its loops take some ten microseconds each, and to wake a thread takes longer.

use std::{
    hint::spin_loop,
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use rayon::{Scope, ThreadPool, Yield};

/// Looks for work without any after which other programs may have the processor.
const PATIENCE: u32 = 100;

/// Looks without any after which a thread goes to sleep after all: some milliseconds. So nothing stands still where a thread looks for
/// the work of one solver on top of a part of another that the first waits for.
const LOOKS_MAX: u32 = 5_000;

/// A pool of threads, shared by solvers: one of its own, or the one that the whole program has.
#[derive(Debug)]
pub struct Team {
    pool: Option<ThreadPool>,
    /// Whether a solver keeps them awake: one is enough.
    is_awake: AtomicBool,
}

/// Set when it goes, however that comes.
struct Flag<'a>(&'a AtomicBool, bool);

impl Drop for Flag<'_> {
    fn drop(&mut self) {
        self.0.store(self.1, Ordering::Release);
    }
}

/// The threads of the whole program.
static PROGRAM: Team = Team { pool: None, is_awake: AtomicBool::new(false) };

impl Team {
    /// The threads of a pool.
    #[must_use]
    pub const fn new(pool: ThreadPool) -> Self {
        Self { pool: Some(pool), is_awake: AtomicBool::new(false) }
    }

    /// The threads of the whole program: what backends have whose work on the processor is beside that of a device.
    #[must_use]
    pub fn program() -> &'static Self {
        &PROGRAM
    }

    /// How many there are.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.as_ref().map_or_else(rayon::current_num_threads, ThreadPool::current_num_threads)
    }

    /// Does `work` in the pool.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.scope(|_| work())
    }

    /// The same, with all threads looking for work until it is done.
    pub fn install_awake<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        if self.threads() == 1 || self.is_awake.swap(true, Ordering::Acquire) {
            return self.install(work);
        }
        let _taken = Flag(&self.is_awake, false);
        let is_done = &AtomicBool::new(false);
        self.scope(|scope| {
            let own = match &self.pool {
                Some(pool) => pool.current_thread_index(),
                None => rayon::current_thread_index(),
            };
            scope.spawn_broadcast(move |_, context| {
                // The thread that works does not wait for itself.
                if Some(context.index()) != own {
                    look(is_done);
                }
            });
            let _done = Flag(is_done, true);
            work()
        })
    }

    fn scope<'scope, R: Send>(&self, work: impl FnOnce(&Scope<'scope>) -> R + Send) -> R {
        match &self.pool {
            Some(pool) => pool.scope(work),
            None => rayon::scope(work),
        }
    }
}

/// Takes over what there is to do until all is done, or nothing has come for long.
fn look(is_done: &AtomicBool) {
    let mut looks = 0;
    while looks < LOOKS_MAX && !is_done.load(Ordering::Acquire) {
        match rayon::yield_now() {
            Some(Yield::Executed) => looks = 0,
            _ if looks < PATIENCE => spin_loop(),
            _ => thread::yield_now(),
        }
        looks += 1;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;

    use rayon::{ThreadPoolBuilder, prelude::*};

    use super::*;

    fn team(threads: usize) -> Team {
        Team::new(ThreadPoolBuilder::new().num_threads(threads).build().unwrap())
    }

    fn sum(team: &Team) -> u64 {
        team.install_awake(|| (0..500).map(|_| (0..1_000_u64).into_par_iter().sum::<u64>()).sum())
    }

    #[test]
    fn work_is_done_once_and_threads_are_free_after_it() {
        for threads in [1, 2, 5] {
            let team = team(threads);
            for _ in 0..3 {
                assert_eq!(sum(&team), 500 * 499_500);
            }
            assert!(!team.is_awake.load(Ordering::Acquire));
        }
    }

    /// Several solvers share a pool, from threads of their own and from within each other.
    #[test]
    fn solvers_beside_each_other_come_to_an_end() {
        let team = team(3);
        let ends = AtomicU32::new(0);
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..20 {
                        assert_eq!(sum(&team), 500 * 499_500);
                        assert_eq!(team.install_awake(|| sum(&team)), 500 * 499_500);
                    }
                    ends.fetch_add(1, Ordering::Relaxed);
                });
            }
        });
        assert_eq!(ends.into_inner(), 4);
    }

    #[test]
    fn a_panic_leaves_the_team_as_it_was() {
        let team = team(2);
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            team.install_awake(|| panic!("on purpose"))
        }));
        assert!(caught.is_err());
        assert_eq!(sum(&team), 500 * 499_500);
    }
}
