//! Lines in the turns' spectrum: at orders that are not whole, alike in all setups.
//!
//! A harmonic of one turn sees a line at order ν as a phasor that turns by ν from turn to turn: its spectrum over the turns
//! has a peak there. A line is one that stands far out of all others, since asynchronous motion may be many tones. Its
//! amplitude in each channel is then fitted to all low harmonics of the turns to be fitted, and its leak is taken out of the
//! averages. It is a motion where all channels fit one displacement and tilt (`source.rs`), and else electrical pick-up. A line of the
//! machine keeps its order; one of the mains keeps its frequency, also where captures differ in speed.

mod source;
mod spectrum;
mod turns;

use std::{f64::consts::PI, ops::Range};

use runout_core::{Complex64, numerics::golden_section::maximum, stage::Station};

use super::drift::Part;
use crate::{layout::Layout, selection::Selection, solve::RESAMPLING};
pub(super) use source::Source;
use turns::{Amplitudes, Capture, Fixed};

/// Fewest turns of a capture.
const FEWEST: usize = 16;
/// Captures differ in speed where a line of a fixed frequency is this part of a period apart over the record.
const APART: f64 = 0.25;
/// A line that only one of the captures was searched for must be in all of them with at least this share of its amplitude.
const IN_ALL: f64 = 0.5;

/// A line, and what it does to the averages.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(super) order: f64,
    pub(super) order_std: f64,
    pub(super) amplitude_um: f64,
    pub(super) amplitude_std: f64,
    pub(super) direction_rad: f64,
    pub(super) direction_std: f64,
    /// Turns a second, where known, and turns fitted in each capture.
    pub(super) turns_hz: Option<f64>,
    pub(super) turns: f64,
    pub(super) source: Source,
    /// Of each sensor.
    pub(super) sensors: Vec<OfSensor>,
    /// χ² of the turns fitted that its parameters explain of noise.
    pub(super) expected: f64,
    /// In the mean over the turns fitted, held out and all, `[order][reading]` from order 0.
    pub(super) leak: [Vec<Complex64>; 3],
}

/// A line in one sensor, all setups together.
#[derive(Debug, Clone, Default)]
pub(super) struct OfSensor {
    pub(super) amplitude_um: f64,
    pub(super) amplitude_std: f64,
    /// χ² of the turns fitted that it explains.
    pub(super) explained: f64,
    /// χ² of the turns that are held out, without it and with it.
    pub(super) held_out: [f64; 2],
}

impl Line {
    /// The first of the sensors that it is of, or the axis, and χ² of the turns fitted that it explains there, beyond what its
    /// parameters would of noise.
    pub(crate) fn row(&self) -> (Option<usize>, f64) {
        let expected = self.expected / self.sensors.len().max(1) as f64;
        let beyond = self.of().map(|sensor| self.sensors[sensor].explained - expected).sum::<f64>();
        (self.target(), beyond.max(0.0))
    }

    /// χ² of the turns that are held out, without it and with it.
    pub(crate) fn held_out(&self) -> [f64; 2] {
        [0, 1].map(|with| self.of().map(|sensor| self.sensors[sensor].held_out[with]).sum())
    }

    /// The first of the sensors that it is of; nothing where it is of the axis.
    fn target(&self) -> Option<usize> {
        match &self.source {
            Source::Motion { .. } => None,
            Source::Sensors { channels, .. } => channels.first().copied(),
        }
    }

    /// The sensors that have it.
    fn of(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.sensors.len()).filter(|sensor| match &self.source {
            Source::Motion { .. } => true,
            Source::Sensors { channels, .. } => channels.contains(sensor),
        })
    }

    /// Its leak into the mean over some turns.
    pub(crate) fn leak(&self, part: Part) -> &[Complex64] {
        &self.leak[part as usize]
    }

    /// Takes a leak out of the readings of the sensors that have the line.
    pub(crate) fn take_out(&self, leak: &[Complex64], layout: &Layout, mean: &mut [Complex64]) {
        let count = layout.readings.len();
        for (index, reading) in layout.readings.iter().enumerate() {
            if self.of().any(|sensor| sensor == reading.sensor) {
                let values = mean.iter_mut().skip(index).step_by(count);
                values.zip(leak.iter().skip(index).step_by(count)).for_each(|(mean, leak)| *mean -= leak);
            }
        }
    }

    /// Root mean square amplitude in some sensors, in µm, and its standard uncertainty.
    pub(super) fn of_sensors(&self, sensors: &[usize]) -> [f64; 2] {
        let count = sensors.len().max(1) as f64;
        let each = || sensors.iter().filter_map(|sensor| self.sensors.get(*sensor));
        let amplitude_um = (each().map(|one| one.amplitude_um.powi(2)).sum::<f64>() / count).sqrt();
        let std = each().map(|one| one.amplitude_um * one.amplitude_std).map(|product| product * product).sum::<f64>();
        [amplitude_um, std.sqrt() / (count * amplitude_um)]
    }
}

/// The lines of a station, the largest first.
pub(crate) fn lines(selection: &Selection, layout: &Layout, station: &Station, orders: usize) -> Vec<Line> {
    let capture = |id: &usize| {
        let profile = station.profiles.iter().find(|profile| profile.setup == *id)?;
        let split = profile.split.as_ref()?;
        let channel = |sensor: &usize| profile.sensors.iter().position(|found| found == sensor);
        let channels = selection.sensors.iter().map(channel).collect::<Option<_>>()?;
        let lengths = split.turns.spans.iter().map(|[start, end]| end - start);
        let turn_samples = lengths.sum::<f64>() / split.turns.spans.len().max(1) as f64;
        Some(Capture { turns: &split.turns, channels, fitted: split.fit.turns.len(), turn_samples })
    };
    let captures: Option<Vec<Capture>> = selection.setups.iter().map(capture).collect();
    let Some(captures) = captures.filter(|captures| captures.iter().all(|one| one.fitted >= FEWEST)) else {
        return Vec::new();
    };
    let rates: Option<Vec<f64>> = station.profiles.iter().map(|profile| profile.sample_rate_hz).collect();
    // Of captures at several rates, samples give no time.
    let rate_hz = rates.and_then(|rates| {
        rates.first().copied().filter(|first| rates.iter().all(|rate| rate.total_cmp(first).is_eq()))
    });
    let turn_samples = captures.iter().map(|one| one.turn_samples).sum::<f64>() / captures.len() as f64;
    let signs = selection.rig.sensors.iter().map(|sensor| sensor.sign).collect();
    let station =
        Searched { captures, layout, signs, orders, turn_samples, turns_hz: rate_hz.map(|hz| hz / turn_samples) };
    station.lines()
}

/// What is searched for lines.
struct Searched<'a> {
    captures: Vec<Capture<'a>>,
    layout: &'a Layout,
    signs: Vec<f64>,
    /// Highest order of the averages.
    orders: usize,
    /// Mean length of a turn over all captures.
    turn_samples: f64,
    turns_hz: Option<f64>,
}

impl Searched<'_> {
    fn lines(&self) -> Vec<Line> {
        let found = spectrum::peaks(&self.captures);
        let kept = found.into_iter().map(|order| self.likeliest(order, Fixed::Order));
        let mut lines: Vec<Line> = kept.filter_map(|order| self.fitted(order)).collect();
        if lines.is_empty() {
            lines.extend(self.of_one_frequency());
        }
        lines
    }

    /// Lines that captures of different speeds have at different orders: searched for in the first capture.
    fn of_one_frequency(&self) -> Vec<Line> {
        let [first, rest @ ..] = &self.captures[..] else { return Vec::new() };
        let turns = first.fitted as f64;
        let differ = |line: f64| {
            rest.iter().any(|one| (one.turn_samples / first.turn_samples - 1.0).abs() * line * turns > APART)
        };
        let fixed = Fixed::Time { turn_samples: self.turn_samples };
        let peaks = spectrum::peaks(&self.captures[..1]).into_iter().filter(|order| differ(order.max(1.0)));
        let lines = peaks.filter_map(|order| {
            let order = self.likeliest(order * self.turn_samples / first.turn_samples, fixed);
            let order =
                maximum(order - 1.0 / turns, order + 1.0 / turns, 1e-3 / turns, |order| self.explained(order, fixed));
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
            let order =
                maximum(near - 1.0 / turns, near + 1.0 / turns, 1e-3 / turns, |order| self.explained(order, fixed));
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
        let [amplitude_um, direction_rad] = along(&amplitudes.found, self.layout).unwrap_or([f64::NAN; 2]);
        // Noise is what lines beside it would have.
        let beside = [-6.5, -4.5, 4.5, 6.5].map(|bins| Amplitudes::new(captures, order + bins / turns, fixed).found);
        let moved: Vec<f64> = beside.iter().filter_map(|found| Some(along(found, self.layout)?[0])).collect();
        let noise_along = (moved.iter().map(|value| value * value).sum::<f64>() / moved.len().max(1) as f64).sqrt();
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
        let amplitude_std = along_it(noise_along);
        Some(Line {
            order,
            order_std,
            amplitude_um,
            amplitude_std,
            direction_rad,
            direction_std: amplitude_std / amplitude_um,
            turns_hz: self.turns_hz,
            turns,
            source,
            sensors,
            expected: (2 * captures.len() * channels + 1) as f64,
            leak: [Part::Fitted, Part::HeldOut, Part::All].map(|part| self.leak(order, fixed, &amplitudes, part)),
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

    /// A line's mean over some turns, `[order][reading]`.
    fn leak(&self, line: f64, fixed: Fixed, amplitudes: &Amplitudes, part: Part) -> Vec<Complex64> {
        let count: usize = self.captures.iter().map(|one| one.channels.len()).sum();
        let mut leak = vec![Complex64::ZERO; (self.orders + 1) * count];
        let mut place = 0;
        for (capture, amplitudes) in self.captures.iter().zip(&amplitudes.found) {
            let turns: Range<usize> = match part {
                Part::Fitted => 0..capture.fitted,
                Part::HeldOut => capture.fitted..capture.turns.count(),
                Part::All => 0..capture.turns.count(),
            };
            let shape = capture.shape(line, fixed, self.orders + 1);
            let phases: Complex64 = turns.clone().map(|turn| capture.phase(turn, line, fixed)).sum();
            let phase = phases / turns.len().max(1) as f64;
            for order in 0..=self.orders {
                // The mean phase is no phase, but turns add up one by one.
                let mean = shape.at(phase, order);
                for (channel, amplitude) in amplitudes.iter().enumerate() {
                    leak[order * count + place + channel] = mean[0] * amplitude.re + mean[1] * amplitude.im;
                }
            }
            place += amplitudes.len();
        }
        leak
    }
}

/// Amplitude and direction of the straight line nearest to the motion, over all setups. Where all sensors look one way, it is the
/// motion along them.
fn along(found: &[Vec<Complex64>], layout: &Layout) -> Option<[f64; 2]> {
    // Σ over setups of Re v vᴴ, v the phasors of x and y.
    let mut squares = [0.0; 3];
    for (setup, amplitudes) in found.iter().enumerate() {
        let (mut cc, mut cs, mut ss) = (0.0, 0.0, 0.0);
        let (mut c, mut s) = (Complex64::ZERO, Complex64::ZERO);
        let readings = layout.readings.iter().filter(|reading| reading.setup == setup);
        for (reading, amplitude) in readings.zip(amplitudes).filter(|(reading, _)| !reading.view.is_axial()) {
            let (sine, cosine) = reading.angle_rad.sin_cos();
            (cc, cs, ss) = (cc + cosine * cosine, cs + cosine * sine, ss + sine * sine);
            (c, s) = (c + amplitude * cosine, s + amplitude * sine);
        }
        let determinant = cc * ss - cs * cs;
        if cc + ss <= 0.0 {
            return None;
        }
        let (x, y) = if determinant > 1e-6 {
            ((c * ss - s * cs) / determinant, (s * cc - c * cs) / determinant)
        } else {
            // What is along the sensors, cos θ·c + sin θ·s, of their common direction.
            (c / (cc + ss), s / (cc + ss))
        };
        squares[0] += x.norm_sqr();
        squares[1] += (x * y.conj()).re;
        squares[2] += y.norm_sqr();
    }
    let [xx, xy, yy] = squares.map(|sum| sum / found.len() as f64);
    let half = 0.5 * (xx - yy);
    let largest = 0.5 * (xx + yy) + half.hypot(xy);
    Some([largest.sqrt(), (0.5 * xy.atan2(half)).rem_euclid(PI)])
}
