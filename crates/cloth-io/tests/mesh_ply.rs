//! PLY files: what is read and what is refused.

use cloth_io::{MeshError, MeshPlace, mesh_read_ply};

const TEXT: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\n\
    property double x\nproperty float y\nproperty int z\nproperty float s\nproperty float t\n\
    element face 1\nproperty list uchar int vertex_indices\nproperty uchar red\nend_header\n\
    0.1 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 5 0 1\n4 0 1 2 3 255\n";

/// Colours of whole numbers are parts of one; normals and texture coordinates are no attributes.
#[test]
fn numbers_of_vertices_become_attributes() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty uchar red\n\
                property float y\nproperty float nx\nproperty float z\nproperty short weight\n\
                property ushort green\nproperty list uchar int ring\nelement face 1\n\
                property list uchar int vertex_indices\nend_header\n\
                0 255 0 1 0 -7 65535 0\n1 51 0 1 0 3 0 1 9\n0 0 1 1 0 0 13107 0\n3 0 1 2\n";
    let mesh = mesh_read_ply("test.ply", text.as_bytes()).unwrap();
    let names: Vec<_> = mesh.attributes.iter().map(|found| found.name.as_str()).collect();
    assert_eq!(names, ["red", "weight", "green"]);
    assert_eq!(mesh.attribute("red").unwrap().values, [1.0, 0.2, 0.0]);
    assert_eq!(mesh.attribute("weight").unwrap().values, [-7.0, 3.0, 0.0]);
    assert_eq!(mesh.attribute("green").unwrap().values, [1.0, 0.0, 0.2]);
    assert_eq!(mesh.positions[1], [1.0, 0.0, 0.0]);
}

#[test]
fn text_with_mixed_types_and_texture() {
    let mesh = mesh_read_ply("test.ply", TEXT.as_bytes()).unwrap();
    assert_eq!(mesh.positions[0], [0.1, 0.0, 0.0]);
    assert_eq!(mesh.positions[3], [0.0, 1.0, 5.0]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let texture = mesh.texture.unwrap();
    assert_eq!(texture.coordinates[2], [1.0, 1.0]);
    assert_eq!(texture.triangles, mesh.triangles);
}

/// A triangle in either byte order.
fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty double x\n\
         property double y\nproperty float z\nelement edge 1\nproperty int vertex1\n\
         element face 1\nproperty list uchar uint vertex_index\nend_header\n"
    )
    .into_bytes();
    let double = |value: f64| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    let float = |value: f32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    let int = |value: u32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    for [x, y, z] in [[0.1, 0.0, 0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        bytes.extend(double(x));
        bytes.extend(double(y));
        bytes.extend(float(z as f32));
    }
    bytes.extend(int(7));
    bytes.push(3);
    bytes.extend([2, 1, 0].into_iter().flat_map(int));
    bytes
}

#[test]
fn binary_in_both_byte_orders() {
    for big in [false, true] {
        let mesh = mesh_read_ply("test.ply", &binary(big)).unwrap();
        assert_eq!(mesh.positions[0], [0.1, 0.0, 0.5]);
        assert_eq!(mesh.triangles, [[2, 1, 0]]);
        assert_eq!(mesh.texture, None);
    }
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = binary(false);
    for length in 0..bytes.len() {
        assert!(mesh_read_ply("test.ply", &bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn impossible_counts_are_refused_before_allocation() {
    for format in ["ascii", "binary_little_endian"] {
        for properties in ["property float x\nproperty float y\nproperty float z\n", ""] {
            let text = format!(
                "ply\nformat {format} 1.0\nelement vertex 1000000000000\n{properties}end_header\n0 0 0\n"
            );
            let problem = mesh_read_ply("test.ply", text.as_bytes()).unwrap_err();
            assert!(matches!(problem, MeshError::Size { declared: 1_000_000_000_000, .. }));
        }
    }
}

#[test]
fn errors_name_the_place() {
    let broken = TEXT.replace("1 1 0 1 1", "1 one 0 1 1");
    let problem = mesh_read_ply("test.ply", broken.as_bytes()).unwrap_err();
    let line = 1 + TEXT.lines().position(|line| line == "1 1 0 1 1").unwrap();
    assert!(
        matches!(problem, MeshError::Syntax { place: MeshPlace::Line(found), .. } if found == line),
        "{problem}"
    );
    let broken = TEXT.replace("4 0 1 2 3", "4 0 1 2 4");
    let message = mesh_read_ply("test.ply", broken.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("face 0 (counted from 0): vertex 4 does not exist, the file has 4"));
    let broken = TEXT.replace("4 0 1 2 3", "4 0 1 2 -1");
    let message = mesh_read_ply("test.ply", broken.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("vertex -1 does not exist"), "{message}");
    let broken = TEXT.replace("property float y", "property float other");
    let problem = mesh_read_ply("test.ply", broken.as_bytes()).unwrap_err();
    assert!(matches!(problem, MeshError::Position { vertex: 0, .. }), "{problem}");
}
