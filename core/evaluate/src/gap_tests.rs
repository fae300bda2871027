//! Values of lines and walls of which a stretch was not measured.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;

use super::{
    Evaluated, PartSummary, add_areal,
    generatrix::add_generatrices,
    tests::{RADIUS_MM, evaluate, station},
};
use crate::Value;
use crate::evaluable::{Evaluable, EvaluableKind, OpenProfile};
use runout_draws::OpenErrors;
use runout_numerics::Complex64;
use runout_turning::{
    station::StationResult,
    surface::{SurfaceBuilder, SurfaceConfig},
};

fn one<'a>(values: &'a [Value], symbol: &str) -> Option<&'a Value> {
    values.iter().find(|value| value.symbol == symbol)
}

/// Waves of 3 mm and 0.6 µm on 90 mm, of which 25 mm were not measured.
#[test]
fn texture_of_an_open_profile_is_that_of_its_stretches() {
    let found = |is_there: &dyn Fn(f64) -> bool, text: &str| {
        let all = (0..=450).map(|at| 0.2 * f64::from(at));
        let z_mm: Vec<f64> = all.filter(|z| is_there(*z)).collect();
        let deviation_um = z_mm.iter().map(|z| 0.6 * (TAU * z / 3.0 + 0.4).sin() + 2.0 * (TAU * z / 80.0).cos());
        let errors = OpenErrors { std_um: vec![0.002; z_mm.len()], ..OpenErrors::default() };
        let profile = OpenProfile { of: "part".into(), deviation_um: deviation_um.collect(), z_mm, errors: Ok(errors) };
        let mut evaluate = evaluate(text).unwrap();
        evaluate.keep_given(&[EvaluableKind::OpenProfile]);
        Evaluated::of(&[Evaluable::OpenProfile(profile)], &evaluate, None).unwrap()
    };
    let values = |found: &Evaluated| found.values.clone();
    let text = "values = ['texture']\nlambda_c_mm = 7.5\n[texture]\nprofiles = ['R', 'P']";
    let whole = found(&|_| true, text);
    let said = |found: &Evaluated| -> Vec<String> {
        found.remarks.iter().filter(|said| said.contains("nothing was measured")).cloned().collect()
    };
    assert!(said(&whole).is_empty(), "{:?}", whole.remarks);
    let gapped = found(&|z| !(30.0..55.0).contains(&z), text);
    let (all, some) = (values(&whole), values(&gapped));
    for symbol in ["Ra", "Rq", "Rz", "Rsm", "Rdq"] {
        let [all, some] = [&all, &some].map(|values| one(values, symbol).unwrap().value);
        assert!((some / all - 1.0).abs() < 0.02, "{symbol} {all} {some}");
    }
    let ra = one(&some, "Ra").unwrap();
    let [low, high] = ra.uncertainty.as_ref().unwrap().interval_95;
    assert!(low > 0.37 && high < 0.39 && (ra.coverage - 64.8 / 90.0).abs() < 0.01, "{ra:?}");
    // The primary profile's section is the whole line.
    assert!(one(&all, "Pa").is_some() && one(&some, "Pa").is_none());
    let said = said(&gapped);
    assert_eq!(said.len(), 2, "{:?}", gapped.remarks);
    assert!(said[0].contains("R profile of part: nothing was measured from 29.8 to 55 mm"), "{said:?}");
    assert!(said[1].ends_with("there are no values"), "{said:?}");
}

/// Sections every millimetre with a wave along z, and where a stretch of 18 mm has none.
fn wall(is_there: impl Fn(f64) -> bool) -> Vec<StationResult> {
    let places = (0..=60).map(f64::from).filter(|z| is_there(*z));
    let section = |z: f64| {
        let along = 0.5 * (TAU * z / 4.0 + 0.3).sin();
        station(z, &[(2, Complex64::from(along)), (5, Complex64::new(0.0, along))], 20, 1e-8, &[])
    };
    places.map(section).collect()
}

fn part(stations: &[StationResult], step_mm: Option<f64>, text: &str) -> PartSummary {
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 90, step_mm });
    stations.iter().for_each(|station| builder.add(station));
    let (surface, uncertain) = builder.build(RADIUS_MM).unwrap();
    let (mut part, evaluate) = (PartSummary::default(), evaluate(text).unwrap());
    add_areal(&mut part, &surface, &uncertain, 2, &evaluate).unwrap();
    add_generatrices(&mut part, &uncertain, RADIUS_MM, false, &evaluate);
    part
}

#[test]
fn texture_of_a_wall_is_that_of_its_stretches() {
    let is_there = |z: f64| !(27.0..45.0).contains(&z);
    let along = "values = ['texture']\nlambda_c_mm = 6.0\n[texture]\ngeneratrices_deg = [10]";
    let (all, some) = (part(&wall(|_| true), None, along), part(&wall(is_there), None, along));
    for symbol in ["Ra", "Rq", "Rsm"] {
        let [all, some] = [&all, &some].map(|part| one(&part.values, symbol).unwrap().value);
        assert!((some / all - 1.0).abs() < 0.03, "{symbol} {all} {some}");
    }
    assert!(
        some.remarks.iter().any(|said| said.contains("nothing was measured from 26 to 45 mm")),
        "{:?}",
        some.remarks
    );
    for text in ["values = ['areal']", "values = ['areal']\nlambda_c_mm = 6.0"] {
        let (all, some) = (part(&wall(|_| true), Some(0.5), text), part(&wall(is_there), Some(0.5), text));
        for symbol in ["Sq", "Sa", "Sdq"] {
            let [all, some] = [&all, &some].map(|part| one(&part.values, symbol).unwrap().value);
            assert!((some / all - 1.0).abs() < 0.03, "{text} {symbol} {all} {some}");
        }
        assert!(some.remarks.iter().any(|said| said.contains("no section was measured from 26 to 45 mm")));
        assert!(one(&some.values, "Sq").unwrap().coverage < 0.75);
    }
}
