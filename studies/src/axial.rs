//! How often the stated 95 % intervals of axial error motion cover the true value, over simulated spindles.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Error, Result,
    azimuth::FacePlace,
    error_motion::{CENTRE, ErrorMotion},
    evaluate::Value,
    measurement::StationTruth,
    numerics::fourier::Fourier,
    rig::{Looks, SensorConfig},
    separation::{Quantity, Separation},
    stage::StationSeparator,
};
use runout_spindle::{
    selection::Selection,
    separators::{HarmonicLeastSquares, Weighting},
    simulate::{AxialLineConfig, FaceConfig, MotionHarmonic, SpindleConfig, simulator},
};

use crate::{campaign, coverage::Row};

/// Half width of the 95 % interval of a normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;
/// Angles at which z is evaluated.
const ANGLES: usize = 36;
/// Setups that are separated; one more is recorded for what another capture would show.
const SETUPS: usize = 3;

/// Where the axial sensors are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// One at the pole of a ball, whose form is declared within a bound that it uses up.
    Pole,
    /// Three at a face of unknown form, at a radius of 20 mm.
    Face,
}

/// Where face motion is evaluated: distance from the axis in mm, angle in degrees.
const TOOL: (f64, f64) = (25.0, 200.0);
/// Name of the face motion at [`TOOL`] in symbols of values.
const AT_TOOL: &str = "face-at-25mm-200deg";

/// Bound of the form at the pole, peak to valley, in µm.
const BOUND_UM: f64 = 0.05;

impl Layout {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Pole, Self::Face];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pole => "one axial sensor at the pole of a ball, form declared within 0.05 µm",
            Self::Face => "three axial sensors at a face of unknown form, radius 20 mm",
        }
    }

    /// One campaign a seed. Sizes go over two decades: fundamental 0.02 to 2 µm, asynchronous motion 0.01 to 0.3 µm rms, noise 5 to 50 nm.
    #[must_use]
    pub fn campaigns(self, first_seed: u64, count: u64) -> Vec<SpindleConfig> {
        (first_seed..first_seed + count).map(|seed| self.campaign(seed)).collect()
    }

    fn campaign(self, seed: u64) -> SpindleConfig {
        let mut config = campaign::reference(seed, 8.0);
        // The golden ratio and its powers: sizes that no two seeds share.
        let share = |power: i32| (seed as f64 * 0.618_034_f64.powi(power)).fract();
        let between = |low: f64, high: f64, power| low * (high / low).powf(share(power));
        let axial = |(id, angle_deg): (&str, f64), radius_mm: f64, section: &str, form_um| SensorConfig {
            id: id.into(),
            angle_deg,
            looks: Looks::Axial,
            radius_mm: Some(radius_mm),
            form_um,
            section: section.into(),
            ..SensorConfig::default()
        };
        match self {
            Self::Pole => {
                config.rig.sensors.push(axial(("Z", 0.0), 0.0, "pole", Some(BOUND_UM)));
                // Two waves whose sum has the bound as its range, at most.
                let wave = |order, part: f64, power| MotionHarmonic {
                    order,
                    amplitude_um: 0.5 * part * BOUND_UM,
                    phase_deg: 360.0 * share(power),
                };
                let first = share(7);
                let harmonics = vec![wave(1, first, 8), wave(2 + (seed % 9) as usize, 1.0 - first, 9)];
                config.face = vec![FaceConfig { section: "pole".into(), harmonics, ..FaceConfig::default() }];
            }
            Self::Face => {
                let places = [("A1", 0.0), ("A2", 130.0), ("A3", 250.0)];
                config.rig.sensors.extend(places.map(|place| axial(place, 20.0, "face", None)));
                config.face = vec![FaceConfig { section: "face".into(), rms_um: 0.5, ..FaceConfig::default() }];
                config.eccentricity.tilt_urad = 50.0;
            }
        }
        let mut again = config.rig.setups[0].clone();
        again.id = "another".into();
        config.rig.setups.push(again);
        config.motion.z_rms_um = between(0.02, 0.8, 1);
        let phase_deg = 360.0 * share(2);
        config.motion.z.push(MotionHarmonic { order: 1, amplitude_um: between(0.01, 1.0, 3), phase_deg });
        config.asynchronous.z_rms_um = between(0.01, 0.3, 4);
        config.asynchronous.z_lines.push(AxialLineConfig { order: 0.38, amplitude_um: between(0.01, 0.2, 5) });
        config.noise.rms_um = between(0.005, 0.05, 6);
        config
    }
}

/// Coverage over campaigns.
///
/// # Errors
/// When a stage fails.
pub fn rows(campaigns: &[SpindleConfig]) -> Result<Vec<Row>> {
    let workers = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let share = campaigns.len().div_ceil(workers).max(1);
    let found: Vec<Result<Vec<Looked>>> = std::thread::scope(|scope| {
        let handles: Vec<_> = campaigns
            .chunks(share)
            .map(|part| {
                scope.spawn(move || {
                    let each: Result<Vec<Vec<Looked>>> = part.iter().map(looked_at).collect();
                    Ok(each?.concat())
                })
            })
            .collect();
        let stopped = || Err(Error::new("simulate", "campaigns", "a thread stopped"));
        handles.into_iter().map(|handle| handle.join().unwrap_or_else(|_| stopped())).collect()
    });
    let mut rows: Vec<Row> = Vec::new();
    for part in found {
        for Looked { name, error, std, holds } in part? {
            let index = rows.iter().position(|row| row.name == name).unwrap_or_else(|| {
                rows.push(Row::new(name.clone()));
                rows.len() - 1
            });
            rows[index].add_interval(error, std, holds);
        }
    }
    Ok(rows)
}

/// One interval beside the truth.
#[derive(Debug, Clone)]
struct Looked {
    name: String,
    error: f64,
    std: f64,
    holds: bool,
}

fn looked_at(config: &SpindleConfig) -> Result<Vec<Looked>> {
    let rig = config.rig.clone().check().map_err(|fault| Error::new("check", "the rig", fault))?;
    let simulator = simulator(config).map_err(|fault| Error::new("check", "the scenario", fault))?;
    let selection = Selection::new(&rig, (0..rig.sensors.len()).collect(), (0..SETUPS).collect());
    let separator = HarmonicLeastSquares::of(selection, true, Weighting::TurnCovariance, f64::INFINITY);
    let tool = FacePlace::of(TOOL.0, TOOL.1.to_radians());
    let projections: Vec<_> = (0..rig.setups.len())
        .map(|setup| Some(separator.projection(if setup < SETUPS { setup } else { 0 })?.with_faces(&[tool])))
        .collect();
    let sizes = [config.recording.samples_per_rev, config.recording.revolutions];
    let (mut station, truth) = campaign::station_with_spread(&simulator, &rig, 0, sizes, None, &projections)?;
    let another = station.profiles.pop();
    let separation = separator.separate(&station)?;
    let values = |profiles: &[runout_core::profile::Profile]| {
        let (station, z_mm, angles) = ("s001", 0.0, sizes[0]);
        let motion = ErrorMotion { station, z_mm, angles, separation: &separation, profiles, slope: 0.0 };
        motion.values(&[CENTRE])
    };
    let (found, other) = (values(&station.profiles), values(another.as_slice()));
    let mut all = at_angles(&separation, &truth)?;
    let value = |values: &[Value], symbol: &str| values.iter().find(|value| value.symbol == symbol).cloned();
    for (place, curve) in [("axial", truth.z_um.clone().unwrap_or_default()), (AT_TOOL, at_tool(&truth))] {
        for (kind, end, true_value) in true_values(&curve) {
            let symbol = format!("{kind}-{place}{end}");
            all.extend(value(&found, &symbol).and_then(|value| beside(&value, true_value)));
        }
    }
    for symbol in ["asynchronous-axial", "asynchronous-axial-rms", "total-axial"] {
        let true_value = value(&other, symbol).map_or(f64::NAN, |value| value.value);
        all.extend(value(&found, symbol).and_then(|value| beside(&value, true_value)));
    }
    Ok(all)
}

fn beside(value: &Value, truth: f64) -> Option<Looked> {
    let known = value.uncertainty.as_ref()?;
    let holds = known.interval_95[0] <= truth && truth <= known.interval_95[1];
    Some(Looked { name: value.symbol.clone(), error: value.value - truth, std: known.std, holds })
}

/// True motion along the axis at the tool: that of a point of a rigid body.
fn at_tool(truth: &StationTruth) -> Vec<f64> {
    let (sine, cosine) = TOOL.1.to_radians().sin_cos();
    let [at_x, at_y] = [1e-3 * TOOL.0 * cosine, 1e-3 * TOOL.0 * sine];
    let (Some(z_um), Some([_, _, tilt_x, tilt_y])) = (&truth.z_um, &truth.motion) else { return Vec::new() };
    z_um.iter().zip(tilt_x.iter().zip(tilt_y)).map(|(z, (tilt_x, tilt_y))| z + tilt_x * at_y - tilt_y * at_x).collect()
}

/// Values of a true motion along the axis: kind, end of the symbol, value.
fn true_values(z_um: &[f64]) -> Vec<(&'static str, &'static str, f64)> {
    let count = z_um.len().max(1) as f64;
    let part = |with: fn(f64) -> f64| {
        let each = z_um.iter().enumerate().map(|(index, z)| z * with(TAU * index as f64 / count));
        2.0 / count * each.sum::<f64>()
    };
    let [cosine, sine] = [part(f64::cos), part(f64::sin)];
    let residual: Vec<f64> = (0..z_um.len())
        .map(|index| {
            let (sin, cos) = (TAU * index as f64 / count).sin_cos();
            z_um[index] - cosine * cos - sine * sin
        })
        .collect();
    let range = |curve: &[f64]| {
        curve.iter().fold(f64::NEG_INFINITY, |high, value| high.max(*value))
            - curve.iter().fold(f64::INFINITY, |low, value| low.min(*value))
    };
    let rms = |curve: &[f64]| {
        let mean = curve.iter().sum::<f64>() / count;
        (curve.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    vec![
        ("fundamental", "", 2.0 * cosine.hypot(sine)),
        ("synchronous", "", range(z_um)),
        ("synchronous", "-rms", rms(z_um)),
        ("residual-synchronous", "", range(&residual)),
        ("residual-synchronous", "-rms", rms(&residual)),
    ]
}

/// z at equal angles, and the face's form where it was found.
fn at_angles(separation: &Separation, truth: &StationTruth) -> Result<Vec<Looked>> {
    let mut all = Vec::new();
    for (unknown, quantity) in separation.unknowns.iter().enumerate() {
        let curve = match quantity {
            Quantity::Z => truth.z_um.as_deref(),
            Quantity::FaceForm(section) => truth.form_um.get(*section).map(Vec::as_slice),
            _ => continue,
        };
        let curve = curve.ok_or_else(|| Error::new("look at", "the campaign", "it does not say what is true"))?;
        let turned = |value: Complex64| if quantity.is_form() { value } else { value.conj() };
        let mut fourier = Fourier::new(curve.len());
        let found = fourier.synthesise(separation.coefficients(unknown).map(turned)).to_vec();
        let std = separation.angle_std(unknown);
        let step = (curve.len() / ANGLES).max(1);
        for (found, truth) in found.iter().zip(curve).step_by(step) {
            let (name, error) = (format!("{} at angles", quantity.id()), found - truth);
            all.push(Looked { name, error, std, holds: error.abs() <= NORMAL_95 * std });
        }
    }
    Ok(all)
}
