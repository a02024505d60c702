//! Times of stages, by events on the device.

use std::time::Duration;

use cloth_core::{Result, StageTime};
use cudarc::driver::{result, sys};

use crate::{fault::DriverResult, queue::Queue};

/// Spans that are kept until somebody asks; more of them are not timed.
const SPANS_MAX: usize = 4096;

/// Events around stages. To record one takes as long as to start a kernel: where a stage begins as the last one ends, both share it.
#[derive(Default)]
pub(crate) struct Timing {
    events: Vec<sys::CUevent>,
    /// Events that are in use: the first ones.
    used: usize,
    /// Stages, and where they begin and end.
    spans: Vec<(&'static str, [usize; 2])>,
    /// Where the last stage has ended.
    last: Option<usize>,
}

// SAFETY: events may be used from any thread that has made the context current.
unsafe impl Send for Timing {}

impl Timing {
    /// An event that is not in use.
    fn event(&mut self, queue: &Queue) -> Result<usize> {
        queue.device.bind()?;
        if self.used == self.events.len() {
            let kind = sys::CUevent_flags::CU_EVENT_DEFAULT;
            self.events.push(result::event::create(kind).engine()?);
        }
        self.used += 1;
        Ok(self.used - 1)
    }

    fn record(&mut self, queue: &Queue) -> Result<usize> {
        let event = self.event(queue)?;
        // SAFETY: event and stream are alive.
        unsafe { result::event::record(self.events[event], queue.stream()) }.engine()?;
        Ok(event)
    }

    /// Marks the start of a stage.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn begin(&mut self, queue: &Queue) -> Result<Option<usize>> {
        if self.spans.len() >= SPANS_MAX {
            return Ok(None);
        }
        match self.last.filter(|_| !queue.moved_data()) {
            Some(last) => Ok(Some(last)),
            None => self.record(queue).map(Some),
        }
    }

    /// Marks its end.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn end(
        &mut self,
        queue: &Queue,
        stage: &'static str,
        start: Option<usize>,
    ) -> Result<()> {
        if let Some(start) = start {
            let end = self.record(queue)?;
            self.spans.push((stage, [start, end]));
            self.last = Some(end);
            queue.moved_data_forget();
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
        self.last = None;
        Ok(Some(events.map(|event| self.events[event])))
    }

    /// The times since the last call, once everything is done.
    pub(crate) fn take(&mut self, queue: &Queue) -> Vec<StageTime> {
        let mut times: Vec<StageTime> = Vec::new();
        if queue.synchronize().is_err() {
            return times;
        }
        for (stage, span) in self.spans.drain(..) {
            let [start, end] = span.map(|event| self.events[event]);
            // SAFETY: both events have been recorded on a stream that has been waited for.
            if let Ok(milliseconds) = unsafe { result::event::elapsed(start, end) } {
                let time = Duration::from_secs_f64(f64::from(milliseconds) * 1e-3);
                match times.iter_mut().find(|entry| entry.stage == stage) {
                    Some(entry) => entry.time += time,
                    None => times.push(StageTime { stage, time }),
                }
            }
        }
        (self.used, self.last) = (0, None);
        times
    }
}

impl Drop for Timing {
    fn drop(&mut self) {
        for event in self.events.drain(..) {
            // SAFETY: events are in one list only, and nobody waits for them any more.
            let _ = unsafe { result::event::destroy(event) };
        }
    }
}
