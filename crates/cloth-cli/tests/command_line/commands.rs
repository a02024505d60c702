//! The commands beside `cloth run`.

use crate::place::{MESH, Place, SQUARE, TINY};

#[test]
fn wrong_arguments_end_with_2() {
    let place = Place::with("tiny.toml", TINY);
    for arguments in [
        &["run"][..],
        &["fly"],
        &["run", "tiny.toml", "--format", "fbx"],
        &["run", "tiny.toml", "--precision", "f16"],
        &["run", "tiny.toml", "--frames", "0"],
        &["run", "tiny.toml", "--frame-stride", "0"],
        &["run", "tiny.toml", "--threads", "0"],
        &["run", "tiny.toml", "--threads", "100000"],
        &["check", "tiny.toml", "--resume"],
        &["run", "tiny.toml", "--solver", "magic"],
        &["run", "tiny.toml", "--solver", "implicit", "--linear", "gmres"],
        &["run", "tiny.toml", "--solver", "implicit", "--tolerance", "2"],
        &["run", "tiny.toml", "--solver", "implicit", "--iterations", "0"],
        &["run", "tiny.toml", "--time-step", "0"],
        &["check", "tiny.toml", "--time-step", "nan"],
    ] {
        assert_eq!(place.output(arguments).status.code(), Some(2), "{arguments:?}");
    }
    let message = place.fails(2, &["run", "tiny.toml", "--backend", "abacus"]);
    assert!(message.starts_with("unknown backend `abacus`; this build has: "), "{message}");
    let message = place.fails(2, &["convert", "tiny.toml", "tiny.obj"]);
    assert!(message.contains("extension toml"), "{message}");
    assert!(!place.path("out").exists() && !place.path("tiny.obj").exists());
}

#[test]
fn built_in_scenes_are_listed_and_shown() {
    let place = Place::new();
    let text = place.succeeds(&["scenes"]);
    let json = place.succeeds(&["scenes", "--json"]);
    let rows: Vec<serde_json::Value> = serde_json::from_str(&json).unwrap();
    let scenes = cloth::scene::builtin_scenes();
    assert_eq!(rows.len(), scenes.len());
    for (row, scene) in rows.iter().zip(scenes) {
        assert_eq!(row["name"], scene.name);
        assert!(row["particles"].as_u64() > Some(0), "{row}");
        assert!(text.contains(scene.name) && text.contains(scene.summary));
        assert_eq!(place.succeeds(&["scenes", "show", scene.name]), scene.text);
    }
    let message = place.fails(3, &["scenes", "show", "drapes"]);
    assert!(message.contains("did you mean `drape`?"), "{message}");
}

#[test]
fn fabrics_are_listed_compared_and_shown_with_their_source() {
    let place = Place::new();
    let fabrics = cloth::scene::measured_fabrics();
    let list = place.succeeds(&["fabrics"]);
    let rows: Vec<serde_json::Value> =
        serde_json::from_str(&place.succeeds(&["fabrics", "--json"])).unwrap();
    assert!(rows.len() >= 40 && rows.len() == fabrics.len());
    for (row, fabric) in rows.iter().zip(fabrics) {
        assert_eq!(row["name"], fabric.name);
        assert!(row["source"]["url"].as_str().unwrap().starts_with("https://"), "{row}");
        assert!(list.contains(&fabric.name), "{}", fabric.name);
    }
    let one = place.succeeds(&["fabrics", "11oz-black-denim"]);
    assert!(one.contains("Wang, H.") && one.contains("assumed: thickness"), "{one}");
    let two = place.succeeds(&["fabrics", "11oz-black-denim", "cotton-broad"]);
    let bending = two.lines().find(|line| line.starts_with("bending, warp")).unwrap();
    assert!(bending.contains("16.05") && bending.contains("11.57"), "{bending}");
    // What was not measured does not look as if it were.
    assert!(two.contains("cotton-broad: assumed: slope of warp"), "{two}");
    let broad = list.lines().find(|line| line.starts_with("cotton-broad")).unwrap();
    assert_eq!(broad.split_whitespace().filter(|word| *word == "-").count(), 3, "{broad}");
    let message = place.fails(3, &["fabrics", "coton-broad"]);
    assert!(message.contains("did you mean `cotton-broad`?"), "{message}");
}

#[test]
fn a_laboratory_sheet_is_fitted_or_its_line_is_named() {
    let place = Place::new();
    place.write("suit.toml", "W = 20\nG = 0.8\n[warp]\nLT = 0.6\nEMT = 5\nB = 0.1\n");
    let text = place.succeeds(&["fabrics", "--sheet", "suit.toml"]);
    assert!(text.contains("off by") && text.contains("assumed: slope of weft"), "{text}");
    place.write("wrong.toml", "W = 20\n[warp]\nLT = 60\nEMT = 5\nB = 0.1\n");
    let message = place.fails(3, &["fabrics", "--sheet", "wrong.toml"]);
    assert!(message.contains("LT of the warp of wrong is 60"), "{message}");
    place.write("typo.toml", "W = 20\nweigth = 3\n");
    let message = place.fails(3, &["fabrics", "--sheet", "typo.toml"]);
    assert!(message.contains("line 2: unknown field `weigth`"), "{message}");
}

#[test]
fn the_schema_and_the_reference_are_printed_as_they_are_kept() {
    let place = Place::new();
    let schema = place.succeeds(&["scenes", "--schema"]);
    assert_eq!(schema, cloth::scene::scene_schema());
    let schema: serde_json::Value = serde_json::from_str(&schema).unwrap();
    assert_eq!(schema["$schema"], "http://json-schema.org/draft-07/schema#");
    for key in ["cloth", "collider", "simulation", "view"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    let reference = place.succeeds(&["scenes", "--reference"]);
    assert_eq!(reference, cloth::scene::scene_reference());
    assert!(
        reference.starts_with("# Scene files")
            && reference.contains("| `time_step` | number | s |")
    );
    for wrong in [["--schema", "--reference"], ["--schema", "--json"], ["--reference", "--json"]] {
        assert_eq!(place.output(&["scenes", wrong[0], wrong[1]]).status.code(), Some(2));
    }
}

#[test]
fn a_gallery_shows_scenes_at_several_moments() {
    let place = Place::new();
    let arguments = ["scenes", "--gallery", "g/allery", "--scene", "quad", "--scene", "rigid-pair"];
    assert_eq!(place.succeeds(&arguments), "");
    let page = String::from_utf8(place.read("g/allery/index.html")).unwrap();
    for scene in cloth::scene::builtin_scenes() {
        let is_there = ["quad", "rigid-pair"].contains(&scene.name);
        assert_eq!(page.contains(&format!("<h2>{}</h2>", scene.name)), is_there, "{}", scene.name);
    }
    assert!(page.contains("Wooden blocks on a bed sheet") && !page.contains("<!--"));
    let files: Vec<_> =
        page.split("img src=\"").skip(1).map(|p| p.split('"').next().unwrap()).collect();
    assert_eq!(files.len(), 12);
    let pictures = files.iter().map(|file| place.read(&format!("g/allery/{file}")));
    let pictures: std::collections::HashSet<_> = pictures.collect();
    assert_eq!(pictures.len(), 12, "no two are alike");
    // What is there is not lost.
    assert!(place.fails(2, &arguments).contains("is not empty"));
    let message = place.fails(3, &["scenes", "--gallery", "other", "--scene", "quat"]);
    assert!(message.contains("did you mean `quad`?") && !place.path("other").exists());
}

#[test]
fn a_shown_scene_runs_as_a_file() {
    let place = Place::new();
    place.write("mine.toml", place.succeeds(&["scenes", "show", "flag"]));
    place.succeeds(&["check", "mine.toml"]);
}

#[test]
fn backends_are_listed() {
    let text = Place::new().succeeds(&["backends"]);
    for name in ["cpu", "reference", "wgpu", "cuda"] {
        assert!(text.lines().any(|line| line.starts_with(&format!("{name}: "))), "{text}");
    }
    if cfg!(feature = "wgpu") {
        assert!(text.contains("  adapter 0: ") && text.contains("    limits: "), "{text}");
    }
}

/// The tests give the program no XDG_RUNTIME_DIR, of which drivers complain.
#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "wgpu"), ignore = "needs the feature wgpu")]
fn drivers_have_no_word_on_stderr() {
    let place = Place::with("tiny.toml", TINY);
    for arguments in
        [&["backends"][..], &["run", "tiny.toml", "--backend", "wgpu", "--format", "none"]]
    {
        let mut command = place.command(arguments);
        // Nor the word that keeps one of them quiet in programs that cargo starts.
        command.env_remove("XDG_RUNTIME_DIR").env_remove("NODEVICE_SELECT");
        let output = command.output().unwrap();
        assert!(output.status.success());
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{arguments:?}");
    }
}

#[test]
fn what_this_build_lacks_is_answered_with_the_feature_that_adds_it() {
    let place = Place::with("tiny.toml", TINY);
    let mut asked = vec![];
    if !cfg!(feature = "viewer") {
        asked.push((&["view", "tiny.toml", "--paused"][..], "viewer"));
        asked.push((&["render", "tiny.toml", "--out", "a.gif"], "viewer"));
        asked.push((&["run", "tiny.toml", "--render"], "viewer"));
    }
    if !cfg!(feature = "cuda") {
        asked.push((&["run", "tiny.toml", "--backend", "cuda:1"], "cuda"));
    }
    if !cfg!(feature = "wgpu") {
        asked.push((&["run", "tiny.toml", "--backend", "wgpu"], "wgpu"));
    }
    for (arguments, feature) in asked {
        let message = place.fails(2, arguments);
        assert!(message.contains(&format!("--features {feature}")), "{message}");
    }
    assert!(!place.path("out").exists());
}

#[test]
fn shells_and_manuals_know_every_command() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = place.succeeds(&["completions", shell]);
        assert!(script.contains("convert") && script.contains("overwrite"), "{shell}");
    }
    let page = place.succeeds(&["man"]);
    assert!(page.contains(".TH cloth 1") && page.contains("143 by SIGTERM"), "{page}");
    let page = place.succeeds(&["man", "run"]);
    assert!(page.contains("overwrite") && page.contains("cloth"), "{page}");
    let message = place.fails(2, &["man", "fly"]);
    assert!(message.contains("there is no command `fly`; there are: run, scenes"), "{message}");
    let help = place.succeeds(&["--help"]);
    for part in ["129  ended by SIGHUP", "CLOTH_CACHE_DIR", "VK_DRIVER_FILES", "--quiet"] {
        assert!(help.contains(part), "{help}");
    }
}

#[test]
fn a_check_counts_and_warns() {
    let place = Place::with("tiny.toml", TINY);
    let text = place.succeeds(&["check", "tiny.toml"]);
    // 2 x 30 stretch, 2 x 25 shear, 2 x 24 bend.
    assert!(text.contains("patch: 36 particles, 50 triangles, 158 springs"), "{text}");
    assert!(text.contains("pins         2\n"), "{text}");
    assert!(!text.contains("warning"), "{text}");

    let unstable = TINY.replace("time_step = 1e-3", "time_step = 5e-2");
    place.write("tiny.toml", &unstable);
    let text = place.succeeds(&["check", "tiny.toml"]);
    let chosen =
        "chosen       implicit, in steps of 5.000e-2 s as given: explicit ones would diverge";
    assert!(text.contains(chosen), "{text}");
    let text = place.succeeds(&["check", "tiny.toml", "--solver", "explicit"]);
    assert!(text.contains("warning: the time step is ") && text.contains("will diverge"), "{text}");
    let loose = TINY[..TINY.find("[[collider]]").unwrap()].replace("pins = ", "# pins = ");
    place.write("tiny.toml", loose);
    let text = place.succeeds(&["check", "tiny.toml"]);
    assert!(text.contains("warning: nothing holds or stops the cloth"), "{text}");
    assert!(!place.path("out").exists());
}

/// Two sheets of fabric, the upper one falls onto the lower one, which hangs by its corners.
const SHEETS: &str = r#"
simulation = { frames = 60, frames_per_second = 120 }
[[cloth]]
name = "held"
pins = ["corners"]
material.preset = "jersey"
geometry.grid = { columns = 9, rows = 9, size = [0.4, 0.4] }
[[cloth]]
name = "falling"
material.preset = "denim"
geometry.grid = { columns = 7, rows = 7, size = [0.2, 0.2], centre = [0.01, 0.02, 0.02] }
"#;

#[test]
fn fabric_touches_fabric_if_a_scene_says_nothing_else() {
    let place = Place::with("sheets.toml", SHEETS);
    let text = place.succeeds(&["check", "sheets.toml"]);
    assert!(text.contains("contact of triangles at 4.00 mm with a friction of 0.3"), "{text}");
    let run = |name: &str| place.succeeds(&["run", name, "--audit", "--format", "none"]);
    let text = run("sheets.toml");
    assert!(text.contains("audit: no triangles intersect"), "{text}");
    place.write("through.toml", format!("contact.response = \"none\"\n{SHEETS}"));
    let text = run("through.toml");
    assert!(!text.contains("contact of triangles") && text.contains("triangles intersect"));
    assert!(!text.contains("audit: no triangles intersect"), "{text}");
    // The midpoint integrator has no such contact.
    let text = place.succeeds(&["check", "sheets.toml", "--solver", "midpoint"]);
    assert!(!text.contains("contact of triangles"), "{text}");
    // What contact alone has needs contact, and contact of points its distance.
    for (keys, message) in [
        (
            "distance = 0.01, response = \"none\"",
            "the response is \"none\": take one of the two out",
        ),
        ("response.impulse = {}", "needs `distance`"),
    ] {
        place.write("wrong.toml", format!("contact = {{ {keys} }}\n{SHEETS}"));
        let text = place.fails(3, &["check", "wrong.toml"]);
        assert!(text.contains(message) && text.contains("line 1,"), "{text}");
    }
}

#[test]
fn options_without_use_are_refused_in_a_sentence() {
    let place = Place::with("tiny.toml", TINY);
    for command in ["run", "check"] {
        let fails = |more: &[&str]| place.fails(2, &[&[command, "tiny.toml"], more].concat());
        for option in ["--linear=cg", "--preconditioner=block", "--tolerance=0.1", "--newton=2"] {
            let message = fails(&[option]);
            let name = option.split('=').next().unwrap();
            let expected = format!("{name} belongs to the implicit solver");
            assert!(message.contains(&expected) && message.contains("leave"), "{message}");
            let message = fails(&[option, "--solver", "semi-implicit"]);
            assert!(message.contains("the semi-implicit one is in use"), "{message}");
        }
        let message = fails(&["--solver=implicit", "--linear=direct", "--iterations=5"]);
        assert!(message.contains("--iterations belongs to methods that iterate"), "{message}");
    }
    assert!(!place.path("out").exists());
}

#[test]
fn a_check_knows_each_solver() {
    let place = Place::with(
        "tiny.toml",
        TINY.replace("time_step = 1e-3", "solver = 'explicit'\ntime_step = 5e-2"),
    );
    let check = |more: &[&str]| place.succeeds(&[&["check", "tiny.toml"], more].concat());
    let text = check(&["--solver", "implicit"]);
    assert!(!text.contains("warning"), "the step of another solver: {text}");
    assert!(text.contains("solver       implicit, cg with preconditioner auto, tolerance 0.001"));
    assert!(text.contains("time step    1.667e-2 s\nchosen       implicit, in 2 steps"), "{text}");
    assert!(text.contains("\nstable       at any time step"), "{text}");
    let text = check(&["--solver", "semi-implicit", "--time-step", "0.05"]);
    assert!(text.contains("warning: the time step is longer than a frame"), "{text}");
    let text = check(&["--adaptive"]);
    assert!(text.contains("time step    5.000e-2 s, halved up to 8 times where needed"), "{text}");
    assert!(!text.contains("warning"), "{text}");
    let large = TINY.replace("columns = 6, rows = 6", "columns = 80, rows = 80");
    place.write("tiny.toml", large);
    let text = check(&["--solver", "implicit", "--linear", "direct"]);
    assert!(text.contains("warning: the method direct") && text.contains("use the method cg"));
}

#[test]
fn a_contact_distance_that_parts_neighbours_is_reported() {
    let wide = |response| format!("{TINY}[contact]\ndistance = 0.06\nresponse.{response}\n");
    let place = Place::with("tiny.toml", wide("penalty.stiffness = 10"));
    let text = place.succeeds(&["check", "tiny.toml"]);
    assert!(text.contains("neighbours push each other apart"), "{text}");
    place.write("tiny.toml", wide("impulse.friction = 0.1"));
    let text = place.succeeds(&["check", "tiny.toml"]);
    assert!(!text.contains("neighbours"), "{text}");
}

#[test]
fn meshes_are_converted() {
    let place = Place::with("square.obj", SQUARE);
    place.succeeds(&["convert", "square.obj", "square.ply"]);
    place.succeeds(&["convert", "square.ply", "again.obj"]);
    let [first, second, third] = ["square.obj", "square.ply", "again.obj"]
        .map(|name| cloth::io::mesh_read(&place.path(name)).unwrap());
    assert_eq!(first.positions, second.positions);
    assert_eq!((first.positions, first.triangles), (third.positions, third.triangles));
    let message = place.fails(2, &["convert", "square.obj", "square.stl"]);
    assert!(message.contains("obj, ply, glb"), "{message}");
    place.write("bad.obj", "v 0 0 nan\n");
    let message = place.fails(3, &["convert", "bad.obj", "bad.ply"]);
    assert!(message.contains("bad.obj"), "{message}");
    assert!(!place.path("bad.ply").exists());
    let left = std::fs::read_dir(place.path("")).unwrap().count();
    assert_eq!(left, 4, "temporary files are left");
}

#[test]
fn frames_of_a_run_are_converted_wherever_its_meshes_are() {
    let place = Place::with("scenes/mesh.obj", SQUARE);
    place.write("scenes/scene.toml", MESH);
    place.succeeds(&["run", "scenes/scene.toml", "--out", "o", "--format", "pc2"]);
    for name in ["o.pc2", "o.mdd", "o.npz", "o.glb", "o.gif", "o.png"] {
        place.succeeds(&["convert", "o", name, "--picture-size", "32x18"]);
        assert!(!place.read(name).is_empty());
    }
    assert!(place.read("o.pc2") == place.read("o/meshed.pc2"));
    place.succeeds(&["convert", "o", "objs", "--format", "obj", "--frame-stride", "2"]);
    let names = std::fs::read_dir(place.path("objs")).unwrap();
    let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["meshed_000000.obj", "meshed_000002.obj"]);
    let message = place.fails(2, &["convert", "o", "frames"]);
    assert!(message.contains("--format with one of: obj"), "{message}");
    let message = place.fails(3, &["convert", "missing", "o.npz"]);
    assert!(message.contains("cannot read `missing`"), "{message}");
    let message = place.fails(3, &["convert", "scenes", "o.npz"]);
    assert!(message.contains("`scenes` is not the output folder of a run"), "{message}");
}

#[test]
fn scenes_are_written_out_in_full() {
    let place = Place::with("tiny.toml", TINY);
    place.succeeds(&["convert", "tiny.toml", "full.toml"]);
    let read = |name| cloth::scene::Scene::read(&place.path(name)).unwrap();
    assert_eq!(read("tiny.toml"), read("full.toml"));
    let full = String::from_utf8(place.read("full.toml")).unwrap();
    assert!(full.contains("friction") && !TINY.contains("friction"));
}

#[test]
fn convert_makes_the_folders_of_its_output() {
    let place = Place::with("square.obj", SQUARE);
    place.succeeds(&["convert", "square.obj", "a/b/square.glb"]);
    place.succeeds(&["convert", "a/b/square.glb", "c/square.obj"]);
    let [first, last] = ["square.obj", "c/square.obj"]
        .map(|name| cloth::io::mesh_read(&place.path(name)).unwrap().positions);
    assert_eq!(first, last, "up stays up");
    place.write("bad.obj", "v 0 0 nan\n");
    place.fails(3, &["convert", "bad.obj", "d/bad.ply"]);
    assert!(!place.path("d").exists(), "nothing is made for nothing");
}
