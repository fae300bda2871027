//! Values of open profiles and height maps beside brute force, and how often their intervals cover the true value.
//! Long because all of them simulate the same open profiles and maps.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; one prints a table for the documentation")]

use std::f64::consts::{LN_2, PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::{Evaluated, tests::evaluate};
use crate::{
    Value,
    evaluable::{Evaluable, EvaluableKind, OpenProfile, PlaneMap},
    height_grid::HeightGrid,
};
use runout_draws::OpenErrors;

const POINTS: usize = 180;

/// What a profile is made of.
#[derive(Debug, Clone, Copy)]
enum Shape {
    /// Four waves of 300 to 12 mm.
    Waves,
    /// A bow of 4 µm and a step of 1 µm.
    Bow,
    /// All waves from 600 mm on, amplitudes falling with the power 1.5 of their number.
    Power,
    /// None.
    Line,
}

const SHAPES: [Shape; 3] = [Shape::Waves, Shape::Bow, Shape::Power];

/// How errors are made and what of them is stated.
#[derive(Debug, Clone, Copy)]
enum Noise {
    /// Independent, of a standard deviation that is known.
    Known,
    /// Independent; the standard deviation at each position is from four degrees of freedom.
    Scatter,
    /// Of each position and its neighbours, as readings that were interpolated.
    Correlated,
    /// Independent, known, and eleven times as large at the end as at the beginning.
    Uneven,
    /// Known, and beside them a bow of the whole profile, of random size and as large.
    Common,
}

const NOISES: [Noise; 3] = [Noise::Known, Noise::Scatter, Noise::Correlated];

fn z_mm() -> Vec<f64> {
    (0..POINTS).map(|at| 2.0 * at as f64).collect()
}

fn truth(shape: Shape, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut wave = |amplitude: f64, length_mm: f64| (amplitude, length_mm, TAU * random.random::<f64>());
    let waves: Vec<(f64, f64, f64)> = match shape {
        Shape::Waves => [(1.5, 300.0), (0.8, 110.0), (0.4, 35.0), (0.1, 12.0)].map(|(a, l)| wave(a, l)).to_vec(),
        Shape::Bow => vec![wave(0.3, 90.0)],
        Shape::Line => Vec::new(),
        Shape::Power => (1..=90).map(|n| wave(2.0 * f64::from(n).powf(-1.5), 600.0 / f64::from(n))).collect(),
    };
    let bow = |z: f64| match shape {
        Shape::Bow => {
            let u = z / 180.0 - 1.0;
            4.0 * u * u + 1.0 / (1.0 + (-(z - 150.0) / 4.0).exp())
        }
        _ => 0.0,
    };
    let height = |z: &f64| bow(*z) + waves.iter().map(|(a, l, phase)| a * (TAU * z / l + phase).sin()).sum::<f64>();
    z_mm().iter().map(height).collect()
}

/// Errors, and what is stated of them.
fn errors(noise: Noise, std_um: f64, seed: u64) -> (Vec<f64>, OpenErrors) {
    let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + seed);
    let white: Vec<f64> = (0..POINTS + 2).map(|_| StandardNormal.sample(&mut random)).collect();
    let exact = OpenErrors { std_um: vec![std_um; POINTS], ..OpenErrors::default() };
    match noise {
        Noise::Known => (white[..POINTS].iter().map(|one| std_um * one).collect(), exact),
        Noise::Uneven => {
            let std_um: Vec<f64> =
                (0..POINTS).map(|at| std_um * (1.0 / 6.0 + 10.0 / 6.0 * at as f64 / POINTS as f64)).collect();
            let errors = white.iter().zip(&std_um).map(|(one, std)| std * one).collect();
            (errors, OpenErrors { std_um, ..exact })
        }
        Noise::Common => {
            let change: Vec<f64> =
                (0..POINTS).map(|at| 3.0 * std_um * (2.0 * at as f64 / POINTS as f64 - 1.0).powi(2)).collect();
            let size: f64 = StandardNormal.sample(&mut random);
            let errors = white.iter().zip(&change).map(|(one, change)| std_um * one + size * change).collect();
            (errors, OpenErrors { common_um: vec![change], ..exact })
        }
        Noise::Scatter => {
            let chi2 = ChiSquared::new(4.0).unwrap();
            let stated = (0..POINTS).map(|_| std_um * (chi2.sample(&mut random) / 4.0_f64).sqrt()).collect();
            let all = OpenErrors { std_um: stated, freedom: 4.0, ..OpenErrors::default() };
            (white[..POINTS].iter().map(|one| std_um * one).collect(), all)
        }
        Noise::Correlated => {
            // Weights ½, ½·√2, ½: variance 1, correlations 0.707 and 0.25.
            let of = |at: usize| 0.5 * (white[at] + 2.0_f64.sqrt() * white[at + 1] + white[at + 2]);
            let correlation = vec![1.0, 0.5_f64.sqrt(), 0.25];
            ((0..POINTS).map(|at| std_um * of(at)).collect(), OpenErrors { correlation, ..exact })
        }
    }
}

fn values(deviation_um: Vec<f64>, errors: Result<OpenErrors, String>, of: &str, text: &str) -> Vec<Value> {
    let mut evaluate = evaluate(text).unwrap();
    evaluate.keep_given(&[EvaluableKind::OpenProfile]);
    let profile = OpenProfile { of: of.into(), z_mm: z_mm(), deviation_um, errors };
    let found = Evaluated::of(&[Evaluable::OpenProfile(profile)], &evaluate, None).unwrap();
    assert!(found.values.iter().all(|value| value.of.as_deref() == Some(of)));
    found.values
}

fn find<'a>(values: &'a [Value], symbol: &str, reference: &str) -> &'a Value {
    values.iter().find(|value| value.symbol == symbol && value.reference.as_deref() == Some(reference)).unwrap()
}

/// Of each value, trials with an interval and those of which it covers the true value.
type Shares = Vec<(String, usize, usize)>;

const ALL: &str = "values = ['straightness', 'texture']\nlambda_c_mm = 40.0";

fn shares(shape: Shape, noise: Noise, std_um: f64, trials: u64, text: &str) -> Shares {
    let mut shares: Shares = Vec::new();
    for trial in 0..trials {
        let true_um = truth(shape, trial);
        let exact = values(true_um.clone(), Err("the truth".into()), "truth", text);
        let (errors_um, stated) = errors(noise, std_um, trial);
        let measured = true_um.iter().zip(&errors_um).map(|(height, error)| height + error).collect();
        let found = values(measured, Ok(stated), &format!("trace {trial}"), text);
        for value in &exact {
            let key = format!("{} {}", value.symbol, value.reference.as_deref().unwrap());
            let place = shares.iter().position(|known| known.0 == key).unwrap_or_else(|| {
                shares.push((key.clone(), 0, 0));
                shares.len() - 1
            });
            let Some(found) = found.iter().find(|one| one.symbol == value.symbol && one.reference == value.reference)
            else {
                continue;
            };
            // A value either states an interval or says why not.
            assert_eq!(found.uncertainty.is_some(), found.no_uncertainty.is_none(), "{key}");
            if let Some(known) = &found.uncertainty {
                let [low, high] = known.interval_95;
                shares[place].1 += 1;
                shares[place].2 += usize::from(low <= value.value && value.value <= high);
            }
        }
    }
    shares
}

#[test]
fn intervals_of_straightness_cover_the_true_value() {
    // From a noise far below the form to one as large.
    let noises = [
        (Shape::Waves, Noise::Known, 0.01),
        (Shape::Waves, Noise::Known, 0.5),
        (Shape::Waves, Noise::Scatter, 0.02),
        (Shape::Waves, Noise::Correlated, 0.02),
        (Shape::Waves, Noise::Uneven, 0.05),
        (Shape::Waves, Noise::Common, 0.05),
        (Shape::Line, Noise::Known, 0.1),
        (Shape::Line, Noise::Scatter, 0.1),
        (Shape::Line, Noise::Common, 0.1),
    ];
    for (shape, noise, std_um) in noises {
        let all = shares(shape, noise, std_um, 60, "values = ['straightness']");
        for (name, stated, inside) in all {
            println!("{shape:?} {noise:?} {std_um} {name}: {inside} of {stated}");
            // 95 % of 60 are 57 ± 1.7; four of those below it.
            assert!(
                stated > 50 && inside as f64 > 0.83 * stated as f64,
                "{shape:?} {noise:?} {std_um} {name}: {inside} of {stated}"
            );
        }
    }
}

fn print_shares(text: &str, trials: u64) {
    for shape in SHAPES {
        for (noise, std_um) in
            NOISES.into_iter().flat_map(|noise| [0.002, 0.01, 0.02, 0.035, 0.1].map(|std| (noise, std)))
        {
            println!("{shape:?}, {noise:?}, {std_um} µm");
            for (name, stated, inside) in shares(shape, noise, std_um, trials, text) {
                if stated > 0 {
                    println!("| {name} | {stated} | {:.1} % |", 100.0 * inside as f64 / stated as f64);
                }
            }
        }
    }
}

#[test]
#[ignore = "prints the table of docs/appendix/texture.md, which takes a minute"]
fn intervals_of_straightness_by_noise() {
    print_shares("values = ['straightness']", 400);
}

#[test]
#[ignore = "prints shares of docs/appendix/texture.md, which takes many minutes"]
fn intervals_of_open_texture_by_noise() {
    print_shares(ALL, 200);
}

/// A Gaussian regression of degree 1 at each point, every point of the profile a neighbour; then sums over the residual.
#[test]
fn values_of_an_open_profile_are_those_of_brute_force() {
    let (z, heights) = (z_mm(), truth(Shape::Power, 7));
    let found = values(heights.clone(), Err("they were left out".into()), "part", ALL);
    let alpha = (LN_2 / PI).sqrt();
    let smooth = |at: f64| {
        let weight = |z: f64| (-PI * ((z - at) / (alpha * 40.0)).powi(2)).exp();
        let moment = |of: &dyn Fn(f64, f64) -> f64| {
            z.iter().zip(&heights).map(|(z, y)| weight(*z) * of(z - at, *y)).sum::<f64>()
        };
        let (s0, s1, s2) = (moment(&|_, _| 1.0), moment(&|x, _| x), moment(&|x, _| x * x));
        let (t0, t1) = (moment(&|_, y| y), moment(&|x, y| x * y));
        (s2 * t0 - s1 * t1) / (s0 * s2 - s1 * s1)
    };
    // Half of a cut-off is left out at both ends.
    let inside = z.iter().zip(&heights).filter(|(z, _)| (20.0..=358.0 - 20.0).contains(*z));
    let mut rough: Vec<f64> = inside.map(|(z, y)| y - smooth(*z)).collect();
    let mean = rough.iter().sum::<f64>() / rough.len() as f64;
    rough.iter_mut().for_each(|height| *height -= mean);
    let count = rough.len() as f64;
    let ra = rough.iter().map(|height| height.abs()).sum::<f64>() / count;
    let rq = (rough.iter().map(|height| height * height).sum::<f64>() / count).sqrt();
    let ends = rough.iter().fold([0.0_f64; 2], |[low, high], height| [low.min(*height), high.max(*height)]);
    for (symbol, expected) in [("Ra", ra), ("Rq", rq), ("Rt", ends[1] - ends[0])] {
        let value = find(&found, symbol, "mean line");
        // The filter's Gaussian ends where it is 1e-4 or less of its middle.
        assert!((value.value / expected - 1.0).abs() < 1e-3, "{symbol}: {} instead of {expected}", value.value);
        assert_eq!(
            (value.filter.as_deref().unwrap(), value.unit.as_str(), value.coverage),
            ("Gaussian λc 40 mm", "um", 1.0)
        );
        assert_eq!(value.no_uncertainty.as_deref(), Some("they were left out"));
    }
    // LSLI by sums over z; MZLI by every line through two points.
    let (z_mean, level) = (z.iter().sum::<f64>() / POINTS as f64, heights.iter().sum::<f64>() / POINTS as f64);
    let products: f64 = z.iter().zip(&heights).map(|(z, y)| (z - z_mean) * (y - level)).sum();
    let slope = products / z.iter().map(|z| (z - z_mean).powi(2)).sum::<f64>();
    let about: Vec<f64> = z.iter().zip(&heights).map(|(z, y)| y - level - slope * (z - z_mean)).collect();
    let (high, low) = (about.iter().copied().fold(0.0, f64::max), about.iter().copied().fold(0.0, f64::min));
    let zone = |slope: f64| {
        let over: Vec<f64> = z.iter().zip(&heights).map(|(z, y)| y - slope * z).collect();
        over.iter().copied().fold(f64::MIN, f64::max) - over.iter().copied().fold(f64::MAX, f64::min)
    };
    let lines = (0..POINTS).flat_map(|one| (0..one).map(move |other| (one, other)));
    let slopes = lines.map(|(one, other)| (heights[one] - heights[other]) / (z[one] - z[other]));
    let least = slopes.map(zone).fold(f64::MAX, f64::min);
    let rms = (about.iter().map(|value| value * value).sum::<f64>() / POINTS as f64).sqrt();
    for (symbol, reference, expected) in [
        ("STRt", "LSLI", high - low),
        ("STRp", "LSLI", high),
        ("STRv", "LSLI", -low),
        ("STRq", "LSLI", rms),
        ("STRt", "MZLI", least),
    ] {
        let value = find(&found, symbol, reference);
        assert!((value.value - expected).abs() < 1e-9, "{symbol} {reference}: {} instead of {expected}", value.value);
        assert!(value.source.contains("ISO 12780-1") && value.filter.as_deref() == Some("none"));
    }
    assert!(find(&found, "STRt", "MZLI").value < find(&found, "STRt", "LSLI").value);
}

#[test]
fn what_is_asked_for_is_given_and_nothing_else() {
    let of = |text: &str| values(truth(Shape::Waves, 1), Err("why".into()), "part", text);
    let symbols = |text: &str| {
        of(text)
            .iter()
            .map(|value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap()))
            .collect::<Vec<_>>()
    };
    let usual = ["STRt LSLI", "STRp LSLI", "STRv LSLI", "STRq LSLI", "STRt MZLI"];
    assert_eq!(symbols(""), usual);
    assert_eq!(symbols("references = ['MZCI', 'MICI']"), ["STRt MZLI"]);
    assert!(symbols("values = ['texture']").is_empty(), "without λc there is no roughness profile");
    assert!(symbols("values = ['texture']\ntexture = { profiles = ['P'] }").contains(&"Pq mean line".to_owned()));
    let short = OpenProfile {
        of: "part".into(),
        z_mm: vec![0.0, 1.0, 2.0],
        deviation_um: vec![0.0, 1.0, 0.0],
        errors: Err("why".into()),
    };
    let found = Evaluated::of(&[Evaluable::OpenProfile(short)], &evaluate(ALL).unwrap(), None).unwrap();
    let unknown = "STRt about LSLI, STRp about LSLI, STRv about LSLI, STRq about LSLI, STRt about MZLI: why";
    assert_eq!(
        found.remarks,
        ["part: texture needs 7 points or more, found 3".to_owned(), format!("part: no uncertainty of {unknown}")]
    );
}

/// Two values by name, and a number of them in the place of many names; nothing of values that have one.
#[test]
fn what_has_no_uncertainty_is_said_with_the_reason() {
    let profile = |errors| {
        let (z_mm, deviation_um) = (z_mm(), truth(Shape::Waves, 1));
        Evaluable::OpenProfile(OpenProfile { of: "guideway".into(), z_mm, deviation_um, errors })
    };
    let said = |errors, text: &str| Evaluated::of(&[profile(errors)], &evaluate(text).unwrap(), None).unwrap().remarks;
    let unknown = || Err("one trace only".to_owned());
    let mzli = said(unknown(), "values = ['straightness']\nreferences = ['MZCI']");
    assert_eq!(mzli, ["guideway: no uncertainty of STRt about MZLI: one trace only"]);
    let both =
        Evaluated::of(&[profile(unknown()), profile(unknown())], &evaluate("references = ['MZCI']").unwrap(), None)
            .unwrap();
    assert_eq!(both.remarks, ["guideway, guideway: no uncertainty of STRt about MZLI: one trace only"], "said once");
    let texture = said(unknown(), "values = ['texture']\nlambda_c_mm = 40.0");
    assert!(texture[0].ends_with(" values: one trace only") && texture.len() == 1, "{texture:?}");
    let known = OpenErrors { std_um: vec![1e-3; POINTS], ..OpenErrors::default() };
    assert_eq!(said(Ok(known), "values = ['straightness']"), Vec::<String>::new());
}

fn plane(heights_nm: impl Fn(f64, f64) -> f64) -> PlaneMap {
    let (columns, rows) = (60_usize, 50_usize);
    let nodes = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let height_nm = nodes
        .map(|(column, row)| if (column, row) == (4, 7) { f64::NAN } else { heights_nm(column as f64, row as f64) });
    let grid = HeightGrid {
        columns,
        step_x_mm: 0.01,
        step_y_mm: 0.02,
        origin_x_mm: 0.0,
        origin_y_mm: 0.0,
        std_nm: Some(0.1),
        height_nm: height_nm.collect(),
    };
    PlaneMap::new("measured", grid)
}

fn areal(map: PlaneMap, text: &str) -> Evaluated {
    let mut evaluate = evaluate(text).unwrap();
    evaluate.keep_given(&[EvaluableKind::HeightMap]);
    Evaluated::of(&[Evaluable::HeightMap(map)], &evaluate, None).unwrap()
}

#[test]
fn values_of_a_height_map_are_those_of_brute_force() {
    let surface = |x: f64, y: f64| 5.0 * (0.3 * x).sin() + 3.0 * (0.2 * y + 0.1 * x).cos() + 7.0 * x - 4.0 * y + 100.0;
    let map = plane(surface);
    // The least-squares plane by sweeps, one term after the other, until nothing changes.
    let nodes: Vec<(f64, f64, f64)> = map
        .grid
        .height_nm
        .iter()
        .enumerate()
        .filter(|(_, height)| height.is_finite())
        .map(|(node, height)| ((node % 60) as f64 - 29.5, (node / 60) as f64 - 24.5, *height))
        .collect();
    let mut left: Vec<f64> = nodes.iter().map(|node| node.2).collect();
    for _ in 0..50 {
        for term in [|_: &(f64, f64, f64)| 1.0, |node: &(f64, f64, f64)| node.0, |node: &(f64, f64, f64)| node.1] {
            let products: f64 = nodes.iter().zip(&left).map(|(node, left)| term(node) * left).sum();
            let share = products / nodes.iter().map(|node| term(node).powi(2)).sum::<f64>();
            left.iter_mut().zip(&nodes).for_each(|(left, node)| *left -= share * term(node));
        }
    }
    let count = left.len() as f64;
    let sq = 1e-3 * (left.iter().map(|height| height * height).sum::<f64>() / count).sqrt();
    let sa = 1e-3 * left.iter().map(|height| height.abs()).sum::<f64>() / count;
    let sz = 1e-3 * (left.iter().copied().fold(0.0, f64::max) - left.iter().copied().fold(0.0, f64::min));
    let found = areal(map.clone(), "values = ['areal']");
    for (symbol, expected) in [("Sq", sq), ("Sa", sa), ("Sz", sz)] {
        let value = found.values.iter().find(|value| value.symbol == symbol).unwrap();
        assert!((value.value - expected).abs() < 1e-12, "{symbol}: {} instead of {expected}", value.value);
        assert_eq!(
            (value.reference.as_deref().unwrap(), value.unit.as_str()),
            ("least-squares plane removed, mean", "um")
        );
        assert!((value.coverage - (1.0 - 1.0 / 3000.0)).abs() < 1e-12);
        assert!(value.uncertainty.is_none() && value.no_uncertainty.as_ref().unwrap().contains("point by point"));
    }
    let sq_of = |text: &str| {
        let found = areal(map.clone(), text);
        let value = found.values.iter().find(|value| value.symbol == "Sq").unwrap();
        (value.value, value.filter.clone(), found.remarks)
    };
    assert!(sq_of("values = ['areal']\nareal = { form = 'none' }").0 > 10.0 * sq, "the tilt stays");
    assert!(sq_of("values = ['areal']\nareal = { form = 'polynomial', degree = 4 }").0 < sq);
    assert!(areal(map.clone(), "").values.is_empty(), "areal values are on request");
    // Waves of 0.21 mm along x and 0.63 mm along y: of the former nearly all passes at a cut-off of 0.25 mm.
    let (value, filter, remarks) = sq_of("values = ['areal']\nlambda_c_mm = 0.25");
    assert_eq!(filter.as_deref(), Some("Gaussian λc 0.25 mm"));
    assert!(
        value < sq && remarks[0].starts_with("measured: areal values leave out 13 columns and 7 rows"),
        "{remarks:?}"
    );
    let (_, _, remarks) = sq_of("values = ['areal']\nlambda_c_mm = 0.4");
    assert!(remarks[0].contains("shorter than two cut-offs λc = 0.4 mm along x:"), "{remarks:?}");
}

#[test]
fn groups_that_nothing_gives_are_refused_by_name_and_left_out_of_all() {
    let config = |text: &str| toml::from_str::<super::EvaluateConfig>(text).unwrap();
    let open = [EvaluableKind::OpenProfile];
    let fault = config("values = ['straightness', 'areal']").check_given(&open).unwrap_err();
    let said = format!("{fault:?}");
    assert!(said.contains("values of `areal`") && said.contains("the separator offers open-profile"), "{said}");
    assert!(config("values = 'all'").check_given(&open).is_ok() && config("").check_given(&open).is_ok());
    let mut all = config("values = 'all'").check().unwrap();
    all.keep_given(&open);
    let symbols: Vec<String> = all.known_values().into_iter().map(|value| value.symbol).collect();
    assert!(symbols.contains(&"STRt".to_owned()) && !symbols.contains(&"RONt".to_owned()), "{symbols:?}");
    assert!(!symbols.contains(&"Ra".to_owned()), "without λc an open profile has none");
    // Circles inside and around have no line: nothing would be left of straightness.
    let circles = config("references = ['MICI']");
    assert!(format!("{:?}", circles.check_given(&open).unwrap_err()).contains("no reference line"));
    assert!(config("references = ['MICI', 'MZCI']").check_given(&open).is_ok());
    assert!(config("values = ['texture']\nreferences = ['MICI']").check_given(&open).is_ok());
    assert!(circles.check_given(&[EvaluableKind::ClosedProfiles]).is_ok());
    let maps = [EvaluableKind::HeightMap];
    let wall = config("values = ['areal']\nareal = { form = 'cone' }").check_given(&maps).unwrap_err();
    assert!(format!("{wall:?}").contains("no wall of a cylinder"));
    let turned = [EvaluableKind::ClosedProfiles, EvaluableKind::AxisMotion];
    assert!(config("values = ['roundness', 'error-motion', 'texture', 'areal']").check_given(&turned).is_ok());
}
