//! What a writer of scenes is told.

use cloth_scene::{CompileOptions, Scene, SceneError};

const VALID: &str = r#"name = "test"

[simulation]
frames = 10
time_step = 0.001
solver = "implicit"

[simulation.implicit]
time_step = 0.02
linear = "cg"
preconditioner = "block"
matrix = "assembled"
tolerance = 0.01
iterations = 50
newton_iterations = 3
newton_tolerance = 0.05
constraint_passes = 2

[simulation.semi_implicit]
time_step = 0.01
solve = "factorisation"

[simulation.adaptive]
strain_max = 0.4
halvings = 5
grow_after = 6

[[cloth]]
name = "sheet"
pins = [0, "top-left"]
velocity = [0, 0, 0]

[cloth.geometry.grid]
columns = 5
rows = 4
spacing = 0.1

[cloth.material]
preset = "jersey"
thickness = 0.002
mass.per_area = 0.2
stretch.stiffness = 20
bend.rigidity = 1e-6

[[collider]]
name = "ball"
shape.sphere.radius = 0.3
friction = 0.5
restitution = 0.1

[[collider.motion]]
time = 1.0
translation = [0, 0, 1]

[contact]
distance = 0.05
response.impulse = { friction = 0.2 }

[wind]
velocity = [1, 0, 0]

[[event]]
time = 0.5
cloth = "sheet"
pins = [0]
action = "release"

[view]
eye = [1, 1, 1]
target = [0, 0, 0]
"#;

fn failure(text: &str) -> String {
    let result = Scene::from_toml(text, "test.toml")
        .and_then(|scene| scene.compile(&CompileOptions::default()));
    match result {
        Ok(_) => panic!("no error for:\n{text}"),
        Err(error) => error.to_string(),
    }
}

/// The message after `from` has become `to`; the last line of the change must be in it.
#[track_caller]
fn changed(from: &str, to: &str, expected: &str) {
    assert_eq!(VALID.matches(from).count(), 1, "{from} must be there once");
    let text = VALID.replace(from, to);
    let message = failure(&text);
    assert!(message.contains(expected), "{message}\nshould say: {expected}");
    let offset = VALID.find(from).unwrap_or_default();
    let line = 1 + VALID[..offset].matches('\n').count() + to.matches('\n').count();
    let place = format!("scene file `test.toml`, line {line}, column ");
    assert!(message.starts_with(&place), "{message}\nshould start with: {place}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
}

#[test]
fn the_unchanged_scene_is_valid() {
    Scene::from_toml(VALID, "test.toml").unwrap().compile(&CompileOptions::default()).unwrap();
}

#[test]
fn unknown_words_have_suggestions() {
    changed("spacing = 0.1", "spacin = 0.1", "unknown key `spacin`; did you mean `spacing`?");
    changed("bend.rigidity", "bend.rigidty", "did you mean `rigidity`?");
    changed("stretch.stiffness", "stretch.stifness", "did you mean `stiffness`?");
    changed("shape.sphere.radius", "shape.spere.radius", "did you mean `sphere`?");
    changed("[contact]", "[contct]", "unknown key `contct`; did you mean `contact`?");
    changed("\"jersey\"", "\"jersy\"", "unknown material preset `jersy`; did you mean `jersey`?");
    changed("\"top-left\"", "\"topleft\"", "did you mean `top-left`?");
    changed("cloth = \"sheet\"", "cloth = \"shet\"", "unknown cloth `shet`; did you mean `sheet`?");
    changed("\"release\"", "\"relase\"", "did you mean `release`?");
    changed("\"implicit\"", "\"implicid\"", "unknown word `implicid`; did you mean `implicit`?");
    changed("\"block\"", "\"blok\"", "unknown word `blok`; did you mean `block`?");
    changed("\"cg\"", "\"gmres\"", "known here: `cg`, `jacobi`, `direct`");
    changed("\"assembled\"", "\"asembled\"", "did you mean `assembled`?");
    changed("\"factorisation\"", "\"lu\"", "known here: `factorisation`, `dense-inverse`");
    changed("grow_after = 6", "grow_afer = 6", "did you mean `grow_after`?");
    changed("[simulation.implicit]", "[simulation.implicitt]", "did you mean `implicit`?");
}

#[test]
fn words_of_other_programs_are_told_what_they_are_here() {
    changed("time_step = 0.001", "dt = 0.001", "did you mean `time_step`?");
    changed("frames = 10", "gravity = -9.81", "at the top of the file");
    changed("velocity = [0, 0, 0]", "position = [0, 0, 1]", "a cloth is belongs to its geometry");
    changed("velocity = [0, 0, 0]", "fabric = \"denim\"", "material.preset = \"cotton\"");
    changed("translation = [0, 0, 1]", "position = [0, 0, 1]", "did you mean `translation`?");
}

#[test]
fn syntax_errors_have_a_line() {
    changed("frames = 10", "frames = = 10", "correct the text there");
    changed("columns = 5", "columns = \"five\"", "invalid type");
    changed("columns = 5", "columns = -5", "-5");
    changed("pins = [0, ", "pins = [0.5, ", "the index of a particle or the name of a set");
    changed(
        "shape.sphere.radius = ",
        "shape = \"plane\" # ",
        "`collider[0].shape`: `plane` has settings, in a table: write `shape.plane = { ... }`",
    );
    changed("pins = [0, ", "pins = [-1, ", "the index of a particle or the name of a set");
    changed("spacing = 0.1", "spacing = 0.1\nstencil = 12\nstencil = 24", "duplicate key");
}

#[test]
fn values_of_the_wrong_kind_have_their_key() {
    let kind = |key: &str, problem: &str| format!(": `{key}`: invalid {problem}");
    changed(
        "columns = 5",
        "columns = \"five\"",
        &kind("cloth[0].geometry.grid.columns", "type: string \"five\", expected u32"),
    );
    changed("columns = 5", "columns = -5", &kind("cloth[0].geometry.grid.columns", "value"));
    changed("frames = 10", "frames = 1.5", &kind("simulation.frames", "type: floating point"));
    changed(
        "friction = 0.5",
        "friction = true",
        &kind("collider[0].friction", "type: boolean `true`, expected f64"),
    );
    changed("radius = 0.3", "radius = \"\"", &kind("collider[0].shape.sphere.radius", "type"));
    changed("time = 1.0", "time = \"\"", &kind("collider[0].motion[0].time", "type"));
    changed(
        "velocity = [0, 0, 0]",
        "velocity = [0, 0, \"\"]",
        &kind("cloth[0].velocity[2]", "type"),
    );
    changed(
        "{ friction = 0.2 }",
        "{ friction = [] }",
        &kind("contact.response.impulse.friction", "type"),
    );
    changed("\"cg\"", "5", &kind("simulation.implicit.linear", "type: integer `5`"));
}

#[test]
fn numbers_are_finite() {
    changed("time_step = 0.001", "time_step = nan", "`simulation.time_step` is nan");
    changed("rigidity = 1e-6", "rigidity = inf", "`cloth[0].material.bend.rigidity` is inf");
    changed("velocity = [0, 0, 0]", "velocity = [0, 0, -inf]", "`cloth[0].velocity[2]` is -inf");
}

#[test]
fn values_are_checked_with_their_line() {
    changed("frames = 10", "frames = 0", "at least one frame");
    changed("time_step = 0.001", "time_step = 0", "greater than zero");
    changed("time_step = 0.001", "time_step = 1e-12", "substeps");
    changed("columns = 5", "columns = 1", "`cloth[0].geometry.grid.columns` is 1");
    changed("rows = 4", "rows = 0", "`cloth[0].geometry.grid.rows` is 0");
    changed("spacing = 0.1", "spacing = -0.1", "spacing of cloth \"sheet\" is -0.1");
    changed("thickness = 0.002", "thickness = 0", "thickness of cloth \"sheet\" is 0");
    changed("mass.per_area = 0.2", "mass.per_area = -1", "mass per area of cloth \"sheet\" is -1");
    changed("stretch.stiffness = 20", "stretch.stiffness = -3", "stretch stiffness");
    for bad in ["0", "-1e-6"] {
        let expected = format!("bend rigidity of cloth \"sheet\" is {bad}");
        changed(
            "rigidity = 1e-6",
            &format!("rigidity = {bad}"),
            &expected.replace("-1e-6", "-0.000001"),
        );
    }
    changed("radius = 0.3", "radius = 0", "radius of collider \"ball\" is 0");
    changed("friction = 0.5", "friction = -1", "friction of collider \"ball\" is -1");
    changed("restitution = 0.1", "restitution = 2", "between 0 and 1");
    changed("distance = 0.05", "distance = 0", "distance of the self-contact is 0");
    changed("{ friction = 0.2 }", "{ friction = -2 }", "friction of the self-contact is -2");
    changed("pins = [0, ", "pins = [20, ", "pin 20 does not exist, there are 20 particles");
    changed("time = 1.0", "time = 0.0", "greater than zero");
    changed("pins = [0]", "pins = [1]", "no pin of cloth \"sheet\" is held there");
    changed("target = [0, 0, 0]", "target = [1, 1, 1]", "is where the eye is");
    changed("velocity = [1, 0, 0]", "velocity = [1, 0, 0]\ndensity = -1", "density of the air");
}

/// Also those of solvers that the scene does not choose: another run of it may.
#[test]
fn settings_of_all_solvers_are_checked_with_their_line() {
    for solver in ["implicit", "explicit", "semi-implicit"] {
        let check = |from: &str, to: &str, expected: &str| {
            let text = VALID.replace("\"implicit\"", &format!("{solver:?}"));
            assert_eq!(text.matches(from).count(), 1, "{from} must be there once");
            let message = failure(&text.replace(from, to));
            assert!(message.contains(expected), "{message}\nshould say: {expected}");
            let line = 1 + text[..text.find(from).unwrap_or_default()].matches('\n').count();
            assert!(message.starts_with(&format!("scene file `test.toml`, line {line}, ")));
        };
        let positive = "it must be greater than zero";
        let implicit = "`simulation.implicit.";
        check(
            "time_step = 0.02",
            "time_step = 0",
            &format!("{implicit}time_step` is 0: {positive}"),
        );
        check("time_step = 0.02", "time_step = 1e-12", "substeps of a frame");
        check("time_step = 0.01", "time_step = -1", &format!("time_step` is -1: {positive}"));
        check(
            "time_step = 0.01",
            "time_step = 1e-12",
            "`simulation.semi_implicit.time_step` makes",
        );
        check(
            "tolerance = 0.01",
            "tolerance = 2",
            &format!("{implicit}tolerance` is 2: it must lie"),
        );
        check("tolerance = 0.05", "tolerance = -1", &format!("{implicit}newton_tolerance` is -1"));
        check("iterations = 50", "iterations = 0", &format!("{implicit}iterations` is 0"));
        check("newton_iterations = 3", "newton_iterations = 0", "newton_iterations` is 0: give at");
        check("passes = 2", "passes = 0", &format!("{implicit}constraint_passes` is 0: give at"));
        check("strain_max = 0.4", "strain_max = 0", &format!("strain_max` is 0: {positive}"));
        check(
            "halvings = 5",
            "halvings = 21",
            "`simulation.adaptive.halvings` is 21: give at most 20",
        );
        check("grow_after = 6", "grow_after = 0", "`simulation.adaptive.grow_after` is 0: give at");
    }
    let message = failure(&VALID.replace("time_step = 0.02", "time_step = 1e-6"));
    assert!(message.contains("halvings` is 5, which can make 1066667 substeps"), "{message}");
}

#[test]
fn a_text_that_is_no_unicode_has_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, b"name = \"x\"\n\n# \xff").unwrap();
    let message = Scene::read(&path).unwrap_err().to_string();
    assert!(message.contains("line 3, column 3: the text is not UTF-8"), "{message}");
    let missing = Scene::read(&folder.path().join("none.toml")).unwrap_err();
    assert!(matches!(missing, SceneError::Read { .. }), "{missing}");
}

#[test]
fn the_same_name_twice_points_at_the_second() {
    let second = "\n[[cloth]]\nname = \"sheet\"\ngeometry.grid = { columns = 2, rows = 2, spacing = 1 }\nmaterial.preset = \"denim\"\n";
    let message = failure(&format!("{VALID}{second}"));
    let line = VALID.lines().count() + 3;
    assert!(message.contains(&format!("line {line}, ")), "{message}");
    assert!(message.contains("two cloths are called \"sheet\""), "{message}");
}

#[test]
fn errors_in_expressions_name_the_line_of_the_scene_and_of_the_expression() {
    let text = format!("{VALID}\n[[field]]\nexpression = \"\"\"\nm * x\n  + t\"\"\"\n");
    let message = failure(&text);
    let line = 1 + text[..text.find("expression").unwrap()].matches('\n').count();
    assert!(message.starts_with(&format!("scene file `test.toml`, line {line}, ")), "{message}");
    assert!(
        message.contains("at its line 2, column 3: `+` takes two scalars or two vec3"),
        "{message}"
    );
    let valid = text.replace("+ t", "+ v * t");
    let scene = Scene::from_toml(&valid, "test.toml").unwrap();
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!(compiled.model.field_programs().count(), 1);
}

/// Solids that bound no volume, bodies without mass.
#[test]
fn errors_in_solids_name_the_body() {
    let rigid = "\n[[rigid]]\nname = \"wedge\"\nmass = 1.0\nshape.tetrahedron.vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n";
    let text = format!("{VALID}{rigid}");
    let scene = Scene::from_toml(&text, "test.toml").unwrap();
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!(compiled.rigids.len(), 1);
    assert_eq!(compiled.model.colliders().len(), scene.colliders.len() + 1);
    for (from, to, expected) in [
        ("mass = 1.0", "mass = 0.0", "greater than zero"),
        ("[0.0, 0.0, 1.0]]", "[1.0, 1.0, 0.0]]", "no volume"),
        ("name = \"wedge\"", "name = \"ball\"", "colliders are called \"ball\""),
    ] {
        let message = failure(&text.replace(from, to));
        assert!(message.contains("line ") && message.contains(expected), "{message}");
    }
}

fn compile(text: &str) -> Result<cloth_scene::CompiledScene, SceneError> {
    Scene::from_toml(text, "small.toml")?.compile(&CompileOptions::default())
}

/// Springs with values of their own need none of the material; others do.
#[test]
fn a_network_needs_no_stiffness_that_none_of_its_springs_takes() {
    let text = |prototype: &str| {
        format!(
            "[[cloth]]\nmaterial = {{ mass.per_particle = 0.002, thickness = 0.004 }}\n\
             geometry.network = {{ width = 3, positions = [[0, 0, 1], [1, 0, 1], [2, 0, 1]], prototype = [{prototype}] }}\n"
        )
    };
    let own = compile(&text("{ class = \"stretch\", stiffness = 30.0 }")).unwrap();
    assert_eq!(own.model.springs().len(), 2);
    let error = compile(&text("{ class = \"stretch\" }")).unwrap_err().to_string();
    assert!(error.contains("has no `stretch.stiffness`"), "{error}");
}

#[test]
fn numbers_begin_with_a_digit() {
    let text = "[[cloth]]\nmaterial.preset = \"cotton\"\ngeometry.grid = { columns = 3, rows = 3, spacing = .1 }\n";
    let error = compile(text).unwrap_err().to_string();
    assert!(error.contains("line 3") && error.contains("0.5, not .5"), "{error}");
}

/// A closed box has faces across every axis.
#[test]
fn a_closed_mesh_of_fabric_needs_no_direction_of_the_warp() {
    let text = |axis: &str| {
        format!(
            "[[cloth]]\nmaterial.preset = \"cotton\"\n{axis}\ngeometry.triangles = {{ vertices = [[0, 0, 1], [0.2, 0, 1], [0.2, 0.1, 1], [0, 0.1, 1], \
             [0, 0, 1.1], [0.2, 0, 1.1], [0.2, 0.1, 1.1], [0, 0.1, 1.1]], faces = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], \
             [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]] }}\n"
        )
    };
    assert_eq!(compile(&text("")).unwrap().model.elements().triangles().len(), 12);
    let error = compile(&text("pattern.axis = [1, 0, 0]")).unwrap_err().to_string();
    assert!(error.contains("stands upright on triangle 6"), "{error}");
}
