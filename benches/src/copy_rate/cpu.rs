//! What copies in the memory of the computer reach.

use std::time::Instant;

use rayon::prelude::*;

/// Numbers in an array: more than any cache holds.
const COUNT: usize = 1 << 26;
/// Copies, of which the fastest counts.
const COPIES: usize = 5;

/// GB/s, read and written counted, with all threads.
#[must_use]
pub fn copy_rate_cpu() -> f64 {
    let source = vec![1.0_f32; COUNT];
    let mut copied = vec![0.0_f32; COUNT];
    let chunk = COUNT / rayon::current_num_threads().max(1);
    let seconds = (0..COPIES).map(|_| {
        let start = Instant::now();
        copied
            .par_chunks_mut(chunk)
            .zip(source.par_chunks(chunk))
            .for_each(|(to, from)| to.copy_from_slice(from));
        start.elapsed().as_secs_f64()
    });
    let fastest = seconds.fold(f64::INFINITY, f64::min);
    (2 * COUNT * size_of::<f32>()) as f64 / fastest / 1e9
}
