//! FYSL: what it means, that it survives being written and read, and what is wrong with bad files.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::fmt::Write;

use cloth_scene::{
    CompileOptions, Scene, SceneError, SceneField, SceneGeometry, SceneRigidShape, SceneRotation,
    SceneShape, builtin_scenes,
    fysl::{FyslFeedback, FyslFrame, FyslTransform, FyslVertices, fysl_xsd},
};
use proptest::prelude::*;

/// Every element and attribute of the language.
const FULL: &str = r##"<?xml version="1.0" encoding="UTF-8"?>
<!-- Comments have no meaning. -->
<fysl version="1.0">
  <scene name="full &amp; &lt;whole&gt;" description="two&#10;lines" units="SI" gravity="0 -9.81 0.5" frame_rate="49">
    <bounds min="-1 -2 -3" max="1 2 3"/>
    <view eye="1 2 3" target="0 0.5 0" field_of_view="35" strain="0.05" threads="true"><dust count="10" min="-1 0 -1" max="1 0.5 1" lifetime="2"/></view>
    <wind velocity="1 0 2" density="1.25"><gust amplitude="0.5" frequency="2"/></wind>
    <contact distance="0.01"><impulse restitution="0.5" friction="0.25"/></contact>
  </scene>
  <simulation type="implicit" interval="0.0005" steps="3" precision="f64" strain_bound="5">
    <strain_limit ratio="1.1" sweeps="2" classes="bend, stretch"/>
    <adaptive strain_max="0.25" halvings="3" grow_after="2"/>
    <implicit interval="0.25" linear="jacobi" preconditioner="diagonal" matrix="assembled" stop="residual" tolerance="0.125" iterations="30" warm_start="true" newton_iterations="2" newton_tolerance="0.5" constraint_passes="3"/>
    <semi_implicit interval="0.125" solve="dense-inverse"/>
    <drag rate="1 2 3"/>
    <procedural><![CDATA[select(x.y < 1, m * vec3(0, 1, 2), v)]]></procedural>
    <directional acceleration="1 2 3"/>
    <procedural_right_handed>x * t</procedural_right_handed>
    <release time="1.5" group="sheet" pins="0, top"/>
    <move time="0.5" group="sheet" pins="corners" offset="1 2 3" duration="0.75"/>
  </simulation>
  <actors>
    <group id="7" name="sheet" type="particle" colour="#102030" pins="0, corners, top">
      <linear velocity="1 2 3"/>
      <grid width="4" height="3" size="0.3 0.2" centre="0 1 0" width_axis="1 0 0" height_axis="0 0 1" neighbours="24"/>
      <fabric preset="denim" mass="0.5"><bend stiffness="2.5" damping="0.125" rigidity="0.0001"/><aerodynamics pressure="1.5"/></fabric>
    </group>
    <group id="1" name="flap">
      <mesh><vertices>0 0 0  1 0 0  0 1 0</vertices><faces>0 1 2</faces></mesh>
      <fabric thickness="0.01" density="0.2"><stretch stiffness="10" damping="0.1"/><shear stiffness="5"/><bend stiffness="1"/></fabric>
    </group>
    <group id="2" name="net">
      <particles width="2" height="2">
        <particle id="9" position="0 0 0"/>
        <particle id="4" position="1 0 0"/>
        <particle id="5" position="0 1 0"/>
        <prototype type="stretch" stiffness="3" damping="0.5" length="0.9"/>
        <joint type="shear" from="5" to="4" stiffness="2"/>
      </particles>
      <fabric thickness="0.01" mass="0.1"><stretch stiffness="10"/><shear stiffness="5"/><bend stiffness="1"/></fabric>
    </group>
    <rigid id="3" name="brick" colour="#ffffff">
      <transform translation="1 2 3"><rotation axis="0 1 0" degrees="90"/></transform>
      <linear mass="2" velocity="1 2 3" force="4 5 6" centre_of_mass="0 0.1 0"/>
      <angular omega="1 2 3" torque="4 5 6"/>
      <matter restitution="0.5" friction="0.25"/>
      <box half_extents="1 2 3"/>
    </rigid>
    <rigid id="4" name="wedge">
      <linear mass="1"/>
      <tetrahedron><vertices>0 0 0  1 0 0  0 1 0  0 0 1</vertices></tetrahedron>
    </rigid>
    <rigid id="5" name="hull">
      <linear mass="1"/>
      <mesh><vertices>0 0 0  1 0 0  0 1 0  0 0 1</vertices><faces>0 2 1 0 1 3 0 3 2 1 2 3</faces></mesh>
    </rigid>
    <collider id="6" name="floor"><matter friction="0.5"/><plane normal="0 1 0"/></collider>
    <collider id="8" name="pole">
      <transform translation="0 5 0"/>
      <capsule half_length="1" radius="0.1"/>
      <keyframe time="1.5" translation="1 2 3"><rotation axis="1 0 0" degrees="400"/></keyframe>
    </collider>
  </actors>
  <feedback><frame number="1" time="0.5"><group name="flap"><vertices>1 2 3</vertices></group></frame></feedback>
</fysl>
"##;

fn read(text: &str) -> Scene {
    Scene::from_fysl(text, "full.fysl").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn error(text: &str) -> (Option<(u32, u32)>, String) {
    let error = Scene::from_fysl(text, "bad.fysl").unwrap_err();
    let position = match &error {
        SceneError::Syntax { place, .. } | SceneError::Value { place, .. } => place.position,
        SceneError::Unknown(unknown) => unknown.place.position,
        other => panic!("{other}"),
    };
    let text = error.to_string();
    assert!(text.starts_with("scene file `bad.fysl`, line ") && !text.contains('\n'), "{text}");
    (position, text)
}

#[test]
fn left_handed_with_y_up_becomes_right_handed_with_z_up() {
    let scene = read(FULL);
    assert_eq!(scene.gravity, [0.0, 0.5, -9.81]);
    let brick = &scene.rigids[0];
    assert_eq!((brick.translation, brick.velocity), ([1.0, 3.0, 2.0], [1.0, 3.0, 2.0]));
    assert_eq!(brick.force, [4.0, 6.0, 5.0]);
    assert_eq!(brick.angular_velocity, [-1.0, -3.0, -2.0], "left hands turn the other way");
    assert_eq!(brick.torque, [-4.0, -6.0, -5.0]);
    assert_eq!(brick.rotation, Some(SceneRotation { axis: [0.0, 0.0, -1.0], degrees: 90.0 }));
    assert_eq!(brick.shape, SceneRigidShape::Box { half_extents: [1.0, 3.0, 2.0] });
    assert_eq!(scene.colliders[0].shape, SceneShape::Plane { normal: [0.0, 0.0, 1.0] });
    // An outward face in either system: in the engine the volume of this tetrahedron is positive.
    let SceneRigidShape::Mesh(hull) = &scene.rigids[2].shape else { panic!() };
    let volume: f64 = hull
        .faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|index| glam::DVec3::from(hull.vertices[index as usize]));
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    assert!(volume.abs() > 0.1);
}

/// A turn by a right angle about the axis that is up takes, in the file, +z to +x (left hands) with
/// the matrix [[0 0 1] [0 1 0] [-1 0 0]]; a body at rest on the ground is turned the same way in both.
#[test]
fn a_matrix_is_the_same_turn_as_its_axis_and_angle() {
    let with = |transform: &str| {
        FULL.replace(
            r#"<transform translation="1 2 3"><rotation axis="0 1 0" degrees="90"/></transform>"#,
            transform,
        )
    };
    let matrix = read(&with(r#"<transform matrix="0 0 1  0 1 0  -1 0 0"/>"#));
    let found = matrix.rigids[0].rotation.unwrap();
    let turn = glam::DQuat::from_axis_angle(found.axis.into(), found.degrees.to_radians());
    // File: z -> x and x -> -z. Engine (y and z exchanged): y -> x and x -> -y.
    assert!((turn * glam::DVec3::Y - glam::DVec3::X).length() < 1e-12);
    assert!((turn * glam::DVec3::X + glam::DVec3::Y).length() < 1e-12);
    let axis = read(FULL).rigids[0].rotation.unwrap();
    let other = glam::DQuat::from_axis_angle(axis.axis.into(), axis.degrees.to_radians());
    assert!(turn.angle_between(other) < 1e-6, "as with an axis");
}

#[test]
fn everything_survives_being_written_and_read() {
    let scene = read(FULL);
    let text = scene.to_fysl().unwrap();
    assert_eq!(read(&text), scene, "{text}");
    assert_eq!(read(&text).to_fysl().unwrap(), text);
    let toml = scene.to_toml().unwrap();
    assert_eq!(Scene::from_toml(&toml, "full.toml").unwrap(), scene, "{toml}");
    assert_eq!(scene.description, "two\nlines");
    assert_eq!(scene.name, "full & <whole>");
    assert_eq!(scene.simulation.frames_per_second, 49.0);
    let fields: Vec<_> = scene.fields.iter().map(std::mem::discriminant).collect();
    assert_eq!(fields.len(), 4);
    assert!(matches!(scene.fields[1], SceneField::ExpressionLeftHanded(_)), "in their order");
}

#[test]
fn built_in_scenes_survive_being_written_and_read() {
    for builtin in builtin_scenes() {
        let scene = Scene::builtin(builtin.name).unwrap();
        let text = scene.to_fysl().unwrap();
        assert_eq!(read(&text), scene, "{}:\n{text}", builtin.name);
    }
}

#[test]
fn prototypes_are_expanded_over_the_places_that_have_particles() {
    let scene = read(FULL);
    let SceneGeometry::Network(net) = &scene.cloths[2].geometry else { panic!() };
    assert_eq!((net.joints[0].from, net.joints[0].to), (2, 1), "by their ids");
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    let range = compiled.model.cloth("net").unwrap().particles.clone();
    let springs: Vec<_> = compiled
        .model
        .springs()
        .iter()
        .filter(|spring| range.contains(&spring.particles[0]))
        .map(|spring| spring.particles.map(|particle| particle - range.start))
        .collect();
    assert_eq!(springs, [[0, 1], [0, 2], [1, 2]], "the fourth place is inert");
}

#[test]
fn the_cloth_of_the_documentation_runs() {
    let document = include_str!("../FYSL.md");
    let text = document.split("```xml\n").nth(1).unwrap().split("```").next().unwrap();
    let compiled = read(text).compile(&CompileOptions::default()).unwrap();
    assert_eq!((compiled.model.particle_count(), compiled.model.pins().len()), (600, 2));
    assert!(compiled.model.has_procedural_fields());
}

#[test]
fn the_documentation_and_the_schema_name_every_element() {
    let document = include_str!("../FYSL.md");
    let schema = fysl_xsd();
    if std::env::var_os("CLOTH_UPDATE").is_some() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fysl.xsd");
        std::fs::write(path, &schema).unwrap();
    }
    let is_same = schema == include_str!("../fysl.xsd");
    assert!(is_same, "cargo run -p cloth-scene --example fysl_xsd > crates/cloth-scene/fysl.xsd");
    for line in schema.lines().filter(|line| line.contains("<xs:element name=")) {
        let name = line.split('"').nth(1).unwrap();
        let known = [format!("`{name}`"), format!("<{name}")];
        assert!(known.iter().any(|known| document.contains(known)), "{name} is not documented");
    }
}

#[test]
fn feedback_is_read_back_as_it_was_written() {
    let scene = read(FULL);
    let feedback = FyslFeedback {
        frames: (0..2)
            .map(|number| FyslFrame {
                number,
                time: f64::from(number) / 3.0,
                groups: vec![FyslVertices {
                    name: "sheet".into(),
                    vertices: vec![[0.1, 0.2 * f64::from(number), 0.3], [1.0 / 3.0, -0.0, 5e-324]],
                }],
                rigids: vec![FyslTransform {
                    name: "brick".into(),
                    translation: [1.0, 2.0, 3.0],
                    rotation: SceneRotation { axis: [0.0, 0.6, 0.8], degrees: 12.5 },
                }],
            })
            .collect(),
    };
    let text = scene.to_fysl_with(&feedback).unwrap();
    assert_eq!(FyslFeedback::from_fysl(&text, "back.fysl").unwrap(), feedback);
    assert_eq!(read(&text), scene);
}

/// Line and column of `part` in `text`.
fn at(text: &str, part: &str) -> (u32, u32) {
    let before = &text[..text.find(part).unwrap()];
    let line = before.matches('\n').count() + 1;
    let column = before.len() - before.rfind('\n').map_or(0, |end| end + 1) + 1;
    (line as u32, column as u32)
}

#[test]
fn errors_name_the_line_the_column_and_the_mend() {
    for (from, to, part, words) in [
        ("<bounds", "<bonds", "<bonds", "did you mean `bounds`?"),
        ("frame_rate", "framerate", "framerate", "did you mean `frame_rate`?"),
        ("id=\"1\"", "id=\"7\"", "id=\"7\" name=\"flap\"", "id 7 is taken"),
        ("id=\"1\"", "id=\"0\"", "id=\"0\"", "positive whole number"),
        ("id=\"1\"", "id=\"x\"", "id=\"x\"", "whole number"),
        ("id=\"1\" ", "", "<group name=\"flap\"", "<group> has no `id`"),
        ("from=\"5\"", "from=\"6\"", "from=\"6\"", "names particle 6, which is not in this group"),
        ("from=\"5\"", "from=\"4\"", "<joint", "joins a particle to itself"),
        (
            "0.5\" frame",
            "NaN\" frame",
            "gravity=\"0 -9.81 NaN",
            "has \"NaN\": give a finite number",
        ),
        ("0.5\" frame", "1e999\" frame", "gravity", "has \"1e999\""),
        ("0 -9.81 0.5", "0 -9.81", "gravity", "has 2 numbers: give 3"),
        (
            "0 1 0</vertices><faces>0 1 2",
            "0 1</vertices><faces>0 1 2",
            "<vertices>0 0 0  1 0 0  0 1<",
            "three for each",
        ),
        (
            "0 1 0  0 0 1</vertices></tet",
            "0 1 0</vertices></tet",
            "<vertices>0 0 0  1 0 0  0 1 0</vertices></tet",
            "give 12",
        ),
        ("<faces>0 1 2</faces>", "<faces>0 1 -2</faces>", "<faces>0 1 -2", "give a whole number"),
        ("type=\"implicit\"", "type=\"fast\"", "type=\"fast\"", "use explicit or implicit"),
        ("warm_start=\"true\"", "warm_start=\"1\"", "warm_start", "use true or false"),
        ("<matter friction", "stray <matter friction", "stray", "text has no meaning"),
        ("<plane normal=\"0 1 0\"/>", "", "<collider id=\"6\"", "has no <plane>"),
        ("<plane ", "<sphere radius=\"1\"/><plane ", "<collider id=\"6\"", "more than one of"),
        (
            "<linear mass=\"2\"",
            "<linear",
            "<linear velocity=\"1 2 3\" force",
            "<linear> has no `mass`",
        ),
        ("<plane ", "<matter/><plane ", "<matter/>", "a second <matter>"),
        (
            "<rotation axis=\"0 1 0\" degrees=\"90\"/>",
            "<rotation axis=\"0 1\" degrees=\"90\"/>",
            "axis=\"0 1\"",
            "give 3",
        ),
        ("<fysl version=\"1.0\">", "<fysl version=\"2.0\">", "version=\"2.0\"", "use 1.0"),
        (
            "<transform translation=\"0 5 0\"/>",
            "<transform matrix=\"2 0 0 0 1 0 0 0 1\"/>",
            "matrix=\"2",
            "is not orthogonal",
        ),
        (
            "<transform translation=\"0 5 0\"/>",
            "<transform matrix=\"-1 0 0 0 1 0 0 0 1\"/>",
            "matrix=\"-1",
            "mirrors",
        ),
        // What only the types of a scene know.
        ("neighbours=\"24\"", "neighbours=\"13\"", "neighbours=\"13\"", "13"),
        ("colour=\"#ffffff\"", "colour=\"#ffff\"", "colour=\"#ffff\"", "#ffff"),
        ("classes=\"bend, stretch\"", "classes=\"bent\"", "classes=\"bent\"", "bent"),
        ("steps=\"3\"", "steps=\"-3\"", "steps=\"-3\"", "-3"),
        ("<scene name", "<scene nme", "nme=", "did you mean `name`?"),
    ] {
        assert!(FULL.contains(from), "{from}");
        let text = FULL.replacen(from, to, 1);
        let (position, message) = error(&text);
        assert_eq!(position, Some(at(&text, part)), "{message}");
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn xml_that_attacks_or_is_damaged_is_refused() {
    let bomb =
        r#"<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><fysl version="1.0">&b;</fysl>"#;
    let deep = format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000));
    let deep_inside = FULL.replace("<actors>", &format!("<actors>{}", "<group>".repeat(100_000)));
    let second = format!("{FULL}<fysl/>");
    let text_after = format!("{FULL}text");
    let encoding = FULL.replace("UTF-8", "UTF-16");
    let truncated = &FULL[..FULL.len() / 2];
    let doubled = FULL.replace("min=\"-1 -2 -3\"", "min=\"-1 -2 -3\" min=\"1 2 3\"");
    let entity = FULL.replace("&amp;", "&unknown;");
    for text in [
        "",
        " ",
        "<",
        "text",
        "<fysl",
        "<fysl version=\"1.0\"/>",
        "<svg/>",
        "<?xml?>",
        bomb,
        &deep,
        &deep_inside,
        &second,
        &text_after,
        &encoding,
        truncated,
        &doubled,
        &entity,
    ] {
        error(text);
    }
    assert!(
        error(bomb).1.contains("DTD") || error(bomb).1.to_lowercase().contains("dtd"),
        "{}",
        error(bomb).1
    );
    assert!(error(&deep).1.contains("deeper than 64"));
    assert!(error(&encoding).1.contains("UTF-16"));
}

#[test]
fn files_that_are_not_utf8_are_refused_with_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("latin.fysl");
    let mut bytes = FULL.as_bytes().to_vec();
    let place = FULL.find("two").unwrap();
    bytes[place] = 0xe4;
    std::fs::write(&path, &bytes).unwrap();
    let message = Scene::read(&path).unwrap_err().to_string();
    assert!(message.contains("line 4") && message.contains("UTF-8"), "{message}");
    std::fs::write(&path, format!("\u{feff}{FULL}")).unwrap();
    assert_eq!(Scene::read(&path).unwrap(), read(FULL), "a byte order mark does no harm");
}

#[test]
fn errors_of_expressions_and_models_name_the_element() {
    let scene = |text: &str| read(text).compile(&CompileOptions::default());
    let text = FULL.replace("x * t<", "x *\n oops<");
    let message = scene(&text).unwrap_err().to_string();
    let (line, column) = at(&text, "<procedural_right_handed>");
    assert!(message.contains(&format!("line {line}, column {column}: ")), "{message}");
    assert!(message.contains("line 2, column 2: `oops` is not known"), "{message}");
    let text = FULL.replace("thickness=\"0.01\" density", "thickness=\"-1\" density");
    let message = scene(&text).unwrap_err().to_string();
    let (line, _) = at(&text, "thickness=\"-1\"");
    assert!(message.contains(&format!("line {line}, ")), "{message}");
}

#[test]
fn what_xml_cannot_hold_is_not_written() {
    let mut scene = Scene::new("bell \u{7}");
    assert!(scene.to_fysl().unwrap_err().to_string().contains("XML cannot hold"));
    scene = read(FULL);
    scene.cloths[0].pins = vec!["a, b".into()];
    assert!(scene.to_fysl().unwrap_err().to_string().contains("pins"));
}

/// A scene of random numbers and names.
fn scenes() -> impl Strategy<Value = Scene> {
    let number = || prop_oneof![any::<f64>().prop_filter("finite", |x| x.is_finite()), Just(0.0)];
    let vector = || [number(), number(), number()];
    let name = || "[ -~äß☃\n\t]{0,12}";
    (
        (name(), name(), vector(), number(), any::<u32>()),
        (vector(), vector(), number(), vector(), name()),
        proptest::collection::vec(vector(), 1..5),
    )
        .prop_map(|((title, about, gravity, rate, frames), (a, b, c, d, text), points)| {
            let mut scene = read(FULL);
            scene.name = title;
            scene.description = about;
            scene.gravity = gravity;
            scene.simulation.frames_per_second = rate;
            scene.simulation.frames = frames;
            scene.fields = vec![
                SceneField::Expression(text.clone()),
                SceneField::Drag { rate: a },
                SceneField::ExpressionLeftHanded(text),
                SceneField::Uniform { acceleration: b },
            ];
            scene.rigids[0].angular_velocity = d;
            scene.rigids[0].rotation = Some(SceneRotation { axis: b, degrees: c });
            scene.colliders[1].translation = a;
            let SceneGeometry::Network(net) = &mut scene.cloths[2].geometry else { panic!() };
            net.positions = points;
            net.joints.clear();
            scene
        })
}

proptest! {
    #[test]
    fn random_scenes_survive_being_written_and_read(scene in scenes()) {
        let text = scene.to_fysl().unwrap();
        prop_assert_eq!(read(&text), scene, "{}", text);
    }

    #[test]
    fn no_mutation_of_a_byte_panics(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..4),
    ) {
        let mut bytes = FULL.as_bytes().to_vec();
        for (place, byte, how) in changes {
            let place = place.index(bytes.len());
            match how {
                0 => bytes[place] = byte,
                1 => bytes.insert(place, byte),
                _ => { bytes.remove(place); }
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        match Scene::from_fysl(&text, "bad.fysl") {
            Ok(scene) => {
                let _ = scene.to_fysl();
                let options = CompileOptions { memory_limit: 64 << 20, ..CompileOptions::default() };
                let _ = scene.compile(&options);
            }
            Err(error) => {
                let mut text = String::new();
                write!(text, "{error}").unwrap();
                prop_assert!(text.contains("line "), "{}", text);
            }
        }
    }
}

#[test]
fn joints_name_the_bodies_that_they_join() {
    let body = |id: u32, name: &str| {
        format!(
            "<rigid id=\"{id}\" name=\"{name}\"><linear mass=\"1\"/><sphere radius=\"0.1\"/></rigid>"
        )
    };
    let text = |joint: &str| {
        format!(
            "<fysl version=\"1.0\"><scene name=\"j\"/><actors><group id=\"1\" name=\"g\"><grid width=\"2\" height=\"2\" \
             spacing=\"1\"/><fabric preset=\"denim\"/></group>{}{}</actors>\n<joints>\n{joint}</joints></fysl>",
            body(2, "a"),
            body(3, "b")
        )
    };
    let all = text(
        "<ball_joint from=\"a\" to=\"b\" anchor=\"0 1 2\"/><fixed_joint from=\"a\" anchor=\"0 0 0\"/>\
         <hinge_joint from=\"b\" anchor=\"0 0 0\" axis=\"0 1 2\" limits=\"-90 45\"/>\
         <slider_joint from=\"b\" to=\"a\" anchor=\"0 0 0\" axis=\"0 1 2\"/>",
    );
    let scene = read(&all);
    assert_eq!(scene.rigid_joints.len(), 4);
    assert_eq!(scene.rigid_joints[0].anchor, [0.0, 2.0, 1.0]);
    assert_eq!(scene.rigid_joints[2].axis, Some([-0.0, -2.0, -1.0]), "a turn the other way");
    assert_eq!(read(&scene.to_fysl().unwrap()), scene);
    assert_eq!(Scene::from_toml(&scene.to_toml().unwrap(), "j.toml").unwrap(), scene);
    let compiled = scene.compile(&CompileOptions::default()).unwrap();
    assert_eq!((compiled.rigid_joints[3].from, compiled.rigid_joints[3].to), (1, Some(0)));
    for (joint, part, words) in [
        (
            "<ball_joint from=\"c\" anchor=\"0 0 0\"/>",
            "from=\"c\"",
            "the body `c`, which does not exist",
        ),
        (
            "<ball_joint from=\"a\" to=\"a\" anchor=\"0 0 0\"/>",
            "<ball_joint",
            "does not join two bodies",
        ),
        ("<hinge_joint from=\"a\" anchor=\"0 0 0\" axis=\"0 0 0\"/>", "<hinge_joint", "not zero"),
    ] {
        let text = text(joint);
        let error = read(&text).compile(&CompileOptions::default()).unwrap_err();
        let (line, column) = at(&text, part);
        let place = format!("line {line}, column {column}");
        assert!(error.to_string().contains(words), "{error}");
        assert!(error.to_string().contains(&place), "{error}, not {place}");
    }
}
