//! A progress bar for work longer than a second, on standard error.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::verbosity;

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Without a terminal a line is written this often.
const LINE_EVERY: Duration = Duration::from_secs(30);

/// Progress over work of a known amount.
pub(crate) struct Progress {
    bar: ProgressBar,
    started: Instant,
    shown: bool,
    lines: u32,
}

impl Progress {
    #[expect(
        clippy::disallowed_methods,
        reason = "decides only when the bar appears"
    )]
    pub(crate) fn new(what: &'static str, steps: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden());
        let template = "{msg:24} {wide_bar} {percent:>3} %  {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self {
            bar,
            started: Instant::now(),
            shown: false,
            lines: 0,
        }
    }

    pub(crate) fn step(&mut self) {
        self.advance(1, false);
    }

    /// Adds to the work done; cached results cost nothing and reduce the total instead.
    pub(crate) fn advance(&mut self, steps: u64, kept: bool) {
        if kept {
            self.bar.dec_length(steps);
        } else {
            self.bar.inc(steps);
        }
        let elapsed = self.started.elapsed();
        if verbosity::is_quiet() {
            return;
        }
        if !self.shown && elapsed > PATIENCE {
            self.shown = true;
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        if self.bar.is_hidden() && elapsed > LINE_EVERY * (self.lines + 1) {
            self.lines += 1;
            let share = 100 * self.bar.position() / self.bar.length().unwrap_or(1).max(1);
            let left_s = self.bar.eta().as_secs();
            eprintln!("{} {share} %, {left_s} s left", self.bar.message());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
