//! Ctrl-C, and the other ways to ask a program to end.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicI32, Ordering},
};

use crate::{failure::Failure, say};

/// What a shell reports of a program that a signal ended is the number of the signal beyond this.
const EXIT_CODE_BASE: i32 = 128;

/// Signals that ask the program to end. Where there is work to be finished first, the first one is a request and the second ends
/// the process; where there is none, the first does.
#[derive(Clone, Default)]
pub(crate) struct Signals(Arc<Heard>);

#[derive(Default)]
struct Heard {
    /// The first signal, 0 for none.
    signal: AtomicI32,
    /// Whether a signal is a request at first.
    patient: AtomicBool,
}

impl Signals {
    /// Listens from now on; until [`Self::finish_work`] is called a signal ends the process at once.
    pub(crate) fn install() -> Result<Self, Failure> {
        let signals = Self::default();
        listen(signals.clone())?;
        Ok(signals)
    }

    /// From now on there is work that must be finished, or none any more.
    pub(crate) fn finish_work(&self, patient: bool) {
        self.0.patient.store(patient, Ordering::SeqCst);
    }

    /// The signal that asked for the end, if there was one.
    pub(crate) fn requested(&self) -> Option<i32> {
        Some(self.0.signal.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
    }

    fn hear(&self, signal: i32) {
        let is_first = self.0.signal.swap(signal, Ordering::SeqCst) == 0;
        if is_first && self.0.patient.load(Ordering::SeqCst) {
            say::note("ending after this frame; interrupt once more to stop at once");
            return;
        }
        // Files that are being written would stay as they are.
        cloth::io::parts_abandon();
        end(exit_code(signal));
    }
}

/// Ends the process with nothing run on the way out. Other threads may be inside a driver of a GPU, whose own clean-up takes away
/// what they stand on: Vulkan on NVIDIA then ended with a fault in place of the code that the signal has.
#[cfg(unix)]
fn end(code: i32) -> ! {
    signal_hook::low_level::exit(code)
}

#[cfg(not(unix))]
fn end(code: i32) -> ! {
    std::process::exit(code)
}

/// The exit code of a program that `signal` ended.
pub(crate) const fn exit_code(signal: i32) -> i32 {
    EXIT_CODE_BASE + signal
}

/// Hears SIGINT, SIGTERM and SIGHUP, the last one unless whoever started the program wants it to be ignored: `nohup` does. Shells
/// start what runs in the background with SIGINT ignored; a run hears it all the same, as that is how others end it.
#[cfg(unix)]
fn listen(heard: Signals) -> Result<(), Failure> {
    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGTERM},
        iterator::Signals as Incoming,
    };

    let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let wanted = [SIGINT, SIGTERM].into_iter().chain(hangup);
    let mut incoming = Incoming::new(wanted).map_err(Failure::other)?;
    let thread = std::thread::Builder::new().name("signals".into());
    let listener = thread.spawn(move || incoming.forever().for_each(|signal| heard.hear(signal)));
    listener.map(drop).map_err(Failure::other)
}

/// Whether a signal is ignored; not so where the system does not tell.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (signal - 1)) != 0
}

/// Hears Ctrl-C and the end of the session.
#[cfg(not(unix))]
fn listen(heard: Signals) -> Result<(), Failure> {
    /// What the signal of Ctrl-C is elsewhere.
    const SIGINT: i32 = 2;
    ctrlc::set_handler(move || heard.hear(SIGINT)).map_err(Failure::other)
}
