//! Mannequins in scenes.

use cloth_core::{BodySurface, ColliderShape};
use cloth_mannequin::{Mannequin, Measures, Pose, Swing, girth};
use cloth_scene::{CompileOptions, CompiledScene, Scene};

const VALID: &str = r#"name = "test"
contact.response.triangles.friction = 0.3

[[cloth]]
name = "sheet"
material.preset = "cotton-broad"
geometry.grid = { columns = 4, rows = 4, spacing = 0.02, centre = [0.0, 0.0, 2.0] }

[[collider]]
name = "wearer"
[collider.shape.mannequin]
height = 1.8
waist = 0.9
edge = 0.03
rate = 20
[[collider.shape.mannequin.pose]]
time = 0.5
shoulder_left = { raise = 60 }
head = 30
[[collider.shape.mannequin.pose]]
time = 1.5
shoulder_left = { raise = 60, forwards = 90 }
knee_right = 40
"#;

fn compiled(text: &str) -> Result<CompiledScene, String> {
    let compile = |scene: Scene| scene.compile(&CompileOptions::default());
    Scene::from_toml(text, "test.toml").and_then(compile).map_err(|error| error.to_string())
}

fn surface(scene: &CompiledScene) -> &BodySurface {
    match &scene.model.colliders()[0].shape {
        ColliderShape::Surface(surface) => surface,
        other => panic!("{other:?}"),
    }
}

#[test]
fn it_has_its_measures_and_takes_its_poses() {
    let scene = compiled(VALID).unwrap();
    let body = surface(&scene);
    let measures = Measures { waist: 0.9, ..Measures::of_height(1.8) };
    let mannequin = Mannequin::new(&measures, 0.03).unwrap();
    let read = girth(&body.sets[0], &body.triangles, 0.62 * 1.8);
    assert!((read / 0.9 - 1.0).abs() < 0.02, "a waist of {read} m");
    // A second in steps of a twentieth, and both ends.
    assert_eq!((body.sets.len(), body.rate, body.start), (21, 20.0, 0.5));
    let side = Swing { raise: 60.0, forwards: 0.0 };
    let right = Pose::default().shoulders[1];
    let first = Pose { shoulders: [side, right], head: 30.0, ..Pose::default() };
    let front = Swing { raise: 60.0, forwards: 90.0 };
    // What the second one does not say is as in the first one.
    let last = Pose { shoulders: [front, right], knees: [0.0, 40.0], ..first };
    assert_eq!(body.sets[0], mannequin.posed(&first));
    assert_eq!(body.sets[10], mannequin.posed(&first.between(&last, 0.5)));
    assert_eq!(body.sets[20], mannequin.posed(&last));
}

#[test]
fn the_wearer_of_the_shirt_never_goes_through_itself() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/garments/tshirt.toml");
    let scene = Scene::read(path.as_ref()).unwrap();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let body = surface(&scene);
    assert!(body.sets.len() > 10, "it raises its arms");
    for set in body.sets.iter().step_by(5).chain(body.sets.last()) {
        let surface = cloth_audit::Surface::cloth(set, &body.triangles);
        assert_eq!(cloth_audit::intersections(&[surface]).pairs(), 0);
    }
}

#[test]
fn it_is_a_solid_of_distances_where_contact_is_not_of_triangles() {
    let text = VALID
        .replace("triangles.friction = 0.3", "impulse.friction = 0.3\ncontact.distance = 0.01");
    let scene = compiled(&text.replace("rate = 20", "rate = 2\ncells = 12")).unwrap();
    assert!(matches!(scene.model.colliders()[0].shape, ColliderShape::Grid(_)));
}

#[test]
fn slips_are_refused_with_their_line() {
    let cases = [
        (
            "height = 1.8",
            "height = -1.8",
            "`collider[0].shape.mannequin.height` is -1.8: give 1.4 to 2.1 m",
        ),
        ("height = 1.8", "heigth = 1.8", "unknown key `heigth`; did you mean `height`?"),
        ("waist = 0.9", "waist = nan", "waist` is nan: give a finite number"),
        ("waist = 0.9", "waist = 1.3", "is too much for the chest"),
        ("edge = 0.03", "edge = 0.3", "edge` is 0.3: give 0.005 to 0.03 m"),
        ("rate = 20", "rate = 0", "rate` is 0: it must be greater than zero"),
        ("rate = 20", "rate = 1.2e4", "give at most 10000 for all of it"),
        ("time = 1.5", "time = 0.5", "is 0.5, and the pose before is at 0.5: give a later time"),
        ("head = 30", "head = 200", "head` is 200: give -90 to 90 degrees"),
        ("raise = 60 }", "raise = 180 }", "raise` is 180: give 0 to 170 degrees"),
        ("raise = 60 }", "rise = 60 }", "unknown key `rise`; did you mean `raise`?"),
    ];
    for (from, to, expected) in cases {
        let message = compiled(&VALID.replacen(from, to, 1)).unwrap_err();
        assert!(message.contains(expected), "{message}\nshould say: {expected}");
        let line = 1 + VALID[..VALID.find(from).unwrap()].matches('\n').count();
        assert!(message.contains(&format!("line {line}, ")), "{message}\nshould be line {line}");
    }
}

#[test]
fn fysl_has_no_words_for_it_and_says_so() {
    let scene = Scene::from_toml(VALID, "test.toml").unwrap();
    let message = scene.to_fysl().unwrap_err().to_string();
    assert!(message.contains("mannequin"), "{message}");
}
