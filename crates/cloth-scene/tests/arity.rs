//! Arrays of a fixed length are as long as they must be, in every key that takes one.

use cloth_scene::{CompileOptions, Scene, builtin_scenes};

const SCENE: &str = "name = \"arity\"
gravity = [0, 0, -9.81]
[[cloth]]
name = \"c\"
velocity = [0, 0, 0]
pins = [0, 1, 2, \"top\"]
material.preset = \"denim\"
geometry.grid = { columns = 2, rows = 2, size = [1, 1], centre = [0, 0, 1], column_axis = [1, 0, 0], row_axis = [0, 1, 0] }
[[cloth]]
name = \"t\"
material.preset = \"denim\"
geometry.triangles = { vertices = [[0, 0, 5], [1, 0, 5], [0, 1, 5]], faces = [[0, 1, 2]] }
[[cloth]]
name = \"n\"
material = { preset = \"denim\", mass.per_particle = 0.01 }
geometry.network = { width = 2, positions = [[0, 0, 7], [1, 0, 7]], prototype = [{ class = \"stretch\" }] }
[[collider]]
name = \"b\"
shape.box.half_extents = [1, 1, 1]
translation = [0, 0, -5]
rotation = { axis = [0, 0, 1], degrees = 5 }
motion = [{ time = 1, translation = [0, 0, 1] }]
[[collider]]
name = \"p\"
shape.plane.normal = [0, 0, 1]
translation = [0, 0, -9]
[[rigid]]
name = \"r\"
mass = 1
shape.tetrahedron.vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
velocity = [0, 0, 0]
force = [0, 0, 0]
centre_of_mass = [0.1, 0.1, 0.1]
angular_velocity = [0, 0, 0]
torque = [0, 0, 0]
[[rigid_joint]]
kind = \"hinge\"
from = \"r\"
anchor = [0, 0, 0]
axis = [0, 0, 1]
limits = [0, 90]
[[field]]
uniform.acceleration = [0, 0, 0]
[[field]]
drag.rate = [0, 0, 0]
[wind]
velocity = [0, 0, 0]
[[event]]
time = 1
cloth = \"c\"
pins = [0]
action.move = { offset = [0, 0, 1], duration = 1 }
[bounds]
min = [0, 0, 0]
max = [1, 1, 1]
[view]
eye = [0, 1, 1]
target = [0, 0, 1]
";

#[test]
fn the_scene_of_these_tests_is_good() {
    let scene = Scene::from_toml(SCENE, "a.toml").unwrap();
    scene.compile(&CompileOptions::default()).unwrap();
}

#[test]
fn four_numbers_for_gravity_are_refused_with_line_and_column() {
    let text = SCENE.replace("[0, 0, -9.81]", "[0, 0, 0, -9.81]");
    let message = Scene::from_toml(&text, "a.toml").unwrap_err().to_string();
    let expected = "scene file `a.toml`, line 2, column 21: `gravity` has 4 elements: give 3; \
                    correct the text there";
    assert_eq!(message, expected);
}

/// One more element in each array of the scene in turn: refused where the length is fixed, accepted by lists.
#[test]
fn one_element_more_is_refused_in_every_array_of_fixed_length() {
    let lists = ["pins", "prototype", "positions", "vertices", "faces", "motion"];
    let mut fixed = 0;
    for (end, _) in SCENE.match_indices(']') {
        // Headers of tables end in brackets, too.
        let start = SCENE[..end].rfind('\n').map_or(0, |at| at + 1);
        let line = &SCENE[start..=end];
        if line.starts_with('[') || SCENE[..end].ends_with('}') {
            continue;
        }
        let opening = (0..end)
            .rev()
            .scan(1, |depth, at| {
                *depth += i32::from(SCENE.as_bytes()[at] == b']');
                *depth -= i32::from(SCENE.as_bytes()[at] == b'[');
                Some((at, *depth))
            })
            .find_map(|(at, depth)| (depth == 0).then_some(at))
            .unwrap();
        let key = SCENE[..opening].trim_end().trim_end_matches('=').trim_end();
        let key = key.rsplit([' ', '.', '\n']).next().unwrap();
        if lists.contains(&key) {
            continue;
        }
        // Its last element once more.
        let last = SCENE[opening + 1..end].rsplit(',').next().unwrap();
        let text = format!("{},{last}{}", &SCENE[..end], &SCENE[end..]);
        let message = match Scene::from_toml(&text, "a.toml") {
            Ok(_) => panic!("one element more in {:?} is accepted", &SCENE[opening..=end]),
            Err(error) => error.to_string(),
        };
        let place = SCENE[..end].matches('\n').count() + 1;
        assert!(message.contains(&format!("line {place}, column ")), "{message}");
        assert!(message.contains("elements: give "), "{message}");
        fixed += 1;
    }
    assert!(fixed > 30, "only {fixed} arrays were tried");
}

#[test]
fn four_corners_of_a_tetrahedron_are_not_five() {
    let text = SCENE.replace("[0, 0, 1]]\nvelocity", "[0, 0, 1], [2, 2, 2]]\nvelocity");
    let message = Scene::from_toml(&text, "a.toml").unwrap_err().to_string();
    let expected = "`rigid[0].shape.tetrahedron.vertices` has 5 elements: give 4";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn an_array_is_no_table() {
    let text = SCENE.replace("[view]\neye = [0, 1, 1]\ntarget = [0, 0, 1]\n", "");
    let text = format!("view = [[0, 1, 1], [0, 0, 1], 40]\n{text}");
    let message = Scene::from_toml(&text, "a.toml").unwrap_err().to_string();
    assert!(message.contains("line 1, column 8: `view` is an array"), "{message}");
}

#[test]
fn built_in_scenes_have_arrays_of_the_right_length() {
    for scene in builtin_scenes() {
        Scene::builtin(scene.name).unwrap();
    }
}
