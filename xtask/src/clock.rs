//! What the stages of a chore take.

use std::time::Instant;

/// Stages that are over, and the one that runs.
pub(crate) struct Clock {
    begun: Instant,
    over: Vec<(&'static str, f64)>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { begun: Instant::now(), over: Vec::new() }
    }

    /// Ends a stage.
    pub(crate) fn over(&mut self, stage: &'static str) {
        self.over.push((stage, self.begun.elapsed().as_secs_f64()));
        self.begun = Instant::now();
    }

    /// "compile and lint 512 s, tests 760 s; 1272 s in all".
    pub(crate) fn text(&self) -> String {
        let each: Vec<String> = self.over.iter().map(|(stage, seconds)| format!("{stage} {seconds:.0} s")).collect();
        let all: f64 = self.over.iter().map(|(_, seconds)| seconds).sum();
        format!("{}; {all:.0} s in all", each.join(", "))
    }
}
