//! No text makes the reader or the compiler panic.

use std::sync::LazyLock;

use cloth_scene::{CompileOptions, Scene, builtin_scenes};
use proptest::prelude::*;

/// Small enough that a mutated count is refused rather than built.
fn options() -> CompileOptions {
    CompileOptions { memory_limit: 8 << 20, ..CompileOptions::default() }
}

/// Scenes small enough to compile thousands of times, with every kind of table.
static SMALL: LazyLock<Vec<String>> = LazyLock::new(|| {
    let full = r##"name = "full"
gravity = [0.0, 0.1, -9.8]
[simulation]
frames = 3
frames_per_second = 24.0
time_step = 1e-3
strain_bound = 5.0
strain_limit = { ratio = 1.1, sweeps = 2, classes = ["bend"] }
solver = "semi-implicit"
adaptive = { strain_max = 0.25, halvings = 3, grow_after = 2 }
implicit = { time_step = 0.25, linear = "jacobi", preconditioner = "diagonal", matrix = "assembled", stop = "residual", tolerance = 0.125, iterations = 30, warm_start = true, newton_iterations = 2, newton_tolerance = 0.5, constraint_passes = 3 }
semi_implicit = { time_step = 0.125, solve = "dense-inverse" }
[[cloth]]
name = "a"
pins = [0, 3, "row-1", "corners"]
velocity = [0.0, 1.0, 2.0]
colour = "#102030"
geometry.grid = { columns = 4, rows = 3, size = [0.3, 0.2], centre = [0.5, 0.25, 1.5], stencil = 24 }
material = { preset = "denim", mass.per_particle = 0.5, bend = { stiffness = 2.5, damping = 0.125, rigidity = 1e-4 }, aerodynamics.pressure = 1.5 }
[[collider]]
name = "b"
shape.capsule = { half_length = 0.5, radius = 0.25 }
rotation = { axis = [0.0, 1.0, 1.0], degrees = 30.5 }
restitution = 0.5
motion = [{ time = 1.5, translation = [1.0, 2.5, 3.0], rotation = { axis = [1.0, 0.0, 0.5], degrees = 400.0 } }]
[[collider]]
name = "c"
shape.plane.normal = [0.0, 0.5, 1.0]
[[collider]]
name = "d"
shape.box.half_extents = [0.5, 1.5, 2.5]
[[field]]
uniform.acceleration = [0.5, 0.0, 0.0]
[[field]]
drag.rate = [0.5, 0.25, 0.0]
[wind]
velocity = [1.0, 0.0, 0.0]
density = 1.25
gust = { amplitude = 0.5, frequency = 2.0 }
[contact]
distance = 0.05
response.penalty = { stiffness = 10.0, damping = 0.5 }
[[event]]
time = 0.5
cloth = "a"
pins = ["corners"]
action.move = { offset = [0.0, 0.5, 1.0], duration = 0.75 }
[[event]]
time = 1.5
cloth = "a"
pins = [0]
action = "release"
[view]
eye = [1.0, 2.0, 3.0]
target = [0.0, 0.5, 0.0]
field_of_view = 35.0
dust = { count = 10, min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 0.5], lifetime = 2.0 }
"##;
    let mut all = vec![full.to_owned()];
    let toml = builtin_scenes().iter().filter(|scene| scene.extension == "toml");
    all.extend(toml.map(|scene| scene.text.to_owned()));
    all
});

/// Compiles and looks at some frames; the result does not matter, that there is one does.
fn exercise(text: &str) {
    let Ok(scene) = Scene::from_toml(text, "p.toml") else { return };
    let Ok(compiled) = scene.compile(&options()) else { return };
    for frame in [0, 1, 2, 17, 40, u64::MAX] {
        let control = compiled.timeline.control(frame);
        assert!(control.validate(&compiled.model).is_ok(), "frame {frame} of:\n{text}");
    }
}

/// Ranges of the numbers of a TOML text.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || "._-#\"".contains(c);
    let mut found = Vec::new();
    let mut start = 0;
    for word in text.split(|c| !is_part(c)) {
        if word.starts_with(|c: char| c.is_ascii_digit() || c == '-') && word.parse::<f64>().is_ok()
        {
            found.push(start..start + word.len());
        }
        start += word.len() + 1;
    }
    found
}

#[test]
fn every_number_of_a_scene_can_be_anything() {
    let text = &SMALL[0];
    Scene::from_toml(text, "p.toml").unwrap().compile(&options()).unwrap();
    let numbers = numbers(text);
    assert!(numbers.len() > 70, "only {} numbers found", numbers.len());
    let extremes = ["nan", "inf", "-inf", "0", "-1", "1e308", "-1e308", "1e-308", "1e999", "5"];
    for range in numbers {
        for value in extremes {
            let mut mutated = text.clone();
            mutated.replace_range(range.clone(), value);
            let read = Scene::from_toml(&mutated, "p.toml");
            if ["nan", "inf", "-inf", "1e999"].contains(&value) {
                assert!(read.is_err(), "accepted {value} in:\n{mutated}");
            }
            exercise(&mutated);
        }
    }
}

#[test]
fn the_full_scene_survives_a_round_trip() {
    let scene = Scene::from_toml(&SMALL[0], "p.toml").unwrap();
    let text = scene.to_toml().unwrap();
    assert_eq!(Scene::from_toml(&text, "q.toml").unwrap(), scene, "{text}");
}

proptest! {
    #[test]
    fn any_text(text in "\\PC{0,200}") {
        exercise(&text);
    }

    #[test]
    fn text_like_toml(text in "([a-z]{1,8}(\\.[a-z]{1,8})? = ([0-9.e-]{1,6}|\\[[0-9, ]{0,8}\\]|\"[a-z]{0,5}\"|\\{\\})\n|\\[{1,2}(cloth|collider|event|view)\\]{1,2}\n){0,12}") {
        exercise(&text);
    }

    #[test]
    fn valid_scenes_with_a_piece_cut_out_or_doubled(
        which in 0..SMALL.len(),
        from in any::<prop::sample::Index>(),
        length in 0_usize..60,
        double in any::<bool>(),
    ) {
        let text = &SMALL[which];
        let boundary = |at: usize| {
            (at.min(text.len())..=text.len()).find(|&i| text.is_char_boundary(i)).unwrap()
        };
        let start = boundary(from.index(text.len()));
        let end = boundary(start + length);
        let middle = if double { text[start..end].repeat(2) } else { String::new() };
        exercise(&format!("{}{middle}{}", &text[..start], &text[end..]));
    }

    #[test]
    fn valid_scenes_with_any_number(
        which in 0..SMALL.len(),
        place in any::<prop::sample::Index>(),
        value in any::<f64>(),
    ) {
        let text = &SMALL[which];
        let numbers = numbers(text);
        let range = numbers[place.index(numbers.len())].clone();
        let mut mutated = text.clone();
        mutated.replace_range(range, &format!("{value:?}").replace("NaN", "nan"));
        exercise(&mutated);
    }
}
