//! Meshes that are written are the meshes that are read back.

use std::path::Path;

use cloth_core::{TextureMap, TriangleMesh};
use cloth_io::{MESH_WRITE_EXTENSIONS, MeshError, mesh_read, mesh_write};

/// A square with a texture seam along its diagonal; all its numbers are exact in single precision.
fn square() -> TriangleMesh {
    TriangleMesh {
        positions: vec![[0.0, 0.0, 0.25], [1.0, 0.0, 0.25], [1.0, 1.0, -0.5], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        texture: Some(TextureMap {
            coordinates: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]],
            triangles: vec![[0, 1, 2], [4, 2, 3]],
        }),
        ..TriangleMesh::default()
    }
}

#[test]
fn every_format_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    for extension in MESH_WRITE_EXTENSIONS {
        let path = folder.path().join(format!("square.{}", extension.to_uppercase()));
        mesh_write(&path, &square()).unwrap();
        let mesh = mesh_read(&path).unwrap();
        assert_eq!(mesh.positions, square().positions, "{extension}");
        assert_eq!(mesh.triangles, square().triangles, "{extension}");
        // PLY has no seams.
        let texture = square().texture.filter(|_| *extension == "obj");
        assert_eq!(mesh.texture, texture, "{extension}");
    }
}

#[test]
fn what_cannot_be_written_is_refused_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    let refused = |change: fn(&mut TriangleMesh)| {
        let mut mesh = square();
        change(&mut mesh);
        mesh_write(&path, &mesh).unwrap_err()
    };
    let error = refused(|mesh| mesh.triangles.clear());
    assert!(matches!(error, MeshError::Empty { what: "triangles", .. }), "{error}");
    let error = refused(|mesh| mesh.positions.clear());
    assert!(matches!(error, MeshError::Empty { what: "vertices", .. }), "{error}");
    let error = refused(|mesh| mesh.positions[2][1] = f64::NAN);
    assert!(matches!(error, MeshError::Position { vertex: 2, .. }), "{error}");
    let error = refused(|mesh| mesh.triangles[1][2] = 4);
    assert!(matches!(error, MeshError::Index { index: 4, count: 4, .. }), "{error}");
    let error = refused(|mesh| mesh.texture.as_mut().unwrap().triangles[1][2] = 5);
    assert!(matches!(error, MeshError::Index { index: 5, count: 5, .. }), "{error}");
    let error = refused(|mesh| mesh.texture.as_mut().unwrap().triangles.clear());
    assert!(matches!(error, MeshError::Syntax { .. }), "{error}");
    let written = |path: &Path| mesh_write(path, &square()).unwrap_err();
    let error = written(&folder.path().join("mesh.stl"));
    assert!(error.to_string().ends_with("use one of: obj, ply"), "{error}");
    let error = written(&folder.path().join("missing").join("mesh.ply"));
    assert!(matches!(error, MeshError::Write { .. }), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
