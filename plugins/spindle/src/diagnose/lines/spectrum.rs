//! The spectrum over the turns, and the peaks that stand out of it.

use std::f64::consts::TAU;

use runout_core::{Complex64, numerics::fourier::Fourier};

use super::turns::Capture;

/// A line's power is this many times that of the largest peak which is none.
const ALONE: f64 = 4.0;
/// And this many times the spectrum's median.
const PROMINENT: f64 = 25.0;
/// Slower than this, in orders, it cannot be distinguished from wandering.
pub(super) const SLOWEST: f64 = 0.25;
/// Bins of the windowed spectrum (of 1/turns) to both sides that belong to a peak.
const WIDTH: f64 = 3.0;

/// Orders of the peaks that stand out, so many at most.
pub(super) fn peaks(captures: &[Capture], most: usize) -> Vec<f64> {
    let turns = captures.iter().map(|one| one.turns.count()).min().unwrap_or(0);
    let longest = captures.iter().map(|one| one.turns.numbers.last().map_or(0, |last| last + 1 - one.turns.numbers[0]));
    let length = (2 * longest.max().unwrap_or(0)).next_power_of_two();
    let low = captures.iter().map(|one| one.turns.orders).min().unwrap_or(0);
    // Power by frequency from 0 to half a cycle a turn, and the order at which it is largest there.
    let mut power = vec![(0.0, 0.0); length / 2];
    let mut fourier = Fourier::new(length);
    for order in 0..low {
        let mut sums = vec![[0.0; 2]; length / 2];
        for capture in captures {
            for channel in &capture.channels {
                add_spectrum(capture, order, *channel, &mut fourier, &mut sums);
            }
        }
        for (bin, (sums, largest)) in sums.iter().zip(&mut power).enumerate() {
            let fraction = bin as f64 / length as f64;
            // A phasor that turns forward by f is a line at n − f or f − n, of Re Σ c e^{−inΦ}.
            for (sum, at) in sums.iter().zip([order as f64 - fraction, order as f64 + fraction]) {
                if *sum > largest.0 {
                    *largest = (*sum, at.abs());
                }
            }
        }
    }
    let mut sorted: Vec<f64> = power.iter().map(|(power, _)| *power).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let apart = (WIDTH * length as f64 / turns.max(1) as f64).ceil() as usize;
    let mut peaks: Vec<(f64, f64)> = Vec::new();
    let mut left: Vec<Option<(f64, f64)>> = power.into_iter().map(Some).collect();
    // What hardly changes from turn to turn is the average, and its wandering.
    left.iter_mut().take(apart).for_each(|bin| *bin = None);
    while peaks.len() <= most {
        let best = left.iter().enumerate().filter_map(|(bin, entry)| entry.map(|(power, at)| (power, at, bin)));
        let Some((size, at, bin)) = best.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        let end = (bin + apart + 1).min(left.len());
        left[bin.saturating_sub(apart)..end].fill(None);
        if at > SLOWEST {
            peaks.push((size, at));
        }
    }
    let stands_out = |count: &usize| {
        let (last, next) = (peaks[count - 1].0, peaks.get(*count).map_or(0.0, |peak| peak.0));
        last > ALONE * next && last > PROMINENT * median
    };
    let count = (1..=peaks.len().min(most)).find(stands_out).unwrap_or(0);
    peaks.into_iter().take(count).map(|(_, at)| at).collect()
}

/// Adds the windowed power of one harmonic's series over the turns: what turns forward, and what turns backward.
fn add_spectrum(capture: &Capture, order: usize, channel: usize, fourier: &mut Fourier, sums: &mut [[f64; 2]]) {
    let turns = &capture.turns;
    let count = turns.count();
    let first = turns.numbers[0];
    let mean = (0..count).map(|turn| turns.at(turn, order, channel)).sum::<Complex64>() / count as f64;
    let span = (turns.numbers[count - 1] + 1 - first) as f64;
    let mut series = vec![Complex64::ZERO; fourier.length()];
    for turn in 0..count {
        let place = turns.numbers[turn] - first;
        let window = 0.5 - 0.5 * (TAU * (place as f64 + 0.5) / span).cos();
        series[place] = window * (turns.at(turn, order, channel) - mean);
    }
    let mut parts = [const { Vec::new() }; 2];
    for (part, of) in parts.iter_mut().zip([|value: &Complex64| value.re, |value: &Complex64| value.im]) {
        *part = vec![Complex64::ZERO; sums.len()];
        fourier.analyse(series.iter().map(of), part);
    }
    let [real, imaginary] = parts;
    for ((sums, real), imaginary) in sums.iter_mut().zip(real).zip(imaginary) {
        let turned = Complex64::I * imaginary;
        sums[0] += (real + turned).norm_sqr();
        sums[1] += (real.conj() + Complex64::I * imaginary.conj()).norm_sqr();
    }
}
