//! The process that reads inputs: it takes a line for each on stdin and gives one on stdout.

use std::{
    fs,
    io::{BufRead, Write, stdin, stdout},
    panic,
    process::ExitCode,
    sync::{Mutex, PoisonError},
    thread,
};

use nix::sys::resource::{Resource, setrlimit};

use crate::targets;

/// Stack of the thread that reads inputs: that of a thread of a program that uses the library.
const STACK: usize = 2 << 20;

/// The first panic since it was asked for last, of whatever thread.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

/// How the places of code begin that is not in the repository: on any machine that has built this.
const LIBRARIES: char = '/';

/// What is to be read.
#[derive(Clone, Debug)]
pub(crate) enum Order<'a> {
    /// The input with this number of a seed.
    Made { target: &'a str, seed: u64, number: u64 },
    /// The content of a file, whose path has no space.
    File { target: &'a str, path: &'a str },
}

impl Order<'_> {
    /// The line that says so.
    pub(crate) fn line(&self) -> String {
        match self {
            Self::Made { target, seed, number } => format!("made {target} {seed} {number}\n"),
            Self::File { target, path } => format!("file {target} {path}\n"),
        }
    }
}

/// Reads inputs until stdin ends, in `memory` MiB beyond what the process has at its start.
pub(crate) fn run(memory: u64) -> ExitCode {
    // The rest of the program is loaded, and threads have begun, before the limit counts.
    targets::prepare();
    let limit = address_space().saturating_add(memory << 20);
    if setrlimit(Resource::RLIMIT_AS, limit, limit).is_err() {
        return ExitCode::from(2);
    }
    panic::set_hook(Box::new(|info| {
        let payload = info.payload();
        let message = (payload.downcast_ref::<&str>().copied())
            .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let place = info.location().map_or_else(String::new, ToString::to_string);
        let message = message.unwrap_or_default().replace('\n', " ");
        let mut first = PANIC.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(format!("{place}: {message}"));
    }));
    let thread = thread::Builder::new().stack_size(STACK).spawn(|| {
        for line in stdin().lock().lines() {
            let Ok(line) = line else { break };
            let answer = answer(&line);
            if writeln!(stdout(), "{answer}").and_then(|()| stdout().flush()).is_err() {
                break;
            }
        }
    });
    match thread.map(thread::JoinHandle::join) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        _ => ExitCode::from(2),
    }
}

/// What became of the input that a line asks for.
fn answer(line: &str) -> String {
    let words: Vec<&str> = line.split(' ').collect();
    let (target, input) = match words[..] {
        ["made", target, seed, number] => {
            let target = targets::named(target);
            let numbers = (seed.parse(), number.parse());
            let (Some(target), (Ok(seed), Ok(number))) = (target, numbers) else {
                return "unknown".into();
            };
            (target, targets::input(target, seed, number))
        }
        ["file", target, path] => match (targets::named(target), fs::read(path)) {
            (Some(target), Ok(input)) => (target, input),
            _ => return "unknown".into(),
        },
        _ => return "unknown".into(),
    };
    let outcome = panic::catch_unwind(|| (target.run)(&input));
    // A panic that a thread has swallowed is one, too; but one of a library that was caught is an answer.
    let panicked = PANIC.lock().unwrap_or_else(PoisonError::into_inner).take();
    let panicked = panicked.filter(|place| outcome.is_err() || !place.starts_with(LIBRARIES));
    match (panicked, outcome) {
        (Some(message), _) => format!("panic {message}"),
        (None, Ok(true)) => "accepted".into(),
        (None, Ok(false)) => "refused".into(),
        (None, Err(_)) => "panic without a message".into(),
    }
}

/// Address space of this process \[byte\].
fn address_space() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"));
    let kilobytes = size.and_then(|size| size.split_whitespace().next()?.parse().ok());
    // Where the system does not tell, a program of this size has about that.
    kilobytes.unwrap_or(1_u64 << 20).saturating_mul(1024)
}
