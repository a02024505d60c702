//! The life of one pin.

use cloth_core::PinAction;

use super::FrameSpan;

/// A particle that is held at times.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PinTrack {
    /// Index in the composite model.
    pub(crate) particle: u32,
    /// Where it is at the start \[m\].
    start: [f64; 3],
    /// When it is held, one after the other.
    holds: Vec<Hold>,
}

/// A time in which a particle is held.
#[derive(Clone, Debug, PartialEq)]
struct Hold {
    /// When it begins \[s\].
    since: f64,
    /// Whether the particle is then where it is at the start, and not wherever it happens to be.
    is_at_start: bool,
    /// Moves, which add up.
    moves: Vec<PinMove>,
    /// When it ends \[s\].
    release: Option<f64>,
}

/// A straight way at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PinMove {
    /// Start \[s\].
    pub(crate) time: f64,
    /// Time it takes \[s\].
    pub(crate) duration: f64,
    /// Way \[m\].
    pub(crate) offset: [f64; 3],
}

impl PinTrack {
    /// A particle that is at this place \[m\] at the start, where it is held or free.
    pub(crate) fn new(particle: u32, start: [f64; 3], is_held: bool) -> Self {
        let holds = if is_held { vec![Hold::new(0.0, true)] } else { Vec::new() };
        Self { particle, start, holds }
    }

    /// Whether it is never held.
    pub(crate) const fn is_empty(&self) -> bool {
        self.holds.is_empty()
    }

    /// The hold that has not ended. Events come in the order of time.
    fn present(&mut self) -> Option<&mut Hold> {
        self.holds.last_mut().filter(|hold| hold.release.is_none())
    }

    /// Holds the particle from `time` \[s\] on, wherever it is, if it is free.
    pub(crate) fn hold(&mut self, time: f64) {
        if self.present().is_none() {
            self.holds.push(Hold::new(time, false));
        }
    }

    /// Moves it. Returns whether it is held.
    pub(crate) fn push(&mut self, step: PinMove) -> bool {
        self.present().map(|hold| hold.moves.push(step)).is_some()
    }

    /// Lets it go at `time` \[s\]. Returns whether it was held.
    pub(crate) fn release(&mut self, time: f64) -> bool {
        self.present().map(|hold| hold.release = Some(time)).is_some()
    }

    /// What happens to the pin in a frame, if anything does.
    pub(crate) fn action(&self, span: &FrameSpan) -> Option<PinAction> {
        let hold = self.holds.iter().rfind(|hold| span.is_after(hold.since))?;
        if let Some(release) = hold.release.filter(|&release| span.is_after(release)) {
            return span.begins_at(release).then_some(PinAction::Release);
        }
        let begins = !hold.is_at_start && span.begins_at(hold.since);
        let moves = |step: &PinMove| span.overlaps(step.time, step.time + step.duration);
        if !hold.moves.iter().any(moves) {
            return begins.then_some(PinAction::Hold);
        }
        Some(match hold.is_at_start {
            true => PinAction::MoveTo(hold.moved(self.start, span.end)),
            false => {
                // A move that began before the frame in which it is first held has its way still before it.
                let start = if begins { hold.since } else { span.start };
                let [start, end] = [start, span.end].map(|time| hold.moved([0.0; 3], time));
                PinAction::MoveBy(std::array::from_fn(|k| end[k] - start[k]))
            }
        })
    }

    /// Where the pin is at `time` \[s\], or was when it was let go, if it is moved; as if it had been at its start when it was held.
    pub(super) fn position(&self, time: f64) -> Option<[f64; 3]> {
        let hold = self.holds.iter().find(|hold| !hold.moves.is_empty())?;
        let time = hold.release.map_or(time, |end| end.min(time));
        Some(hold.moved(self.start, time))
    }
}

impl Hold {
    const fn new(since: f64, is_at_start: bool) -> Self {
        Self { since, is_at_start, moves: Vec::new(), release: None }
    }

    /// Where it is at `time` \[s\] if it is first held at a `place` \[m\].
    fn moved(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        self.moves.iter().fold(place, |place, step| {
            let fraction = ((time - step.time) / step.duration).clamp(0.0, 1.0);
            std::array::from_fn(|k| place[k] + fraction * step.offset[k])
        })
    }
}
