//! Small files that ask for much time or memory. Bounds on time are a hundred times what is needed, so that they hold
//! on slow machines, and far below what the defects took.

use std::{
    fs,
    time::{Duration, Instant},
};

use cloth_io::{MeshError, mesh_read, mesh_read_gltf, mesh_read_obj};

#[track_caller]
fn within<T>(seconds: u64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    assert!(start.elapsed() < Duration::from_secs(seconds), "took {:?}", start.elapsed());
    result
}

fn base64(bytes: &[u8]) -> String {
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let of = |bits: u32| char::from(letters[(bits & 63) as usize]);
    let triple = |t: &[u8]| {
        let bits = t.iter().fold(0_u32, |bits, &byte| (bits << 8) | u32::from(byte));
        [of(bits >> 18), of(bits >> 12), of(bits >> 6), of(bits)]
    };
    assert!(bytes.len().is_multiple_of(3));
    bytes.chunks(3).flat_map(triple).collect()
}

/// A glTF whose `nodes` nodes all show one mesh of `triangles` triangles with vertices of their own, `uri` being the
/// buffer, which it declares to have `length` bytes.
fn gltf(nodes: usize, triangles: usize, uri: &str, length: u64) -> String {
    let vertices = 3 * triangles;
    let list: Vec<String> = (0..nodes).map(|node| node.to_string()).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "buffers":[{{"byteLength":{length},"uri":"{uri}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3",
                       "min":[0,0,0],"max":[1,1,1]}}]}}"#,
        list.join(","),
        vec![r#"{"mesh":0}"#; nodes].join(","),
        12 * vertices,
    )
}

fn positions(triangles: usize) -> Vec<u8> {
    let triangle = |number: usize| {
        let z = number as f32;
        [0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z]
    };
    (0..triangles).flat_map(triangle).flat_map(f32::to_le_bytes).collect()
}

fn embedded(nodes: usize, triangles: usize) -> String {
    let bytes = positions(triangles);
    let uri = format!("data:application/octet-stream;base64,{}", base64(&bytes));
    gltf(nodes, triangles, &uri, bytes.len() as u64)
}

#[test]
fn a_mesh_that_five_thousand_nodes_show_is_refused_before_memory_is_taken() {
    let text = embedded(5000, 20_000);
    assert!(text.len() < 3 << 20);
    let error = within(60, || mesh_read_gltf("copies.gltf", text.as_bytes(), None)).unwrap_err();
    let MeshError::TooLarge { declared, .. } = &error else { panic!("{error}") };
    assert_eq!(*declared, 4999 * 60_000);
    assert!(error.to_string().contains("vertices in copies"), "{error}");
    // Some copies are what nodes are for.
    let mesh = mesh_read_gltf("few.gltf", embedded(3, 10).as_bytes(), None).unwrap();
    assert_eq!((mesh.positions.len(), mesh.groups.len()), (90, 3));
}

#[test]
fn nodes_of_empty_primitives_count_as_work() {
    let primitives = vec![r#"{"attributes":{"POSITION":0}}"#; 20_000].join(",");
    let text = embedded(20_000, 1).replace(r#"{"attributes":{"POSITION":0}}"#, &primitives);
    let error = within(60, || mesh_read_gltf("work.gltf", text.as_bytes(), None)).unwrap_err();
    assert!(matches!(error, MeshError::TooLarge { .. }), "{error}");
}

#[test]
fn primitives_that_share_their_vertices_read_them_once() {
    let shared = vec![r#"{"attributes":{"POSITION":0},"mode":4}"#; 400].join(",");
    let text = embedded(1, 300).replace(r#"{"attributes":{"POSITION":0}}"#, &shared);
    let mesh = within(60, || mesh_read_gltf("shared.gltf", text.as_bytes(), None)).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (900, 400 * 300));
}

/// Triangles that many primitives make of the same bytes take memory that the size of the file does not announce.
#[test]
fn primitives_that_share_too_many_corners_are_refused_before_memory_is_taken() {
    let shared = vec![r#"{"attributes":{"POSITION":0},"mode":4}"#; 4000].join(",");
    let text = embedded(1, 3000).replace(r#"{"attributes":{"POSITION":0}}"#, &shared);
    assert!(text.len() < 1 << 20);
    let read = within(60, || mesh_read_gltf("shared.gltf", text.as_bytes(), None));
    let Err(MeshError::TooLarge { declared, what, .. }) = &read else { panic!("it is read") };
    assert_eq!((*declared, *what), (4000 * 9000, "corners"));
}

#[test]
fn of_an_external_buffer_only_what_its_views_show_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.gltf");
    // A file with a hole takes no room on the disk; read whole, it would fill the memory.
    let length = 1 << 40;
    let buffer = fs::File::create(folder.path().join("buffer.bin")).unwrap();
    std::io::Write::write_all(&mut &buffer, &positions(2)).unwrap();
    if buffer.set_len(length).is_err() {
        println!("skipped: this file system has no holes");
        return;
    }
    fs::write(&path, gltf(1, 2, "buffer.bin", length)).unwrap();
    let mesh = within(60, || mesh_read(&path)).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    // A view that is too long is a sentence, not an attempt.
    let view = format!("\"byteLength\":{}", 12 * 6);
    let text = gltf(1, 2, "buffer.bin", length).replace(&view, &format!("\"byteLength\":{length}"));
    fs::write(&path, text).unwrap();
    let error = within(60, || mesh_read(&path)).unwrap_err().to_string();
    assert!(error.contains("bytes of external buffers"), "{error}");
    // So is a mesh file of that size.
    let error = within(60, || {
        fs::rename(folder.path().join("buffer.bin"), folder.path().join("huge.obj")).unwrap();
        mesh_read(&folder.path().join("huge.obj"))
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("asks for 1099511627776 bytes"), "{error}");
}

#[test]
fn the_binary_chunk_is_not_copied_for_each_buffer() {
    // Buffers without a place mean the binary chunk, and a file can have any number of them.
    let mut json = gltf(1, 1, "x", 36).replace(r#","uri":"x""#, "");
    let more = vec![r#"{"byteLength":1}"#; 50_000].join(",");
    json = json.replace(
        r#""buffers":[{"byteLength":36}]"#,
        &format!(r#""buffers":[{{"byteLength":36}},{more}]"#),
    );
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let mut binary = positions(1);
    binary.resize(1 << 20, 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", &binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    let mesh = within(60, || mesh_read_gltf("chunk.glb", &bytes, None)).unwrap();
    assert_eq!(mesh.triangles.len(), 1);
}

/// An OBJ whose faces all belong to the groups of `names`.
fn grouped(names: impl Iterator<Item = String>, faces: usize) -> String {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    text += &format!("g {}\n", names.collect::<Vec<_>>().join(" "));
    for face in 0..faces {
        text += &format!("v 0 0 {}\nf 1 2 -1\n", face + 1);
    }
    text
}

#[test]
fn a_face_in_five_thousand_groups_is_refused() {
    let text = grouped((0..5000).map(|name| format!("n{name}")), 10_000);
    let error = within(60, || mesh_read_obj("groups.obj", text.as_bytes())).unwrap_err();
    assert!(error.to_string().contains("line 4: a face is in more than 64 groups"), "{error}");
    let text = grouped((0..60).map(|name| format!("n{name}")), 1000);
    let mesh = within(60, || mesh_read_obj("groups.obj", text.as_bytes())).unwrap();
    assert_eq!(mesh.groups.len(), 60);
    assert!(mesh.groups.iter().all(|group| group.vertices.len() == 1002));
}

#[test]
fn a_long_name_is_not_copied_for_each_group_statement() {
    let mut text = format!("o {}\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", "n".repeat(1000));
    text += &"g a\nf 1 2 3\ng b\nf 1 2 3\n".repeat(50_000);
    let mesh = within(60, || mesh_read_obj("names.obj", text.as_bytes())).unwrap();
    assert_eq!(mesh.groups.len(), 3);
    let text = text.replace("o n", &format!("o {}n", "n".repeat(2000)));
    let error = within(60, || mesh_read_obj("names.obj", text.as_bytes())).unwrap_err();
    assert!(error.to_string().contains("bytes in the name of a group"), "{error}");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.obj");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let device = folder.path().join("zero.ply");
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    fs::write(folder.path().join("mesh.gltf"), gltf(1, 1, "pipe.obj", 36)).unwrap();
    for path in [pipe, device, folder.path().join("mesh.gltf"), folder.path().join("folder.glb")] {
        if path.ends_with("folder.glb") {
            fs::create_dir(&path).unwrap();
        }
        let error = within(60, || mesh_read(&path)).unwrap_err();
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }
}
