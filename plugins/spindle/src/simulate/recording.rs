//! The recording: samples are computed as they are read.

use std::path::PathBuf;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    measurement::{Block, Capture, Recording, SampleStream, StationKey, StationTruth},
};

use super::{
    asynchronous::Wandering,
    chain::Channel,
    config::{Geometry, Phase},
    geometry::{self, Sight},
    motion::Displacement,
    profile::Profile,
    random::{Place, Purpose, phase, stream},
    series::{self, LANES, Phasor, Series},
    spin::{Marks, Spin},
    strangers::{Acting, Slip},
    world::{UM_PER_MM_URAD, World},
};

/// Samples of a block, unless asked otherwise: some hundred kilobytes.
pub(super) const BLOCK_SAMPLES: usize = 4096;

/// A simulated recording of all stations in all setups.
pub struct SpindleRecording<'a> {
    pub(super) world: &'a World,
    pub(super) block_samples: usize,
}

impl Recording for SpindleRecording<'_> {
    fn stations(&self) -> &[StationKey] {
        &self.world.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        Ok(Box::new(SimulatedStream::new(self.world, self.block_samples, station, setup)?))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn truth(&self, station: usize) -> Result<Option<StationTruth>> {
        let world = self.world;
        let key = world.stations.get(station).ok_or_else(|| missing("station", station))?;
        let circle = |section: usize| {
            if world.rig.is_face(section) {
                return series::turn(&world.faces[section], world.samples_per_rev, false);
            }
            let harmonics = world.form.at(key.z_mm + world.rig.section_z_mm(section));
            series::turn(&harmonics, world.samples_per_rev, false)
        };
        let [x, y, tilt_x, tilt_y, mut z] = world.motion.error_motion(world.rig.rotation.direction()).axes;
        for (order, value) in world.axial_um.iter().enumerate() {
            series::add(&mut z, order, *value);
        }
        let turn = |axis: &[Complex64]| series::turn(axis, world.samples_per_rev, true);
        Ok(Some(StationTruth {
            form_um: (0..world.rig.sections.len()).map(circle).collect(),
            motion: Some([x, y, tilt_x, tilt_y].map(|axis| turn(&axis))),
            z_um: world.rig.has_axial().then(|| turn(&z)),
        }))
    }
}

fn missing(noun: &str, index: usize) -> Error {
    Error::new("simulate", format!("{noun} {index}"), "the scenario has none of this number")
        .of(ErrorKind::Configuration)
}

/// One station in one setup.
struct SimulatedStream<'a> {
    world: &'a World,
    capture: Capture,
    block_samples: usize,
    /// Index of the next sample.
    position: u64,
    spin: Spin,
    /// By how many samples sensors are late, and the asynchronous motion as they see it then; the first ones are not late.
    late: Vec<(f64, Wandering)>,
    /// Angles of the spindle at its marks.
    marks: Marks,
    /// Turns after which samples are lost, and how many, in turns.
    lost_turns: Option<(f64, f64)>,
    motion_ratio: f64,
    /// Whether the spindle turns the other way than in the other setups.
    backwards: bool,
    sensors: Vec<Looking<'a>>,
}

/// A sensor in one capture.
struct Looking<'a> {
    /// Index of how late it is.
    late: usize,
    /// What its reading is taken times in this setup.
    gain: f64,
    stance: Stance,
    z_mm: f64,
    /// What a sensor that looks along the axis sees.
    face: Option<Face<'a>>,
    /// The part's axis in the part's own coordinates, in µm.
    clamped: Complex64,
    /// Share of the spindle's motion that it sees: less where its bracket moves too.
    motion_share: f64,
    /// What it sees of the part at its z.
    profile: Profile,
    /// What it sees where axial motion has moved the part, instant by instant.
    moved: Vec<Phasor<LANES>>,
    strangers: Vec<Acting>,
    channel: Channel<'a>,
}

/// A face under a sensor that looks along the axis.
struct Face<'a> {
    radius_um: f64,
    /// Deviation under the sensor's circle, in µm.
    harmonics: &'a [Complex64],
    /// How far the part's axis leans in the part's own coordinates, in µrad.
    lean_urad: Complex64,
    /// By which angle the surface on the axis is turned.
    pole: Complex64,
}

/// Where a sensor looks from.
#[derive(Debug, Clone, Copy)]
struct Stance {
    /// e^{iθ′}, the direction of its line.
    line: Complex64,
    /// e^{i(θ′ − β)}.
    toward: Complex64,
}

/// The spindle at some instants.
struct Instants {
    /// e^{iΦ} turned the way the part turns.
    turned: Phasor<LANES>,
    displacement: Displacement<LANES>,
    /// Displacement of the part along the axis, where there is any.
    axial_um: Option<[f64; LANES]>,
    /// Its angle in turns: whole ones and the rest.
    turns: [(f64, f64); LANES],
}

impl<'a> SimulatedStream<'a> {
    fn new(world: &'a World, block_samples: usize, station: usize, setup: usize) -> Result<Self> {
        let key = world.stations.get(station).ok_or_else(|| missing("station", station))?;
        let clamped_in = world.setups.get(setup).ok_or_else(|| missing("setup", setup))?;
        let name = world.rig.setups.get(setup).map_or("", |setup| setup.id.as_str());
        let spin = world.course.spin(world.seed, setup, station);
        let mut delays = vec![0.0];
        delays.extend(world.sensors.iter().map(|sensor| sensor.delay_samples).filter(|delay| *delay != 0.0));
        delays.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        delays.dedup_by(|a, b| a.total_cmp(b).is_eq());
        let of_setup = |values: &[(usize, f64)]| -> Vec<f64> {
            values.iter().filter(|(only, _)| *only == setup).map(|(_, value)| *value).collect()
        };
        let sensors = clamped_in.channels.iter().enumerate().map(|(item, sensor)| {
            let sensor = &world.sensors[*sensor];
            let angle =
                sensor.angle_rad + clamped_in.sensors_rad + of_setup(&sensor.angles_in_setups).iter().sum::<f64>();
            let z_mm = sensor.z_mm + key.z_mm;
            let random = stream(world.seed, Purpose::Noise, Place { setup, station, item });
            Looking {
                late: delays.iter().position(|delay| delay.total_cmp(&sensor.delay_samples).is_eq()).unwrap_or(0),
                gain: clamped_in.gain * of_setup(&sensor.gains_in_setups).iter().product::<f64>(),
                stance: Stance { line: Complex64::cis(angle), toward: Complex64::cis(angle - clamped_in.part_rad) },
                z_mm,
                face: sensor.axial_radius_mm.map(|radius_mm| Face {
                    radius_um: 1e3 * radius_mm,
                    harmonics: &world.faces[sensor.section],
                    lean_urad: clamped_in.clamping.get(sensor.section).map_or(Complex64::ZERO, |one| one.tilt_urad),
                    pole: clamped_in.pole,
                }),
                clamped: world.clamped_at(clamped_in, sensor, z_mm),
                motion_share: 1.0 - sensor.bracket_share,
                profile: Profile::new(world, clamped_in, sensor, z_mm),
                moved: Vec::new(),
                strangers: Acting::all(&sensor.strangers, setup),
                channel: Channel::new(&sensor.chain, random, setup, |item| {
                    let mut random = stream(world.seed, Purpose::PickUp, Place { setup, station, item });
                    phase(&mut random).arg() / std::f64::consts::TAU
                }),
            }
        });
        let late = delays.iter().map(|delay| (*delay, world.asynchronous.capture(world.seed, setup, station, *delay)));
        let limits: Option<Vec<[f64; 2]>> = world.sensors.iter().map(|sensor| sensor.chain.limits_um()).collect();
        let capture = Capture {
            object: format!("simulation:/{name}/{}", key.name),
            setup,
            station: key.name.clone(),
            z_mm: key.z_mm,
            stated_speed_rpm: Some(world.speed_rpm),
            sample_rate_hz: Some(world.sample_rate_hz),
            samples: world.course.samples(),
            sensors: (0..world.sensors.len()).collect(),
            sensor_ids: world.rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um: limits,
            marks: spin.marks(&clamped_in.marks),
            marks_within_samples: 0.0,
            encoder: world.phase == Phase::Encoder,
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        Ok(Self {
            world,
            capture,
            block_samples: block_samples.max(1),
            position: 0,
            spin,
            late: late.collect(),
            marks: clamped_in.marks,
            lost_turns: clamped_in.lost_turns,
            motion_ratio: clamped_in.motion_ratio,
            backwards: clamped_in.backwards,
            sensors: sensors.collect(),
        })
    }

    /// The spindle as late sensors see it at `count` samples from `start`; lanes behind repeat the last.
    fn instants(&mut self, late: usize, start: u64, count: usize) -> Instants {
        let (delay_samples, wandering) = &mut self.late[late];
        let mut turns = [(0.0, 0.0); LANES];
        for (lane, angle) in turns.iter_mut().enumerate() {
            *angle = self.spin.turns((start + lane.min(count - 1) as u64) as f64 - *delay_samples);
            if let Some((_, lost)) = self.lost_turns.filter(|(after, _)| angle.0 + angle.1 >= *after) {
                angle.1 += lost;
            }
        }
        let forwards = Phasor::of_turns(&turns.map(|(_, rest)| rest));
        let turn = if self.backwards { forwards.conj() } else { forwards };
        let mut displacement = self.world.motion.at(&turn);
        for value in displacement.iter_mut().flatten() {
            *value *= self.motion_ratio;
        }
        wandering.add(start, count, &turns, &mut displacement);
        let axial = &self.world.axial_um;
        let mut axial_um = (!axial.is_empty()).then(|| axial.as_slice().sum(&turn.conj()));
        if displacement[4].iter().any(|z| *z != 0.0) {
            let sum = axial_um.get_or_insert([0.0; LANES]);
            sum.iter_mut().zip(&displacement[4]).for_each(|(sum, z)| *sum += z);
        }
        let turned = if self.world.rig.rotation.direction() > 0.0 { turn } else { turn.conj() };
        Instants { turned, displacement, axial_um, turns }
    }
}

impl Looking<'_> {
    /// What arrives at the sensor's own electronics from the first `count` instants, in µm.
    fn look(&mut self, world: &World, instants: &Instants, count: usize) -> [f64; LANES] {
        let mut seen = self.see(world, instants, self.stance);
        if self.strangers.is_empty() {
            return seen;
        }
        let slips: Vec<Slip> = self.strangers.iter().filter_map(Acting::slip).collect();
        let mut stance = self.stance;
        for slip in slips.iter().filter(|slip| slip.turned != Complex64::ONE) {
            stance = Stance { line: stance.line * slip.turned, toward: stance.toward * slip.turned };
            let elsewhere = self.see(world, instants, stance);
            for lane in (0..count).filter(|lane| slip.has_happened(instants.turns[*lane])) {
                seen[lane] = elsewhere[lane];
            }
        }
        let toward = instants.turned.conj().times(self.stance.toward);
        for lane in 0..count {
            let toward = Complex64::new(toward.re[lane], toward.im[lane]);
            for stranger in &mut self.strangers {
                seen[lane] = stranger.act(seen[lane], instants.turns[lane], toward);
            }
        }
        seen
    }

    /// How far the surface stands out along the sensor's line, in µm.
    fn see(&mut self, world: &World, instants: &Instants, stance: Stance) -> [f64; LANES] {
        // α₀ = θ′ − direction·Φ − β.
        let toward = instants.turned.conj().times(stance.toward);
        if let Some(face) = &self.face {
            return self.see_face(world, instants, stance, face);
        }
        let lever = UM_PER_MM_URAD * self.z_mm;
        let (mut along, mut across) = ([0.0; LANES], [0.0; LANES]);
        let [x, y, tilt_x, tilt_y, _] = &instants.displacement;
        for lane in 0..LANES {
            let axis = Complex64::new(x[lane] + lever * tilt_y[lane], y[lane] - lever * tilt_x[lane]);
            let axis = self.motion_share * axis;
            // The part's own x axis stands at angle −α₀ in the sensor's frame.
            let clamped = self.clamped * Complex64::new(toward.re[lane], -toward.im[lane]);
            let centre = axis * stance.line.conj() + clamped;
            (along[lane], across[lane]) = (centre.re, centre.im);
        }
        let sight = Sight { toward, along, across };
        let mut seen = match &instants.axial_um {
            None => meet(world, self.profile.harmonics(), &sight),
            Some(axial_um) => {
                // The part has moved up by a: the sensor sees what was at z − a.
                world.form.fill(&axial_um.map(|axial_um| self.z_mm - 1e-3 * axial_um), &mut self.moved);
                self.profile.see(&mut self.moved);
                meet(world, self.moved.as_slice(), &sight)
            }
        };
        if world.form.is_grooved() {
            for (lane, seen) in seen.iter_mut().enumerate() {
                *seen -=
                    self.profile.groove_um(&world.form, Complex64::new(sight.toward.re[lane], sight.toward.im[lane]));
            }
        }
        seen
    }
}

impl Looking<'_> {
    /// How far the face stands out towards +z under the sensor, in µm: the place of the face there in the part's own coordinates, the
    /// height of that place, and how the part is displaced and tilted.
    fn see_face(&self, world: &World, instants: &Instants, stance: Stance, face: &Face) -> [f64; LANES] {
        let [x, y, tilt_x, tilt_y, _] = &instants.displacement;
        let lever = UM_PER_MM_URAD * self.z_mm;
        let mut seen = instants.axial_um.unwrap_or([0.0; LANES]);
        let mut under = Phasor::<LANES>::ZERO;
        for lane in 0..LANES {
            let turned = Complex64::new(instants.turned.re[lane], instants.turned.im[lane]);
            // Where the sensor stands, from the part's axis.
            let axis = Complex64::new(x[lane] + lever * tilt_y[lane], y[lane] - lever * tilt_x[lane]);
            let from_axis = match world.geometry {
                Geometry::Exact => stance.line * face.radius_um - axis,
                Geometry::Linear => stance.line * face.radius_um,
            };
            // The plane z = ε_x·y − ε_y·x of a part that is tilted, and that of a part whose own axis leans.
            seen[lane] += 1e-6 * (tilt_x[lane] * from_axis.im - tilt_y[lane] * from_axis.re);
            let own_zero = stance.line.conj() * stance.toward;
            let place = from_axis * own_zero * turned.conj()
                - if world.geometry == Geometry::Exact { self.clamped } else { Complex64::ZERO };
            seen[lane] -= 1e-6 * (face.lean_urad.conj() * place).re;
            let direction = if face.radius_um > 0.0 { place / place.norm() } else { turned.conj() * face.pole };
            (under.re[lane], under.im[lane]) = (direction.re, direction.im);
        }
        let height = face.harmonics.sum(&under);
        seen.iter_mut().zip(height).for_each(|(seen, height)| *seen += height);
        seen
    }
}

fn meet<const L: usize>(world: &World, profile: &(impl Series<L> + ?Sized), sight: &Sight<L>) -> [f64; L] {
    match world.geometry {
        Geometry::Exact => geometry::exact(world.radius_um, profile, sight, world.steps),
        Geometry::Linear => geometry::linear(profile, sight),
    }
}

impl SampleStream for SimulatedStream<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        block.start = self.position;
        let left = self.capture.samples - self.position;
        if left == 0 {
            return Ok(false);
        }
        let samples = left.min(self.block_samples as u64) as usize;
        let channels = self.sensors.len();
        block.samples.resize(samples * channels, 0.0);
        let world = self.world;
        for (batch, rows) in block.samples.chunks_mut(LANES * channels).enumerate() {
            let start = self.position + (batch * LANES) as u64;
            let count = rows.len() / channels;
            let instants: Vec<Instants> = (0..self.late.len()).map(|late| self.instants(late, start, count)).collect();
            if self.capture.encoder {
                let turns = instants[0].turns[..count].iter();
                block.angle_rev.extend(turns.map(|(whole, rest)| whole + rest - self.marks.late_turns(whole + rest)));
            }
            for (index, sensor) in self.sensors.iter_mut().enumerate() {
                let seen = sensor.look(world, &instants[sensor.late], count);
                for (lane, (row, displacement_um)) in rows.chunks_mut(channels).zip(seen).enumerate() {
                    let turns = (start + lane as u64) as f64 / world.samples_per_rev as f64;
                    let sample = start + lane as u64;
                    let turned = instants[0].turns[lane];
                    row[index] = sensor.gain * sensor.channel.record(displacement_um, turns, sample, turned);
                }
            }
            for row in rows.chunks_mut(channels) {
                world.cross_talk.iter().for_each(|one| row[one.to] += one.relative * row[one.from]);
            }
        }
        self.position += samples as u64;
        Ok(true)
    }
}
