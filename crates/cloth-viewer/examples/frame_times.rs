//! Time of a frame, simulation and picture together: `frame_times [BACKEND [FRAMES [SIDE...]]]`.
//!
//! The scene is the benchmark patch that falls on a ball, with self-contact, in 17 explicit substeps a
//! frame; pictures have 1280 x 720 pixels.

use std::error::Error;

use cloth::scene::{BenchKind, CompileOptions, bench_scene};
use cloth_viewer::{ClipOptions, Gpu, Overlays, Source, Studio};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let backend = arguments.next().unwrap_or_else(|| "wgpu".into());
    let frames: usize = arguments.next().map_or(Ok(60), |text| text.parse())?;
    let sides: Vec<u32> = arguments.map(|text| text.parse()).collect::<Result<_, _>>()?;
    let sides = if sides.is_empty() { vec![160, 1024] } else { sides };
    let gpu = Gpu::headless(None)?;
    println!("{}, backend {backend}, {frames} frames", gpu.description());
    println!("| particles | contact | ms per frame: least | median | most |");
    println!("|---|---|---|---|---|");
    for side in sides {
        for contact in [false, true] {
            let scene = bench_scene(BenchKind::Sphere, side, contact);
            let options = ClipOptions {
                size: [1280, 720],
                overlays: Some(Overlays::default()),
                backend: backend.clone(),
                frames: None,
                stride: 1,
                still: false,
            };
            let source = Source::Scene(Box::new(scene), CompileOptions::default());
            let mut studio = Studio::new(&gpu, source, &options)?;
            let mut times = studio.frame_times(frames)?;
            times.sort();
            let ms = |index: usize| times[index].as_secs_f64() * 1e3;
            println!(
                "| {side} x {side} | {} | {:.3} | {:.3} | {:.3} |",
                if contact { "on" } else { "off" },
                ms(0),
                ms(times.len() / 2),
                ms(times.len() - 1),
            );
        }
    }
    Ok(())
}
