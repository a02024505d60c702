//! The common workload on the GPU: time of a frame, of its stages, and what that means in bytes.
//!
//! `cargo bench -p cloth-benches --bench gpu [-- SIDE ...]`. Times are medians of frames 10 to 70. A frame
//! is timed in two ways: with its report, as an application runs that looks at every frame; and in a row
//! of frames with one wait at their end, which is what the device itself takes.

use std::{error::Error, time::Instant};

use cloth::{
    Backend, Frame, StageTime, State,
    scene::{BenchKind, CompileOptions, bench_scene},
    wgpu::{WgpuBackend, WgpuOptions},
};
use cloth_benches::{FRAMES_BEFORE, FRAMES_MEASURED, Workload};

/// Bytes of the state that a substep must read and write for each particle: position, velocity, inverse
/// mass and mass.
const STATE_BYTES: f64 = 64.0;

fn main() -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let backend = WgpuBackend::new(std::env::var("CLOTH_ADAPTER").ok().as_deref())?;
    println!("{}, opened in {:.0} ms", backend.info().device, milliseconds(start));
    let timed = WgpuBackend::with_options(&WgpuOptions {
        adapter: std::env::var("CLOTH_ADAPTER").ok(),
        stage_times: true,
        ..WgpuOptions::default()
    })?;
    let sides: Vec<u32> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sides = match sides.as_slice() {
        [] if backend.is_processor() => &[64][..],
        [] => &[160, 256, 512, 1024],
        given => given,
    };
    println!(
        "{:<8}{:<9}{:>6}{:>12}{:>12}{:>12}{:>12}{:>10}{:>10}{:>9}{:>9}",
        "scene",
        "contact",
        "N",
        "first ms",
        "report ms",
        "in a row",
        "Msteps/s",
        "GB/s",
        "contacts",
        "rebuilds",
        "strain"
    );
    for contact in [false, true] {
        for &side in sides {
            case(&backend, Workload::new(BenchKind::Sphere, side, contact))?;
        }
    }
    for contact in [false, true] {
        for &side in sides {
            stages(&timed, Workload::new(BenchKind::Sphere, side, contact))?;
        }
    }
    Ok(())
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn case(backend: &WgpuBackend, workload: Workload) -> Result<(), Box<dyn Error>> {
    let compiled = bench_scene(workload.kind, workload.side, workload.contact)
        .compile(&CompileOptions::default())?;
    let frame = Frame::per_second(compiled.frames_per_second);
    let start = Instant::now();
    let mut solver = backend.create_solver(compiled.model.clone(), &compiled.config)?;
    solver.advance(frame)?;
    solver.synchronize()?;
    let first = milliseconds(start);
    for _ in 1..FRAMES_BEFORE {
        solver.advance(frame)?;
        solver.synchronize()?;
    }
    let mut state = State::default();
    solver.download(&mut state)?;
    let mut times = Vec::new();
    let mut last = cloth::StepReport::default();
    let mut rebuilds = 0;
    for _ in 0..FRAMES_MEASURED {
        let start = Instant::now();
        solver.advance(frame)?;
        last = solver.synchronize()?;
        times.push(milliseconds(start));
        rebuilds += last.contact_rebuilds;
    }
    let with_report = median(&mut times);
    let mut times = Vec::new();
    for _ in 0..3 {
        solver.upload(&state)?;
        solver.download(&mut state)?;
        let start = Instant::now();
        for _ in 0..FRAMES_MEASURED {
            solver.advance(frame)?;
        }
        solver.synchronize()?;
        times.push(milliseconds(start) / FRAMES_MEASURED as f64);
    }
    let in_a_row = median(&mut times);
    let steps = workload.particles() as f64 * f64::from(last.substeps);
    println!(
        "{:<8}{:<9}{:>6}{first:>12.1}{with_report:>12.4}{in_a_row:>12.4}{:>12.0}{:>10.0}{:>10}{:>9.2}{:>9.4}",
        workload.scene(),
        workload.contact,
        workload.side,
        steps / in_a_row / 1e3,
        steps * STATE_BYTES / in_a_row / 1e6,
        last.contacts,
        f64::from(rebuilds) / FRAMES_MEASURED as f64,
        last.measures.strain_mean,
    );
    Ok(())
}

/// Times of single stages, which wait for each other here.
fn stages(backend: &WgpuBackend, workload: Workload) -> Result<(), Box<dyn Error>> {
    let mut running = workload.start(backend)?;
    let mut sums: Vec<StageTime> = Vec::new();
    for _ in 0..FRAMES_MEASURED {
        for time in running.step()?.stage_times {
            match sums.iter_mut().find(|sum| sum.stage == time.stage) {
                Some(sum) => sum.time += time.time,
                None => sums.push(time),
            }
        }
    }
    for sum in sums {
        let time = sum.time.as_secs_f64() * 1e6 / FRAMES_MEASURED as f64;
        println!(
            "stage {:<22} N {:>5} contact {:<6}{time:>10.1} us a frame",
            sum.stage, workload.side, workload.contact
        );
    }
    Ok(())
}
