//! How often the stated 95 % intervals cover the true value, over simulated campaigns with asynchronous motion.

use std::fmt::Write;

use runout_core::{
    Complex64, Error, Result,
    draws::{Draws, Measured, Uncertainty},
    measurement::StationTruth,
    numerics::fourier::Fourier,
    separation::{Quantity, Separation},
    stage::StationSeparator,
    standards::{roundness::ront_lsci_um, texture::ra_um},
};
use runout_spindle::{
    separators::{HarmonicLeastSquares, Weighting},
    simulate::{LineConfig, SpindleConfig, simulator},
};

use crate::campaign;

/// Half width of the 95 % interval of a normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;
/// Angles at which form and motion are evaluated.
const ANGLES: usize = 72;

/// Intervals of one kind that were evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which quantity, and how it is evaluated.
    pub name: String,
    /// Intervals that cover the true value.
    pub inside: usize,
    /// All intervals.
    pub all: usize,
    /// Mean square of the errors.
    squares: f64,
    /// Mean square of the stated standard uncertainties.
    stated: f64,
}

impl Row {
    pub(crate) fn new(name: String) -> Self {
        Self { name, inside: 0, all: 0, squares: 0.0, stated: 0.0 }
    }

    fn add(&mut self, error: f64, std: f64) {
        self.add_interval(error, std, error.abs() <= NORMAL_95 * std);
    }

    pub(crate) fn add_interval(&mut self, error: f64, std: f64, holds: bool) {
        self.all += 1;
        self.inside += usize::from(holds);
        self.squares += error * error;
        self.stated += std * std;
    }

    /// Share of the intervals that cover the true value, in percent.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * self.inside as f64 / self.all.max(1) as f64
    }
}

/// What the axis does besides repeating itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// The campaigns of the reference: asynchronous motion of 0.15 µm rms, sensor noise of 0.05 µm.
    Reference,
    /// Asynchronous motion far above the sensors' noise: 0.5 µm rms and 1 µrad, noise of 0.01 µm.
    Asynchronous,
    /// A bearing cage besides the reference: a line of 0.2 µm at 0.43 of a turn.
    Cage,
}

impl Setting {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Reference, Self::Asynchronous, Self::Cage];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reference => "asynchronous motion 0.15 µm rms, sensor noise 0.05 µm",
            Self::Asynchronous => "asynchronous motion 0.5 µm rms and 1 µrad, sensor noise 0.01 µm",
            Self::Cage => "as the first, and a line of 0.2 µm at order 0.43",
        }
    }

    /// One campaign a seed: four sensors, three part angles, 60 turns of 512 samples.
    #[must_use]
    pub fn campaigns(self, first_seed: u64, count: u64) -> Vec<SpindleConfig> {
        let campaign = |seed| {
            let mut config = campaign::reference(seed, 8.0);
            match self {
                Self::Reference => {}
                Self::Asynchronous => {
                    config.asynchronous.rms_um = Some(0.5);
                    config.asynchronous.tilt_rms_urad = 1.0;
                    config.noise.rms_um = 0.01;
                }
                Self::Cage => {
                    let line = LineConfig { order: 0.43, amplitude_um: 0.2, direction_deg: 30.0 };
                    config.asynchronous.lines.push(line);
                }
            }
            config
        };
        (first_seed..first_seed + count).map(campaign).collect()
    }
}

/// Coverage over campaigns.
///
/// # Errors
/// When a stage fails.
pub fn rows(campaigns: &[SpindleConfig]) -> Result<Vec<Row>> {
    let workers = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let share = campaigns.len().div_ceil(workers).max(1);
    let parts: Vec<Result<Vec<Row>>> = std::thread::scope(|scope| {
        let handles: Vec<_> = campaigns.chunks(share).map(|part| scope.spawn(|| part_rows(part))).collect();
        let stopped = || Err(Error::new("simulate", "campaigns", "a thread stopped"));
        handles.into_iter().map(|handle| handle.join().unwrap_or_else(|_| stopped())).collect()
    });
    let mut total: Vec<Row> = Vec::new();
    for part in parts {
        for row in part? {
            match total.iter_mut().find(|known| known.name == row.name) {
                Some(known) => {
                    known.inside += row.inside;
                    known.all += row.all;
                    known.squares += row.squares;
                    known.stated += row.stated;
                }
                None => total.push(row),
            }
        }
    }
    Ok(total)
}

fn part_rows(campaigns: &[SpindleConfig]) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for config in campaigns {
        let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
        let simulator = simulator(config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
        let recording = &config.recording;
        let (station, truth) = campaign::station(&simulator, &rig, recording.samples_per_rev, recording.revolutions)?;
        let separation = HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance).separate(&station)?;
        look(&separation, &truth, &mut rows);
    }
    Ok(rows)
}

fn look(separation: &Separation, truth: &StationTruth, rows: &mut Vec<Row>) {
    let width = separation.unknowns.len();
    for (unknown, quantity) in separation.unknowns.iter().enumerate() {
        let Some(curve) = true_curve(truth, *quantity) else { continue };
        let mut fourier = Fourier::new(curve.len());
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(curve.iter().copied(), &mut harmonics);
        let of = |kind: &str| format!("{}, {kind}", quantity.id());
        let mut error = vec![Complex64::ZERO; separation.max_order() + 1];
        // At 1/rev form is 0 by definition.
        let first = if quantity.is_form() { 2 } else { 1 };
        for (order, error) in error.iter_mut().enumerate().skip(first) {
            let index = order * width + unknown;
            if !separation.observable[index] {
                continue;
            }
            let truth = harmonics.get(order).copied().unwrap_or_default();
            let truth = if quantity.is_form() { truth } else { truth.conj() };
            *error = separation.estimate[index] - truth;
            // Half the variance is the real part's, half the imaginary part's.
            let std = separation.coefficient_std(index) / 2.0_f64.sqrt();
            let band = if order <= 15 { "orders to 15" } else { "orders from 16" };
            let row = entry(rows, of(band));
            row.add(error.re, std);
            row.add(error.im, std);
        }
        if quantity.is_form() {
            sizes(separation, unknown, curve, rows);
        }
        let turned = error.iter().map(|error| if quantity.is_form() { *error } else { error.conj() });
        let samples = Fourier::new(2 * error.len() + 2).synthesise(turned).to_vec();
        let std = separation.angle_std(unknown);
        let row = entry(rows, of("at angles"));
        for step in 0..ANGLES {
            row.add(samples[step * samples.len() / ANGLES], std);
        }
    }
}

/// Values that are not linear in the form.
fn sizes(separation: &Separation, unknown: usize, truth_um: &[f64], rows: &mut Vec<Row>) {
    let width = separation.unknowns.len();
    let from_two = |(order, value)| if order < 2 { Complex64::ZERO } else { value };
    let harmonics = separation.coefficients(unknown).enumerate().map(from_two);
    let harmonics: Vec<Complex64> = harmonics.collect();
    let variance: Vec<f64> = separation.variance.iter().skip(unknown).step_by(width).copied().collect();
    let squares = (0..variance.len()).map(|order| separation.degrees_of_freedom(order)).collect();
    // Any seed that is another one for another form.
    let seed = harmonics.last().map_or(0, |value| value.re.to_bits());
    let measured = Measured { harmonics, variance, squares, variance_from: separation.variance_from, lowest: 2 };
    let Some(draws) = Draws::of_section(&measured, seed) else { return };
    let values = |profile: &[f64], found: &mut Vec<f64>| found.extend([ront_lsci_um(profile), ra_um(profile)]);
    let mut truths = Vec::new();
    values(truth_um, &mut truths);
    let found = draws.profiles(|_| Complex64::ONE, truth_um.len(), |_, _| ()).values_of_section(values);
    for ((name, truth), known) in ["RONt", "Ra"].into_iter().zip(truths).zip(found) {
        let Some(Uncertainty { std, interval_95: [low, high], .. }) = known.uncertainty else { continue };
        entry(rows, name.into()).add_interval(known.found - truth, std, (low..=high).contains(&truth));
    }
}

fn entry(rows: &mut Vec<Row>, name: String) -> &mut Row {
    let index = rows.iter().position(|row| row.name == name).unwrap_or_else(|| {
        rows.push(Row::new(name));
        rows.len() - 1
    });
    &mut rows[index]
}

fn true_curve(truth: &StationTruth, quantity: Quantity) -> Option<&[f64]> {
    let axis = match quantity {
        Quantity::Form(section) | Quantity::FaceForm(section) => {
            return truth.form_um.get(section).map(Vec::as_slice);
        }
        Quantity::X => 0,
        Quantity::Y => 1,
        Quantity::TiltX => 2,
        Quantity::TiltY => 3,
        Quantity::Z => return truth.z_um.as_deref(),
        Quantity::Along(_) | Quantity::TiltAlong(_) | Quantity::FaceMotion(_) => return None,
    };
    Some(&truth.motion.as_ref()?[axis])
}

/// The table as Markdown.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text =
        String::from("| quantity | intervals | contain the truth | rms error / stated |\n| --- | --- | --- | --- |\n");
    for row in rows {
        let ratio = (row.squares / row.stated).sqrt();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {} | {} | {:.1} % | {ratio:.3} |", row.name, row.all, row.percent());
    }
    text
}
