//! OBJ files: what is read and what is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth_io::{MeshError, MeshPlace, mesh_read_obj};

fn error(text: &str) -> MeshError {
    mesh_read_obj("test.obj", text.as_bytes()).unwrap_err()
}

#[test]
fn vertices_keep_file_order_even_when_unused() {
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1 0\nf 4 3 2\n";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.positions[0], [9.0; 3]);
    assert_eq!(mesh.triangles, [[3, 2, 1]]);
    assert_eq!(mesh.texture, None);
}

#[test]
fn polygons_become_fans_and_texture_keeps_its_indices() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.5 0.25\nvt 1\nvt 0 1 0\n\
                f 1/1/7 2/2/7 3/3 4/-1\n";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let texture = mesh.texture.unwrap();
    assert_eq!(texture.coordinates, [[0.5, 0.25], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(texture.triangles, [[0, 1, 2], [0, 2, 2]]);
}

#[test]
fn texture_is_left_out_when_a_corner_lacks_it() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1//1 3//1 2//1\n";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    assert_eq!(mesh.texture, None);
}

#[test]
fn groups_collect_the_vertices_of_their_faces() {
    let text = "g \nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no the shirt\ng left hem\nf 2 3 4\n\
                g right\nf 1 2 3\ng unused\n";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    let names: Vec<_> = mesh.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["the shirt", "left", "hem", "right"]);
    assert_eq!(mesh.group("hem").unwrap().vertices, [1, 2, 3]);
    assert_eq!(mesh.group("right").unwrap().vertices, [0, 1, 2]);
    assert_eq!(mesh.group("the shirt").unwrap().vertices, [0, 1, 2, 3]);
}

/// `g` before `p` names single vertices: what faces are around them does not matter.
#[test]
fn points_and_lines_are_members_of_groups_without_their_neighbours() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no sheet\nf 1 2 3\nf 1 3 4\n\
                g corner\np 2\ng edge\nl 3 -1\ng two\np 1 4\n";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    assert_eq!(mesh.group("corner").unwrap().vertices, [1]);
    assert_eq!(mesh.group("edge").unwrap().vertices, [2, 3]);
    assert_eq!(mesh.group("two").unwrap().vertices, [0, 3]);
    assert_eq!(mesh.group("sheet").unwrap().vertices, [0, 1, 2, 3]);
    assert_eq!(mesh.triangles.len(), 2);

    let problem = error("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\ng pins\np 4\n").to_string();
    assert!(problem.contains("line 6") && problem.contains("vertex 4 does not exist"), "{problem}");
    let problem = error("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\ng pins\np one\n").to_string();
    assert!(problem.contains("line 6") && problem.contains("`one`"), "{problem}");
}

#[test]
fn line_ends_comments_continuations_and_unknown_statements_are_understood() {
    let text = "# caf\u{e9}\r\nsmell 1 2 3 0.5\r\nv 0 0 0 # first\r\nv 1 0 \\\r\n0\r\nv 1e0 1 0\r\n\
                f 1 2 \\\n3";
    let mesh = mesh_read_obj("test.obj", text.as_bytes()).unwrap();
    assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn errors_name_the_line() {
    const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases = [
        ("f 1 2 4\n", "vertex 4 does not exist, the file has 3"),
        ("f 1 2 -4\n", "vertex -4 does not exist"),
        ("f 1 2 0\n", "vertex 0 does not exist"),
        ("f 1/1 2/1 3/1\n", "texture coordinate 1 does not exist, the file has 0"),
        ("f 1 2 x\n", "`x` is not a face corner"),
        ("f 1 2\n", "at least 3 corners but has 2"),
        ("v 1 2\n", "needs 3 numbers but has 2"),
        ("v 1 2 three\n", "`three` in a vertex position is not a number"),
        ("f 1 2 2\n", "uses vertex 1 (counted from 0) twice"),
    ];
    for (line, expected) in cases {
        let message = error(&format!("{VERTICES}{line}")).to_string();
        assert!(message.contains(expected), "{message}");
        assert!(message.contains("`test.obj`, line 4"), "{message}");
    }
    let problem = error(&format!("{VERTICES}f 9223372036854775807 1 2\n"));
    assert!(matches!(problem, MeshError::Index { place: MeshPlace::Line(4), .. }), "{problem}");
}

#[test]
fn positions_that_are_not_finite_name_the_vertex() {
    for word in ["nan", "inf", "1e999"] {
        let problem = error(&format!("v 0 0 0\nv 0 {word} 0\nv 0 1 0\nf 1 2 3\n"));
        assert!(matches!(problem, MeshError::Position { vertex: 1, .. }), "{problem}");
    }
    let problem = error("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nf 1/1 2/1 3/1\n");
    assert!(matches!(problem, MeshError::TextureCoordinate { coordinate: 0, .. }), "{problem}");
}

#[test]
fn empty_meshes_are_refused() {
    assert!(matches!(error(""), MeshError::Empty { what: "vertices", .. }));
    assert!(matches!(error("v 0 0 0\n"), MeshError::Empty { what: "triangles", .. }));
}
