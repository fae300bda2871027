//! What the single turns of a station show, and their average does not.

use runout_core::stage::Station;

use super::{
    changes::{self, Change},
    drift::Creeping,
    lines::{self, Lines},
};
use crate::{layout::Layout, selection::Selection};

/// Of one station.
pub(crate) struct TurnObservations {
    /// What their levels say of each sensor's creep.
    pub creeping: Vec<Option<Creeping>>,
    /// Changes within a setup.
    pub changes: Vec<Change>,
    /// Asynchronous lines.
    pub lines: Lines,
}

impl TurnObservations {
    /// `creeping` is what the levels of all stations say of each sensor.
    pub(crate) fn new(
        selection: &Selection,
        layout: &Layout,
        station: &Station,
        creeping: Vec<Option<Creeping>>,
    ) -> Self {
        Self {
            changes: changes::changes(selection, station, &creeping),
            lines: lines::lines(selection, layout, station),
            creeping,
        }
    }

    /// Whether turns differ by noise alone, as far as single turns show.
    pub(super) fn is_steady(&self) -> bool {
        self.lines.found.is_empty() && self.creeping.iter().flatten().all(|creeping| !creeping.certain())
    }
}
