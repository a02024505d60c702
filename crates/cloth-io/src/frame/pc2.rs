//! Writes Point Cache 2: a header of 32 bytes, then positions \[m\] of 3 × f32 for each frame, all
//! little endian.

use std::io::Write;

use super::FrameError;
use super::container::ContainerSource;
use super::output::output_write;

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let point_count = source.count_i32("particles", source.topology.particle_count)?;
    let frame_count = source.count_i32("frames", source.frames.len())?;
    output_write(source.path, |writer| {
        let mut header = Vec::with_capacity(32);
        header.extend_from_slice(b"POINTCACHE2\0");
        header.extend_from_slice(&1i32.to_le_bytes()); // version
        header.extend_from_slice(&point_count.to_le_bytes());
        header.extend_from_slice(&0f32.to_le_bytes()); // first frame
        header.extend_from_slice(&1f32.to_le_bytes()); // frames between samples
        header.extend_from_slice(&frame_count.to_le_bytes());
        writer.write_all(&header).map_err(FrameError::write(source.path))?;
        for &index in &source.frames {
            let frame = source.store.frame(index)?;
            let coordinates = frame.positions.iter().flatten();
            let bytes: Vec<u8> = coordinates.flat_map(|x| x.to_le_bytes()).collect();
            writer.write_all(&bytes).map_err(FrameError::write(source.path))?;
        }
        Ok(())
    })
}
