//! The simulated world: what is really there, once all effects have had their say.

use runout_core::{
    Complex64,
    fault::Fault,
    measurement::StationKey,
    rig::{Calibration, Rig, Sensor},
};

use super::{
    asynchronous::Asynchronous,
    chain::{Chain, Converter},
    check,
    config::{Geometry, Phase, Scenario, StationsConfig},
    face,
    form::Form,
    geometry::Reach,
    motion::Motion,
    random::{Place, Purpose, phase, stream},
    series,
    spin::{Marks, SpinCourse},
    strangers::Stranger,
};

/// Everything that a capture is computed from.
#[derive(Debug)]
pub(super) struct World {
    /// As it is declared.
    pub rig: Rig,
    pub seed: u64,
    pub geometry: Geometry,
    pub radius_um: f64,
    pub stations: Vec<StationKey>,
    pub samples_per_rev: usize,
    pub speed_rpm: f64,
    pub sample_rate_hz: f64,
    pub phase: Phase,
    pub course: SpinCourse,
    pub form: Form,
    /// Form that turns with the spindle, in µm, from order 0.
    pub chuck_um: Vec<Complex64>,
    /// Of each section, the harmonics of the face there, in µm, from order 0; empty of a circle around the part.
    pub faces: Vec<Vec<Complex64>>,
    pub motion: Motion,
    /// Axial motion, Re Σ a e^{−inΦ}, in µm.
    pub axial_um: Vec<Complex64>,
    /// Shares of channels in the readings of others.
    pub cross_talk: Vec<Share>,
    pub asynchronous: Asynchronous,
    pub sensors: Vec<TrueSensor>,
    pub setups: Vec<TrueSetup>,
    /// Newton steps that the exact geometry needs.
    pub steps: usize,
}

/// A sensor as it really is.
#[derive(Debug, Clone)]
pub(super) struct TrueSensor {
    pub angle_rad: f64,
    pub z_mm: f64,
    /// Distance from the axis of a sensor that looks along it.
    pub axial_radius_mm: Option<f64>,
    pub section: usize,
    /// What it sees of the part besides its form, in µm, from order 0.
    pub run_out_um: Vec<Complex64>,
    /// Width of the arc over which it averages the form, in mm.
    pub spot_mm: f64,
    /// Share of the spindle's motion by which its bracket moves.
    pub bracket_share: f64,
    /// By how much its readings are late.
    pub delay_samples: f64,
    /// Of single setups: index and angle in rad, index and gain.
    pub angles_in_setups: Vec<(usize, f64)>,
    pub gains_in_setups: Vec<(usize, f64)>,
    pub chain: Chain,
    pub strangers: Vec<Stranger>,
}

/// A share of a channel's reading in that of another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub from: usize,
    pub to: usize,
    pub relative: f64,
}

/// A setup as it really is.
#[derive(Debug, Clone)]
pub(super) struct TrueSetup {
    pub part_rad: f64,
    pub sensors_rad: f64,
    pub motion_ratio: f64,
    /// What the part's form is more as it is clamped here, in µm, from order 0.
    pub clamping_form_um: Vec<Complex64>,
    /// What all readings are taken times.
    pub gain: f64,
    /// Of each channel, the sensor that it records.
    pub channels: Vec<usize>,
    /// Whether the spindle turns the other way than in the other setups.
    pub backwards: bool,
    /// Angles of the spindle at its marks.
    pub marks: Marks,
    /// Turns after which samples are lost, and how many, in turns.
    pub lost_turns: Option<(f64, f64)>,
    /// One a section.
    pub clamping: Vec<Clamping>,
    /// By which angle the surface under a sensor on the axis is turned, as e^{iψ}.
    pub pole: Complex64,
}

/// How the part's axis runs in the part's own coordinates: offset where z is [`World::clamping_z_mm`], and its growth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clamping {
    pub offset_um: Complex64,
    pub tilt_urad: Complex64,
}

/// mm · µrad in µm.
pub(super) const UM_PER_MM_URAD: f64 = 1e-3;
/// Stations that a campaign may have.
const MOST_STATIONS: usize = 1_000_000;
/// How many parts the random streams distinguish.
const MOST_PARTS: usize = 4_096;

impl World {
    /// Without effects.
    pub(crate) fn new<E>(config: &Scenario<E>) -> Result<Self, Fault> {
        let rig = config.rig.clone().check().map_err(|fault| fault.under("rig"))?;
        if rig.sensors.len() > MOST_PARTS || rig.setups.len() > MOST_PARTS {
            return Err(Fault::at("rig", format!("more than {MOST_PARTS} sensors or setups cannot be simulated")));
        }
        if let Some(index) = rig.sensors.iter().position(|sensor| sensor.calibration != Calibration::NONE) {
            let fault = Fault::here("a simulated sensor gives displacements in µm").under_item("sensors", index);
            let help = "leave `unit`, `um_per_volt`, `gain`, `quadratic_per_um` and `cubic_per_um2` out; an effect gives a \
                        sensor a gain or a characteristic";
            return Err(fault.under("rig").help(help));
        }
        let in_recording = |fault: Fault| fault.under("recording");
        let recording = &config.recording;
        check::positive("speed_rpm", recording.speed_rpm).map_err(in_recording)?;
        let course = SpinCourse::new(recording).map_err(in_recording)?;
        let converter = Converter::new(recording).map_err(in_recording)?;
        let stations = stations(&recording.stations).map_err(|fault| in_recording(fault.under("stations")))?;
        let sample_rate_hz = recording.samples_per_rev as f64 * recording.speed_rpm / 60.0;
        let orders = recording.samples_per_rev.div_ceil(2);

        let sections_mm: Vec<f64> = stations
            .iter()
            .flat_map(|station| {
                let around = (0..rig.sections.len()).filter(|section| !rig.is_face(*section));
                around.map(|section| station.z_mm + rig.section_z_mm(section))
            })
            .collect();
        let form = Form::new(&config.form, config.seed, &sections_mm, orders).map_err(|fault| fault.under("form"))?;
        let faces = face::harmonics(&config.face, &rig, config.seed, orders)?;
        let motion = Motion::new(&config.motion, config.seed, orders).map_err(|fault| fault.under("motion"))?;
        let asynchronous = Asynchronous::new(&config.asynchronous, sample_rate_hz, course.samples())
            .map_err(|fault| fault.under("asynchronous"))?;
        check::not_negative("rms_um", config.noise.rms_um).map_err(|fault| fault.under("noise"))?;
        let in_eccentricity = |fault: Fault| fault.under("eccentricity");
        check::finite("offset_um", config.eccentricity.offset_um).map_err(in_eccentricity)?;
        check::finite("tilt_urad", config.eccentricity.tilt_urad).map_err(in_eccentricity)?;

        let sensor = |sensor: &Sensor| TrueSensor {
            angle_rad: sensor.angle_rad,
            z_mm: sensor.z_mm,
            axial_radius_mm: sensor.axial_radius_mm,
            section: sensor.section,
            run_out_um: Vec::new(),
            spot_mm: 0.0,
            bracket_share: 0.0,
            delay_samples: 0.0,
            angles_in_setups: Vec::new(),
            gains_in_setups: Vec::new(),
            chain: Chain::new(config.noise.rms_um, sensor.sign, converter),
            strangers: Vec::new(),
        };
        let setups = rig.setups.iter().enumerate().map(|(index, setup)| {
            let mut random = stream(config.seed, Purpose::Eccentricity, Place { setup: index, ..Place::default() });
            let clamping = Clamping {
                offset_um: config.eccentricity.offset_um * phase(&mut random),
                tilt_urad: config.eccentricity.tilt_urad * phase(&mut random),
            };
            TrueSetup {
                part_rad: setup.part_rad,
                sensors_rad: setup.sensors_rad,
                motion_ratio: 1.0,
                clamping_form_um: Vec::new(),
                gain: 1.0,
                channels: (0..rig.sensors.len()).collect(),
                backwards: false,
                marks: Marks::default(),
                lost_turns: None,
                clamping: vec![clamping; rig.sections.len()],
                pole: phase(&mut stream(config.seed, Purpose::Pole, Place { setup: index, ..Place::default() })),
            }
        });
        Ok(Self {
            seed: config.seed,
            geometry: config.geometry,
            radius_um: 1e3 * rig.part_radius_mm,
            stations,
            samples_per_rev: recording.samples_per_rev,
            speed_rpm: recording.speed_rpm,
            sample_rate_hz,
            phase: recording.phase,
            course,
            form,
            faces,
            motion,
            cross_talk: Vec::new(),
            chuck_um: Vec::new(),
            axial_um: Vec::new(),
            asynchronous,
            sensors: rig.sensors.iter().map(sensor).collect(),
            setups: setups.collect(),
            steps: 0,
            rig,
        })
    }

    /// The world after the last change to it.
    pub(crate) fn completed(mut self) -> Result<Self, Fault> {
        let reach = self.reach();
        if self.geometry == Geometry::Exact && !reach.fits(self.radius_um) {
            let message = format!(
                "the axis moves by up to {:.0} µm and the form has up to {:.0} µm and {:.0} µm/rad: too much for a radius of {:.0} µm",
                reach.displacement, reach.form, reach.slope, self.radius_um
            );
            return Err(Fault::at("rig", message).help("displacement and form may reach a tenth of the radius"));
        }
        self.steps = reach.steps(self.radius_um);
        Ok(self)
    }

    /// The first order that the sampling cannot carry.
    pub(crate) fn orders(&self) -> usize {
        self.samples_per_rev.div_ceil(2)
    }

    /// Where the clamping's offset is given: the first section of the first station, in mm.
    pub(crate) fn clamping_z_mm(&self) -> f64 {
        self.rig.section_z_mm(0) + self.stations.first().map_or(0.0, |station| station.z_mm)
    }

    /// The part's axis under a sensor, in the part's own coordinates, in µm.
    pub(crate) fn clamped_at(&self, setup: &TrueSetup, sensor: &TrueSensor, z_mm: f64) -> Complex64 {
        let Some(clamping) = setup.clamping.get(sensor.section) else { return Complex64::ZERO };
        clamping.offset_um + clamping.tilt_urad * (UM_PER_MM_URAD * (z_mm - self.clamping_z_mm()))
    }

    fn reach(&self) -> Reach {
        let ends = [self.stations.first(), self.stations.last()];
        let mut displacement_um = 0.0_f64;
        let [x, y, tilt_x, tilt_y, _] = self.motion.axes.each_ref().map(|axis| series::bound(axis));
        let (wandering_um, wandering_urad) = self.asynchronous.bounds();
        for station in ends.into_iter().flatten() {
            for sensor in &self.sensors {
                let z_mm = sensor.z_mm + station.z_mm;
                let lever = UM_PER_MM_URAD * z_mm.abs();
                for setup in &self.setups {
                    let synchronous = x.hypot(y) + lever * tilt_x.hypot(tilt_y);
                    let asynchronous = wandering_um + lever * wandering_urad;
                    let clamped = self.clamped_at(setup, sensor, z_mm).norm();
                    displacement_um =
                        displacement_um.max(setup.motion_ratio.abs() * synchronous + asynchronous + clamped);
                }
            }
        }
        let besides = self.sensors.iter().map(|sensor| &sensor.run_out_um);
        let besides = besides.chain(self.setups.iter().map(|setup| &setup.clamping_form_um)).chain([&self.chuck_um]);
        let (form, slope) = besides.fold((self.form.bound_um(), self.form.slope_bound_um()), |(form, slope), one| {
            (form + series::bound(one), slope + series::slope_bound(one))
        });
        Reach { displacement: displacement_um, form, slope }
    }
}

fn stations(config: &StationsConfig) -> Result<Vec<StationKey>, Fault> {
    check::finite("first_z_mm", config.first_z_mm)?;
    check::finite("step_mm", config.step_mm)?;
    if !(1..=MOST_STATIONS).contains(&config.count) {
        return Err(Fault::at("count", format!("expected 1 to {MOST_STATIONS} stations, found {}", config.count)));
    }
    if config.count > 1 && config.step_mm.abs() <= 0.0 {
        return Err(Fault::at("step_mm", "stations at a step of 0 mm would be one and the same"));
    }
    let width = config.count.to_string().len().max(3);
    let station = |index: usize| StationKey {
        name: format!("s{:0width$}", index + 1),
        z_mm: config.first_z_mm + index as f64 * config.step_mm,
    };
    Ok((0..config.count).map(station).collect())
}
