//! Loading: from files to recorded turns or measured points.

use crate::points::{PointColumn, Points};
use runout_error::Result;
use runout_turning::{measurement::Recording, rig::Rig};

/// Opens a measurement.
pub trait Loader: Send + Sync {
    /// What it will give, so that `check` can refuse a pipeline before it runs.
    fn kind(&self) -> SourceKind;

    /// Opens the files.
    ///
    /// # Errors
    /// When a file is missing, damaged, or does not hold what is wanted of it.
    fn open(&self, wanted: &Request) -> Result<Source>;
}

/// What a pipeline wants of its files.
#[derive(Debug, Clone, Copy, Default)]
pub struct Request<'a> {
    /// Sensors and setups; always there for [`SourceKind::Turns`].
    pub rig: Option<&'a Rig>,
    /// Columns of points, for [`SourceKind::Points`].
    pub columns: &'a [PointColumn],
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
