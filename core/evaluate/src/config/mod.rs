//! `[evaluate]`: which of the standards' values a run gives.

mod areal;
mod check;
mod groups;
mod motion;
mod names;
mod texture;

pub use areal::{ArealFilter, FormRemoval};
pub use groups::Group;

use areal::ArealConfig;
use groups::Groups;
use motion::{CentreConfig, FacePlaceConfig};
use texture::TextureConfig;

use areal::Areal;
use groups::GroupsSchema;
use schemars::JsonSchema;
use serde::Deserialize;
use texture::Texture;

use super::{Limit, Orders};
use crate::error_motion::{self, Centre};
use crate::evaluable::EvaluableKind;
use runout_numerics::filter::Kind as FilterKind;
use runout_standards::roundness::Reference;
use runout_turning::{
    azimuth::{Azimuth, FacePlace},
    rig::Rig,
};

/// `[evaluate]`: which of the standards' values a run gives, and how.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EvaluateConfig {
    /// Groups of values, or "all"; without it `roundness`, `straightness`, `texture`, `cylindricity` and `error-motion`, as far as what
    /// the separator offers gives them; `run-out` where nothing is separated. Of "all", what a run cannot give (areal values and twist of a single section) is left out.
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
    /// What texture values are of, besides λs and λc.
    #[serde(default)]
    pub texture: TextureConfig,
    /// How areal and twist values are made of the surface, besides λs and λc.
    #[serde(default)]
    pub areal: ArealConfig,
}

/// What to evaluate, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluate {
    groups: Vec<Group>,
    /// Whether there are closed profiles to evaluate.
    of_closed: bool,
    /// Whether single turns of the axis are known.
    of_turns: bool,
    /// Whether all groups were asked for, and none by its name.
    pub all: bool,
    pub(super) references: Vec<Reference>,
    filter_upr: Option<Vec<f64>>,
    filter: FilterKind,
    high_pass_upr: Option<f64>,
    pub(super) robust_filter_upr: Vec<f64>,
    pub(super) slope_window_deg: Option<f64>,
    pub(super) harmonics_upr: usize,
    pub(super) datum: Vec<String>,
    pub(super) lambda_c_mm: Option<f64>,
    pub(super) lambda_s_mm: Option<f64>,
    /// Centres of polar plots.
    pub centres: Vec<Centre>,
    pub(super) texture: Texture,
    pub(super) areal: Areal,
    /// Chosen radial directions.
    pub directions: Vec<Azimuth>,
    /// Chosen places on faces.
    pub faces: Vec<FacePlace>,
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
            of_turns: true,
            all: false,
            references: vec![Reference::LeastSquares, Reference::MinimumZone],
            filter_upr: None,
            filter: FilterKind::Gaussian,
            high_pass_upr: None,
            robust_filter_upr: Vec::new(),
            slope_window_deg: None,
            harmonics_upr: 15,
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
    pub fn add_faces(&mut self, rig: &Rig) {
        let turned_rad = rig.setups.first().map_or(0.0, |setup| setup.sensors_rad);
        let off_axis = rig.sensors.iter().filter_map(|sensor| {
            let radius_mm = sensor.axial_radius_mm.filter(|radius_mm| *radius_mm > 0.0)?;
            Some(FacePlace::of(radius_mm, sensor.angle_rad + turned_rad))
        });
        self.faces.extend(off_axis);
        self.faces = once_each(std::mem::take(&mut self.faces));
    }

    /// Adds areal values, which are asked for by name otherwise.
    pub fn add_areal(&mut self) {
        self.groups.push(Group::Areal);
    }

    /// Adds values of the readings, which are asked for by name where something is separated.
    pub fn add_run_out(&mut self) {
        self.groups.push(Group::RunOut);
    }

    /// Leaves only what is computed from these.
    pub fn keep_given(&mut self, given: &[EvaluableKind]) {
        self.groups.retain(|group| group.is_given_by(given));
        self.of_closed = given.contains(&EvaluableKind::ClosedProfiles);
        self.of_turns = given.contains(&EvaluableKind::TurnSpread);
        if !self.of_closed && self.areal.form == FormRemoval::Cylinder {
            self.areal.form = FormRemoval::Plane;
        }
    }

    /// Adds the amplitudes that a limit of these orders needs.
    pub fn add_amplitudes(&mut self, orders: Orders) {
        if self.of_closed && !self.has(Group::Harmonics) {
            self.groups.push(Group::Harmonics);
            self.harmonics_upr = orders.last;
        }
        self.harmonics_upr = self.harmonics_upr.max(orders.last);
    }

    /// One more limit.
    pub fn add_limit(&mut self, limit: Limit) {
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
