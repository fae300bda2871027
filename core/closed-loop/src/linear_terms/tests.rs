use nalgebra::{DMatrix, DVector};

use super::*;
use crate::{Fit, Parameter};

/// Uniform between −0.5 and 0.5.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

fn term(id: &str, columns: Vec<Vec<f64>>) -> Term {
    let parameter = |index: usize| Parameter { name: format!("p{index}"), unit: "um".into(), tolerance: 1.0 };
    let parameters = (0..columns.len()).map(parameter).collect();
    Term { effect: Effect { id: id.into(), targets: Vec::new(), parameters }, columns, rank: 0 }
}

/// 90 points in six groups; a level and a slope are declared, a square and a pair of waves may be missing.
struct Made {
    model: LinearTerms,
    y: Vec<f64>,
    columns: Vec<Vec<f64>>,
    group: Vec<usize>,
}

fn made(std: Option<f64>) -> Made {
    let mut seed = 17;
    let x: Vec<f64> = (0..90).map(|index| f64::from(index) / 30.0 + 0.02 * noise(&mut seed)).collect();
    let of = |f: &dyn Fn(f64) -> f64| x.iter().map(|x| f(*x)).collect::<Vec<f64>>();
    let columns =
        vec![of(&|_| 1.0), of(&|x| x), of(&|x| 1e3 * x * x), of(&|x| (7.0 * x).cos()), of(&|x| (7.0 * x).sin())];
    let y: Vec<f64> =
        x.iter().map(|x| 3.0 - x + 0.4 * x * x + 0.3 * (7.0 * x).sin() + 0.05 * noise(&mut seed)).collect();
    let group: Vec<usize> = (0..90).map(|index| index / 15).collect();
    let observations = Observations {
        values: y.clone(),
        unit: "um".into(),
        std,
        group: group.clone(),
        groups: (0..6).map(|group| format!("group {group}")).collect(),
        ..Observations::default()
    };
    let declared =
        |name: &str, column: &Vec<f64>| Declared { name: name.into(), unit: "um".into(), column: column.clone() };
    let terms = vec![term("square", columns[2..3].to_vec()), term("waves", columns[3..].to_vec())];
    let model =
        LinearTerms::new(observations, vec![declared("level", &columns[0]), declared("slope", &columns[1])], terms);
    Made { model: model.unwrap(), y, columns, group }
}

/// Least squares by nalgebra's singular values, on some of the points.
fn brute(columns: &[Vec<f64>], y: &[f64], kept: &[usize]) -> DVector<f64> {
    let matrix = DMatrix::from_fn(kept.len(), columns.len(), |row, column| columns[column][kept[row]]);
    let right = DVector::from_iterator(kept.len(), kept.iter().map(|point| y[*point]));
    matrix.svd(true, true).solve(&right, 1e-13).unwrap()
}

fn predicted(columns: &[Vec<f64>], values: &DVector<f64>, point: usize) -> f64 {
    columns.iter().zip(values.iter()).map(|(column, value)| column[point] * value).sum()
}

#[test]
fn the_fit_is_least_squares() {
    let Made { model, y, columns, .. } = made(Some(0.02));
    let all: Vec<usize> = (0..90).collect();
    let expected = brute(&columns[..2], &y, &all);
    let fit = model.fit(&[]).unwrap();
    for (found, expected) in fit.declared().iter().zip(expected.iter()) {
        // 1e-12: rounding of numbers near 3.
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }
    let remainder = fit.remainder();
    assert_eq!(remainder.dof, 88);
    for (point, found) in remainder.residual.iter().enumerate() {
        let expected = (y[point] - predicted(&columns[..2], &expected, point)) / 0.02;
        assert!((found - expected).abs() < 1e-10);
    }
    assert!((remainder.noise_floor - 0.02 * (88.0_f64 / 90.0).sqrt()).abs() < 1e-15);
    // Standard uncertainty of the level: σ √[(AᵀA)⁻¹]₁₁, raised by the residual.
    let matrix = DMatrix::from_fn(90, 2, |row, column| columns[column][row]);
    let inverse = matrix.tr_mul(&matrix).try_inverse().unwrap();
    let expected = 0.02 * (inverse[(0, 0)] * remainder.chi2_per_dof()).sqrt();
    assert!((fit.values()[0].std / expected - 1.0).abs() < 1e-9);
}

#[test]
fn signatures_are_the_derivative_of_the_residual() {
    let Made { model, .. } = made(Some(0.02));
    for (effect, parameters) in [(0, 1), (1, 2)] {
        for parameter in 0..parameters {
            let with = |value: f64| {
                let mut values = vec![0.0; parameters];
                values[parameter] = value;
                model.fit(&[Setting { effect, values }]).unwrap()
            };
            let (low, high) = (with(-0.5), with(0.5));
            let signature = &low.signature(effect)[parameter];
            for (point, slope) in signature.iter().enumerate() {
                let difference = high.remainder().residual[point] - low.remainder().residual[point];
                // Linear, so the difference is exact: rounding of 1e3·x²/0.02 near 5e5.
                assert!((difference - slope).abs() < 1e-8, "{difference}, {slope}");
            }
            // What the declared parameters make of it.
            let change = high.declared()[0] - low.declared()[0];
            let bias = &low.bias(effect)[2 * parameter];
            assert!((bias.value - change.abs()).abs() < 1e-8 && bias.on == "level" && bias.unit == "um/um");
        }
    }
}

#[test]
fn groups_left_out_are_predicted_by_the_others() {
    let Made { model, y, columns, group } = made(None);
    for (applied, columns) in [
        (vec![], columns[..2].to_vec()),
        (vec![Setting { effect: 1, values: vec![0.0, 0.2] }], [&columns[..2], &columns[3..]].concat()),
    ] {
        let squares: f64 = (0..6)
            .map(|out| {
                let others: Vec<usize> = (0..90).filter(|point| group[*point] != out).collect();
                let fit = brute(&columns, &y, &others);
                let left = (0..90).filter(|point| group[*point] == out);
                left.map(|point| (y[point] - predicted(&columns, &fit, point)).powi(2)).sum::<f64>()
            })
            .sum();
        let remainder = model.fit(&applied).unwrap().remainder().clone();
        assert!((remainder.held_out_chi2 / squares - 1.0).abs() < 1e-9, "{} {squares}", remainder.held_out_chi2);
        assert!((remainder.held_out_rms - (squares / 90.0).sqrt()).abs() < 1e-10);
        assert!(!remainder.noise_is_known());
    }
}

/// What the held-out rms is on average over noise alone, in groups of unequal leverage.
#[test]
fn held_out_noise_is_as_expected() {
    let mut seed = 23;
    let x: Vec<f64> = (0..24).map(|index| f64::from(index).powi(2) / 60.0).collect();
    let column = |f: fn(f64) -> f64| x.iter().map(|x| f(*x)).collect::<Vec<f64>>();
    let declared = |name: &str, column| Declared { name: name.into(), unit: "um".into(), column };
    let (mut squares, mut expected) = (0.0, 0.0);
    for _ in 0..2000 {
        let observations = Observations {
            // Twelve uniform numbers have the variance 1.
            values: x.iter().map(|_| 0.3 * (0..12).map(|_| noise(&mut seed)).sum::<f64>()).collect(),
            unit: "um".into(),
            std: Some(0.3),
            group: (0..24).map(|index| index / 4).collect(),
            groups: (0..6).map(|group| format!("group {group}")).collect(),
            ..Observations::default()
        };
        let declared = vec![declared("level", column(|_| 1.0)), declared("slope", column(|x| x))];
        let model = LinearTerms::new(observations, declared, vec![term("square", vec![column(|x| x * x)])]).unwrap();
        let fit = model.fit(&[Setting { effect: 0, values: vec![0.0] }]).unwrap();
        squares += fit.remainder().held_out_rms.powi(2) / 2000.0;
        expected = fit.remainder().held_out_expected_rms;
    }
    // 2000 means of 24 squares: 1.5 % for independent ones, more because the last group is extrapolated.
    assert!((squares.sqrt() / expected - 1.0).abs() < 0.05 && expected > 0.31, "{} {expected}", squares.sqrt());
}

/// A group that is ten times as noisy is named by itself, also at the end, where all others fit worse because of it.
#[test]
fn a_bad_group_is_named() {
    for bad in 0..6 {
        let Made { model, .. } = made(None);
        let Data { mut observations, declared, terms, .. } = (*model.0).clone();
        let mut seed = 31;
        let sound = LinearTerms::new(observations.clone(), declared.clone(), terms.clone()).unwrap();
        let waves = [Setting { effect: 0, values: vec![4e-4] }, Setting { effect: 1, values: vec![0.0, 0.3] }];
        assert!(sound.fit(&waves).unwrap().far_worse().is_empty());
        for (value, group) in observations.values.iter_mut().zip(&observations.group) {
            *value += if *group == bad { 0.5 * noise(&mut seed) } else { 0.0 };
        }
        let named = LinearTerms::new(observations, declared, terms).unwrap().fit(&waves).unwrap().far_worse();
        assert_eq!(named.len(), 1, "{named:?}");
        assert!(named[0].place.starts_with(&format!("group {bad}: ")), "{named:?}");
        assert!((0.07..0.3).contains(&named[0].rms_um), "{named:?}");
    }
}

#[test]
fn what_only_one_group_determines_is_predicted_as_nothing() {
    // Two groups of two; the term is seen in the second alone.
    let observations = Observations {
        values: vec![1.0, 1.2, 5.0, 5.2],
        unit: "um".into(),
        std: None,
        group: vec![0, 0, 1, 1],
        groups: vec!["first".into(), "second".into()],
        ..Observations::default()
    };
    let level = Declared { name: "level".into(), unit: "um".into(), column: vec![1.0; 4] };
    let step = term("step", vec![vec![0.0, 0.0, 1.0, 1.0]]);
    let model = LinearTerms::new(observations, vec![level], vec![step]).unwrap();
    let fit = model.fit(&[Setting { effect: 0, values: vec![4.0] }]).unwrap();
    // The first group's mean is 1.1 and cannot say how high the step is: the others keep errors near 4.
    assert!(fit.remainder().rms < 0.11 && fit.remainder().held_out_rms > 1.0, "{:?}", fit.remainder());
}

#[test]
fn known_effects_are_not_fitted_again() {
    let Made { model, .. } = made(None);
    let known = [Setting { effect: 0, values: vec![0.0] }];
    let free = model.fit(&known).unwrap().remainder().clone();
    let fixed = model.with_known(&known).fit(&known).unwrap().remainder().clone();
    assert_eq!((free.dof, fixed.dof), (87, 88));
    assert!(free.held_out_rms < 0.8 * fixed.held_out_rms, "{} {}", free.held_out_rms, fixed.held_out_rms);
}

#[test]
fn points_that_do_not_determine_the_parameters_are_refused() {
    let observations = |values: &[f64]| Observations {
        values: values.to_vec(),
        group: vec![0; values.len()],
        groups: vec!["all".into()],
        ..Observations::default()
    };
    let declared = |column: &[f64]| Declared { name: "level".into(), unit: "um".into(), column: column.to_vec() };
    let refused = |values: &[f64], columns: &[&[f64]]| {
        let columns = columns.iter().map(|column| declared(column)).collect();
        LinearTerms::new(observations(values), columns, Vec::new()).unwrap_err().to_string()
    };
    assert!(refused(&[1.0, 2.0], &[&[1.0, 1.0], &[2.0, 2.0]]).contains("do not determine"));
    assert!(refused(&[1.0, 2.0], &[&[1.0]]).contains("length"));
    assert!(refused(&[1.0, f64::NAN], &[&[1.0, 1.0]]).contains("finite"));
    assert!(refused(&[], &[&[]]).contains("do not determine"));
}
