//! How many vertices a mesh file holds, found without reading the mesh.

use std::{
    io::{self, BufRead, BufReader, Read},
    path::Path,
};

use cloth_io::file_open;

/// Longer headers are no headers.
const PLY_HEADER_MAX: u64 = 1 << 20;

/// Bytes of a glTF file for each vertex: three coordinates and two triangles, 32 bits each.
const GLTF_VERTEX_BYTES: u64 = 3 * 4 + 2 * 3 * 4;

/// Text is scanned in pieces of this size, so that a file of gigabytes takes no memory.
const SCAN_BYTES: usize = 1 << 18;

/// Vertices of the mesh in the file `path`: as declared by the header of a PLY, as counted in an
/// OBJ, and guessed from the size of a glTF file, whose buffers may even lie in other files.
///
/// Nothing but regular files is opened: reading from a pipe would take the mesh away.
pub(super) fn vertex_count(path: &Path) -> io::Result<u64> {
    let metadata = path.metadata()?;
    if !metadata.is_file() {
        return Ok(0);
    }
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    match extension.as_deref().and_then(|extension| extension.to_str()) {
        // A header can promise anything; the file has at least a byte for each vertex. The reader
        // of meshes has the better message for a false promise.
        Some("ply") => Ok(ply_vertices(file_open(path)?)?.min(metadata.len())),
        Some("obj") => obj_vertices(BufReader::with_capacity(SCAN_BYTES, file_open(path)?)),
        _ => Ok(metadata.len() / GLTF_VERTEX_BYTES),
    }
}

/// The number in the line `element vertex NUMBER` of a PLY header; 0 if there is none.
fn ply_vertices(file: impl Read) -> io::Result<u64> {
    let mut reader = BufReader::new(file.take(PLY_HEADER_MAX));
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line)? > 0 {
        let text = String::from_utf8_lossy(&line);
        let mut words = text.split_ascii_whitespace();
        match [words.next(), words.next(), words.next()] {
            [Some("element"), Some("vertex"), Some(count)] => {
                return Ok(count.parse().unwrap_or(0));
            }
            [Some("end_header"), ..] => break,
            _ => line.clear(),
        }
    }
    Ok(0)
}

/// Counts the lines of an OBJ file whose first word is `v`.
fn obj_vertices(mut reader: impl BufRead) -> io::Result<u64> {
    enum Place {
        LineStart,
        AfterV,
        Elsewhere,
    }
    let mut count = 0;
    let mut place = Place::LineStart;
    loop {
        let piece = reader.fill_buf()?;
        if piece.is_empty() {
            return Ok(count);
        }
        for &byte in piece {
            place = match (place, byte) {
                (_, b'\n') => Place::LineStart,
                (Place::LineStart, b' ' | b'\t') => Place::LineStart,
                (Place::LineStart, b'v') => Place::AfterV,
                (Place::AfterV, b' ' | b'\t') => {
                    count += 1;
                    Place::Elsewhere
                }
                _ => Place::Elsewhere,
            };
        }
        let length = piece.len();
        reader.consume(length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obj_has_as_many_vertices_as_lines_that_start_with_v() {
        let text = "# v 1\no v\nv 0 0 0\n  v\t1 0 0\nvt 0 0\nvn 0 0 1\nvp 0\nv 1 1 0\r\nf 1 2 3\nv";
        // Pieces of any size: words are cut in two.
        for piece in 1..=text.len() {
            let reader = BufReader::with_capacity(piece, text.as_bytes());
            assert_eq!(obj_vertices(reader).unwrap(), 3, "pieces of {piece} bytes");
        }
    }

    #[test]
    fn a_ply_has_as_many_vertices_as_its_header_says() {
        let header = "ply\r\nformat ascii 1.0\r\ncomment element vertex 9\r\nelement face 7\r\n";
        let count = |text: String| ply_vertices(text.as_bytes()).unwrap();
        assert_eq!(count(format!("{header}element vertex 1234\r\nend_header\r\n")), 1234);
        assert_eq!(count(format!("{header}end_header\nelement vertex 5\n")), 0);
        assert_eq!(count(format!("{header}element vertex many\nend_header\n")), 0);
        assert_eq!(count(String::new()), 0);
    }

    #[test]
    fn a_header_cannot_promise_more_vertices_than_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("false.PLY");
        let header = "ply\nformat ascii 1.0\nelement vertex 999999999999\nend_header\n";
        std::fs::write(&path, header).unwrap();
        assert_eq!(vertex_count(&path).unwrap(), header.len() as u64);
        assert_eq!(vertex_count(folder.path()).unwrap(), 0, "a folder");
    }
}
