//! Where the tool is at a time.

use std::f64::consts::TAU;

use super::{
    config::{Direction, FlyCuttingScenario, SimulatedEffect},
    motion::{FoundLine, Synchronous},
};

/// The machine: everything that moves the tool.
#[derive(Debug, Clone)]
pub(super) struct Machine {
    pub nose_radius_mm: f64,
    pub cutter_radius_mm: f64,
    /// Angle of the map, in rad.
    pub rotation: f64,
    /// Speed of the feed, in mm/s.
    feed_mm_per_s: f64,
    /// Turns per second.
    turns_per_s: f64,
    waves: Vec<Wave>,
    /// Legendre polynomials of the table: order and size in nm.
    table: Vec<(usize, f64)>,
    /// Where the table is in the middle of the map, and half of the map's length, in mm.
    middle_mm: [f64; 2],
    synchronous: Option<Synchronous>,
}

#[derive(Debug, Clone)]
struct Wave {
    hertz: f64,
    phase: f64,
    direction: Direction,
    /// In nm or µrad.
    amplitude: f64,
}

/// Where the tip of the tool is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tip {
    pub x_mm: f64,
    pub height_nm: f64,
}

impl Machine {
    pub(crate) fn new(scenario: &FlyCuttingScenario, synchronous: Option<Synchronous>, found: &[FoundLine]) -> Self {
        let FlyCuttingScenario { cut, grid, .. } = scenario;
        let turns_per_s = cut.speed_rpm / 60.0;
        let length_mm = grid.step_x_mm * (grid.columns - 1) as f64;
        let mut machine = Self {
            nose_radius_mm: cut.nose_radius_mm,
            cutter_radius_mm: cut.cutter_radius_mm,
            rotation: 0.0,
            feed_mm_per_s: 1e-3 * cut.feed_um_per_rev * turns_per_s,
            turns_per_s,
            waves: Vec::new(),
            table: Vec::new(),
            middle_mm: [grid.origin_x_mm + 0.5 * length_mm, 0.5 * length_mm],
            synchronous,
        };
        let mut wave = |hertz: f64, phase_deg: f64, direction, nm: Option<f64>, urad: Option<f64>| {
            let amplitude = nm.or(urad).unwrap_or(0.0);
            machine.waves.push(Wave { hertz, phase: phase_deg.to_radians(), direction, amplitude });
        };
        for line in &scenario.line {
            wave(line.frequency_hz, line.phase_deg, line.direction, line.amplitude_nm, line.amplitude_urad);
        }
        for one in &scenario.harmonics {
            let hertz = f64::from(one.order) * turns_per_s;
            wave(hertz, one.phase_deg, one.direction, one.amplitude_nm, one.amplitude_urad);
        }
        let axial_nm_per_um = scenario.spindle.as_ref().map_or(0.0, |spindle| spindle.axial_nm_per_um);
        for line in found {
            wave(line.order * turns_per_s, 0.0, Direction::Axial, Some(axial_nm_per_um * line.amplitude_um), None);
        }
        for effect in &scenario.effect {
            match effect {
                SimulatedEffect::SpindleLine {
                    frequency_hz,
                    frequency_ratio,
                    direction,
                    amplitude_nm,
                    amplitude_urad,
                    phase_deg,
                    ..
                } => {
                    let hertz = frequency_hz.or(frequency_ratio.map(|ratio| ratio * turns_per_s)).unwrap_or(0.0);
                    wave(hertz, *phase_deg, *direction, *amplitude_nm, *amplitude_urad);
                }
                SimulatedEffect::TableStraightness { order, amplitude_nm, .. } => {
                    machine.table.push((*order, *amplitude_nm));
                }
                SimulatedEffect::FeedScale { scale_um_per_m, .. } => {
                    machine.feed_mm_per_s *= 1.0 + 1e-6 * scale_um_per_m;
                }
                SimulatedEffect::NoseRadius { change_mm, .. } => machine.nose_radius_mm += change_mm,
                SimulatedEffect::MapRotation { angle_urad, .. } => machine.rotation += 1e-6 * angle_urad,
                SimulatedEffect::CutterRadius { change_mm, .. } => machine.cutter_radius_mm += change_mm,
                SimulatedEffect::WorkpieceTilt { .. }
                | SimulatedEffect::Scratch { .. }
                | SimulatedEffect::Pit { .. } => {}
            }
        }
        machine
    }

    /// Feed of a turn, in mm.
    pub(crate) fn feed_mm(&self) -> f64 {
        self.feed_mm_per_s / self.turns_per_s
    }

    /// A bound of the height of the tool, in nm.
    pub(crate) fn highest_nm(&self) -> f64 {
        let waves = self.waves.iter().map(|wave| match wave.direction {
            Direction::Axial => wave.amplitude.abs(),
            Direction::TiltX | Direction::TiltY => wave.amplitude.abs() * self.cutter_radius_mm,
        });
        // A Legendre polynomial is at most 1 within the map, and passes that reach the map are near it.
        let table: f64 = self.table.iter().map(|(_, size)| 2.0 * size.abs()).sum();
        let synchronous = self.synchronous.as_ref().map_or(0.0, |motion| motion.highest_nm(self.cutter_radius_mm));
        waves.sum::<f64>() + table + synchronous
    }

    /// The angle within the turn at which the tool crosses a row.
    pub(crate) fn crossing(&self, y_mm: f64) -> f64 {
        let at = |displaced_mm: f64| ((y_mm - displaced_mm) / self.cutter_radius_mm).clamp(-1.0, 1.0).asin();
        let mut angle = at(0.0);
        if let Some(motion) = &self.synchronous {
            // The motion is micrometres on a radius of many millimetres: each round gains five digits.
            for _ in 0..3 {
                angle = at(1e-3 * motion.at(angle).y_um);
            }
        }
        angle
    }

    /// The tip at an angle of a turn, in radians.
    pub(crate) fn tip(&self, turn: f64, angle: f64) -> Tip {
        let seconds = (turn + angle / TAU) / self.turns_per_s;
        let (sine, cosine) = angle.sin_cos();
        let r = self.cutter_radius_mm;
        let along = |direction| match direction {
            Direction::Axial => 1.0,
            // µrad times mm is nm.
            Direction::TiltX => r * sine,
            Direction::TiltY => -r * cosine,
        };
        let fed_mm = self.feed_mm_per_s * seconds;
        let waves = self
            .waves
            .iter()
            .map(|wave| wave.amplitude * along(wave.direction) * (TAU * wave.hertz * seconds + wave.phase).cos());
        let [middle_mm, half_mm] = self.middle_mm;
        let place = (fed_mm - middle_mm) / half_mm;
        let table = self.table.iter().map(|(order, size)| size * legendre(*order, place));
        let mut tip = Tip { x_mm: fed_mm + r * (cosine - 1.0), height_nm: waves.sum::<f64>() + table.sum::<f64>() };
        if let Some(motion) = &self.synchronous {
            let there = motion.at(angle);
            tip.x_mm += 1e-3 * there.x_um;
            tip.height_nm += 1e3 * there.z_um
                + there.tilt_x_urad * along(Direction::TiltX)
                + there.tilt_y_urad * along(Direction::TiltY);
        }
        tip
    }
}

/// P_n(u) by Bonnet's recursion (DLMF 18.9.1).
fn legendre(order: usize, u: f64) -> f64 {
    let (mut before, mut last) = (1.0, u);
    for n in 1..order {
        let next = ((2 * n + 1) as f64 * u * last - n as f64 * before) / (n + 1) as f64;
        (before, last) = (last, next);
    }
    if order == 0 { before } else { last }
}
