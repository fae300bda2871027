//! Butterworth low-pass in second-order sections, by the bilinear transform with the cut-off prewarped.
//!
//! With K = tan(π f_c/f_s), a pole pair of the analogue prototype at damping 1/Q gives
//! H(z) = K²(1 + z⁻¹)² / [(1 + K/Q + K²) + 2(K² − 1)z⁻¹ + (1 − K/Q + K²)z⁻²],
//! and the single pole of an odd order K(1 + z⁻¹) / [(1 + K) + (K − 1)z⁻¹]
//! (Oppenheim, Schafer: Discrete-Time Signal Processing, 3rd ed., 7.2.2). Each section has gain 1 at 0 Hz.

use std::f64::consts::{PI, SQRT_2};

/// One section: y = b₀x + b₁x₋₁ + b₂x₋₂ − a₁y₋₁ − a₂y₋₂.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Section {
    /// Of the input.
    pub b: [f64; 3],
    /// Of the output, a₁ and a₂; a₀ is 1.
    pub a: [f64; 2],
}

impl Section {
    /// Distance of its outermost pole from 0.
    fn pole_radius(&self) -> f64 {
        let [a1, a2] = self.a;
        let discriminant = 0.25 * a1 * a1 - a2;
        if discriminant < 0.0 { a2.sqrt() } else { 0.5 * a1.abs() + discriminant.sqrt() }
    }
}

/// Sections of a low-pass whose single pass is −3 dB at `cutoff_hz`, below half of `rate_hz`.
pub(crate) fn sections(order: usize, cutoff_hz: f64, rate_hz: f64) -> Vec<Section> {
    let k = (PI * cutoff_hz / rate_hz).tan();
    let mut sections = Vec::with_capacity(order.div_ceil(2));
    if order % 2 == 1 {
        let scale = 1.0 / (1.0 + k);
        sections.push(Section { b: [k * scale, k * scale, 0.0], a: [(k - 1.0) * scale, 0.0] });
    }
    // The most damped pair first: its output is the smallest.
    for pair in (0..order / 2).rev() {
        let damping = 2.0 * (PI * (2 * pair + 1) as f64 / (2 * order) as f64).sin();
        let scale = 1.0 / (1.0 + damping * k + k * k);
        let gain = k * k * scale;
        sections.push(Section {
            b: [gain, 2.0 * gain, gain],
            a: [2.0 * (k * k - 1.0) * scale, (1.0 - damping * k + k * k) * scale],
        });
    }
    sections
}

/// Samples after which the answer to an impulse has died away to `share`.
pub(crate) fn settling_samples(sections: &[Section], share: f64) -> usize {
    let radius = sections.iter().map(Section::pole_radius).fold(0.0, f64::max);
    // A pole at 0 forgets at once; the sections' own lengths remain.
    let decay = if radius > 0.0 { share.ln() / radius.ln() } else { 0.0 };
    decay.ceil() as usize + 2 * sections.len()
}

/// Where two passes together are −3 dB: |H|⁴ = ½, so that 1 + (tan(π f/f_s)/K)^2N = √2.
pub(crate) fn two_pass_half_power_hz(order: usize, cutoff_hz: f64, rate_hz: f64) -> f64 {
    let k = (PI * cutoff_hz / rate_hz).tan();
    let ratio = (SQRT_2 - 1.0).powf(0.5 / order as f64);
    (ratio * k).atan() * rate_hz / PI
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]
    use sci_rs::signal::filter::design::{DigitalFilter, FilterBandType, FilterOutputType, butter_dyn};

    use super::*;
    use runout_core::measurement::Response;

    #[test]
    fn poles_and_gains_are_those_of_an_independent_design() {
        for order in 1..=8 {
            for (cutoff_hz, rate_hz) in [(500.0, 20_000.0), (3.0, 1000.0), (400.0, 1000.0)] {
                let found = sections(order, cutoff_hz, rate_hz);
                let band = Some(FilterBandType::Lowpass);
                let output = Some(FilterOutputType::Sos);
                let DigitalFilter::Sos(expected) =
                    butter_dyn::<f64>(order, vec![cutoff_hz], band, Some(false), output, Some(rate_hz))
                else {
                    panic!("no sections");
                };
                // Sections may be paired otherwise; their product may not. Compared on the unit circle.
                for turn in [0.0, 0.01, 0.1, 0.2, 0.37] {
                    let z = num_complex_exp(turn);
                    let of = |b: [f64; 3], a: [f64; 3]| poly(b, z) / poly(a, z);
                    let ours: runout_core::Complex64 =
                        found.iter().map(|section| of(section.b, [1.0, section.a[0], section.a[1]])).product();
                    let theirs: runout_core::Complex64 =
                        expected.sos.iter().map(|section| of(section.b, section.a)).product();
                    // 1e-9: rounding of poles close to 1, where the lowest cut-off puts them.
                    assert!((ours - theirs).norm() < 1e-9, "order {order}, {cutoff_hz} Hz at {turn}: {ours} {theirs}");
                }
            }
        }
    }

    fn num_complex_exp(turn: f64) -> runout_core::Complex64 {
        runout_core::Complex64::cis(-std::f64::consts::TAU * turn)
    }

    fn poly(terms: [f64; 3], z: runout_core::Complex64) -> runout_core::Complex64 {
        terms[0] + z * (terms[1] + z * terms[2])
    }

    #[test]
    fn two_passes_are_half_power_where_it_is_said() {
        for order in 1..=8 {
            let half_power_hz = two_pass_half_power_hz(order, 100.0, 1000.0);
            let z = num_complex_exp(half_power_hz / 1000.0);
            let gain: f64 = sections(order, 100.0, 1000.0)
                .iter()
                .map(|section| (poly(section.b, z) / poly([1.0, section.a[0], section.a[1]], z)).norm_sqr())
                .product();
            assert!((gain - 0.5_f64.sqrt()).abs() < 1e-12, "order {order}: {gain}");
            // What is stated of the filter beside values.
            let response = Response { description: String::new(), half_power_hz, order, sample_rate_hz: 1000.0 };
            for frequency_hz in [1.0, 40.0, 90.0, 150.0, 300.0] {
                let z = num_complex_exp(frequency_hz / 1000.0);
                let gain: f64 = sections(order, 100.0, 1000.0)
                    .iter()
                    .map(|section| (poly(section.b, z) / poly([1.0, section.a[0], section.a[1]], z)).norm_sqr())
                    .product();
                assert!((response.amplitude(frequency_hz) - gain).abs() < 1e-12, "order {order}, {frequency_hz} Hz");
            }
        }
    }
}
