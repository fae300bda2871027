//! Every method on rigs that it can take: the truth comes back, and closed forms equal least squares.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common::{FOUR_SENSORS, Sum, Truth, coefficient_error, disturb, linear_station, random_sum, rig};
use runout_core::{
    Complex64,
    rig::{Rig, Rotation},
    separation::Quantity,
    stage::StationSeparator,
};
use runout_spindle::{
    layout::Layout,
    selection::Selection,
    separators::{
        ClosedFormSeparator, DonaldsonReversal, HarmonicLeastSquares, Method, MultiStep, ThreePoint, Weighting,
        four_sensor_reversal,
    },
};

const SAMPLES: usize = 256;

fn truth(sections: u64) -> Truth {
    Truth {
        form_um: (0..sections).map(|section| random_sum(section + 1, 90, 12.0)).collect(),
        motion: [13, 14, 15, 16].map(|seed| random_sum(seed, 90, if seed < 15 { 4.0 } else { 20.0 })),
    }
}

fn method<M: Method>(rig: &Rig, second_order: bool, max_noise_gain: f64) -> ClosedFormSeparator {
    let (sensors, setups) = M::choose(rig);
    ClosedFormSeparator::of::<M>(Selection::new(rig, sensors, setups), second_order, max_noise_gain).unwrap()
}

/// The general separator on the sensors and setups that a method chooses.
fn general<M: Method>(rig: &Rig, second_order: bool, max_noise_gain: f64) -> HarmonicLeastSquares {
    let (sensors, setups) = M::choose(rig);
    let selection = Selection::new(rig, sensors, setups);
    HarmonicLeastSquares::of(selection, second_order, Weighting::None, max_noise_gain)
}

/// Compares a method with the general separator, order by order, also on readings that no form and motion explain.
fn agree<M: Method>(name: &str, sensors: &[(f64, f64, &str)], setups: &[(f64, f64)], limit: f64) {
    for rotation in [Rotation::Ccw, Rotation::Cw] {
        let mut rig = rig(sensors, setups);
        rig.rotation = rotation;
        let mut station = linear_station(&rig, &truth(2), SAMPLES, 8.0);
        disturb(&mut station);
        for second_order in [false, true] {
            let closed = method::<M>(&rig, second_order, limit);
            let general = general::<M>(&rig, second_order, limit);
            let max_order = station.profiles[0].max_order();
            let lost = |separator: &dyn StationSeparator| {
                let assessment = separator.assess(max_order).unwrap();
                (assessment.lost_form_orders(), assessment.lost_motion_orders())
            };
            assert_eq!(lost(&closed), lost(&general), "{name}");
            let sensitivities =
                [closed.sensitivity(&station).unwrap().unwrap(), general.sensitivity(&station).unwrap().unwrap()];
            let (closed, general) = (closed.separate(&station).unwrap(), general.separate(&station).unwrap());
            assert_eq!(closed.observable, general.observable, "{name}");
            assert!(
                closed.observable.iter().filter(|observable| **observable).count() > 100,
                "{name}: most orders are observable"
            );
            let mut worst: f64 = 0.0;
            for (index, (a, b)) in closed.estimate.iter().zip(&general.estimate).enumerate() {
                if closed.observable[index] {
                    worst = worst.max((a - b).norm());
                } else {
                    assert!(a.re.is_nan() && b.re.is_nan(), "{name}, entry {index}: a lost order is no number");
                }
            }
            println!("{name}, second order {second_order}: differ by {worst:.1e} µm or µrad");
            // 10 µm rounded to 2e-15, times a noise gain of up to 30, times 30 µrad a µm.
            assert!(worst < 1e-11, "{name}: {worst:e}");
            let pairs = sensitivities[0].operator.iter().zip(&sensitivities[1].operator);
            let difference = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(difference < 1e-11, "{name}: sensitivities differ by {difference:e}");
        }
    }
}

const REVERSAL: [(f64, f64); 2] = [(0.0, 0.0), (180.0, 180.0)];
const TRIANGLE: [(f64, f64, &str); 3] = [(20.0, 0.0, "a"), (119.844, 0.0, "a"), (222.5, 0.0, "a")];

#[test]
fn closed_forms_equal_least_squares() {
    let none = f64::INFINITY;
    agree::<DonaldsonReversal>("donaldson, one section", &[(0.0, 100.0, "a")], &REVERSAL, none);
    let two = [(90.0, 100.0, "a"), (90.0, 130.0, "b")];
    agree::<DonaldsonReversal>("donaldson, two sections", &two, &[(33.0, 12.0), (213.0, 192.0)], none);
    agree::<DonaldsonReversal>("donaldson, oblique", &[(40.0, 100.0, "a")], &REVERSAL, none);
    let oblique = [(210.0, 100.0, "a"), (210.0, 130.0, "b")];
    agree::<DonaldsonReversal>("donaldson, oblique, two sections", &oblique, &[(33.0, 12.0), (213.0, 192.0)], none);
    let steps =
        |count: i32| (0..count).map(|step| (f64::from(step) * 360.0 / f64::from(count), 0.0)).collect::<Vec<_>>();
    agree::<MultiStep>("multi-step, 7 equal", &[(0.0, 100.0, "a")], &steps(7), none);
    agree::<MultiStep>("multi-step, two sections", &two, &steps(12), none);
    agree::<MultiStep>("multi-step, unequal", &[(0.0, 100.0, "a")], &[(0.0, 0.0), (50.0, 0.0), (97.3, 0.0)], none);
    agree::<ThreePoint>("three-point", &TRIANGLE, &[(0.0, 0.0)], 30.0);
    agree::<ThreePoint>("three-point, part and sensors turned", &TRIANGLE, &[(70.0, 25.0)], 30.0);
    let twice: Vec<_> = TRIANGLE
        .iter()
        .map(|(angle, ..)| (*angle, 100.0, "a"))
        .chain(TRIANGLE.iter().map(|(angle, ..)| (angle + 7.0, 130.0, "b")))
        .collect();
    agree::<ThreePoint>("three-point, two sections", &twice, &[(0.0, 0.0)], 30.0);
}

/// A motion from x, y and the tilts about them, order by order.
fn combined(motion: &[Sum; 4], quantity: Quantity) -> Sum {
    let (sine, cosine) = quantity.azimuth().map_or((0.0, 0.0), |line| line.degrees().to_radians().sin_cos());
    let shares = match quantity {
        Quantity::Form(_) | Quantity::FaceForm(_) | Quantity::Z | Quantity::FaceMotion(_) => [0.0; 4],
        Quantity::X => [1.0, 0.0, 0.0, 0.0],
        Quantity::Y => [0.0, 1.0, 0.0, 0.0],
        Quantity::TiltX => [0.0, 0.0, 1.0, 0.0],
        Quantity::TiltY => [0.0, 0.0, 0.0, 1.0],
        Quantity::Along(_) => [cosine, sine, 0.0, 0.0],
        Quantity::TiltAlong(_) => [0.0, 0.0, -sine, cosine],
    };
    let of_order = |order: usize| {
        let parts = motion.iter().zip(shares).flat_map(|(sum, share)| sum.iter().map(move |term| (term, share)));
        let parts = parts.filter(|((known, ..), _)| *known == order);
        let sum: Complex64 = parts.map(|((_, size, phase), share)| Complex64::from_polar(size * share, *phase)).sum();
        (order, sum.norm(), sum.arg())
    };
    (2..=90).map(of_order).collect()
}

/// The truth from a rig by least squares, within rounding times the layout's noise gain; and what is not observable.
fn recovers(name: &str, sensors: &[(f64, f64, &str)], setups: &[(f64, f64)], lost: &dyn Fn(usize) -> bool) {
    let rig = rig(sensors, setups);
    let truth = truth(rig.sections.len() as u64);
    let separator = HarmonicLeastSquares::new(&rig, false, Weighting::None);
    let separation = separator.separate(&linear_station(&rig, &truth, SAMPLES, 8.0)).unwrap();
    let assessment = Layout::new(&rig, false).assess(separation.max_order());
    for section in 0..rig.sections.len() {
        let expected: Vec<usize> = (1..=separation.max_order()).filter(|order| lost(*order)).collect();
        assert_eq!(separation.lost_orders(section), expected, "{name}");
    }
    for (unknown, quantity) in separation.unknowns.iter().enumerate() {
        let sum = match quantity {
            Quantity::Form(section) => truth.form_um[*section].clone(),
            motion => combined(&truth.motion, *motion),
        };
        for order in (2..=separation.max_order()).filter(|order| !lost(*order)) {
            let error = coefficient_error(&separation, unknown, order, &sum);
            let gain = assessment.orders[order - 1].noise_gain[unknown];
            // 1e-13 µm: rounding of readings of some 10 µm.
            assert!(error < 1e-13 * gain.max(1.0), "{name}, {quantity:?}, order {order}: {error:e}, gain {gain}");
        }
    }
}

/// Arbitrary-angle reversal (Qiao, Chen, Zhao, Appl. Sci. 15(16) 9064, 2025) and hybrids need no code of their own.
#[test]
fn the_general_separator_takes_arbitrary_angles_and_hybrids() {
    let none = |_: usize| false;
    recovers("reversal by 160° with the sensors", &FOUR_SENSORS, &[(0.0, 0.0), (160.0, 160.0)], &none);
    recovers("part by 70°, sensors by 31°", &FOUR_SENSORS, &[(0.0, 0.0), (70.0, 31.0)], &none);
    recovers("three probes, part at 0 and 180", &TRIANGLE, &[(0.0, 0.0), (180.0, 0.0)], &none);
    let two_sections =
        [(0.0, 100.0, "a"), (99.844, 100.0, "a"), (202.5, 100.0, "a"), (0.0, 130.0, "b"), (90.0, 130.0, "b")];
    recovers("three and two probes, reversed", &two_sections, &REVERSAL, &none);
    let steps: Vec<_> = (0..5).map(|step| (72.0 * f64::from(step), 0.0)).collect();
    // x and y are seen, so 1/rev is determined by the clamping rule; multiples of 5 are not.
    // All along one line: motion there is all that is observable, and 1/rev is eccentricity as well as motion.
    let oblique = [(30.0, 100.0, "a"), (210.0, 130.0, "b")];
    recovers("one line at 30°, reversed", &oblique, &REVERSAL, &none);
    recovers("one line at 120°", &[(-60.0, 0.0, "a")], &[(0.0, 0.0), (50.0, 0.0), (97.3, 180.0)], &none);
    recovers("two probes, five steps", &[(0.0, 0.0, "a"), (90.0, 0.0, "a")], &steps, &|order| order % 5 == 0);
}

#[test]
fn multi_step_loses_multiples_of_its_steps() {
    for count in [3_usize, 4, 7] {
        let steps: Vec<_> = (0..count).map(|step| (step as f64 * 360.0 / count as f64, 0.0)).collect();
        let rig = rig(&[(0.0, 0.0, "a")], &steps);
        let lost = method::<MultiStep>(&rig, false, f64::INFINITY).assess(60).unwrap().lost_form_orders();
        assert_eq!(lost, (1..=60).filter(|order| order % count == 0).collect::<Vec<_>>());
    }
}

/// `docs/appendix/physics.md` section 2: noise gain of form for 0/99.844/202.5.
#[test]
fn noise_gain_of_the_reference_three_point() {
    let rig = rig(&[(0.0, 0.0, "a"), (99.844, 0.0, "a"), (202.5, 0.0, "a")], &[(0.0, 0.0)]);
    let assessment = method::<ThreePoint>(&rig, false, f64::INFINITY).assess(500).unwrap();
    let worst = |highest: usize| {
        let gains = assessment.orders[1..highest].iter().map(|order| order.noise_gain[0]);
        gains.fold(0.0, f64::max)
    };
    for (highest, expected) in [(15, 3.8), (50, 4.9), (150, 9.7)] {
        println!("three-point 0/99.844/202.5: worst noise gain to order {highest}: {:.3}", worst(highest));
        // The table gives two digits, of angles to a thousandth of a degree: 1 %.
        assert!((worst(highest) / expected - 1.0).abs() < 0.01, "{highest}: {}", worst(highest));
    }
    assert!(worst(500) > 1e3, "singular by 500");
    // ‖c‖/|W_n|, written out.
    let angles = [0.0_f64, 99.844, 202.5].map(f64::to_radians);
    let sine = |a: usize, b: usize| (angles[b] - angles[a]).sin();
    let weights = [sine(1, 2), sine(2, 0), sine(0, 1)];
    let norm = weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
    for order in &assessment.orders[1..200] {
        let phase = |angle: f64| Complex64::cis(order.order as f64 * angle);
        let transfer: Complex64 = weights.iter().zip(angles).map(|(weight, angle)| phase(angle) * *weight).sum();
        assert!((order.noise_gain[0] / (norm / transfer.norm()) - 1.0).abs() < 1e-9, "order {}", order.order);
    }
}

#[test]
fn orders_near_the_zeros_are_lost_by_the_stated_rule() {
    let rig = rig(&[(0.0, 0.0, "a"), (99.844, 0.0, "a"), (202.5, 0.0, "a")], &[(0.0, 0.0)]);
    let assessment = method::<ThreePoint>(&rig, false, 30.0).assess(300).unwrap();
    let raw = method::<ThreePoint>(&rig, false, f64::INFINITY).assess(300).unwrap();
    for (entry, raw) in assessment.orders.iter().zip(&raw.orders).skip(1) {
        let noisy = raw.noise_gain.iter().any(|gain| *gain > 30.0);
        assert_eq!(entry.observable.contains(&false), noisy, "order {}", entry.order);
        if noisy {
            assert!(entry.lost_because.as_ref().unwrap().contains("30 times"), "{:?}", entry.lost_because);
        }
    }
    assert!(assessment.lost_form_orders().contains(&255));
}

/// Methods take from a larger rig what they need, and say what they leave out.
#[test]
fn methods_choose_from_a_larger_rig() {
    let sensors = [(0.0, 100.0, "a"), (90.0, 100.0, "a"), (222.0, 100.0, "a"), (0.0, 130.0, "b"), (90.0, 130.0, "b")];
    let rig = rig(&sensors, &REVERSAL);
    let truth = truth(2);
    let station = linear_station(&rig, &truth, SAMPLES, 0.0);
    let chosen = Selection::named(&rig, None, None, four_sensor_reversal::choose).unwrap();
    let four = four_sensor_reversal::separator(chosen, false, false).unwrap();
    let separators: [(&str, Box<dyn StationSeparator>, usize, &str); 3] = [
        ("donaldson", Box::new(method::<DonaldsonReversal>(&rig, false, f64::INFINITY)), 2, "S2, S3, S5"),
        ("three-point", Box::new(method::<ThreePoint>(&rig, false, 30.0)), 1, "S4, S5, k1"),
        ("four-sensor", Box::new(four), 2, "S3"),
    ];
    for (name, separator, forms, unused) in separators {
        let assessment = separator.assess(20).unwrap();
        assert!(assessment.notes.contains(&format!("not used: {unused}")), "{name}: {:?}", assessment.notes);
        let separation = separator.separate(&station).unwrap();
        assert_eq!(separation.unknowns.iter().filter(|unknown| unknown.is_form()).count(), forms, "{name}");
        for section in 0..forms {
            let unknown = separation.position(Quantity::Form(section)).unwrap();
            for order in (2..=60).filter(|order| separation.observable[order * separation.unknowns.len() + unknown]) {
                let error = coefficient_error(&separation, unknown, order, &truth.form_um[section]);
                assert!(error < 1e-11, "{name}, order {order}: {error:e}");
            }
        }
        // Motion is that of the sensors' plane where tilt is not observable.
        assert!((separation.motion_z_mm - if forms == 1 { 100.0 } else { 0.0 }).abs() < 1e-12, "{name}");
    }
}
