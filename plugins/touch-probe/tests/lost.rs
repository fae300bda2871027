//! What setups lose, and points that are not what they should be.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::support;
use crate::support::{column, config, configuration, flags, lobing, scenario, setups, table, value};
use runout_core::{
    points::Points,
    stage::{Outcome, PointSeparator},
};

fn refused(scenario: &runout_touch_probe::simulate::TouchProbeScenario, points: &Points) -> String {
    config(scenario, 6, Some(2.0)).separate(points).unwrap_err().to_string()
}

/// Turned by 120°: every third order is lost, also in the tables, and is a number again with a third angle.
#[test]
fn orders_that_the_setups_do_not_separate_are_null() {
    let scenario = scenario(1, &setups(&[(0.0, 0.0), (120.0, 0.0)]));
    let probe = config(&scenario, 12, None);
    assert!(probe.notes().iter().any(|note| note.starts_with("lost orders of lobing: 1, 3, 6, 9, 12")));
    let outcome = probe.separate(&scenario.touched().points()).unwrap();
    let rows = table(&outcome, "lobing");
    let lost = flags(rows.column_by_name("lobing_lost").unwrap());
    for (index, order) in (2..=12).enumerate() {
        let amplitude = value(&outcome, &format!("lobe_{order}_amplitude"));
        assert_eq!(lost[index], order % 3 == 0);
        assert_eq!(amplitude.value.is_nan(), order % 3 == 0, "{order}");
        assert_eq!(column(&rows, "amplitude_um")[index].is_nan(), order % 3 == 0);
        assert_eq!(column(&rows, "form_amplitude_um")[index].is_nan(), order % 3 == 0);
    }
    let form = outcome.form().unwrap();
    assert_eq!(form.sections[0].lost_orders(0), [3, 6, 9, 12]);
}

/// The probe turned instead of the ring: the same, in the probe's frame.
#[test]
fn a_turned_probe_separates_as_well() {
    let mut scenario = scenario(4, &setups(&[(0.0, 0.0), (0.0, 100.0), (0.0, 217.0)]));
    scenario.std_um = 0.05;
    let outcome = config(&scenario, 12, None).separate(&scenario.touched().points()).unwrap();
    let truth = lobing(&scenario);
    for order in [2, 3, 6, 9] {
        let found = value(&outcome, &format!("lobe_{order}_amplitude"));
        assert!((found.value - truth.amplitude(order)).abs() < 4.0 * found.std().unwrap(), "{order}");
    }
    let [a, b] = truth.parts(3);
    let phase = value(&outcome, "lobe_3_phase");
    assert!((phase.value - (-b).atan2(a).to_degrees()).abs() < 4.0 * phase.std().unwrap());
}

/// One setup: lobing is what is read, and its uncertainty holds the ring's form.
#[test]
fn the_bound_of_the_ring_goes_into_the_uncertainty() {
    let scenario = scenario(2, &setups(&[(0.0, 0.0)]));
    let fault = configuration(&scenario, 15, None).separator().unwrap_err();
    assert!(format!("{fault:?}").contains("ring_form_um"));
    let (mut inside, mut all) = (0, 0);
    for seed in 0..40 {
        let mut scenario = scenario.clone();
        scenario.seed = seed;
        let form: Vec<f64> = (0..720).map(|index| scenario.form_um(f64::from(index).to_radians() / 2.0)).collect();
        let bound = support::range(&form);
        let outcome = config(&scenario, 15, Some(bound)).separate(&scenario.touched().points()).unwrap();
        assert!(outcome.evaluables.is_empty());
        let rows = table(&outcome, "pretravel");
        let truth = lobing(&scenario);
        let found = column(&rows, "pretravel_um");
        for (index, std) in column(&rows, "std_pretravel_um").iter().enumerate() {
            assert!(*std > bound / 3.0);
            all += 1;
            let direction = column(&rows, "direction_deg")[index].to_radians();
            inside += usize::from((found[index] - truth.at(direction)).abs() < 1.96 * std);
        }
    }
    assert!(inside as f64 > 0.95 * f64::from(all), "{inside} of {all}");
}

/// The compensation brings touches of another ring to its radius.
#[test]
fn the_compensation_is_to_be_added() {
    let mut scenario = scenario(6, &setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]));
    scenario.std_um = 0.02;
    let outcome = config(&scenario, 15, None).separate(&scenario.touched().points()).unwrap();
    let rows = table(&outcome, "compensation");
    let [x, y] = ["dx_mm", "dy_mm"].map(|name| column(&rows, name));
    scenario.ring.random_rms_um = 0.0;
    scenario.setups =
        vec![runout_touch_probe::simulate::Placed { centre_um: [0.0; 2], ..setups(&[(0.0, 0.0)])[0].clone() }];
    scenario.repeats = 1;
    let touched = scenario.touched();
    let corrected = touched.place_mm.iter().zip(x.iter().zip(&y)).map(|([x, y], (dx, dy))| [x + dx, y + dy]);
    let corrected: Vec<[f64; 2]> = corrected.collect();
    let mean = corrected.iter().map(|[x, y]| x.hypot(*y)).sum::<f64>() / corrected.len() as f64;
    assert!((mean - 25.0).abs() < 5e-5, "{mean}");
    // Order 1 of lobing stays: it is centring.
    let [before, after] = [&touched.place_mm, &corrected].map(|places| support::range(&support::about_circle(places)));
    // An order without evidence beside touches that are unlike the others is not compensated.
    assert!(before > 10.0 && after < 0.6, "{before} {after}");
}

fn with(points: &Points, name: &str, change: impl Fn(f64) -> f64) -> Points {
    let mut points = points.clone();
    let column = points.columns.iter_mut().find(|column| column.name == name).unwrap();
    column.values.iter_mut().for_each(|value| *value = change(*value));
    points
}

fn without(points: &Points, name: &str) -> Points {
    let mut points = points.clone();
    points.columns.retain(|column| column.name != name);
    points
}

#[test]
fn points_that_are_not_what_they_should_be() {
    let scenario = scenario(2, &setups(&[(0.0, 0.0)]));
    let points = scenario.touched().points();
    let separate = |points: &Points| -> Outcome { config(&scenario, 6, Some(2.0)).separate(points).unwrap() };
    assert!(refused(&scenario, &without(&points, "radius_mm")).contains("radius_mm"));
    assert!(refused(&scenario, &without(&points, "direction_deg")).contains("direction_deg"));
    assert!(refused(&scenario, &with(&points, "radius_mm", |mm| 2.0 * mm)).contains("diameter"));
    assert!(refused(&scenario, &with(&points, "radius_mm", |mm| 1e3 * mm)).contains("µm"));
    let mut unknown = points.clone();
    unknown.labels[0].values[3] = "r7".into();
    assert!(refused(&scenario, &unknown).contains("r7"));
    let mut two = points.clone();
    two.columns.iter_mut().for_each(|column| column.values.truncate(2));
    two.labels[0].values.truncate(2);
    assert!(refused(&scenario, &two).contains("2 touches"), "{}", refused(&scenario, &two));
    assert!(refused(&scenario, &with(&points, "direction_deg", f64::to_radians)).contains("radians"));
    // Repeats are counted where they are not named, and directions that do not repeat leave the noise to the residual.
    let counted = separate(&without(&points, "repeat"));
    // A phase that is not observable is NaN, which equals nothing.
    assert_eq!(format!("{:?}", counted.values), format!("{:?}", separate(&points).values));
    let mut scattered = points.clone();
    let angles = scattered.columns.iter_mut().find(|column| column.name == "direction_deg").unwrap();
    angles.values.iter_mut().enumerate().for_each(|(row, angle)| *angle += 2.0 * (row / 60) as f64);
    let scattered = separate(&without(&scattered, "repeat"));
    assert!(scattered.remarks.iter().any(|remark| remark.contains("touched twice")), "{:?}", scattered.remarks);
    // Places instead of directions and radii.
    let touched = scenario.touched();
    let mut places = without(&without(&points, "direction_deg"), "radius_mm");
    for (axis, name) in ["x_mm", "y_mm"].into_iter().enumerate() {
        let values = touched.place_mm.iter().map(|place| place[axis]).collect();
        places.columns.push(runout_core::points::Column { name: name.into(), values });
    }
    let of_places = separate(&places);
    let [one, other] = [&of_places, &counted].map(|outcome| value(outcome, "lobe_3_amplitude").value);
    assert!((one - other).abs() < 0.02, "{one} {other}");
    let mut stated = configuration(&scenario, 6, Some(2.0));
    stated.std_um = Some(0.0009);
    let stated = stated.separator().unwrap().separate(&points).unwrap();
    assert!(stated.remarks.iter().any(|remark| remark.contains("it may be in mm")));
}

/// 24 even directions do not determine 15 orders: those that they do not are lost, and the others keep their uncertainty.
#[test]
fn orders_that_the_directions_do_not_determine_are_lost() {
    let mut scenario = scenario(8, &setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]));
    scenario.directions = 24;
    let outcome = config(&scenario, 15, None).separate(&scenario.touched().points()).unwrap();
    let said = outcome.remarks.iter().any(|remark| remark.starts_with("24 directions determine orders up to 11"));
    assert!(said, "{:?}", outcome.remarks);
    let mean = value(&outcome, "pretravel_mean");
    assert!(mean.std().unwrap() < 1.0, "{mean:?}");
    assert!(value(&outcome, "lobe_14_amplitude").value.is_nan());
}

/// In 16 directions, order 8 is a cosine alone: its sine is 0 at all touches but for their rounding, and each other order is read as one more.
#[test]
fn directions_that_determine_no_order_are_refused() {
    let mut scenario = scenario(8, &setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]));
    scenario.directions = 16;
    let points = scenario.touched().points();
    let refused = config(&scenario, 15, None).separate(&points).unwrap_err();
    assert!(refused.to_string().contains("do not determine orders up to 15"), "{refused}");
    assert!(format!("{refused:?}").contains("at least 31 directions"), "{refused:?}");
    let fewer = config(&scenario, 7, None).separate(&points).unwrap();
    assert!(value(&fewer, "lobe_3_amplitude").std().unwrap() < 0.5);
}
