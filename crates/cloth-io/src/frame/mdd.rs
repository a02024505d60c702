//! Writes a LightWave Motion Designer cache: frame count and point count as i32, the time \[s\] of
//! each frame as f32, then positions \[m\] of 3 × f32 for each frame, all big endian.

use std::io::Write;

use super::FrameError;
use super::output::output_write;
use super::point_cache::CacheSource;

pub(super) fn write(cache: &CacheSource<'_>) -> Result<(), FrameError> {
    let [point_count, frame_count] = cache.counts()?;
    output_write(cache.path, |writer| {
        let frames = &cache.source.frames;
        let mut header = Vec::with_capacity(8 + 4 * frames.len());
        header.extend_from_slice(&frame_count.to_be_bytes());
        header.extend_from_slice(&point_count.to_be_bytes());
        for &index in frames {
            header.extend_from_slice(&(cache.source.store.time(index)? as f32).to_be_bytes());
        }
        writer.write_all(&header).map_err(FrameError::write(cache.path))?;
        cache.positions(writer, f32::to_be_bytes)
    })
}
