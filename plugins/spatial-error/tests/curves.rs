//! Component curves: against the errors of simulated axes, and the error that is left when they are taken away.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::support::{scenario, separator, value};
use nalgebra::{DMatrix, DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    component_curves::{ComponentCurves, symbols},
    stage::{Outcome, PointSeparator},
};
use runout_spatial_error::simulate::{Layout, Scenario, Simulated, SimulatedEffect};

/// The errors that the tests hide, with their orders.
const HIDDEN: [(&str, u32, f64); 9] = [
    ("EXX", 3, 6.0),
    ("EYX", 2, 5.0),
    ("EZX", 3, -4.0),
    ("EYY", 2, -5.0),
    ("EXY", 2, 4.0),
    ("EZZ", 2, 6.0),
    ("EAX", 2, 25.0),
    ("EBY", 1, 30.0),
    ("ECX", 2, -20.0),
];

fn machine(seed: u64) -> Scenario {
    let layout = Layout::Grid { from_mm: [0.0; 3], to_mm: [600.0, 400.0, 350.0], counts: [7, 5, 5] };
    let one = |(target, order, size): &(&str, u32, f64)| {
        let targets = [(*target).to_owned()];
        if "ABC".contains(&target[1..2]) {
            SimulatedEffect::Angular { targets, order: *order, amplitude_urad: *size }
        } else if target[1..2] == target[2..3] {
            SimulatedEffect::Positioning { targets, order: *order, amplitude_um: *size }
        } else {
            SimulatedEffect::Straightness { targets, order: *order, amplitude_um: *size }
        }
    };
    let mut effect: Vec<SimulatedEffect> = HIDDEN.iter().map(one).collect();
    effect.push(SimulatedEffect::Scale { targets: ["X".into()], scale_um_per_m: 40.0 });
    for (target, angle_urad) in [("XY", 35.0), ("XZ", -20.0), ("YZ", 15.0)] {
        effect.push(SimulatedEffect::Squareness { targets: [target.into()], angle_urad });
    }
    Scenario { layout, effect, field: None, ..scenario(seed) }
}

fn curves(outcome: &Outcome) -> ComponentCurves {
    let mut all = ComponentCurves::default();
    outcome.tables.iter().for_each(|table| all.take(&table.table, &table.rows).unwrap());
    all
}

/// Powers of a Legendre polynomial of low order, u from −1 to 1.
fn polynomial(order: u32, u: f64) -> f64 {
    match order {
        1 => u,
        2 => 1.5 * u * u - 0.5,
        _ => 2.5 * u.powi(3) - 1.5 * u,
    }
}

/// Nodes of the lines between them that are nearest to a curve, u from −1 to 1, over the whole travel.
fn nearest_lines(nodes: usize, curve: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let dense = 2000;
    let u = |row: usize| (2.0 * row as f64 + 1.0) / f64::from(dense) - 1.0;
    let count = usize::try_from(dense).unwrap();
    let hat =
        |row: usize, node: usize| (1.0 - (0.5 * (u(row) + 1.0) * (nodes - 1) as f64 - node as f64).abs()).max(0.0);
    let design = DMatrix::from_fn(count, nodes, hat);
    let values = DVector::from_fn(count, |row, _| curve(u(row)));
    design.svd(true, true).solve(&values, 1e-12).unwrap().iter().copied().collect()
}

/// Slope of the line that fits best.
fn slope(at: &[f64], values: &[f64]) -> f64 {
    let middle = at.iter().sum::<f64>() / at.len() as f64;
    let squares: f64 = at.iter().map(|at| (at - middle).powi(2)).sum();
    at.iter().zip(values).map(|(at, value)| (at - middle) * value).sum::<f64>() / squares
}

/// Less the line, or the mean, that fits best.
fn referenced(at: &[f64], values: &[f64], line: bool) -> Vec<f64> {
    let columns = if line { 2 } else { 1 };
    let design = DMatrix::from_fn(at.len(), columns, |row, column| at[row].powi(i32::try_from(column).unwrap()));
    let values = DVector::from_column_slice(values);
    let fit = design.clone().svd(true, true).solve(&values, 1e-12).unwrap();
    (values - design * fit).iter().copied().collect()
}

#[test]
fn curves_are_those_of_the_axes_within_their_uncertainty() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..3 {
        let outcome = separator("curves = { pitch_mm = [100.0, 100.0, 87.5] }")
            .separate(&machine(seed).simulate().points())
            .unwrap();
        let found = curves(&outcome);
        assert_eq!(found.axes(), ["X", "Y", "Z"]);
        let (mut of_turn, mut of_line) = (0.0, 0.0);
        for axis in 0..3 {
            let nodes = found.of_axis(["X", "Y", "Z"][axis]);
            assert_eq!(nodes.len(), [7, 5, 5][axis]);
            let at: Vec<f64> = nodes.iter().map(|node| node.position).collect();
            for (error, symbol) in symbols(["X", "Y", "Z"][axis]).iter().enumerate() {
                let blind = ["EAZ", "EBZ", "ECZ", "ECY"].contains(&symbol.as_str());
                assert!(nodes.iter().all(|node| node.errors[error].is_nan() == blind), "{symbol}");
                if blind {
                    continue;
                }
                let curve = |u: f64| -> f64 {
                    let own = HIDDEN.iter().filter(|(target, ..)| target == symbol);
                    let scale = if symbol == "EXX" { 0.04 * 300.0 * u } else { 0.0 };
                    own.map(|(_, order, size)| size * polynomial(*order, u)).sum::<f64>() + scale
                };
                let truth = nearest_lines(nodes.len(), &curve);
                match symbol.as_str() {
                    "EZX" => of_line = 1e3 * slope(&at, &truth),
                    "ECX" => of_turn = truth.iter().sum::<f64>() / truth.len() as f64,
                    _ => {}
                }
                let truth = referenced(&at, &truth, error < 3 && error != axis);
                for (node, truth) in nodes.iter().zip(truth) {
                    let (found, std) = (node.errors[error], node.std[error]);
                    assert!(std > 0.0 && std < if error < 3 { 1.0 } else { 8.0 }, "{symbol}: ± {std}");
                    let z_score = (found - truth) / std;
                    assert!(z_score.abs() < 5.0, "{symbol} at {}: {found} ± {std}, is {truth}", node.position);
                    squares += z_score * z_score;
                    count += 1.0;
                }
            }
        }
        // The mean of ECX turns Y against X, and the line of EZX is that of X.
        for (symbol, truth) in [("EC0Y", -35.0 + of_turn), ("EB0Z", -20.0 + of_line), ("EA0Z", -15.0)] {
            let found = value(&outcome, symbol, None);
            let std = found.std().unwrap();
            assert!(std < 3.0, "{symbol} ± {std}");
            assert!((found.value - truth).abs() < 4.0 * std, "{symbol}: {found:?}, is {truth}");
        }
    }
    let chi2: f64 = squares / count;
    assert!((0.6..1.5).contains(&chi2), "{chi2} of {count}");
}

fn at_end(axis: usize) -> f64 {
    [600.0, 400.0, 350.0][axis]
}

/// Where the chain with these curves takes a command: bodies one after the other, full rotations.
fn moved_um(curves: &ComponentCurves, place: [f64; 3]) -> Vector3<f64> {
    let known = |value: f64| if value.is_nan() { 0.0 } else { value };
    let location = |symbol: &str| {
        let found = curves.location.iter().find(|error| error.symbol == symbol).unwrap();
        1e-6 * known(found.value)
    };
    let middle = Vector3::from(curves.nodes[0].at_mm.map(|_| 0.0)) + Vector3::new(300.0, 200.0, 175.0);
    let offset = Vector3::from(place) - middle;
    let mut carried = Isometry3::identity();
    for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
        let nodes = curves.of_axis(letter);
        let upper = nodes.iter().position(|node| node.position >= place[axis] - 1e-9).unwrap_or(nodes.len() - 1).max(1);
        let (low, high) = (nodes[upper - 1], nodes[upper]);
        let share = (place[axis] - low.position) / (high.position - low.position);
        let of = |error: usize| known(low.errors[error]) * (1.0 - share) + known(high.errors[error]) * share;
        let mut direction = Vector3::zeros();
        direction[axis] = 1.0;
        match letter {
            "Y" => direction.x = -location("EC0Y"),
            "Z" => (direction.x, direction.y) = (location("EB0Z"), -location("EA0Z")),
            _ => {}
        }
        let along = direction * offset[axis] + 1e-3 * Vector3::new(of(0), of(1), of(2));
        let turned = UnitQuaternion::from_scaled_axis(1e-6 * Vector3::new(of(3), of(4), of(5)));
        carried *= Isometry3::from_parts(Translation3::from(along), turned);
    }
    1e3 * ((carried * Point3::origin()).coords - offset)
}

/// Root mean square length of errors at places, less the rigid motion that fits best.
fn free_rms_um(places: &[[f64; 3]], errors: &[Vector3<f64>]) -> f64 {
    let design = DMatrix::from_fn(3 * places.len(), 6, |row, column| {
        let (place, axis) = (Vector3::from(places[row / 3]) * 1e-3, row % 3);
        if column < 3 {
            return f64::from(u8::from(column == axis));
        }
        let mut about = Vector3::zeros();
        about[column - 3] = 1.0;
        about.cross(&place)[axis]
    });
    let all = DVector::from_fn(3 * places.len(), |row, _| errors[row / 3][row % 3]);
    let fit = design.clone().svd(true, true).solve(&all, 1e-12).unwrap();
    ((all - design * fit).norm_squared() / places.len() as f64).sqrt()
}

fn compensated(made: &Simulated, found: &ComponentCurves, sign: f64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let places: Vec<[f64; 3]> =
        (0..400).map(|_| [0, 1, 2].map(|axis| random.random_range(0.0..=at_end(axis)))).collect();
    let errors: Vec<Vector3<f64>> = (places.iter())
        .map(|place| {
            let correct = -sign * moved_um(found, *place);
            let command = Vector3::from(*place) + 1e-3 * correct;
            Vector3::from(made.error_um(command.into())) + correct
        })
        .collect();
    free_rms_um(&places, &errors)
}

#[test]
fn the_machine_is_left_with_the_error_that_is_predicted() {
    for (seed, field) in [(1, false), (2, true), (3, true)] {
        let mut made = machine(seed);
        if field {
            made.field = scenario(seed).field.map(|field| runout_spatial_error::simulate::Field {
                std_um: field.std_um.map(|std| 0.6 * std),
                ..field
            });
        }
        let made = made.simulate();
        let outcome = separator("curves = { pitch_mm = [100.0, 100.0, 87.5] }").separate(&made.points()).unwrap();
        let found = curves(&outcome);
        let predicted = value(&outcome, "volumetric_rms_after", None);
        let (expected, std) = (predicted.value, predicted.std().unwrap());
        let beyond = value(&outcome, "volumetric_rms_beyond_axes", None).value;
        let before = value(&outcome, "volumetric_rms", None).value;
        let left = compensated(&made, &found, 1.0);
        let reversed = compensated(&made, &found, -1.0);
        println!(
            "field {field}: before {before:.2}, left {left:.2}, predicted {expected:.2} ± {std:.2}, beyond {beyond:.2}, reversed {reversed:.2} µm"
        );
        assert!(left < 1.15 * expected && left > expected / 1.4, "{left} of {expected} ± {std}");
        assert!(beyond <= expected && (beyond > 1.2) == field, "{beyond}");
        assert!(before > 2.0 * expected && reversed > 1.5 * before, "{before} {reversed}");
    }
}

#[test]
fn too_few_places_are_said_and_the_run_goes_on() {
    let outcome =
        separator("curves = { pitch_mm = [5.0, 5.0, 5.0] }").separate(&scenario(1).simulate().points()).unwrap();
    assert!(curves(&outcome).nodes.is_empty());
    assert!(outcome.remarks.iter().any(|remark| remark.contains("no component curves")), "{:?}", outcome.remarks);
}

#[test]
fn nodes_between_places_are_not_observable() {
    // Places every 100 mm do not show nodes every 50 mm.
    let outcome =
        separator("curves = { pitch_mm = [50.0, 100.0, 87.5] }").separate(&machine(4).simulate().points()).unwrap();
    let found = curves(&outcome);
    if !found.nodes.is_empty() {
        let between = |at: f64| (at / 100.0).fract() > 0.1;
        assert!(found.of_axis("X").iter().filter(|node| between(node.position)).all(|node| node.errors[0].is_nan()));
        assert!(found.of_axis("Y").iter().all(|node| node.errors[1].is_finite()));
    }
}
