//! Controls of single frames.

use cloth_core::{ColliderControl, PinAction, PinControl};
use cloth_scene::{CompileOptions, Scene, Timeline};

fn timeline(events: &str) -> Timeline {
    let text = format!(
        "name = \"t\"\nsimulation.frames_per_second = 10\n[[cloth]]\nname = \"first\"\n\
         geometry.grid = {{ columns = 2, rows = 3, spacing = 1 }}\nmaterial.preset = \"denim\"\n\
         [[cloth]]\nname = \"second\"\npins = [\"corners\"]\n\
         geometry.grid = {{ columns = 3, rows = 3, spacing = 1, origin = [0, 0, 0] }}\n\
         material.preset = \"denim\"\n{events}"
    );
    Scene::from_toml(&text, "t.toml")
        .and_then(|scene| scene.compile(&CompileOptions::default()))
        .unwrap_or_else(|error| panic!("{error}"))
        .timeline
}

/// Particle 8 of the second cloth, after the six of the first.
const LAST: u32 = 6 + 8;

#[test]
fn a_pin_moves_and_is_released_once() {
    let timeline = timeline(
        "[[event]]\ntime = 0.2\ncloth = \"second\"\npins = [8]\n\
         action.move = { offset = [0, 0, 2], duration = 0.4 }\n\
         [[event]]\ntime = 0.45\ncloth = \"second\"\npins = [8]\naction = \"release\"\n",
    );
    let pins = |frame| timeline.control(frame).pins;
    assert_eq!(pins(1), []);
    for (frame, height) in [(2, 0.5), (3, 1.0), (4, 1.5)] {
        let PinAction::MoveTo(target) = pins(frame)[0].action else { panic!("frame {frame}") };
        assert_eq!(target[..2], [2.0, 2.0]);
        assert!((target[2] - height).abs() < 1e-12, "frame {frame}: {target:?}");
    }
    assert_eq!(pins(5), [PinControl { particle: LAST, action: PinAction::Release }]);
    assert_eq!(pins(6), []);
    assert_eq!(pins(1000), []);
}

/// Wherever it is then: only its way is known before.
#[test]
fn what_was_free_is_held_moved_and_let_go_again() {
    let event = |time: f64, action: &str| {
        format!("[[event]]\ntime = {time:?}\ncloth = \"first\"\npins = [2]\naction{action}\n")
    };
    let lift = ".move = { offset = [0, 0, 2], duration = 0.4 }";
    let events =
        [(0.15, " = \"hold\""), (0.25, lift), (0.8, " = \"release\""), (1.0, " = \"hold\"")];
    let text: String = events.iter().map(|(time, action)| event(*time, action)).collect();
    let found = timeline(&text);
    let action = |frame| found.control(frame).pins.first().map(|pin| (pin.particle, pin.action));
    assert_eq!(action(1), None);
    // Held and moved at once.
    let mut way = 0.0;
    for frame in 2..7 {
        let Some((2, PinAction::MoveBy([0.0, 0.0, up]))) = action(frame) else {
            panic!("{frame}: {:?}", action(frame))
        };
        way += up;
    }
    assert!((way - 2.0_f64).abs() < 1e-12, "{way}");
    assert_eq!(action(7), None);
    assert_eq!(action(8), Some((2, PinAction::Release)));
    assert_eq!(action(9), None);
    assert_eq!(action(10), Some((2, PinAction::Hold)));
    assert_eq!(action(11), None);
    // From the middle of a frame to the end of it a hand goes what it has to in the next.
    let late = timeline(&(event(0.25, " = \"hold\"") + &event(0.25, lift)));
    assert_eq!(late.control(2).pins, []);
    let [pin] = late.control(3).pins[..] else { panic!("one pin") };
    let PinAction::MoveBy([.., up]) = pin.action else { panic!("{:?}", pin.action) };
    assert!((up - 0.75).abs() < 1e-12, "{up}");
}

#[test]
fn a_move_ends_exactly_at_its_offset() {
    let timeline = timeline(
        "[[event]]\ntime = 0\ncloth = \"second\"\npins = [\"top\"]\n\
         action.move = { offset = [0.1, 0, 0.7], duration = 0.35 }\n",
    );
    let last = timeline.control(3).pins;
    assert_eq!(last.len(), 2, "the middle of the top edge is not pinned");
    assert_eq!(last[1].action, PinAction::MoveTo([2.1, 2.0, 0.7]));
    assert_eq!(timeline.control(4).pins, []);
}

#[test]
fn releases_at_the_start_and_at_frame_times_happen_once() {
    for (time, frame) in [(0.0, 0), (0.1, 1), (0.3, 3), (0.31, 4), (1e9, 10_000_000_000)] {
        let timeline = timeline(&format!(
            "[[event]]\ntime = {time:?}\ncloth = \"second\"\npins = [8]\naction = \"release\"\n"
        ));
        let released: Vec<u64> = (frame.max(5) - 5..frame + 5)
            .filter(|&frame| !timeline.control(frame).pins.is_empty())
            .collect();
        assert_eq!(released, [frame], "time {time}");
    }
}

#[test]
fn a_released_pin_cannot_be_moved() {
    let text = "name = \"t\"\n[[cloth]]\nname = \"a\"\npins = [0]\nmaterial.preset = \"denim\"\n\
                geometry.grid = { columns = 2, rows = 2, spacing = 1 }\n\
                [[event]]\ntime = 2\ncloth = \"a\"\npins = [0]\n\
                action.move = { offset = [0, 0, 1], duration = 1 }\n\
                [[event]]\ntime = 1\ncloth = \"a\"\npins = [0]\naction = \"release\"\n";
    let scene = Scene::from_toml(text, "t.toml").unwrap();
    let message = scene.compile(&CompileOptions::default()).unwrap_err().to_string();
    assert!(message.contains("line 10, ") && message.contains("pin it, or hold it"), "{message}");
    let held =
        text.replace("pins = [0]\naction", "pins = [4]\naction").replace("\"release\"", "\"hold\"");
    let scene = Scene::from_toml(&held, "t.toml").unwrap();
    let message = scene.compile(&CompileOptions::default()).unwrap_err().to_string();
    assert!(message.contains("line 15, ") && message.contains("has 4 vertices"), "{message}");
}

#[test]
fn colliders_follow_their_keyframes() {
    let timeline = timeline(
        "[[collider]]\nname = \"still\"\nshape.sphere.radius = 1\n\
         [[collider]]\nname = \"turning\"\nshape.box.half_extents = [1, 1, 1]\n\
         translation = [0, 0, 1]\n\
         motion = [{ time = 0.5, translation = [1, 0, 1] },\
         { time = 1, rotation = { axis = [0, 0, 1], degrees = 720 } }]\n",
    );
    let pose = |frame| {
        let controls: Vec<ColliderControl> = timeline.control(frame).colliders;
        assert_eq!(controls.len(), 1);
        assert_eq!(controls[0].collider, 1);
        controls[0].pose
    };
    assert!((pose(1).translation[0] - 0.4).abs() < 1e-12);
    assert_eq!(pose(4).translation, [1.0, 0.0, 1.0]);
    // A tenth of a second is a fifth of two turns, 144 degrees.
    let half_angle = 72.0_f64.to_radians();
    assert!((pose(5).rotation[2] - half_angle.sin()).abs() < 1e-9);
    assert!((pose(9).rotation[3].abs() - 1.0).abs() < 1e-9, "two whole turns");
    assert!(timeline.control(10).colliders.is_empty());
}
