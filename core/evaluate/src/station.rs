//! One station with all of its values, finished in one place.

use crate::{
    Evaluate, Group, ReferenceCircle, Value, circles,
    error_motion::{Centre, ErrorMotion, behind_low_pass, below_absent},
    run_out,
    section::{missing_circles, section_values, steepest_um_per_deg},
};
use runout_consistency::refuted_by;
use runout_turning::{reading::ReadingValues, rig::Rig, separation::Quantity, station::StationResult};

/// What was separated, and the standards' values of it.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedStation {
    /// Form and motion.
    pub result: StationResult,
    /// Values of the form, section by section.
    pub values: Vec<Vec<Value>>,
    /// Reference circles of the form, section by section.
    pub circles: Vec<Vec<ReferenceCircle>>,
    /// Error motion values of the axis; empty where no spread over the turns is known.
    pub motion_values: Vec<Value>,
    /// What readings have by themselves: where nothing is separated, or run-out is asked for.
    pub readings: Vec<ReadingValues>,
}

impl EvaluatedStation {
    /// Evaluates a station of a part of this nominal radius, one of so many that are tested alike. A rig declares interruptions.
    #[must_use]
    pub fn of(
        mut result: StationResult,
        evaluate: &Evaluate,
        radius_mm: f64,
        rig: Option<&Rig>,
        stations: usize,
    ) -> Self {
        if let Some(rig) = rig {
            let beyond_rad = result.profiles.iter().map(|profile| profile.bridged_beyond_rad).fold(0.0, f64::max);
            for section in &mut result.separation.sections {
                section.declared_gaps = rig.gaps_of(&section.id);
                section.gaps = section.declared_gaps.widened(beyond_rad);
            }
        }
        let sections = 0..result.separation.sections.len();
        let mut values: Vec<Vec<Value>> =
            sections.clone().map(|section| section_values(&result, section, evaluate, radius_mm)).collect();
        let mut motion_values = error_motion_values(&result, &evaluate.centres, radius_mm);
        let missing = |section: usize| missing_circles(&result, section, evaluate, radius_mm, &values[section]);
        let missing: Vec<String> = sections.flat_map(missing).collect();
        result.separation.warnings.extend(missing);
        judge_among(&mut result, rig, stations);
        if let Some(by) = refuted_by(&result.separation.residual.checks) {
            values.iter_mut().flatten().chain(&mut motion_values).for_each(|value| value.refuted_by = Some(by.clone()));
        }
        let circle = |(section, values): (usize, &Vec<Value>)| {
            circles::section_circles(&result, section, evaluate, radius_mm, rig, values)
        };
        let circles = values.iter().enumerate().map(circle).collect();
        let asked = evaluate.has(Group::RunOut) || result.separation.has_no_observable_form();
        let readings = if asked { ReadingValues::of_all(&result.profiles, rig) } else { Vec::new() };
        if let Some(rig) = rig.filter(|_| evaluate.has(Group::RunOut)) {
            // What is separated may be refuted; readings are what was measured.
            for (at, values) in result.separation.sections.iter().zip(&mut values) {
                let section = rig.sections.iter().position(|id| *id == at.id);
                values.extend(
                    section.into_iter().flat_map(|section| run_out::values(&result.profiles, &readings, rig, section)),
                );
            }
        }
        Self { result, values, circles, motion_values, readings }
    }

    /// Adds what refutes the values and circles of the form, where nothing of the station's own refutes them.
    #[must_use]
    pub fn refuted_by(mut self, by: Option<&str>) -> Self {
        let of_values = self.values.iter_mut().flatten().map(|value| &mut value.refuted_by);
        let of_circles = self.circles.iter_mut().flatten().map(|circle| &mut circle.refuted_by);
        for refuted_by in of_values.chain(of_circles) {
            *refuted_by = refuted_by.take().or_else(|| by.map(str::to_owned));
        }
        self
    }

    /// The first RONt of a section.
    #[must_use]
    pub fn ront(&self, section: usize) -> Option<&Value> {
        self.values.get(section)?.iter().find(|value| value.symbol == "RONt")
    }
}

/// The tests of the station's readings and of the course of its turns, as one of several stations and captures.
fn judge_among(result: &mut StationResult, rig: Option<&Rig>, stations: usize) {
    let checks = &mut result.separation.residual.checks;
    for check in checks.iter_mut() {
        *check = check.clone().among(stations);
    }
    for profile in &result.profiles {
        let setup = rig.and_then(|rig| rig.setups.get(profile.setup)).map_or("", |setup| setup.id.as_str());
        checks.extend(profile.course.checks.iter().map(|check| check.clone().within(setup)));
    }
}

fn error_motion_values(result: &StationResult, centres: &[Centre], radius_mm: f64) -> Vec<Value> {
    let StationResult { station, z_mm, angles, separation, profiles, .. } = result;
    if profiles.iter().all(|profile| profile.spread.is_none()) {
        return Vec::new();
    }
    // A face's slope around the axis is none of the circumference.
    let circle = |(_, quantity): &(usize, &Quantity)| matches!(quantity, Quantity::Form(_));
    let forms = separation.unknowns.iter().enumerate().filter(circle);
    let steepest = forms.map(|(unknown, _)| steepest_um_per_deg(&result.over_angle(unknown))).fold(0.0, f64::max);
    let slope = steepest.to_degrees() / (1e3 * radius_mm);
    let values = ErrorMotion { station, z_mm: *z_mm, angles: *angles, separation, profiles, slope }.values(centres);
    let goes_on = profiles.iter().any(|profile| profile.absent_um > 0.0);
    let values = if goes_on { below_absent(values) } else { values };
    match result.half_power_upr() {
        Some(half_power_upr) => behind_low_pass(values, separation, half_power_upr),
        None => values,
    }
}
