#![allow(clippy::unwrap_used, reason = "tests")]

use runout_core::points::{Column, Trace};

use super::*;
use crate::AxialReversalConfig;

/// Two and three traces of two bent profiles, each sampled otherwise.
fn points() -> Points {
    let (mut z_mm, mut reading_um, mut traces) = (Vec::new(), Vec::new(), Vec::new());
    for (number, setup) in ["initial", "initial", "reversed", "reversed", "reversed"].into_iter().enumerate() {
        let start = z_mm.len();
        let sign = if setup == "initial" { 1.0 } else { -1.0 };
        for index in 0..90 {
            let z = 0.5 * f64::from(index) + 0.07 * number as f64 + 0.05 * f64::from(index % 3);
            let (part, slide) = ((z / 3.0).sin() + 0.02 * (z - 20.0).powi(2) / 20.0, 0.3 * (z / 9.0).cos());
            z_mm.push(z);
            reading_um.push(part + sign * slide + 4.0 * number as f64 + 0.02 * (17.0 * z).sin());
        }
        traces.push(Trace { id: format!("{number}"), kind: setup.into(), points: start..z_mm.len() });
    }
    let columns =
        vec![Column { name: "z_mm".into(), values: z_mm }, Column { name: "reading_um".into(), values: reading_um }];
    Points { input: "made.csv".into(), columns, traces, ..Points::default() }
}

fn model(slide_cutoff_mm: Option<f64>) -> TracesModel {
    let separator = AxialReversalConfig { slide_cutoff_mm, ..AxialReversalConfig::default() }.separator().unwrap();
    let points = points();
    separator.traces_model(&points, &separator.traces(&points).unwrap(), slide_cutoff_mm, &[]).unwrap()
}

/// Values of every effect, none of them 0.
fn much(kind: Kind) -> Vec<f64> {
    match kind {
        Kind::AxialRegistration => vec![0.083],
        Kind::SensorGain => vec![-0.04],
        Kind::PartTilt => vec![0.3],
        Kind::RotationOffset => vec![8.0],
        Kind::ThermalDrift => vec![0.4, 0.22],
    }
}

fn zero(kind: Kind) -> Vec<f64> {
    kind.parameters().iter().map(|parameter| if parameter.name == "time_constant" { 0.3 } else { 0.0 }).collect()
}

/// Signatures beside differences of the residual, outside the span of everything that is fitted, and moves beside
/// differences of part and slide: of each effect alone, at nothing and at much, beside another effect.
#[test]
fn signatures_and_moves_are_those_of_refits() {
    for cutoff in [None, Some(15.0)] {
        let model = model(cutoff);
        let beside = model.effects().iter().position(|effect| effect.targets == ["4"]).unwrap();
        for effect in (0..model.effects().len()).filter(|effect| *effect != beside) {
            let kind = model.data().candidates[effect].kind;
            for values in [zero(kind), much(kind)] {
                let with = |values: &[f64]| {
                    vec![
                        Setting { effect: beside, values: much(model.data().candidates[beside].kind) },
                        Setting { effect, values: values.to_vec() },
                    ]
                };
                let fit = model.fit(&with(&values)).unwrap();
                let data = model.data();
                let moves = data.results.moves(data, fit.applied(), effect).into_iter();
                let moves: Vec<Vec<f64>> = moves.map(|both| both.into_iter().flatten().collect()).collect();
                let signature = fit.signature(effect);
                for parameter in 0..values.len() {
                    let step = 1e-5;
                    let moved = |sign: f64| {
                        let mut values = values.clone();
                        values[parameter] += sign * step;
                        model.fit(&with(&values)).unwrap()
                    };
                    let (up, down) = (moved(1.0), moved(-1.0));
                    let slope = |up: &[f64], down: &[f64]| -> Vec<f64> {
                        up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * step)).collect()
                    };
                    // A refit also turns the span of what is fitted, by as much as is left: that part lies in the span.
                    let change = fit.outside(&slope(&up.remainder().residual, &down.remainder().residual));
                    let distance = |a: &[f64], b: &[f64]| rms(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>());
                    let named = format!("{cutoff:?} {:?} {parameter}", model.effects()[effect]);
                    // 1e-6: rounding of readings near 10 µm over 2e-5, and the step's square.
                    assert!(distance(&signature[parameter], &change) < 1e-6 * (1.0 + rms(&change)), "{named}");
                    let change = slope(&up.results(), &down.results());
                    assert!(distance(&moves[parameter], &change) < 1e-6 * (1.0 + rms(&change)), "{named}");
                }
            }
        }
    }
}

#[test]
fn shifts_count_from_a_majority_or_the_mean() {
    let shifted = |shift_mm| Alteration { shift_mm, ..Alteration::default() };
    let mut all = [0.0, 0.1, 0.0, 0.3, 0.0, 0.3].map(shifted);
    centre(&mut all, &[0, 0, 0, 1, 1, 1]);
    let found: Vec<f64> = all.iter().map(|one| one.shift_mm).collect();
    for (found, expected) in found.iter().zip([0.0, 0.1, 0.0, 0.1, -0.2, 0.1]) {
        assert!((found - expected).abs() < 1e-15);
    }
}
