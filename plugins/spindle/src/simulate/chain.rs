//! From what a sensor sees to what is recorded: characteristic, drift, noise, filter, converter.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::fault::Fault;

use super::{
    check,
    config::{RecordingConfig, SampleFormat},
};

/// A channel's characteristic, the same in every capture.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub gain: f64,
    pub quadratic_per_um: f64,
    pub cubic_per_um2: f64,
    pub drifts: Vec<Drift>,
    pub pick_ups: Vec<PickUp>,
    pub noise_um: f64,
    pub filters: Vec<LowPass>,
    pub sign: f64,
    pub converter: Converter,
}

/// rate · τ · (1 − e^{−t/τ}), or rate · t.
#[derive(Debug, Clone)]
pub(super) struct Drift {
    pub rate_um_per_rev: f64,
    pub time_constant_turns: Option<f64>,
    /// Whether it drifts in each of the setups.
    pub setups: Vec<bool>,
}

/// A line that a channel picks up.
#[derive(Debug, Clone, Copy)]
pub(super) struct PickUp {
    pub runs: Runs,
    pub amplitude_um: f64,
    /// The effect's place in the list: channels of one effect have the same phase.
    pub item: usize,
}

/// What a line keeps to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Runs {
    /// Time: periods per sample.
    PerSample(f64),
    /// The spindle: periods per turn.
    PerTurn(f64),
}

impl Drift {
    fn at(&self, turns: f64) -> f64 {
        match self.time_constant_turns {
            Some(tau) => -self.rate_um_per_rev * tau * (-turns / tau).exp_m1(),
            None => self.rate_um_per_rev * turns,
        }
    }
}

impl Chain {
    pub(crate) fn new(noise_um: f64, sign: f64, converter: Converter) -> Self {
        Self {
            gain: 1.0,
            quadratic_per_um: 0.0,
            cubic_per_um2: 0.0,
            drifts: Vec::new(),
            pick_ups: Vec::new(),
            noise_um,
            filters: Vec::new(),
            sign,
            converter,
        }
    }

    /// Lowest and highest reading that can be recorded, in µm, the sign already applied.
    pub(crate) fn limits_um(&self) -> Option<[f64; 2]> {
        let [low, high] = self.converter.limits_um()?;
        Some(if self.sign < 0.0 { [-high, -low] } else { [low, high] })
    }
}

/// One channel in one capture: samples must come in their order.
pub(super) struct Channel<'a> {
    chain: &'a Chain,
    random: ChaCha8Rng,
    setup: usize,
    /// Phase of each line picked up, in periods.
    phases: Vec<f64>,
    filters: Vec<LowPass>,
    started: bool,
}

impl<'a> Channel<'a> {
    /// In a setup; `phase` gives that of the line of an effect, in periods.
    pub(crate) fn new(chain: &'a Chain, random: ChaCha8Rng, setup: usize, phase: impl Fn(usize) -> f64) -> Self {
        let phases = chain.pick_ups.iter().map(|pick_up| phase(pick_up.item)).collect();
        Self { chain, random, setup, phases, filters: chain.filters.clone(), started: false }
    }

    /// The recorded reading of a displacement `turns` nominal turns after the capture began, both in µm, at a sample and with the
    /// spindle at its angle in turns, whole ones and the rest.
    pub(crate) fn record(&mut self, displacement_um: f64, turns: f64, sample: u64, angle: (f64, f64)) -> f64 {
        let chain = self.chain;
        let curved = displacement_um * (chain.quadratic_per_um + displacement_um * chain.cubic_per_um2);
        let mut value = chain.gain * (displacement_um + displacement_um * curved);
        for drift in chain.drifts.iter().filter(|drift| drift.setups.get(self.setup).is_some_and(|drifts| *drifts)) {
            value += drift.at(turns);
        }
        for (pick_up, phase) in chain.pick_ups.iter().zip(&self.phases) {
            let periods = match pick_up.runs {
                Runs::PerSample(each) => (each * sample as f64).fract(),
                Runs::PerTurn(order) => (order * angle.0).fract() + order * angle.1,
            };
            value += pick_up.amplitude_um * (std::f64::consts::TAU * (periods + phase)).cos();
        }
        if chain.noise_um > 0.0 {
            value += chain.noise_um * self.random.sample::<f64, _>(StandardNormal);
        }
        for filter in &mut self.filters {
            if !self.started {
                filter.settle(value);
            }
            value = filter.step(value);
        }
        self.started = true;
        chain.sign * chain.converter.convert(chain.sign * value)
    }
}

/// What samples can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Converter {
    Double,
    Single,
    Integer { step_um: f64, lowest: f64, highest: f64 },
}

impl Converter {
    pub(crate) fn new(config: &RecordingConfig) -> Result<Self, Fault> {
        let highest = match config.format {
            SampleFormat::F64 | SampleFormat::F32 => {
                if config.range_um.is_some() {
                    return Err(Fault::at("range_um", "only integer samples have a range").help("set format = \"i16\""));
                }
                let double = config.format == SampleFormat::F64;
                return Ok(if double { Self::Double } else { Self::Single });
            }
            SampleFormat::I16 => f64::from(i16::MAX),
            SampleFormat::I32 => f64::from(i32::MAX),
        };
        let Some(range) = config.range_um else {
            return Err(Fault::at("format", "integer samples need `range_um`").help("add range_um = 100"));
        };
        check::positive("range_um", range)?;
        Ok(Self::Integer { step_um: range / highest, lowest: -highest - 1.0, highest })
    }

    fn limits_um(self) -> Option<[f64; 2]> {
        match self {
            Self::Integer { step_um, lowest, highest } => Some([lowest * step_um, highest * step_um]),
            _ => None,
        }
    }

    fn convert(self, value: f64) -> f64 {
        match self {
            Self::Double => value,
            Self::Single => f64::from(value as f32),
            Self::Integer { step_um, lowest, highest } => (value / step_um).round().clamp(lowest, highest) * step_um,
        }
    }
}

/// A digital Butterworth low-pass in sections of second order.
#[derive(Debug, Clone)]
pub(super) struct LowPass {
    sections: Vec<Section>,
}

/// y = b₀x + s₁; s₁ ← b₁x − a₁y + s₂; s₂ ← b₂x − a₂y.
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
    state: [f64; 2],
}

impl LowPass {
    /// The analogue prototype by the bilinear transform, its cut-off put back where it was (tan πf/fs for f).
    pub(crate) fn butterworth(order: usize, cutoff_hz: f64, sample_rate_hz: f64) -> Result<Self, Fault> {
        if !(1..=8).contains(&order) {
            return Err(Fault::at("order", format!("expected an order from 1 to 8, found {order}")));
        }
        if !(cutoff_hz > 0.0 && cutoff_hz < 0.5 * sample_rate_hz) {
            let half = 0.5 * sample_rate_hz;
            return Err(Fault::at(
                "cutoff_hz",
                format!("expected above 0 and below {half} Hz, half the sampling rate"),
            ));
        }
        let k = (std::f64::consts::PI * cutoff_hz / sample_rate_hz).tan();
        let pairs = (0..order / 2).map(|pair| {
            // 1/Q of the pair of poles.
            let damping = 2.0 * (std::f64::consts::PI * (2 * pair + 1) as f64 / (2 * order) as f64).sin();
            let norm = 1.0 / (1.0 + k * (damping + k));
            let b = k * k * norm;
            Section {
                b: [b, 2.0 * b, b],
                a: [2.0 * (k * k - 1.0) * norm, (1.0 + k * (k - damping)) * norm],
                state: [0.0; 2],
            }
        });
        let mut sections: Vec<Section> = pairs.collect();
        if order % 2 == 1 {
            let norm = 1.0 / (1.0 + k);
            sections.push(Section { b: [k * norm, k * norm, 0.0], a: [(k - 1.0) * norm, 0.0], state: [0.0; 2] });
        }
        Ok(Self { sections })
    }

    /// As if `value` had been there for ever.
    fn settle(&mut self, value: f64) {
        for section in &mut self.sections {
            section.state = [(1.0 - section.b[0]) * value, (section.b[2] - section.a[1]) * value];
        }
    }

    fn step(&mut self, mut value: f64) -> f64 {
        for Section { b, a, state } in &mut self.sections {
            let out = b[0] * value + state[0];
            state[0] = b[1] * value - a[0] * out + state[1];
            state[1] = b[2] * value - a[1] * out;
            value = out;
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, TAU};

    use super::*;

    fn gain(filter: &LowPass, cycles_per_sample: f64) -> f64 {
        let mut filter = filter.clone();
        let (mut re, mut im) = (0.0, 0.0);
        for index in 0..8000 {
            let (sin, cos) = (TAU * cycles_per_sample * f64::from(index)).sin_cos();
            let out = filter.step(cos);
            // The first half is left to the transient.
            if index >= 4000 {
                re += out * cos / 2000.0;
                im += out * sin / 2000.0;
            }
        }
        f64::hypot(re, im)
    }

    #[test]
    fn butterworth_is_flat_then_falls() {
        for order in 1..=8 {
            let filter = LowPass::butterworth(order, 100.0, 1000.0).unwrap();
            // 1e-9: transients of the sharpest filter after 4000 samples.
            assert!((gain(&filter, 0.1) - FRAC_1_SQRT_2).abs() < 1e-9, "order {order}");
            let warped = (std::f64::consts::PI * 0.25).tan() / (std::f64::consts::PI * 0.1).tan();
            let expected = 1.0 / (1.0 + warped.powi(2 * i32::try_from(order).unwrap())).sqrt();
            assert!((gain(&filter, 0.25) - expected).abs() < 1e-9, "order {order}");
            let mut settled = filter.clone();
            settled.settle(3.0);
            assert!((0..100).all(|_| (settled.step(3.0) - 3.0).abs() < 1e-13));
        }
        assert!(LowPass::butterworth(1, 500.0, 1000.0).is_err());
    }

    #[test]
    fn drift_starts_at_its_rate_and_settles() {
        let drift = Drift { rate_um_per_rev: 0.6, time_constant_turns: Some(25.0), setups: vec![true] };
        assert!((drift.at(1e-6) / 1e-6 - 0.6).abs() < 1e-7);
        assert!((drift.at(1e4) - 15.0).abs() < 1e-12);
        let straight = Drift { time_constant_turns: None, ..drift.clone() };
        assert!((straight.at(60.0) - 36.0).abs() < 1e-12);
        assert!((drift.at(25.0) - 15.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
    }

    #[test]
    fn codes_round_and_clip() {
        let config =
            RecordingConfig { format: SampleFormat::I16, range_um: Some(32.767), ..RecordingConfig::default() };
        let converter = Converter::new(&config).unwrap();
        assert!((converter.convert(0.0014) - 0.001).abs() < 1e-15);
        assert!((converter.convert(-0.0016) + 0.002).abs() < 1e-15);
        assert!((converter.convert(50.0) - 32.767).abs() < 1e-12);
        assert!((converter.convert(-50.0) + 32.768).abs() < 1e-12);
        let downwards = Chain::new(0.0, -1.0, converter);
        assert!((downwards.limits_um().unwrap()[1] - 32.768).abs() < 1e-12);
    }
}
