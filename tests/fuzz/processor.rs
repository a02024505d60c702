//! A worker as its parent sees it: started anew when it ended, killed when it is late.

use std::{
    env, fs,
    io::{self, BufRead, BufReader, Read, Seek, Write},
    os::unix::process::ExitStatusExt,
    process::{Child, Command, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError},
    thread,
    time::Duration,
};

use crate::{arguments::Limits, finding::Harm, worker::Order};

/// What became of an input that did no harm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    Accepted,
    Refused,
}

/// Time for a worker to begin; it makes the inputs that others are made of.
const START: Duration = Duration::from_secs(60);
/// Deadlines that pass before a worker hangs which hardly works.
const PATIENCE: u32 = 3;
/// Last words that are kept \[byte\].
const WORDS: usize = 300;

pub(crate) struct Processor {
    limits: Limits,
    running: Option<Running>,
}

struct Running {
    child: Child,
    answers: Receiver<String>,
    words: fs::File,
}

impl Processor {
    pub(crate) const fn new(limits: Limits) -> Self {
        Self { limits, running: None }
    }

    /// Has an input read.
    ///
    /// # Errors
    /// If no worker can be started.
    pub(crate) fn read(&mut self, order: &Order<'_>) -> io::Result<Result<Reading, Harm>> {
        let mut running = match self.running.take() {
            Some(running) => running,
            None => Running::start(self.limits.memory)?,
        };
        let asked =
            running.child.stdin.as_mut().map(|stdin| stdin.write_all(order.line().as_bytes()));
        if !matches!(asked, Some(Ok(()))) {
            return Ok(Err(running.end(false)));
        }
        let answer = match running.answer(Duration::from_secs(self.limits.deadline)) {
            Ok(answer) => answer,
            Err(error) => return Ok(Err(running.end(error == RecvTimeoutError::Timeout))),
        };
        let result = match answer.as_str() {
            "accepted" => Ok(Reading::Accepted),
            "refused" => Ok(Reading::Refused),
            other => match other.strip_prefix("panic ") {
                Some(message) => Err(Harm::Panic(message.to_owned())),
                None => {
                    return Err(io::Error::other(format!("{order:?}: the worker said {other}")));
                }
            },
        };
        // After a panic nothing of what is shared can be trusted.
        if result.is_ok() {
            self.running = Some(running);
        } else {
            running.end(false);
        }
        Ok(result)
    }

    /// Has an input read by a worker that has read nothing else.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub(crate) fn read_alone(&mut self, order: &Order<'_>) -> io::Result<Result<Reading, Harm>> {
        if let Some(running) = self.running.take() {
            running.end(false);
        }
        self.read(order)
    }
}

impl Drop for Processor {
    fn drop(&mut self) {
        if let Some(running) = self.running.take() {
            running.end(false);
        }
    }
}

impl Running {
    fn start(memory: u64) -> io::Result<Self> {
        let words = tempfile::tempfile()?;
        let mut child = Command::new(env::current_exe()?)
            .args(["worker", "--memory", &memory.to_string()])
            // Address space that allocators keep for themselves would count as memory.
            .env("MALLOC_ARENA_MAX", "1")
            .env("RAYON_NUM_THREADS", "2")
            .env("RUST_BACKTRACE", "0")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::from(words.try_clone()?))
            .spawn()?;
        let (sender, answers) = mpsc::channel();
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || {
                let mut lines = BufReader::new(stdout).lines();
                while let Some(Ok(line)) = lines.next() {
                    if sender.send(line).is_err() {
                        break;
                    }
                }
            });
        }
        let mut running = Self { child, answers, words };
        // Its start does not count as time of the first input.
        let greeting = running.child.stdin.as_mut().map(|stdin| stdin.write_all(b"hello\n"));
        match (greeting, running.answers.recv_timeout(START)) {
            (Some(Ok(())), Ok(_)) => Ok(running),
            _ => Err(io::Error::other(format!("a worker did not start: {}", running.end(false)))),
        }
    }

    /// Waits for an answer until the deadline. On a busy machine others take the time: as long as the worker itself worked for less than half
    /// of it, it gets more; but not for ever, as what sleeps hangs, too.
    fn answer(&self, deadline: Duration) -> Result<String, RecvTimeoutError> {
        let before = processor_time(self.child.id());
        for _ in 0..PATIENCE {
            match self.answers.recv_timeout(deadline) {
                Err(RecvTimeoutError::Timeout) => {}
                answer => return answer,
            }
            let worked = processor_time(self.child.id()).zip(before).map(|(now, then)| now - then);
            if worked.is_none_or(|worked| worked >= deadline / 2) {
                break;
            }
        }
        Err(RecvTimeoutError::Timeout)
    }

    /// Ends the process, and says how it ended.
    fn end(mut self, is_late: bool) -> Harm {
        if is_late {
            // It may have ended by itself in the meantime; then there is nobody to kill.
            let _ = self.child.kill();
        }
        drop(self.child.stdin.take());
        let status = match self.child.wait() {
            _ if is_late => return Harm::Hang,
            Ok(status) => status,
            Err(error) => return Harm::Crash(error.to_string()),
        };
        let ended = match (status.signal(), status.code()) {
            (Some(signal), _) => format!("signal {signal}"),
            (None, code) => format!("exit code {}", code.unwrap_or_default()),
        };
        let mut words = Vec::new();
        let read = self.words.rewind().and_then(|()| self.words.read_to_end(&mut words));
        let text = String::from_utf8_lossy(&words);
        let lines = text.lines().filter(|line| !line.trim().is_empty() && read.is_ok());
        let last = lines.collect::<Vec<_>>().join("; ");
        let last: String =
            last.chars().rev().take(WORDS).collect::<Vec<_>>().into_iter().rev().collect();
        Harm::Crash(format!("{ended}\n{last}"))
    }
}

/// Time for which processors worked on a process; nothing where the system does not tell in the way of Linux.
fn processor_time(process: u32) -> Option<Duration> {
    let status = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name, in brackets, may have spaces; the state comes after it, and eleven numbers later user and system time in hundredths.
    let numbers: Vec<&str> = status.rsplit_once(')')?.1.split_whitespace().collect();
    let [user, system] = [11, 12].map(|place| numbers.get(place)?.parse::<u64>().ok());
    Some(Duration::from_millis(10 * (user? + system?)))
}
