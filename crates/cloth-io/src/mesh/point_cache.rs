//! Point Cache 2: where the vertices of a mesh are at successive times.

use std::path::Path;

use super::{MESH_COUNT_MAX, MESH_FILE_MAX, MeshError, MeshPlace, bytes_read};

/// Bytes before the positions.
const HEADER: usize = 32;
const MAGIC: &[u8; 12] = b"POINTCACHE2\0";

/// Positions of the vertices of a mesh, one set after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCache {
    /// Vertices of the mesh.
    pub points: usize,
    /// The sets \[m\], each with as many positions.
    pub samples: Vec<Vec<[f64; 3]>>,
}

/// Reads a Point Cache 2: a header of 32 bytes, then positions of 3 × f32 for each sample, all little endian. The format says
/// nothing of the time between samples.
///
/// # Errors
/// [`MeshError`] if the file cannot be read, is no point cache, is shorter than its header says, or has positions that are not finite.
pub fn point_cache_read(path: &Path) -> Result<PointCache, MeshError> {
    let file = path.display().to_string();
    point_cache_read_bytes(&file, &bytes_read(path, MESH_FILE_MAX)?)
}

/// The same from `bytes`; `file` is the name used in errors.
///
/// # Errors
/// As [`point_cache_read`].
pub fn point_cache_read_bytes(file: &str, bytes: &[u8]) -> Result<PointCache, MeshError> {
    let wrong = |problem: String| MeshError::Syntax {
        file: file.into(),
        place: MeshPlace::Header,
        problem,
    };
    if bytes.len() < HEADER || !bytes.starts_with(MAGIC) {
        return Err(wrong("it does not begin as a Point Cache 2 does (`POINTCACHE2`)".into()));
    }
    let word = |at: usize| i32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[at + k]));
    let [points, samples] = [word(16), word(28)];
    for (what, count) in [("vertices", points), ("samples", samples)] {
        if count < 1 {
            return Err(wrong(format!("it has {count} {what}")));
        }
    }
    let points = points as u64;
    if points > MESH_COUNT_MAX {
        let (what, limit) = ("vertices", MESH_COUNT_MAX);
        return Err(MeshError::TooLarge { file: file.into(), what, declared: points, limit });
    }
    // The product of two 32-bit numbers and 12 fits.
    let [declared, found] = [samples as u64 * points * 12, (bytes.len() - HEADER) as u64];
    if declared > found {
        return Err(MeshError::Size {
            file: file.into(),
            what: "bytes of positions".into(),
            declared,
            limit: found,
        });
    }
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[k])));
    let mut read = PointCache { points: points as usize, samples: Vec::new() };
    for sample in bytes[HEADER..].chunks_exact(12 * points as usize).take(samples as usize) {
        let position = |at: &[u8]| [0, 4, 8].map(|k| number(&at[k..k + 4]));
        let positions: Vec<[f64; 3]> = sample.chunks_exact(12).map(position).collect();
        if let Some(vertex) = positions.iter().position(|at| at.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::Position { file: file.into(), vertex });
        }
        read.samples.push(positions);
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache(points: i32, samples: i32, numbers: &[f32]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(1_i32.to_le_bytes());
        bytes.extend(points.to_le_bytes());
        bytes.extend(0_f32.to_le_bytes());
        bytes.extend(1_f32.to_le_bytes());
        bytes.extend(samples.to_le_bytes());
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        bytes
    }

    #[test]
    fn positions_come_sample_by_sample() {
        let numbers: Vec<f32> = (0..12).map(|i| i as f32 / 4.0).collect();
        let read = point_cache_read_bytes("a.pc2", &cache(2, 2, &numbers)).unwrap();
        assert_eq!(read.points, 2);
        assert_eq!(read.samples[0], [[0.0, 0.25, 0.5], [0.75, 1.0, 1.25]]);
        assert_eq!(read.samples[1], [[1.5, 1.75, 2.0], [2.25, 2.5, 2.75]]);
        // What comes after that is not looked at.
        assert_eq!(
            point_cache_read_bytes("a.pc2", &cache(2, 1, &numbers)).unwrap().samples.len(),
            1
        );
    }

    #[test]
    fn damage_is_named() {
        let numbers = [0.0; 12];
        for (bytes, words) in [
            (b"OBJ".to_vec(), "does not begin"),
            (cache(0, 2, &numbers), "0 vertices"),
            (cache(2, -1, &numbers), "-1 samples"),
            (cache(2, 3, &numbers), "declares 72 bytes of positions but can hold at most 48"),
            (cache(i32::MAX, i32::MAX, &numbers), "vertices, and at most"),
            (cache(2, 1, &[0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0]), "position of vertex 1"),
        ] {
            let message = point_cache_read_bytes("a.pc2", &bytes).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("a.pc2"), "{message}");
        }
    }
}
