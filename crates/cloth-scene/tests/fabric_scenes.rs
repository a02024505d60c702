//! Cloth of fabric as scenes say it: what a scene gets, and what its writer is told.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{fs, path::Path};

use cloth_core::{ClothMaterial, StrainGauge};
use cloth_scene::{CompileOptions, CompiledScene, Scene};

/// A scene with one cloth, whose table has these lines.
fn text(lines: &str) -> String {
    format!("name = \"t\"\n[simulation]\nframes = 2\n[[cloth]]\nname = \"a\"\n{lines}\n")
}

fn compile(folder: &Path, lines: &str) -> Result<CompiledScene, String> {
    let mut scene = Scene::from_toml(&text(lines), "t.toml").map_err(|e| e.to_string())?;
    scene.origin.directory = folder.to_owned();
    scene.compile(&CompileOptions::default()).map_err(|error| error.to_string())
}

fn compiled(lines: &str) -> CompiledScene {
    compile(Path::new(""), lines).unwrap_or_else(|error| panic!("{error}"))
}

fn is_fabric(scene: &CompiledScene) -> bool {
    matches!(scene.cloths[0].material, ClothMaterial::Fabric(_))
}

const GRID: &str = "geometry.grid = { columns = 5, rows = 4, spacing = 0.1 }\n";

#[test]
fn the_model_is_what_a_scene_says_or_means() {
    let by = |lines: &str| is_fabric(&compiled(&format!("{GRID}{lines}")));
    assert!(by("material.preset = \"cotton-broad\""));
    assert!(by("material.preset = \"denim\"\nmodel = \"fabric\""));
    assert!(!by("material.preset = \"denim\"\nmodel = \"springs\""));
    assert!(by("material.preset = \"denim\""));
    let solver = "[simulation]\nframes = 2\nsolver = \"semi-implicit\"\n";
    let text = text(&format!("{GRID}material.preset = \"denim\""))
        .replace("[simulation]\nframes = 2\n", solver);
    let scene = Scene::from_toml(&text, "t.toml").unwrap();
    assert!(
        is_fabric(&scene.compile(&CompileOptions::default()).unwrap()),
        "as with other solvers"
    );
    assert!(!by("material = { preset = \"denim\", shear.stiffness = 5 }"));
    assert!(!by("material = { preset = \"denim\", mass.per_particle = 1e-3 }"));
}

#[test]
fn grids_are_meshed_in_three_ways_and_keep_their_sets_and_texture() {
    for (meshing, particles, triangles) in
        [("alternating", 20, 24), ("union-jack", 32, 48), ("one-way", 20, 24)]
    {
        let scene = compiled(&format!(
            "pins = [\"top-left\", \"all\"]\nmaterial.preset = \"drape-001\"\n\
             geometry.grid = {{ columns = 5, rows = 4, spacing = 0.1, meshing = \"{meshing}\" }}"
        ));
        let model = &scene.model;
        assert_eq!((model.particle_count(), model.triangles().len()), (particles, triangles));
        assert_eq!(model.pins().len(), particles, "all of them, once");
        let texture = scene.texture(0).unwrap();
        assert_eq!(texture.triangles.len(), triangles);
        assert_eq!((texture.coordinates[0], texture.coordinates[19]), ([0.0; 2], [1.0; 2]));
        let mass: f64 = model.masses().iter().sum();
        let ClothMaterial::Fabric(material) = scene.cloths[0].material else { panic!() };
        assert!((mass / (0.12 * material.fabric.area_density) - 1.0).abs() < 1e-12);
    }
}

const PANELS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 50 0\nvt 50 50\nvt 0 50\n\
                      g front\nf 1/1 2/2 3/3\ng back\nf 1/1 3/3 4/4\n";

fn mesh(folder: &Path, file: &str, lines: &str) -> Result<CompiledScene, String> {
    fs::write(folder.join("mesh.obj"), file).expect("a file for the test");
    let lines =
        format!("material.preset = \"drape-001\"\ngeometry.mesh.file = \"mesh.obj\"\n{lines}");
    compile(folder, &lines)
}

/// Where the warp of each triangle points.
fn warps(scene: &CompiledScene) -> Vec<[f64; 3]> {
    let gauge = StrainGauge::new(&scene.model);
    gauge.measure(scene.model.positions()).map(|triangle| triangle.threads[0]).collect()
}

#[test]
fn the_warp_turns_with_the_cloth_and_with_each_panel() {
    let folder = tempfile::tempdir().unwrap();
    let near = |found: [f64; 3], wanted: [f64; 3]| {
        (0..3).for_each(|k| assert!((found[k] - wanted[k]).abs() < 1e-12, "{found:?} {wanted:?}"));
    };
    let scene = mesh(folder.path(), PANELS, "").unwrap();
    warps(&scene).into_iter().for_each(|warp| near(warp, [1.0, 0.0, 0.0]));
    let half = 0.5_f64.sqrt();
    for lines in [
        "pattern = { warp = 45, panels = [{ group = \"back\", warp = 90 }] }",
        "pattern = { from = \"uv\", scale = 0.02, warp = 45, panels = [{ group = \"back\", warp = 90 }] }",
        "pattern = { axis = [0, 2, 0], warp = -45, panels = [{ group = \"back\", warp = 0 }] }",
    ] {
        let scene = mesh(folder.path(), PANELS, lines).unwrap();
        assert_eq!(scene.warnings, [""; 0]);
        let [front, back] = warps(&scene)[..] else { panic!() };
        near(front, [half, half, 0.0]);
        near(back, [0.0, 1.0, 0.0]);
    }
    let grid = compiled(&format!("{GRID}material.preset = \"drape-001\"\npattern.warp = 90"));
    warps(&grid).into_iter().for_each(|warp| near(warp, [0.0, 1.0, 0.0]));
    // Triangles in the scene itself, whose pattern is half as large as they are.
    let scene = compiled(
        "material.preset = \"drape-001\"\npattern.from = \"uv\"\ngeometry.triangles = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], \
         faces = [[0, 1, 2]], uv = [[0, 0], [0.5, 0], [0, 0.5]] }",
    );
    near(warps(&scene)[0], [2.0, 0.0, 0.0]);
}

#[test]
fn a_panel_can_be_of_another_fabric_and_of_layers() {
    let folder = tempfile::tempdir().unwrap();
    let plain = mesh(folder.path(), PANELS, "").unwrap();
    let doubled =
        mesh(folder.path(), PANELS, "pattern.panels = [{ group = \"back\", layers = 2 }]");
    let doubled = doubled.unwrap();
    let elements = |scene: &CompiledScene| scene.model.elements().clone();
    let [before, after] = [elements(&plain), elements(&doubled)];
    assert_eq!((before.fabrics().len(), after.fabrics().len()), (1, 2));
    assert_eq!(after.triangles()[0].fabric, 0);
    assert_eq!(after.triangles()[1].fabric, 1);
    assert_eq!(after.triangles()[0].bending.plate, before.triangles()[0].bending.plate);
    let twice = before.triangles()[1].bending.plate.map(|x| 2.0 * x);
    assert_eq!(after.triangles()[1].bending.plate, twice);
    assert_eq!(after.fabrics()[1].warp.linear, 2.0 * before.fabrics()[0].warp.linear);
    // Vertex 1 is of the front alone, vertex 3 of the back alone.
    let masses = |scene: &CompiledScene| [scene.model.masses()[1], scene.model.masses()[3]];
    let ([one, other], [front, back]) = (masses(&plain), masses(&doubled));
    assert_eq!((front, back), (one, 2.0 * other));
    // Where panels overlap the first one counts, and one alone can have its own warp.
    let lines = "pattern = { warp = 30, panels = [{ group = \"back\", preset = \"denim\", warp = 90 }, { group = \"front\", layers = 3 }] }";
    let mixed = mesh(folder.path(), PANELS, lines).unwrap();
    let fabrics = elements(&mixed);
    let denim = compiled(&format!("{GRID}material.preset = \"denim\""));
    assert_eq!(fabrics.fabrics()[1], denim.model.elements().fabrics()[0]);
    assert_eq!(fabrics.triangles().iter().map(|t| t.fabric).collect::<Vec<_>>(), [2, 1]);
    assert!((warps(&mixed)[1][1] - 1.0).abs() < 1e-12, "{:?}", warps(&mixed));
    assert_ne!(mixed.model.fingerprint(), plain.model.fingerprint());
    for (panel, words) in [
        ("preset = \"cotton-brod\"", "did you mean `cotton-broad`"),
        ("layers = 0", "must be from 1 to 100"),
        ("layers = 1000", "must be from 1 to 100"),
    ] {
        let lines = format!("pattern.panels = [{{ group = \"back\", {panel} }}]");
        let message = mesh(folder.path(), PANELS, &lines).unwrap_err();
        assert!(message.contains("line") && message.contains(words), "{message}");
    }
}

#[test]
fn a_laboratory_sheet_is_a_fabric() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.toml"), "W = 12\n[warp]\noverhang = 40\n").unwrap();
    let lines = format!("{GRID}material = {{ sheet = \"sheet.toml\", damping.bend = 2e-3 }}");
    let scene = compile(folder.path(), &lines).unwrap();
    let ClothMaterial::Fabric(material) = scene.cloths[0].material else { panic!() };
    assert!((material.fabric.area_density - 0.12).abs() < 1e-12);
    assert_eq!(material.fabric.damping, [2e-5, 2e-3]);
    assert!(scene.notes[0].contains("assumed: thickness"), "{:?}", scene.notes);
}

/// What is allowed but looks like a slip, and what was done without being asked.
#[test]
fn slips_are_told_with_their_mend() {
    let folder = tempfile::tempdir().unwrap();
    let told = |file: &str, lines: &str| {
        let scene = mesh(folder.path(), file, lines).unwrap();
        [scene.notes, scene.warnings].concat().join("\n")
    };
    let pixels = told(PANELS, "pattern.from = \"uv\"");
    assert!(
        pixels.contains("5.000e1 times as large") && pixels.contains("about 2.000e-2"),
        "{pixels}"
    );
    let quad = told("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", "");
    assert!(quad.contains("1 faces of its mesh have more than three corners"), "{quad}");
    let needle = told("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.5 -0.001 0\nf 1 2 3\nf 1 4 2\n", "");
    assert!(needle.contains("triangle 1 the thinnest"), "{needle}");
    let overlap = told(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.1 0\nvt 1.1 0\nvt 0.1 1\n\
         f 1/1 2/2 3/3\nf 4/4 5/5 6/6\n",
        "pattern.from = \"uv\"",
    );
    assert!(overlap.contains("triangle 0 on 1 first"), "{overlap}");
}

#[test]
fn what_makes_no_sense_has_its_line_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let sheet = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    sheet("stiff.toml", "W = 12\ncoupling = 5000\n[warp]\noverhang = 40\n");
    sheet("kes.toml", "W = 12\n[warp]\nLT = 65\nEMT = 6\noverhang = 40\n");
    sheet("falls.toml", "W = 12\n[warp]\ncurve = \"falls.csv\"\noverhang = 40\n");
    sheet("falls.csv", "0, 0\n0.05, 30\n0.1, 20\n");
    sheet("units.toml", "W = 12000\n[warp]\noverhang = 40\n");
    sheet("bias.toml", "W = 12\n[warp]\nB = 0.1\n[bias]\nB = 0.001\n");
    sheet("wrong.toml", "W = 12\nwarp = 3\n");
    let by_sheet = |name: &str, words: &[&str]| {
        let lines = format!("{GRID}material.sheet = \"{name}\"");
        let message = compile(folder.path(), &lines).unwrap_err();
        let all = ["line 7"].iter().chain(words).all(|word| message.contains(word));
        assert!(all, "{words:?}: {message}");
    };
    by_sheet("stiff.toml", &["biaxial coupling", "use a smaller one"]);
    by_sheet("kes.toml", &["LT of the warp", "is 65", "between"]);
    by_sheet("falls.toml", &["falls from 30 to 20", "point 2", "leave out"]);
    by_sheet("units.toml", &["mass per area", "must lie between"]);
    by_sheet("bias.toml", &["at 45 degrees", "measure it again"]);
    by_sheet("wrong.toml", &["wrong.toml", "line 2"]);
    by_sheet("none.toml", &["cannot read", "check the path"]);
    by_sheet("../stiff.toml", &["plain path below the folder"]);

    let by_lines = |lines: &str, words: &[&str]| {
        let message = compile(folder.path(), lines).unwrap_err();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    };
    let with = |lines: &str, words: &[&str]| by_lines(&format!("{GRID}{lines}"), words);
    with("material.preset = \"coton-broad\"", &["line 7", "did you mean `cotton-broad`"]);
    with("model = \"springs\"\nmaterial.preset = \"drape-001\"", &["line 8", "model = \"fabric\""]);
    with("model = \"fabric\"\nmaterial.thickness = 1e-3", &["has no `preset`", "cloth fabrics"]);
    with("material = { preset = \"drape-001\", sheet = \"a\" }", &["remove one"]);
    with("material = { preset = \"drape-001\", bend.stiffness = 1 }", &["model = \"springs\""]);
    with(
        "material = { preset = \"denim\", damping.bend = 1 }\nmodel = \"springs\"",
        &["is of fabric"],
    );
    with("material = { preset = \"drape-001\", damping.bend = -1 }", &["must not be negative"]);
    with("material.preset = \"drape-001\"\npattern.scale = 2", &["is of meshes: remove it"]);
    with(
        "material = { preset = \"drape-001\", mass.per_area = 0 }",
        &["line 7", "greater than zero"],
    );
    by_lines(
        "model = \"fabric\"\nmaterial.preset = \"denim\"\ngeometry.network = { width = 2, positions = [[0, 0, 0], [1, 0, 0]] }",
        &["has no triangles", "a grid or mesh"],
    );
    by_lines(
        "geometry.grid = { columns = 3, rows = 3, spacing = 1, stencil = 24 }\nmaterial.preset = \"drape-001\"",
        &["stencil", "is of springs"],
    );
    by_lines(
        "geometry.triangles = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces = [[0, 1, 2]], uv = [[0, 0]] }\n\
         material.preset = \"drape-001\"\npattern.from = \"uv\"",
        &["has 1 coordinates", "there are 3 vertices"],
    );

    let by_mesh = |file: &str, lines: &str, words: &[&str]| {
        let message = mesh(folder.path(), file, lines).unwrap_err();
        let all = ["line"].iter().chain(words).all(|word| message.contains(word));
        assert!(all, "{words:?}: {message}");
    };
    let uv = "pattern.from = \"uv\"";
    by_mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", uv, &["no texture coordinates"]);
    by_mesh("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "", &["triangle 0 has no area", "remove it"]);
    let point = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 2 0\nf 1/1 2/2 3/3\n";
    by_mesh(point, uv, &["triangle 0 has no area in its pattern", "move its coordinates apart"]);
    let flipped = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.9 0.1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    by_mesh(flipped, uv, &["triangles 1 and 0 lie on each other", "turn its coordinates over"]);
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n";
    by_mesh(three, "", &["belongs to 3 triangles", "split the mesh there"]);
    let turned = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 4 3\n";
    by_mesh(turned, "", &["the same way", "flip one of them"]);
    by_mesh(PANELS, "pattern.axis = [0, 0, 1]", &["stands upright on triangle 0"]);
    by_mesh(PANELS, "pattern.panels = [{ group = \"frnt\", warp = 0 }]", &["did you mean `front`"]);
    by_mesh(PANELS, "pattern = { from = \"uv\", axis = [1, 0, 0] }", &["runs along u"]);
    by_mesh(PANELS, "pattern.scale = 2", &["give `from = \"uv\"`"]);
}

#[test]
fn a_collider_that_would_throw_cloth_back_is_told_that_it_does_not() {
    let notes = |restitution: f64, contact: &str| {
        compiled(&format!(
            "{GRID}material.preset = \"cotton-broad\"\n[[collider]]\nname = \"floor\"\nshape.plane = {{}}\n\
             translation = [0, 0, -1]\nrestitution = {restitution}\n[contact]\n{contact}"
        ))
        .notes
        .concat()
    };
    assert!(notes(0.5, "response.triangles = {}").contains("`restitution` of \"floor\""));
    assert!(!notes(0.0, "response.triangles = {}").contains("rebound"));
    assert!(!notes(0.5, "response = \"none\"").contains("rebound"));
}
