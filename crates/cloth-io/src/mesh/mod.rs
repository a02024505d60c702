//! Triangle meshes from OBJ, PLY and glTF files, and into the same.
//!
//! Every reader keeps the vertices in file order with their file indices, because pins and
//! constraints of a scene refer to them, and every reader checks the mesh before it hands it out:
//! finite positions, face indices in range, no corner twice in one face.

mod assembly;
mod error;
mod gltf;
mod gltf_accessor;
mod gltf_attribute;
mod gltf_buffer;
mod obj;
mod ply;
mod point_cache;
mod write;

use std::path::Path;

use cloth_core::TriangleMesh;

use crate::file::file_read;

pub use error::{MeshError, MeshPlace};
pub use gltf::mesh_read_gltf;
pub use obj::mesh_read_obj;
pub use ply::mesh_read_ply;
pub use point_cache::{PointCache, point_cache_read, point_cache_read_bytes};
pub use write::{
    MESH_WRITE_EXTENSIONS, mesh_write, mesh_write_gltf, mesh_write_obj, mesh_write_ply,
};

/// File name extensions that [`mesh_read`] knows, lower case, without the dot.
pub const MESH_EXTENSIONS: &[&str] = &["obj", "ply", "gltf", "glb"];

/// Larger than the largest mesh that can be read.
const MESH_FILE_MAX: u64 = 4 << 30;

/// Most vertices of a mesh, and most triangles: a cloth of so many particles needs ten gigabytes.
pub(crate) const MESH_COUNT_MAX: u64 = 1 << 24;

/// The bytes of a file that is no longer than `limit`.
fn bytes_read(path: &Path, limit: u64) -> Result<Vec<u8>, MeshError> {
    let file = path.display().to_string();
    let bytes = path.metadata().and_then(|metadata| match metadata.len() {
        // The length of what is not a file means nothing.
        length if metadata.is_file() && length > limit => Ok(Err(length)),
        _ => file_read(path, limit).map(Ok),
    });
    match bytes {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(declared)) => Err(MeshError::TooLarge { file, what: "bytes", declared, limit }),
        Err(source) => Err(MeshError::Read { file, source }),
    }
}

/// Reads the mesh in the file `path`; the extension selects the format, see [`MESH_EXTENSIONS`].
///
/// Positions are taken as metres. glTF is y up by its specification, so what comes from there is
/// turned to the axes of the engine, z up; OBJ and PLY say nothing of axes and are taken as they are.
///
/// # Errors
///
/// [`MeshError`] if the file cannot be read, its format is unknown or damaged, or the mesh in it
/// is empty or has non-finite positions or invalid faces.
pub fn mesh_read(path: &Path) -> Result<TriangleMesh, MeshError> {
    let file = path.display().to_string();
    let extension = path
        .extension()
        .map(|extension| extension.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default();
    if !MESH_EXTENSIONS.contains(&extension.as_str()) {
        return Err(MeshError::Extension { file });
    }
    let bytes = bytes_read(path, MESH_FILE_MAX)?;
    match extension.as_str() {
        "obj" => mesh_read_obj(&file, &bytes),
        "ply" => mesh_read_ply(&file, &bytes),
        _ => mesh_read_gltf(&file, &bytes, path.parent()),
    }
}
