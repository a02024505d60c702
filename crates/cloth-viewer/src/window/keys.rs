//! What keys do: what people expect, the keys of the classic cloth demo, and a few more.

use eframe::egui::{Event, InputState, Key, Modifiers};

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Pause,
    Step,
    StepBack,
    First,
    Last,
    Reset,
    Undo,
    Redo,
    Save,
    Wires,
    Fullscreen,
    Help,
    Open,
    Exit,
    Screenshot,
    Record,
    Dismiss,
    Corner(usize),
}

impl Action {
    /// Whether a key that is held down asks again and again.
    const fn repeats(self) -> bool {
        matches!(self, Self::Step | Self::StepBack | Self::Undo | Self::Redo)
    }
}

/// What is held down beside a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum With {
    Nothing,
    Ctrl,
    CtrlShift,
}

impl With {
    /// What is held down, if keys mean something then.
    const fn of(modifiers: Modifiers) -> Option<Self> {
        match (modifiers.ctrl || modifiers.command, modifiers.alt, modifiers.shift) {
            (false, false, _) => Some(Self::Nothing),
            (true, false, false) => Some(Self::Ctrl),
            (true, false, true) => Some(Self::CtrlShift),
            _ => None,
        }
    }
}

/// Key, what is held down with it, its name, what it does in words, and what it asks for.
const KEYS: [(Key, With, &str, &str, Action); 24] = [
    (Key::Space, With::Nothing, "space", "play or pause", Action::Pause),
    (Key::P, With::Nothing, "P", "the same", Action::Pause),
    (Key::ArrowRight, With::Nothing, "right", "the next frame, then wait", Action::Step),
    (Key::ArrowLeft, With::Nothing, "left", "the frame before", Action::StepBack),
    (Key::Home, With::Nothing, "home", "the first frame that is kept", Action::First),
    (Key::End, With::Nothing, "end", "the last frame", Action::Last),
    (Key::R, With::Nothing, "R", "back to the start", Action::Reset),
    (Key::Z, With::Ctrl, "ctrl + Z", "take a change of a value back", Action::Undo),
    (Key::Z, With::CtrlShift, "ctrl + shift + Z", "make it again", Action::Redo),
    (Key::Y, With::Ctrl, "ctrl + Y", "the same", Action::Redo),
    (Key::S, With::Ctrl, "ctrl + S", "save the scene with these values", Action::Save),
    (Key::Num0, With::Nothing, "0", "hold or let go corner 0", Action::Corner(0)),
    (Key::Num1, With::Nothing, "1", "corner 1", Action::Corner(1)),
    (Key::Num2, With::Nothing, "2", "corner 2", Action::Corner(2)),
    (Key::Num3, With::Nothing, "3", "corner 3", Action::Corner(3)),
    (Key::W, With::Nothing, "W", "wireframe", Action::Wires),
    (Key::S, With::Nothing, "S", "screenshot", Action::Screenshot),
    (Key::V, With::Nothing, "V", "begin or end a recording", Action::Record),
    (Key::F, With::Nothing, "F", "full screen", Action::Fullscreen),
    (Key::O, With::Nothing, "O", "type what to open", Action::Open),
    (Key::Escape, With::Nothing, "esc", "put a message away", Action::Dismiss),
    (Key::H, With::Nothing, "H", "this help", Action::Help),
    (Key::X, With::Nothing, "X", "exit", Action::Exit),
    (Key::Q, With::Ctrl, "ctrl + Q", "the same", Action::Exit),
];

/// What the pointer does, in words.
const POINTER: [(&str, &str); 5] = [
    ("left drag", "pull the cloth"),
    ("ctrl + click", "hold or let go a particle"),
    ("right drag, alt + left drag", "turn"),
    ("middle drag, shift + right drag", "move sideways"),
    ("wheel", "nearer, farther"),
];

/// What a key asks for, pressed or held down.
fn action(key: Key, modifiers: Modifiers, is_repeat: bool) -> Option<Action> {
    let with = With::of(modifiers)?;
    let found = KEYS.iter().find(|entry| (entry.0, entry.1) == (key, with));
    found.map(|entry| entry.4).filter(|action| !is_repeat || action.repeats())
}

/// What the keys that were pressed ask for.
pub(super) fn actions(input: &InputState) -> Vec<Action> {
    let pressed = input.events.iter().filter_map(|event| match event {
        Event::Key { key, pressed: true, repeat, modifiers, .. } => {
            action(*key, *modifiers, *repeat)
        }
        _ => None,
    });
    pressed.collect()
}

/// All keys and what they do.
pub(super) fn help() -> impl Iterator<Item = (&'static str, &'static str)> {
    KEYS.iter().map(|(_, _, name, text, _)| (*name, *text)).chain(POINTER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_has_two_meanings() {
        for (number, entry) in KEYS.iter().enumerate() {
            let is_same = |other: &&(Key, With, _, _, _)| (other.0, other.1) == (entry.0, entry.1);
            assert!(KEYS[..number].iter().find(is_same).is_none(), "{:?}", entry.0);
        }
    }

    #[test]
    fn keys_do_what_people_expect_and_the_classic_ones_are_kept() {
        let plain = |key| action(key, Modifiers::NONE, false);
        assert_eq!(plain(Key::Space), Some(Action::Pause));
        assert_eq!(plain(Key::ArrowRight), Some(Action::Step));
        assert_eq!(plain(Key::ArrowLeft), Some(Action::StepBack));
        assert_eq!(action(Key::Z, Modifiers::CTRL, false), Some(Action::Undo));
        let both = Modifiers::CTRL | Modifiers::SHIFT;
        assert_eq!(action(Key::Z, both, false), Some(Action::Redo));
        assert_eq!(action(Key::Y, Modifiers::CTRL, false), Some(Action::Redo));
        assert_eq!(action(Key::S, Modifiers::CTRL, false), Some(Action::Save));
        for (key, classic) in [
            (Key::P, Action::Pause),
            (Key::R, Action::Reset),
            (Key::W, Action::Wires),
            (Key::F, Action::Fullscreen),
            (Key::H, Action::Help),
            (Key::X, Action::Exit),
            (Key::Num0, Action::Corner(0)),
            (Key::Num3, Action::Corner(3)),
        ] {
            assert_eq!(plain(key), Some(classic));
            // Capital letters are the same keys.
            assert_eq!(action(key, Modifiers::SHIFT, false), Some(classic));
            assert_eq!(action(key, Modifiers::ALT, false), None);
        }
        assert_eq!(action(Key::R, Modifiers::CTRL, false), None);
    }

    /// A key that is held down must not switch on and off.
    #[test]
    fn a_key_that_is_held_down_steps_but_toggles_nothing() {
        let held = |key| action(key, Modifiers::NONE, true);
        assert_eq!(held(Key::ArrowRight), Some(Action::Step));
        for key in [Key::Space, Key::P, Key::R, Key::W, Key::V, Key::Num1] {
            assert_eq!(held(key), None, "{key:?}");
        }
    }
}
