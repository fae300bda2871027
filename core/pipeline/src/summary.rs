//! What a run found, for people and programs.

mod reported;

pub use reported::ReportedValue;
use runout_evaluate::nan_for_null;
pub use runout_evaluate::{Decision, Limit, LimitSummary, LimitValue, PartSummary, PlacedValue, Value};

use std::{collections::BTreeMap, path::PathBuf};

use crate::report_head::ReportHead;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use runout_closed_loop::{correction::Correction, diagnosis};
use runout_consistency::{Check, Test, refuted_by};
use runout_evaluate::own;
use runout_turning::{
    provenance::Provenance,
    reading::ReadingValues,
    separation::{Assessment, Separation},
    surface::Meeting,
};

/// What a run found, for people and programs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// The pipeline's title.
    pub title: String,
    /// What the head of a report says; absent where the pipeline has no [report].
    #[serde(default, skip_serializing_if = "ReportHead::is_empty")]
    pub head: ReportHead,
    /// Enough to repeat the run.
    pub provenance: Provenance,
    /// Effects that the results are corrected for: what `diagnose` added, and what `[diagnose] known` declares. Those of a run
    /// have none.
    #[serde(default)]
    pub effects: Vec<Correction>,
    /// Orders that the layout cannot separate.
    pub lost_orders: LostOrders,
    /// One entry a station.
    pub stations: Vec<StationSummary>,
    /// Values of all sections together, where they were asked for and there are two sections or more.
    pub part: Option<PartSummary>,
    /// The limits of the pipeline, in their order, with what was found.
    pub limits: Vec<LimitSummary>,
    /// The surface, where one was built.
    pub surface: Option<SurfaceSummary>,
    /// Values of a domain that are not those of a form: of measured points.
    #[serde(default, skip_serializing_if = "Vec::is_empty", with = "own")]
    #[schemars(with = "Vec<own::OwnValue>")]
    pub values: Vec<Value>,
    /// The tests of the data on themselves: what was tested, what it found and what was done.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub consistency: Vec<Check>,
    /// Files written.
    pub outputs: Vec<PathBuf>,
    /// What the user should know: of the whole, then of each station, behind the station's name.
    pub warnings: Vec<String>,
    /// Those of `warnings` that say nothing wrong: what the layout cannot separate, what the result is made of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl Summary {
    /// Every value of form and motion: of sections, then of their station, station by station; the whole part's last.
    #[must_use]
    pub fn placed_values(&self) -> Vec<PlacedValue<'_>> {
        let mut all = Vec::new();
        for station in &self.stations {
            let name = Some(station.station.as_str());
            for section in &station.sections {
                let (id, z_mm) = (Some(section.section.as_str()), Some(section.z_mm));
                all.extend(section.values.iter().map(|value| PlacedValue { station: name, section: id, z_mm, value }));
            }
            let place = |value| PlacedValue { station: name, section: None, z_mm: Some(station.z_mm), value };
            all.extend(station.motion_values.iter().map(place));
        }
        let of_part = self.part.iter().flat_map(|part| &part.values);
        all.extend(of_part.map(|value| PlacedValue { station: None, section: None, z_mm: None, value }));
        all
    }

    /// Every value: of form and motion, then those of the domain.
    #[must_use]
    pub fn all_values(&self) -> Vec<PlacedValue<'_>> {
        self.placed_values().into_iter().chain(self.values.iter().map(Value::placed)).collect()
    }

    /// Marks the values of the whole part, where the data of one of its stations refute what is said of them.
    pub(crate) fn refute_part(&mut self) {
        let Some(by) = refuted_by(&self.consistency) else { return };
        let values = self.part.iter_mut().flat_map(|part| &mut part.values);
        values.for_each(|value| value.refuted_by = Some(by.clone()));
    }

    /// What refutes values of this result, each reason once with the number of values, and how many values there are.
    #[must_use]
    pub fn refuted(&self) -> (Vec<(&str, usize)>, usize) {
        let all = self.all_values();
        let mut reasons: Vec<(&str, usize)> = Vec::new();
        for reason in all.iter().filter_map(|placed| placed.value.refuted_by.as_deref()) {
            match reasons.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, count)) => *count += 1,
                None => reasons.push((reason, 1)),
            }
        }
        (reasons, all.len())
    }

    /// The warnings that are no notes: `--fail-on-warning` counts them.
    pub fn findings(&self) -> impl Iterator<Item = &String> {
        self.warnings.iter().filter(|warning| !self.notes.contains(warning))
    }
}

/// The observable ones of a domain's values that were there before the loop changed them.
#[must_use]
pub fn moved(before: &[Value], after: &[Value]) -> Vec<diagnosis::Moved> {
    let of = |value: &Value| {
        let before = before.iter().find(|one| one.id() == value.id())?;
        Some(diagnosis::Moved {
            value: value.symbol.clone(),
            section: value.of.clone(),
            before: before.number()?,
            after: value.number()?,
            std: value.std(),
            unit: value.unit.clone(),
            reference: value.reference.clone(),
            filter: value.filter.clone(),
            lost_orders: Vec::new(),
        })
    };
    after.iter().filter_map(of).collect()
}

/// Orders that cannot be separated.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LostOrders {
    /// At which a section's form is not observable.
    pub form: Vec<usize>,
    /// At which a motion is not observable.
    pub motion: Vec<usize>,
    /// Of other quantities of a domain, by their names.
    #[serde(flatten)]
    pub others: BTreeMap<String, Vec<usize>>,
}

impl From<diagnosis::LostOrders> for LostOrders {
    fn from(mut lost: diagnosis::LostOrders) -> Self {
        let mut take = |name: &str| lost.0.remove(name).unwrap_or_default();
        let (form, motion) = (take("form"), take("motion"));
        Self { form, motion, others: lost.0 }
    }
}

impl LostOrders {
    /// Adds what turned out to be lost at a station: a method may not know it before.
    pub(crate) fn add_those_of(&mut self, separation: &Separation) {
        for (unknown, quantity) in separation.unknowns.iter().enumerate() {
            self.add(quantity.is_form(), &separation.lost_orders(unknown));
        }
    }

    /// Adds orders at which a form or a motion turned out to be lost.
    pub(crate) fn add(&mut self, is_form: bool, orders: &[usize]) {
        let all = if is_form { &mut self.form } else { &mut self.motion };
        for order in orders {
            if let Err(place) = all.binary_search(order) {
                all.insert(place, *order);
            }
        }
    }
}

impl From<&Assessment> for LostOrders {
    fn from(assessment: &Assessment) -> Self {
        Self { form: assessment.lost_form_orders(), motion: assessment.lost_motion_orders(), others: BTreeMap::new() }
    }
}

/// One station of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StationSummary {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// What became of the turns, one entry a setup.
    pub captures: Vec<CaptureSummary>,
    /// Form, section by section.
    pub sections: Vec<SectionSummary>,
    /// The line along which all motion of this station is, where that is neither x nor y: its angle from x towards y, in
    /// degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_along_deg: Option<f64>,
    /// What the readings themselves have, one entry a setup and sensor: where no order of form is observable, and nothing else is
    /// known. Empty where form is separated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub readings: Vec<ReadingValues>,
    /// Where along the axis radial motion of this station is stated, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_z_mm: Option<f64>,
    /// Error motion values of the axis; empty where no spread over the turns is known.
    pub motion_values: Vec<Value>,
    /// Root mean square that the fit leaves of the readings, in µm; absent where nothing is redundant.
    pub residual_rms_um: Option<f64>,
    /// Its value expected from the covariance of the averages, in µm.
    pub expected_residual_rms_um: Option<f64>,
    /// Weighted residual per degree of freedom.
    pub chi2_per_dof: Option<f64>,
    /// Real degrees of freedom of the residual; absent where nothing is redundant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_dof: Option<usize>,
    /// Lowest and highest order at which a reading is redundant: those that the residual and chi squared are of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_orders: Option<[usize; 2]>,
    /// True error of the motions, where the recording carries the truth.
    pub truth: Option<MotionTruth>,
    /// What the user should know of this station; it is in the warnings of the whole too.
    pub warnings: Vec<String>,
}

impl Summary {
    /// Stations whose residual differs from that expected from the noise of their readings: those of a finding in `consistency`.
    pub fn misfits(&self) -> impl Iterator<Item = &StationSummary> + Clone {
        misfits(&self.stations, &self.consistency)
    }
}

/// Stations whose residual, as a whole or at an order, is refuted by one of these tests.
pub(crate) fn misfits<'a>(
    stations: &'a [StationSummary],
    checks: &'a [Check],
) -> impl Iterator<Item = &'a StationSummary> + Clone {
    let of_residual = |check: &&Check| check.refutes() && matches!(check.test, Test::Residual | Test::Alike);
    let refuted =
        move |station: &&StationSummary| checks.iter().filter(of_residual).any(|check| check.part == station.station);
    stations.iter().filter(refuted)
}

/// What became of one capture's turns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CaptureSummary {
    /// Id of the setup.
    pub setup: String,
    /// Whole turns between the first and the last mark.
    pub turns_recorded: usize,
    /// Turns in the average.
    pub turns_used: usize,
    /// "3 turns: start-up".
    pub trimmed: Vec<String>,
    /// Turns left out of the average, each with its reason.
    pub rejected: Vec<RejectedTurnSummary>,
    /// Mean speed of the turns used.
    pub speed_rpm: Option<f64>,
    /// Mean reading of each sensor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<LevelSummary>,
    /// Filters that the signal went through.
    pub filters: Vec<String>,
}

/// Mean reading of a sensor over the turns used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelSummary {
    /// Id of the sensor.
    pub sensor: String,
    /// In µm.
    pub mean_um: f64,
    /// Its standard uncertainty from the scatter of the turns, in µm; null below two turns.
    pub std_um: Option<f64>,
}

/// A turn that was left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RejectedTurnSummary {
    /// Counted from 0 at the capture's first mark.
    pub turn: usize,
    /// Sample at which it begins.
    pub start_sample: u64,
    /// Why.
    pub reason: String,
}

/// One section's form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SectionSummary {
    /// Its id in the rig.
    pub section: String,
    /// Its place, in mm.
    pub z_mm: f64,
    /// Root mean square of the form, in µm; null where nothing is separated.
    #[serde(deserialize_with = "nan_for_null")]
    #[schemars(with = "Option<f64>")]
    pub form_rms_um: f64,
    /// Standard uncertainty of the form at any one angle, from the covariance of the averages, in µm.
    pub form_std_um: Option<f64>,
    /// The standards' values.
    pub values: Vec<Value>,
    /// True error of the form (root mean square over observable orders from 2), where the truth is known.
    pub truth_form_rms_error_um: Option<f64>,
}

/// True errors of the motion: root mean square over observable orders from 2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MotionTruth {
    /// Of x, in µm.
    pub x_rms_error_um: Option<f64>,
    /// Of y, in µm.
    pub y_rms_error_um: Option<f64>,
    /// Of the tilt about x, in µrad.
    pub tilt_x_rms_error_urad: Option<f64>,
    /// Of the tilt about y, in µrad.
    pub tilt_y_rms_error_urad: Option<f64>,
    /// Of motion along `motion_along_deg`, in µm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along_rms_error_um: Option<f64>,
    /// Of the tilt towards `motion_along_deg`, in µrad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt_along_rms_error_urad: Option<f64>,
    /// Of motion along the axis, from 1/rev on, in µm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z_rms_error_um: Option<f64>,
}

/// The surface of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceSummary {
    /// Angles around the part.
    pub angles: usize,
    /// Rings along z.
    pub rings: usize,
    /// First and last ring, in mm.
    pub z_mm: [f64; 2],
    /// How it was filled between the sections.
    pub interpolation: String,
    /// Where sections of different sensors meet, and how well they agree.
    pub meetings: Vec<Meeting>,
}
