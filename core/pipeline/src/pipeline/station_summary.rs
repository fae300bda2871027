//! The summary of one station, from its form, motion and turns.

use super::true_error::true_error;
use crate::summary::{CaptureSummary, LevelSummary, MotionTruth, RejectedTurnSummary, SectionSummary, StationSummary};
use runout_evaluate::EvaluatedStation;
use runout_turning::{
    azimuth::Azimuth,
    profile::{Profile, Rejection, TurnLength},
    reading::{coefficients, sensor_id, setup_id, variances},
    rig::Rig,
    separation::{Quantity, SectionAt},
};

pub(super) fn summarise(station: &EvaluatedStation, rig: Option<&Rig>) -> StationSummary {
    let EvaluatedStation { result, values, motion_values, readings, .. } = station;
    let separation = &result.separation;
    let known = |value: f64| value.is_finite().then_some(value);
    let nothing = separation.has_no_observable_form();
    // A face has no form of a circle around the part: its harmonics are in the table.
    let around = |(section, _): &(usize, &SectionAt)| rig.is_none_or(|rig| !rig.is_face(*section));
    let sections = separation.sections.iter().enumerate().filter(around).map(|(section, at)| {
        let unknown = separation.position(Quantity::Form(section));
        SectionSummary {
            section: at.id.clone(),
            z_mm: at.z_mm,
            form_rms_um: result.form_rms_um(section).filter(|_| !nothing).map_or(f64::NAN, |(rms_um, _)| rms_um),
            form_std_um: unknown.filter(|_| !nothing).and_then(|unknown| known(separation.angle_std(unknown))),
            values: values.get(section).cloned().unwrap_or_default(),
            truth_form_rms_error_um: true_error(result, Quantity::Form(section)),
        }
    });
    let sections: Vec<_> = sections.collect();
    let azimuth = separation.azimuth();
    let has_motion = result.truth.as_ref().is_some_and(|truth| truth.motion.is_some());
    StationSummary {
        station: result.station.clone(),
        z_mm: result.z_mm,
        captures: result.profiles.iter().map(|profile| capture_summary(profile, rig)).collect(),
        sections,
        motion_along_deg: azimuth.map(Azimuth::degrees),
        readings: if nothing { readings.clone() } else { Vec::new() },
        motion_z_mm: plane_of_values(station),
        motion_values: motion_values.clone(),
        residual_rms_um: known(separation.residual.rms_um),
        expected_residual_rms_um: known(separation.residual.expected_rms_um),
        chi2_per_dof: known(separation.residual.chi2_per_dof),
        residual_dof: Some(separation.residual.dof).filter(|dof| *dof > 0),
        residual_orders: separation.residual.orders,
        truth: has_motion.then(|| MotionTruth {
            x_rms_error_um: true_error(result, Quantity::X),
            y_rms_error_um: true_error(result, Quantity::Y),
            tilt_x_rms_error_urad: true_error(result, Quantity::TiltX),
            tilt_y_rms_error_urad: true_error(result, Quantity::TiltY),
            z_rms_error_um: true_error(result, Quantity::Z),
            along_rms_error_um: azimuth.and_then(|azimuth| true_error(result, Quantity::Along(azimuth))),
            tilt_along_rms_error_urad: azimuth.and_then(|azimuth| true_error(result, Quantity::TiltAlong(azimuth))),
        }),
        warnings: separation
            .warnings
            .iter()
            .chain(result.profiles.iter().flat_map(|profile| &profile.warnings))
            .cloned()
            .collect(),
    }
}

fn capture_summary(profile: &Profile, rig: Option<&Rig>) -> CaptureSummary {
    let setup = setup_id(profile, rig);
    let sensor = |index: usize| sensor_id(index, rig);
    let length =
        |turn: &TurnLength| format!("{:.1} samples long, the median turn has {:.1}", turn.samples, turn.median_samples);
    let reason = |rejection: &Rejection| match rejection {
        Rejection::MissingMark(turn) => format!("a mark is missing: {}", length(turn)),
        Rejection::DoubledMark(turn) if turn.samples > 0.9 * turn.median_samples => {
            "next to a mark that was counted twice: where it begins or ends is open".into()
        }
        Rejection::DoubledMark(turn) => format!("a mark was counted twice: {}", length(turn)),
        Rejection::Speed(turn) => format!("off speed: {}", length(turn)),
        Rejection::Defect { sensor: index, kind } => format!("{}: {kind}", sensor(*index)),
        Rejection::Outlier { sensor: index, distance_um } => {
            format!("{}: {distance_um:.3} µm rms from the other turns", sensor(*index))
        }
        Rejection::Incomplete => "not wholly covered by samples".into(),
        Rejection::Angle => "the encoder's angle does not grow steadily by one turn".into(),
    };
    CaptureSummary {
        setup,
        turns_recorded: profile.turns.recorded,
        turns_used: profile.turns.used,
        trimmed: profile.turns.trimmed.iter().map(|trim| format!("{} turns: {}", trim.turns, trim.reason)).collect(),
        rejected: profile
            .turns
            .rejected
            .iter()
            .map(|turn| RejectedTurnSummary {
                turn: turn.turn,
                start_sample: turn.start_sample,
                reason: reason(&turn.reason),
            })
            .collect(),
        speed_rpm: profile.speed_rpm,
        levels: profile
            .sensors
            .iter()
            .enumerate()
            .filter_map(|(channel, index)| level(profile, channel, sensor(*index)))
            .collect(),
        filters: profile.responses.iter().map(|response| response.description.clone()).collect(),
    }
}

/// Mean reading of a channel.
fn level(profile: &Profile, channel: usize, sensor: String) -> Option<LevelSummary> {
    let mean_um = coefficients(profile, channel).first()?.re;
    let std_um = variances(profile, channel).and_then(|variances| variances.first().map(|variance| variance.sqrt()));
    mean_um.is_finite().then_some(LevelSummary { sensor, mean_um, std_um: std_um.filter(|std| std.is_finite()) })
}

/// Where the radial values of error motion hold: midway between the sensors, not where the tables have x and y.
fn plane_of_values(EvaluatedStation { result, motion_values, .. }: &EvaluatedStation) -> Option<f64> {
    let spread = result.profiles.iter().find_map(|profile| profile.spread.as_ref())?;
    (!motion_values.is_empty()).then_some(spread.projection.z_mm + result.z_mm)
}
