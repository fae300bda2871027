//! The search for lines in single turns.

use std::f64::consts::PI;

use runout_core::{Complex64, numerics::golden_section::maximum, stage::Station};

use super::{
    Line, Lines, OfSensor,
    orbit::Orbit,
    source, spectrum,
    turns::{Amplitudes, Capture, Fixed, InCapture},
};
use crate::{effects::MOST_LINES, layout::Layout, selection::Selection, solve::RESAMPLING};

/// Fewest turns of a capture.
const FEWEST: usize = 16;
/// Captures differ in speed where a line of a fixed frequency is this part of a period apart over the record.
const APART: f64 = 0.25;
/// A line that only one of the captures was searched for must be in all of them with at least this share of its amplitude.
const IN_ALL: f64 = 0.5;
/// Lines are two where they are so many periods apart over the record.
const RESOLVED: f64 = 1.5;
/// Places beside a line that noise is taken from, in periods over the record: as far as tones of asynchronous motion may be apart.
const BESIDE: [f64; 12] = [-12.5, -10.5, -8.5, -6.5, -4.5, -2.5, 2.5, 4.5, 6.5, 8.5, 10.5, 12.5];
/// Lines are fitted in turn so many times at most, or until none moves by this part of a period over the record, nor its power by this share.
const ROUNDS: usize = 20;
const SETTLED: f64 = 1e-3;

/// The lines of a station.
pub(crate) fn lines(selection: &Selection, layout: &Layout, station: &Station) -> Lines {
    let capture = |id: &usize| {
        let profile = station.profiles.iter().find(|profile| profile.setup == *id)?;
        let split = profile.split.as_ref()?;
        let channel = |sensor: &usize| profile.sensors.iter().position(|found| found == sensor);
        let channels = selection.sensors.iter().map(channel).collect::<Option<_>>()?;
        let lengths = split.turns.spans.iter().map(|[start, end]| end - start);
        let turn_samples = lengths.sum::<f64>() / split.turns.spans.len().max(1) as f64;
        Some(Capture { turns: split.turns.clone(), channels, fitted: split.fit.turns.len(), turn_samples })
    };
    let captures: Option<Vec<Capture>> = selection.setups.iter().map(capture).collect();
    let Some(captures) = captures.filter(|captures| captures.iter().all(|one| one.fitted >= FEWEST)) else {
        return Lines::default();
    };
    let rates: Option<Vec<f64>> = station.profiles.iter().map(|profile| profile.sample_rate_hz).collect();
    // Of captures at several rates, samples give no time.
    let rate_hz = rates.and_then(|rates| {
        rates.first().copied().filter(|first| rates.iter().all(|rate| rate.total_cmp(first).is_eq()))
    });
    let turn_samples = captures.iter().map(|one| one.turn_samples).sum::<f64>() / captures.len() as f64;
    let signs = selection.rig.sensors.iter().map(|sensor| sensor.sign).collect();
    Searched { captures, layout, signs, turn_samples, turns_hz: rate_hz.map(|hz| hz / turn_samples) }.lines()
}

/// What is searched for lines.
struct Searched<'a> {
    captures: Vec<Capture>,
    layout: &'a Layout,
    signs: Vec<f64>,
    /// Mean length of a turn over all captures.
    turn_samples: f64,
    turns_hz: Option<f64>,
}

impl Searched<'_> {
    /// What stands out of the turns, then out of their residual, until nothing does.
    fn lines(mut self) -> Lines {
        let mut lines: Vec<Line> = Vec::new();
        while lines.len() < MOST_LINES {
            let mut more: Vec<Line> = spectrum::peaks(&self.captures, MOST_LINES - lines.len())
                .into_iter()
                .filter_map(|order| self.fitted(self.likeliest(order, Fixed::Order)))
                .collect();
            if more.is_empty() && lines.is_empty() {
                more = self.of_one_frequency();
            }
            // A line that changes over the record leaves itself.
            let is_new = |one: &Line| lines.iter().all(|line| (line.order - one.order).abs() > RESOLVED / one.turns);
            more.retain(is_new);
            if more.is_empty() {
                break;
            }
            more.iter().for_each(|line| self.add(line, -1.0));
            lines.extend(more);
            self.settle(&mut lines);
        }
        lines.sort_by(|a, b| b.power().total_cmp(&a.power()));
        let without =
            if lines.is_empty() { Vec::new() } else { self.captures.into_iter().map(|one| one.turns).collect() };
        Lines { found: lines, without }
    }

    /// Fits each line to the turns without all others, until none moves.
    fn settle(&mut self, lines: &mut [Line]) {
        if lines.len() < 2 {
            return;
        }
        for _ in 0..ROUNDS {
            let mut moves = false;
            for line in &mut *lines {
                self.add(line, 1.0);
                let near = 1.0 / line.turns;
                let order = self.best(line.order, near, line.fixed);
                if let Some(fitted) = self.fitted_at(order, line.fixed) {
                    moves |= (fitted.order - line.order).abs() > SETTLED * near
                        || (fitted.power() / line.power() - 1.0).abs() > SETTLED;
                    *line = fitted;
                }
                self.add(line, -1.0);
            }
            if !moves {
                return;
            }
        }
    }

    /// Adds a line to the turns, or takes it out of them where `times` is −1.
    fn add(&mut self, line: &Line, times: f64) {
        self.captures.iter_mut().zip(&line.captures).for_each(|(capture, line)| capture.add(line, times));
    }

    /// Lines that captures of different speeds have at different orders: searched for in the first capture.
    fn of_one_frequency(&self) -> Vec<Line> {
        let [first, rest @ ..] = &self.captures[..] else { return Vec::new() };
        let turns = first.fitted as f64;
        let differ = |line: f64| {
            rest.iter().any(|one| (one.turn_samples / first.turn_samples - 1.0).abs() * line * turns > APART)
        };
        let fixed = Fixed::Time { turn_samples: self.turn_samples };
        let peaks = spectrum::peaks(&self.captures[..1], MOST_LINES).into_iter().filter(|order| differ(order.max(1.0)));
        let lines = peaks.filter_map(|order| {
            let order = self.likeliest(order * self.turn_samples / first.turn_samples, fixed);
            let order = self.best(order, 1.0 / turns, fixed);
            let size = |amplitudes: &Vec<Complex64>| amplitudes.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
            let sizes: Vec<f64> = Amplitudes::new(&self.captures, order, fixed).found.iter().map(size).collect();
            let in_all = sizes.iter().all(|size| *size > IN_ALL * sizes[0]);
            in_all.then(|| self.fitted_at(order, fixed))?
        });
        lines.collect()
    }

    fn explained(&self, order: f64, fixed: Fixed) -> f64 {
        Amplitudes::new(&self.captures, order, fixed).all_explained()
    }

    /// The order near another one that explains most.
    fn best(&self, order: f64, near: f64, fixed: Fixed) -> f64 {
        maximum(order - near, order + near, 1e-3 * near, |order| self.explained(order, fixed))
    }

    /// Of all lines that a turn shows at the same phase, n ± f for the same f, the one that explains most: their turns differ by
    /// how they go within a turn only.
    fn likeliest(&self, order: f64, fixed: Fixed) -> f64 {
        if fixed != Fixed::Order {
            return order;
        }
        let fraction = (order - order.round()).abs();
        let low = self.captures.iter().map(|one| one.turns.orders).min().unwrap_or(0);
        let alike = (0..low).flat_map(|order| [order as f64 - fraction, order as f64 + fraction]);
        let alike = alike.filter(|order| *order > spectrum::SLOWEST);
        alike.max_by(|a, b| self.explained(*a, fixed).total_cmp(&self.explained(*b, fixed))).unwrap_or(order)
    }

    /// A line near an order, which keeps its order or its frequency: whichever explains more.
    fn fitted(&self, near: f64) -> Option<Line> {
        let turns = self.captures.iter().map(|one| one.fitted).min()? as f64;
        let best = |fixed| {
            let order = self.best(near, 1.0 / turns, fixed);
            (self.explained(order, fixed), order, fixed)
        };
        let time = Fixed::Time { turn_samples: self.turn_samples };
        let apart = |one: &Capture| one.apart(near, time) > APART;
        let kept = best(Fixed::Order);
        let (_, order, fixed) = if self.captures.iter().any(apart) {
            let timed = best(time);
            if timed.0 > kept.0 { timed } else { kept }
        } else {
            kept
        };
        self.fitted_at(order, fixed)
    }

    fn fitted_at(&self, order: f64, fixed: Fixed) -> Option<Line> {
        let captures = &self.captures;
        let turns = captures.iter().map(|one| one.fitted).min()? as f64;
        let amplitudes = Amplitudes::new(captures, order, fixed);
        let lines: Vec<InCapture> = (captures.iter().zip(&amplitudes.found))
            .map(|(capture, amplitudes)| capture.line(order, fixed, amplitudes))
            .collect();
        // Noise is what lines beside it have of what it leaves.
        let mut left = captures.clone();
        left.iter_mut().zip(&lines).for_each(|(capture, line)| capture.add(line, -1.0));
        let beside = BESIDE.map(|bins| Amplitudes::new(&left, order + bins / turns, fixed).found);
        let setups = captures.len() as f64;
        let channels = captures.first()?.channels.len();
        let mean_square = |all: &[Vec<Vec<Complex64>>], channel: usize| {
            let each = all.iter().flatten().map(|setup| setup[channel].norm_sqr());
            each.sum::<f64>() / (all.len() as f64 * setups)
        };
        let noise: Vec<f64> = (0..channels).map(|channel| mean_square(&beside, channel)).collect();
        let power: Vec<f64> =
            (0..channels).map(|channel| mean_square(std::slice::from_ref(&amplitudes.found), channel)).collect();
        let source = source::source(&amplitudes.found, &noise, self.layout, &self.signs);
        // Half of a complex amplitude's noise is along it; setups are independent.
        let along_it = |noise: f64| noise / (2.0 * setups).sqrt();
        let mut sensors = self.weighed(order, fixed, &amplitudes)?;
        for ((sensor, power), noise) in sensors.iter_mut().zip(&power).zip(&noise) {
            (sensor.amplitude_um, sensor.amplitude_std) = (power.sqrt(), along_it(noise.sqrt()));
        }
        let signal = power.iter().sum::<f64>() / noise.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let order_std = 3.0_f64.sqrt() / (signal.sqrt() * turns * PI * 2.0 * setups.sqrt());
        Some(Line {
            order,
            order_std,
            orbit: Orbit::new(&amplitudes.found, &beside, self.layout),
            turns_hz: self.turns_hz,
            turns,
            source,
            sensors,
            expected: (2 * captures.len() * channels + 1) as f64,
            fixed,
            captures: lines,
        })
    }

    /// What the fitted turns say for a line in each sensor, and χ² of those held out without and with it.
    fn weighed(&self, line: f64, fixed: Fixed, amplitudes: &Amplitudes) -> Option<Vec<OfSensor>> {
        let channels = self.captures.first()?.channels.len();
        let mut sensors = vec![OfSensor::default(); channels];
        let (mut about_mean, mut entries, mut means) = (0.0, 0, 0.0);
        for (setup, capture) in self.captures.iter().enumerate() {
            let shape = capture.shape(line, fixed, capture.turns.orders);
            let count = capture.fitted as f64;
            for (index, (channel, sensor)) in capture.channels.iter().zip(&mut sensors).enumerate() {
                let amplitude = amplitudes.found[setup][index];
                sensor.explained += amplitudes.explained[setup][index];
                for order in 0..capture.turns.orders {
                    let of = |turn: usize| {
                        let [a, b] = shape.at(capture.phase(turn, line, fixed), order);
                        (capture.turns.at(turn, order, *channel), a * amplitude.re + b * amplitude.im)
                    };
                    let (mean, leak) = (0..capture.fitted)
                        .map(of)
                        .fold((Complex64::ZERO, Complex64::ZERO), |(mean, leak), (value, line)| {
                            (mean + value / count, leak + line / count)
                        });
                    about_mean += (0..capture.fitted).map(|turn| (of(turn).0 - mean).norm_sqr()).sum::<f64>();
                    entries += 2 * (capture.fitted - 1);
                    means += if order > 0 { mean.norm_sqr() } else { 0.0 };
                    for (value, line) in (capture.fitted..capture.turns.count()).map(of) {
                        sensor.held_out[0] += (value - mean).norm_sqr();
                        sensor.held_out[1] += (value - mean - (line - leak)).norm_sqr();
                    }
                }
            }
        }
        let readings = self.captures.len() * channels;
        let resampling = RESAMPLING * RESAMPLING * means / (2 * readings.max(1)) as f64;
        let square = ((about_mean - amplitudes.all_explained()) / entries.max(1) as f64).max(resampling);
        for sensor in &mut sensors {
            sensor.explained /= square;
            sensor.held_out = sensor.held_out.map(|sum| sum / square);
        }
        (square > 0.0).then_some(sensors)
    }
}
