//! A progress bar for what takes longer than a second, on standard error.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Progress over a known number of steps.
pub(crate) struct Progress {
    bar: ProgressBar,
    started: Instant,
    shown: bool,
}

impl Progress {
    #[expect(
        clippy::disallowed_methods,
        reason = "decides only when the bar appears"
    )]
    pub(crate) fn new(what: &'static str, steps: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden());
        if let Ok(style) =
            ProgressStyle::with_template("{msg:24} {wide_bar} {percent:>3} %  {eta} left")
        {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self {
            bar,
            started: Instant::now(),
            shown: false,
        }
    }

    pub(crate) fn step(&mut self) {
        self.bar.inc(1);
        if !self.shown && self.started.elapsed() > PATIENCE {
            self.shown = true;
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

/// Progress over units of different weights, some of which are there already: tells the time that is left by the rate of
/// those that were made.
pub(crate) struct WeightedProgress {
    what: &'static str,
    bar: ProgressBar,
    started: Instant,
    last_told: Instant,
    units: usize,
    units_done: usize,
    left: u64,
    made: u64,
}

/// Where no bar can be drawn, a line is written this often.
const LINE_EVERY: Duration = Duration::from_secs(30);

impl WeightedProgress {
    #[expect(
        clippy::disallowed_methods,
        reason = "tells how much time is left; nothing depends on it"
    )]
    pub(crate) fn new(what: &'static str, units: usize, weight: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(weight), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:42} {wide_bar} {percent:>3} %") {
            bar.set_style(style);
        }
        let now = Instant::now();
        Self {
            what,
            bar,
            started: now,
            last_told: now,
            units,
            units_done: 0,
            left: weight,
            made: 0,
        }
    }

    /// One unit more, of this weight; `kept` if it cost nothing.
    pub(crate) fn advance(&mut self, weight: u64, kept: bool) {
        self.units_done += 1;
        self.left = self.left.saturating_sub(weight);
        if !kept {
            self.made += weight;
        }
        let text = self.text();
        self.bar.set_message(text.clone());
        self.bar.inc(weight);
        if self.bar.is_hidden() && self.last_told.elapsed() > LINE_EVERY {
            self.last_told += self.last_told.elapsed();
            eprintln!("{text}");
        }
    }

    fn text(&self) -> String {
        let so_far = format!("{} {} of {}", self.what, self.units_done, self.units);
        if self.made == 0 || self.left == 0 {
            return so_far;
        }
        let rate = self.made as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
        let left_s = self.left as f64 / rate;
        if left_s < 90.0 {
            format!("{so_far}, {left_s:.0} s left")
        } else {
            format!("{so_far}, {:.0} min left", left_s / 60.0)
        }
    }
}

impl Drop for WeightedProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
