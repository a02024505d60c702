//! The table of 2006: conjugate gradients and Jacobi on 100 to 3,600 particles with 24 neighbours, in steps of
//! 10 ms, and on to the 667,648 particles that were named as where such a simulation should get to.

use cloth::{LinearMethod, Preconditioner};
use cloth_benches::HangWorkload;

use super::{group, workloads::implicit};
use crate::{case::Case, engine::Engine};

/// Columns and rows.
const SIZES: [[u32; 2]; 9] = [
    [10, 10],
    [20, 20],
    [30, 30],
    [40, 40],
    [50, 50],
    [60, 60],
    [160, 160],
    [512, 512],
    [1024, 652],
];
const ITERATIONS: [u32; 3] = [10, 30, 70];
/// Length of a step \[s\].
const STEP: f64 = 0.01;
/// Particles above which few steps are timed.
const PARTICLES_MANY: u32 = 100_000;
/// Particles of the largest patch for a GPU that the processor plays.
const PARTICLES_EMULATED: u32 = 900;
/// Frames per second that were published for 3,600 particles: on a GPU with Jacobi, on the processor.
const PUBLISHED: [f64; 2] = [20.0, 2.0];

pub(super) fn cases(engine: &Engine) -> Vec<Case> {
    let mut cases = Vec::new();
    for [side, rows] in SIZES {
        if engine.is_emulated() && side * rows > PARTICLES_EMULATED {
            continue;
        }
        for (label, method) in [
            ("conjugate gradients", LinearMethod::ConjugateGradient),
            ("Jacobi", LinearMethod::Jacobi),
        ] {
            for count in ITERATIONS {
                let workload = HangWorkload { rows, time_step: STEP, ..HangWorkload::new(side) };
                let integrator = implicit(method, Preconditioner::Diagonal, count);
                let frames = if side * rows > PARTICLES_MANY { [2, 4] } else { [5, 20] };
                let case = Case::hang(group::TABLE_LINEAR, workload, integrator);
                let published = published(side, rows, method, engine.is_asynchronous());
                cases.push(case.labelled(label).over(frames).beside(published));
            }
        }
    }
    cases
}

fn published(side: u32, rows: u32, method: LinearMethod, is_gpu: bool) -> Option<f64> {
    let is_row = side * rows == 3600;
    match (is_row, is_gpu, method) {
        (true, true, LinearMethod::Jacobi) => Some(PUBLISHED[0]),
        (true, false, _) => Some(PUBLISHED[1]),
        _ => None,
    }
}
