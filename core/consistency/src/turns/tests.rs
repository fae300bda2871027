//! Recordings simulated sample by sample in time: lines that wander in frequency and size, levels that drift, noise that is coloured.

use std::f64::consts::TAU;

use super::*;
use crate::{
    check::Test,
    testing::Random,
    trials::{fewest, trials},
};

const SAMPLES: usize = 48;

/// What goes wrong.
#[derive(Debug, Clone, Copy)]
enum Trouble {
    None,
    Ratio(f64),
    Step(f64),
    Fade(f64),
    Grows(f64),
    MarkEvery(usize),
    MarksATurn(usize),
    /// In the middle of one turn, in µm.
    Knock(f64),
}

struct Recording {
    turns: usize,
    channels: usize,
    /// Asynchronous motion and noise, in µm rms.
    motion_um: f64,
    noise_um: f64,
    /// Wander of the level, in µm a turn.
    wander_um: f64,
    /// Decaying creep of the level, in µm.
    creep_um: f64,
    off_centre_um: f64,
}

/// A line: turns a turn, its phase's wander a turn, its size in each channel, and how it swells and over how many turns.
struct Line {
    at: f64,
    wander: f64,
    size: Vec<f64>,
    swell: f64,
    over: f64,
    phase: f64,
}

impl Recording {
    fn any(random: &mut Random, sort: usize) -> Self {
        let turns = [40, 64, 25, 150, 90, 40][sort % 6];
        Self {
            turns,
            channels: 1 + sort % 4,
            motion_um: [0.15, 0.5, 0.05, 0.3, 1.0, 0.15][sort % 6],
            noise_um: [0.05, 0.02, 0.3, 0.01, 0.1, 0.05][sort % 6],
            wander_um: [0.0, 0.02, 0.0, 0.05, 0.01, 0.2][sort % 6],
            creep_um: [0.0, 5.0, 1.0, 20.0, 0.0, 3.0][sort % 6],
            off_centre_um: 2.0 + 10.0 * random.normal().abs(),
        }
    }

    fn record(&self, random: &mut Random, trouble: Trouble) -> TurnTable {
        let lines: Vec<Line> = (0..8)
            .map(|_| Line {
                at: (random.normal() * 2.0).abs() + 0.2,
                wander: 0.02 * random.normal().abs(),
                size: (0..self.channels).map(|_| random.normal() * self.motion_um / 2.0).collect(),
                swell: 0.5 * random.normal().abs().min(2.0),
                over: 3.0 + 40.0 * random.normal().abs(),
                phase: TAU * random.normal(),
            })
            .collect();
        let lobes: Vec<Vec<[f64; 2]>> = (0..self.channels)
            .map(|_| (2..=12).map(|n| [random.normal() / f64::from(n), random.normal() / f64::from(n)]).collect())
            .collect();
        let phase = TAU * random.normal();
        let (ratio, [turns_a_mark, marks]) = match trouble {
            Trouble::Ratio(ratio) => (ratio, [1, 1]),
            Trouble::MarkEvery(turns) => (1.0, [turns, 1]),
            Trouble::MarksATurn(marks) => (1.0, [1, marks]),
            _ => (1.0, [1, 1]),
        };
        let speed = ratio * turns_a_mark as f64 / marks as f64;
        let samples = SAMPLES * turns_a_mark;
        let mut walk = vec![0.0; lines.len()];
        let (mut level, mut coloured) = (vec![0.0; self.channels], vec![0.0; self.channels]);
        let mut table = TurnTable { together: 1, orders: ORDERS, channels: self.channels, ..TurnTable::default() };
        for turn in 0..self.turns {
            let mut values = vec![vec![0.0; samples]; self.channels];
            for sample in 0..samples {
                let time = turn as f64 + sample as f64 / samples as f64;
                for (walk, line) in walk.iter_mut().zip(&lines) {
                    *walk += TAU * line.wander * random.normal() / (samples as f64).sqrt();
                }
                let mut angle = TAU * time * speed;
                let (mut fade, mut growth, mut knock) = (0.0, 1.0, 0.0);
                match trouble {
                    Trouble::Step(by) => angle -= if time < 0.31 * self.turns as f64 { 0.0 } else { by },
                    Trouble::Fade(by) => fade = by * (-time * 4.0 / self.turns as f64).exp(),
                    Trouble::Grows(by) => growth += by * time / self.turns as f64,
                    Trouble::Knock(by) if turn == 17 && time > 17.4 => {
                        knock = by * (-20.0 * (time - 17.4)).exp() * (40.0 * (time - 17.4)).cos();
                    }
                    _ => {}
                }
                for (channel, values) in values.iter_mut().enumerate() {
                    level[channel] += self.wander_um * random.normal() / (samples as f64).sqrt();
                    coloured[channel] = 0.7 * coloured[channel] + 0.7 * self.noise_um * random.normal();
                    let mut part = self.off_centre_um * (angle + phase + channel as f64).cos();
                    for (place, [cosine, sine]) in lobes[channel].iter().enumerate() {
                        let (s, c) = ((place + 2) as f64 * angle).sin_cos();
                        part += cosine * c + sine * s;
                    }
                    let mut value =
                        growth * part + fade * (3.0 * angle + 0.4).cos() + level[channel] + coloured[channel] + knock;
                    value += self.creep_um * (1.0 - (-time * 3.0 / self.turns as f64).exp());
                    for (line, walk) in lines.iter().zip(&walk) {
                        let swell = 1.0 + line.swell * (TAU * time / line.over + line.phase).sin();
                        value += line.size[channel] * swell * (TAU * line.at * time * speed + line.phase + walk).cos();
                    }
                    values[sample] = value;
                }
            }
            table.turns.push(turn);
            table.levels_um.extend(values.iter().map(|values| values.iter().sum::<f64>() / samples as f64));
            for order in 1..=ORDERS {
                for values in &values {
                    let at = |sample: usize| Complex64::cis(TAU * (order * sample) as f64 / samples as f64);
                    let sum: Complex64 = values.iter().enumerate().map(|(sample, value)| at(sample) * *value).sum();
                    table.coefficients.push(sum * 2.0 / samples as f64);
                }
            }
        }
        table
    }
}

fn findings(table: &TurnTable) -> Vec<String> {
    let course = table.course();
    assert!(course.checks.iter().all(|check| check.test == Test::Turns));
    course.checks.iter().map(|check| check.finding.clone()).filter(|finding| !finding.is_empty()).collect()
}

fn share(random: &mut Random, trials: usize, trouble: Trouble, words: &str) -> f64 {
    let usual = |off_centre_um| Recording {
        turns: 40,
        channels: 4,
        motion_um: 0.15,
        noise_um: 0.05,
        wander_um: 0.0,
        creep_um: 0.0,
        off_centre_um,
    };
    let named = |_: &usize| {
        let off_centre_um = 5.0 + 3.0 * random.normal().abs();
        let found = findings(&usual(off_centre_um).record(random, trouble));
        found.iter().any(|finding| finding.contains(words))
    };
    (0..trials).filter(named).count() as f64 / trials as f64
}

#[test]
fn sound_recordings_have_no_course() {
    let mut random = Random::new(42);
    let trials = 300;
    let mut false_findings = Vec::new();
    for trial in 0..trials {
        let recording = Recording::any(&mut random, trial);
        false_findings
            .extend(findings(&recording.record(&mut random, Trouble::None)).into_iter().map(|said| (trial % 6, said)));
    }
    assert!(false_findings.len() * 100 <= trials, "{false_findings:?}");
}

#[test]
fn troubles_are_named() {
    let (mut random, mut missed, mut shares) = (Random::new(7), false, Vec::new());
    for (trouble, words, least) in [
        (Trouble::Ratio(1.0001), "against the mark", 0.6),
        (Trouble::Ratio(1.001), "against the mark", 0.95),
        (Trouble::Ratio(1.021), "ratio 1.021", 0.95),
        (Trouble::Ratio(0.97), "ratio 0.970", 0.95),
        (Trouble::Step(2_f64.to_radians()), "steps by", 0.95),
        (Trouble::Fade(3.0), "order 3 fades", 0.95),
        (Trouble::Fade(1.5), "order 3 fades", 0.6),
        (Trouble::Grows(0.05), "size of all orders", 0.5),
        (Trouble::MarkEvery(2), "once in 2 turns", 0.95),
        (Trouble::MarkEvery(3), "once in 3 turns", 0.95),
        (Trouble::MarksATurn(2), "two marks a turn", 0.95),
        (Trouble::Knock(5.0), "turn 18 by", 0.95),
    ] {
        let found = share(&mut random, 40, trouble, words);
        shares.push((trouble, found));
        missed |= found < least;
    }
    assert!(!missed, "{shares:?}");
}

#[test]
fn a_course_widens_the_mean_by_its_size() {
    let mut random = Random::new(3);
    let recording = Recording { turns: 64, ..Recording::any(&mut random, 0) };
    let faded = recording.record(&mut random, Trouble::Fade(30.0));
    let course = faded.course();
    let means: Vec<Complex64> = (0..faded.channels).map(|channel| mean(faded.series(3, channel))).collect();
    let std_um = course.covariance(3, &means).unwrap()[0].re.sqrt();
    // From 30 to 0.5 µm: the range over √12.
    assert!(std_um > 29.5 / 12_f64.sqrt() * 0.8 && std_um < 12.0, "{std_um}");
    assert_eq!(course.covariance(5, &means), None);
    let step = recording.record(&mut random, Trouble::Step(0.1)).course();
    assert!((step.phase_std_rad / (0.1 * 2_f64.sqrt() / 3.0) - 1.0).abs() < 0.05, "{}", step.phase_std_rad);
    let turned = step.covariance(7, &[Complex64::new(3.0, 0.0)]).unwrap()[0].re.sqrt();
    assert!((turned / (3.0 * 7.0 * step.phase_std_rad) - 1.0).abs() < 1e-9);
}

#[test]
fn a_creeping_level_is_taken_out() {
    let mut random = Random::new(5);
    let recording = Recording { creep_um: 20.0, wander_um: 0.0, turns: 60, ..Recording::any(&mut random, 0) };
    let table = recording.record(&mut random, Trouble::None);
    let steady = table.without_creep();
    let first = |table: &TurnTable| (mean(table.series(2, 0).take(5)) - mean(table.series(2, 0).skip(55))).norm();
    assert!(first(&steady) < 0.3 * first(&table), "{} {}", first(&steady), first(&table));
    assert!(findings(&table).is_empty(), "{:?}", findings(&table));
}

/// A phase of all orders is found with its size, small or so large that orders turn by many periods.
#[test]
fn a_phase_is_as_large_as_it_is_said_to_be() {
    let mut random = Random::new(11);
    let steps_deg = [0.5, 3.0, 20.0, -45.0, 90.0, 170.0];
    let ratios = [1.0001, 1.00014, 0.9995, 1.0005, 1.003, 1.021, 0.97, 1.05];
    let steps = steps_deg.map(|by_deg: f64| (Trouble::Step(by_deg.to_radians()), by_deg.to_radians()));
    for (trouble, by_rad) in steps.into_iter().chain(ratios.map(|ratio| (Trouble::Ratio(ratio), TAU * (1.0 - ratio)))) {
        let (mut held, mut said, trials) = (0, 0, trials(40));
        for trial in 0..trials {
            let recording = Recording { turns: 60, channels: 4, ..Recording::any(&mut random, 6 * trial) };
            let Some(phase) = recording.record(&mut random, trouble).course().phase else { continue };
            said += 1;
            held += usize::from((phase.by_rad - by_rad).abs() < 3.0 * phase.std_rad);
            assert!((phase.by_rad - by_rad).abs() < 0.2 * by_rad.abs() + 3.0 * phase.std_rad, "{trouble:?}: {phase:?}");
        }
        println!("simulated, {trouble:?}: said {said} of {trials}, within 3 std {held}");
        assert!(2 * said >= trials && held >= fewest(said, [85, 100], 0.95), "{trouble:?}: {held} of {said}");
    }
}
