//! Times of stages, by events on the device.

use std::time::Duration;

use cloth_core::{Result, StageTime};
use cudarc::driver::{result, sys};

use crate::{fault::DriverResult, queue::Queue};

/// Spans that are kept until somebody asks; more of them are not timed.
const SPANS_MAX: usize = 4096;

/// Events around stages.
#[derive(Default)]
pub(crate) struct Timing {
    spans: Vec<(&'static str, [sys::CUevent; 2])>,
    free: Vec<sys::CUevent>,
}

// SAFETY: events may be used from any thread that has made the context current.
unsafe impl Send for Timing {}

impl Timing {
    fn event(&mut self, queue: &Queue) -> Result<sys::CUevent> {
        queue.device.bind()?;
        match self.free.pop() {
            Some(event) => Ok(event),
            None => result::event::create(sys::CUevent_flags::CU_EVENT_DEFAULT).engine(),
        }
    }

    fn record(&mut self, queue: &Queue) -> Result<sys::CUevent> {
        let event = self.event(queue)?;
        // SAFETY: event and stream are alive.
        unsafe { result::event::record(event, queue.stream()) }.engine()?;
        Ok(event)
    }

    /// Marks the start of a stage.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn begin(&mut self, queue: &Queue) -> Result<Option<sys::CUevent>> {
        if self.spans.len() < SPANS_MAX { self.record(queue).map(Some) } else { Ok(None) }
    }

    /// Marks its end.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn end(
        &mut self,
        queue: &Queue,
        stage: &'static str,
        start: Option<sys::CUevent>,
    ) -> Result<()> {
        if let Some(start) = start {
            let end = self.record(queue)?;
            self.spans.push((stage, [start, end]));
        }
        Ok(())
    }

    /// The events around a stage that the caller has recorded, together with what is between them.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn span(
        &mut self,
        queue: &Queue,
        stage: &'static str,
    ) -> Result<Option<[sys::CUevent; 2]>> {
        if self.spans.len() == SPANS_MAX {
            return Ok(None);
        }
        let events = [self.event(queue)?, self.event(queue)?];
        self.spans.push((stage, events));
        Ok(Some(events))
    }

    /// The times since the last call, once everything is done.
    pub(crate) fn take(&mut self, queue: &Queue) -> Vec<StageTime> {
        let mut times: Vec<StageTime> = Vec::new();
        if queue.synchronize().is_err() {
            return times;
        }
        for (stage, [start, end]) in self.spans.drain(..) {
            // SAFETY: both events have been recorded on a stream that has been waited for.
            if let Ok(milliseconds) = unsafe { result::event::elapsed(start, end) } {
                let time = Duration::from_secs_f64(f64::from(milliseconds) * 1e-3);
                match times.iter_mut().find(|entry| entry.stage == stage) {
                    Some(entry) => entry.time += time,
                    None => times.push(StageTime { stage, time }),
                }
            }
            self.free.extend([start, end]);
        }
        times
    }
}

impl Drop for Timing {
    fn drop(&mut self) {
        let spans = self.spans.drain(..).flat_map(|(_, events)| events);
        for event in spans.chain(self.free.drain(..)) {
            // SAFETY: events are in one list only, and nobody waits for them any more.
            let _ = unsafe { result::event::destroy(event) };
        }
    }
}
