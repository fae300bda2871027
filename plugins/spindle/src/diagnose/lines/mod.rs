//! Lines in the turns' spectrum: motion at orders that are not whole, alike in all setups.
//!
//! A harmonic of one turn sees a line at order ν as a phasor that turns by ν from turn to turn: its spectrum over the turns
//! has a peak there. A line is one that stands far out of all others, since asynchronous motion may be many tones. Its
//! amplitude in each channel is then fitted to all low harmonics of the turns to be fitted, and its leak is taken out of the
//! averages.

mod spectrum;

use std::f64::consts::{PI, TAU};

use runout_core::{
    Complex64,
    model::diagnosis::{Diagnosis, Estimated},
    profile::Turns,
    stage::Station,
};

use super::data::Shared;
use crate::{layout::Layout, selection::Selection};

/// Fewest turns of a capture.
const FEWEST: usize = 16;

/// A line, and what it does to the averages.
#[derive(Debug, Clone)]
pub struct Line {
    order: f64,
    order_std: f64,
    amplitude_um: f64,
    amplitude_std: f64,
    direction_rad: f64,
    direction_std: f64,
    /// χ² of the turns fitted that it explains, beyond what its parameters would of noise.
    pub evidence: f64,
    /// χ² of the turns that are held out, without it and with it.
    pub held_out: [f64; 2],
    /// In the mean over the turns fitted, held out and all, `[order][reading]` from order 0.
    pub leak: [Vec<Complex64>; 3],
}

/// The turns of each setup in the layout's order of channels.
struct Capture<'a> {
    turns: &'a Turns,
    channels: Vec<usize>,
    fitted: usize,
}

impl Capture<'_> {
    /// A turn's angle at its start, in turns.
    fn start(&self, turn: usize) -> f64 {
        self.turns.numbers[turn] as f64
    }
}

/// The lines of a station, the largest first.
pub fn lines(selection: &Selection, layout: &Layout, station: &Station, orders: usize) -> Vec<Line> {
    let capture = |id: &usize| {
        let profile = station.profiles.iter().find(|profile| profile.setup == *id)?;
        let split = profile.split.as_ref()?;
        let channel = |sensor: &usize| profile.sensors.iter().position(|found| found == sensor);
        let channels = selection.sensors.iter().map(channel).collect::<Option<_>>()?;
        Some(Capture { turns: &split.turns, channels, fitted: split.fit.turns.len() })
    };
    let captures: Option<Vec<Capture>> = selection.setups.iter().map(capture).collect();
    let Some(captures) = captures.filter(|captures| captures.iter().all(|one| one.fitted >= FEWEST)) else {
        return Vec::new();
    };
    let found = spectrum::peaks(&captures).into_iter().map(|order| likeliest(&captures, order));
    found.filter_map(|order| fitted(&captures, layout, order, orders)).collect()
}

/// Of all lines that a turn shows at the same phase, n ± f for the same f, the one that explains most: their turns differ by
/// how they go within a turn only.
fn likeliest(captures: &[Capture], order: f64) -> f64 {
    let fraction = (order - order.round()).abs();
    let low = captures.iter().map(|one| one.turns.orders).min().unwrap_or(0);
    let alike = (0..low).flat_map(|order| [order as f64 - fraction, order as f64 + fraction]);
    let alike = alike.filter(|order| *order > spectrum::SLOWEST);
    alike.max_by(|a, b| amplitudes(captures, *a).1.total_cmp(&amplitudes(captures, *b).1)).unwrap_or(order)
}

/// Harmonics of one turn of e^{iνθ}'s real and imaginary part: cₙ for a = 1 and a = i of Re(a e^{iνθ}), the turn beginning
/// after `start` turns.
fn of_turn(line: f64, start: f64, order: usize) -> [Complex64; 2] {
    let whole = |x: f64| {
        // ∫₀^{2π} e^{ixφ} dφ / 2π
        if x.abs() < 1e-9 { Complex64::ONE } else { (Complex64::cis(TAU * x) - 1.0) / Complex64::new(0.0, TAU * x) }
    };
    let phase = Complex64::cis(TAU * (line * start).fract());
    let scale = if order == 0 { 0.5 } else { 1.0 };
    let forward = phase * whole(line + order as f64) * scale;
    let backward = phase.conj() * whole(order as f64 - line) * scale;
    [forward + backward, Complex64::I * (forward - backward)]
}

/// Amplitudes `[setup][channel]` that fit the turns of a range best, and the sum of squares that they explain.
fn amplitudes(captures: &[Capture], line: f64) -> (Vec<Vec<Complex64>>, f64) {
    let mut explained = 0.0;
    let of_capture = |capture: &Capture| {
        let (turns, low) = (capture.fitted, capture.turns.orders);
        let mut columns = vec![[Complex64::ZERO; 2]; turns * low];
        for order in 0..low {
            let mut mean = [Complex64::ZERO; 2];
            for turn in 0..turns {
                let values = of_turn(line, capture.start(turn), order);
                mean.iter_mut().zip(values).for_each(|(mean, value)| *mean += value / turns as f64);
                columns[turn * low + order] = values;
            }
            for turn in 0..turns {
                columns[turn * low + order].iter_mut().zip(mean).for_each(|(value, mean)| *value -= mean);
            }
        }
        let dot = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        for [a, b] in &columns {
            aa += dot(*a, *a);
            ab += dot(*a, *b);
            bb += dot(*b, *b);
        }
        let determinant = (aa * bb - ab * ab).max(f64::MIN_POSITIVE);
        let each = capture.channels.iter().map(|channel| {
            let (mut a, mut b) = (0.0, 0.0);
            for turn in 0..turns {
                for order in 0..low {
                    let value = capture.turns.at(turn, order, *channel);
                    let [of_a, of_b] = columns[turn * low + order];
                    a += dot(of_a, value);
                    b += dot(of_b, value);
                }
            }
            let found = Complex64::new(a * bb - b * ab, b * aa - a * ab) / determinant;
            explained += a * found.re + b * found.im;
            found
        });
        each.collect()
    };
    let all = captures.iter().map(of_capture).collect();
    (all, explained)
}

fn fitted(captures: &[Capture], layout: &Layout, near: f64, orders: usize) -> Option<Line> {
    let turns = captures.iter().map(|one| one.fitted).min()? as f64;
    let order = maximum(near - 1.0 / turns, near + 1.0 / turns, 1e-3 / turns, |order| amplitudes(captures, order).1);
    let (found, explained) = amplitudes(captures, order);
    let [amplitude_um, direction_rad] = along(&found, layout)?;
    // Noise is what a line beside it would have.
    let beside: Vec<f64> = [-6.5, -4.5, 4.5, 6.5]
        .iter()
        .filter_map(|bins| Some(along(&amplitudes(captures, order + bins / turns).0, layout)?[0]))
        .collect();
    let noise = (beside.iter().map(|value| value * value).sum::<f64>() / beside.len().max(1) as f64).sqrt();
    let setups = captures.len() as f64;
    // Half of a complex amplitude's noise is along it; setups are independent.
    let amplitude_std = noise / (2.0 * setups).sqrt();
    let order_std = 3.0_f64.sqrt() * noise / (amplitude_um * turns * PI * 2.0 * setups.sqrt());
    let (evidence, held_out) = weighed(captures, order, &found, explained)?;
    let leak = [
        leak(captures, order, &found, orders, |one| 0..one.fitted),
        leak(captures, order, &found, orders, |one| one.fitted..one.turns.count()),
        leak(captures, order, &found, orders, |one| 0..one.turns.count()),
    ];
    let direction_std = amplitude_std / amplitude_um;
    Some(Line { order, order_std, amplitude_um, amplitude_std, direction_rad, direction_std, evidence, held_out, leak })
}

/// Where a function with one maximum between two places has it, by golden section.
fn maximum(mut low: f64, mut high: f64, tolerance: f64, value: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    while high - low > tolerance {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - share * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + share * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}

/// Amplitude and direction of the straight line nearest to the motion, over all setups.
fn along(found: &[Vec<Complex64>], layout: &Layout) -> Option<[f64; 2]> {
    // Σ over setups of Re v vᴴ, v the phasors of x and y.
    let mut squares = [0.0; 3];
    for (setup, amplitudes) in found.iter().enumerate() {
        let (mut cc, mut cs, mut ss) = (0.0, 0.0, 0.0);
        let (mut c, mut s) = (Complex64::ZERO, Complex64::ZERO);
        let readings = layout.readings.iter().filter(|reading| reading.setup == setup);
        for (reading, amplitude) in readings.zip(amplitudes) {
            let (sine, cosine) = reading.angle_rad.sin_cos();
            (cc, cs, ss) = (cc + cosine * cosine, cs + cosine * sine, ss + sine * sine);
            (c, s) = (c + amplitude * cosine, s + amplitude * sine);
        }
        let determinant = cc * ss - cs * cs;
        if determinant < 1e-6 {
            return None;
        }
        let (x, y) = ((c * ss - s * cs) / determinant, (s * cc - c * cs) / determinant);
        squares[0] += x.norm_sqr();
        squares[1] += (x * y.conj()).re;
        squares[2] += y.norm_sqr();
    }
    let [xx, xy, yy] = squares.map(|sum| sum / found.len() as f64);
    let half = 0.5 * (xx - yy);
    let largest = 0.5 * (xx + yy) + half.hypot(xy);
    Some([largest.sqrt(), (0.5 * xy.atan2(half)).rem_euclid(PI)])
}

/// What the fitted turns say for a line, and χ² of those held out without and with it.
fn weighed(captures: &[Capture], line: f64, found: &[Vec<Complex64>], explained: f64) -> Option<(f64, [f64; 2])> {
    let (mut about_mean, mut entries) = (0.0, 0);
    let mut held = [0.0; 2];
    for (capture, amplitudes) in captures.iter().zip(found) {
        for (channel, amplitude) in capture.channels.iter().zip(amplitudes) {
            for order in 0..capture.turns.orders {
                let of = |turn: usize| {
                    let [a, b] = of_turn(line, capture.start(turn), order);
                    (capture.turns.at(turn, order, *channel), a * amplitude.re + b * amplitude.im)
                };
                let count = capture.fitted as f64;
                let (mean, leak) = (0..capture.fitted)
                    .map(of)
                    .fold((Complex64::ZERO, Complex64::ZERO), |(mean, leak), (value, line)| {
                        (mean + value / count, leak + line / count)
                    });
                about_mean += (0..capture.fitted).map(|turn| (of(turn).0 - mean).norm_sqr()).sum::<f64>();
                entries += 2 * (capture.fitted - 1);
                for (value, line) in (capture.fitted..capture.turns.count()).map(of) {
                    held[0] += (value - mean).norm_sqr();
                    held[1] += (value - mean - (line - leak)).norm_sqr();
                }
            }
        }
    }
    let square = (about_mean - explained).max(0.0) / entries.max(1) as f64;
    let parameters = (2 * found.iter().map(Vec::len).sum::<usize>() + 1) as f64;
    (square > 0.0).then(|| ((explained / square - parameters).max(0.0), held.map(|sum| sum / square)))
}

/// A line's mean over some turns, `[order][reading]`.
fn leak(
    captures: &[Capture],
    line: f64,
    found: &[Vec<Complex64>],
    orders: usize,
    part: impl Fn(&Capture) -> std::ops::Range<usize>,
) -> Vec<Complex64> {
    let count: usize = captures.iter().map(|one| one.channels.len()).sum();
    let mut leak = vec![Complex64::ZERO; (orders + 1) * count];
    let mut place = 0;
    for (capture, amplitudes) in captures.iter().zip(found) {
        let turns = part(capture);
        for order in 0..=orders {
            let mut mean = [Complex64::ZERO; 2];
            for turn in turns.clone() {
                let values = of_turn(line, capture.start(turn), order);
                mean.iter_mut().zip(values).for_each(|(mean, value)| *mean += value / turns.len() as f64);
            }
            for (channel, amplitude) in amplitudes.iter().enumerate() {
                leak[order * count + place + channel] = mean[0] * amplitude.re + mean[1] * amplitude.im;
            }
        }
        place += amplitudes.len();
    }
    leak
}

/// Says a line that was found by its order, amplitude and direction.
pub fn say(diagnosis: &mut Diagnosis, shared: &Shared, applied: &[usize]) {
    let Some(station) = shared.data.first() else { return };
    let added = diagnosis.added.iter_mut().filter(|added| added.effect == "asynchronous-line");
    for (added, number) in added.zip(applied) {
        let Some(line) = station.seen.lines.get(*number) else { continue };
        let said = |name: &str, value: f64, std: f64, unit: &str| Estimated {
            name: name.into(),
            value,
            std,
            unit: unit.into(),
        };
        added.parameters = vec![
            said("order", line.order, line.order_std, "1/rev"),
            said("amplitude", line.amplitude_um, line.amplitude_std, "um"),
            said("direction", line.direction_rad, line.direction_std, "rad"),
        ];
    }
}
