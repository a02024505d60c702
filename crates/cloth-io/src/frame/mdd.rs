//! Writes a LightWave Motion Designer cache: frame count and point count as i32, the time \[s\] of
//! each frame as f32, then positions \[m\] of 3 × f32 for each frame, all big endian.

use std::io::Write;

use super::FrameError;
use super::container::ContainerSource;
use super::output::output_write;

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let point_count = source.count_i32("particles", source.topology.particle_count)?;
    let frame_count = source.count_i32("frames", source.frames.len())?;
    output_write(source.path, |writer| {
        let mut header = Vec::with_capacity(8 + 4 * source.frames.len());
        header.extend_from_slice(&frame_count.to_be_bytes());
        header.extend_from_slice(&point_count.to_be_bytes());
        for &index in &source.frames {
            header.extend_from_slice(&(source.store.time(index)? as f32).to_be_bytes());
        }
        writer.write_all(&header).map_err(FrameError::write(source.path))?;
        for &index in &source.frames {
            let frame = source.store.frame(index)?;
            let coordinates = frame.positions.iter().flatten();
            let bytes: Vec<u8> = coordinates.flat_map(|x| x.to_be_bytes()).collect();
            writer.write_all(&bytes).map_err(FrameError::write(source.path))?;
        }
        Ok(())
    })
}
