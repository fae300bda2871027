//! What the standards' values can be computed from, as data: a domain offers it, the pipeline turns it into values.

use crate::height_grid::HeightGrid;
use runout_standards::open_errors::OpenErrors;
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
}

/// Kinds of [`Evaluable`], which a domain declares before there are data; and what only recorded turns have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvaluableKind {
    /// Closed profiles, section by section.
    ClosedProfiles,
    /// Motion of an axis with the spread over its turns, station by station. Recorded turns give it, points do not.
    AxisMotion,
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
        }
    }

    /// The closed profiles, where it is these.
    pub(crate) fn into_form(self) -> Option<Form> {
        match self {
            Self::ClosedProfiles(form) => Some(form),
            _ => None,
        }
    }

    /// The heights on a plane, where it is these.
    pub(crate) fn plane_map(&self) -> Option<&PlaneMap> {
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
pub struct PlaneMap {
    /// What it is of: "measured", "residual". Values have it as `of`, and limits name it as `section`.
    pub of: String,
    /// The heights.
    pub grid: HeightGrid,
}
