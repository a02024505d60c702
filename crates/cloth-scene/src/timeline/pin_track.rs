//! The life of one pin.

use cloth_core::PinAction;

use super::FrameSpan;

/// A pin that moves or is released.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PinTrack {
    /// Index in the composite model.
    pub(crate) particle: u32,
    /// Position at time zero \[m\].
    pub(crate) start: [f64; 3],
    /// Moves, which add up.
    pub(crate) moves: Vec<PinMove>,
    /// When it is let go \[s\].
    pub(crate) release: Option<f64>,
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
    pub(crate) const fn new(particle: u32, start: [f64; 3]) -> Self {
        Self { particle, start, moves: Vec::new(), release: None }
    }

    /// What happens to the pin in a frame, if anything does.
    pub(crate) fn action(&self, span: &FrameSpan) -> Option<PinAction> {
        if let Some(release) = self.release.filter(|&release| span.is_after(release)) {
            return span.begins_at(release).then_some(PinAction::Release);
        }
        self.moves
            .iter()
            .any(|step| span.overlaps(step.time, step.time + step.duration))
            .then(|| PinAction::MoveTo(self.position(span.end)))
    }

    /// Where the pin is at `time` \[s\].
    pub(super) fn position(&self, time: f64) -> [f64; 3] {
        self.moves.iter().fold(self.start, |position, step| {
            let fraction = ((time - step.time) / step.duration).clamp(0.0, 1.0);
            std::array::from_fn(|k| position[k] + fraction * step.offset[k])
        })
    }
}
