//! A solve with the preconditioner `schwarz` takes no memory once all is built.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../schwarz/rig.rs"]
#[allow(dead_code, reason = "another test needs the rest")]
mod rig;

use cloth_core::{LinearSettings, Precision, Preconditioner};
use peak_alloc::PeakAlloc;

use rig::{fabric, folded, settings, sheet, solve, springs};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Solves of which the least counts: handing work to threads takes a block of their queue now and then.
const SOLVES: usize = 4;

/// Bytes that were taken at once in `work`, more than before it.
fn taken(work: impl FnOnce()) -> usize {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    work();
    MEMORY.peak_usage().saturating_sub(before)
}

#[test]
fn a_solve_takes_no_memory() {
    for (model, precision) in [
        (sheet(128, |_| fabric()), Precision::F32),
        (sheet(128, springs), Precision::F32),
        (sheet(70, |_| fabric()), Precision::F64),
    ] {
        let mut kernels = folded(&model, precision, 2);
        let settings = settings(Preconditioner::Schwarz);
        let built = taken(|| {
            solve(&mut *kernels, &settings);
        });
        // The control: a build takes memory, and that is seen.
        assert!(built > 100 * model.particle_count(), "{built}");
        for tolerance in [1e-1, 1e-3, 1e-5] {
            let settings = LinearSettings { tolerance, ..settings };
            let bytes: [usize; SOLVES] = std::array::from_fn(|_| {
                taken(|| {
                    solve(&mut *kernels, &settings);
                })
            });
            println!("{bytes:?} bytes to {tolerance}");
            assert!(bytes.contains(&0), "{bytes:?} bytes to {tolerance}");
        }
    }
}
