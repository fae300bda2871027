//! Simulation: a recording computed from a declared truth.

use runout_error::Result;
use runout_turning::{measurement::Recording, rig::Rig};

/// Computes a recording from a scenario.
pub trait Simulator: Send + Sync {
    /// The rig that it simulates.
    fn rig(&self) -> &Rig;

    /// The recording, computed as it is read.
    ///
    /// # Errors
    /// When the scenario cannot be computed.
    fn recording(&self) -> Result<Box<dyn Recording + '_>>;

    /// The scenario in full, hidden effects included, for the file's truth.
    fn scenario(&self) -> &str;
}
