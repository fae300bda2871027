//! Simulation: what would be measured, computed from a declared truth.

use runout_error::Result;
use runout_evaluate::height_grid::HeightGrid;
use runout_table::{RecordBatch, TableSpec};
use runout_turning::{measurement::Recording, rig::Rig};

/// Computes what would be measured from a scenario.
pub trait Simulator: Send + Sync {
    /// What would be measured; samples of a recording are computed as they are read.
    ///
    /// # Errors
    /// When the scenario cannot be computed.
    fn simulate(&self) -> Result<Simulation<'_>>;

    /// The scenario in full, hidden effects included, for the file's truth.
    fn scenario(&self) -> &str;
}

/// What a simulator gives.
pub enum Simulation<'a> {
    /// Recorded turns of the sensors of a rig.
    Turns {
        /// The rig.
        rig: &'a Rig,
        /// The recording.
        recording: Box<dyn Recording + 'a>,
    },
    /// Measured points, one a row.
    Points {
        /// Their columns.
        table: TableSpec,
        /// The points.
        rows: RecordBatch,
    },
    /// Heights of a surface.
    Heights(HeightGrid),
}
