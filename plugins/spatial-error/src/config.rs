//! `[separate] plugin = "spatial-error"`.

use std::path::PathBuf;

use runout_core::{fault::Fault, pipeline::Context};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    compensate::{Axis, Chain},
    correlation::Family,
    joint::Covariance,
    query::Query,
    terms::Term,
};

/// `[separate] plugin = "spatial-error"`.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpatialErrorConfig {
    /// What is always fitted: `rigid` (placement of the tracker: three displacements, three rotations), `translation` (ordinary
    /// kriging), nothing (a field of mean zero).
    #[serde(default = "rigid")]
    pub declared: Vec<Declared>,
    /// The covariance of the field.
    #[serde(default)]
    pub kriging: Kriging,
    /// Offset of the measured point from the last axis of the chain, in mm.
    #[serde(default)]
    pub tool_mm: [f64; 3],
    /// Periods of the ball screws or scales of X, Y and Z, in mm; 0 where one is not known: `diagnose` then looks for it.
    #[serde(default)]
    pub pitch_mm: [f64; 3],
    /// Linear axes from the base to the tool.
    #[serde(default = "xyz")]
    pub chain: [Letter; 3],
    /// Where to predict and to compensate; at the measured places without it.
    #[serde(default)]
    pub query: Query,
    /// How to compensate: by X, Y and Z without limits where nothing is said.
    #[serde(default)]
    pub compensate: Compensate,
    /// Component errors of the axes at nodes, as tables: for a machine whose `chain` is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curves: Option<Curves>,
    /// Standard uncertainty of one coordinate of one row, in µm. Without it: of the column `std_um`, else from repeats, else the
    /// nugget is noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std_um: Option<f64>,
}

/// Nodes of the component curves.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curves {
    /// Distance of the nodes of X, Y and Z, in mm: the measured travel is divided evenly, as near to it as possible.
    pub pitch_mm: [f64; 3],
}

impl Default for SpatialErrorConfig {
    fn default() -> Self {
        Self {
            declared: rigid(),
            kriging: Kriging::default(),
            tool_mm: [0.0; 3],
            pitch_mm: [0.0; 3],
            chain: xyz(),
            query: Query::default(),
            compensate: Compensate::default(),
            curves: None,
            std_um: None,
        }
    }
}

/// What is always fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Declared {
    /// Displacement and rotation.
    Rigid,
    /// Displacement.
    Translation,
}

/// A linear axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum Letter {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

/// The covariance of the field.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Kriging {
    /// Its family, or `auto`: the most likely one.
    #[serde(default)]
    pub variogram: Variogram,
    /// Standard deviation of the field, in µm. With `range_mm`: nothing is estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sill_um: Option<f64>,
    /// Ranges along x, y, z, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_mm: Option<[f64; 3]>,
    /// Standard deviation of what differs from place to place, in µm: noise, where that is not known from elsewhere. 0 without it,
    /// where sill and ranges are given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nugget_um: Option<f64>,
    /// Distinct places up to which all are used at once. Above, each prediction uses the nearest ones.
    #[serde(default = "full_places")]
    pub full_places: usize,
}

impl Default for Kriging {
    fn default() -> Self {
        Self { variogram: Variogram::Auto, sill_um: None, range_mm: None, nugget_um: None, full_places: full_places() }
    }
}

/// A family of covariances.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Variogram {
    /// The most likely one.
    #[default]
    Auto,
    /// exp(−d), d the distance in ranges.
    Exponential,
    /// exp(−d²/2).
    Gaussian,
    /// 1 − 1.5 d + 0.5 d³, 0 from the range on.
    Spherical,
    /// (1 + √3 d) exp(−√3 d).
    #[serde(rename = "matern-3/2")]
    Matern32,
    /// (1 + √5 d + 5 d²/3) exp(−√5 d).
    #[serde(rename = "matern-5/2")]
    Matern52,
}

impl Variogram {
    /// The family; `None` where it is to be found.
    #[must_use]
    pub fn family(self) -> Option<Family> {
        match self {
            Self::Auto => None,
            Self::Exponential => Some(Family::Exponential),
            Self::Gaussian => Some(Family::Gaussian),
            Self::Spherical => Some(Family::Spherical),
            Self::Matern32 => Some(Family::Matern32),
            Self::Matern52 => Some(Family::Matern52),
        }
    }
}

/// How to compensate.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Compensate {
    /// File with the axes that correct: `axes = [{ id = "X", kind = "linear", direction = [1, 0, 0] }, …]`, from the base to the
    /// tool. X, Y and Z without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<PathBuf>,
    /// Largest correction of a linear axis, in µm, where the axis has none of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_um: Option<f64>,
}

fn rigid() -> Vec<Declared> {
    vec![Declared::Rigid]
}

fn xyz() -> [Letter; 3] {
    [Letter::X, Letter::Y, Letter::Z]
}

fn full_places() -> usize {
    3000
}

/// Places that one covariance matrix may hold: three factors, their inverses and two copies stay below 2 GB.
const FULL_PLACES: std::ops::RangeInclusive<usize> = 100..=5000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxesFile {
    axes: Vec<Axis>,
}

impl Kriging {
    /// The covariance, where it is given.
    #[must_use]
    pub fn fixed(&self) -> Option<Covariance> {
        Some(Covariance {
            family: self.variogram.family()?,
            sill_um: self.sill_um?,
            range_mm: self.range_mm?,
            nugget_um: self.nugget_um.unwrap_or(0.0),
        })
    }

    fn check(&self) -> Result<(), Fault> {
        let above = |key: &str, value: f64, least: bool, unit: &str| {
            let right = value.is_finite() && (value > 0.0 || (least && value == 0.0));
            let bound = if least { "0 or above" } else { "above 0" };
            if right {
                Ok(())
            } else {
                Err(Fault::at(key, format!("expected a number of {unit} {bound}, found {value}")))
            }
        };
        if let Some(sill_um) = self.sill_um {
            above("sill_um", sill_um, false, "µm")?;
        }
        for range_mm in self.range_mm.iter().flatten() {
            above("range_mm", *range_mm, false, "mm")?;
        }
        if let Some(nugget_um) = self.nugget_um {
            above("nugget_um", nugget_um, true, "µm")?;
        }
        if !FULL_PLACES.contains(&self.full_places) {
            let (from, to) = (FULL_PLACES.start(), FULL_PLACES.end());
            let message = format!("expected a number of places from {from} to {to}, found {}", self.full_places);
            return Err(Fault::at("full_places", message));
        }
        let given = [self.sill_um.is_some(), self.range_mm.is_some(), self.nugget_um.is_some()];
        if given == [false; 3] {
            return Ok(());
        }
        let keys = ["sill_um", "range_mm", "nugget_um"];
        let first = keys[given.iter().position(|given| *given).unwrap_or(0)];
        if self.variogram == Variogram::Auto {
            let message = "a covariance that is given needs its family in `variogram`, and that is `auto`";
            return Err(
                Fault::at(first, message).help("take one of exponential, gaussian, spherical, matern-3/2, matern-5/2")
            );
        }
        if !(given[0] && given[1]) {
            let message =
                "a covariance is given by `variogram`, `sill_um`, `range_mm` and `nugget_um`, or estimated as a whole";
            return Err(Fault::at(first, message));
        }
        Ok(())
    }
}

impl SpatialErrorConfig {
    /// Columns of the declared trend.
    #[must_use]
    pub fn declared_terms(&self) -> Vec<Term> {
        let shifts = [0, 1, 2].map(Term::Shift);
        if self.declared.contains(&Declared::Rigid) {
            shifts.into_iter().chain([0, 1, 2].map(Term::Turn)).collect()
        } else if self.declared.contains(&Declared::Translation) {
            shifts.to_vec()
        } else {
            Vec::new()
        }
    }

    /// Indices of the chain's axes.
    #[must_use]
    pub fn chain_axes(&self) -> [usize; 3] {
        self.chain.map(|letter| letter as usize)
    }

    /// Checks the values and reads the file of axes.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn checked(&self, context: &Context) -> Result<Chain, Fault> {
        self.kriging.check().map_err(|fault| fault.under("kriging"))?;
        if let Some(index) = self.tool_mm.iter().position(|value| !value.is_finite()) {
            return Err(Fault::at("tool_mm", format!("expected lengths in mm, found {}", self.tool_mm[index])));
        }
        if let Some(value) = self.pitch_mm.iter().find(|value| !(value.is_finite() && **value >= 0.0)) {
            return Err(Fault::at(
                "pitch_mm",
                format!("expected periods in mm, 0 where one is not known, found {value}"),
            ));
        }
        let mut axes = self.chain_axes();
        axes.sort_unstable();
        if axes != [0, 1, 2] {
            return Err(Fault::at("chain", "expected X, Y and Z, each once, from the base to the tool"));
        }
        if let Some(std_um) = self.std_um.filter(|std_um| !(std_um.is_finite() && *std_um > 0.0)) {
            return Err(Fault::at("std_um", format!("the uncertainty must be above 0 µm, found {std_um}")));
        }
        let pitch_mm = self.curves.map_or([1.0; 3], |curves| curves.pitch_mm);
        if let Some(pitch) = pitch_mm.iter().find(|pitch| !(pitch.is_finite() && **pitch > 0.0)) {
            let fault = Fault::at("pitch_mm", format!("distances of nodes are above 0 mm, found {pitch}"));
            return Err(fault.under("curves"));
        }
        self.query.check().map_err(|fault| fault.under("query"))?;
        self.compensate.chain(self, context).map_err(|fault| fault.under("compensate"))
    }
}

impl Compensate {
    fn chain(&self, config: &SpatialErrorConfig, context: &Context) -> Result<Chain, Fault> {
        if let Some(limit) = self.limit_um.filter(|limit| !(limit.is_finite() && *limit > 0.0)) {
            return Err(Fault::at("limit_um", format!("the limit must be above 0 µm, found {limit}")));
        }
        let axes = match &self.axes {
            None => Axis::xyz(config.chain_axes()),
            Some(path) => {
                let path = context.path(path);
                let object = path.display();
                let refuse = |problem: String| Fault::at("axes", format!("cannot read {object}: {problem}"));
                let text = runout_core::input_file::read_text(&path).map_err(|error| refuse(error.to_string()))?;
                let file: AxesFile = toml::from_str(&text).map_err(|error| refuse(error.to_string()))?;
                file.axes
            }
        };
        Chain::new(axes, self.limit_um, config.tool_mm).map_err(|problem| Fault::at("axes", problem))
    }
}

/// Universal kriging of the spatial error, and its compensation.
#[derive(Debug, Clone)]
pub struct SpatialError {
    pub(crate) config: SpatialErrorConfig,
    pub(crate) chain: Chain,
    pub(crate) query: Query,
}
