//! What the standards' values can be computed from, as data: a domain offers it, the pipeline turns it into values.

use crate::height_grid::HeightGrid;
use runout_draws::OpenErrors;
use runout_turning::separation::Separation;

/// Something that the standards' values are computed from, with its errors and with what it is of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Evaluable {
    /// Closed profiles of a part, with the covariance of their harmonics: roundness, texture around, cylindricity, areal values of the wall. One at
    /// most in an outcome: a surface and meshes follow from it.
    ClosedProfiles(Form),
    /// A profile along a line: straightness, texture along.
    OpenProfile(OpenProfile),
    /// Heights on a plane: areal values. Of the first one in an outcome meshes are drawn.
    HeightMap(PlaneMap),
    /// Motion of an axis of rotation at standing positions: synchronous error motion values.
    AxisMotion(AxisMotion),
}

/// Kinds of [`Evaluable`], which a domain declares before there are data; and what only recorded turns have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvaluableKind {
    /// Closed profiles, section by section.
    ClosedProfiles,
    /// Motion of an axis of rotation.
    AxisMotion,
    /// How far single turns of an axis lie apart, station by station. Recorded turns give it beside the motion, points do not.
    TurnSpread,
    /// A profile along a line.
    OpenProfile,
    /// Heights on a plane.
    HeightMap,
}

impl EvaluableKind {
    /// Its name in messages and documents: "open-profile".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ClosedProfiles => "closed-profiles",
            Self::AxisMotion => "axis-motion",
            Self::TurnSpread => "turn-spread",
            Self::OpenProfile => "open-profile",
            Self::HeightMap => "height-map",
        }
    }
}

impl Evaluable {
    /// What it is.
    #[must_use]
    pub fn kind(&self) -> EvaluableKind {
        match self {
            Self::ClosedProfiles(_) => EvaluableKind::ClosedProfiles,
            Self::OpenProfile(_) => EvaluableKind::OpenProfile,
            Self::HeightMap(_) => EvaluableKind::HeightMap,
            Self::AxisMotion(_) => EvaluableKind::AxisMotion,
        }
    }

    /// The closed profiles, where it is these.
    #[must_use]
    pub fn into_form(self) -> Option<Form> {
        match self {
            Self::ClosedProfiles(form) => Some(form),
            _ => None,
        }
    }

    /// The heights on a plane, where it is these.
    #[must_use]
    pub fn plane_map(&self) -> Option<&PlaneMap> {
        match self {
            Self::HeightMap(map) => Some(map),
            _ => None,
        }
    }
}

/// Closed profiles of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Form {
    /// One separation a section, in the order of z, named by the section's id.
    pub sections: Vec<Separation>,
    /// Radius of the cylinder that deviations count from, in mm.
    pub radius_mm: f64,
}

/// A profile along a line. Its level and its slope are no part of any value.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenProfile {
    /// What it is of: "part", "slide", the id of a trace. Values have it as `of`, and limits name it as `section`.
    pub of: String,
    /// Ascending positions along the line, in mm.
    pub z_mm: Vec<f64>,
    /// Deviations at them, in µm; NaN where missing.
    pub deviation_um: Vec<f64>,
    /// What its errors are; or why they are not known, in words for the user.
    pub errors: Result<OpenErrors, String>,
}

/// Heights on a plane. Level and tilt are removed with the form, before any value.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlaneMap {
    /// What it is of: "measured", "residual". Values have it as `of`, and limits name it as `section`.
    pub of: String,
    /// The heights.
    pub grid: HeightGrid,
    /// What its heights count from where the domain has removed form: "least-squares sphere removed". `[evaluate.areal] form` then removes more only
    /// where it is `polynomial`.
    pub reference: Option<String>,
    /// Why its values have no uncertainty, in words for the user, where the domain knows more than that errors of a map are stated point by point.
    pub no_uncertainty: Option<String>,
    /// Nodes whose height was filled and not measured: they lower the coverage of values.
    pub filled: usize,
}

impl PlaneMap {
    /// A map whose form is not removed.
    #[must_use]
    pub fn new(of: impl Into<String>, grid: HeightGrid) -> Self {
        Self { of: of.into(), grid, reference: None, no_uncertainty: None, filled: 0 }
    }
}

/// Motion of an axis of rotation at standing positions.
///
/// Directions are those of an axis along z: x and y across it, right-handed. Level, and what turns with the axis once a turn, are how the
/// axis and what it carries are placed, and no part of any value.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisMotion {
    /// What it is of: "C". Values have it as `of`, and limits name it as `section`.
    pub of: String,
    /// Letters of the machine's directions in the places of x, y and z: `['y', 'z', 'x']` of an axis along x.
    pub letters: [char; 3],
    /// Distinct positions, in degrees.
    pub angle_deg: Vec<f64>,
    /// Where along the axis x and y are, in mm.
    pub z_mm: f64,
    /// At each position: x, y and z of the axis in µm, its tilts about x and y in µrad; NaN where not observable.
    pub motion: Vec<[f64; 5]>,
    /// What its errors are; or why they are not known, in words for the user.
    pub errors: Result<MotionErrors, String>,
}

/// Errors of the motion of an axis. Its covariance is that of both kinds together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MotionErrors {
    /// Covariance of the five numbers at each position, but for `common`; independent from position to position.
    pub own: Vec<[[f64; 5]; 5]>,
    /// Changes of the whole motion, five numbers at each position, each change with a factor of its own of standard deviation 1.
    pub common: Vec<Vec<[f64; 5]>>,
    /// Degrees of freedom behind both; 0 where they are taken as exact.
    pub freedom: f64,
}
