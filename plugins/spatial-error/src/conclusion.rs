//! What a result is made of.

use crate::{
    campaign::Campaign, compensate::Correction, config::SpatialError, joint::Predicted, solve::Solution, terms::Term,
};

/// What a result is made of.
pub(crate) struct Conclusion<'a> {
    /// Configuration.
    pub separator: &'a SpatialError,
    /// Readings.
    pub campaign: &'a Campaign,
    /// The fit.
    pub solution: &'a Solution,
    /// Id and target of each added effect, with its term.
    pub names: &'a [(String, String, Term)],
}

/// A prediction at a query.
pub(crate) struct At {
    /// The place, in mm.
    pub place_mm: [f64; 3],
    /// Each component.
    pub predicted: [Predicted; 3],
    /// Whether it is an extrapolation.
    pub extrapolated: bool,
    /// The correction; `None` where nothing is predicted.
    pub correction: Option<Correction>,
    /// The predicted error without the placement.
    pub error_um: [f64; 3],
}
