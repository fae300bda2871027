//! An effect that was found.

use super::{Remainder, evidence::Evidence, fit::Refit};

/// An effect that was added, with everything that it cannot be distinguished from.
#[derive(Clone)]
pub(super) struct FoundEffect {
    /// The best one first.
    pub members: Vec<usize>,
    /// Values of each member as if it were all of it.
    pub alone: Vec<Vec<f64>>,
    /// Values and standard uncertainties as if the best one were all of it.
    pub values: Vec<f64>,
    pub std: Vec<f64>,
    pub evidence: Evidence,
    pub before: Remainder,
    pub after: Remainder,
}

/// What the search for mistakes finds.
pub(super) enum Declaration<F> {
    /// Nothing that the data prove.
    Sound,
    /// Less than this effect explains, which therefore comes first.
    Beside(Box<FoundEffect>),
    /// Mistakes; the fit with them corrected.
    Corrected(Refit<F>),
}
