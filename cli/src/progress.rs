//! Progress on a terminal's stderr; nothing in a pipe.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use runout_core::pipeline::run::Observer;

use crate::render::one_line;

/// A bar that fills as things get done.
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar for things of this name ("stations"); it shows once it is known how many there are.
    #[must_use]
    pub(crate) fn new(things: &'static str) -> Self {
        // Hidden by itself where stderr is no terminal.
        Self::shown_by(ProgressBar::new(0), things)
    }

    /// A bar that never shows.
    #[must_use]
    pub(crate) fn hidden() -> Self {
        Self::shown_by(ProgressBar::hidden(), "")
    }

    fn shown_by(bar: ProgressBar, things: &'static str) -> Self {
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} {prefix} {msg} ({elapsed}, {eta} to go)")
        {
            bar.set_style(style);
        }
        bar.set_prefix(things);
        Self { bar }
    }

    /// There are so many.
    pub(crate) fn expect(&self, count: usize) {
        self.bar.set_length(count as u64);
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    /// One more thing is done.
    pub(crate) fn advance(&self, done: &str) {
        self.bar.set_message(one_line(done).into_owned());
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for Progress {
    fn begin(&self, stations: usize) {
        self.expect(stations);
    }

    fn station(&self, name: &str) {
        self.advance(name);
    }

    fn message(&self, text: &str) {
        self.bar.println(one_line(text));
    }
}
