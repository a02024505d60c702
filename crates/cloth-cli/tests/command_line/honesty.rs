//! What contact of particles cannot promise is said.

use crate::place::Place;

/// A coarse sheet, a needle under it, and contact with itself over a short distance; all pinned sheets meet.
const SCENE: &str = r#"
name = "coarse"
simulation = { frames = 3, frames_per_second = 30, time_step = 5e-4 }

[[cloth]]
name = "sheet"
geometry.grid = { columns = 8, rows = 8, spacing = 0.05 }
material = { preset = "jersey", thickness = 0.002 }
pins = ["border"]

[[cloth]]
name = "lid"
geometry.grid = { columns = 8, rows = 8, spacing = 0.05, centre = [0.002, 0, 0.05] }
material = { preset = "jersey", thickness = 0.002 }
pins = ["all"]

[[collider]]
name = "needle"
shape.capsule = { half_length = 0.1, radius = 0.005 }
translation = [0, 0, -0.5]

[[collider]]
name = "floor"
shape.plane = {}
translation = [0, 0, -1]

[contact]
distance = 0.03
response.impulse.friction = 0.3

[[event]]
time = 0.0
cloth = "lid"
pins = ["all"]
action.move = { offset = [0, 0, -0.05], duration = 0.06 }
"#;

#[test]
fn what_is_thinner_than_the_cloth_is_fine_is_warned_of() {
    let place = Place::with("coarse.toml", SCENE);
    let text = place.succeeds(&["check", "coarse.toml"]);
    assert!(text.contains("collider \"needle\" is 0.0100 m thin"), "{text}");
    assert!(text.contains("contact distance 0.03 m is short"), "{text}");
    assert!(!text.contains("\"floor\""), "{text}");
    let fine = SCENE.replace("radius = 0.005", "radius = 0.05").replace("= 0.03", "= 0.04");
    place.write("fine.toml", fine);
    let text = place.succeeds(&["check", "fine.toml"]);
    assert!(!text.contains("slip through"), "{text}");
}

#[test]
fn the_summary_warns_of_cloth_in_cloth() {
    let place = Place::with("coarse.toml", SCENE);
    let text = place.succeeds(&["run", "coarse.toml"]);
    assert!(text.contains("closer than half the contact distance"), "{text}");
    assert!(text.contains("\"needle\" is 0.0100 m thin"), "{text}");
    assert!(text.contains("compression 0."), "{text}");
}

/// A strain of 0.136 at rest, and no word of it.
#[test]
fn cloth_far_from_the_origin_is_refused_in_single_precision() {
    let far = SCENE.replace("spacing = 0.05 }", "spacing = 0.05, origin = [1e4, 0, 0] }");
    let place = Place::with("far.toml", &far);
    let message = place.fails(3, &["check", "far.toml"]);
    assert!(message.contains("at most") && message.contains("precision f64"), "{message}");
    place.fails(3, &["run", "far.toml"]);
    place.succeeds(&["check", "far.toml", "--precision", "f64"]);
}
