//! `[separate] plugin = "as-measured"`.

use runout_core::fault::{Fault, within};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[separate] plugin = "as-measured"`: what the points are of, and what is done to them before values are computed, in this order: crop, outliers, form,
/// voids.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct AsMeasuredConfig {
    /// What the points are of; without it a height map.
    #[serde(default)]
    pub object: Object,
    /// The part that is evaluated, of a height map or a profile; without it all of it.
    #[serde(default)]
    pub crop: Option<Crop>,
    /// Leaves out points further than this many median absolute deviations from the median of their neighbours (of a circle: from its fit). Without it every
    /// point stays.
    #[serde(default)]
    pub outlier_mad: Option<f64>,
    /// Form that is removed by least squares, of a height map or a profile; without it the plane, or the line of a profile.
    #[serde(default)]
    pub form: Option<FormRemoval>,
    /// Degree of `form = "polynomial"`, 1 to 8; without it 2.
    #[serde(default)]
    pub degree: Option<usize>,
    /// What becomes of points of a height map that have no height, or whose height is left out; without it they are masked.
    #[serde(default)]
    pub voids: Voids,
    /// Nominal radius of a circle or a cylinder, in mm; without it the mean radius where the points have one.
    #[serde(default)]
    pub radius_mm: Option<f64>,
    /// Highest order (undulations per revolution) that is fitted to each circle. Without it 500, or less: half a wave is as long as the arcs between
    /// points, and a tenth of the points, 10 at least, are left to show the noise.
    #[serde(default)]
    pub max_order: Option<usize>,
}

/// What points are of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Object {
    /// Heights on a grid in a plane: areal values.
    #[default]
    HeightMap,
    /// Heights along a line: straightness and texture.
    Profile,
    /// A circle: roundness, and texture around.
    Roundness,
    /// Circles of a cylinder at their heights, or a helix: roundness, cylindricity, areal values of the wall.
    Cylinder,
}

/// The part that is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// From and to along x, in mm.
    #[serde(default)]
    pub x_mm: Option<[f64; 2]>,
    /// From and to along y, in mm.
    #[serde(default)]
    pub y_mm: Option<[f64; 2]>,
}

/// A form that is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FormRemoval {
    /// Nothing but the mean.
    None,
    /// The plane; of a profile the line.
    Plane,
    /// A polynomial in x and y of a total degree; of a profile in x.
    Polynomial,
    /// A cylinder in any direction, tilted; of a profile a circle.
    Cylinder,
    /// A sphere; of a profile a circle.
    Sphere,
}

/// What becomes of points without a height.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Voids {
    /// They are left out of every value.
    #[default]
    Mask,
    /// They get the mean of the nearest heights along their row and their column, weighted by the inverse distance.
    Fill,
}

/// Degree of a polynomial where none is given, and the highest.
pub(crate) const DEGREE: usize = 2;
const HIGHEST_DEGREE: usize = 8;
/// Highest order of a circle where none is given, and at all.
pub(crate) const ORDERS: usize = 500;
const HIGHEST_ORDER: usize = 2_000;

impl AsMeasuredConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn checked(&self) -> Result<(), Fault> {
        let is_round = matches!(self.object, Object::Roundness | Object::Cylinder);
        let (plane_keys, round_keys) = (
            [("crop", self.crop.is_some()), ("form", self.form.is_some()), ("degree", self.degree.is_some())],
            [("radius_mm", self.radius_mm.is_some()), ("max_order", self.max_order.is_some())],
        );
        let refused = if is_round { plane_keys.as_slice() } else { round_keys.as_slice() };
        if let Some((key, _)) = refused.iter().find(|(_, is_there)| *is_there) {
            let of = if is_round { "height maps and profiles" } else { "circles and cylinders" };
            return Err(Fault::at(*key, format!("this is a key of {of}")).help("`object` says what the points are of"));
        }
        if self.voids == Voids::Fill && self.object != Object::HeightMap {
            return Err(Fault::at("voids", "only voids of a height map are filled"));
        }
        if self.degree.is_some() && self.form != Some(FormRemoval::Polynomial) {
            return Err(Fault::at("degree", "only a polynomial has a degree").help("set `form = \"polynomial\"`"));
        }
        within("degree", "a degree", self.degree.unwrap_or(DEGREE), 1..=HIGHEST_DEGREE)?;
        within("max_order", "an order", self.max_order.unwrap_or(ORDERS), 2..=HIGHEST_ORDER)?;
        if let Some(radius_mm) = self.radius_mm.filter(|radius| !(radius.is_finite() && *radius > 0.0)) {
            return Err(Fault::at("radius_mm", format!("the radius must be above 0 mm, found {radius_mm}")));
        }
        if let Some(outlier_mad) = self.outlier_mad.filter(|mad| !(mad.is_finite() && *mad >= 1.0)) {
            let message = format!("expected at least 1 (half of the points lie nearer), found {outlier_mad}");
            return Err(Fault::at("outlier_mad", message).help("without the key every point is kept"));
        }
        for (key, ends) in self.crop.iter().flat_map(|crop| [("x_mm", crop.x_mm), ("y_mm", crop.y_mm)]) {
            if let Some([from, to]) = ends.filter(|[from, to]| !(from.is_finite() && to.is_finite() && from < to)) {
                return Err(Fault::at(key, format!("expected [from, to] with from below to, found [{from}, {to}]"))
                    .under("crop"));
            }
        }
        if self.object == Object::Profile && self.crop.is_some_and(|crop| crop.y_mm.is_some()) {
            return Err(Fault::at("y_mm", "a profile has no y").under("crop"));
        }
        Ok(())
    }
}
