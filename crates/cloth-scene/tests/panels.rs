//! Pieces of a flat pattern from SVG and DXF: their triangles, their names, and what cannot be cut.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{fs, path::Path};

use cloth_core::{FabricAudit, TriangleMesh};
use cloth_scene::{CompileOptions, CompiledScene, Scene};
use tempfile::TempDir;

fn text(file: &str, more: &str, pieces: &str) -> String {
    format!(
        "name = \"t\"\n[[cloth]]\nname = \"shirt\"\nmodel = \"fabric\"\nmaterial.preset = \"cotton-broad\"\n\
         [cloth.geometry.panels]\nfile = \"{file}\"\nedge = 0.02\n{more}\n{pieces}\n"
    )
}

fn compile(folder: &Path, text: &str) -> Result<CompiledScene, String> {
    let mut scene = Scene::from_toml(text, "t.toml").map_err(|error| error.to_string())?;
    scene.origin.directory = folder.to_owned();
    scene.compile(&CompileOptions::default()).map_err(|error| error.to_string())
}

const PIECE: &str = "[[cloth.geometry.panels.pieces]]\noutline = \"a\"";

/// An SVG file in millimetres with one shape.
fn svg(shape: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"400mm\" viewBox=\"0 0 400 400\">\n{shape}\n</svg>"
    )
}

fn dxf(units: &str, flag: u8, vertices: &[[f64; 3]]) -> String {
    let mut text = format!(
        "0\nSECTION\n2\nHEADER\n{units}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\na\n70\n{flag}\n"
    );
    for [x, y, bulge] in vertices {
        text += &format!("10\n{x}\n20\n{y}\n42\n{bulge}\n");
    }
    text + "0\nENDSEC\n0\nEOF\n"
}

fn area(scene: &CompiledScene) -> f64 {
    let at = |i: u32| glam(scene.model.positions()[i as usize]);
    let of = |&[a, b, c]: &[u32; 3]| {
        let [p, q] = [b, c].map(|i| [0, 1, 2].map(|k| at(i)[k] - at(a)[k]));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        0.5 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt()
    };
    scene.model.triangles().iter().map(of).sum()
}

fn glam(place: [f64; 3]) -> [f64; 3] {
    place
}

#[test]
fn a_circle_and_a_square_have_their_area_mass_and_even_triangles() {
    let folder = TempDir::new().unwrap();
    let arc = "M 100 200 C 100 144.77 144.77 100 200 100 C 255.23 100 300 144.77 300 200 C 300 255.23 255.23 300 200 300 C 144.77 300 100 255.23 100 200 Z";
    for (shape, expected) in [
        (format!("<path id=\"a\" d=\"{arc}\"/>"), std::f64::consts::PI * 0.01),
        ("<rect id=\"a\" x=\"50\" y=\"50\" width=\"300\" height=\"200\"/>".into(), 0.06),
        ("<polygon id=\"a\" points=\"0,0 300,0 300,200 0,200\"/>".into(), 0.06),
    ] {
        fs::write(folder.path().join("p.svg"), svg(&shape)).unwrap();
        let scene = compile(folder.path(), &text("p.svg", "", PIECE)).unwrap();
        // A polygon in a circle is a little smaller.
        assert!((area(&scene) / expected - 1.0).abs() < 8e-3, "{shape}: {} m2", area(&scene));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let mesh = TriangleMesh {
            positions: scene.model.positions().to_vec(),
            triangles: scene.model.triangles().to_vec(),
            ..TriangleMesh::default()
        };
        let smallest = mesh.triangles.iter().map(|t| angle(&mesh, t)).fold(f64::MAX, f64::min);
        assert!(smallest > 20.0, "{shape}: an angle of {smallest} degrees");
    }
}

fn angle(mesh: &TriangleMesh, triangle: &[u32; 3]) -> f64 {
    let x = triangle.map(|i| mesh.positions[i as usize]);
    let side = |a: usize, b: usize| -> f64 {
        (0..3).map(|k| (x[a][k] - x[b][k]).powi(2)).sum::<f64>().sqrt()
    };
    let sides = [side(0, 1), side(1, 2), side(2, 0)];
    (0..3)
        .map(|k| {
            let (a, b, c) = (sides[k], sides[(k + 1) % 3], sides[(k + 2) % 3]);
            ((a * a + b * b - c * c) / (2.0 * a * b)).acos().to_degrees()
        })
        .fold(f64::MAX, f64::min)
}

#[test]
fn pieces_lie_where_they_are_put_and_edges_are_sets() {
    let folder = TempDir::new().unwrap();
    let shape =
        "<polygon id=\"a\" data-edges=\"top right hem left\" points=\"0,0 300,0 300,200 0,200\"/>";
    fs::write(folder.path().join("p.svg"), svg(shape)).unwrap();
    let pieces = "[[cloth.geometry.panels.pieces]]\noutline = \"a\"\nname = \"front\"\ntranslation = [0, 0, 1]\n\
        [[cloth.geometry.panels.pieces]]\noutline = \"a\"\nname = \"back\"\nmirror = true\nradius = 0.3\ntranslation = [0, 0.5, 1]\n";
    let with = text("p.svg", "", pieces)
        .replace("model =", "pins = [\"front:hem\", \"back:top\"]\nmodel =");
    let scene = compile(folder.path(), &with).unwrap();
    let pins = scene.model.pins();
    assert_eq!(pins.len(), 2 * 16);
    for &pin in &pins[..16] {
        let [_, y, z] = scene.model.positions()[pin as usize];
        assert!(y == 0.0 && (z - 0.9).abs() < 1e-12);
    }
    for &pin in &pins[16..] {
        let [x, y, z] = scene.model.positions()[pin as usize];
        // On a cylinder around (0, 0.8).
        assert!((x.hypot(y - 0.8) - 0.3).abs() < 1e-12 && (z - 1.1).abs() < 1e-12, "{x} {y} {z}");
    }
    // Wrapping keeps lengths along the cylinder: chords are a little shorter.
    assert!((area(&scene) / 0.12 - 1.0).abs() < 1e-3);
}

/// A piece with a crease 131 mm from its left, which is no whole number of edges.
const CREASED: &str = "<rect id=\"a\" x=\"0\" y=\"0\" width=\"300\" height=\"200\"/>\n\
    <line data-piece=\"a\" data-line=\"crease\" x1=\"131\" y1=\"0\" x2=\"131\" y2=\"200\"/>";

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Folded by an angle, the sides of a piece are as far apart as in a triangle, and it is without strain: rest shape and start have the same folds.
#[test]
fn a_piece_is_folded_along_a_line() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("p.svg"), svg(CREASED)).unwrap();
    for (angle, mirror) in [(0.0_f64, false), (60.0, false), (-100.0, true), (150.0, true)] {
        let fold = format!(
            "folds = [{{ lines = [\"a:crease\"], angle = {angle} }}]\npattern.imperfection = 0\nmodel ="
        );
        let pieces = format!("{PIECE}\nfolded = true\nmirror = {mirror}");
        let scene = text("p.svg", "", &pieces).replace("model =", &fold);
        let scene = compile(folder.path(), &scene).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert!((area(&scene) / 0.06 - 1.0).abs() < 1e-9, "{angle}: {} m2", area(&scene));
        let audit = FabricAudit::new(&scene.model, scene.model.positions()).unwrap();
        let strain = (audit.stretches[1] - 1.0).max(1.0 - audit.stretches[0]);
        assert!(audit.energy_bending < 1e-12 && strain < 1e-9, "{angle}: {audit:?}");
        // The border has its corners in order, the lower left one first.
        let x = scene.model.positions();
        let ends = x.iter().filter(|x| (x[2] + 0.1).abs() < 1e-9).copied();
        let ends: Vec<[f64; 3]> = ends.collect();
        let width = ends.iter().flat_map(|a| ends.iter().map(|b| distance(*a, *b)));
        let width = width.fold(0.0, f64::max);
        let (a, b, inner) = (0.131_f64, 0.169, (180.0 - angle).to_radians());
        let expected = (a * a + b * b - 2.0 * a * b * inner.cos()).sqrt().max(b);
        assert!((width - expected).abs() < 1e-9, "{angle}: {width} m, not {expected} m");
    }
}

const PAINTED: &str = r#"
name = "painted"
[[cloth]]
name = "sheet"
material = { preset = "cotton-broad", maps = [MAPS] }
geometry.mesh.file = "sheet.ply"
[[collider]]
name = "floor"
shape.plane = {}
translation = [0, 0, -0.01]
[[attachment]]
name = "goal"
vertices = ["all"]
to = "floor"
stiffness = 8
damping = 2
weights = "goal"
reach = 1
"#;

/// A square of two triangles; each vertex has a goal.
const SHEET: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float goal\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0\n1 0 0 0.5\n0 1 0 1\n1 1 0 1\n3 0 1 2\n3 1 3 2\n";

/// Triangles have the mean of what is painted on their corners, holds what is painted on theirs.
#[test]
fn fabrics_and_goals_are_painted() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("sheet.ply"), SHEET).unwrap();
    let bend = "{ by = \"goal\", of = \"bend\", range = [1, 5] }";
    let mass = "{ by = \"all\", of = \"mass\", range = [9, 3] }";
    let compiled = |maps: &str| {
        let scene = PAINTED.replace("MAPS", maps);
        compile(folder.path(), &scene).unwrap()
    };
    let plain = compiled("");
    let scene = compiled(&format!("{bend}, {mass}"));
    let rigidity = |scene: &CompiledScene, t: usize| {
        let elements = scene.model.elements();
        let of = elements.triangles()[t].fabric as usize;
        (elements.fabrics()[of].bending.warp, elements.fabrics()[of].area_density)
    };
    // Means of 0.5 and 0.8333, the second one to the nearest step of 1/64.
    for (t, mean) in [(0, 0.5), (1, 53.0 / 64.0)] {
        let ((was, light), (is, heavy)) = (rigidity(&plain, t), rigidity(&scene, t));
        assert!((is / was - (1.0 + 4.0 * mean)).abs() < 1e-12, "{t}: {}", is / was);
        assert!((heavy / light - 3.0).abs() < 1e-12);
    }
    let of = |scene: &CompiledScene| scene.model.masses().iter().sum::<f64>();
    assert!((of(&scene) / of(&plain) - 3.0).abs() < 1e-12);
    let control = plain.timeline.control(0);
    let springs: Vec<_> = control
        .forces
        .iter()
        .flatten()
        .map(|force| (force.particle, force.spring.unwrap()))
        .map(|(particle, spring)| (particle, spring.stiffness, spring.damping))
        .collect();
    assert_eq!(springs, [(1, 4.0, 1.0), (2, 8.0, 2.0), (3, 8.0, 2.0)], "the first one is free");
    for (maps, goal, words) in [
        (
            bend.replace("\"goal\"", "\"gaol\""),
            "\"goal\"",
            "set of particles `gaol`; did you mean `goal`",
        ),
        (bend.replace("[1, 5]", "[1, 0]"), "\"goal\"", "maps[0].range` is 0: a factor"),
        (String::new(), "\"gaol\"", "attribute `gaol`"),
    ] {
        let scene = PAINTED
            .replace("MAPS", &maps)
            .replace("weights = \"goal\"", &format!("weights = {goal}"));
        let error = compile(folder.path(), &scene).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
    let hard = PAINTED.replace("MAPS", "").replace("stiffness = 8\ndamping = 2\n", "");
    assert!(compile(folder.path(), &hard).unwrap_err().contains("give both, or remove it"));
    let springs =
        PAINTED.replace("MAPS", bend).replace("preset = \"cotton-broad\"", "preset = \"denim\"");
    let springs = springs.replace("name = \"sheet\"\n", "name = \"sheet\"\nmodel = \"springs\"\n");
    assert!(compile(folder.path(), &springs).unwrap_err().contains("is of fabric"));
}

#[test]
fn lines_and_folds_that_make_no_sense_are_refused() {
    let folder = TempDir::new().unwrap();
    let refused = |shapes: &str, folds: &str| {
        fs::write(folder.path().join("p.svg"), svg(shapes)).unwrap();
        let folds = format!("folds = [{folds}]\nmodel =");
        let scene = text("p.svg", "", PIECE).replace("model =", &folds);
        compile(folder.path(), &scene).unwrap_err()
    };
    let crease = |angle: &str| format!("{{ lines = [\"a:crease\"], angle = {angle} }}");
    for (from, to, words) in [
        ("data-piece=\"a\"", "data-piece=\"b\"", "piece \"b\", which there is not"),
        ("y1=\"0\"", "y1=\"-50\"", "line \"crease\" leaves its piece \"a\""),
        ("x1=\"131\"", "x1=\"1e999\"", "line \"crease\""),
        ("x1=\"131\"", "x1=\"bad\"", "which is no number"),
    ] {
        let error = refused(&CREASED.replace(from, to), &crease("90"));
        assert!(error.contains(words), "{error}");
    }
    let unknown = refused(CREASED, &crease("90").replace("crease", "creas"));
    assert!(unknown.contains("a:creas") && unknown.contains("a:crease"), "{unknown}");
    let across = format!(
        "{CREASED}\n<line data-piece=\"a\" id=\"across\" x1=\"0\" y1=\"90\" x2=\"300\" y2=\"111\"/>"
    );
    assert!(refused(&across, &crease("90")).contains("crosses another line"));
    for (angle, words) in [("181", "give -180 to 180 degrees"), ("nan", "give a finite number")] {
        assert!(refused(CREASED, &crease(angle)).contains(words));
    }
    let border = refused(CREASED, "{ lines = [\"a:0\"], angle = 10 }");
    assert!(border.contains("has no edge between two triangles"), "{border}");
    let springs = "name = \"t\"\n[[cloth]]\nmodel = \"springs\"\nfolds = [{ lines = [\"column-1\"], angle = 9 }]\n\
        material.preset = \"denim\"\ngeometry.grid = { columns = 4, rows = 4, spacing = 0.1 }";
    assert!(compile(folder.path(), springs).unwrap_err().contains("of fabric"));
}

#[test]
fn outlines_in_dxf_have_units_and_arcs() {
    let folder = TempDir::new().unwrap();
    // Half a circle of 100 mm on a square of 200 mm: an arc of half a turn has bulge 1.
    let vertices = [[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [200.0, 200.0, 1.0], [0.0, 200.0, 0.0]];
    let units = "9\n$INSUNITS\n70\n4\n";
    fs::write(folder.path().join("p.dxf"), dxf(units, 1, &vertices)).unwrap();
    let scene = compile(folder.path(), &text("p.dxf", "", PIECE)).unwrap();
    let expected = 0.04 + 0.5 * std::f64::consts::PI * 0.01;
    assert!((area(&scene) / expected - 1.0).abs() < 5e-3, "{}", area(&scene));
}

#[test]
fn what_cannot_be_cut_is_refused_with_name_line_and_mend() {
    let folder = TempDir::new().unwrap();
    let square = [[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [200.0, 200.0, 0.0], [0.0, 200.0, 0.0]];
    let mm = "9\n$INSUNITS\n70\n4\n";
    for (name, content, words) in [
        (
            "p.svg",
            svg("<path id=\"a\" d=\"M 0 0 L 100 0 L 100 100\"/>"),
            &["\"a\" is open", "line 2"][..],
        ),
        (
            "p.svg",
            svg("<path id=\"a\" d=\"M 0 0 L 100 100 L 100 0 L 0 100 Z\"/>"),
            &["crosses itself", "line 2"],
        ),
        (
            "p.svg",
            svg("<path id=\"a\" d=\"M 0 0 Q 100 bad\"/>"),
            &["\"a\" has a path that is none", "line 2"],
        ),
        (
            "p.svg",
            svg("<g transform=\"scale(2)\">\n<path id=\"a\" d=\"M 0 0 L 100 0 L 0 100 Z\"/></g>"),
            &["transform", "line 3"],
        ),
        ("p.svg", svg("<path id=\"b\" d=\"M 0 0 L 100 0 L 0 100 Z\"/>"), &["b", "outline"]),
        ("p.svg", "<svg><rect id=\"a\" width=\"1\" height=\"1\"/></svg>".into(), &["unit"]),
        ("p.svg", svg("<rect"), &["line"]),
        ("p.dxf", dxf("", 1, &square), &["$INSUNITS", "unit"]),
        ("p.dxf", dxf(mm, 0, &square), &["\"a\" is open"]),
        ("p.dxf", dxf(mm, 1, &square).replace("LWPOLYLINE", "SPLINE"), &["SPLINE", "polylines"]),
        ("p.dxf", dxf(mm, 1, &square).replace("\n42\n", "\nx\n"), &["no group code"]),
        ("p.png", String::new(), &["svg, dxf"]),
    ] {
        fs::write(folder.path().join(name), &content).unwrap();
        let error = compile(folder.path(), &text(name, "", PIECE)).unwrap_err();
        for word in words {
            assert!(error.contains(word), "{content}: no {word:?} in {error}");
        }
        assert!(error.contains("`t.toml`, line"), "{error}");
    }
    fs::write(folder.path().join("p.svg"), svg("<rect id=\"a\" width=\"100\" height=\"100\"/>"))
        .unwrap();
    for (more, pieces, words) in [
        ("unit = 0", PIECE, "greater than zero"),
        ("", "pieces = []", "at least one piece"),
        ("", &*format!("{PIECE}\n{PIECE}"), "name of two pieces"),
        ("unit = 1e-9", PIECE, "smaller than its edges"),
    ] {
        let error = compile(folder.path(), &text("p.svg", more, pieces)).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn slanted_sides_have_no_triangles_without_area() {
    let folder = TempDir::new().unwrap();
    // Points on such sides are on a line but for rounding.
    for far in [330, 347, 361, 389] {
        let path = format!("M 60 10 L 300 10 L {far} 380 C 250 395 100 395 20 380 Z");
        let shape = format!("<path id=\"a\" data-edges=\"waist right hem left\" d=\"{path}\"/>");
        fs::write(folder.path().join("a.svg"), svg(&shape)).unwrap();
        let seam = "[[seam]]\nname = \"s\"\nlines = [[\"a:right\"], [\"a:left\"]]\ngather = 1.0\n";
        let scene = compile(folder.path(), &text("a.svg", "", &format!("{PIECE}\n{seam}")));
        assert!(scene.is_ok(), "{far}: {scene:?}");
    }
}

/// A cushion is two squares, one turned around; without that one of them has its outer side inside.
#[test]
fn pieces_sewn_with_the_same_side_out_are_told_to_turn_around() {
    let folder = TempDir::new().unwrap();
    let square = "<rect id=\"a\" x=\"0\" y=\"0\" width=\"200\" height=\"200\"/>";
    fs::write(folder.path().join("p.svg"), svg(square)).unwrap();
    // Edges from the top left on; those of what is turned around are left for right.
    let cushion = |turn: &str, edges: [usize; 4]| {
        let pieces = format!(
            "{PIECE}\nname = \"front\"\n{PIECE}\nname = \"back\"\ntranslation = [0, 0.02, 0]\n{turn}\n"
        );
        let seams = edges.iter().enumerate().map(|(front, back)| {
            format!("[[seam]]\nlines = [[\"front:{front}\"], [\"back:{back}\"]]\n")
        });
        compile(folder.path(), &text("p.svg", "", &(pieces + &seams.collect::<String>())))
    };
    let message = cushion("", [0, 1, 2, 3]).unwrap_err();
    assert!(
        message.contains("line 6, ") && message.contains("turn one of them around"),
        "{message}"
    );
    let turn = "rotation = { axis = [0, 0, 1], degrees = 180 }";
    cushion(turn, [0, 3, 2, 1]).unwrap();
}
