//! A scene without triangles in every format.

use std::fs::File;

use crate::place::Place;

/// Six particles on a line, held at one end.
const ROPE: &str = r##"name = "rope"
simulation = { frames = 3, frames_per_second = 30, time_step = 1e-3 }
view = { eye = [0.5, -2, 1], target = [0.5, 0, 0.9] }

[[cloth]]
name = "rope"
pins = [0]
colour = "#c03020"

[cloth.material]
thickness = 0.01
mass.per_particle = 0.01
stretch.stiffness = 100
shear.stiffness = 100
bend.stiffness = 1

[cloth.geometry.network]
width = 6
positions = [[0, 0, 1], [0.2, 0, 1], [0.4, 0, 1], [0.6, 0, 1], [0.8, 0, 1], [1, 0, 1]]
prototype = [{ class = "stretch", stiffness = 100, length = 0.2 }]

[[collider]]
name = "floor"
shape.plane = {}
"##;

const FORMATS: &str = "obj,ply,vtu,png,gltf,pc2,mdd,npz,gif,apng";

fn lines_starting(text: &str, start: &str) -> usize {
    text.lines().filter(|line| line.starts_with(start)).count()
}

#[test]
fn a_rope_is_lines_and_points_in_every_format() {
    let place = Place::with("rope.toml", ROPE);
    let said = place.succeeds(&["run", "rope.toml", "--format", FORMATS]);
    assert_eq!(said.matches("rope_mesh.obj").count(), 1, "each file is named once: {said}");
    let text = |name: &str| String::from_utf8_lossy(&place.read(name)).into_owned();
    for frame in 0..=3 {
        let obj = text(&format!("out/rope/obj/rope_{frame:06}.obj"));
        let found = ["v ", "l ", "f "].map(|start| lines_starting(&obj, start));
        assert_eq!(found, [6, 5, 0], "{obj}");
        let ply = text(&format!("out/rope/ply/rope_{frame:06}.ply"));
        assert!(ply.contains("element vertex 6") && ply.contains("element edge 5"), "{ply}");
        let vtu = text(&format!("out/rope/vtu/rope_{frame:06}.vtu"));
        assert!(vtu.contains("NumberOfPoints=\"6\"") && vtu.contains("NumberOfCells=\"5\""));
        image::open(place.path(&format!("out/rope/png/rope_{frame:06}.png"))).unwrap();
    }
    let mesh = text("out/rope/rope_mesh.obj");
    assert_eq!(["v ", "l ", "f "].map(|start| lines_starting(&mesh, start)), [6, 5, 0], "{mesh}");

    let glb = place.read("out/rope/rope.glb");
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let mode = &json["meshes"][0]["primitives"][0]["mode"];
    assert_eq!(mode, 1, "lines: {}", json["meshes"]);
    assert!(json["animations"].is_array());
    // Four frames of six points, after their headers.
    assert_eq!(place.read("out/rope/rope.pc2").len(), 32 + 4 * 6 * 12);
    assert_eq!(place.read("out/rope/rope.mdd").len(), 8 + 4 * 4 + 4 * 6 * 12);
    let mut npz =
        zip::ZipArchive::new(File::open(place.path("out/rope/rope.npz")).unwrap()).unwrap();
    let positions = npyz::NpyFile::new(npz.by_name("positions.npy").unwrap()).unwrap();
    assert_eq!(positions.shape(), [4, 6, 3]);
    for clip in ["out/rope/rope.gif", "out/rope/rope.png"] {
        assert!(place.read(clip).len() > 200, "{clip}");
    }
}

#[test]
fn a_rope_is_seen_converted_and_run_in_every_way() {
    let place = Place::with("rope.toml", ROPE);
    place.succeeds(&["run", "rope.toml", "--format", "png", "--out", "o"]);
    for (number, format) in FORMATS.split(',').enumerate() {
        let to = format!("c{number}");
        place.succeeds(&["convert", "o", &to, "--format", format, "--picture-size", "160x90"]);
        assert!(place.path(&to).exists(), "{format}");
    }
    let drawn = image::open(place.path("c3/rope_000003.png")).unwrap().into_rgb8();
    let is_red = |p: &&image::Rgb<u8>| i32::from(p[0]) > i32::from(p[1]) + 40;
    assert!(drawn.pixels().filter(is_red).count() > 20, "the rope is seen");
    for solver in ["explicit", "implicit", "semi-implicit"] {
        place.succeeds(&["run", "rope.toml", "--solver", solver, "--format", "none"]);
    }
    place.succeeds(&["run", "rope.toml", "--format", "obj,vtu,gltf", "--with", "colliders"]);
    place.succeeds(&["convert", "rope.toml", "rope.fysl"]);
    place.succeeds(&["run", "rope.fysl", "--format", FORMATS, "--out", "again"]);
    assert_eq!(place.read("again/rope.pc2"), {
        place.succeeds(&["convert", "o", "first.pc2"]);
        place.read("first.pc2")
    });
    // A mesh of it is none, which is said.
    let message = place.fails(3, &["convert", "c0/rope_000003.obj", "mesh.ply"]);
    assert!(message.contains("has no triangles"), "{message}");
}
