//! Writes one mesh into a file.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use cloth_core::{TextureMap, TriangleMesh, VertexAttribute, VertexGroup};

use super::ply::is_attribute;
use super::{MeshError, MeshPlace};
use crate::file::replace_unsynced;
use crate::frame::{
    Column, Frame, Topology, gltf_mesh_write, obj_write, ply_write_with, points_write,
};

/// File name extensions that [`mesh_write`] knows, lower case, without the dot.
pub const MESH_WRITE_EXTENSIONS: &[&str] = &["obj", "ply", "glb"];

/// Writes `mesh` into the file `path`, which is complete or as it was; the extension selects the
/// format, see [`MESH_WRITE_EXTENSIONS`]. Vertices keep their order, but for glTF, which has a vertex more
/// for each further texture coordinate. OBJ holds groups, PLY and glTF hold attributes.
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
        "glb" => mesh_write_gltf(path, mesh),
        _ => Err(MeshError::WriteExtension { file: path.display().to_string() }),
    }
}

/// Writes `mesh` as Wavefront OBJ with texture coordinates, normals, and each group as points, whatever
/// the extension of `path`.
///
/// # Errors
///
/// Those of [`mesh_write`], but for the extension.
pub fn mesh_write_obj(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    write(path, mesh, |writer, topology, frame| {
        obj_write(writer, topology, frame, &[])?;
        mesh.groups.iter().try_for_each(|group| group_write(writer, group))
    })
}

/// Writes `mesh` as binary PLY in single precision with normals, whatever the extension of `path`.
/// Texture coordinates are written if no vertex has two of them, attributes as further numbers, if
/// their names can be those of properties.
///
/// # Errors
///
/// Those of [`mesh_write`], but for the extension.
pub fn mesh_write_ply(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    // Names in the header are identifiers, and some have a meaning of their own.
    let is_plain = |name: &str| {
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        is_attribute(name) && begins && name.chars().all(is_part)
    };
    let attributes = mesh.attributes.iter().filter(|attribute| is_plain(&attribute.name));
    let columns: Vec<_> =
        attributes.map(|attribute| Column::Float(&attribute.name, &attribute.values)).collect();
    write(path, mesh, |writer, topology, frame| {
        ply_write_with(writer, topology, frame, &[], &columns)
    })
}

/// Writes `mesh` as binary glTF 2.0 in single precision with texture coordinates, normals and
/// attributes, turned to y up as the format wants it, whatever the extension of `path`.
///
/// # Errors
///
/// Those of [`mesh_write`], but for the extension.
pub fn mesh_write_gltf(path: &Path, mesh: &TriangleMesh) -> Result<(), MeshError> {
    write(path, mesh, |writer, topology, frame| {
        gltf_mesh_write(writer, topology, frame, &mesh.attributes)
    })
}

/// Writes the vertices of a group as points, which are members of it alone.
fn group_write(writer: &mut impl Write, group: &VertexGroup) -> io::Result<()> {
    // Spaces part the names of several groups, and `#` begins a comment.
    let plain = |c: char| c.is_whitespace() || c.is_control() || c == '#';
    writeln!(writer, "g {}", group.name.replace(plain, "_"))?;
    points_write(writer, &group.vertices)
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
    // In single precision, as most formats have it.
    let not_finite = |position: &[f64; 3]| position.iter().any(|&x| !(x as f32).is_finite());
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
    let count = mesh.positions.len();
    let mut members = mesh.groups.iter().flat_map(|group| &group.vertices);
    if let Some(&vertex) = members.find(|&&vertex| vertex as usize >= count) {
        let index = vertex.into();
        let place = MeshPlace::File;
        return Err(MeshError::Index { file: file(), place, what: "vertex", index, count });
    }
    let short = |attribute: &&VertexAttribute| attribute.values.len() != count;
    if let Some(VertexAttribute { name, values }) = mesh.attributes.iter().find(short) {
        return Err(MeshError::Syntax {
            file: file(),
            place: MeshPlace::File,
            problem: format!("attribute `{name}` has {} values for {count} vertices", values.len()),
        });
    }
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
    let not_finite = |coordinate: &[f64; 2]| coordinate.iter().any(|&x| !(x as f32).is_finite());
    if let Some(coordinate) = coordinates.iter().position(not_finite) {
        return Err(MeshError::TextureCoordinate { file: file(), coordinate });
    }
    index_check(triangles, coordinates.len(), "texture coordinate")
}
