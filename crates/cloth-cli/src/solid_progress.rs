//! How far the distances of solids are, on stderr.

use std::{
    io::{IsTerminal, stderr},
    sync::{Mutex, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use cloth::scene::CompileProgress;
use indicatif::{ProgressBar, ProgressStyle};

use crate::say::{self, Level};

/// Time between two lines where there is no terminal, and until the first one.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// A bar on a terminal, else a line every few seconds; nothing for solids that are done at once.
#[derive(Default)]
pub(crate) struct SolidProgress {
    bar: OnceLock<Option<ProgressBar>>,
    last: Mutex<Option<Instant>>,
}

impl SolidProgress {
    /// Called by all threads that take samples.
    pub(crate) fn show(&self, CompileProgress { done, total }: CompileProgress) {
        if let Some(bar) = self.bar.get_or_init(|| bar(total)) {
            bar.set_position(done);
            return;
        }
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let since = *last.get_or_insert_with(Instant::now);
        if since.elapsed() >= LINE_INTERVAL {
            *last = Some(Instant::now());
            let percent = 100.0 * done as f64 / total.max(1) as f64;
            say::note(format_args!("distances of solids: {percent:.0} %"));
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Some(Some(bar)) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}

fn bar(total: u64) -> Option<ProgressBar> {
    if !stderr().is_terminal() || !say::is_at(Level::Normal) {
        return None;
    }
    let style = "{wide_bar} distances of solids {percent} %, {eta} left";
    let style = ProgressStyle::with_template(style).unwrap_or(ProgressStyle::default_bar());
    Some(ProgressBar::new(total).with_style(style))
}
