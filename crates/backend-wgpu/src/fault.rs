//! What goes wrong on a device outside of any call: loss, errors without a scope.

use std::sync::{Arc, Mutex, PoisonError};

use cloth_core::{Error, Result};

/// The name of this backend in errors.
pub(crate) const BACKEND: &str = "wgpu";

/// The first failure of a device, kept until somebody asks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Faults(Arc<Mutex<Option<Error>>>);

impl Faults {
    /// Starts to listen to a device.
    pub(crate) fn listen(device: &wgpu::Device) -> Self {
        let faults = Self::default();
        let lost = faults.clone();
        device.set_device_lost_callback(move |reason, message| {
            let message = message.trim();
            let reason = match (reason, message.is_empty()) {
                (wgpu::DeviceLostReason::Destroyed, true) => "it was destroyed".to_owned(),
                (_, true) => "the driver gave no reason".to_owned(),
                (_, false) => message.to_owned(),
            };
            lost.report(Error::DeviceLost { backend: BACKEND, reason });
        });
        let uncaptured = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error| uncaptured.report(fault(&error, 0, 0))));
        faults
    }

    /// Keeps a failure, unless there is an earlier one. The loss of a device counts more than
    /// whatever it brought about.
    pub(crate) fn report(&self, error: Error) {
        let mut first = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_lost = matches!(error, Error::DeviceLost { .. });
        if first.is_none() || is_lost {
            *first = Some(error);
        }
    }

    /// The first failure, if there was any. A device does not recover.
    pub(crate) fn check(&self) -> Result<()> {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error.clone()),
            None => Ok(()),
        }
    }
}

/// The engine's error for one of wgpu, in a call that needed `requested` bytes after `available`
/// ones had been taken.
pub(crate) fn fault(error: &wgpu::Error, requested: u64, available: u64) -> Error {
    match error {
        wgpu::Error::OutOfMemory { .. } => Error::OutOfMemory { requested, available },
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            Error::DeviceLost { backend: BACKEND, reason: description.clone() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_runs_out_is_told_with_its_size() {
        let error = wgpu::Error::OutOfMemory { source: "full".into() };
        let expected = Error::OutOfMemory { requested: 30, available: 20 };
        assert_eq!(fault(&error, 30, 20), expected);
    }

    #[test]
    fn the_loss_of_a_device_counts_more_than_what_follows_from_it() {
        let faults = Faults::default();
        assert_eq!(faults.check(), Ok(()));
        let follows = Error::OutOfMemory { requested: 1, available: 0 };
        let lost = Error::DeviceLost { backend: BACKEND, reason: "unplugged".into() };
        faults.report(follows.clone());
        assert_eq!(faults.check(), Err(follows.clone()));
        faults.report(lost.clone());
        faults.report(follows);
        assert_eq!(faults.check(), Err(lost));
    }
}
