//! `[evaluate]`: which of the standards' values a run gives.
//!
//! Long because each key of `[evaluate]` is declared, checked and turned into what is computed in one place.

use schemars::JsonSchema;
use serde::{
    Deserialize, Deserializer,
    de::{SeqAccess, Unexpected, Visitor},
};

use super::{
    Limit,
    filter::{Filter, between_name, robust_name, waviness_name},
};
use crate::stage::EvaluableKind;
use runout_error::fault::{Fault, Place, known_names};
use runout_numerics::filter::Kind as FilterKind;
use runout_standards::{areal, roundness::Reference, texture::Kind, twist};
use runout_turning::{
    azimuth::{Azimuth, FacePlace},
    error_motion::{self, Centre},
    rig::Rig,
};

/// `[evaluate]`: which of the standards' values a run gives, and how.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EvaluateConfig {
    /// Groups of values, or "all"; without it `roundness`, `straightness`, `texture`, `cylindricity` and `error-motion`, as far as what
    /// the separator offers gives them. Of "all", what a run cannot give (areal values and twist of a single section) is left out.
    #[schemars(with = "Option<GroupsSchema>")]
    pub values: Option<Groups>,
    /// Reference circles of roundness; those of cylindricity follow them (LSCY, MZCY, MICY, MCCY), and the lines of straightness those
    /// two that there are (LSLI, MZLI). Without it LSCI and MZCI.
    pub references: Option<Vec<Reference>>,
    /// Cut-offs of the Gaussian low-pass (ISO 16610-21) for roundness and cylindricity, in undulations per revolution, as
    /// 15, 50, 150, 500, 1500. Unfiltered values are always there besides. Without it 50, where the orders reach it.
    pub filter_upr: Option<Vec<f64>>,
    /// Kind of the filters of `filter_upr` and `high_pass_upr`; without it `gaussian`.
    pub filter: Option<FilterKind>,
    /// Cut-off of a high-pass in undulations per revolution, which makes a band of each filter of `filter_upr`; unfiltered values stay.
    pub high_pass_upr: Option<f64>,
    /// Cut-offs of robust Gaussian low-passes (ISO 16610-31) for roundness, in undulations per revolution, besides `filter_upr`.
    pub robust_filter_upr: Option<Vec<f64>>,
    /// Window, in degrees up to 180, over which `roundness` gives the largest change of the profile, `slope`.
    pub slope_window_deg: Option<f64>,
    /// Highest order of `harmonics`, from 2 on; without it 15.
    pub harmonics_upr: Option<usize>,
    /// Sections, or stations of sections, whose least-squares centres make the datum axis of eccentricity, coaxiality and run-out
    /// of the other sections (with `cylindricity`, where centres are known); one section makes an axis along z.
    pub datum: Option<Vec<String>>,
    /// λc, the longest wavelength of texture and areal values, in mm; it makes the values of the roughness profile besides the
    /// unfiltered Ra.
    pub lambda_c_mm: Option<f64>,
    /// λs, the shortest, in mm.
    pub lambda_s_mm: Option<f64>,
    /// Centres of polar plots that error motion values are about; without it LSC.
    pub centres: Option<Vec<CentreConfig>>,
    /// Fixed sensitive directions of error motion besides x and y, in degrees from x towards y, above -360 and below 360:
    /// where the tool stands. A direction and its opposite are one, 0 to below 180°.
    pub directions_deg: Option<Vec<f64>>,
    /// Places of a face at which face error motion is evaluated, besides those of the rig's axial sensors off the axis: where
    /// a tool stands.
    pub faces: Option<Vec<FacePlaceConfig>>,
    /// How the errors of a profile become those of its roundness values; without it `linear`.
    pub uncertainty: Option<Propagation>,
    /// What texture values are of, besides λs and λc.
    #[serde(default)]
    pub texture: TextureConfig,
    /// How areal and twist values are made of the surface, besides λs and λc.
    #[serde(default)]
    pub areal: ArealConfig,
}

/// How the errors of a profile become those of its roundness values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Propagation {
    /// RONq in closed form, extremes from errors drawn at the points that may come to touch; whole profiles are drawn where this is not
    /// exact enough (an interruption, large errors, many such points).
    #[default]
    Linear,
    /// Whole profiles are drawn for all of them (JCGM 101:2008).
    MonteCarlo,
}

/// A place of a face.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FacePlaceConfig {
    /// Distance from the axis, in mm.
    pub radius_mm: f64,
    /// Angle from x towards y, in degrees.
    pub angle_deg: f64,
}

impl FacePlaceConfig {
    fn check(&self) -> Result<FacePlace, Fault> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            let message = format!("a place of a face is above 0 mm from the axis, found {}", self.radius_mm);
            return Err(Fault::at("radius_mm", message).help("on the axis, face error motion is axial error motion"));
        }
        if !self.angle_deg.is_finite() || self.angle_deg.abs() >= 360.0 {
            let message = format!("the angle must lie between -360 and 360 degrees, found {}", self.angle_deg);
            return Err(Fault::at("angle_deg", message));
        }
        Ok(FacePlace::of(self.radius_mm, self.angle_deg.to_radians()))
    }
}

/// `[evaluate.texture]`: which profiles have texture values, and what the standard leaves to the one who evaluates.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct TextureConfig {
    /// Profiles: R (roughness, λs to λc), P (primary, from λs on), W (waviness, λc to λf). Without it R. R and W need λc.
    pub profiles: Option<Vec<Kind>>,
    /// λf, the longest wavelength of W, in mm; without it W has all that is longer than λc.
    pub lambda_f_mm: Option<f64>,
    /// Heights above the mean line, in µm, at which the material ratio Rmr(c), Pmr(c), Wmr(c) is given.
    pub heights_um: Option<Vec<f64>>,
    /// Material ratios p and q of Rdc, Pdc, Wdc, in %; without it 20 and 80.
    pub rdc_percent: Option<[f64; 2]>,
    /// Angles of the part, in degrees, at which the profiles are taken along the axis too, from section to section.
    pub generatrices_deg: Option<Vec<f64>>,
}

/// `[evaluate.areal]`: form removal, filter and material ratios of areal values.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ArealConfig {
    /// F-operator: what is taken off before the filters; without it `cylinder`.
    pub form: Option<FormRemoval>,
    /// Degree of `polynomial` along the axis, 0 to 8; without it 2.
    pub degree: Option<usize>,
    /// The filter of λs and λc; without it `gaussian`.
    pub filter: Option<ArealFilter>,
    /// Heights above the mean, in µm, at which the material ratio Smr(c) is given.
    pub heights_um: Option<Vec<f64>>,
    /// Material ratios, in %, at which the height Smc(p) above the mean is given.
    pub ratios_percent: Option<Vec<f64>>,
}

/// What the F-operator takes off a wall, by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FormRemoval {
    /// Nothing but the mean.
    None,
    /// A line along the axis, the same all around: radius and taper. Of a height map its plane, without the key.
    Plane,
    /// A cylinder: radius, place and tilt of its axis.
    Cylinder,
    /// A cone: a cylinder and its taper.
    Cone,
    /// A body whose radius and centre are polynomials along the axis. Of a height map a polynomial in x and y of a total degree.
    Polynomial,
}

/// The filter of areal values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ArealFilter {
    /// ISO 16610-61.
    #[default]
    Gaussian,
    /// ISO 16610-71: scratches and grooves do not pull it. It states no uncertainty.
    RobustGaussian,
}

impl ArealConfig {
    fn check(self) -> Result<Areal, Fault> {
        let usual = Areal::default();
        let degree = self.degree.unwrap_or(usual.degree);
        if degree > HIGHEST_DEGREE {
            return Err(Fault::at("degree", format!("expected a degree from 0 to {HIGHEST_DEGREE}, found {degree}")));
        }
        if self.degree.is_some() && self.form != Some(FormRemoval::Polynomial) {
            return Err(Fault::at("degree", "only a polynomial has a degree").help("set `form = \"polynomial\"`"));
        }
        let (heights_um, ratios_percent) =
            (self.heights_um.unwrap_or_default(), self.ratios_percent.unwrap_or_default());
        if let Some((index, height)) = heights_um.iter().enumerate().find(|(_, height)| !height.is_finite()) {
            let fault = Fault::here(format!("expected a finite height in µm, found {height}"));
            return Err(fault.under_item("heights_um", index));
        }
        if let Some((index, ratio)) =
            ratios_percent.iter().enumerate().find(|(_, ratio)| !(0.0..=100.0).contains(*ratio))
        {
            let fault = Fault::here(format!("expected a material ratio from 0 to 100 %, found {ratio}"));
            return Err(fault.under_item("ratios_percent", index));
        }
        let (form, filter) = (self.form.unwrap_or(usual.form), self.filter.unwrap_or_default());
        Ok(Areal { form, degree, filter, heights_um, ratios_percent })
    }
}

/// Highest degree of a polynomial form.
const HIGHEST_DEGREE: usize = 8;

/// How areal values are made of the surface, checked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Areal {
    pub form: FormRemoval,
    pub degree: usize,
    pub filter: ArealFilter,
    pub heights_um: Vec<f64>,
    pub ratios_percent: Vec<f64>,
}

impl Default for Areal {
    fn default() -> Self {
        let (heights_um, ratios_percent) = (Vec::new(), Vec::new());
        Self { form: FormRemoval::Cylinder, degree: 2, filter: ArealFilter::Gaussian, heights_um, ratios_percent }
    }
}

impl TextureConfig {
    fn check(self, lambda_s_mm: Option<f64>, lambda_c_mm: Option<f64>) -> Result<Texture, Fault> {
        let usual = Texture::default();
        let profiles = once_each(self.profiles.unwrap_or_else(|| usual.profiles.clone()));
        if profiles.is_empty() {
            return Err(Fault::at("profiles", "expected at least one of R, P, W"));
        }
        if lambda_c_mm.is_none() && profiles.contains(&Kind::W) {
            return Err(Fault::at("profiles", "a waviness profile needs λc").help("add `lambda_c_mm` to [evaluate]"));
        }
        if lambda_s_mm.is_some() && lambda_c_mm.is_none() && !profiles.contains(&Kind::P) {
            let help = "add `lambda_c_mm`, or P to `profiles` in [evaluate.texture]";
            return Err(Fault::here("λs alone makes no roughness profile").help(help));
        }
        if let Some(longest) = self.lambda_f_mm {
            let shortest = lambda_c_mm.unwrap_or(0.0);
            if !(longest.is_finite() && longest > shortest) {
                let message = format!("λf must be longer than λc = {shortest} mm, found {longest}");
                return Err(Fault::at("lambda_f_mm", message));
            }
        }
        let heights_um = self.heights_um.unwrap_or_default();
        if let Some((index, height)) = heights_um.iter().enumerate().find(|(_, height)| !height.is_finite()) {
            let fault = Fault::here(format!("expected a finite height in µm, found {height}"));
            return Err(fault.under_item("heights_um", index));
        }
        let generatrices_deg = once_each(self.generatrices_deg.unwrap_or_default());
        if let Some((index, angle)) = generatrices_deg.iter().enumerate().find(|(_, angle)| !angle.is_finite()) {
            let fault = Fault::here(format!("expected an angle in degrees, found {angle}"));
            return Err(fault.under_item("generatrices_deg", index));
        }
        let difference_percent = self.rdc_percent.unwrap_or(usual.difference_percent);
        let [upper, lower] = difference_percent;
        if !(upper >= 0.0 && upper < lower && lower <= 100.0) {
            let message = format!("expected two material ratios from 0 to 100 %, ascending, found {upper} and {lower}");
            return Err(Fault::at("rdc_percent", message));
        }
        Ok(Texture { profiles, lambda_f_mm: self.lambda_f_mm, heights_um, difference_percent, generatrices_deg })
    }
}

/// What texture values are of, checked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Texture {
    pub profiles: Vec<Kind>,
    pub lambda_f_mm: Option<f64>,
    pub heights_um: Vec<f64>,
    pub difference_percent: [f64; 2],
    pub generatrices_deg: Vec<f64>,
}

impl Default for Texture {
    fn default() -> Self {
        let (heights_um, generatrices_deg) = (Vec::new(), Vec::new());
        Self {
            profiles: vec![Kind::R],
            lambda_f_mm: None,
            heights_um,
            difference_percent: [20.0, 80.0],
            generatrices_deg,
        }
    }
}

/// A centre of a polar plot (ISO 230-7) as it stands in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "UPPERCASE")]
#[non_exhaustive]
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
#[non_exhaustive]
pub enum Group {
    /// RONt about each reference; RONp, RONv, RONq and the steepest slope dr/dθ about LSCI; of each section.
    Roundness,
    /// Amplitude and phase of each order from 2 on of each section's form.
    Harmonics,
    /// STRt about LSLI and MZLI; STRp, STRv and STRq about LSLI; of open profiles.
    Straightness,
    /// Ra of each section's unfiltered profile; with λc the values of ISO 21920-2, of the profiles in [evaluate.texture].
    /// Of open profiles the latter.
    Texture,
    /// CYLt about each reference, CYLp, CYLv, CYLq about LSCY, of all sections together.
    Cylindricity,
    /// ISO 25178-2 on the surface without its form, which is a cylinder unless [evaluate.areal] says otherwise.
    Areal,
    /// Twist of a turned or ground shaft (MBN 31007-07): the strongest helix on the surface.
    Twist,
    /// ISO 230-7, of each station.
    ErrorMotion,
}

impl Group {
    /// All of them.
    const ALL: [Self; 8] = [
        Self::Roundness,
        Self::Harmonics,
        Self::Straightness,
        Self::Texture,
        Self::Cylindricity,
        Self::Areal,
        Self::Twist,
        Self::ErrorMotion,
    ];

    /// Its name in a file.
    fn name(self) -> &'static str {
        match self {
            Self::Roundness => "roundness",
            Self::Harmonics => "harmonics",
            Self::Straightness => "straightness",
            Self::Texture => "texture",
            Self::Cylindricity => "cylindricity",
            Self::Areal => "areal",
            Self::Twist => "twist",
            Self::ErrorMotion => "error-motion",
        }
    }
}

/// Groups of values as they stand in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Groups {
    /// "all".
    All,
    /// A list.
    Listed(Vec<Group>),
}

/// [`Groups`] for the schema.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is made")]
enum GroupsSchema {
    Word(All),
    Listed(Vec<Group>),
}

#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is made")]
enum All {
    All,
}

impl<'de> Deserialize<'de> for Groups {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words;

        impl<'de> Visitor<'de> for Words {
            type Value = Groups;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("\"all\" or a list of groups")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Groups, E> {
                if word == "all" { Ok(Groups::All) } else { Err(E::invalid_value(Unexpected::Str(word), &self)) }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Groups, A::Error> {
                let mut groups = Vec::new();
                while let Some(group) = items.next_element()? {
                    groups.push(group);
                }
                Ok(Groups::Listed(groups))
            }
        }

        deserializer.deserialize_any(Words)
    }
}

/// What to evaluate, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluate {
    groups: Vec<Group>,
    /// Whether there are closed profiles to evaluate.
    of_closed: bool,
    /// Whether all groups were asked for, and none by its name.
    pub(crate) all: bool,
    pub(super) references: Vec<Reference>,
    filter_upr: Option<Vec<f64>>,
    filter: FilterKind,
    high_pass_upr: Option<f64>,
    pub(super) robust_filter_upr: Vec<f64>,
    pub(super) slope_window_deg: Option<f64>,
    pub(super) harmonics_upr: usize,
    pub(super) propagation: Propagation,
    pub(super) datum: Vec<String>,
    pub(super) lambda_c_mm: Option<f64>,
    pub(super) lambda_s_mm: Option<f64>,
    pub(crate) centres: Vec<Centre>,
    pub(super) texture: Texture,
    pub(super) areal: Areal,
    pub(crate) directions: Vec<Azimuth>,
    pub(crate) faces: Vec<FacePlace>,
    limits: Vec<Limit>,
}

impl Default for Evaluate {
    fn default() -> Self {
        Self {
            groups: vec![
                Group::Roundness,
                Group::Straightness,
                Group::Texture,
                Group::Cylindricity,
                Group::ErrorMotion,
            ],
            of_closed: true,
            all: false,
            references: vec![Reference::LeastSquares, Reference::MinimumZone],
            filter_upr: None,
            filter: FilterKind::Gaussian,
            high_pass_upr: None,
            robust_filter_upr: Vec::new(),
            slope_window_deg: None,
            harmonics_upr: 15,
            propagation: Propagation::default(),
            datum: Vec::new(),
            lambda_c_mm: None,
            lambda_s_mm: None,
            centres: vec![error_motion::CENTRE],
            texture: Texture::default(),
            areal: Areal::default(),
            directions: Vec::new(),
            faces: Vec::new(),
            limits: Vec::new(),
        }
    }
}

/// The cut-off where nothing is said, in undulations per revolution.
const USUAL_UPR: f64 = 50.0;

/// Lowest order of `harmonics`: those below are level and centre, no form.
const LOWEST_HARMONIC: usize = 2;

impl EvaluateConfig {
    /// Refuses names of the datum that are no section of the rig that measures.
    ///
    /// # Errors
    /// The first of them.
    pub(crate) fn check_datum(&self, rig: &Rig) -> Result<(), Fault> {
        let unknown = |name: &&String| !rig.sections.contains(name);
        match self.datum.iter().flatten().enumerate().find(|(_, name)| unknown(name)) {
            Some((index, name)) => {
                let fault = Fault::here(format!("the rig has no section `{name}`"));
                let fault = fault.help(known_names(name, rig.sections.iter().map(String::as_str)));
                Err(fault.under_item("datum", index))
            }
            None => Ok(()),
        }
    }

    /// Refuses groups by name that nothing gives of what a separator offers, and forms that its height maps do not have.
    ///
    /// # Errors
    /// The first of them.
    pub(crate) fn check_given(&self, given: &[EvaluableKind]) -> Result<(), Fault> {
        let names = |kinds: &[EvaluableKind]| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
        if let Some(Groups::Listed(groups)) = &self.values
            && let Some((index, group)) = groups.iter().enumerate().find(|(_, group)| !group.is_given_by(given))
        {
            let message = format!("nothing here gives values of `{}`", group.name());
            let help =
                format!("they are computed from {}; the separator offers {}", names(group.sources()), names(given));
            return Err(Fault::here(message).help(help).under_item("values", index));
        }
        let asked = match &self.values {
            Some(Groups::Listed(groups)) => groups.contains(&Group::Straightness),
            Some(Groups::All) | None => true,
        };
        let lines = |references: &Vec<Reference>| references.iter().any(|one| one.line_symbol().is_some());
        let only_profiles = given == [EvaluableKind::OpenProfile];
        if asked && only_profiles && self.references.as_ref().is_some_and(|references| !lines(references)) {
            let fault = Fault::at("references", "an open profile has no reference line of these");
            return Err(fault.help("LSCI for the least-squares line LSLI, MZCI for the minimum-zone line MZLI"));
        }
        let of_maps = given.contains(&EvaluableKind::HeightMap) && !given.contains(&EvaluableKind::ClosedProfiles);
        if of_maps && matches!(self.areal.form, Some(FormRemoval::Cylinder | FormRemoval::Cone)) {
            let fault = Fault::at("form", "a height map on a plane is no wall of a cylinder");
            return Err(fault.help("none, plane or polynomial").under("areal"));
        }
        Ok(())
    }

    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn check(self) -> Result<Evaluate, Fault> {
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
        if let Some(highest) = self.harmonics_upr.filter(|highest| *highest < LOWEST_HARMONIC) {
            let message = format!("expected an order from {LOWEST_HARMONIC} on, found {highest}");
            return Err(Fault::at("harmonics_upr", message));
        }
        if matches!(&self.datum, Some(datum) if datum.is_empty()) {
            return Err(Fault::at("datum", "expected at least one section"));
        }
        match (self.lambda_s_mm, self.lambda_c_mm) {
            (Some(shortest), Some(longest)) if shortest >= longest => {
                let message = format!("λs must be shorter than λc = {longest} mm, found {shortest}");
                return Err(Fault::at("lambda_s_mm", message));
            }
            _ => {}
        }
        if matches!(&self.references, Some(references) if references.is_empty()) {
            return Err(Fault::at("references", "expected at least one of LSCI, MZCI, MICI, MCCI"));
        }
        if matches!(&self.centres, Some(centres) if centres.is_empty()) {
            return Err(Fault::at("centres", "expected at least one of PC, LSC, MZC, MIC, MCC"));
        }
        let texture = self.texture.check(self.lambda_s_mm, self.lambda_c_mm).map_err(|fault| match fault.place {
            // What is wrong of all keys together is that of λs.
            Place::Path(ref path) if path.is_empty() => fault.under("lambda_s_mm"),
            _ => fault.under("texture"),
        })?;
        for (index, direction) in self.directions_deg.iter().flatten().enumerate() {
            // A direction and its opposite are one, but a whole turn is a slip of the pen.
            if direction.is_nan() || direction.abs() >= 360.0 {
                let message = format!("the direction must lie between -360 and 360 degrees, found {direction}");
                return Err(Fault::here(message).under_item("directions_deg", index));
            }
        }
        let directions = self.directions_deg.unwrap_or_default();
        let faces = self
            .faces
            .unwrap_or_default()
            .into_iter()
            .enumerate()
            .map(|(index, place)| place.check().map_err(|fault| fault.under_item("faces", index)));
        let faces = faces.collect::<Result<Vec<FacePlace>, Fault>>()?;
        let usual = Evaluate::default();
        Ok(Evaluate {
            all: self.values == Some(Groups::All),
            of_closed: usual.of_closed,
            groups: match self.values {
                Some(Groups::All) => Group::ALL.to_vec(),
                Some(Groups::Listed(groups)) => groups,
                None => usual.groups,
            },
            references: once_each(self.references.unwrap_or(usual.references)),
            filter_upr: self.filter_upr.map(once_each),
            filter: self.filter.unwrap_or_default(),
            high_pass_upr: self.high_pass_upr,
            robust_filter_upr: once_each(self.robust_filter_upr.unwrap_or_default()),
            slope_window_deg: self.slope_window_deg,
            harmonics_upr: self.harmonics_upr.unwrap_or(usual.harmonics_upr),
            propagation: self.uncertainty.unwrap_or_default(),
            datum: once_each(self.datum.unwrap_or_default()),
            lambda_c_mm: self.lambda_c_mm,
            lambda_s_mm: self.lambda_s_mm,
            centres: self
                .centres
                .map_or(usual.centres, |centres| once_each(centres.into_iter().map(Centre::from).collect())),
            texture,
            areal: self.areal.check().map_err(|fault| fault.under("areal"))?,
            directions: once_each(
                directions.into_iter().map(|angle_deg| Azimuth::of(angle_deg.to_radians())).collect(),
            ),
            faces: once_each(faces),
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

    /// Adds the places of a rig's axial sensors off the axis, as they stand in its first setup.
    pub(crate) fn add_faces(&mut self, rig: &Rig) {
        let turned_rad = rig.setups.first().map_or(0.0, |setup| setup.sensors_rad);
        let off_axis = rig.sensors.iter().filter_map(|sensor| {
            let radius_mm = sensor.axial_radius_mm.filter(|radius_mm| *radius_mm > 0.0)?;
            Some(FacePlace::of(radius_mm, sensor.angle_rad + turned_rad))
        });
        self.faces.extend(off_axis);
        self.faces = once_each(std::mem::take(&mut self.faces));
    }

    /// Leaves only what is computed from these.
    pub(crate) fn keep_given(&mut self, given: &[EvaluableKind]) {
        self.groups.retain(|group| group.is_given_by(given));
        self.of_closed = given.contains(&EvaluableKind::ClosedProfiles);
        if !self.of_closed && self.areal.form == FormRemoval::Cylinder {
            self.areal.form = FormRemoval::Plane;
        }
    }

    pub(crate) fn add_limit(&mut self, limit: Limit) {
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

    /// Whether values are asked for that need the surface between the sections, or its rings.
    #[must_use]
    pub fn needs_surface(&self) -> bool {
        let generatrices = self.has(Group::Texture) && !self.texture.generatrices_deg.is_empty();
        generatrices || self.has(Group::Areal) || self.has(Group::Twist)
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
        let waviness = self.lambda_c_mm.map(|c| waviness_name(c, self.texture.lambda_f_mm));
        let between = [between_name(self.lambda_s_mm, self.lambda_c_mm), between_name(self.lambda_s_mm, None)];
        once_each(round.chain(robust).chain(between).chain(waviness).collect())
    }

    /// Symbols and units of the values that may come.
    pub(super) fn symbols(&self) -> Vec<(String, &'static str)> {
        let mut symbols: Vec<(&'static str, &'static str)> = Vec::new();
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
        if self.has(Group::Straightness) {
            symbols.extend(["STRt", "STRp", "STRv", "STRq"].map(|symbol| (symbol, "µm")));
        }
        if self.has(Group::Texture) {
            if self.of_closed {
                symbols.push(("Ra", "µm"));
            }
            for kind in &self.texture.profiles {
                if *kind == Kind::P || self.lambda_c_mm.is_some() {
                    symbols.extend(kind.parameters().iter().map(|(symbol, unit, _)| (*symbol, *unit)));
                    symbols.push((kind.material_ratio_symbol(), "%"));
                }
            }
        }
        if self.has(Group::Cylindricity) {
            let names = ["CYLt", "CYLp", "CYLv", "CYLq", "CYLtt", "STRsg", "STRsa", "coaxiality", "parallelism"];
            symbols.extend(names.map(|symbol| (symbol, "µm")));
            if !self.datum.is_empty() {
                symbols.extend(["eccentricity", "circular-run-out", "total-run-out"].map(|symbol| (symbol, "µm")));
            }
        }
        if self.has(Group::Areal) {
            symbols.extend(areal::PARAMETERS.iter().map(|(symbol, unit, _)| (*symbol, *unit)));
            symbols.extend([("Smr(c)", "%"), ("Smc(p)", "µm")]);
        }
        if self.has(Group::Twist) {
            symbols.extend(twist::PARAMETERS.iter().map(|(symbol, unit, _)| (*symbol, *unit)));
        }
        let mut symbols: Vec<(String, &'static str)> =
            symbols.into_iter().map(|(symbol, unit)| (symbol.to_owned(), unit)).collect();
        if self.has(Group::ErrorMotion) {
            symbols.extend(error_motion::symbols(&self.directions, &self.faces));
        }
        symbols
    }
}
