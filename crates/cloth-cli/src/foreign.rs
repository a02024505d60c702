//! What drivers and window systems write on stderr by themselves, which a user can do nothing about.

#[cfg(unix)]
use std::{
    fs::{File, OpenOptions},
    io::stderr,
    os::fd::{AsFd, OwnedFd},
    sync::atomic::{AtomicBool, Ordering},
};

#[cfg(unix)]
use crate::say::{self, Level};

/// Runs `work`, which may load drivers, with their own words left out; `--verbose` lets them through. What the program itself says
/// arrives.
#[cfg(unix)]
pub(crate) fn hushed<T>(work: impl FnOnce() -> T) -> T {
    let _hush = Hush::begin();
    work()
}

/// Runs `work`.
#[cfg(not(unix))]
pub(crate) fn hushed<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Puts stderr back at its end, also if a panic ends it.
#[cfg(unix)]
struct Hush(OwnedFd);

/// Whether stderr leads elsewhere.
#[cfg(unix)]
static HUSHED: AtomicBool = AtomicBool::new(false);

#[cfg(unix)]
impl Hush {
    /// Nothing where it is not wanted, where another one holds, or where the system refuses.
    fn begin() -> Option<Self> {
        if say::is_at(Level::Verbose) || HUSHED.swap(true, Ordering::SeqCst) {
            return None;
        }
        let begun = Self::redirect();
        HUSHED.store(begun.is_some(), Ordering::SeqCst);
        begun
    }

    fn redirect() -> Option<Self> {
        let saved = stderr().as_fd().try_clone_to_owned().ok()?;
        let own = File::from(saved.try_clone().ok()?);
        let nowhere = OpenOptions::new().write(true).open("/dev/null").ok()?;
        nix::unistd::dup2_stderr(&nowhere).ok()?;
        say::own_set(Some(own));
        Some(Self(saved))
    }
}

#[cfg(unix)]
impl Drop for Hush {
    fn drop(&mut self) {
        say::own_set(None);
        // It was stderr a moment ago.
        let _ = nix::unistd::dup2_stderr(&self.0);
        HUSHED.store(false, Ordering::SeqCst);
    }
}
