//! How much memory a solver takes.

use crate::{MEMORY, engine::Engine};

/// What was in use at some moment.
pub(crate) struct MemoryMark {
    host: usize,
    device: Option<u64>,
}

impl MemoryMark {
    pub(crate) fn now(engine: &Engine) -> Self {
        Self { host: MEMORY.current_usage(), device: engine.memory_used() }
    }

    /// What has been taken since, on the host and on the device \[bytes\].
    pub(crate) fn since(&self, engine: &Engine) -> (f64, Option<f64>) {
        let host = MEMORY.current_usage().saturating_sub(self.host) as f64;
        let device = engine.memory_used().zip(self.device);
        (host, device.map(|(now, before)| now.saturating_sub(before) as f64))
    }
}
