//! Meshes that are written are the meshes that are read back.

use std::path::Path;

use cloth_core::{TextureMap, TriangleMesh, VertexAttribute, VertexGroup};
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
        match *extension {
            "glb" => assert!(mesh.texture.is_some(), "its corners come back, in another order"),
            _ => assert_eq!(mesh.texture, texture, "{extension}"),
        }
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
    assert!(error.to_string().ends_with("use one of: obj, ply, glb"), "{error}");
    let error = written(&folder.path().join("missing").join("mesh.ply"));
    assert!(matches!(error, MeshError::Write { .. }), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// glTF is y up: what is read from it, written and read again stands as it did, attributes included.
#[test]
fn a_mesh_survives_gltf_unrotated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.glb");
    let pin = VertexAttribute { name: "pin".to_owned(), values: vec![0.0, 0.25, 0.5, 1.0] };
    let mesh = TriangleMesh { texture: None, attributes: vec![pin], ..square() };
    mesh_write(&path, &mesh).unwrap();
    let read = mesh_read(&path).unwrap();
    assert_eq!((&read.positions, &read.triangles), (&mesh.positions, &mesh.triangles));
    assert_eq!(read.attributes, mesh.attributes);
    let gltf = gltf::Gltf::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| gltf.blob.as_deref());
    assert_eq!(reader.read_positions().unwrap().nth(1), Some([1.0, 0.25, 0.0]), "y up in the file");
    let ply = folder.path().join("square.ply");
    mesh_write(&ply, &read).unwrap();
    assert_eq!(mesh_read(&ply).unwrap().attributes, mesh.attributes);
}

#[test]
fn groups_are_written_as_points_of_obj() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.obj");
    let group = VertexGroup { name: "left hem".to_owned(), vertices: vec![1, 3] };
    mesh_write(&path, &TriangleMesh { groups: vec![group], ..square() }).unwrap();
    assert_eq!(mesh_read(&path).unwrap().group("left_hem").unwrap().vertices, [1, 3]);
}
