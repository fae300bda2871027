//! Simulated campaigns and their separation, in memory.

use std::path::Path;

use runout_core::{
    Complex64, Error, Result,
    consistency::turns::PhaseCourse,
    counted_turns::counted,
    inspection::Inspection,
    measurement::{Recording, StationTruth},
    numerics::fourier::Fourier,
    pipeline::{Context, StageConfig, put_right::marks::recounted},
    profile::Profile,
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    separation::{Quantity, Separation},
    spread::Projection,
    stage::{AverageRequest, Averager, Conditioner, Preprocessor, Station, StationSeparator},
};
use runout_preprocess::{SynchronousAverageConfig, TrimConfig};
use runout_spindle::simulate::{SpindleConfig, SpindleSimulator};

/// Four sensors at 0° and 90° in two sections, 30 mm apart.
#[must_use]
pub fn four_sensors(setups: &[(f64, f64)]) -> RigConfig {
    let sensor = |id: &str, angle_deg: f64, z_mm: f64, section: &str| SensorConfig {
        id: id.into(),
        angle_deg,
        z_mm,
        section: section.into(),
        sign: 1,
        ..SensorConfig::default()
    };
    RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![
            sensor("S1", 0.0, 100.0, "a"),
            sensor("S2", 90.0, 100.0, "a"),
            sensor("S3", 0.0, 130.0, "b"),
            sensor("S4", 90.0, 130.0, "b"),
        ],
        setups: setups
            .iter()
            .enumerate()
            .map(|(index, (part_deg, sensors_deg))| SetupConfig {
                id: format!("k{}", index + 1),
                part_deg: *part_deg,
                sensors_deg: *sensors_deg,
                ..SetupConfig::default()
            })
            .collect(),
    }
}

/// `docs/appendix/physics.md`'s campaign: 60 turns of 512 samples, sensor noise 0.05 µm, asynchronous motion 0.15 µm, form 4 µm rms,
/// motion 1.5 µm rms, part angles 0°, 99.844°, 202.5°, sensors fixed.
#[must_use]
pub fn reference(seed: u64, eccentricity_um: f64) -> SpindleConfig {
    let mut config = SpindleConfig::new(four_sensors(&[(0.0, 0.0), (99.844, 0.0), (202.5, 0.0)]));
    config.seed = seed;
    config.form.rms_um = 4.0;
    config.motion.x_rms_um = 1.5;
    config.motion.y_rms_um = 1.5;
    config.motion.tilt_rms_urad = 3.0;
    config.eccentricity.offset_um = eccentricity_um;
    config.asynchronous.rms_um = Some(0.15);
    config.noise.rms_um = 0.05;
    config
}

/// For stages that use nothing but their own keys.
fn no_context() -> Context<'static> {
    Context { folder: Path::new(""), rig: None }
}

/// A separated campaign of one station.
pub struct Outcome {
    /// Form and motion.
    pub separation: Separation,
    /// What the simulator says is true.
    pub truth: StationTruth,
}

/// Averages the first `turns` turns of the first station of a campaign on `samples_per_rev` angles.
///
/// # Errors
/// When a stage fails.
pub fn station(
    simulator: &SpindleSimulator,
    rig: &Rig,
    samples_per_rev: usize,
    turns: usize,
) -> Result<(Station, StationTruth)> {
    station_holding_out(simulator, rig, 0, [samples_per_rev, turns], None)
}

/// Averages the first turns (`[samples_per_rev, turns]`) of any station, a share of them by themselves besides.
///
/// # Errors
/// When a stage fails.
pub fn station_holding_out(
    simulator: &SpindleSimulator,
    rig: &Rig,
    station: usize,
    [samples_per_rev, turns]: [usize; 2],
    share: Option<f64>,
) -> Result<(Station, StationTruth)> {
    station_with_spread(simulator, rig, station, [samples_per_rev, turns], share, &[])
}

/// Averages the first turns (`[samples_per_rev, turns]`) of any station, a share of them by themselves besides. Where a
/// projection of a setup is given, the average has the spread of its turns.
///
/// # Errors
/// When a stage fails.
pub fn station_with_spread(
    simulator: &SpindleSimulator,
    rig: &Rig,
    station: usize,
    [samples_per_rev, turns]: [usize; 2],
    share: Option<f64>,
    projections: &[Option<Projection>],
) -> Result<(Station, StationTruth)> {
    let recording = simulator.spindle_recording();
    let averager = averager(samples_per_rev)?;
    let profile = |setup: usize| -> Result<Profile> {
        let projection = projections.get(setup).and_then(Option::as_ref);
        let wanted = AverageRequest { hold_out: share, projection };
        let average = |counted_by: &[PhaseCourse]| {
            let stream = counted_by.iter().fold(recording.open(station, setup)?, counted);
            let recorded = stream.capture().marks.len().saturating_sub(1);
            let trim = trim(recorded.saturating_sub(turns))?;
            averager.average_requested(trim.attach(Box::new(Inspection::new(stream)))?, wanted)
        };
        Ok(recounted(average(&[])?, |_| true, average))
    };
    let profiles: Result<Vec<Profile>> = (0..rig.setups.len()).map(profile).collect();
    let truth = recording.truth(station)?.unwrap_or_default();
    let missing = || Error::new("average", format!("station {station}"), "the campaign has no such station");
    let key = recording.stations().get(station).ok_or_else(missing)?;
    Ok((Station { name: key.name.clone(), z_mm: key.z_mm, profiles: profiles? }, truth))
}

fn trim(end_turns: usize) -> Result<Box<dyn Conditioner>> {
    match (TrimConfig { speed_tolerance_percent: 1.0, start_turns: 0, end_turns }).check(&no_context()) {
        Ok(Preprocessor::Conditioner(conditioner)) => Ok(conditioner),
        Ok(_) => Err(Error::new("set up", "the trim", "it is no conditioner")),
        Err(fault) => Err(Error::caused("set up", "the trim", fault)),
    }
}

fn averager(samples_per_rev: usize) -> Result<Box<dyn Averager>> {
    let config = SynchronousAverageConfig {
        samples_per_rev,
        min_turns: 2,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    };
    match config.check(&no_context()) {
        Ok(Preprocessor::Averager(averager)) => Ok(averager),
        Ok(_) => Err(Error::new("set up", "the average", "it is no averager")),
        Err(fault) => Err(Error::caused("set up", "the average", fault)),
    }
}

/// Separates the first station of a campaign.
///
/// # Errors
/// When a stage fails.
pub fn separate(station: &Station, truth: &StationTruth, separator: &dyn StationSeparator) -> Result<Outcome> {
    Ok(Outcome { separation: separator.separate(station)?, truth: truth.clone() })
}

impl Outcome {
    /// Root mean square error of the forms over an inclusive band of orders, in µm, over all sections.
    #[must_use]
    pub fn form_error_um(&self, orders: std::ops::RangeInclusive<usize>) -> f64 {
        let mut squares = 0.0;
        for (section, truth) in self.truth.form_um.iter().enumerate() {
            let Some(unknown) = self.separation.position(Quantity::Form(section)) else { return f64::NAN };
            let mut fourier = Fourier::new(truth.len());
            let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
            fourier.analyse(truth.iter().copied(), &mut harmonics);
            let found = self.separation.coefficients(unknown).enumerate().filter(|(order, _)| orders.contains(order));
            squares += found
                .map(|(order, value)| (value - harmonics.get(order).copied().unwrap_or_default()).norm_sqr())
                .sum::<f64>();
        }
        (0.5 * squares / self.truth.form_um.len() as f64).sqrt()
    }
}

impl Outcome {
    /// Form of a section over the part's angle, orders from 2, in µm.
    #[must_use]
    pub fn form_um(&self, section: usize, angles: usize) -> Vec<f64> {
        let Some(unknown) = self.separation.position(Quantity::Form(section)) else { return Vec::new() };
        let harmonics = self.separation.coefficients(unknown).enumerate();
        let from_two = harmonics.map(|(order, value)| if order < 2 { Complex64::ZERO } else { value });
        Fourier::new(angles).synthesise(from_two).to_vec()
    }
}
