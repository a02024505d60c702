//! Writes one mesh into a file.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use cloth_core::{TextureMap, TriangleMesh};

use super::{MeshError, MeshPlace};
use crate::file::replace_unsynced;
use crate::frame::{Frame, Topology, obj_write, ply_write};

/// File name extensions that [`mesh_write`] knows, lower case, without the dot.
pub const MESH_WRITE_EXTENSIONS: &[&str] = &["obj", "ply"];

/// Writes `mesh` into the file `path`, which is complete or as it was; the extension selects the
/// format, see [`MESH_WRITE_EXTENSIONS`]. Vertices keep their order. Groups are not written.
///
/// # Errors
///
/// [`MeshError`] if the extension is unknown, the mesh is empty or has non-finite positions or
/// indices out of range, or the file cannot be written.
pub fn mesh_write(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "obj" => mesh_write_obj(path, mesh),
        "ply" => mesh_write_ply(path, mesh),
        _ => Err(MeshError::WriteExtension { file: path.display().to_string() }),
    }
}

/// Writes `mesh` as Wavefront OBJ with texture coordinates, whatever the extension of `path`.
///
/// # Errors
///
/// Those of [`mesh_write`], but for the extension.
pub fn mesh_write_obj(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    write(path, mesh, obj_write)
}

/// Writes `mesh` as binary PLY in single precision with normals, whatever the extension of `path`.
/// Texture coordinates are written if no vertex has two of them.
///
/// # Errors
///
/// Those of [`mesh_write`], but for the extension.
pub fn mesh_write_ply(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    write(path, mesh, ply_write)
}

fn write(
    path: &Path,
    mesh: &TriangleMesh,
    content: impl FnOnce(&mut BufWriter<File>, &Topology, &Frame<'_>) -> io::Result<()>,
) -> Result<(), MeshError> {
    let file = path.display().to_string();
    check(&file, mesh)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    // A mesh is a run of one frame, whose rate does not matter.
    let (triangles, texture) = (mesh.triangles.clone(), mesh.texture.clone());
    let topology = Topology::single(&name, mesh.positions.len(), triangles, texture, 1.0);
    let frame = Frame::new(0, 0.0, &mesh.positions);
    let error = |source| MeshError::Write { file: file.clone(), source };
    let content = |writer: &mut _| content(writer, &topology, &frame).map_err(error);
    replace_unsynced(path, content, error)
}

/// Checks what the writers rely on.
fn check(file: &str, mesh: &TriangleMesh) -> Result<(), MeshError> {
    let file = || file.to_owned();
    if mesh.positions.is_empty() {
        return Err(MeshError::Empty { file: file(), what: "vertices" });
    }
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty { file: file(), what: "triangles" });
    }
    let not_finite = |position: &[f64; 3]| position.iter().any(|x| !x.is_finite());
    if let Some(vertex) = mesh.positions.iter().position(not_finite) {
        return Err(MeshError::Position { file: file(), vertex });
    }
    let index_check = |triangles: &[[u32; 3]], count: usize, what: &'static str| {
        let numbered = triangles.iter().enumerate();
        let mut corners = numbered.flat_map(|(face, corners)| corners.map(|index| (face, index)));
        match corners.find(|&(_, index)| index as usize >= count) {
            None => Ok(()),
            Some((face, index)) => Err(MeshError::Index {
                file: file(),
                place: MeshPlace::Face(face),
                what,
                index: index.into(),
                count,
            }),
        }
    };
    index_check(&mesh.triangles, mesh.positions.len(), "vertex")?;
    let Some(TextureMap { coordinates, triangles }) = &mesh.texture else {
        return Ok(());
    };
    if triangles.len() != mesh.triangles.len() {
        return Err(MeshError::Syntax {
            file: file(),
            place: MeshPlace::File,
            problem: "the texture map has another number of triangles than the mesh".to_owned(),
        });
    }
    index_check(triangles, coordinates.len(), "texture coordinate")
}
