//! Damaged files of all formats: an error or a valid mesh, never a panic.

use cloth_core::TriangleMesh;
use cloth_io::{MeshError, mesh_read, mesh_read_gltf, mesh_read_obj, mesh_read_ply};
use proptest::prelude::*;

const OBJ: &[u8] = b"o cloth\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvt 1 0\nvt 1 1\n\
    g hem\nf 1/1 2/2 3/3\nf 1/1/1 3/3/1 -1/-1/1\n";
const PLY_TEXT: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
    property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n\
    end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const GLTF: &[u8] = br#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
    "min":[0,0,0],"max":[1,1,0]}]}"#;

fn ply_binary() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\n\
        end_header\n"
        .to_vec();
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    bytes.extend(positions.iter().flat_map(|x| x.to_le_bytes()));
    bytes.push(3);
    bytes.extend([0i32, 1, 2].iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

fn glb() -> Vec<u8> {
    let mut json = GLTF.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((20 + json.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes
}

fn read(format: usize, bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    match format {
        0 => mesh_read_obj("test.obj", bytes),
        1 | 2 => mesh_read_ply("test.ply", bytes),
        _ => mesh_read_gltf("test.glb", bytes, None),
    }
}

fn valid(format: usize) -> Vec<u8> {
    match format {
        0 => OBJ.to_vec(),
        1 => PLY_TEXT.to_vec(),
        2 => ply_binary(),
        3 => GLTF.to_vec(),
        _ => glb(),
    }
}

/// Reads `bytes` and checks what the readers promise.
fn check(format: usize, bytes: &[u8]) {
    let Ok(mesh) = read(format, bytes) else {
        return;
    };
    let count = mesh.positions.len() as u32;
    assert!(count > 0 && !mesh.triangles.is_empty());
    assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
    for &[a, b, c] in &mesh.triangles {
        assert!(a < count && b < count && c < count && a != b && b != c && c != a);
    }
    if let Some(texture) = &mesh.texture {
        assert_eq!(texture.triangles.len(), mesh.triangles.len());
        let count = texture.coordinates.len() as u32;
        assert!(texture.triangles.iter().flatten().all(|&index| index < count));
    }
    for group in &mesh.groups {
        assert!(group.vertices.is_sorted() && group.vertices.iter().all(|&index| index < count));
    }
}

#[test]
fn the_undamaged_files_are_read() {
    for format in 0..5 {
        let mesh = read(format, &valid(format)).unwrap();
        assert_eq!(mesh.positions.len(), if format == 0 { 4 } else { 3 }, "{format}");
    }
}

#[test]
fn unknown_extensions_and_missing_files_are_errors() {
    let problem = mesh_read("shirt.fbx".as_ref()).unwrap_err();
    assert!(problem.to_string().contains("use one of: obj, ply, gltf, glb"), "{problem}");
    assert!(matches!(mesh_read("missing.OBJ".as_ref()), Err(MeshError::Read { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn random_bytes(format in 0usize..5, bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        check(format, &bytes);
    }

    #[test]
    fn mutated_bytes(
        format in 0usize..5,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        length in any::<prop::sample::Index>(),
        cut in any::<bool>(),
    ) {
        let mut bytes = valid(format);
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if cut {
            bytes.truncate(length.index(bytes.len()));
        }
        check(format, &bytes);
    }

    /// Numbers are where sizes, offsets and indices go wrong.
    #[test]
    fn mutated_numbers(
        format in prop::sample::select(vec![0usize, 1, 3]),
        place in any::<prop::sample::Index>(),
        number in prop::sample::select(vec![
            "0", "-1", "-2", "1", "7", "255", "65536", "4294967295", "4294967296", "2147483648",
            "9223372036854775807", "-9223372036854775808", "18446744073709551615", "1e308", "1e400",
            "nan", "5121", "5125", "",
        ]),
    ) {
        let text = String::from_utf8(valid(format)).unwrap();
        let digits = |c: char| c.is_ascii_digit();
        let starts: Vec<_> = text
            .char_indices()
            .filter(|&(at, c)| digits(c) && !text[..at].ends_with(digits))
            .map(|(at, _)| at)
            .collect();
        let start = starts[place.index(starts.len())];
        let length = text[start..].find(|c| !digits(c)).unwrap_or(text.len() - start);
        let text = [&text[..start], number, &text[start + length..]].concat();
        check(format, text.as_bytes());
    }
}
