//! What deviations are referred to: circles of profiles, and cylinders of walls in the same four ways.

use schemars::JsonSchema;
use serde::Deserialize;

/// A reference circle (ISO 12181-1), and the reference cylinder (ISO 12180-1) that corresponds to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
pub enum Reference {
    /// LSCI: the sum of squared distances to the circle, at right angles to it, is least.
    #[serde(rename = "LSCI")]
    LeastSquares,
    /// MZCI: two concentric circles that enclose the profile at the least distance; the reference is midway between.
    #[serde(rename = "MZCI")]
    MinimumZone,
    /// MICI: the largest circle inside the profile.
    #[serde(rename = "MICI")]
    MaximumInscribed,
    /// MCCI: the smallest circle around the profile.
    #[serde(rename = "MCCI")]
    MinimumCircumscribed,
}

impl Reference {
    /// All of them.
    pub const ALL: [Self; 4] =
        [Self::LeastSquares, Self::MinimumZone, Self::MaximumInscribed, Self::MinimumCircumscribed];

    /// The standard's symbol of the circle.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::LeastSquares => "LSCI",
            Self::MinimumZone => "MZCI",
            Self::MaximumInscribed => "MICI",
            Self::MinimumCircumscribed => "MCCI",
        }
    }

    /// The standard's symbol of the cylinder.
    #[must_use]
    pub fn cylinder_symbol(self) -> &'static str {
        match self {
            Self::LeastSquares => "LSCY",
            Self::MinimumZone => "MZCY",
            Self::MaximumInscribed => "MICY",
            Self::MinimumCircumscribed => "MCCY",
        }
    }
}
