//! The simulator `touch-probe`: touches of a ring by a kinematic probe, computed from statics, point by point.
//!
//! The probe moves outward in small steps until its stylus meets the wall, and further until it triggers. The stylus bends as a
//! spring; its force tilts a plate that a preload presses on three seats. The seats' forces follow from the balance of forces and
//! moments, and the electrical resistance of each seat grows as its force falls (F^(−1/3), Hertz). The probe triggers where the sum
//! reaches a limit. All points are found by bisection. Nothing here is a harmonic of lobing, and nothing is shared with the solver.

mod scenario;

pub use scenario::{Drift, Machine, Placed, Probe, Ring, Strangers, TouchProbeScenario, Wave};

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{Column, Labels, Points},
    stage::{Simulation, Simulator},
    table::{ColumnSpec, TableSpec, counts, numbers, texts},
};

/// Steps of a bisection: 1 mm to below 1e-12 mm.
const BISECTIONS: usize = 42;
/// The wall is searched within this of the nominal radius, in mm.
const SEARCHED_MM: f64 = 2.0;
/// The stylus bends by less than this before the probe triggers, in mm.
const MOST_TRAVEL_MM: f64 = 0.3;
/// Step of the wall's slope, in mm.
const STEP_MM: f64 = 1e-3;

/// A simulated campaign.
#[derive(Debug, Clone, Default)]
pub struct Touched {
    /// Id of the setup of each touch.
    pub setup: Vec<String>,
    /// Number of the pass.
    pub repeat: Vec<usize>,
    /// Direction commanded, in degrees.
    pub direction_deg: Vec<f64>,
    /// Radius read, in mm.
    pub radius_mm: Vec<f64>,
    /// Place read, in mm.
    pub place_mm: Vec<[f64; 2]>,
    /// Time, in s.
    pub time_s: Vec<f64>,
}

impl Touched {
    /// As points with direction and radius.
    #[must_use]
    pub fn points(&self) -> Points {
        let numbers = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        Points {
            input: "simulated".into(),
            columns: vec![
                numbers("direction_deg", self.direction_deg.clone()),
                numbers("radius_mm", self.radius_mm.clone()),
                numbers("repeat", self.repeat.iter().map(|repeat| *repeat as f64).collect()),
                numbers("time_s", self.time_s.clone()),
            ],
            labels: vec![Labels { name: "setup".into(), values: self.setup.clone() }],
            ..Points::default()
        }
    }
}

impl TouchProbeScenario {
    /// Computes the touches.
    #[must_use]
    pub fn touched(&self) -> Touched {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let wall = Wall { ring: self.ring_waves(&mut random), scenario: self };
        let mut touched = Touched::default();
        let directions: Vec<f64> = (0..self.directions)
            .map(|index| 360.0 * index as f64 / self.directions as f64)
            .filter(|angle| self.gap_deg.is_none_or(|[from, to]| *angle < from || *angle > to))
            .collect();
        let count = (self.setups.len() * self.repeats * directions.len()).max(2);
        for setup in 0..self.setups.len() {
            for repeat in 0..self.repeats {
                for direction in &directions {
                    let number = touched.radius_mm.len();
                    let time = number as f64 / (count - 1) as f64;
                    let place = wall.touch(setup, repeat, time, direction.to_radians());
                    let noise: f64 = random.sample(StandardNormal);
                    let radius = place[0].hypot(place[1]) + 1e-3 * self.std_um * noise;
                    let angle = place[1].atan2(place[0]);
                    touched.setup.push(self.setups[setup].id.clone());
                    touched.repeat.push(repeat);
                    touched.direction_deg.push(*direction);
                    touched.radius_mm.push(radius);
                    touched.place_mm.push([radius * angle.cos(), radius * angle.sin()]);
                    touched.time_s.push(self.interval_s * number as f64);
                }
            }
        }
        touched
    }

    /// Pre-travel in a direction of the probe's frame (radians), on a flat wall, in µm.
    #[must_use]
    pub fn pretravel_um(&self, direction: f64) -> f64 {
        self.probe.travel_um(direction) + waves_um(&self.probe.extra_lobing, direction)
    }

    /// Form of the ring, in µm.
    #[must_use]
    pub fn form_um(&self, angle: f64) -> f64 {
        waves_um(&self.ring_waves(&mut ChaCha8Rng::seed_from_u64(self.seed)), angle)
    }

    fn ring_waves(&self, random: &mut ChaCha8Rng) -> Vec<Wave> {
        let mut waves = self.ring.waves.clone();
        let mut drawn: Vec<Wave> = (2..=12)
            .map(|order| {
                let [amplitude, phase]: [f64; 2] = [random.sample(StandardNormal), random.random_range(0.0..360.0)];
                Wave { order, amplitude_um: amplitude / f64::from(order), phase_deg: phase }
            })
            .collect();
        let rms = drawn.iter().map(|wave| 0.5 * wave.amplitude_um.powi(2)).sum::<f64>().sqrt();
        for wave in &mut drawn {
            wave.amplitude_um *= self.ring.random_rms_um / rms;
        }
        waves.extend(drawn);
        waves
    }
}

fn waves_um(waves: &[Wave], angle: f64) -> f64 {
    let one = |wave: &Wave| wave.amplitude_um * (f64::from(wave.order) * angle + wave.phase_deg.to_radians()).cos();
    waves.iter().map(one).sum()
}

/// The largest x up to `high` at which `inside` holds, from `low` where it does.
fn bisect(mut low: f64, mut high: f64, inside: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if inside(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

impl Probe {
    /// Resistance of the seats under a lateral force at the tip, over that without it; infinite where a seat lifts.
    fn resistance(&self, force_n: f64, direction: f64) -> f64 {
        let resistance = |force_n: f64| {
            let at = |angle: &f64| {
                let (sine, cosine) = angle.to_radians().sin_cos();
                Vector3::new(self.seat_radius_mm * cosine, self.seat_radius_mm * sine, 0.0)
            };
            let seats = self.seats_deg.each_ref().map(at);
            let preload = Vector3::new(0.0, 0.0, -self.preload_n);
            let preload_at = Vector3::new(self.preload_at_mm[0], self.preload_at_mm[1], 0.0);
            // The wall pushes the tip inward.
            let push = Vector3::new(-direction.cos(), -direction.sin(), 0.0) * force_n;
            let tip = Vector3::new(0.0, 0.0, -self.stylus_mm);
            let moment = preload_at.cross(&preload) + tip.cross(&push);
            let up = Vector3::new(0.0, 0.0, 1.0);
            let arms = seats.map(|seat| seat.cross(&up));
            let balance = Matrix3::new(
                1.0, 1.0, 1.0, //
                arms[0].x, arms[1].x, arms[2].x, //
                arms[0].y, arms[1].y, arms[2].y,
            );
            let right = Vector3::new(self.preload_n, -moment.x, -moment.y);
            let forces = balance.lu().solve(&right).unwrap_or(Vector3::new(0.0, 0.0, 0.0));
            forces.iter().map(|force| if *force > 0.0 { force.powf(-1.0 / 3.0) } else { f64::INFINITY }).sum::<f64>()
        };
        resistance(force_n) / resistance(0.0)
    }

    fn triggers(&self, travel_um: f64, direction: f64) -> bool {
        self.resistance(self.stiffness_n_per_um * travel_um, direction) >= self.trigger_ratio
    }

    fn travel_um(&self, direction: f64) -> f64 {
        bisect(0.0, 1e3 * MOST_TRAVEL_MM, |travel| !self.triggers(travel, direction))
    }
}

/// The ring before the machine.
struct Wall<'a> {
    scenario: &'a TouchProbeScenario,
    ring: Vec<Wave>,
}

impl Wall<'_> {
    /// How far a place is beyond the wall, in mm.
    fn beyond_mm(&self, setup: usize, repeat: usize, time: f64, place: [f64; 2]) -> f64 {
        let TouchProbeScenario { setups, drift, strangers, ring_radius_mm, .. } = self.scenario;
        let placed = &setups[setup];
        let course = if drift.time_constant > 0.0 {
            (1.0 - (-time / drift.time_constant).exp()) / (1.0 - (-1.0 / drift.time_constant).exp())
        } else {
            time
        };
        let [x, y] = [0, 1].map(|axis| place[axis] - 1e-3 * (placed.centre_um[axis] + course * drift.centre_um[axis]));
        let mut ring_deg = placed.ring_deg;
        if let Some((of, from, by_deg)) = strangers.slipped
            && of == setup
            && repeat >= from
        {
            ring_deg += by_deg;
        }
        let angle = y.atan2(x) - ring_deg.to_radians();
        let mut radius_um = waves_um(&self.ring, angle) + course * drift.radius_um;
        if let Some([at, width, height]) = strangers.chip
            && strangers.chip_in.is_none_or(|only| only == setup)
        {
            let off = (angle.to_degrees() - at).rem_euclid(360.0);
            let off = off.min(360.0 - off);
            if off < 0.5 * width {
                // A chip on the wall makes the ring smaller.
                radius_um -= height;
            }
        }
        if let Some((of, wave)) = strangers.bent
            && of == setup
        {
            radius_um += waves_um(&[wave], angle);
        }
        x.hypot(y) - ring_radius_mm - 1e-3 * radius_um
    }

    /// The place that the machine reads where the probe triggers, in mm.
    fn touch(&self, setup: usize, repeat: usize, time: f64, direction: f64) -> [f64; 2] {
        let TouchProbeScenario { setups, probe, machine, ring_radius_mm, .. } = self.scenario;
        let (sine, cosine) = direction.sin_cos();
        let at = |travel: f64| [travel * cosine, travel * sine];
        let beyond = |place: [f64; 2]| self.beyond_mm(setup, repeat, time, place);
        let [low, high] = [ring_radius_mm - SEARCHED_MM, ring_radius_mm + SEARCHED_MM];
        let contact = bisect(low, high, |travel| beyond(at(travel)) < 0.0);
        let touched = at(contact);
        let slope = |axis: usize| {
            let moved = |by: f64| {
                let mut place = touched;
                place[axis] += by;
                beyond(place)
            };
            (moved(STEP_MM) - moved(-STEP_MM)) / (2.0 * STEP_MM)
        };
        let normal = [slope(0), slope(1)];
        let steepness = normal[0].hypot(normal[1]);
        let seen = normal[1].atan2(normal[0]) - setups[setup].probe_deg.to_radians();
        let extra_mm = 1e-3 * waves_um(&probe.extra_lobing, seen);
        // Bending of the stylus: how far its unbent tip is beyond the wall, along the normal.
        let bent = |travel: f64| beyond(at(travel)) / steepness;
        let trigger = bisect(contact, contact + MOST_TRAVEL_MM, |travel| !probe.triggers(1e3 * bent(travel), seen));
        let [x, y] = at(trigger + extra_mm);
        let Machine { scale_x, scale_y, squareness_urad, reversal_um } = machine;
        [
            x * (1.0 + 1e-6 * scale_x) + 1e-6 * squareness_urad * y + 0.5e-3 * reversal_um[0] * sign(cosine),
            y * (1.0 + 1e-6 * scale_y) + 0.5e-3 * reversal_um[1] * sign(sine),
        ]
    }
}

/// The sense of a motion; an axis that does not move keeps its place.
fn sign(velocity: f64) -> f64 {
    if velocity.abs() < 1e-9 { 0.0 } else { velocity.signum() }
}

/// The simulator.
struct TouchProbeSimulator {
    scenario: TouchProbeScenario,
    text: String,
}

impl Simulator for TouchProbeSimulator {
    fn simulate(&self) -> Result<Simulation<'_>> {
        let touched = self.scenario.touched();
        let table = TableSpec::new(
            "touches",
            "touches of a ring",
            vec![
                ColumnSpec::name("setup", "id of the setup"),
                ColumnSpec::count("repeat", "", "number of the pass"),
                ColumnSpec::number("direction_deg", "deg", "direction of the touch in the machine"),
                ColumnSpec::number("radius_mm", "mm", "radius read, from the nominal centre"),
                ColumnSpec::number("time_s", "s", "time"),
            ],
        );
        // As a control gives them: 0.01 µm.
        let rounded = touched.radius_mm.iter().map(|radius| (radius * 1e5).round() / 1e5);
        let rows = table.rows(vec![
            texts(&touched.setup),
            counts(touched.repeat.iter().copied()),
            numbers(touched.direction_deg.iter().copied()),
            numbers(rounded),
            numbers(touched.time_s.iter().copied()),
        ])?;
        Ok(Simulation::Points { table, rows })
    }

    fn scenario(&self) -> &str {
        &self.text
    }
}

impl StageConfig for TouchProbeScenario {
    type Stage = Box<dyn Simulator>;

    const NAME: &'static str = "touch-probe";
    const ABOUT: &'static str = "touches of a ring by a kinematic probe on three seats";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let positive = [("ring_radius_mm", self.ring_radius_mm), ("interval_s", self.interval_s)];
        if let Some((key, value)) = positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Err(Fault::at(key, format!("expected a number above 0, found {value}")));
        }
        if !(self.std_um.is_finite() && self.std_um >= 0.0) {
            return Err(Fault::at("std_um", format!("expected 0 µm or above, found {}", self.std_um)));
        }
        if self.directions == 0 || self.repeats == 0 || self.setups.is_empty() {
            return Err(Fault::at("directions", "there is no touch: directions, repeats and setups are needed"));
        }
        if self.ring_radius_mm <= SEARCHED_MM {
            return Err(Fault::at("ring_radius_mm", format!("expected more than {SEARCHED_MM} mm")));
        }
        if self.probe.trigger_ratio <= 1.0 || self.probe.preload_n <= 0.0 || self.probe.stiffness_n_per_um <= 0.0 {
            let problem = "preload and stiffness must be above 0, and the trigger's ratio above 1";
            return Err(Fault::at("trigger_ratio", problem).under("probe"));
        }
        let text = toml::to_string(&self)
            .map_err(|error| Fault::here(format!("the scenario cannot be written as text: {error}")))?;
        let text = format!("plugin = \"{}\"\n{text}", Self::NAME);
        Ok(Box::new(TouchProbeSimulator { scenario: self, text }))
    }
}
