//! Writes Point Cache 2: a header of 32 bytes, then positions \[m\] of 3 × f32 for each frame, all
//! little endian. The format has no frame rate.

use std::io::Write;

use super::FrameError;
use super::output::output_write;
use super::point_cache::CacheSource;

pub(super) fn write(cache: &CacheSource<'_>) -> Result<(), FrameError> {
    let [point_count, frame_count] = cache.counts()?;
    output_write(cache.path, |writer| {
        let mut header = Vec::with_capacity(32);
        header.extend_from_slice(b"POINTCACHE2\0");
        header.extend_from_slice(&1i32.to_le_bytes()); // version
        header.extend_from_slice(&point_count.to_le_bytes());
        header.extend_from_slice(&0f32.to_le_bytes()); // first frame
        header.extend_from_slice(&1f32.to_le_bytes()); // frames between samples
        header.extend_from_slice(&frame_count.to_le_bytes());
        writer.write_all(&header).map_err(FrameError::write(cache.path))?;
        cache.positions(writer, f32::to_le_bytes)
    })
}
