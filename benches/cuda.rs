//! The CUDA backend on the common workload, timed by events on the device: medians of frames 10 to 70.
//!
//! `cargo bench --bench cuda -- [--fast] [--quick]`.

use std::time::Instant;

use cloth::{Backend, Result, scene::BenchKind};
use cloth_backend_cuda::{CudaBackend, CudaOptions};
use cloth_benches::{FRAMES_MEASURED, Workload};

/// Bytes that a device of this kind copies in a second, read and written: the floor is made of it.
const BANDWIDTH: f64 = 4.28e12;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn explicit(backend: &dyn Backend, label: &str, side: u32, contact: bool) -> Result<()> {
    let workload = Workload::new(BenchKind::Sphere, side, contact);
    let started = Instant::now();
    let mut running = workload.start(backend)?;
    let (mut device, mut wall, mut rebuilds) = (Vec::new(), Vec::new(), 0);
    let mut last = None;
    for _ in 0..FRAMES_MEASURED {
        let report = running.step()?;
        let stages = report.stage_times.iter().filter(|stage| stage.stage != "measure");
        device.push(stages.map(|stage| stage.time.as_secs_f64()).sum::<f64>() * 1e6);
        wall.push(report.wall_time.as_secs_f64() * 1e6);
        rebuilds += report.contact_rebuilds;
        last = Some(report);
    }
    let Some(report) = last else { return Ok(()) };
    let particles = f64::from(side) * f64::from(side);
    let floor = 17.0 * particles * 64.0 / BANDWIDTH * 1e6;
    println!(
        "{label:<12} {side:>5} {:<7} {:>9.1} us/frame  wall {:>9.1}  floor {floor:>7.1}  strain mean {:.4}  rebuilds/frame {:.1}  contacts {}  ({:.1} s)",
        if contact { "contact" } else { "free" },
        median(device),
        median(wall),
        report.measures.strain_mean,
        f64::from(rebuilds) / FRAMES_MEASURED as f64,
        report.contacts,
        started.elapsed().as_secs_f64(),
    );
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |name: &str| arguments.iter().any(|argument| argument == name);
    if has("--list") || has("--test") {
        return Ok(());
    }
    let sides: &[u32] = if has("--quick") { &[160, 512] } else { &[160, 512, 1024, 2048] };
    for (label, fast, patches) in [
        ("reproducible", false, true),
        ("fast", true, true),
        ("rep. no grid", false, false),
        ("fast no grid", true, false),
    ] {
        let options = CudaOptions { fast, patches, ..CudaOptions::default() };
        let backend = match CudaBackend::new(options) {
            Ok(backend) => backend,
            Err(error) => {
                println!("cuda: not run here: {error}");
                return Ok(());
            }
        };
        for contact in [false, true] {
            for &side in sides {
                if !patches && (contact || side == 2048) {
                    continue;
                }
                explicit(&backend, label, side, contact)?;
            }
        }
    }
    Ok(())
}
