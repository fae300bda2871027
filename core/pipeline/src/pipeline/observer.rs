//! Who watches a run.

/// Watches a run, for a progress bar.
pub trait Observer: Sync {
    /// The run begins.
    fn begin(&self, _stations: usize) {}
    /// A station is done.
    fn station(&self, _name: &str) {}
    /// A stage says something.
    fn message(&self, _text: &str) {}
}

/// Watches nothing.
pub struct Silent;

impl Observer for Silent {}
