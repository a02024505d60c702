//! Writes a short made-up motion of a tablecloth in every output format.
//!
//! `cargo run --release -p cloth-io --example frame_formats -- FOLDER [SIDE [FRAMES]]`

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use cloth_core::TextureMap;
use cloth_io::{
    ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, FrameStore, PictureShape,
    PictureShapes, PictureStyle, Topology, container_write,
};

/// Frames in a second of the motion.
const FRAMES_PER_SECOND: f64 = 24.0;
/// Radius of the ball below the cloth [m].
const RADIUS: f64 = 0.35;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("name an output folder")?);
    let side: usize = arguments.next().map_or(Ok(64), |text| text.parse())?;
    let frame_count: usize = arguments.next().map_or(Ok(36), |text| text.parse())?;
    let topology = grid_topology(side);
    let style = PictureStyle {
        shapes: PictureShapes::fixed(vec![
            PictureShape::Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 }.into(),
            PictureShape::Sphere { center: [0.0, 0.0, 0.55], radius: RADIUS }.into(),
        ]),
        ..PictureStyle::default()
    };
    std::fs::create_dir_all(&folder)?;
    let store = sequences_write(&folder, &topology, side, frame_count, &style)?;
    for format in FrameFormat::ALL {
        if format.is_sequence() {
            continue;
        }
        let mut options = ContainerOptions { style: style.clone(), ..ContainerOptions::default() };
        if format.is_picture() {
            (options.style.width, options.style.height) = (640, 360);
        }
        let path = folder.join(format!("tablecloth.{}", format.extension()));
        let start = Instant::now();
        let report = container_write(format, &path, &topology, &store, &options)?;
        println!("{format}: {:?} in {:.2?}", report.files, start.elapsed());
        for warning in report.warnings {
            println!("warning: {warning}");
        }
    }
    Ok(())
}

/// Computes the motion, writes each frame in all sequence formats and keeps the frames.
fn sequences_write(
    folder: &Path,
    topology: &Topology,
    side: usize,
    frame_count: usize,
    style: &PictureStyle,
) -> Result<FrameStore, Box<dyn Error>> {
    let mut store = FrameStore::create(&folder.join("frames.cloth"), topology)?;
    let mut writers = Vec::new();
    for format in FrameFormat::ALL {
        if format.is_sequence() {
            let subfolder = folder.join(format.name());
            let writer = FrameSequenceWriter::new(format, &subfolder, "tablecloth", topology)?;
            writers.push((format, writer.with_style(style.clone())));
        }
    }
    for index in 0..frame_count {
        let time = index as f64 / FRAMES_PER_SECOND;
        let progress = index as f64 / (frame_count - 1).max(1) as f64;
        let positions = draped_positions(side, progress);
        let velocities = vec![[0.0, 0.0, -0.5]; positions.len()];
        let frame =
            Frame { velocities: Some(&velocities), ..Frame::new(index as u64, time, &positions) };
        store.append(time, &positions)?;
        for (format, writer) in &mut writers {
            let start = Instant::now();
            let path = writer.write(&frame)?;
            if index == 0 {
                println!("{format}: {} in {:.2?}", path.display(), start.elapsed());
            }
        }
    }
    Ok(store)
}

/// A square grid of particles with texture coordinates.
fn grid_topology(side: usize) -> Topology {
    let mut triangles = Vec::new();
    for row in 0..side as u32 - 1 {
        for column in 0..side as u32 - 1 {
            let corner = row * side as u32 + column;
            let above = corner + side as u32;
            triangles.push([corner, corner + 1, above + 1]);
            triangles.push([corner, above + 1, above]);
        }
    }
    let part = |index: usize| index as f64 / (side - 1) as f64;
    let texture = TextureMap {
        coordinates: (0..side * side)
            .map(|index| [part(index % side), part(index / side)])
            .collect(),
        triangles: triangles.clone(),
    };
    let particle_count = side * side;
    Topology::single("tablecloth", particle_count, triangles, Some(texture), FRAMES_PER_SECOND)
}

/// A square of 1.4 m that hangs over the ball with folds, from flat (`progress` 0) to hanging (1).
fn draped_positions(side: usize, progress: f64) -> Vec<[f64; 3]> {
    let part = |index: usize| 1.4 * (index as f64 / (side - 1) as f64 - 0.5);
    let position = |index: usize| {
        let (x, y) = (part(index % side), part(index / side));
        let (distance, angle) = (x.hypot(y), y.atan2(x));
        let top = 0.55 + RADIUS + 0.01;
        let bend = RADIUS / progress.max(1e-3);
        // The sheet rolls onto a ball that shrinks towards the real one, and hangs below its edge.
        let arc = (distance / bend).min(1.35);
        let hanging = distance - arc * bend;
        let folds = 0.5 * hanging * progress * (1.0 + (8.0 * angle).cos());
        let radius = bend * arc.sin() + hanging * 0.25 + 0.28 * folds;
        let height = top - bend * (1.0 - arc.cos()) - 0.92 * hanging;
        [radius * angle.cos(), radius * angle.sin(), height.max(0.004 + 0.02 * hanging)]
    };
    (0..side * side).map(position).collect()
}
