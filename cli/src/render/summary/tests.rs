use insta::assert_snapshot;
use runout_core::{
    draws::Uncertainty,
    evaluate::Value,
    summary::{
        CaptureSummary, LostOrders, MotionTruth, RejectedTurnSummary, SectionSummary, StationSummary, Summary,
        SurfaceSummary,
    },
    surface::Meeting,
};

use super::text;
use crate::render::wrap::within;

fn capture(setup: &str, rejected: usize) -> CaptureSummary {
    let turn = |turn| RejectedTurnSummary { turn, start_sample: 512 * turn as u64, reason: "S2: clipped".into() };
    CaptureSummary {
        setup: setup.into(),
        turns_recorded: 60,
        turns_used: 57 - rejected,
        trimmed: vec!["3 turns: start-up".into()],
        rejected: (10..10 + rejected).map(turn).collect(),
        speed_rpm: Some(500.02),
        levels: Vec::new(),
        filters: vec!["low-pass, −3 dB at 451 Hz".into()],
    }
}

fn section(id: &str, z_mm: f64) -> SectionSummary {
    let value = |symbol: &str, value, std: Option<f64>| Value {
        band_upr: [2, 80],
        uncertainty: std.map(|std| Uncertainty::new(std, [value - 2.0 * std, value + 2.0 * std], 400)),
        ..Value::referred(symbol, value, "um", "", "LSCI")
    };
    SectionSummary {
        section: id.into(),
        z_mm,
        form_rms_um: 4.012_34 + z_mm / 1000.0,
        form_std_um: Some(0.0034),
        values: vec![value("RONt", 21.6412, Some(0.0312)), value("Ra", 3.2, None)],
        truth_form_rms_error_um: Some(0.0051),
    }
}

fn motion_values(size: f64) -> Vec<Value> {
    let value = |symbol: &str, unit: &str, reference: &str, value, std: Option<f64>| Value {
        band_upr: [2, 80],
        uncertainty: std.map(|std| Uncertainty::new(std, [value, value], 0)),
        ..Value::referred(symbol, value, unit, "", reference)
    };
    vec![
        value("synchronous-radial-x", "um", "LSC", 3.2 * size, Some(0.004)),
        value("total-radial-x", "um", "LSC", 4.1 * size, None),
        value("synchronous-radial-x", "um", "MZC", 3.1 * size, None),
        value("asynchronous-radial-x", "um", "turns at one angle", 0.8 * size, Some(0.05)),
        value("residual-synchronous-tilt-y", "urad", "LSC", 6.0 * size, None),
        value("fundamental-radial", "um", "PC", 0.6 * size, Some(0.002)),
    ]
}

fn summary(stations: usize) -> Summary {
    let station = |index: usize| {
        let z_mm = 10.0 * index as f64;
        StationSummary {
            station: format!("s{index:02}"),
            z_mm,
            captures: vec![capture("initial", 0), capture("reversed", index % 2)],
            sections: vec![section("a", 200.0 + z_mm), section("b", 230.0 + z_mm)],
            motion_along_deg: None,
            motion_z_mm: None,
            readings: vec![],
            motion_values: motion_values(1.0 + 0.1 * index as f64),
            residual_rms_um: Some(0.0066 + 1e-4 * index as f64),
            expected_residual_rms_um: Some(0.0065),
            chi2_per_dof: Some(1.02),
            residual_dof: None,
            residual_orders: None,
            truth: Some(MotionTruth {
                z_rms_error_um: None,
                x_rms_error_um: Some(0.012),
                y_rms_error_um: Some(0.013),
                tilt_x_rms_error_urad: None,
                tilt_y_rms_error_urad: None,
                along_rms_error_um: None,
                tilt_along_rms_error_urad: None,
            }),
            warnings: vec!["the speed is 3 % off the stated one".into()],
        }
    };
    let meeting = Meeting {
        z_mm: 230.0,
        sections: ["b@s00".into(), "a@s03".into()],
        rms_um: 0.0048,
        max_um: 0.015,
        expected_rms_um: None,
    };
    Summary {
        title: "Turned shaft".into(),
        lost_orders: LostOrders { form: (2..=80).step_by(2).collect(), motion: vec![1], ..LostOrders::default() },
        stations: (0..stations).map(station).collect(),
        surface: Some(SurfaceSummary {
            angles: 720,
            rings: 2 * stations,
            z_mm: [200.0, 260.0],
            interpolation: "monotone".into(),
            meetings: vec![meeting],
        }),
        outputs: vec!["out/form.parquet".into()],
        warnings: (0..stations).map(|index| format!("s{index:02}: the speed is 3 % off the stated one")).collect(),
        ..Summary::default()
    }
}

#[test]
fn few_stations_stand_row_by_row() {
    assert_snapshot!(text(&summary(2), 100, true));
}

#[test]
fn one_station_has_its_error_motion_with_uncertainty() {
    assert_snapshot!(text(&summary(1), 100, true));
}

#[test]
fn many_stations_are_gathered() {
    assert_snapshot!(text(&summary(40), 100, true));
}

/// Without `--verbose` the answer and the tables fit a screen, whatever the terminal.
#[test]
fn the_answer_comes_first_at_80_and_120_columns() {
    for (terminal, name) in [(80, "answer_at_80_columns"), (120, "answer_at_120_columns")] {
        let width = within(terminal);
        let shown = text(&summary(40), width, false);
        assert!(shown.lines().all(|line| line.chars().count() <= width), "{shown}");
        assert!(shown.lines().nth(1).is_some_and(|line| line.starts_with("The residual agrees")), "{shown}");
        assert_snapshot!(name, shown);
    }
}

/// A value whose data refute it has its mark at the number, and the verdict says so.
#[test]
fn what_the_data_refute_is_marked_where_it_is_printed() {
    let mut refuted = summary(1);
    let by = "s00: the residual is 10.19 times the noise";
    for section in &mut refuted.stations[0].sections {
        section.values.iter_mut().for_each(|value| value.refuted_by = Some(by.into()));
    }
    assert_snapshot!(text(&refuted, 100, false));
}
