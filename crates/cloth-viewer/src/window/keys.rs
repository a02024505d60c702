//! What keys do: those of the classic cloth demo, and a few more.

use eframe::egui::{InputState, Key};

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Pause,
    Step,
    Reset,
    Wires,
    Fullscreen,
    Help,
    Open,
    Exit,
    Screenshot,
    Record,
    Corner(usize),
}

/// Key, its name, what it does in words, and what it asks for.
const KEYS: [(Key, &str, &str, Action); 14] = [
    (Key::P, "P", "pause or go on", Action::Pause),
    (Key::Space, "space", "one frame, then wait", Action::Step),
    (Key::R, "R", "back to the start", Action::Reset),
    (Key::W, "W", "wireframe", Action::Wires),
    (Key::Num0, "0", "hold or let go corner 0", Action::Corner(0)),
    (Key::Num1, "1", "corner 1", Action::Corner(1)),
    (Key::Num2, "2", "corner 2", Action::Corner(2)),
    (Key::Num3, "3", "corner 3", Action::Corner(3)),
    (Key::S, "S", "screenshot", Action::Screenshot),
    (Key::V, "V", "begin or end a recording", Action::Record),
    (Key::F, "F", "full screen", Action::Fullscreen),
    (Key::O, "O", "type what to open", Action::Open),
    (Key::H, "H", "this help", Action::Help),
    (Key::X, "X", "exit", Action::Exit),
];

/// What the pointer does, in words.
const POINTER: [(&str, &str); 5] = [
    ("left drag", "pull the cloth"),
    ("ctrl + click", "hold or let go a particle"),
    ("right drag, alt + left drag", "turn"),
    ("middle drag, shift + right drag", "move sideways"),
    ("wheel", "nearer, farther"),
];

/// What the keys that were pressed ask for.
pub(super) fn actions(input: &InputState) -> Vec<Action> {
    if input.modifiers.ctrl || input.modifiers.command {
        return Vec::new();
    }
    KEYS.iter().filter(|(key, ..)| input.key_pressed(*key)).map(|(.., action)| *action).collect()
}

/// All keys and what they do.
pub(super) fn help() -> impl Iterator<Item = (&'static str, &'static str)> {
    KEYS.iter().map(|(_, name, text, _)| (*name, *text)).chain(POINTER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_has_two_meanings() {
        for (number, (key, ..)) in KEYS.iter().enumerate() {
            assert!(KEYS[..number].iter().all(|(other, ..)| other != key), "{key:?}");
        }
    }
}
