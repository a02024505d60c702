//! `cloth audit`, `cloth run --audit`, and what `cloth check` says of intersections.

use crate::place::{MESH, Place, SQUARE, TINY};

/// A square, and a triangle that goes through it.
const PIERCED: &str = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv .6 .2 .5\nv .7 .2 1.5\nv .6 .3 1.5\nf 1 2 3\nf 1 3 4\nf 5 6 7\n";

#[test]
fn a_mesh_is_audited() {
    let place = Place::with("square.obj", SQUARE);
    let text = place.succeeds(&["audit", "square.obj"]);
    assert!(text.contains("frame 0: 0 pairs of triangles within cloths"), "{text}");
    place.write("pierced.obj", PIERCED);
    let message = place.fails(5, &["audit", "pierced.obj"]);
    assert!(
        message.contains("`pierced.obj`: triangles intersect in 1 of 1 frame, at most 1 pair")
            && message.contains("triangles 0 and 2 near [0.6"),
        "{message}"
    );
    // Vertices in one place are one: a square whose triangles share no vertex.
    let split = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3\nf 4 5 6\n";
    place.write("split.obj", split);
    place.succeeds(&["audit", "split.obj"]);
    let message = place.fails(3, &["audit", "."]);
    assert!(!message.is_empty());
    place.write("notes.txt", "mine");
    let message = place.fails(2, &["audit", "notes.txt"]);
    assert!(message.contains("give the folder of a run or a mesh"), "{message}");
    place.fails(3, &["audit", "missing.obj"]);
}

#[test]
fn frames_of_a_run_are_audited() {
    let place = Place::with("tiny.toml", TINY);
    let arguments = ["run", "tiny.toml", "--audit", "--format", "none", "--out", "o"];
    let text = place.succeeds(&arguments);
    assert!(text.contains("audit: no triangles intersect in 3 frames"), "{text}");
    let report = String::from_utf8(place.read("o/report.jsonl")).unwrap();
    assert_eq!(report.matches("\"intersections_within\":0,").count(), 3, "{report}");
    let text = place.succeeds(&["audit", "o"]);
    assert_eq!(text.lines().count(), 4, "{text}");
    let json = place.succeeds(&["audit", "o", "--json", "--frame-stride", "2"]);
    let frames: Vec<serde_json::Value> =
        json.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let numbers: Vec<_> = frames.iter().map(|line| line["frame"].as_u64().unwrap()).collect();
    assert_eq!(numbers, [0, 2, 3], "the last one is always there");
    assert_eq!(frames[1]["intersections_between"], 0);
    place.succeeds(&["run", "tiny.toml", "--format", "none", "--out", "p"]);
    let report = String::from_utf8(place.read("p/report.jsonl")).unwrap();
    assert!(!report.contains("intersections"), "nobody asked for it: {report}");
}

/// The negative control: cloth that intersects is seen, by all three.
#[test]
fn input_that_intersects_is_reported() {
    let place = Place::with("mesh.obj", PIERCED);
    place.write("meshed.toml", MESH);
    let text = place.succeeds(&["check", "meshed.toml"]);
    assert!(text.contains("intersecting 1 pair of triangles within cloths"), "{text}");
    assert!(
        text.contains("warning: cloth intersects at the start, first triangle 0 of `shirt` and 2"),
        "{text}"
    );
    let arguments = ["run", "meshed.toml", "--audit", "--format", "none", "--out", "o"];
    let text = place.succeeds(&arguments);
    assert!(text.contains("warning: triangles intersect in 2 of 2 frames"), "{text}");
    let message = place.fails(5, &["audit", "o"]);
    assert!(message.contains("first in frame 0: triangle 0 of `shirt`"), "{message}");
}

/// Cloth that crosses cloth, and a ball, at the start is pulled apart if the scene asks for it, and stays so; what is held cannot be.
#[test]
fn input_that_intersects_is_recovered() {
    let scene = r#"
simulation = { frames = 8, frames_per_second = 30 }
contact = { recover = true }
[[cloth]]
name = "low"
material.preset = "jersey"
geometry.grid = { columns = 21, rows = 21, size = [0.4, 0.4], centre = [0, 0, 0.095] }
[[cloth]]
name = "high"
material.preset = "denim"
geometry.grid = { columns = 15, rows = 15, size = [0.2, 0.2], centre = [0.03, 0, 0.1], column_axis = [1, 0, 0.1], row_axis = [0, 1, 0] }
[[collider]]
name = "ball"
shape.sphere.radius = 0.1
friction = 0.3
"#;
    let place = Place::with("crossed.toml", scene);
    let text = place.succeeds(&["check", "crossed.toml"]);
    assert!(text.contains("note: cloth that intersected was pulled apart: "), "{text}");
    assert!(
        text.contains("0 with bodies, 0 crossing edges") && !text.contains("warning"),
        "{text}"
    );
    let run = ["run", "crossed.toml", "--audit", "--format", "none"];
    let text = place.succeeds(&run);
    assert!(text.contains("audit: no triangles intersect in 8 frames"), "{text}");
    place.write("crossed.toml", scene.replace("{ recover = true }", "{ recover = false }"));
    let text = place.succeeds(&["check", "crossed.toml"]);
    assert!(text.contains("`contact.recover = true` pulls it apart before"), "{text}");
    let output = place.output(&[&run[..], &["--overwrite"]].concat());
    let [text, errors] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(errors.contains("warning: cloth intersects at the start, first triangle"), "{errors}");
    assert!(text.contains("warning: triangles intersect in 8 of 8 frames"), "{text}");
    let held: Vec<String> = (0..441).map(|i| i.to_string()).collect();
    let held = format!("[{}]", held.join(", "));
    let all = scene.replace("name = \"low\"", &format!("name = \"low\"\npins = {held}"));
    place.write("crossed.toml", all);
    let text = place.succeeds(&["check", "crossed.toml"]);
    assert!(text.contains("warning: cloth that intersects could not be pulled apart in"), "{text}");
    place.write(
        "crossed.toml",
        scene.replace("true", "true, distance = 0.01, response.penalty.stiffness = 9"),
    );
    let message = place.fails(3, &["check", "crossed.toml"]);
    assert!(message.contains("contact.recover") && message.contains("of triangles"), "{message}");
}

/// Two sheets that fall onto each other on a ball.
const TOUCHING: &str = r#"name = "touching"
[simulation]
frames = 6
frames_per_second = 30
[contact]
distance = 0.004
[[cloth]]
material.preset = "cotton-broad"
geometry.grid = { columns = 9, rows = 9, spacing = 0.02, centre = [0, 0, 0.11] }
[[cloth]]
material.preset = "cotton-broad"
geometry.grid = { columns = 9, rows = 9, spacing = 0.02, centre = [0, 0, 0.12] }
[[collider]]
shape.sphere.radius = 0.1
"#;

#[test]
fn contacts_are_written_for_every_frame() {
    let place = Place::with("touching.toml", TOUCHING);
    let run = |more: &[&str]| {
        let first = ["run", "touching.toml", "--format", "none", "--out", "o"];
        place.succeeds(&[&first, more].concat())
    };
    run(&["--contacts", "vtu"]);
    let last = String::from_utf8_lossy(&place.read("o/contacts/contacts_000006.vtu")).into_owned();
    assert!(last.contains("Name=\"friction\"") && !last.contains("NumberOfPoints=\"0\""));
    // Those of the run before go, and nothing else.
    place.write("o/contacts/mine.txt", "mine");
    run(&["--contacts", "npz", "--overwrite", "--frames", "2"]);
    let left: Vec<_> = std::fs::read_dir(place.path("o/contacts")).unwrap().collect();
    assert_eq!(left.len(), 3, "{left:?}");
    place.write("tiny.toml", TINY);
    let arguments = ["run", "tiny.toml", "--contacts", "npz", "--format", "none", "--out", "p"];
    let message = place.fails(3, &arguments);
    assert!(message.contains("no contact of triangles"), "{message}");
}
