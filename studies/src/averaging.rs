//! Ra against the number of turns averaged: the four-sensor paper's Fig. 7 and Table 1, simulated.
//!
//! Qiao, Xu, Zhao (2024): N = 2560 samples a turn, 500 rpm, section a at 200 mm and b 30 mm further, R = 30 mm, part
//! and sensors reversed; asynchronous motion is a Weierstrass-Mandelbrot function, G = 1e-4, γ = 1.5, Ra 1.53 µm.

use std::fmt::Write;

use runout_core::{
    Complex64, Error, Result, measurement::Recording, numerics::fourier::Fourier, standards::texture::ra_um,
};
use runout_spindle::{
    selection::Selection,
    separators::four_sensor_reversal,
    simulate::{SpindleConfig, simulator},
};

use crate::{
    campaign,
    plot::{self, Axes, Curve},
};

/// Turns averaged.
pub const TURNS: [usize; 8] = [10, 20, 30, 40, 60, 80, 100, 120];
/// Ra of a process of normal height distribution is √(2/π) of its root mean square.
const RA_OF_RMS: f64 = 0.797_884_560_802_865_4;

/// Ra over the number of turns averaged.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Turns averaged.
    pub turns: usize,
    /// Ra of sensor S1's average, without separation, in µm.
    pub reading_um: f64,
    /// Ra of the separated forms, in µm.
    pub form_um: [f64; 2],
    /// Error of the separated forms, in µm rms over orders from 2.
    pub error_um: f64,
}

/// A simulated campaign under the paper's settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Ra of the true forms, in µm.
    pub own_um: [f64; 2],
    /// One entry a number of turns.
    pub rows: Vec<Row>,
}

/// Fig. 7: form of Ra 1.85 µm in both sections, asynchronous motion of Ra 1.53 µm, no synchronous motion.
///
/// # Errors
/// When the scenario cannot be computed.
pub fn figure_7() -> Result<SpindleConfig> {
    let mut config = settings();
    config.form.own_share = 0.0;
    with_mean_ra(config, 1.85)
}

/// Table 1: form of Ra 4.86 µm, the mean of the paper's two sections, with synchronous motion besides.
///
/// # Errors
/// When the scenario cannot be computed.
pub fn table_1() -> Result<SpindleConfig> {
    let mut config = settings();
    config.form.own_share = 0.3;
    config.motion.x_rms_um = 2.0;
    config.motion.y_rms_um = 2.0;
    config.motion.tilt_rms_urad = 5.0;
    config.eccentricity.offset_um = 8.0;
    config.noise.rms_um = 0.05;
    with_mean_ra(config, 4.86)
}

/// Scales the form, which is proportional to its `rms_um`, to a mean Ra of its sections.
fn with_mean_ra(mut config: SpindleConfig, ra_mean_um: f64) -> Result<SpindleConfig> {
    config.form.rms_um = 1.0;
    let simulator = simulator(&config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let truth = simulator.spindle_recording().truth(0)?.unwrap_or_default();
    let sections = truth.form_um.len() as f64;
    config.form.rms_um = ra_mean_um * sections / truth.form_um.iter().map(|form| ra_um(form)).sum::<f64>();
    Ok(config)
}

fn settings() -> SpindleConfig {
    let mut rig = campaign::four_sensors(&[(0.0, 0.0), (180.0, 180.0)]);
    for sensor in &mut rig.sensors {
        sensor.z_mm += 100.0;
    }
    let mut config = SpindleConfig::new(rig);
    config.seed = 7;
    config.recording.samples_per_rev = 2560;
    config.recording.revolutions = 120;
    config.asynchronous.rms_um = Some(1.53 / RA_OF_RMS);
    config
}

/// Separates a campaign with growing numbers of turns.
///
/// # Errors
/// When a stage fails.
pub fn study(config: &SpindleConfig) -> Result<Study> {
    let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
    let simulator = simulator(config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let separator = four_sensor_reversal::separator(Selection::whole(&rig), true, false)
        .map_err(|fault| Error::caused("set up", "the separator", fault))?;
    let samples = config.recording.samples_per_rev;
    let mut study = Study { own_um: [f64::NAN; 2], rows: Vec::new() };
    for turns in TURNS {
        let (station, truth) = campaign::station(&simulator, &rig, samples, turns)?;
        let reading = station.profiles.first().map_or(f64::NAN, |profile| {
            let channels = profile.channels();
            // The clamping's 1/rev is no texture.
            let harmonics = profile.mean.iter().step_by(channels).enumerate();
            let from_two = harmonics.map(|(order, value)| if order < 2 { Complex64::ZERO } else { value.conj() });
            ra_um(Fourier::new(samples).synthesise(from_two))
        });
        let outcome = campaign::separate(&station, &truth, &separator)?;
        study.own_um = [0, 1].map(|section| truth.form_um.get(section).map_or(f64::NAN, |form| ra_um(form)));
        study.rows.push(Row {
            turns,
            reading_um: reading,
            form_um: [0, 1].map(|section| ra_um(&outcome.form_um(section, samples))),
            error_um: outcome.form_error_um(2..=samples / 2),
        });
    }
    Ok(study)
}

impl Study {
    /// The table as Markdown.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| turns | S1's average, not separated: Ra | section a: Ra | section b: Ra | form error |\n\
             | --- | --- | --- | --- | --- |\n",
        );
        for row in &self.rows {
            let [a, b] = row.form_um;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| {} | {:.4} µm | {a:.4} µm | {b:.4} µm | {:.4} µm rms |",
                row.turns, row.reading_um, row.error_um
            );
        }
        let [a, b] = self.own_um;
        let _ = writeln!(text, "| the part's own | | {a:.4} µm | {b:.4} µm | |");
        text
    }

    /// Ra of section a and of the plain average over the number of turns, as PNG.
    ///
    /// # Errors
    /// When the picture cannot be drawn.
    pub fn picture(&self, title: &str) -> Result<Vec<u8>> {
        let curve = |name: &str, colour, value: &dyn Fn(&Row) -> f64| Curve {
            name: name.into(),
            points: self.rows.iter().map(|row| (row.turns as f64, value(row))).collect(),
            colour,
            dashed: false,
            dots: true,
        };
        let own = Curve { dashed: true, dots: false, ..curve("the part's own", "#555555", &|_| self.own_um[0]) };
        let curves = [
            curve("S1's average, not separated", "#c1440e", &|row| row.reading_um),
            curve("form, section a", "#1f6fb4", &|row| row.form_um[0]),
            own,
        ];
        plot::curves(&Axes { title, x: "turns averaged", y: "Ra / µm" }, &curves)
            .map_err(|problem| Error::new("draw", title, problem))
    }
}
