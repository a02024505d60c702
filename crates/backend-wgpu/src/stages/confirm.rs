//! Learning whether frames were good while the device is at work on later ones.
//!
//! Of the frames that may be under way the host asks about the first half, and waits for the answer when the second half is
//! under way too: the device need not stand still until it has answered and is given work again. If they were not good,
//! all open frames are done again.

use cloth_core::Result;

use super::{Stages, encode::FRAMES_AHEAD};
use crate::{
    buffers::MOTIONS_MAX,
    contact::Question,
    layout::Status,
    readback::{Answer, Readback},
};

impl Stages {
    /// Whether there is room for the motion that later frames begin with.
    pub(super) fn asks_ahead(&self) -> bool {
        self.buffers.motion_count() == MOTIONS_MAX
    }

    /// Asks, or takes the answer, if it is time for that. All open frames are recorded to their end.
    pub(super) fn frames_confirm(&mut self) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let count = open.frames.len();
        if count >= FRAMES_AHEAD
            && let Some(question) = open.question.take()
        {
            let status: Status =
                question.status.wait(&self.context, bytemuck::pod_read_unaligned)?;
            if status.invalid != 0 {
                return self.settle();
            }
            open.start = question.motion;
            let good = open.frames.drain(..question.frames);
            if let Some(policy) = &mut self.contact {
                good.for_each(|_| policy.frame_was_good());
            }
        }
        match &self.open {
            Some(open) if open.question.is_none() && open.frames.len() >= FRAMES_AHEAD / 2 => {
                self.status_ask()
            }
            _ => Ok(()),
        }
    }

    /// Asks for the status after the frames that are open now.
    fn status_ask(&mut self) -> Result<()> {
        let size = size_of::<Status>() as u64;
        let readback = Readback::new(&self.context, size);
        let status = self.buffers.get("status", 0, 0)?;
        self.recorder.copy(&self.context, status, 0, readback.buffer(), 0, size);
        self.recorder.submit(&self.context)?;
        let status = Answer::ask(&self.context, readback, size);
        let motion = self.present;
        if let Some(open) = &mut self.open {
            open.question = Some(Question { frames: open.frames.len(), motion, status });
        }
        Ok(())
    }
}
