//! `[evaluate]`: which of the standards' values a run gives.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    filter::{Filter, between_name, robust_name},
    limit::Limit,
};
use crate::{
    evaluate::{
        areal,
        error_motion::{self, Centre},
        roundness::Reference,
        texture,
    },
    numerics::filter::Kind,
    pipeline::error::Fault,
};

/// `[evaluate]`: which of the standards' values a run gives, and how.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluateConfig {
    /// Groups of values; without it `roundness`, `texture`, `cylindricity` and `error-motion`.
    pub values: Option<Vec<Group>>,
    /// Reference circles of roundness; those of cylindricity follow them (LSCY, MZCY, MICY, MCCY). Without it LSCI and
    /// MZCI.
    pub references: Option<Vec<Reference>>,
    /// Cut-offs of the Gaussian low-pass (ISO 16610-21) for roundness and cylindricity, in undulations per revolution, as
    /// 15, 50, 150, 500, 1500. Unfiltered values are always there besides. Without it 50, where the orders reach it.
    pub filter_upr: Option<Vec<f64>>,
    /// Kind of the filters of `filter_upr` and `high_pass_upr`; without it `gaussian`.
    pub filter: Option<Kind>,
    /// Cut-off of a high-pass in undulations per revolution, which makes a band of each filter of `filter_upr`; unfiltered values stay.
    pub high_pass_upr: Option<f64>,
    /// Cut-offs of robust Gaussian low-passes (ISO 16610-31) for roundness, in undulations per revolution, besides `filter_upr`.
    pub robust_filter_upr: Option<Vec<f64>>,
    /// Window, in degrees up to 180, over which `roundness` gives the largest change of the profile, `slope`.
    pub slope_window_deg: Option<f64>,
    /// Highest order of `harmonics`; without it 15.
    pub harmonics_upr: Option<usize>,
    /// Sections, or stations of sections, whose least-squares centres make the datum axis of eccentricity, coaxiality and run-out
    /// of the other sections (with `cylindricity`, where centres are known); one section makes an axis along z.
    pub datum: Option<Vec<String>>,
    /// λc, the longest wavelength of texture and areal values, in mm; it makes Rq, Rp, Rv, Rz, Rt, Rsk, Rku, Rsm and Rdq
    /// besides the unfiltered Ra.
    pub lambda_c_mm: Option<f64>,
    /// λs, the shortest, in mm.
    pub lambda_s_mm: Option<f64>,
    /// Centres of polar plots that error motion values are about; without it LSC.
    pub centres: Option<Vec<CentreConfig>>,
}

/// A centre of a polar plot (ISO 230-7) as it stands in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "UPPERCASE")]
pub enum CentreConfig {
    /// The centre of the polar chart.
    Pc,
    /// Least squares.
    Lsc,
    /// Minimum zone; other texts call it MRS.
    Mzc,
    /// Maximum inscribed circle.
    Mic,
    /// Minimum circumscribed circle.
    Mcc,
}

impl From<CentreConfig> for Centre {
    fn from(centre: CentreConfig) -> Self {
        match centre {
            CentreConfig::Pc => Self::PolarChart,
            CentreConfig::Lsc => Self::Plot(Reference::LeastSquares),
            CentreConfig::Mzc => Self::Plot(Reference::MinimumZone),
            CentreConfig::Mic => Self::Plot(Reference::MaximumInscribed),
            CentreConfig::Mcc => Self::Plot(Reference::MinimumCircumscribed),
        }
    }
}

/// Values that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// RONt about each reference; RONp, RONv, RONq and the steepest slope dr/dθ about LSCI; of each section.
    Roundness,
    /// Amplitude and phase of each order from 2 on of each section's form.
    Harmonics,
    /// Ra of each section's unfiltered profile; with λc the values of ISO 21920-2.
    Texture,
    /// CYLt about each reference, CYLp, CYLv, CYLq about LSCY, of all sections together.
    Cylindricity,
    /// ISO 25178-2 on the surface without its least-squares cylinder.
    Areal,
    /// ISO 230-7, of each station.
    ErrorMotion,
}

/// What to evaluate, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluate {
    groups: Vec<Group>,
    pub(super) references: Vec<Reference>,
    filter_upr: Option<Vec<f64>>,
    filter: Kind,
    high_pass_upr: Option<f64>,
    pub(super) robust_filter_upr: Vec<f64>,
    pub(super) slope_window_deg: Option<f64>,
    pub(super) harmonics_upr: usize,
    pub(super) datum: Vec<String>,
    pub(super) lambda_c_mm: Option<f64>,
    pub(super) lambda_s_mm: Option<f64>,
    pub(in crate::pipeline) centres: Vec<Centre>,
    limits: Vec<Limit>,
}

impl Default for Evaluate {
    fn default() -> Self {
        Self {
            groups: vec![Group::Roundness, Group::Texture, Group::Cylindricity, Group::ErrorMotion],
            references: vec![Reference::LeastSquares, Reference::MinimumZone],
            filter_upr: None,
            filter: Kind::Gaussian,
            high_pass_upr: None,
            robust_filter_upr: Vec::new(),
            slope_window_deg: None,
            harmonics_upr: 15,
            datum: Vec::new(),
            lambda_c_mm: None,
            lambda_s_mm: None,
            centres: vec![error_motion::CENTRE],
            limits: Vec::new(),
        }
    }
}

/// The cut-off where nothing is said, in undulations per revolution.
const USUAL_UPR: f64 = 50.0;

impl EvaluateConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(in crate::pipeline) fn check(self) -> Result<Evaluate, Fault> {
        for (key, cutoffs) in [("filter_upr", &self.filter_upr), ("robust_filter_upr", &self.robust_filter_upr)] {
            for (index, cutoff) in cutoffs.iter().flatten().enumerate() {
                if !(cutoff.is_finite() && *cutoff > 0.0) {
                    let fault = Fault::here(format!("the cut-off must be above 0 undulations a turn, found {cutoff}"));
                    return Err(fault.under_item(key, index));
                }
            }
        }
        for (key, wavelength) in [("lambda_c_mm", self.lambda_c_mm), ("lambda_s_mm", self.lambda_s_mm)] {
            match wavelength {
                Some(length) if !(length.is_finite() && length > 0.0) => {
                    return Err(Fault::at(key, format!("the wavelength must be above 0 mm, found {length}")));
                }
                _ => {}
            }
        }
        if let Some(cutoff) = self.high_pass_upr {
            if !(cutoff.is_finite() && cutoff > 0.0) {
                let message = format!("the cut-off must be above 0 undulations a turn, found {cutoff}");
                return Err(Fault::at("high_pass_upr", message));
            }
            let low_passes = self.filter_upr.as_deref().unwrap_or(&[USUAL_UPR]);
            if let Some(below) = low_passes.iter().find(|below| **below <= cutoff) {
                let message = format!("the high-pass must be below the low-pass at {below}, found {cutoff}");
                return Err(Fault::at("high_pass_upr", message));
            }
        }
        if let Some(window) = self.slope_window_deg.filter(|window| !(*window > 0.0 && *window <= 180.0)) {
            let message = format!("the window must be above 0° and at most 180°, found {window}");
            return Err(Fault::at("slope_window_deg", message));
        }
        if matches!(&self.datum, Some(datum) if datum.is_empty()) {
            return Err(Fault::at("datum", "expected at least one section"));
        }
        match (self.lambda_s_mm, self.lambda_c_mm) {
            (Some(shortest), Some(longest)) if shortest >= longest => {
                let message = format!("λs must be shorter than λc = {longest} mm, found {shortest}");
                return Err(Fault::at("lambda_s_mm", message));
            }
            (Some(_), None) => {
                return Err(Fault::at("lambda_s_mm", "λs alone makes no texture").help("add `lambda_c_mm`"));
            }
            _ => {}
        }
        if matches!(&self.references, Some(references) if references.is_empty()) {
            return Err(Fault::at("references", "expected at least one of LSCI, MZCI, MICI, MCCI"));
        }
        if matches!(&self.centres, Some(centres) if centres.is_empty()) {
            return Err(Fault::at("centres", "expected at least one of PC, LSC, MZC, MIC, MCC"));
        }
        let usual = Evaluate::default();
        Ok(Evaluate {
            groups: self.values.unwrap_or(usual.groups),
            references: once_each(self.references.unwrap_or(usual.references)),
            filter_upr: self.filter_upr.map(once_each),
            filter: self.filter.unwrap_or_default(),
            high_pass_upr: self.high_pass_upr,
            robust_filter_upr: once_each(self.robust_filter_upr.unwrap_or_default()),
            slope_window_deg: self.slope_window_deg,
            harmonics_upr: self.harmonics_upr.unwrap_or(usual.harmonics_upr),
            datum: once_each(self.datum.unwrap_or_default()),
            lambda_c_mm: self.lambda_c_mm,
            lambda_s_mm: self.lambda_s_mm,
            centres: self
                .centres
                .map_or(usual.centres, |centres| once_each(centres.into_iter().map(Centre::from).collect())),
            limits: Vec::new(),
        })
    }
}

fn once_each<T: PartialEq>(items: Vec<T>) -> Vec<T> {
    let mut kept = Vec::new();
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}

impl Evaluate {
    /// The peak-to-valley about LSCI alone, for comparisons.
    #[must_use]
    pub fn ront() -> Self {
        Self {
            groups: vec![Group::Roundness],
            references: vec![Reference::LeastSquares],
            filter_upr: Some(Vec::new()),
            ..Self::default()
        }
    }

    /// The first peak-to-valley of a section that these give, unfiltered, and nothing else; about LSCI where they give none.
    #[must_use]
    pub fn first_ront(&self) -> Self {
        let first = self.references.first().filter(|_| self.has(Group::Roundness)).copied();
        Self { references: vec![first.unwrap_or(Reference::LeastSquares)], ..Self::ront() }
    }

    /// Nothing.
    #[must_use]
    pub fn nothing() -> Self {
        Self { groups: Vec::new(), ..Self::default() }
    }

    pub(in crate::pipeline) fn add_limit(&mut self, limit: Limit) {
        self.limits.push(limit);
    }

    /// What values have to keep.
    #[must_use]
    pub fn limits(&self) -> &[Limit] {
        &self.limits
    }

    /// Whether a group of values is asked for.
    #[must_use]
    pub fn has(&self, group: Group) -> bool {
        self.groups.contains(&group)
    }

    /// Cut-offs for orders up to `highest`; `None` is no filter.
    pub(super) fn cutoffs_upr(&self, highest: usize) -> Vec<Option<f64>> {
        let usual: &[f64] = if highest as f64 >= USUAL_UPR { &[USUAL_UPR] } else { &[] };
        let cutoffs = self.filter_upr.as_deref().unwrap_or(usual);
        std::iter::once(None).chain(cutoffs.iter().copied().map(Some)).collect()
    }

    /// The filter of roundness and cylindricity with a cut-off; `None` is no filter.
    pub(super) fn low_pass(&self, cutoff_upr: Option<f64>) -> Filter {
        Filter::round(self.filter, cutoff_upr.and(self.high_pass_upr), cutoff_upr)
    }

    /// Names of the filters that values may have.
    pub(super) fn filter_names(&self) -> Vec<String> {
        let cutoffs = self.filter_upr.as_deref().unwrap_or(&[USUAL_UPR]);
        let round = std::iter::once(None).chain(cutoffs.iter().copied().map(Some));
        let round = round.map(|cutoff| self.low_pass(cutoff).name);
        let robust = self.robust_filter_upr.iter().map(|cutoff| robust_name(*cutoff));
        once_each(round.chain(robust).chain([between_name(self.lambda_s_mm, self.lambda_c_mm)]).collect())
    }

    /// Symbols and units of the values that may come.
    pub(super) fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        let mut symbols = Vec::new();
        if self.has(Group::Roundness) {
            symbols.extend(["RONt", "RONp", "RONv", "RONq"].map(|symbol| (symbol, "µm")));
            symbols.push(("dr/dtheta", "µm/°"));
            if self.slope_window_deg.is_some() {
                symbols.push(("slope", "µm"));
            }
        }
        if self.has(Group::Harmonics) {
            symbols.extend([("amplitude", "µm"), ("phase", "°")]);
        }
        if self.has(Group::Texture) {
            symbols.push(("Ra", "µm"));
            if self.lambda_c_mm.is_some() {
                symbols.extend(texture::PARAMETERS[1..].iter().map(|(symbol, unit, _)| (*symbol, *unit)));
            }
        }
        if self.has(Group::Cylindricity) {
            let names = ["CYLt", "CYLp", "CYLv", "CYLq", "CYLtt", "STRt", "coaxiality", "parallelism"];
            symbols.extend(names.map(|symbol| (symbol, "µm")));
            if !self.datum.is_empty() {
                symbols.extend(["eccentricity", "circular-run-out", "total-run-out"].map(|symbol| (symbol, "µm")));
            }
        }
        if self.has(Group::Areal) {
            symbols.extend(areal::PARAMETERS.iter().map(|(symbol, unit, _)| (*symbol, *unit)));
        }
        if self.has(Group::ErrorMotion) {
            symbols.extend(error_motion::SYMBOLS);
        }
        symbols
    }
}
