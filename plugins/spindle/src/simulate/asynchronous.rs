//! Motion of the axis that does not repeat from turn to turn: a fractal function of time, and single lines.

use std::f64::consts::TAU;

use runout_core::{Complex64, fault::Fault};

use super::{
    check,
    config::{AsynchronousConfig, AxialLineConfig, LineConfig},
    motion::Displacement,
    random::{Place, Purpose, phase, stream},
    series::LANES,
};

/// What all captures have in common.
#[derive(Debug, Clone)]
pub(super) struct Asynchronous {
    tones: Vec<Tone>,
    /// Root mean square of x, y in µm, tilt about x and y in µrad, z in µm, relative to the tones' amplitudes.
    scales: [f64; 5],
    lines: Vec<Line>,
}

/// One term of the Weierstrass-Mandelbrot function.
#[derive(Debug, Clone, Copy)]
struct Tone {
    cycles_per_sample: f64,
    amplitude: f64,
}

#[derive(Debug, Clone, Copy)]
struct Line {
    order: f64,
    /// x, y and z, in µm.
    amplitude_um: [f64; 3],
}

/// Terms that a fractal may have: γ so near 1 that it needs more is a mistake.
const MOST_TONES: usize = 2_000;
/// Samples after which the tones' rotation starts afresh from exact angles: 256 products round by 3e-14 at most.
const AFRESH: u64 = 256;

impl Asynchronous {
    pub(crate) fn new(config: &AsynchronousConfig, sample_rate_hz: f64, samples: u64) -> Result<Self, Fault> {
        let mut asynchronous = Self { tones: Vec::new(), scales: [0.0; 5], lines: Vec::new() };
        for (index, line) in config.lines.iter().enumerate() {
            asynchronous.add_line(line).map_err(|fault| fault.under_item("lines", index))?;
        }
        for (index, line) in config.z_lines.iter().enumerate() {
            asynchronous.add_axial_line(line).map_err(|fault| fault.under_item("z_lines", index))?;
        }
        check::not_negative("tilt_rms_urad", config.tilt_rms_urad)?;
        check::not_negative("z_rms_um", config.z_rms_um)?;
        if let Some(rms) = config.rms_um {
            check::not_negative("rms_um", rms)?;
        }
        if let Some(scale) = config.scale_mm {
            check::positive("scale_mm", scale)?;
            if config.rms_um.is_some() {
                return Err(Fault::at("scale_mm", "the size is given twice: leave out `scale_mm` or `rms_um`"));
            }
        }
        if !(config.dimension > 1.0 && config.dimension < 2.0) {
            let message = format!("the fractal dimension lies between 1 and 2, found {}", config.dimension);
            return Err(Fault::at("dimension", message));
        }
        if !(config.gamma.is_finite() && config.gamma > 1.0) {
            return Err(Fault::at("gamma", format!("expected a ratio above 1, found {}", config.gamma)));
        }
        let longest_s = config.longest_period_s.unwrap_or(samples as f64 / sample_rate_hz);
        check::positive("longest_period_s", longest_s)?;
        let highest_hz = config.max_frequency_hz.unwrap_or(0.5 * sample_rate_hz);
        check::positive("max_frequency_hz", highest_hz)?;

        let terms = (highest_hz * longest_s).ln() / config.gamma.ln();
        if terms > MOST_TONES as f64 {
            return Err(Fault::at("gamma", format!("{terms:.0} terms are too many; {MOST_TONES} are allowed"))
                .help("choose a larger ratio"));
        }
        let frequencies = (0..).map(|term| config.gamma.powi(term) / longest_s);
        let frequencies = frequencies.take_while(|hertz| *hertz <= highest_hz);
        asynchronous.tones = frequencies
            .map(|hertz| Tone {
                cycles_per_sample: hertz / sample_rate_hz,
                amplitude: hertz.powf(config.dimension - 2.0),
            })
            .collect();
        let drawn_rms = (0.5 * asynchronous.tones.iter().map(|tone| tone.amplitude.powi(2)).sum::<f64>()).sqrt();
        let wanted = config.rms_um.unwrap_or(0.0) > 0.0
            || config.scale_mm.is_some()
            || config.tilt_rms_urad > 0.0
            || config.z_rms_um > 0.0;
        if !wanted {
            asynchronous.tones.clear();
        } else if drawn_rms <= 0.0 {
            return Err(Fault::at("max_frequency_hz", "no term of the fractal is that slow"));
        } else {
            let across = match config.scale_mm {
                Some(scale) => 1e3 * scale.powf(config.dimension - 1.0),
                None => config.rms_um.unwrap_or(0.0) / drawn_rms,
            };
            let tilt = config.tilt_rms_urad / drawn_rms;
            asynchronous.scales = [across, across, tilt, tilt, config.z_rms_um / drawn_rms];
        }
        Ok(asynchronous)
    }

    pub(crate) fn add_line(&mut self, line: &LineConfig) -> Result<(), Fault> {
        check::positive("order", line.order)?;
        check::finite("amplitude_um", line.amplitude_um)?;
        check::finite("direction_deg", line.direction_deg)?;
        if line.order.fract().abs() < f64::EPSILON {
            return Err(Fault::at("order", format!("{} is whole: such motion repeats every turn", line.order))
                .help("put it into [motion]"));
        }
        let (sin, cos) = line.direction_deg.to_radians().sin_cos();
        let amplitude_um = [line.amplitude_um * cos, line.amplitude_um * sin, 0.0];
        self.lines.push(Line { order: line.order, amplitude_um });
        Ok(())
    }

    fn add_axial_line(&mut self, line: &AxialLineConfig) -> Result<(), Fault> {
        self.add_line(&LineConfig { order: line.order, amplitude_um: line.amplitude_um, direction_deg: 0.0 })?;
        if let Some(added) = self.lines.last_mut() {
            added.amplitude_um = [0.0, 0.0, line.amplitude_um];
        }
        Ok(())
    }

    /// No displacement across the axis (µm) and no tilt (µrad) is larger.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        let tones: f64 = self.tones.iter().map(|tone| tone.amplitude).sum();
        let lines: f64 = self.lines.iter().map(|line| line.amplitude_um[0].hypot(line.amplitude_um[1])).sum();
        (tones * self.scales[0].hypot(self.scales[1]) + lines, tones * self.scales[2].hypot(self.scales[3]))
    }

    /// The motion in one capture, as a channel sees it that is late by some samples.
    pub(crate) fn capture(&self, seed: u64, setup: usize, station: usize, delay_samples: f64) -> Wandering {
        let mut wandering = Wandering {
            delay_samples,
            cycles_per_sample: self.tones.iter().map(|tone| tone.cycles_per_sample).collect(),
            amplitudes: [const { Vec::new() }; 5],
            rotors: vec![Complex64::ONE; self.tones.len()],
            steps: self.tones.iter().map(|tone| Complex64::cis(TAU * tone.cycles_per_sample)).collect(),
            lines: Vec::new(),
        };
        for (item, (amplitudes, scale)) in wandering.amplitudes.iter_mut().zip(self.scales).enumerate() {
            if scale > 0.0 {
                let mut random = stream(seed, Purpose::Fractal, Place { setup, station, item });
                *amplitudes = self.tones.iter().map(|tone| scale * tone.amplitude * phase(&mut random)).collect();
            }
        }
        for (item, line) in self.lines.iter().enumerate() {
            let mut random = stream(seed, Purpose::Line, Place { setup, station, item });
            wandering.lines.push((*line, phase(&mut random).arg()));
        }
        wandering
    }
}

/// Asynchronous motion of one capture, sample after sample from the first.
pub(super) struct Wandering {
    delay_samples: f64,
    cycles_per_sample: Vec<f64>,
    /// Of x, y, tilt about x and y, z; empty where there is none.
    amplitudes: [Vec<Complex64>; 5],
    rotors: Vec<Complex64>,
    steps: Vec<Complex64>,
    lines: Vec<(Line, f64)>,
}

impl Wandering {
    /// Adds the motion at `count` samples from `start`; `turns` are the spindle's whole turns and the rest.
    pub(crate) fn add(
        &mut self,
        start: u64,
        count: usize,
        turns: &[(f64, f64); LANES],
        displacement: &mut Displacement<LANES>,
    ) {
        for lane in 0..count {
            self.turn_rotors(start + lane as u64);
            for (axis, amplitudes) in displacement.iter_mut().zip(&self.amplitudes) {
                let terms = amplitudes.iter().zip(&self.rotors);
                axis[lane] += terms.map(|(a, rotor)| a.re * rotor.re - a.im * rotor.im).sum::<f64>();
            }
            let (whole, rest) = turns[lane];
            for (line, phase) in &self.lines {
                let cycles = (line.order * whole).fract() + line.order * rest;
                let swing = (TAU * cycles + phase).cos();
                displacement[0][lane] += line.amplitude_um[0] * swing;
                displacement[1][lane] += line.amplitude_um[1] * swing;
                displacement[4][lane] += line.amplitude_um[2] * swing;
            }
        }
    }

    fn turn_rotors(&mut self, sample: u64) {
        if sample.is_multiple_of(AFRESH) {
            for (rotor, cycles) in self.rotors.iter_mut().zip(&self.cycles_per_sample) {
                *rotor = Complex64::cis(TAU * (cycles * (sample as f64 - self.delay_samples)).fract());
            }
        } else {
            for (rotor, step) in self.rotors.iter_mut().zip(&self.steps) {
                *rotor *= step;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(config: &AsynchronousConfig, samples: u64) -> Vec<[f64; 5]> {
        let asynchronous = Asynchronous::new(config, 1000.0, samples).unwrap();
        let mut capture = asynchronous.capture(3, 0, 0, 0.0);
        (0..samples)
            .map(|sample| {
                let mut displacement = [[0.0; LANES]; 5];
                let turns = [(sample as f64 * 0.01, 0.0); LANES];
                capture.add(sample, 1, &turns, &mut displacement);
                displacement.map(|axis| axis[0])
            })
            .collect()
    }

    #[test]
    fn the_fractal_is_as_large_as_asked() {
        let samples = 20_000;
        let config = AsynchronousConfig { rms_um: Some(0.15), tilt_rms_urad: 0.4, ..AsynchronousConfig::default() };
        let motion = series(&config, samples);
        for (axis, expected) in [0.15, 0.15, 0.4, 0.4].into_iter().enumerate() {
            let rms = (motion.iter().map(|point| point[axis].powi(2)).sum::<f64>() / samples as f64).sqrt();
            // 15 %: the slowest terms, which carry most, fit no whole number of times into the capture.
            assert!((rms / expected - 1.0).abs() < 0.15, "axis {axis}: {rms}");
        }
        // Directions are independent of one another: 0.6 is beyond four terms of the sum in step.
        let product: f64 = motion.iter().map(|point| point[0] * point[1]).sum();
        assert!((product / samples as f64).abs() < 0.6 * 0.15_f64.powi(2));
    }

    /// The sum written out, with the paper's G, γ and D: the recurrence drifts nowhere.
    #[test]
    fn the_fractal_is_the_formula() {
        let config = AsynchronousConfig { scale_mm: Some(1e-4), dimension: 1.6, ..AsynchronousConfig::default() };
        let asynchronous = Asynchronous::new(&config, 1000.0, 4000).unwrap();
        let capture = asynchronous.capture(3, 0, 0, 0.0);
        let phases: Vec<f64> = capture.amplitudes[0].iter().map(|amplitude| amplitude.arg()).collect();
        let motion = series(&config, 4000);
        for sample in [0_u16, 255, 256, 3999] {
            let time_s = f64::from(sample) / 1000.0;
            // γ^n₁ = 1/L with L = 4 s.
            let first = -(4.0_f64.ln()) / 1.5_f64.ln();
            let terms = (0..).map(|term| first + f64::from(term)).take_while(|n| 1.5_f64.powf(*n) <= 500.0);
            let sum: f64 = terms
                .zip(&phases)
                .map(|(n, phase)| 1.5_f64.powf((1.6 - 2.0) * n) * (TAU * 1.5_f64.powf(n) * time_s + phase).cos())
                .sum();
            let expected_um = 1e3 * 1e-4_f64.powf(0.6) * sum;
            // 1e-9 µm: phases of up to 2π·1200 rounded to 1e-12, times amplitudes of some µm.
            assert!((motion[usize::from(sample)][0] - expected_um).abs() < 1e-9);
        }
    }
}
