//! Scenes in FYSL: run, converted both ways, and given back.

use cloth::scene::{Scene, builtin_scenes, fysl::FyslFeedback};

use crate::place::{Place, TINY};

/// A ball of 50 g falls into a small sheet.
const FALL: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fysl version="1.0">
  <scene name="fall" frame_rate="30"/>
  <simulation interval="0.0005" steps="12">
    <procedural>vec3(0, 0.1 * m * sin(t), 0)</procedural>
  </simulation>
  <actors>
    <group id="1" name="sheet" model="springs" pins="corners">
      <grid width="9" height="9" spacing="0.05" centre="0 0.5 0" width_axis="1 0 0" height_axis="0 0 1"/>
      <fabric preset="jersey"/>
    </group>
    <rigid id="2" name="ball">
      <transform translation="0 0.62 0"/>
      <linear mass="0.05"/>
      <sphere radius="0.08"/>
    </rigid>
  </actors>
</fysl>
"#;

/// The vertices of the last frame are those of this mesh.
fn assert_mesh(place: &Place, mesh: &str, feedback: &FyslFeedback) {
    let obj = String::from_utf8(place.read(mesh)).unwrap();
    let vertices: Vec<Vec<f64>> = obj
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect())
        .collect();
    let found: Vec<[f64; 3]> =
        feedback.frames.last().unwrap().groups.iter().flat_map(|g| g.vertices.clone()).collect();
    assert_eq!(found.len(), vertices.len(), "{mesh}");
    for (found, wanted) in found.iter().flatten().zip(vertices.iter().flatten()) {
        assert!((found - wanted).abs() < 1e-6, "{mesh}: {found} {wanted}");
    }
}

#[test]
fn the_built_in_scenes_run_on_every_backend_and_give_their_final_state_back() {
    for backend in cloth::backends() {
        for scene in builtin_scenes().iter().filter(|scene| scene.extension == "fysl") {
            let place = Place::new();
            // In single precision unless it has double precision alone.
            let precision = backend.precisions[0];
            let command = format!(
                "run {} --backend {} --precision {precision} --frames 6 --out o --format obj --feedback back.fysl",
                scene.name, backend.name
            );
            place.succeeds(&command.split(' ').collect::<Vec<_>>());
            let text = String::from_utf8(place.read("back.fysl")).unwrap();
            let feedback = FyslFeedback::from_fysl(&text, "back.fysl").unwrap();
            assert_eq!(feedback.frames.len(), 6, "{} on {}", scene.name, backend.name);
            assert_mesh(&place, &format!("o/obj/{}_000006.obj", scene.name), &feedback);
        }
    }
}

#[test]
fn feedback_read_back_is_the_final_state() {
    let place = Place::with("fall.fysl", FALL);
    let arguments =
        ["run", "fall.fysl", "--out", "o", "--format", "obj", "--feedback", "back.fysl"];
    place.succeeds(&arguments);
    let text = String::from_utf8(place.read("back.fysl")).unwrap();
    let feedback = FyslFeedback::from_fysl(&text, "back.fysl").unwrap();
    assert_eq!(feedback.frames.len(), 12);
    let last = &feedback.frames[11];
    assert_eq!((last.number, last.groups.len(), last.rigids.len()), (12, 1, 1));
    assert_mesh(&place, "o/obj/fall_000012.obj", &feedback);
    let ball = last.rigids[0].translation;
    assert!((0.5..0.57).contains(&ball[2]), "it fell, and not through: {ball:?}");
    let lowest = last.groups[0].vertices.iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
    assert!(lowest < 0.49 && ball[2] > lowest, "the sheet holds the ball: {lowest} {ball:?}");
    assert_eq!(
        Scene::from_fysl(&text, "back.fysl").unwrap(),
        Scene::from_fysl(FALL, "fall.fysl").unwrap(),
        "and the scene is in it"
    );
}

#[test]
fn a_run_with_bodies_goes_on_as_if_it_had_not_ended() {
    let place = Place::with("fall.fysl", FALL);
    let run = |folder: &str, more: &[&str]| {
        let arguments = ["run", "fall.fysl", "--out", folder, "--format", "obj"];
        place.succeeds(&[&arguments[..], more].concat());
    };
    run("whole", &[]);
    run("parts", &["--frames", "5"]);
    run("parts", &["--resume"]);
    for file in ["poses.txt", "frames.bin", "obj/fall_000005.obj", "obj/fall_000012.obj"] {
        let [whole, parts] =
            ["whole", "parts"].map(|folder| place.read(&format!("{folder}/{file}")));
        assert!(whole == parts, "{file}");
    }
    let poses = place.read("parts/poses.txt");
    assert_eq!(poses.iter().filter(|&&byte| byte == b'\n').count(), 13);
    place.write("parts/poses.txt", b"nothing\n");
    let message =
        place.fails(3, &["run", "fall.fysl", "--out", "parts", "--format", "obj", "--resume"]);
    assert!(message.contains("poses.txt"), "{message}");
}

#[test]
fn scenes_are_converted_both_ways() {
    let place = Place::with("fall.fysl", FALL);
    place.succeeds(&["convert", "fall.fysl", "fall.toml"]);
    place.succeeds(&["convert", "fall.toml", "again.xml"]);
    let read = |name: &str| String::from_utf8(place.read(name)).unwrap();
    let scene = Scene::from_fysl(FALL, "fall.fysl").unwrap();
    assert_eq!(Scene::from_toml(&read("fall.toml"), "fall.toml").unwrap(), scene);
    assert_eq!(Scene::from_fysl(&read("again.xml"), "again.xml").unwrap(), scene);
    let place = Place::with("tiny.toml", TINY);
    place.succeeds(&["convert", "tiny.toml", "tiny.fysl"]);
    place.succeeds(&["run", "tiny.fysl", "--format", "none"]);
    let text = place.fails(2, &["convert", "tiny.toml", "tiny.txt"]);
    assert!(text.contains("toml or fysl"), "{text}");
}

#[test]
fn errors_name_file_line_and_column() {
    let place = Place::with("bad.fysl", FALL.replace("<sphere", "<sfere"));
    let text = place.fails(3, &["run", "bad.fysl"]);
    assert!(text.contains("bad.fysl`, line 15, column 7"), "{text}");
    assert!(text.contains("did you mean `sphere`?"), "{text}");
}
