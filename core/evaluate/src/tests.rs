//! Long because values, parts and limits are tested on the same few stations.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::{PI, SQRT_2};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::{
    section::missing_circles,
    trials::{fewest, trials},
};
use runout_error::fault::{Fault, Place, Step};
use runout_numerics::Complex64;
use runout_standards::gaps::Gaps;
use runout_turning::{
    measurement::Response,
    profile::Profile,
    separation::{Quantity, SectionAt, Separation},
    station::StationResult,
    surface::{SurfaceBuilder, SurfaceConfig},
};

pub(super) const RADIUS_MM: f64 = 30.0;
/// Form²/R of 6 µm on 30 mm: what centring and circles that are no limaçons leave.
const EXACT_UM: f64 = 1.2e-3;

/// A section at z with these waves (order, coefficient), orders to `highest`, each of one variance.
pub(super) fn station(
    z_mm: f64,
    waves: &[(usize, Complex64)],
    highest: usize,
    variance: f64,
    lost: &[usize],
) -> StationResult {
    let mut estimate = vec![Complex64::ZERO; highest + 1];
    for (order, value) in waves {
        estimate[*order] = *value;
    }
    let separation = Separation {
        sections: vec![SectionAt::whole("a", z_mm)],
        unknowns: vec![Quantity::Form(0)],
        estimate,
        variance: vec![variance; highest + 1],
        observable: (0..=highest).map(|order| !lost.contains(&order)).collect(),
        ..Separation::default()
    };
    StationResult { station: format!("s{z_mm}"), z_mm, angles: 720, separation, profiles: Vec::new(), truth: None }
}

pub(super) fn lobes(order: usize, amplitude_um: f64) -> (usize, Complex64) {
    (order, Complex64::from(amplitude_um))
}

pub(super) fn evaluate(text: &str) -> Result<Evaluate, Fault> {
    toml::from_str::<EvaluateConfig>(text).unwrap().check()
}

pub(super) fn find<'a>(values: &'a [Value], symbol: &str, reference: &str, filter: &str) -> &'a Value {
    let wanted = |value: &&Value| {
        value.symbol == symbol
            && value.reference.as_deref() == Some(reference)
            && value.filter.as_deref() == Some(filter)
    };
    values.iter().find(wanted).unwrap_or_else(|| panic!("no {symbol} {reference} {filter} in {values:?}"))
}

#[test]
fn three_lobes_have_the_values_of_their_amplitude() {
    // Level and eccentricity are no form; 2 µm of three lobes are 4 µm high about every circle.
    let waves = [lobes(0, 7.0), lobes(1, 5.0), lobes(3, 2.0)];
    let evaluate = evaluate("references = ['LSCI', 'MZCI', 'MICI', 'MCCI']").unwrap();
    let values = section_values(&station(0.0, &waves, 60, f64::NAN, &[7, 55, 1]), 0, &evaluate, RADIUS_MM);
    for reference in ["LSCI", "MZCI", "MICI", "MCCI"] {
        let ront = find(&values, "RONt", reference, "none");
        assert!((ront.value - 4.0).abs() < EXACT_UM, "{reference}: {}", ront.value);
        assert_eq!((&*ront.unit, ront.band_upr, ront.uncertainty.as_ref()), ("um", [2, 60], None));
        assert_eq!(ront.lost_orders, [7, 55]);
        // ISO 16610-21: of three lobes 2^-(3/50)² pass.
        let filtered = find(&values, "RONt", reference, "Gaussian 50 UPR");
        assert!((filtered.value - 4.0 * (-(3.0_f64 / 50.0).powi(2)).exp2()).abs() < EXACT_UM);
        assert_eq!((filtered.band_upr, &*filtered.lost_orders), ([2, 50], &[7, 55][..]));
    }
    for (symbol, expected) in [("RONp", 2.0), ("RONv", 2.0), ("RONq", SQRT_2)] {
        let found = find(&values, symbol, "LSCI", "none").value;
        assert!((found - expected).abs() < EXACT_UM, "{symbol} {found}");
    }
    // |d/dα 2·cos 3α| is at most 6 µm a radian.
    let steepest = find(&values, "dr/dtheta", "LSCI", "none");
    assert!((steepest.value - 6.0_f64.to_radians()).abs() < 1e-12, "{}", steepest.value);
    assert_eq!(steepest.unit, "um/deg");
    // 720 angles miss the mean of a rectified wave by (π·3/720)²/3.
    assert!((find(&values, "Ra", "mean line", "none").value - 4.0 / PI).abs() < 1e-4);
    assert_eq!(values.iter().filter(|value| value.symbol == "Ra").count(), 1);
}

#[test]
fn an_interruption_is_in_no_value_and_each_says_so() {
    // 2 µm of two lobes: without their two hills, what is left is from −2 µm to 2·cos 60° about a circle that fits it less well.
    let mut result = station(0.0, &[lobes(2, 2.0)], 60, 1e-8, &[]);
    let mut gaps = Gaps::default();
    gaps.add(-30_f64.to_radians(), 60_f64.to_radians());
    gaps.add(150_f64.to_radians(), 60_f64.to_radians());
    result.separation.sections[0].gaps = gaps;
    let evaluate = evaluate("references = ['LSCI', 'MCCI']\nfilter_upr = []").unwrap();
    let values = section_values(&result, 0, &evaluate, RADIUS_MM);
    assert!(values.iter().all(|value| (value.coverage - 2.0 / 3.0).abs() < 5e-3 && value.uncertainty.is_some()));
    for reference in ["LSCI", "MCCI"] {
        let ront = find(&values, "RONt", reference, "none").value;
        assert!((ront - 3.0).abs() < 0.02, "{reference}: {ront}");
    }
}

/// What is left of 200° of interruption surrounds no centre: MICI does not exist, and its reason is given.
#[test]
fn an_arc_says_which_circle_it_does_not_have() {
    let mut result = station(0.0, &[lobes(9, 2.0)], 60, 1e-8, &[]);
    let evaluate = evaluate("references = ['LSCI', 'MICI', 'MCCI']\nfilter_upr = []").unwrap();
    let values = section_values(&result, 0, &evaluate, RADIUS_MM);
    assert!(missing_circles(&result, 0, &evaluate, RADIUS_MM, &values).is_empty());
    // A value that is not there is said to be missing also where the circle could be found.
    let but_one: Vec<Value> =
        values.iter().filter(|value| value.reference.as_deref() != Some("MICI")).cloned().collect();
    let missing = missing_circles(&result, 0, &evaluate, RADIUS_MM, &but_one);
    assert!(missing.len() == 1 && missing[0].contains("no RONt about MICI"), "{missing:?}");
    result.separation.sections[0].gaps.add(0.0, 200_f64.to_radians());
    let values = section_values(&result, 0, &evaluate, RADIUS_MM);
    let about = |reference: &str| {
        values.iter().any(|value| value.symbol == "RONt" && value.reference.as_deref() == Some(reference))
    };
    assert_eq!(["LSCI", "MICI", "MCCI"].map(about), [true, false, true]);
    let missing = missing_circles(&result, 0, &evaluate, RADIUS_MM, &values);
    assert!(missing.len() == 1 && missing[0].contains("section a: no RONt about MICI"), "{missing:?}");
    assert!(missing[0].contains("not bounded"), "{missing:?}");
}

#[test]
fn half_of_a_wave_at_the_cut_off_is_left() {
    for cutoff in [15, 50, 150] {
        let evaluate = evaluate(&format!("filter_upr = [{cutoff}]")).unwrap();
        let values = section_values(&station(0.0, &[lobes(cutoff, 2.0)], 200, f64::NAN, &[]), 0, &evaluate, RADIUS_MM);
        let [all, half] =
            ["none", &format!("Gaussian {cutoff} UPR")].map(|filter| find(&values, "RONt", "LSCI", filter));
        // 720 angles miss the peaks of 150 lobes by the same share of both.
        assert!((half.value / all.value - 0.5).abs() < 1e-4, "{cutoff}: {}", half.value / all.value);
    }
    // 20 orders do not reach the usual cut-off.
    let values = section_values(&station(0.0, &[lobes(3, 2.0)], 20, f64::NAN, &[]), 0, &Evaluate::default(), RADIUS_MM);
    assert!(values.iter().all(|value| value.filter.as_deref() == Some("none")));
}

#[test]
fn texture_lies_between_its_wavelengths() {
    // λc = 0.8 mm on a circumference of 188.5 mm: 300 waves of 0.63 mm pass to 66 %, 5 of 37.7 mm do not.
    let evaluate = evaluate("values = ['texture']\nlambda_c_mm = 0.8").unwrap();
    let values =
        section_values(&station(0.0, &[lobes(5, 9.0), lobes(300, 1.0)], 340, f64::NAN, &[]), 0, &evaluate, RADIUS_MM);
    let passed = 1.0 - (-(300.0 * 0.8 / (60.0 * PI)).powi(2)).exp2();
    let rq = find(&values, "Rq", "mean line", "Gaussian λc 0.8 mm");
    assert!((rq.value - passed / SQRT_2).abs() < 1e-3, "{} {passed}", rq.value);
    assert_eq!(rq.band_upr, [236, 340]);
    assert!(find(&values, "Ra", "mean line", "none").value > 5.0);
}

/// 95 % intervals of values that are not linear cover the true value about as often as they say.
#[test]
fn intervals_cover_the_true_value() {
    let count = trials(200);
    let truth = [lobes(2, 1.0), lobes(3, 2.0), lobes(5, 0.7)];
    let evaluate = evaluate("values = ['roundness']\nreferences = ['MZCI']\nfilter_upr = []").unwrap();
    let of = |waves: &[(usize, Complex64)], variance| {
        let mut result = station(0.0, waves, 20, variance, &[]);
        result.angles = 90;
        section_values(&result, 0, &evaluate, RADIUS_MM).remove(0)
    };
    let expected = of(&truth, f64::NAN).value;
    let (variance, mut random) = (4e-4, ChaCha8Rng::seed_from_u64(11));
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut inside = 0;
    for _ in 0..count {
        let share = (0.5_f64 * variance).sqrt();
        let mut waves: Vec<(usize, Complex64)> =
            (2..=20).map(|order| (order, Complex64::new(share * normal(), share * normal()))).collect();
        for (order, value) in &truth {
            waves[order - 2].1 += value;
        }
        let [low, high] = of(&waves, variance).uncertainty.unwrap().interval_95;
        inside += usize::from(low <= expected && expected <= high);
    }
    // 95 % of 200 are 190 ± 3.1; coarse ends of 400 draws and what a linear model does not hold take some.
    assert!((fewest(count, [178, 200], 0.95)..=count.min(199)).contains(&inside), "{inside} of {count}");
}

#[test]
fn all_groups_are_asked_for_by_one_word() {
    let all = evaluate("values = 'all'").unwrap();
    let groups =
        [Group::Roundness, Group::Texture, Group::Cylindricity, Group::Areal, Group::Twist, Group::ErrorMotion];
    assert!(groups.iter().all(|group| all.has(*group)));
    let unknown = |text: &str| toml::from_str::<EvaluateConfig>(text).unwrap_err().to_string();
    assert!(unknown("values = 'some'").contains("\"all\" or a list"), "{}", unknown("values = 'some'"));
    assert!(unknown("values = ['area']").contains("areal"), "{}", unknown("values = ['area']"));
}

/// 95 % intervals of the steepest slope, of which noise of high orders is a good part, cover the true value: forms of 4 µm that
/// fall with order⁻¹ to 60 and with order⁻² to 20, errors of 4 nm and (of the first) 10 nm at every angle in orders to 255, of a
/// variance known from 20 degrees of freedom.
#[test]
fn intervals_of_the_steepest_slope_cover_the_true_value() {
    const HIGHEST: usize = 255;
    let count = trials(300);
    let evaluate = evaluate("values = ['roundness']\nreferences = ['LSCI']\nfilter_upr = []").unwrap();
    let of = |waves: &[(usize, Complex64)], variance: &[f64], trial: usize| {
        let mut result = station(0.0, waves, HIGHEST, f64::NAN, &[]);
        result.station = format!("s{trial}");
        result.separation.variance.copy_from_slice(variance);
        find(&section_values(&result, 0, &evaluate, RADIUS_MM), "dr/dtheta", "LSCI", "none").clone()
    };
    let mut random = ChaCha8Rng::seed_from_u64(21);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    for (fall, last, std_um) in [(-1, 60, 0.0043), (-1, 60, 0.01), (-2, 20, 0.0043)] {
        let rms: f64 = (2..=last).map(|order| 0.5 * f64::from(order).powi(2 * fall)).sum::<f64>().sqrt();
        let variance = 2.0 * std_um * std_um / (HIGHEST - 1) as f64;
        let (mut inside, mut noise, mut half, mut squares) = (0, 0.0, 0.0, 0.0);
        for trial in 0..count {
            let mut waves: Vec<(usize, Complex64)> = vec![(0, Complex64::ZERO); HIGHEST + 1];
            for order in 2..=last {
                let phase = Complex64::new(normal(), normal());
                waves[order as usize] =
                    (order as usize, phase / phase.norm() * (4.0 / rms * f64::from(order).powi(fall)));
            }
            let truth = of(&waves[2..=last as usize], &[f64::NAN; HIGHEST + 1], trial).value;
            let share = (0.5 * variance).sqrt();
            for (order, wave) in waves.iter_mut().enumerate().skip(2) {
                *wave = (order, wave.1 + Complex64::new(share * normal(), share * normal()));
            }
            // Five orders have their variance in common.
            let mut stated = vec![variance; HIGHEST + 1];
            for five in stated.chunks_mut(5) {
                five.fill(variance * (0..40).map(|_| normal().powi(2)).sum::<f64>() / 40.0);
            }
            let found = of(&waves[2..], &stated, trial);
            let [low, high] = found.uncertainty.unwrap().interval_95;
            inside += usize::from(low <= truth && truth <= high);
            noise += (found.value / truth - 1.0) / count as f64;
            half += 0.5 * (high - low) / count as f64;
            squares += (found.value - truth).powi(2) / count as f64;
        }
        let percent = 100.0 * inside as f64 / count as f64;
        let wide = half / (1.96 * squares.sqrt());
        println!(
            "order^{fall} to {last}, {std_um} µm: {percent:.1} %, {wide:.2} of 1.96 rms, noise adds {:.1} %",
            100.0 * noise
        );
        // 95 % of 300 are 285 ± 3.8; of forms that end, the lower end is that of none above their last order, which holds more.
        assert!(inside >= fewest(count, [275, 300], 0.95) && wide < 1.5, "{percent} %, {wide}");
    }
}

/// Also where no other value of the part was asked for.
#[test]
fn lost_orders_are_said_of_areal_values() {
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 64, step_mm: None });
    builder.add(&station(0.0, &[lobes(3, 1.0)], 20, 1e-6, &[1, 7]));
    builder.add(&station(5.0, &[lobes(3, 1.2)], 20, 1e-6, &[9]));
    let (surface, uncertain) = builder.build(RADIUS_MM).unwrap();
    let mut part = PartSummary::default();
    add_areal(&mut part, &surface, &uncertain, 2, &evaluate("values = ['areal']").unwrap()).unwrap();
    assert!(!part.values.is_empty() && part.values.iter().all(|value| value.lost_orders == [7, 9]));
    assert!(part.remarks.is_empty());
}

fn part(stations: &[StationResult], placed: bool, text: &str) -> PartSummary {
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 360, step_mm: None });
    for station in stations {
        builder.add(station);
    }
    part_summary(builder.sections(), 360, &evaluate(text).unwrap(), RADIUS_MM, placed).unwrap()
}

#[test]
fn centred_sections_have_their_form_and_no_taper() {
    let tapered = |z: f64, amplitude| station(z, &[lobes(0, z), lobes(1, z), lobes(3, amplitude)], 20, 1e-6, &[]);
    let found = part(&[tapered(0.0, 2.0), tapered(10.0, 3.0)], false, "");
    let cylt = find(&found.values, "CYLt", "LSCY of centred sections", "none");
    assert!((cylt.value - 6.0).abs() < EXACT_UM, "{}", cylt.value);
    // The lobes have the error of their order, √(½ · 1e-6 µm²); with all orders, four peaks of √(½ · 19 · 1e-6 µm²) each.
    let std = cylt.uncertainty.as_ref().unwrap().std;
    assert!(std > 7e-4 && std < 0.016, "{std}");
    assert!(find(&found.values, "CYLt", "MZCY of centred sections", "none").value < cylt.value + EXACT_UM);
    assert!(found.values.iter().all(|value| value.symbol.starts_with("CYL") && value.symbol != "CYLtt"));
    assert!(found.remarks[0].contains("CYLtt"));
}

/// Shares of 95 % intervals of cylindricity that cover the true value, and the stated standard uncertainty over the errors' standard
/// deviation: four sections with orders to 30 of 1/n µm, errors of `noise_um`/√n at order n.
fn cylindricity_intervals(text: &str, noise_um: f64, trials: u64) -> Vec<(String, f64, f64)> {
    const HIGHEST: usize = 30;
    let variance = |order: usize| if order < 2 { 0.0 } else { noise_um * noise_um / order as f64 };
    let of = |rings: &[Vec<(usize, Complex64)>], noisy: bool| {
        let stations: Vec<StationResult> = (rings.iter().zip(0..))
            .map(|(waves, ring)| {
                let mut station = station(8.0 * f64::from(ring), waves, HIGHEST, f64::NAN, &[]);
                if noisy {
                    station.separation.variance = (0..=HIGHEST).map(variance).collect();
                }
                station
            })
            .collect();
        part(&stations, false, text).values
    };
    let (mut inside, mut errors, mut stated): (Vec<usize>, Vec<Vec<f64>>, Vec<f64>) = Default::default();
    let mut names = Vec::new();
    for trial in 0..trials {
        let mut random = ChaCha8Rng::seed_from_u64(trial);
        let truth: Vec<Vec<(usize, Complex64)>> = (0..4)
            .map(|_| {
                let wave = |order: usize| {
                    let amplitude = rand::RngExt::random_range(&mut random, 0.3..1.0) / order as f64;
                    (order, Complex64::from_polar(amplitude, rand::RngExt::random_range(&mut random, 0.0..2.0 * PI)))
                };
                (2..=HIGHEST).map(wave).collect()
            })
            .collect();
        let mut disturbed = |(order, value): &(usize, Complex64)| {
            let share = (0.5 * variance(*order)).sqrt();
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            (*order, value + Complex64::new(share * normal(), share * normal()))
        };
        let found: Vec<Vec<(usize, Complex64)>> =
            truth.iter().map(|ring| ring.iter().map(&mut disturbed).collect()).collect();
        let (exact, found) = (of(&truth, false), of(&found, true));
        names = exact.iter().map(|value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap())).collect();
        inside.resize(exact.len(), 0);
        errors.resize(exact.len(), Vec::new());
        stated.resize(exact.len(), 0.0);
        for (index, (exact, found)) in exact.iter().zip(&found).enumerate() {
            let known = found.uncertainty.as_ref().unwrap();
            inside[index] += usize::from((known.interval_95[0]..=known.interval_95[1]).contains(&exact.value));
            errors[index].push(found.value - exact.value);
            stated[index] += known.std.powi(2);
        }
    }
    let of_value = |(index, name): (usize, String)| {
        let count = trials as f64;
        let mean = errors[index].iter().sum::<f64>() / count;
        let squares: f64 = errors[index].iter().map(|error| (error - mean).powi(2)).sum();
        (name, inside[index] as f64 / count, (stated[index] / squares).sqrt())
    };
    names.into_iter().enumerate().map(of_value).collect()
}

#[test]
fn intervals_of_cylindricity_cover_the_true_value() {
    for noise_um in [0.02, 0.3] {
        for (name, inside, ratio) in cylindricity_intervals("references = ['LSCI']\nfilter_upr = []", noise_um, 60) {
            // 95 % of 60 are 57 ± 1.7. Below 0.1 µm; above, noise is as large as the form, and only the size of ± is examined.
            assert!(noise_um > 0.1 || inside >= 0.85, "{name}, {noise_um} µm: {inside}");
            // A standard deviation of 60 is known to 9 %. Above, the least form is next to nothing, and ± reaches that far.
            assert!(
                (0.7..if noise_um > 0.1 { 3.0 } else { 2.6 }).contains(&ratio),
                "{name}, {noise_um} µm: stated {ratio} times the scatter"
            );
        }
    }
}

#[test]
#[ignore = "prints the table of docs/appendix/intervals.md, which takes minutes"]
fn intervals_of_cylindricity_by_noise() {
    for (references, trials) in [("'LSCI'", 300), ("'MZCI', 'MICI', 'MCCI'", 100)] {
        for noise_um in [0.003, 0.02, 0.05, 0.1] {
            let text = format!("references = [{references}]\nfilter_upr = []");
            for (name, inside, ratio) in cylindricity_intervals(&text, noise_um, trials) {
                println!("| {name} | {noise_um} | {:.1} % | {ratio:.2} |", 100.0 * inside);
            }
        }
    }
}

/// 95 % intervals of RONt about MICI and MCCI with two lobes, whose contacts are nearly opposite each other.
#[test]
fn intervals_cover_the_true_value_with_nearly_opposite_contacts() {
    const HIGHEST: usize = 30;
    let count = trials(300);
    let text = "values = ['roundness']\nreferences = ['MICI', 'MCCI']\nfilter_upr = []";
    let evaluate = evaluate(text).unwrap();
    for (strength, noise_um) in [(0.1, 0.001), (0.3, 0.004), (0.1, 0.008)] {
        let mut inside = [0; 2];
        for trial in 0..count as u64 {
            let mut random = ChaCha8Rng::seed_from_u64(trial);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let truth: Vec<(usize, Complex64)> = (2..=HIGHEST)
                .map(|order| {
                    let size = if order == 2 { 1.0 } else { strength / order as f64 };
                    (order, size * Complex64::new(normal(), normal()))
                })
                .collect();
            let share = noise_um / SQRT_2;
            let found: Vec<(usize, Complex64)> = truth
                .iter()
                .map(|(order, value)| (*order, value + share * Complex64::new(normal(), normal())))
                .collect();
            let of = |waves: &[(usize, Complex64)], variance| {
                let mut result = station(0.0, waves, HIGHEST, variance, &[]);
                result.angles = 240;
                section_values(&result, 0, &evaluate, RADIUS_MM)
            };
            let (exact, found) = (of(&truth, f64::NAN), of(&found, noise_um * noise_um));
            for (inside, (exact, found)) in inside.iter_mut().zip(exact.iter().zip(&found)) {
                let [low, high] = found.uncertainty.as_ref().unwrap().interval_95;
                *inside += usize::from((low..=high).contains(&exact.value));
            }
        }
        println!("{strength} µm of other lobes, errors {noise_um} µm: MICI, MCCI {inside:?} of {count}");
        // 95 % of 300 are 285 ± 3.8.
        assert!(
            inside.iter().all(|inside| (fewest(count, [273, 300], 0.95)..=count.min(298)).contains(inside)),
            "{strength} {noise_um}: {inside:?} of {count}"
        );
    }
}

#[test]
fn placed_sections_have_taper_bend_and_coaxiality() {
    // Radii 1 µm more and less at the ends: diameters differ by 4 µm.
    let cone = |z: f64, level| station(z, &[lobes(0, level)], 10, 1e-6, &[]);
    let found = part(&[cone(0.0, -1.0), cone(10.0, 0.0), cone(20.0, 1.0)], true, "references = ['LSCI']");
    let value = |symbol, reference| find(&found.values, symbol, reference, "none").value;
    assert!((value("CYLtt", "LSCY") - 2.0).abs() < EXACT_UM);
    assert!((value("CYLt", "LSCY") - 2.0).abs() < EXACT_UM);
    assert!(find(&found.values, "CYLtt", "LSCY", "none").uncertainty.is_some());

    // A section 3 µm aside: the axis lies 1 µm aside, and 2 µm from that section.
    let bent = |z: f64, aside| station(z, &[lobes(1, aside)], 10, f64::NAN, &[]);
    let found = part(&[bent(0.0, 0.0), bent(10.0, 3.0), bent(20.0, 0.0)], true, "references = ['LSCI']");
    let value = |symbol, reference| find(&found.values, symbol, reference, "none").value;
    assert!((value("coaxiality", "LSCY") - 4.0).abs() < EXACT_UM);
    assert!((value("STRsa", "LSLI of the median line") - 4.0).abs() < EXACT_UM);
    assert!((value("STRsg", "LSLI of generatrices") - 3.0).abs() < EXACT_UM);
}

/// Centres of noise alone: intervals of their distances from the datum axis begin at 0 and end above what was found.
#[test]
fn intervals_of_coaxial_sections_begin_at_zero() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (std, walls) = (0.003, trials(60));
    let mut inside = [0_usize; 3];
    for _ in 0..walls {
        let mut ring = |z: f64| {
            let centre = Complex64::new(std * normal(), std * normal());
            station(z, &[(1, centre), lobes(3, 1.5)], 10, 2.0 * std * std, &[])
        };
        let wall = [0.0, 5.0, 10.0, 15.0, 20.0].map(&mut ring);
        let found = part(&wall, true, "references = ['LSCI']\nfilter_upr = []\ndatum = ['s0', 's20']");
        for (inside, symbol) in inside.iter_mut().zip(["eccentricity", "coaxiality", "STRsa"]) {
            for value in found.values.iter().filter(|value| value.symbol == symbol) {
                let [low, high] = value.uncertainty.as_ref().unwrap().interval_95;
                assert!(low <= value.value && value.value <= high, "{symbol} {} in {low} to {high}", value.value);
                *inside += usize::from(low == 0.0);
            }
        }
    }
    // Three eccentricities a wall, coaxiality with the datum axis and with LSCY: 95 % ± 1.6, 2 and 2.8 %.
    let least = [(3, [160, 180]), (2, [106, 120]), (1, [52, 60])];
    let least = least.map(|(of_each, of_full)| fewest(of_each * walls, of_full, 0.95));
    assert!(inside.iter().zip(least).all(|(inside, least)| *inside >= least), "{inside:?} of {least:?}");
}

#[test]
fn harmonics_have_amplitude_and_the_first_crest() {
    let waves = [(3, Complex64::from_polar(2.0, -0.6)), (5, Complex64::from_polar(0.001, 1.0))];
    let evaluate = evaluate("values = ['harmonics']\nharmonics_upr = 6").unwrap();
    let values = section_values(&station(0.0, &waves, 60, 2e-4, &[4]), 0, &evaluate, RADIUS_MM);
    let orders: Vec<usize> = values.iter().map(|value| value.band_upr[0]).collect();
    assert_eq!(orders, [2, 2, 3, 3, 5, 5, 6, 6]);
    let (amplitude, phase) = (&values[2], &values[3]);
    // 2·cos(3α − 0.6) has its crest at 0.2 rad.
    assert!((amplitude.value - 2.0).abs() < 1e-12 && (phase.value - 0.2_f64.to_degrees()).abs() < 1e-9);
    assert_eq!((&*amplitude.symbol, &*phase.symbol, &*phase.unit), ("amplitude", "phase", "deg"));
    // σ = √(½·2e-4) = 0.01 µm along the amplitude, and as much across it: 0.01/(2·3) rad.
    assert!((amplitude.uncertainty.as_ref().unwrap().std - 0.01).abs() < 1e-12);
    assert!((phase.uncertainty.as_ref().unwrap().std - (0.01_f64 / 6.0).to_degrees()).abs() < 1e-12);
    // Less than noise: from 0 on, and of no phase.
    let lowest = values[4].uncertainty.as_ref().unwrap().interval_95[0];
    assert!(lowest.abs() < 1e-12 && values[5].uncertainty.is_none());
}

#[test]
fn the_slope_in_a_window_is_the_largest_change_over_it() {
    // 2·cos 3α changes by 2·2·sin(3w/2) over w.
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || -> f64 { 0.5_f64.sqrt() * 1e-3 * Distribution::<f64>::sample(&StandardNormal, &mut random) };
    let noise: Vec<(usize, Complex64)> = (2..=60).map(|order| (order, Complex64::new(normal(), normal()))).collect();
    for window in [5.0_f64, 30.0, 60.0] {
        let text = format!("references = ['LSCI']\nfilter_upr = []\nslope_window_deg = {window}");
        let values =
            section_values(&station(0.0, &[lobes(3, 2.0)], 60, 1e-6, &[]), 0, &evaluate(&text).unwrap(), RADIUS_MM);
        let slope = find(&values, "slope", &format!("LSCI, window {window}°"), "none");
        let expected = 4.0 * (1.5 * window).to_radians().sin();
        assert!((slope.value - expected).abs() < 1e-4 * expected, "{} instead of {expected}", slope.value);
        // Errors of so many orders, each twice half of 1e-6 µm² times 1 − cos nw, at one angle; the lobes alone have less.
        let mut waves = noise.clone();
        waves[1].1 += 2.0;
        let measured = section_values(&station(0.0, &waves, 60, 1e-6, &[]), 0, &evaluate(&text).unwrap(), RADIUS_MM);
        let known = find(&measured, "slope", &format!("LSCI, window {window}°"), "none").uncertainty.clone().unwrap();
        let squares: f64 = (2..=60).map(|n| 1e-6 * (1.0 - (f64::from(n) * window).to_radians().cos())).sum();
        assert!(known.std > 0.2 * squares.sqrt() && known.std < 1.5 * squares.sqrt(), "{known:?} {}", squares.sqrt());
        assert!(known.interval_95[0] < expected && expected < known.interval_95[1], "{known:?} {expected}");
    }
    assert!(evaluate("slope_window_deg = 0").is_err() && evaluate("slope_window_deg = 181").is_err());
}

#[test]
fn filters_pass_their_share_at_the_cut_off() {
    for (kind, name, share) in [
        ("gaussian", "Gaussian 50 UPR", 0.5),
        ("spline", "spline 50 UPR", 0.5),
        ("2rc", "2RC 50 UPR", 0.75),
        ("2rc-phase-correct", "2RC phase correct 50 UPR", 0.75),
    ] {
        let text = format!("references = ['LSCI']\nfilter = '{kind}'\nfilter_upr = [50]");
        let waves = [lobes(50, 2.0)];
        let values = section_values(&station(0.0, &waves, 200, f64::NAN, &[]), 0, &evaluate(&text).unwrap(), RADIUS_MM);
        let found = find(&values, "RONt", "LSCI", name).value;
        assert!((found - 4.0 * share).abs() < EXACT_UM, "{kind}: {found}");
    }
    // A band: half of both ends, nearly all between them.
    let band = evaluate("references = ['LSCI']\nfilter_upr = [150]\nhigh_pass_upr = 15").unwrap();
    for (order, share) in [(15, 0.5 * (-0.01_f64).exp2()), (150, 0.5), (40, 0.945)] {
        let waves = [lobes(order, 2.0)];
        let values = section_values(&station(0.0, &waves, 300, f64::NAN, &[]), 0, &band, RADIUS_MM);
        let value = find(&values, "RONt", "LSCI", "Gaussian 15 to 150 UPR");
        assert!((value.value / 4.0 - share).abs() < 4e-3, "{order}: {}", value.value);
        assert_eq!(value.band_upr, [15, 150]);
    }
    assert!(evaluate("high_pass_upr = 60").is_err() && evaluate("high_pass_upr = 0").is_err());
}

/// Three lobes and a scratch of 10 µm in a dale: a Gaussian of 15 UPR follows it by half a micron, the robust one does not.
#[test]
fn a_scratch_does_not_pull_the_robust_filter() {
    let width: f64 = 0.005;
    let scratch = |order: usize| {
        let share = (-0.5 * (order as f64 * width).powi(2)).exp();
        Complex64::from(-10.0 * width * (2.0 / PI).sqrt() * share)
    };
    let mut waves: Vec<(usize, Complex64)> = (2..=340).map(|order| (order, scratch(order))).collect();
    waves[1].1 += Complex64::from_polar(2.0, PI);
    let text = "references = ['LSCI']\nfilter_upr = [15]\nrobust_filter_upr = [15]";
    let values = section_values(&station(0.0, &waves, 340, 1e-9, &[]), 0, &evaluate(text).unwrap(), RADIUS_MM);
    let [plain, robust] =
        ["Gaussian 15 UPR", "robust Gaussian 15 UPR"].map(|filter| find(&values, "RONt", "LSCI", filter));
    // Of three lobes (1 + a) e^−a pass, a = 1.678 (3/15)². Orders 0 and 1 of the scratch are not in the form: 0.01 µm.
    let expected = 4.0 * 1.0671 * (-0.0671_f64).exp();
    assert!((robust.value - expected).abs() < 0.05, "{} instead of {expected}", robust.value);
    assert!((plain.value - expected).abs() > 0.15, "{}", plain.value);
    assert!(robust.uncertainty.as_ref().is_some_and(|known| known.std > 0.0 && known.std < 0.01));
}

/// A section 3 µm aside of the axis of two others, with two lobes of 0.5 µm.
#[test]
fn sections_have_their_position_about_a_datum_axis() {
    let text = "references = ['LSCI']\nfilter_upr = []\ndatum = ['s0', 's20']";
    let at =
        |z: f64, x: f64, y: f64, form: f64| station(z, &[(1, Complex64::new(x, -y)), lobes(2, form)], 10, 1e-6, &[]);
    let rings = [at(0.0, 1.0, 0.0, 0.0), at(20.0, 3.0, 4.0, 0.0), at(10.0, 5.0, 2.0, 0.5), at(30.0, 4.0, 6.0, 0.0)];
    let found = part(&rings, true, text);
    let value = |symbol, reference| find(&found.values, symbol, reference, "none");
    let eccentricity = value("eccentricity", "section a of s10, axis of s0, s20");
    // The axis passes through (2, 2) at 10 mm. Form²/R.
    assert!((eccentricity.value - 3.0).abs() < EXACT_UM && eccentricity.uncertainty.is_some(), "{eccentricity:?}");
    let runout = value("circular-run-out", "section a of s10, axis of s0, s20").value;
    // 3 cos α + ½ cos 2α is from −2.5 to 3.5.
    let lowest =
        (0..3600).map(|step| (f64::from(step) / 10.0).to_radians()).map(|a| 3.0 * a.cos() + 0.5 * (2.0 * a).cos());
    let expected = 3.5 - lowest.fold(f64::INFINITY, f64::min);
    assert!((runout - expected).abs() < EXACT_UM, "{runout} instead of {expected}");
    assert!(value("circular-run-out", "section a of s30, axis of s0, s20").value < 2.0 * EXACT_UM);
    assert!((value("coaxiality", "axis of s0, s20").value - 6.0).abs() < 2.0 * EXACT_UM);
    assert!((value("total-run-out", "axis of s0, s20").value - expected).abs() < EXACT_UM);
    assert!(value("parallelism", "LSLI of the opposite generatrix").value > 1.0);
    // What is not there is said.
    let unknown = part(&rings, true, "datum = ['s0', 'B']");
    assert!(unknown.remarks.iter().any(|remark| remark.contains("no section `B`")), "{:?}", unknown.remarks);
    let centred = part(&rings, false, text);
    assert!(centred.remarks.iter().any(|remark| remark.contains("centres")), "{:?}", centred.remarks);
    assert!(evaluate("datum = []").is_err());
}

#[test]
fn intervals_of_positions_cover_the_true_value() {
    let count = trials(60);
    let text = "references = ['LSCI']\nfilter_upr = []\ndatum = ['s0', 's20']";
    let variance = 4e-4;
    let mut inside: Vec<(String, usize)> = Vec::new();
    for trial in 0..count as u64 {
        let mut random = ChaCha8Rng::seed_from_u64(trial);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let of = |rings: &[Vec<(usize, Complex64)>], variance| {
            let stations: Vec<StationResult> = (rings.iter().zip([0.0, 20.0, 10.0, 30.0]))
                .map(|(waves, z)| station(z, waves, 12, variance, &[]))
                .collect();
            let values = part(&stations, true, text).values;
            values
                .into_iter()
                .filter(|value| value.reference.as_ref().unwrap().contains("axis of"))
                .collect::<Vec<Value>>()
        };
        let truth: Vec<Vec<(usize, Complex64)>> = (0..4)
            .map(|_| (1..=12).map(|order| (order, Complex64::new(normal(), normal()) / order as f64)).collect())
            .collect();
        let share = (0.5_f64 * variance).sqrt();
        let mut disturb =
            |(order, value): &(usize, Complex64)| (*order, value + share * Complex64::new(normal(), normal()));
        let found: Vec<Vec<(usize, Complex64)>> =
            truth.iter().map(|ring| ring.iter().map(&mut disturb).collect()).collect();
        let (exact, found) = (of(&truth, f64::NAN), of(&found, variance));
        inside.resize(exact.len(), (String::new(), 0));
        for ((name, inside), (exact, found)) in inside.iter_mut().zip(exact.iter().zip(&found)) {
            let [low, high] = found.uncertainty.as_ref().unwrap().interval_95;
            *name = format!("{} {}", exact.symbol, exact.reference.as_deref().unwrap());
            *inside += usize::from((low..=high).contains(&exact.value));
        }
    }
    println!("{inside:?}");
    // 95 % of 60 are 57 ± 1.7.
    let least = fewest(count, [50, 60], 0.95);
    assert!(inside.iter().all(|(_, inside)| *inside >= least), "{inside:?} of {count}");
}

/// A section beside the axis of others by its noise, and by more.
#[test]
fn intervals_of_a_section_beside_its_axis_hold_from_zero_on() {
    let (std, count) = (0.003, trials(40));
    for beside_um in [0.003, 0.015] {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut inside = [0_usize; 2];
        for _ in 0..count {
            let mut ring = |(z_mm, own_um): (f64, f64)| {
                let centre = Complex64::new(own_um + std * normal(), std * normal());
                station(z_mm, &[(1, centre), lobes(3, 1.5)], 10, 2.0 * std * std, &[])
            };
            let wall = [(0.0, 0.0), (5.0, 0.0), (10.0, beside_um), (15.0, 0.0), (20.0, 0.0)].map(&mut ring);
            let found = part(&wall, true, "references = ['LSCI']\nfilter_upr = []\ndatum = ['s0', 's20']");
            let of = |symbol: &str, of: &str| {
                let is_it = |value: &&Value| value.symbol == symbol && value.reference.as_ref().unwrap().contains(of);
                found.values.iter().find(is_it).unwrap().interval_95().unwrap()
            };
            let wanted = [("eccentricity", "of s10", beside_um), ("coaxiality", "axis of s0", 2.0 * beside_um)];
            for (inside, (symbol, name, truth)) in inside.iter_mut().zip(wanted) {
                let [low, high] = of(symbol, name);
                *inside += usize::from((low..=high).contains(&truth));
            }
        }
        println!("beside by {beside_um} µm: eccentricity and coaxiality within {inside:?} of {count}");
        assert!(inside.iter().all(|inside| *inside >= fewest(count, [34, 40], 0.95)), "{beside_um}: {inside:?}");
    }
}

/// Walls that are straight and parallel, and walls that are less and less so: the values grow with noise, and their intervals
/// cover the true value.
#[test]
fn intervals_of_lines_cover_the_true_value_from_zero_on() {
    let count = trials(40);
    let variance = 4e-4;
    for form_um in [0.0, 0.005, 0.03, 0.3] {
        let mut inside: Vec<(String, usize)> = Vec::new();
        for trial in 0..count as u64 {
            let mut random = ChaCha8Rng::seed_from_u64(trial);
            let mut waves = |size: f64| -> Vec<Complex64> {
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                let level = Complex64::from(size * 2.0_f64.sqrt() * normal());
                std::iter::once(level).chain((1..=6).map(|_| size * Complex64::new(normal(), normal()))).collect()
            };
            let truth: Vec<Vec<Complex64>> = (0..5).map(|_| waves(form_um)).collect();
            let found: Vec<Vec<Complex64>> = truth
                .iter()
                .map(|ring| ring.iter().zip(waves((0.5_f64 * variance).sqrt())).map(|(a, b)| a + b).collect())
                .collect();
            let of = |rings: &[Vec<Complex64>], variance| {
                let stations: Vec<StationResult> = (rings.iter().zip([0.0, 10.0, 20.0, 30.0, 40.0]))
                    .map(|(waves, z)| {
                        let waves: Vec<(usize, Complex64)> = waves.iter().copied().enumerate().collect();
                        let mut station = station(z, &waves, 6, variance, &[]);
                        (station.station, station.angles) = (format!("{z} {trial}"), 24);
                        station
                    })
                    .collect();
                let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 36, step_mm: None });
                stations.iter().for_each(|station| builder.add(station));
                let evaluate = evaluate("references = ['LSCI']\nfilter_upr = []").unwrap();
                let values = part_summary(builder.sections(), 36, &evaluate, RADIUS_MM, true).unwrap().values;
                values.into_iter().filter(|value| ["CYLtt", "STRsg", "parallelism"].contains(&&*value.symbol))
            };
            let (exact, found): (Vec<Value>, Vec<Value>) =
                (of(&truth, f64::NAN).collect(), of(&found, variance).collect());
            inside.resize(exact.len(), (String::new(), 0));
            for ((name, inside), (exact, found)) in inside.iter_mut().zip(exact.iter().zip(&found)) {
                let [low, high] = found.uncertainty.as_ref().unwrap().interval_95;
                name.clone_from(&exact.symbol);
                // A form of nothing has rounding.
                *inside += usize::from((low - 1e-9..=high).contains(&exact.value));
            }
        }
        println!("{form_um} µm: {inside:?} of {count}");
        let least = fewest(count, [34, 40], 0.95);
        // 95 % of 40 are 38 ± 1.4.
        assert!(inside.len() == 3 && inside.iter().all(|(_, inside)| *inside >= least), "{form_um}: {inside:?}");
    }
}

#[allow(clippy::type_complexity, reason = "taken apart at once by the test")]
fn limited(limits: &str) -> Vec<(Decision, Vec<(Decision, bool)>, usize)> {
    let uncertainty = |std: f64, value: f64| Uncertainty::new(std, [value - 2.0 * std, value + 2.0 * std], 400);
    let value = |reference: &str, value: f64, std: Option<f64>| Value {
        band_upr: [2, 50],
        uncertainty: std.map(|std| uncertainty(std, value)),
        ..Value::referred("RONt", value, "um", "", reference)
    };
    let all =
        [("a", value("LSCI", 4.0, Some(0.25))), ("a", value("MZCI", 3.8, Some(0.25))), ("b", value("LSCI", 4.0, None))];
    let placed: Vec<PlacedValue> = (all.iter())
        .map(|(section, value)| PlacedValue { station: Some("s0"), section: Some(section), z_mm: Some(0.0), value })
        .collect();
    let mut evaluate = Evaluate::default();
    let limit: Limit = toml::from_str(limits).unwrap();
    evaluate.add_limit(limit.check(&evaluate, &[], None).unwrap());
    let (decided, remarks) = decide(evaluate.limits(), &placed).unwrap();
    let of = |value: &LimitValue| (value.decision, value.within);
    decided.iter().map(|one| (one.decision, one.values.iter().map(of).collect(), remarks.len())).collect()
}

#[test]
fn a_crest_between_two_angles_is_not_missed() {
    // Orders 299 and 301 are 3 µm high together where they meet, at 0.61 of the way between two of 720 angles.
    let crest = 0.61 * 2.0 * PI / 720.0;
    let waves = [299, 301].map(|order: usize| (order, Complex64::from_polar(1.5, -(order as f64) * crest)));
    let evaluate = evaluate("references = ['LSCI']\nfilter_upr = []").unwrap();
    let values = section_values(&station(0.0, &waves, 359, f64::NAN, &[]), 0, &evaluate, RADIUS_MM);
    let ronp = find(&values, "RONp", "LSCI", "none").value;
    assert!((ronp - 3.0).abs() < 0.02 * 3.0, "{ronp}");
}

#[test]
fn a_form_that_is_not_observable_has_no_values() {
    let all: Vec<usize> = (1..=60).collect();
    let lost = station(0.0, &[lobes(3, 2.0)], 60, 1e-6, &all);
    assert_eq!(section_values(&lost, 0, &Evaluate::default(), RADIUS_MM), []);
    assert!(lost.over_angle(0).iter().all(|value| value.is_nan()));
    assert!(lost.separation.angle_std(0).is_nan());
}

/// 4 µm keep 9 µm, but not if an order of their band is not in them.
#[test]
fn nothing_is_proven_of_a_value_that_lacks_orders() {
    let evaluate = evaluate("references = ['LSCI']").unwrap();
    let limit: Limit = toml::from_str("symbol = 'RONt'\nunit = 'um'\nupper = 9.0").unwrap();
    let decided = |lost: &[usize], half_power_hz: Option<f64>| {
        let mut result = station(0.0, &[lobes(3, 2.0)], 160, 1e-6, lost);
        result.profiles = half_power_hz.into_iter().map(weakened).collect();
        let values = section_values(&result, 0, &evaluate, RADIUS_MM);
        let placed = values.iter().map(|value| PlacedValue { station: None, section: None, z_mm: None, value });
        let (found, _) = decide(std::slice::from_ref(&limit), &placed.collect::<Vec<_>>()).unwrap();
        found[0].values.iter().map(|value| (value.filter.clone().unwrap(), value.decision)).collect::<Vec<_>>()
    };
    let of = |none, filtered| vec![("none".to_owned(), none), ("Gaussian 50 UPR".to_owned(), filtered)];
    assert_eq!(decided(&[], None), of(Decision::Conforms, Decision::Conforms));
    assert_eq!(decided(&[20], None), of(Decision::Undecided, Decision::Undecided));
    // At 600 rpm 400 Hz are order 40, and 800 Hz order 80, of which the Gaussian passes 17 %; of order 150 it passes 0.2 %.
    // What is unfiltered says which band it has.
    assert_eq!(decided(&[], Some(400.0)), of(Decision::Conforms, Decision::Undecided));
    assert_eq!(decided(&[], Some(800.0)), of(Decision::Conforms, Decision::Undecided));
    assert_eq!(decided(&[], Some(1500.0)), of(Decision::Conforms, Decision::Conforms));
}

/// 2 µm of ten lobes behind a low-pass whose −3 dB are at order 10.8, and the same at order 11.
#[test]
fn what_a_low_pass_takes_is_in_the_interval_or_nothing_is_proven() {
    let evaluate = evaluate("references = ['LSCI']\nfilter_upr = []").unwrap();
    let of = |order: usize| {
        let response = weakened(108.0).responses.remove(0);
        let mut result = station(0.0, &[lobes(order, response.amplitude(10.0 * order as f64))], 40, 1e-8, &[]);
        result.profiles = vec![weakened(108.0)];
        find(&section_values(&result, 0, &evaluate, RADIUS_MM), "RONt", "LSCI", "none").clone()
    };
    let below = of(10);
    let [low, high] = below.uncertainty.unwrap().interval_95;
    assert!(below.value < 1.8 && low < below.value && high > 2.0 && below.weakened_above_upr.is_none());
    assert_eq!(of(11).weakened_above_upr, Some(10.8));
}

/// A form with a wave of order 300 and 3.6 µm in a band to 500 UPR, recorded with orders to 255: nothing of that band is
/// proven.
#[test]
fn nothing_is_proven_of_a_filter_that_reaches_above_the_orders() {
    let of = |limit: &str, text: &str, waves: &[(usize, Complex64)], highest: usize| {
        let limit: Limit = toml::from_str(limit).unwrap();
        let values = section_values(&station(0.0, waves, highest, 1e-8, &[]), 0, &evaluate(text).unwrap(), RADIUS_MM);
        let placed = values.iter().map(|value| PlacedValue { station: None, section: None, z_mm: None, value });
        let (found, _) = decide(std::slice::from_ref(&limit), &placed.collect::<Vec<_>>()).unwrap();
        let one = found[0].values.first().unwrap().clone();
        (one.decision, one.band_upr, one.missing)
    };
    let ront = |cutoff: u32, waves: &[(usize, Complex64)], highest: usize| {
        let limit = format!("symbol = 'RONt'\nunit = 'um'\nupper = 1.5\nfilter = 'Gaussian {cutoff} UPR'");
        of(&limit, &format!("references = ['LSCI']\nfilter_upr = [{cutoff}]"), waves, highest)
    };
    let lobe = [lobes(3, 0.22), lobes(300, 2.3)];
    let (decision, band, missing) = ront(500, &lobe[..1], 255);
    assert_eq!((decision, band), (Decision::Undecided, [2, 255]));
    assert!(missing.unwrap().contains("orders above 255"));
    assert_eq!(ront(500, &lobe, 2047), (Decision::DoesNotConform, [2, 500], None));
    // 255 orders hold all of 50 UPR; 127 of them let 1.1 % of the next one go, and 157 less than 0.1 %.
    assert_eq!(ront(50, &lobe[..1], 255), (Decision::Conforms, [2, 50], None));
    assert_eq!(ront(50, &lobe[..1], 127).0, Decision::Undecided);
    assert_eq!(ront(50, &lobe[..1], 157).0, Decision::Conforms);
    // Unfiltered it is a value of the orders that there are.
    let unfiltered = "symbol = 'RONt'\nunit = 'um'\nupper = 1.5\nfilter = 'none'";
    assert_eq!(of(unfiltered, "references = ['LSCI']", &lobe[..1], 255), (Decision::Conforms, [2, 255], None));
    // λs of 0.8 mm on 188 mm are 236 undulations; of 2.5 mm 75.
    for (lambda_s, decision) in [(0.8, Decision::Undecided), (2.5, Decision::Conforms)] {
        let text = format!("values = ['texture']\nlambda_c_mm = 8\nlambda_s_mm = {lambda_s}");
        let rz = "symbol = 'Rz'\nunit = 'um'\nupper = 1.5";
        assert_eq!(of(rz, &text, &[lobes(60, 0.2)], 255).0, decision, "{lambda_s}");
    }
}

/// What one section does not have is in no value of the wall, and a surface has no more orders than its angles hold.
#[test]
fn a_wall_and_a_surface_say_what_their_filter_asks_for_and_they_do_not_have() {
    let wall = |highest: [usize; 2]| {
        let rings = [station(0.0, &[lobes(3, 1.0)], highest[0], 1e-6, &[]), station(5.0, &[], highest[1], 1e-6, &[])];
        let found = part(&rings, false, "references = ['LSCI']");
        find(&found.values, "CYLt", "LSCY of centred sections", "Gaussian 50 UPR").absent_above_upr
    };
    assert_eq!([wall([170, 170]), wall([170, 60])], [None, Some(60)]);
    // More orders than the usual 720 angles hold, where the filter asks for them and the surface has them.
    let fine = |highest| {
        let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 1400, step_mm: None });
        for z in [0.0, 5.0] {
            builder.add(&station(z, &[lobes(300, 1.0)], highest, 1e-6, &[]));
        }
        let evaluate = evaluate("values = ['cylindricity']\nreferences = ['LSCI']\nfilter_upr = [150]").unwrap();
        let found = part_summary(builder.sections(), 1400, &evaluate, RADIUS_MM, false).unwrap();
        let cylt = find(&found.values, "CYLt", "LSCY of centred sections", "Gaussian 150 UPR");
        (cylt.absent_above_upr, cylt.value)
    };
    let (absent, cylt_um) = fine(600);
    assert!(absent.is_none() && (cylt_um - 2.0 / 16.0).abs() < 2e-3, "{cylt_um}");
    assert_eq!(fine(400).0, Some(400));
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: 64, step_mm: None });
    for z in 0..3 {
        builder.add(&station(5.0 * f64::from(z), &[lobes(3, 1.0)], 100, 1e-6, &[]));
    }
    let (surface, uncertain) = builder.build(RADIUS_MM).unwrap();
    for (lambda_s, absent) in [(8.0, Some(31)), (40.0, None)] {
        let mut part = PartSummary::default();
        let text = format!("values = ['areal']\nlambda_c_mm = 90\nlambda_s_mm = {lambda_s}");
        add_areal(&mut part, &surface, &uncertain, 2, &evaluate(&text).unwrap()).unwrap();
        assert!(
            !part.values.is_empty() && part.values.iter().all(|value| value.absent_above_upr == absent),
            "{lambda_s}"
        );
    }
}

/// The average behind a low-pass.
fn weakened(half_power_hz: f64) -> Profile {
    Profile {
        speed_rpm: Some(600.0),
        responses: vec![Response { description: "low-pass".into(), half_power_hz, order: 4, sample_rate_hz: 20_000.0 }],
        ..Profile::default()
    }
}

/// 4.0 ± 0.5 µm and 3.8 ± 0.5 µm of section a, 4.0 µm without uncertainty of section b.
#[test]
fn a_limit_is_kept_only_where_that_is_proven() {
    use Decision::{Conforms, DoesNotConform, Undecided};
    let symbol = "symbol = 'RONt'\nunit = 'um'\n";
    for (limit, decision, values) in [
        ("section = 'a'\nreference = 'LSCI'\nupper = 4.5", Conforms, vec![(Conforms, true)]),
        ("section = 'a'\nreference = 'LSCI'\nupper = 4.4", Undecided, vec![(Undecided, true)]),
        ("section = 'a'\nreference = 'LSCI'\nupper = 3.6", Undecided, vec![(Undecided, false)]),
        ("section = 'a'\nreference = 'LSCI'\nupper = 3.4", DoesNotConform, vec![(DoesNotConform, false)]),
        ("section = 'a'\nreference = 'LSCI'\nlower = 4.6", DoesNotConform, vec![(DoesNotConform, false)]),
        ("section = 'a'\nlower = 3.0\nupper = 4.5", Conforms, vec![(Conforms, true), (Conforms, true)]),
        ("section = 'a'\nupper = 4.4", Undecided, vec![(Undecided, true), (Conforms, true)]),
        ("section = 'b'\nupper = 100.0", Undecided, vec![(Undecided, true)]),
        ("section = 'b'\nupper = 1.0", Undecided, vec![(Undecided, false)]),
    ] {
        assert_eq!(limited(&format!("{symbol}{limit}")), [(decision, values, 0)], "{limit}");
    }
    assert_eq!(limited(&format!("{symbol}section = 'c'\nupper = 4.5")), [(Undecided, vec![], 1)]);
}

/// Micro as its own sign and as the Greek letter, and as a letter that every keyboard has.
#[test]
fn a_unit_may_be_written_in_each_usual_way() {
    for (symbol, units) in [
        ("RONt", ["um", "\u{b5}m", "\u{3bc}m"]),
        ("dr/dtheta", ["um/deg", "\u{b5}m/°", "\u{3bc}m/deg"]),
        ("residual-synchronous-tilt-x", ["urad", "\u{b5}rad", "\u{3bc}rad"]),
    ] {
        for unit in units {
            let limit: Limit = toml::from_str(&format!("symbol = '{symbol}'\nunit = '{unit}'\nupper = 1")).unwrap();
            assert!(limit.check(&Evaluate::default(), &[], None).is_ok(), "{symbol} {unit}");
        }
    }
    // No symbol is given to two values; Ra has a filter or none.
    let evaluate = evaluate("values = ['roundness', 'cylindricity', 'areal', 'error-motion']").unwrap();
    let mut symbols: Vec<String> = evaluate.known_values().into_iter().map(|value| value.symbol).collect();
    let count = symbols.len();
    symbols.sort();
    symbols.dedup();
    assert_eq!(symbols.len(), count);
}

#[test]
fn what_cannot_be_evaluated_is_refused_at_its_place() {
    let key = |name: &str| Step::Key(name.into());
    for (text, place, words) in [
        ("filter_upr = [50, -1]", vec![key("filter_upr"), Step::Index(1)], "above 0"),
        ("lambda_c_mm = 0.0", vec![key("lambda_c_mm")], "above 0 mm"),
        ("lambda_s_mm = 0.0025", vec![key("lambda_s_mm")], "alone"),
        ("lambda_c_mm = 0.8\nlambda_s_mm = 2.5", vec![key("lambda_s_mm")], "shorter than λc"),
        ("references = []", vec![key("references")], "at least one"),
        ("texture = { profiles = ['W'] }", vec![key("texture"), key("profiles")], "needs λc"),
        (
            "lambda_c_mm = 0.8\ntexture = { lambda_f_mm = 0.5 }",
            vec![key("texture"), key("lambda_f_mm")],
            "longer than λc",
        ),
        ("texture = { rdc_percent = [80, 20] }", vec![key("texture"), key("rdc_percent")], "ascending"),
        ("directions_deg = [30, inf]", vec![key("directions_deg"), Step::Index(1)], "degrees"),
        ("directions_deg = [400]", vec![key("directions_deg"), Step::Index(0)], "-360 and 360"),
        ("directions_deg = [0, -360]", vec![key("directions_deg"), Step::Index(1)], "-360 and 360"),
        ("harmonics_upr = 0", vec![key("harmonics_upr")], "from 2 on"),
    ] {
        let fault = evaluate(text).unwrap_err();
        assert!(fault.message.contains(words), "{fault}");
        assert_eq!(fault.place, Place::Path(place), "{text}");
    }
    for (text, at, words) in [
        ("symbol = 'RONtt'\nunit = 'um'\nupper = 1", "symbol", "did you mean `RONt`"),
        ("symbol = 'Rz'\nunit = 'um'\nupper = 1", "symbol", "lambda_c_mm"),
        ("symbol = 'RONt'\nunit = 'mm'\nupper = 1", "unit", "given in `um`"),
        ("symbol = 'RONt'\nunit = 'um'\nreference = 'MICI'\nupper = 1", "reference", "`MZCI`"),
        ("symbol = 'CYLt'\nunit = 'um'\nreference = 'LSCI'\nupper = 1", "reference", "`LSCY`"),
        ("symbol = 'synchronous-radal-x'\nunit = 'um'\nupper = 1", "symbol", "did you mean `synchronous-radial-x`"),
        ("symbol = 'total-radial-x'\nunit = 'um'\nreference = 'MZC'\nupper = 1", "reference", "`LSC`"),
        ("symbol = 'total-radial-x-with-fundamental'\nunit = 'um'\nreference = 'LSC'\nupper = 1", "reference", "`PC`"),
        ("symbol = 'synchronous-radial-at-30deg'\nunit = 'um'\nupper = 1", "symbol", "synchronous-radial"),
        ("symbol = 'RONt'\nunit = 'um'\nfilter = '50'\nupper = 1", "filter", "`Gaussian 50 UPR`"),
        ("symbol = 'RONt'\nunit = 'um'\nlower = 2\nupper = 1", "upper", "from lower = 2"),
        ("symbol = 'RONt'\nunit = 'um'\nupper = inf", "upper", "finite"),
    ] {
        let limit: Limit = toml::from_str(text).unwrap();
        let fault = limit.check(&Evaluate::default(), &[], None).unwrap_err();
        let said = format!("{fault}; {}", fault.help.clone().unwrap_or_default());
        assert!(said.contains(words), "{said}");
        assert_eq!(fault.place, Place::Path(vec![key(at)]), "{text}");
    }
    let none: Limit = toml::from_str("symbol = 'RONt'\nunit = 'um'").unwrap();
    assert!(none.check(&Evaluate::default(), &[], None).unwrap_err().message.contains("`upper`, `lower` or both"));
}

/// Sections are known of a rig; measured points bring their own.
#[test]
fn a_datum_that_the_rig_does_not_have_is_refused_at_its_name() {
    let sensor = "{ id = 'p', angle_deg = 0, section = 'A' }";
    let text = format!(
        "part_radius_mm = 30
setups = [{{ id = 'a', part_deg = 0 }}]
sensors = [{sensor}]"
    );
    let rig = toml::from_str::<runout_turning::rig::RigConfig>(&text).unwrap().check().unwrap();
    let config = |text: &str| toml::from_str::<EvaluateConfig>(text).unwrap();
    let fault = config("datum = ['A', 'B']").check_datum(&rig).unwrap_err();
    assert_eq!(fault.place, Place::Path(vec![Step::Key("datum".into()), Step::Index(1)]));
    assert!(fault.message.contains("no section `B`") && fault.help.clone().unwrap().contains("`A`"), "{fault}");
    assert!(config("datum = ['A']").check_datum(&rig).is_ok() && config("").check_datum(&rig).is_ok());
}
