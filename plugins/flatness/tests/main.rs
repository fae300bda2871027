//! Simulated plates: eight lines of an autocollimator (Moody), there and back, whose readings come from a surface that no formula of the solver has.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; shares are printed")]

#[path = "../../../tests/support/trials.rs"]
mod trials;

use arrow_array::Float64Array;
use runout_core::{
    Result,
    closed_loop::{Settings, diagnosis::Verdict},
    draws::Draw,
    pipeline::{Context, StageConfig},
    points::{Column, Labels, Points},
    stage::{Outcome, PointDiagnosis, PointSeparator, Separator},
};
use runout_flatness::FlatnessConfig;
use trials::{fewest, trials};

/// Corners, middles of the edges and the centre of a plate of 800 mm x 600 mm: lines in steps of 100 mm.
const LINES: [(&str, [f64; 2], [f64; 2]); 8] = [
    ("AC", [0.0, 0.0], [800.0, 600.0]),
    ("BD", [800.0, 0.0], [0.0, 600.0]),
    ("AB", [0.0, 0.0], [800.0, 0.0]),
    ("BC", [800.0, 0.0], [800.0, 600.0]),
    ("CD", [800.0, 600.0], [0.0, 600.0]),
    ("DA", [0.0, 600.0], [0.0, 0.0]),
    ("EG", [400.0, 0.0], [400.0, 600.0]),
    ("HF", [0.0, 300.0], [800.0, 300.0]),
];

/// Height in µm: a bowl, a twist and waves.
fn surface([x, y]: [f64; 2]) -> f64 {
    let (u, v) = (x / 400.0 - 1.0, y / 300.0 - 1.0);
    3.0 * (u * u + 0.7 * v * v) + 1.2 * u * v + 0.8 * (2.3 * u + 0.4).sin() * (1.7 * v).cos()
}

/// Line, places of the rear and of the front foot, reading.
struct Rows(Vec<(String, [f64; 4], f64)>);

impl Rows {
    fn of(lines: &[(&'static str, [f64; 2], [f64; 2])], noise_urad: f64, drift_urad: f64, seed: u64) -> Self {
        let mut draw = Draw::new(seed);
        let mut rows = Vec::new();
        for ((name, from, to), back) in lines.iter().flat_map(|line| [(line, false), (line, true)]) {
            let steps = ((to[0] - from[0]).hypot(to[1] - from[1]) / 100.0).round();
            let zero = 50.0 * draw.normal();
            let at = |step: f64| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / steps);
            for number in 0..steps as usize {
                // Back along the line, the carriage faces as before.
                let step = if back { steps as usize - 1 - number } else { number };
                let [rear, front] = [at(step as f64), at(step as f64 + 1.0)];
                let tilt = 10.0 * (surface(front) - surface(rear));
                let reading = zero + tilt + drift_urad * number as f64 + noise_urad * draw.normal();
                let name = if back { format!("{name} back") } else { (*name).to_owned() };
                rows.push((name, [rear[0], rear[1], front[0], front[1]], reading));
            }
        }
        Self(rows)
    }

    fn points(&self) -> Points {
        let places = ["from_x_mm", "from_y_mm", "to_x_mm", "to_y_mm"];
        let place = |(index, name): (usize, &&str)| Column {
            name: (**name).into(),
            values: self.0.iter().map(|(_, places, _)| places[index]).collect(),
        };
        let slopes = Column { name: "slope_urad".into(), values: self.0.iter().map(|row| row.2).collect() };
        let lines = Labels { name: "line".into(), values: self.0.iter().map(|row| row.0.clone()).collect() };
        Points {
            columns: places.iter().enumerate().map(place).chain([slopes]).collect(),
            labels: vec![lines],
            ..Points::default()
        }
    }
}

fn separator(std_urad: Option<f64>) -> Box<dyn PointSeparator> {
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let Separator::Points(separator) = FlatnessConfig { std_urad }.check(&context).unwrap() else { panic!("points") };
    separator
}

fn run(rows: &Rows, std_urad: Option<f64>) -> Result<Outcome> {
    separator(std_urad).separate(&rows.points())
}

fn diagnose(rows: &Rows, std_urad: Option<f64>) -> PointDiagnosis {
    separator(std_urad).model().unwrap().diagnose(&rows.points(), &Settings::default()).unwrap()
}

/// Heights at all places of the lines about their least-squares plane, by sums over the places; and the least distance of two parallel
/// planes by a search over tilts.
fn truth() -> [f64; 5] {
    let mut places: Vec<[f64; 2]> = Vec::new();
    for (_, [x0, y0, x1, y1], _) in Rows::of(&LINES, 0.0, 0.0, 0).0 {
        for place in [[x0, y0], [x1, y1]] {
            if !places.iter().any(|known| (known[0] - place[0]).hypot(known[1] - place[1]) < 1.0) {
                places.push(place);
            }
        }
    }
    let range = |a: f64, b: f64| {
        let heights = places.iter().map(|place| surface(*place) - a * place[0] - b * place[1]);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), one| (low.min(one), high.max(one)));
        high - low
    };
    // Coordinates about their means are not correlated on these lines, but nearly: solved by 2 x 2.
    let count = places.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| places.iter().map(of).sum::<f64>() / count;
    let (mx, my, mz) = (mean(&|p| p[0]), mean(&|p| p[1]), mean(&|p| surface(*p)));
    let [xx, xy, yy] =
        [mean(&|p| (p[0] - mx).powi(2)), mean(&|p| (p[0] - mx) * (p[1] - my)), mean(&|p| (p[1] - my).powi(2))];
    let [xz, yz] = [mean(&|p| (p[0] - mx) * (surface(*p) - mz)), mean(&|p| (p[1] - my) * (surface(*p) - mz))];
    let (a, b) = ((xz * yy - yz * xy) / (xx * yy - xy * xy), (yz * xx - xz * xy) / (xx * yy - xy * xy));
    let about: Vec<f64> = places.iter().map(|p| surface(*p) - mz - a * (p[0] - mx) - b * (p[1] - my)).collect();
    let (low, high) = about.iter().fold((0.0_f64, 0.0_f64), |(low, high), one| (low.min(*one), high.max(*one)));
    let rms = (about.iter().map(|one| one * one).sum::<f64>() / count).sqrt();
    let (mut best, mut step) = ([a, b], 1e-2);
    while step > 1e-12 {
        let tried = (-10..=10).flat_map(|i| (-10..=10).map(move |j| (f64::from(i), f64::from(j))));
        let tried = tried.map(|(i, j)| [best[0] + 0.1 * i * step, best[1] + 0.1 * j * step]);
        best = tried.min_by(|p, q| range(p[0], p[1]).total_cmp(&range(q[0], q[1]))).unwrap();
        step *= 0.7;
    }
    [high - low, high, -low, rms, range(best[0], best[1])]
}

#[test]
fn a_plate_without_noise_has_its_heights() {
    let found = run(&Rows::of(&LINES, 0.0, 0.0, 1), Some(0.1)).unwrap();
    for (value, truth) in found.values.iter().zip(truth()) {
        assert!((value.value - truth).abs() < 1e-6 + 1e-4 * truth, "{}: {} for {truth}", value.symbol, value.value);
    }
    let rows = &found.tables[0].rows;
    assert_eq!(rows.num_rows(), 2 * (2 * 11 + 3 * 9 + 3 * 7));
    // A line has its places and heights in one order, there and back.
    for name in ["along_mm", "x_mm", "y_mm", "height_um"] {
        let column = rows.column_by_name(name).unwrap().as_any().downcast_ref::<Float64Array>().unwrap().values();
        let (there, back) = (&column[..11], &column[11..22]);
        assert!(there.iter().zip(back).all(|(there, back)| (there - back).abs() < 1e-9), "{name}: {there:?} {back:?}");
    }
}

#[test]
fn intervals_cover_the_true_value() {
    let (truth, plates) = (truth(), trials(150));
    for (noise_urad, is_stated) in [(0.2, true), (0.2, false), (3.0, true), (3.0, false)] {
        let mut held = [0; 5];
        for seed in 0..plates as u64 {
            let found = run(&Rows::of(&LINES, noise_urad, 0.0, seed), is_stated.then_some(noise_urad)).unwrap();
            for ((held, value), truth) in held.iter_mut().zip(&found.values).zip(truth) {
                let [low, high] = value.interval_95().unwrap();
                *held += usize::from(low <= truth && truth <= high);
            }
        }
        println!("noise {noise_urad} µrad, stated {is_stated}: {held:?} of {plates}");
        let least = fewest(plates, [134, 150], 0.95);
        assert!(held.iter().all(|held| *held >= least), "{noise_urad} {is_stated}: {held:?} of {plates}");
    }
}

/// A plate that is fifty times as flat as the other: what is found is noise, which may have hidden as much.
#[test]
fn intervals_of_a_flat_plate_cover_the_true_value() {
    let (mut held, plates) = ([0; 5], trials(150));
    for seed in 0..plates as u64 {
        let [mut flat, sound] = [3.0, 0.0].map(|noise_urad| Rows::of(&LINES, noise_urad, 0.0, seed));
        flat.0.iter_mut().zip(&sound.0).for_each(|(row, sound)| row.2 -= 0.98 * sound.2);
        let found = run(&flat, Some(3.0)).unwrap();
        for ((held, value), truth) in held.iter_mut().zip(&found.values).zip(truth()) {
            let [low, high] = value.interval_95().unwrap();
            *held += usize::from((low..=high).contains(&(0.02 * truth)));
        }
    }
    println!("flat: {held:?} of {plates}");
    assert!(held.iter().all(|held| *held >= fewest(plates, [134, 150], 0.95)), "{held:?} of {plates}");
}

#[test]
fn a_drift_is_found_with_its_size_and_a_clean_plate_names_nothing() {
    for seed in 0..8 {
        let clean = diagnose(&Rows::of(&LINES, 0.3, 0.0, seed), Some(0.3)).diagnosis;
        assert_eq!((clean.verdict, clean.added.len()), (Verdict::AtNoiseFloor, 0), "{:?}", clean.consistency);
        let found = diagnose(&Rows::of(&LINES, 0.3, 1.0, seed), Some(0.3));
        let [added] = &found.diagnosis.added[..] else { panic!("{:?}", found.diagnosis.added) };
        let (drift, flatness) = (&added.parameters[0], &found.after.values[0]);
        assert!((drift.value - 1.0).abs() < 4.0 * drift.std.unwrap(), "{} ± {:?}", drift.value, drift.std);
        assert_eq!(found.diagnosis.verdict, Verdict::Explained);
        assert!((flatness.value - truth()[0]).abs() < 4.0 * flatness.uncertainty.as_ref().unwrap().std);
    }
}

#[test]
fn what_the_lines_do_not_show_is_refused() {
    let said = |rows: &Rows| run(rows, Some(0.1)).unwrap_err().to_string();
    assert!(said(&Rows(Vec::new())).contains("there is no reading"));
    let one = Rows::of(&LINES[2..3], 0.1, 0.0, 1);
    assert!(said(&one).contains("all places lie on one line"), "{}", said(&one));
    // Two edges that no line joins.
    let apart = Rows::of(&[LINES[2], LINES[4]], 0.1, 0.0, 1);
    assert!(said(&apart).contains("do not determine"), "{}", said(&apart));
    let mut standing = Rows::of(&LINES, 0.1, 0.0, 1);
    standing.0[3].1 = [5.0; 4];
    assert!(said(&standing).contains("row 4: both feet stand at one place"));
}
