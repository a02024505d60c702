//! Harm of all kinds, to show that none goes unseen.

use std::{hint::black_box, thread, time::Duration};

use fastrand::Rng;

/// One of the kinds in turn, hidden among other bytes.
pub(crate) fn make(rng: &mut Rng) -> Vec<u8> {
    let kind = *super::super::mutate::any(rng, b"pthmsg");
    let before = "x".repeat(rng.usize(..20));
    format!("{before}{}{before}", char::from(kind)).into_bytes()
}

pub(crate) fn run(input: &[u8]) -> bool {
    let text = String::from_utf8_lossy(input);
    match text.chars().find(|c| *c != 'x') {
        Some('p') => panic!("a trap of {} bytes", input.len()),
        // Nobody hears of a panic of another thread unless it is asked for.
        Some('t') => drop(thread::spawn(|| panic!("a trap in a thread")).join()),
        Some('h') => thread::sleep(Duration::from_secs(3600)),
        Some('m') => {
            let mut kept: Vec<Vec<u8>> = Vec::new();
            loop {
                kept.push(black_box(vec![1; 16 << 20]));
            }
        }
        Some('s') => drop(black_box(depth(0))),
        Some(_) => return true,
        None => {}
    }
    false
}

/// Takes all of the stack.
fn depth(level: u64) -> u64 {
    let here = black_box([level; 64]);
    if here[0] == u64::MAX { 0 } else { depth(level + 1) + here[level as usize % 64] }
}
