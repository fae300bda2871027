//! The part: one function h(α, z), so that all sensors at the same z see the same circle.

use std::f64::consts::TAU;

use runout_core::{Complex64, fault::Fault};

use super::{
    check,
    config::FormConfig,
    random::{Place, Purpose, phase, stream},
    series::{self, Phasor},
};

/// h(α, z) = Re Σ_bands e^{iκz} Σₙ cₙ e^{inα}, in µm.
#[derive(Debug, Clone)]
pub(super) struct Form {
    bands: Vec<Band>,
    grooves: Vec<Groove>,
}

/// A keyway: where it begins and how wide it is, in turns of the part.
#[derive(Debug, Clone, Copy)]
struct Groove {
    from: f64,
    width: f64,
    depth_um: f64,
}

/// Harmonics whose phase advances along z at one rate.
#[derive(Debug, Clone)]
struct Band {
    /// κ, in rad/mm.
    twist_rad_per_mm: f64,
    /// cₙ, in µm, from order 0.
    harmonics: Vec<Complex64>,
}

/// Wavelengths of the random changes along z, relative to the configured one: two that do not repeat together.
const WAVELENGTHS: [f64; 2] = [1.0, 1.618];

impl Form {
    /// `sections_mm` are the z of all sections that are measured; `orders` is the first order that cannot be sampled.
    pub(crate) fn new(config: &FormConfig, seed: u64, sections_mm: &[f64], orders: usize) -> Result<Self, Fault> {
        check::not_negative("rms_um", config.rms_um)?;
        check::finite("slope", config.slope)?;
        check::positive("wavelength_mm", config.wavelength_mm)?;
        if !(0.0..=1.0).contains(&config.own_share) {
            return Err(Fault::at("own_share", format!("expected 0 to 1, found {}", config.own_share)));
        }
        if config.measured.is_some() {
            return Err(Fault::at("measured", "a file is read where a scenario is checked, not here"));
        }
        let mut form = Self { bands: Vec::new(), grooves: Vec::new() };
        for (index, keyway) in config.keyways.iter().enumerate() {
            let checked = || {
                check::finite("from_deg", keyway.from_deg)?;
                check::finite("to_deg", keyway.to_deg)?;
                check::finite("depth_um", keyway.depth_um)
            };
            checked().map_err(|fault| fault.under_item("keyways", index))?;
            let [from, to] = [keyway.from_deg, keyway.to_deg].map(|angle_deg| angle_deg / 360.0);
            form.grooves.push(Groove { from, width: (to - from).rem_euclid(1.0), depth_um: keyway.depth_um });
        }
        if config.rms_um > 0.0 {
            check::order("max_order", config.max_order, 2, orders)?;
            form.draw(config, seed);
            let squares = sections_mm.iter().map(|z| series::rms(&form.at(*z)).powi(2));
            let rms = (squares.sum::<f64>() / sections_mm.len().max(1) as f64).sqrt();
            form.bands.iter_mut().flat_map(|band| &mut band.harmonics).for_each(|value| *value *= config.rms_um / rms);
        }
        for (index, harmonic) in config.harmonics.iter().enumerate() {
            let checked = || {
                check::order("order", harmonic.order, 2, orders)?;
                check::finite("amplitude_um", harmonic.amplitude_um)?;
                check::finite("phase_deg", harmonic.phase_deg)?;
                check::finite("twist_deg_per_mm", harmonic.twist_deg_per_mm)
            };
            checked().map_err(|fault| fault.under_item("harmonics", index))?;
            let value = Complex64::from_polar(harmonic.amplitude_um, harmonic.phase_deg.to_radians());
            form.add(harmonic.twist_deg_per_mm.to_radians(), harmonic.order, value);
        }
        Ok(form)
    }

    fn draw(&mut self, config: &FormConfig, seed: u64) {
        let mut random = stream(seed, Purpose::Form, Place::default());
        let twists = WAVELENGTHS.iter().map(|ratio| TAU / (ratio * config.wavelength_mm));
        // Both signs of a twist together: amplitudes change along z, not only phases.
        let twists: Vec<f64> = twists.flat_map(|twist| [twist, -twist]).collect();
        let shared = (1.0 - config.own_share).sqrt();
        let own = (config.own_share / twists.len() as f64).sqrt();
        for order in 2..=config.max_order {
            let amplitude = (order as f64).powf(-config.slope);
            self.add(0.0, order, amplitude * shared * phase(&mut random));
            for twist in &twists {
                self.add(*twist, order, amplitude * own * phase(&mut random));
            }
        }
    }

    #[allow(clippy::float_cmp, reason = "a band is found by the very value that it was made with")]
    fn add(&mut self, twist_rad_per_mm: f64, order: usize, value: Complex64) {
        let found = self.bands.iter().position(|band| band.twist_rad_per_mm == twist_rad_per_mm);
        let index = found.unwrap_or_else(|| {
            self.bands.push(Band { twist_rad_per_mm, harmonics: Vec::new() });
            self.bands.len() - 1
        });
        series::add(&mut self.bands[index].harmonics, order, value);
    }

    /// Harmonics of the circle at z, in µm, from order 0.
    pub(crate) fn at(&self, z_mm: f64) -> Vec<Complex64> {
        let mut harmonics = vec![Complex64::ZERO; self.orders()];
        for band in &self.bands {
            let turned = Complex64::cis(band.twist_rad_per_mm * z_mm);
            for (sum, value) in harmonics.iter_mut().zip(&band.harmonics) {
                *sum += turned * value;
            }
        }
        harmonics
    }

    /// Writes the harmonics of the circle at a z for each lane, in µm, from order 0, into memory that is kept.
    pub(crate) fn fill<const L: usize>(&self, z_mm: &[f64; L], harmonics: &mut Vec<Phasor<L>>) {
        harmonics.clear();
        harmonics.resize(self.orders(), Phasor::ZERO);
        for band in &self.bands {
            let turned = Phasor::of_turns(&z_mm.map(|z_mm| band.twist_rad_per_mm * z_mm / TAU));
            for (sum, value) in harmonics.iter_mut().zip(&band.harmonics) {
                let term = turned.times(*value);
                for lane in 0..L {
                    sum.re[lane] += term.re[lane];
                    sum.im[lane] += term.im[lane];
                }
            }
        }
    }

    /// Whether there are grooves.
    pub(crate) fn is_grooved(&self) -> bool {
        !self.grooves.is_empty()
    }

    /// How deep the grooves are where the part's angle is that of a number, in µm.
    pub(crate) fn groove_um(&self, toward: Complex64) -> f64 {
        let turn = toward.arg() / TAU;
        let here = self.grooves.iter().filter(|groove| (turn - groove.from).rem_euclid(1.0) <= groove.width);
        here.map(|groove| groove.depth_um).sum()
    }

    /// One more than the highest order.
    fn orders(&self) -> usize {
        self.bands.iter().map(|band| band.harmonics.len()).max().unwrap_or(0)
    }

    /// No |h| is larger, in µm.
    pub(crate) fn bound_um(&self) -> f64 {
        self.bands.iter().map(|band| series::bound(&band.harmonics)).sum()
    }

    /// No |dh/dα| is larger, in µm/rad.
    pub(crate) fn slope_bound_um(&self) -> f64 {
        self.bands.iter().map(|band| series::slope_bound(&band.harmonics)).sum()
    }
}
