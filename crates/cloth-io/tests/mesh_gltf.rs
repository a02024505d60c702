//! glTF files: what is read and what is refused.

use std::path::Path;

use cloth_io::{MeshError, mesh_read, mesh_read_gltf};

/// Bytes of 4 positions (2 of them equal), 4 texture coordinates and 6 indices: two triangles that
/// an exporter split at a texture seam.
fn buffer() -> Vec<u8> {
    let positions: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [-0.0, 1.0, 0.0],
    ];
    let coordinates: [[f32; 2]; 6] =
        [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [0.25, 1.0], [0.5, 0.5], [0.75, 0.5]];
    let indices: [u16; 6] = [0, 1, 2, 3, 4, 5];
    let mut bytes = Vec::new();
    bytes.extend(positions.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(coordinates.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(indices.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// The JSON of a scene with the buffer at `uri`; the node is moved, and mirrored if told so.
fn json(uri: &str, mirrored: bool) -> String {
    let scale = if mirrored { "[-1,1,1]" } else { "[1,1,1]" };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[0,0,2]}},
                 {{"name":"shirt","mesh":0,"scale":{scale}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2}}]}}],
        "buffers":[{{"byteLength":132{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":72}},{{"buffer":0,"byteOffset":72,"byteLength":48}},
                       {{"buffer":0,"byteOffset":120,"byteLength":12}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":6,"type":"VEC3",
                       "min":[0,0,0],"max":[1,1,0]}},
                     {{"bufferView":1,"componentType":5126,"count":6,"type":"VEC2"}},
                     {{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}]}}"#,
        if uri.is_empty() { String::new() } else { format!(r#","uri":"{uri}""#) },
    )
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend((12 + 8 + json.len() as u32 + 8 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn check(mesh: &cloth_core::TriangleMesh) {
    assert_eq!(
        mesh.positions,
        [[0.0, -2.0, 0.0], [1.0, -2.0, 0.0], [0.0, -2.0, 1.0], [1.0, -2.0, 1.0]],
        "y of the file is up, z towards the viewer"
    );
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    let texture = mesh.texture.as_ref().expect("texture coordinates");
    // Both sides of the seam keep their own coordinate of vertex 1; v points up.
    assert_eq!(texture.coordinates[texture.triangles[0][1] as usize], [1.0, 0.0]);
    assert_eq!(texture.coordinates[texture.triangles[1][0] as usize], [0.25, 0.0]);
    assert_eq!(mesh.groups.len(), 1);
    assert_eq!(mesh.group("shirt").expect("a group").vertices, [0, 1, 2, 3]);
}

#[test]
fn binary_external_and_embedded_buffers_give_the_same_mesh() {
    check(&mesh_read_gltf("test.glb", &glb(&json("", false), &buffer()), None).unwrap());

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), buffer()).unwrap();
    let path = folder.path().join("test.gltf");
    std::fs::write(&path, json("a%20b.bin", false)).unwrap();
    check(&mesh_read(&path).unwrap());

    let percent: String = buffer().iter().map(|byte| format!("%{byte:02x}")).collect();
    let uri = format!("data:application/octet-stream,{percent}");
    check(&mesh_read_gltf("test.gltf", json(&uri, false).as_bytes(), None).unwrap());
}

#[test]
fn mirroring_turns_the_triangles_over() {
    let mesh = mesh_read_gltf("test.glb", &glb(&json("", true), &buffer()), None).unwrap();
    assert_eq!(mesh.positions[1], [-1.0, -2.0, 0.0]);
    assert_eq!(mesh.triangles, [[0, 2, 1], [1, 2, 3]]);
}

/// A file of the mesh above with colours, a weight and an attribute of a kind that is not read.
#[test]
fn colours_and_weights_become_attributes() {
    let json = json("", false)
        .replace("\"TEXCOORD_0\":1", "\"TEXCOORD_0\":1,\"COLOR_0\":3,\"_Pin\":4,\"_FLOW\":5,\"_ID\":6")
        .replace("\"byteLength\":132", "\"byteLength\":260")
        .replace(
            "\"byteOffset\":120,\"byteLength\":12}",
            "\"byteOffset\":120,\"byteLength\":12},{\"buffer\":0,\"byteOffset\":132,\"byteLength\":128}",
        )
        .replace(
            "\"count\":6,\"type\":\"SCALAR\"}",
            "\"count\":6,\"type\":\"SCALAR\"},
             {\"bufferView\":3,\"componentType\":5121,\"count\":6,\"type\":\"VEC4\",\"normalized\":true},
             {\"bufferView\":3,\"byteOffset\":24,\"componentType\":5126,\"count\":6,\"type\":\"SCALAR\"},
             {\"bufferView\":3,\"byteOffset\":48,\"componentType\":5126,\"count\":6,\"type\":\"VEC3\"},
             {\"bufferView\":3,\"byteOffset\":48,\"componentType\":5125,\"count\":6,\"type\":\"SCALAR\"}",
        );
    let mut bytes = buffer();
    // Vertices 1 and 3 of the file are one vertex, and so are 2 and 5.
    let reds = [0_u8, 255, 51, 255, 102, 153];
    bytes.extend(reds.iter().flat_map(|&red| [red, 0, 0, 255]));
    bytes.extend([0.0_f32, 0.25, 0.0, 0.75, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend((0..18).flat_map(|x| (x as f32).to_le_bytes()));
    bytes.resize(260, 0);
    let mesh = mesh_read_gltf("test.glb", &glb(&json, &bytes), None).unwrap();
    let names: Vec<_> = mesh.attributes.iter().map(|found| found.name.as_str()).collect();
    assert_eq!(names, ["alpha", "blue", "flow.x", "flow.y", "flow.z", "green", "pin", "red"]);
    assert_eq!(mesh.attribute("pin").unwrap().values, [0.0, 0.5, 0.0, 1.0], "the mean of two");
    let red = &mesh.attribute("red").unwrap().values;
    for (found, wanted) in red.iter().zip([0.0, 1.0, 0.4, 0.4]) {
        assert!((found - wanted).abs() < 1e-6, "{red:?}");
    }
    assert_eq!(mesh.attribute("flow.y").unwrap().values, [1.0, 7.0, 11.5, 13.0]);
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn buffers_outside_the_folder_are_refused() {
    for uri in ["../secret.bin", "/etc/passwd", "http://host/a.bin", "%2e%2e/secret.bin"] {
        let result =
            mesh_read_gltf("test.gltf", json(uri, false).as_bytes(), Some(Path::new("folder")));
        assert!(matches!(result, Err(MeshError::BufferPath { .. })), "{uri}");
    }
    let result = mesh_read_gltf("test.gltf", json("a.bin", false).as_bytes(), None);
    assert!(matches!(result, Err(MeshError::BufferPath { .. })));
}

#[test]
fn arrays_outside_their_buffer_and_cycles_are_refused() {
    let good = json("", false);
    let cases = [
        ("\"count\":6,\"type\":\"VEC3\"", "\"count\":7,\"type\":\"VEC3\"", "outside its buffer"),
        ("\"byteOffset\":120,", "\"byteOffset\":4294967290,", "outside its buffer"),
        ("\"count\":6,\"type\":\"SCALAR\"", "\"count\":0,\"type\":\"SCALAR\"", ""),
        ("\"componentType\":5123", "\"componentType\":5126", "uncommon number type"),
        ("\"type\":\"VEC3\"", "\"type\":\"VEC4\"", "uncommon number type"),
        ("\"byteLength\":132", "\"byteLength\":99999", "declares 99999 bytes in buffer 0"),
        ("{\"name\":\"shirt\",", "{\"name\":\"shirt\",\"children\":[0],", "reached on two ways"),
    ];
    for (from, to, expected) in cases {
        let broken = good.replace(from, to);
        assert_ne!(broken, good, "{from}");
        let result = mesh_read_gltf("test.glb", &glb(&broken, &buffer()), None);
        let message = result.unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let mut beyond = buffer();
    beyond[120] = 6;
    let message = mesh_read_gltf("test.glb", &glb(&good, &beyond), None).unwrap_err().to_string();
    assert!(message.contains("vertex 6 does not exist"), "{message}");
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = glb(&json("", false), &buffer());
    for length in 0..bytes.len() {
        assert!(mesh_read_gltf("test.glb", &bytes[..length], None).is_err(), "{length}");
    }
}
