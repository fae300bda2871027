//! Loading: from files to recorded turns or measured points.

use crate::{Result, measurement::Recording, points::Points, rig::Rig};

/// Opens a measurement.
pub trait Loader: Send + Sync {
    /// What it will give, so that `check` can refuse a pipeline before it runs.
    fn kind(&self) -> SourceKind;

    /// Opens the files. `rig` is there whenever [`kind`](Self::kind) is [`SourceKind::Turns`].
    ///
    /// # Errors
    /// When a file is missing, damaged, or does not hold what the rig names.
    fn open(&self, rig: Option<&Rig>) -> Result<Source>;
}

/// What a loader gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// Recorded turns of sensors.
    Turns,
    /// Measured points.
    Points,
}

/// An opened measurement.
pub enum Source {
    /// Recorded turns of sensors.
    Turns(Box<dyn Recording>),
    /// Measured points.
    Points(Points),
}
