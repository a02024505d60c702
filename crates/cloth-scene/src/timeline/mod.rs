//! What the outside does to a running scene, frame by frame.

mod attachment_track;
mod collider_track;
mod pin_track;

use cloth_core::{ColliderControl, Control, PinControl};

pub(crate) use attachment_track::{AttachmentTrack, Held, Hold};
pub(crate) use collider_track::{ColliderKey, ColliderTrack};
pub(crate) use pin_track::{PinMove, PinTrack};

/// Events and keyframes of a scene. The control of a frame depends on its number alone, so that a
/// run can be taken up again at any frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    frames_per_second: f64,
    pins: Vec<PinTrack>,
    colliders: Vec<ColliderTrack>,
    attachments: Vec<AttachmentTrack>,
}

/// Share of a frame below which a difference of two times is rounding.
const ROUNDING: f64 = 1e-6;

impl Timeline {
    pub(crate) const fn new(
        frames_per_second: f64,
        pins: Vec<PinTrack>,
        colliders: Vec<ColliderTrack>,
    ) -> Self {
        Self { frames_per_second, pins, colliders, attachments: Vec::new() }
    }

    /// The same with what colliders hold.
    pub(crate) fn with_attachments(self, attachments: Vec<AttachmentTrack>) -> Self {
        Self { attachments, ..self }
    }

    /// Whether nothing ever happens.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.pins.is_empty() && self.colliders.is_empty() && self.attachments.is_empty()
    }

    /// The control to set before frame number `frame` is advanced; frames count from 0, frame k
    /// leads from time k / frames per second to (k + 1) / frames per second.
    #[must_use]
    pub fn control(&self, frame: u64) -> Control {
        let span = FrameSpan::new(frame, self.frames_per_second);
        let pins = self.pins.iter().filter_map(|track| {
            Some(PinControl { particle: track.particle, action: track.action(&span)? })
        });
        let colliders = self.colliders.iter().filter_map(|track| {
            let pose = track.moves_in(&span).then(|| track.pose(span.end))?;
            Some(ColliderControl { collider: track.collider, pose })
        });
        let tracks = &self.colliders;
        let carried = self.attachments.iter().flat_map(|held| held.pins(tracks, &span));
        let springs = self.attachments.iter().any(|held| held.spring.is_some());
        let forces = self.attachments.iter().flat_map(|held| held.forces(tracks, &span));
        Control {
            pins: carried.chain(pins).collect(),
            colliders: colliders.collect(),
            forces: springs.then(|| forces.collect()),
            ..Control::default()
        }
    }
}

impl Timeline {
    /// Where the colliders that ever move are after `frames` frames.
    pub fn colliders(&self, frames: u64) -> impl Iterator<Item = ColliderControl> {
        let time = frames as f64 / self.frames_per_second;
        let tracks = self.colliders.iter();
        tracks
            .map(move |track| ColliderControl { collider: track.collider, pose: track.pose(time) })
    }

    /// Where the pins that ever move are after `frames` frames \[m\], or were when they were let go. Those that events hold are taken to
    /// be held where they are at the start.
    pub fn moved_pins(&self, frames: u64) -> impl Iterator<Item = [f64; 3]> {
        let time = frames as f64 / self.frames_per_second;
        self.pins.iter().filter_map(move |track| track.position(time))
    }
}

/// The time that a frame covers.
pub(crate) struct FrameSpan {
    /// Start \[s\].
    pub(crate) start: f64,
    /// End \[s\].
    pub(crate) end: f64,
    /// Times closer than this are the same \[s\].
    pub(crate) rounding: f64,
}

impl FrameSpan {
    fn new(frame: u64, frames_per_second: f64) -> Self {
        let number = frame as f64;
        Self {
            start: number / frames_per_second,
            end: (number + 1.0) / frames_per_second,
            rounding: ROUNDING / frames_per_second,
        }
    }

    /// Whether something that lasts from `start` to `end` \[s\] happens in this frame.
    pub(crate) fn overlaps(&self, start: f64, end: f64) -> bool {
        start < self.end - self.rounding && end > self.start + self.rounding
    }

    /// Whether the start of this frame is the first that is not before `time` \[s\].
    pub(crate) fn begins_at(&self, time: f64) -> bool {
        let length = self.end - self.start;
        (self.start - length + self.rounding < time || self.start == 0.0)
            && time <= self.start + self.rounding
    }

    /// Whether this frame starts after `time` \[s\], or at it.
    pub(crate) fn is_after(&self, time: f64) -> bool {
        time <= self.start + self.rounding
    }
}
