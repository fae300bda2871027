//! What deviations are referred to: circles of profiles, and cylinders of walls in the same four ways.

use std::fmt;

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

    /// The standard's symbol of the lines of an open profile (ISO 12780-1); a circle inside or around has none.
    #[must_use]
    pub fn line_symbol(self) -> Option<&'static str> {
        match self {
            Self::LeastSquares => Some("LSLI"),
            Self::MinimumZone => Some("MZLI"),
            Self::MaximumInscribed | Self::MinimumCircumscribed => None,
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

/// Why points have no reference circle or cylinder of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Undetermined {
    /// Fewer points than the circle or cylinder has unknowns.
    TooFewPoints,
    /// All points of a wall have the same height.
    OneHeight,
    /// The nominal radius is not a positive number, or deviations of a wall are as large as it.
    Radius,
    /// The points do not surround a centre or axis (a partial arc): the inscribed circle, or the radius of the zone, grows
    /// without bound.
    NotBounded,
    /// The search did not converge.
    NotFound,
}

impl fmt::Display for Undetermined {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::TooFewPoints => "there are fewer points than unknowns",
            Self::OneHeight => "all points have the same height",
            Self::Radius => "the nominal radius is not above the deviations",
            Self::NotBounded => "the points do not surround a centre: the reference is not bounded",
            Self::NotFound => "the search did not converge",
        })
    }
}

impl std::error::Error for Undetermined {}
