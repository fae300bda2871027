//! Simulated machines, and what the separator says of them.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::format_collect,
    clippy::unnecessary_debug_formatting,
    clippy::float_cmp,
    dead_code,
    reason = "tests"
)]

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{Rng, RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    model::{
        closed_loop::Settings,
        diagnosis::{Diagnosis, Verdict},
    },
    stage::PointSeparator,
};
use runout_spatial_error::simulate::{Field, Layout, Placement, Scenario, Simulated, SimulatedEffect, Tracker};

use super::support::{column, flags, separator, table};

const TRAVEL_MM: [f64; 3] = [600.0, 400.0, 350.0];
/// Unseen places of each machine.
const UNSEEN: usize = 40;

/// A machine at random: rigid placement, a field, noise.
pub fn draw(random: &mut impl Rng) -> Scenario {
    let layout = if random.random_bool(0.6) {
        let counts = *[[6, 5, 4], [5, 5, 5], [7, 4, 4], [8, 5, 3]].choose(random).unwrap();
        Layout::Grid { from_mm: [0.0; 3], to_mm: TRAVEL_MM, counts }
    } else {
        Layout::Scattered { from_mm: [0.0; 3], to_mm: TRAVEL_MM, count: random.random_range(90..=160) }
    };
    let smoothness = *[Some(0.5), Some(1.5), Some(2.5), None].choose(random).unwrap();
    let noise_um = 10_f64.powf(random.random_range(-0.5..0.3));
    let mut around = |size: f64| [0, 1, 2].map(|_| random.random_range(-size..size));
    let placement = Placement { shift_um: around(300.0), turn_urad: around(200.0) };
    let at_mm = [-1500.0, 200.0, 300.0];
    let field = Field {
        std_um: [0, 1, 2].map(|_| 10_f64.powf(random.random_range(0.0..0.9))),
        range_mm: [0, 1, 2].map(|axis: usize| TRAVEL_MM[axis] * random.random_range(0.3..0.9)),
        smoothness,
    };
    Scenario {
        layout,
        passes: random.random_range(1..=3),
        random_order: random.random_bool(0.5),
        seconds_per_point: 10.0,
        seed: random.random_range(0..1 << 40),
        chain: "XYZ".into(),
        tool_mm: [0.0; 3],
        tracker: Tracker { at_mm, noise_um, angle_urad: random.random_range(0.0..0.3) * noise_um },
        placement,
        field: Some(field),
        effect: Vec::new(),
    }
}

/// What a study of coverage adds up.
#[derive(Debug, Default)]
pub struct Coverage {
    pub machines: usize,
    pub predictions: usize,
    pub squares: f64,
    pub inside: usize,
    /// Machines of which compensation removes 70 %, or leaves at most 1.15 times what the best predictor leaves.
    pub compensated: usize,
    pub removed: Vec<f64>,
    pub beside_best: Vec<f64>,
    pub chi2_of_machine: Vec<f64>,
}

impl Coverage {
    pub fn chi2(&self) -> f64 {
        self.squares / self.predictions as f64
    }

    pub fn share_inside(&self) -> f64 {
        self.inside as f64 / self.predictions as f64
    }

    pub fn print(&self) {
        let mut chi2 = self.chi2_of_machine.clone();
        chi2.sort_by(f64::total_cmp);
        let quantile = |share: f64| chi2[((chi2.len() - 1) as f64 * share) as usize];
        println!("machines {}, predictions at unseen places {}", self.machines, self.predictions);
        println!(
            "mean square of error/std {:.3}; 95 % intervals hold {:.1} %",
            self.chi2(),
            100.0 * self.share_inside()
        );
        println!(
            "of single machines: 10 % below {:.2}, median {:.2}, 90 % below {:.2}",
            quantile(0.1),
            quantile(0.5),
            quantile(0.9)
        );
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        println!(
            "compensation removes {:.0} % on average; it leaves {:.2} times what the best predictor leaves; right for {} of {}",
            100.0 * mean(&self.removed),
            mean(&self.beside_best),
            self.compensated,
            self.machines
        );
    }
}

/// Predictions at places that no machine was measured at.
pub fn coverage(machines: usize, seed: u64) -> Coverage {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sum = Coverage::default();
    for _ in 0..machines {
        let scenario = draw(&mut random);
        let made = scenario.simulate();
        let unseen: Vec<[f64; 3]> = (0..UNSEEN)
            .map(|_| [0, 1, 2].map(|axis: usize| TRAVEL_MM[axis] * random.random_range(0.02..0.98)))
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("unseen.csv");
        let lines: String = unseen.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
        std::fs::write(&path, format!("x_mm,y_mm,z_mm\n{lines}")).unwrap();
        let outcome = separator(&format!("query = {{ path = {path:?} }}")).separate(&made.points()).unwrap();
        let rows = table(&outcome, "prediction");
        let outside = flags(&rows, "extrapolated");
        let (mut squares, mut count) = (0.0, 0);
        for (axis, name) in ["dx_um", "dy_um", "dz_um"].into_iter().enumerate() {
            let (mean, std) = (column(&rows, name), column(&rows, &format!("std_{name}")));
            for (row, place) in unseen.iter().enumerate().filter(|(row, _)| !outside[*row]) {
                let z = (mean[row] - made.truth_um(*place)[axis]) / std[row];
                squares += z * z;
                count += 1;
                sum.inside += usize::from(z.abs() < 1.96);
            }
        }
        if count > 0 {
            sum.chi2_of_machine.push(squares / count as f64);
        }
        sum.squares += squares;
        sum.predictions += count;
        let [before, after, best] = compensated(&scenario, &made, &unseen, &outcome);
        sum.machines += 1;
        sum.removed.push(1.0 - after / before);
        sum.beside_best.push(after / best);
        sum.compensated += usize::from(after <= 0.3 * before || after <= 1.15 * best);
    }
    sum
}

/// Error before and after compensation, and what the best predictor leaves, each without the best rigid motion.
fn compensated(
    scenario: &Scenario,
    made: &Simulated,
    unseen: &[[f64; 3]],
    outcome: &runout_core::stage::Outcome,
) -> [f64; 3] {
    let rows = table(outcome, "compensation");
    let add = ["correct_x_um", "correct_y_um", "correct_z_um"].map(|name| column(&rows, name));
    let error: Vec<Vector3<f64>> = unseen.iter().map(|place| Vector3::from(made.error_um(*place))).collect();
    let left: Vec<Vector3<f64>> =
        error.iter().enumerate().map(|(row, error)| error + Vector3::from_fn(|axis, _| add[axis][row])).collect();
    let best = Dense::new(scenario, made).predict(unseen);
    let truth = unseen.iter().map(|place| Vector3::from(made.truth_um(*place)));
    let of_best: Vec<Vector3<f64>> = truth.zip(best).map(|(truth, best)| truth - best).collect();
    [error, left, of_best].map(|all| without_rigid(unseen, &all))
}

/// Root mean square of what the best rigid motion leaves.
fn without_rigid(places: &[[f64; 3]], values: &[Vector3<f64>]) -> f64 {
    let design = DMatrix::from_fn(3 * places.len(), 6, |row, column| rigid(places[row / 3], row % 3, column));
    let right = DVector::from_fn(3 * places.len(), |row, _| values[row / 3][row % 3]);
    let solved = design.clone().svd(true, true).solve(&right, 1e-9).unwrap();
    (right - design * solved).norm() / (places.len() as f64).sqrt()
}

fn rigid(place: [f64; 3], axis: usize, column: usize) -> f64 {
    if column < 3 {
        return f64::from(u8::from(column == axis));
    }
    let about = Vector3::from_fn(|at, _| f64::from(u8::from(at == column - 3)));
    1e-3 * about.cross(&Vector3::from_fn(|at, _| place[at] - 0.5 * TRAVEL_MM[at]))[axis]
}

/// Kriging with the true covariance, by full matrices: the best linear predictor, and what an effect would show with.
struct Dense {
    places: Vec<[f64; 3]>,
    field: Field,
    inverse: Vec<DMatrix<f64>>,
    mean: Vec<DVector<f64>>,
    trend: DVector<f64>,
    normal_inverse: DMatrix<f64>,
}

impl Dense {
    fn new(scenario: &Scenario, made: &Simulated) -> Self {
        let count = made.commands_mm.len() / scenario.passes;
        let mut places: Vec<[f64; 3]> = Vec::new();
        let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
        for (place, reading) in made.commands_mm.iter().zip(&made.readings_um) {
            let index = places.iter().position(|known| known == place).unwrap_or_else(|| {
                places.push(*place);
                sums.push((Vector3::zeros(), 0.0));
                places.len() - 1
            });
            sums[index].0 += Vector3::from(*reading);
            sums[index].1 += 1.0;
        }
        assert_eq!(places.len(), count);
        let field = scenario.field.clone().unwrap();
        let angular = 1e-3 * 2000.0 * scenario.tracker.angle_urad;
        let noise = scenario.tracker.noise_um.powi(2) + angular * angular;
        let mut inverse = Vec::new();
        let mut mean = Vec::new();
        let mut normal = DMatrix::zeros(6, 6);
        let mut right = DVector::zeros(6);
        for axis in 0..3 {
            let covariance = DMatrix::from_fn(count, count, |row, column| {
                let own = if row == column { noise / sums[row].1 } else { 0.0 };
                field.std_um[axis].powi(2) * correlation(&field, places[row], places[column]) + own
            });
            let values = DVector::from_fn(count, |row, _| sums[row].0[axis] / sums[row].1);
            let design = DMatrix::from_fn(count, 6, |row, column| rigid(places[row], axis, column));
            let all = covariance.cholesky().unwrap().inverse();
            normal += design.transpose() * &all * &design;
            right += design.transpose() * &all * &values;
            inverse.push(all);
            mean.push(values);
        }
        let normal_inverse = normal.try_inverse().unwrap();
        let trend = &normal_inverse * right;
        Self { places, field, inverse, mean, trend, normal_inverse }
    }

    fn predict(&self, queries: &[[f64; 3]]) -> Vec<Vector3<f64>> {
        let mut all = vec![Vector3::zeros(); queries.len()];
        for axis in 0..3 {
            let of_trend = |place: [f64; 3]| (0..6).map(|at| rigid(place, axis, at) * self.trend[at]).sum::<f64>();
            let left = DVector::from_fn(self.places.len(), |row, _| self.mean[axis][row] - of_trend(self.places[row]));
            let weights = &self.inverse[axis] * left;
            for (out, query) in all.iter_mut().zip(queries) {
                let field: f64 = (self.places.iter().zip(weights.iter()))
                    .map(|(place, weight)| correlation(&self.field, *place, *query) * weight)
                    .sum();
                out[axis] = of_trend(*query) + self.field.std_um[axis].powi(2) * field;
            }
        }
        all
    }

    /// χ² by which a signal at the places raises the likelihood, placement free.
    fn visibility(&self, signal: &dyn Fn([f64; 3]) -> [f64; 3]) -> f64 {
        let mut whole = 0.0;
        let mut across = DVector::zeros(6);
        for axis in 0..3 {
            let values = DVector::from_fn(self.places.len(), |row, _| signal(self.places[row])[axis]);
            let design = DMatrix::from_fn(self.places.len(), 6, |row, column| rigid(self.places[row], axis, column));
            let weighted = &self.inverse[axis] * &values;
            whole += values.dot(&weighted);
            across += design.transpose() * weighted;
        }
        whole - (&self.normal_inverse * &across).dot(&across)
    }
}

/// Matérn's family by its closed forms, and its limit.
fn correlation(field: &Field, one: [f64; 3], other: [f64; 3]) -> f64 {
    let scale = Matrix3::from_diagonal(&Vector3::from(field.range_mm).map(f64::recip));
    let d = (scale * (Vector3::from(one) - Vector3::from(other))).norm();
    match field.smoothness {
        None => (-0.5 * d * d).exp(),
        Some(nu) if nu < 1.0 => (-d).exp(),
        Some(nu) if nu < 2.0 => (1.0 + 3_f64.sqrt() * d) * (-3_f64.sqrt() * d).exp(),
        Some(_) => (1.0 + 5_f64.sqrt() * d + 5.0 / 3.0 * d * d) * (-5_f64.sqrt() * d).exp(),
    }
}

/// What a blind benchmark adds up.
#[derive(Debug, Default)]
pub struct Blind {
    pub campaigns: usize,
    pub clean: usize,
    pub false_alarms: usize,
    pub visible: usize,
    pub named: usize,
    pub wrong: usize,
    pub strangers: usize,
    pub unexplained: usize,
    pub parameter_squares: f64,
    pub parameters: usize,
    pub misses: Vec<String>,
}

impl Blind {
    pub fn print(&self) {
        println!("campaigns {}", self.campaigns);
        println!("visible effects named, itself or in its set: {} of {}", self.named, self.visible);
        println!("effects named that were not there: {}", self.wrong);
        println!("clean campaigns with an effect or a stranger: {} of {}", self.false_alarms, self.clean);
        println!("strangers said to be unexplained: {} of {}", self.unexplained, self.strangers);
        println!(
            "mean square of (value - truth)/std: {:.2} of {}",
            self.parameter_squares / self.parameters.max(1) as f64,
            self.parameters
        );
        for miss in &self.misses {
            println!("  {miss}");
        }
    }
}

/// χ² from which an effect is visible.
const VISIBLE: f64 = 60.0;

fn effect(random: &mut impl Rng, noise_um: f64) -> (SimulatedEffect, String, f64) {
    let size = noise_um * random.random_range(5.0..25.0) * if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let one = |random: &mut dyn FnMut(usize) -> usize, all: &[&str]| all[random(all.len())].to_owned();
    let kind = random.random_range(0..6);
    let mut pick = |count: usize| random.random_range(0..count);
    match kind {
        0 => {
            let target = one(&mut pick, &["X", "Y", "Z"]);
            let value = 4.0 * size;
            (
                SimulatedEffect::Scale { targets: [target.clone()], scale_um_per_m: value },
                format!("scale {target}"),
                value,
            )
        }
        1 => {
            let target = one(&mut pick, &["XY", "XZ", "YZ"]);
            let value = 4.0 * size;
            (
                SimulatedEffect::Squareness { targets: [target.clone()], angle_urad: value },
                format!("squareness {target}"),
                value,
            )
        }
        2 => {
            let target = one(&mut pick, &["EXX", "EYY", "EZZ"]);
            let order = pick(2) as u32 + 2;
            let effect = SimulatedEffect::Positioning { targets: [target.clone()], order, amplitude_um: size };
            (effect, format!("positioning {target} order {order}"), size)
        }
        3 => {
            let target = one(&mut pick, &["EYX", "EZX", "EXY", "EZY", "EXZ", "EYZ"]);
            let order = pick(2) as u32 + 2;
            let effect = SimulatedEffect::Straightness { targets: [target.clone()], order, amplitude_um: size };
            (effect, format!("straightness {target} order {order}"), size)
        }
        4 => {
            let target = one(&mut pick, &["EAX", "EBX", "ECX", "EAY", "EBY"]);
            let (order, value) = (pick(2) as u32 + 1, 5.0 * size);
            let effect = SimulatedEffect::Angular { targets: [target.clone()], order, amplitude_urad: value };
            (effect, format!("angular {target} order {order}"), value)
        }
        _ => {
            let target = one(&mut pick, &["x", "y", "z"]);
            let effect =
                SimulatedEffect::ThermalDrift { targets: [target.clone()], drift_um: size, time_constant: None };
            (effect, format!("thermal-drift {target}"), size)
        }
    }
}

/// Campaigns that the loop knows nothing of: clean ones, effects, strangers.
pub fn blind(campaigns: usize, seed: u64) -> Blind {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sum = Blind::default();
    for campaign in 0..campaigns {
        let mut scenario = draw(&mut random);
        scenario.passes = scenario.passes.max(2);
        let noise_um = scenario.tracker.noise_um;
        let mut truths: Vec<(String, f64)> = Vec::new();
        let kind = random.random_range(0..20);
        let mut stranger = false;
        match kind {
            0..5 => {}
            5..17 => {
                for _ in 0..if kind < 13 { 1 } else { 2 } {
                    let (effect, name, value) = effect(&mut random, noise_um);
                    if truths.iter().all(|(known, _)| *known != name) {
                        scenario.effect.push(effect);
                        truths.push((name, value));
                    }
                }
            }
            _ => {
                stranger = true;
                let size = scenario.field.as_ref().unwrap().std_um.iter().copied().fold(3.0 * noise_um, f64::max);
                let mut by =
                    || 3.0 * size * random.random_range(0.5..1.5) * if random.random_bool(0.5) { 1.0 } else { -1.0 };
                let by_um = [by(), by(), by()];
                scenario.effect.push(if kind == 17 {
                    let axis = random.random_range(0..3);
                    let at_mm = TRAVEL_MM[axis] * random.random_range(0.25..0.75);
                    SimulatedEffect::Step { axis: ["X", "Y", "Z"][axis].into(), at_mm, by_um }
                } else {
                    let share = random.random_range(0.35..0.55);
                    SimulatedEffect::DisplacedBox {
                        from_mm: [-1.0; 3],
                        to_mm: TRAVEL_MM.map(|length| share * length),
                        by_um,
                    }
                });
            }
        }
        let made = scenario.simulate();
        let found = separator("query = { grid_mm = [300.0, 200.0, 175.0] }")
            .model()
            .unwrap()
            .diagnose(&made.points(), &Settings { max_added: 40, ..Settings::default() })
            .unwrap()
            .diagnosis;
        let campaign = format!("campaign {campaign}");
        judge(&mut sum, &campaign, &scenario, &made, &truths, stranger, &found);
    }
    sum
}

fn judge(
    sum: &mut Blind,
    campaign: &str,
    scenario: &Scenario,
    made: &Simulated,
    truths: &[(String, f64)],
    stranger: bool,
    found: &Diagnosis,
) {
    sum.campaigns += 1;
    // Each finding by its name with the order, and those that it is not told from.
    let names: Vec<Vec<String>> = found
        .added
        .iter()
        .map(|added| {
            let order = added.parameters.iter().find(|parameter| parameter.name == "order");
            let order = order.map_or_else(String::new, |order| format!(" order {}", order.value));
            let first = format!("{} {}{order}", added.effect, added.targets.join(" "));
            std::iter::once(first).chain(added.confounded_with.iter().cloned()).collect()
        })
        .collect();
    let said = format!(
        "{campaign}: {truths:?} said {names:?} {:?} {:?}",
        found.verdict,
        found.unexplained.iter().map(|one| &one.place).collect::<Vec<_>>()
    );
    if stranger {
        sum.strangers += 1;
        let right = found.verdict == Verdict::Unexplained;
        sum.unexplained += usize::from(right);
        if !right {
            sum.misses.push(format!("stranger {:?} {said}", scenario.effect));
        }
        return;
    }
    if truths.is_empty() {
        sum.clean += 1;
        let alarm = !found.added.is_empty() || !found.unexplained.is_empty();
        sum.false_alarms += usize::from(alarm);
        if alarm {
            sum.misses.push(format!("clean {said}"));
        }
        return;
    }
    let dense = Dense::new(scenario, made);
    for (index, (name, value)) in truths.iter().enumerate() {
        let mut without = scenario.clone();
        without.effect.remove(index);
        let without = without.simulate();
        let drifts = name.starts_with("thermal");
        let signal = |place: [f64; 3]| {
            let (with, without) = (made.truth_um(place), without.truth_um(place));
            [0, 1, 2].map(|axis| with[axis] - without[axis])
        };
        // A drift shows in the repeats.
        let noise = scenario.tracker.noise_um.hypot(2.0 * scenario.tracker.angle_urad);
        let visibility = if drifts {
            (value / noise).powi(2) / 12.0 * made.time_s.len() as f64 * (1.0 - 1.0 / scenario.passes as f64) / 2.0
        } else {
            dense.visibility(&signal)
        };
        if visibility < VISIBLE {
            continue;
        }
        sum.visible += 1;
        let hit = names.iter().position(|set| set.contains(name));
        sum.named += usize::from(hit.is_some());
        match hit {
            None => sum.misses.push(format!("missed {name} (χ² {visibility:.0}) {said}")),
            Some(at) => {
                if let [.., last] = &found.added[at].parameters[..]
                    && !drifts
                    // Orders count over the measured volume, which scattered places do not fill.
                    && matches!(scenario.layout, Layout::Grid { .. })
                    && let Some(std) = last.std
                {
                    let z = (last.value - value) / std;
                    sum.parameter_squares += z * z;
                    sum.parameters += 1;
                    if z.abs() > 3.0 {
                        sum.misses.push(format!(
                            "{name}: {:.2} ± {std:.2} is {value:.2} ({:?}) {said}",
                            last.value, scenario.field
                        ));
                    }
                }
            }
        }
    }
    let wrong = names.iter().filter(|set| truths.iter().all(|(name, _)| !set.contains(name))).count();
    sum.wrong += wrong;
    if wrong > 0 || !found.unexplained.is_empty() {
        sum.misses.push(format!("more than there is: {said}"));
    }
}

/// One campaign of many places: seconds, memory, and what is said of the approximation.
pub fn many(count: usize) {
    let layout = Layout::Scattered { from_mm: [0.0; 3], to_mm: TRAVEL_MM, count };
    let made = Scenario { layout, passes: 1, ..super::support::scenario(1) }.simulate();
    let points = made.points();
    let start = std::time::Instant::now();
    let outcome = separator("query = { grid_mm = [50.0, 50.0, 50.0] }").separate(&points).unwrap();
    println!("{count} places: {:.1} s", start.elapsed().as_secs_f64());
    let rows = table(&outcome, "prediction");
    let place = ["x_mm", "y_mm", "z_mm"].map(|name| column(&rows, name));
    let (mean, std) = (column(&rows, "dx_um"), column(&rows, "std_dx_um"));
    let z = |row: usize| (mean[row] - made.truth_um([0, 1, 2].map(|axis: usize| place[axis][row]))[0]) / std[row];
    let squares: f64 = (0..mean.len()).map(|row| z(row).powi(2)).sum();
    println!("mean square of error/std of {} predictions: {:.2}", mean.len(), squares / mean.len() as f64);
    for remark in &outcome.remarks {
        println!("- {remark}");
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    println!("{}", status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("peak memory is not known here"));
}
