//! Ctrl-C.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use crate::failure::Failure;

/// What a shell reports of a program that an interrupt ended.
const EXIT_CODE_INTERRUPTED: i32 = 130;

/// Whether the user, or a batch system, wants the run to end.
pub(super) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens from now on. The first interrupt is a request, the second ends the process at once.
    pub(super) fn install() -> Result<Self, Failure> {
        let requested = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&requested);
        ctrlc::set_handler(move || {
            if seen.swap(true, Ordering::SeqCst) {
                std::process::exit(EXIT_CODE_INTERRUPTED);
            }
            eprintln!("ending after this frame; interrupt once more to stop at once");
        })
        .map_err(Failure::other)?;
        Ok(Self(requested))
    }

    pub(super) fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
