//! Where sensors can stand beside one another, in hundredths of a degree: what is reported is then what was checked.

use rand::RngExt;
use runout_core::rig::Rig;

/// Steps of the angles in a turn: 0.01°.
const TURN: i64 = 36_000;
/// Steps in a degree.
pub(super) const STEPS_PER_DEG: f64 = 100.0;

/// The clearance that sensors of one section keep; sensors of different sections do not meet.
///
/// The first sensor stays where the rig has it. The others stand on whole steps of 0.01°.
#[derive(Debug, Clone)]
pub struct Spacing {
    /// Smallest distance between two sensors of a section, in steps.
    clearance: i64,
    /// First and last step at which another sensor of the first one's section can stand.
    free: (i64, i64),
    /// Sensors of each section, the first sensor left out.
    movable: Vec<Vec<usize>>,
    /// The first sensor's section.
    held: usize,
}

/// A section has more sensors than fit.
#[derive(Debug, Clone, PartialEq)]
pub struct TooTight {
    /// The section's id.
    pub section: String,
    /// Its sensors.
    pub sensors: usize,
    /// The largest clearance that they can keep, in degrees.
    pub most_deg: f64,
}

impl Spacing {
    /// The places of a rig's sensors with a clearance.
    ///
    /// # Errors
    /// When a section has no room for its sensors.
    pub fn new(rig: &Rig, clearance_deg: f64) -> Result<Self, TooTight> {
        let exact = clearance_deg * STEPS_PER_DEG;
        // Rounding must not turn 1500.0000000002 into 1501.
        let up = |steps: f64| (steps - 1e-6).ceil() as i64;
        let clearance = up(exact);
        let first = rig.sensors.first();
        let held = first.map_or(0, |sensor| sensor.section);
        let at = first.map_or(0.0, |sensor| sensor.angle_rad.to_degrees() * STEPS_PER_DEG);
        let free = (up(at + exact), -up(exact - at - TURN as f64));
        let mut movable = vec![Vec::new(); rig.sections.len()];
        for (index, sensor) in rig.sensors.iter().enumerate().skip(1) {
            movable[sensor.section].push(index);
        }
        let spacing = Self { clearance, free, movable, held };
        for (section, id) in rig.sections.iter().enumerate() {
            let sensors = spacing.movable[section].len() + usize::from(section == held);
            if sensors > 1 && spacing.slack(section) < 0 {
                // With the first sensor between two steps, the last hundredth may be missing.
                let most_deg = ((TURN as usize / sensors).saturating_sub(1) / 10) as f64 / 10.0;
                return Err(TooTight { section: id.clone(), sensors, most_deg });
            }
        }
        Ok(spacing)
    }

    /// Steps that are left in a section when its sensors stand as near as they may.
    fn slack(&self, section: usize) -> i64 {
        // More than there are steps do not fit either.
        let sensors = i64::try_from(self.movable[section].len()).unwrap_or(TURN);
        if section == self.held {
            self.free.1 - self.free.0 - (sensors - 1) * self.clearance
        } else {
            TURN - sensors * self.clearance
        }
    }

    /// A random arrangement, every one as likely; the first sensor's entry stays as it is.
    pub(super) fn draw(&self, steps: &mut [i64], random: &mut impl RngExt) {
        for (section, sensors) in self.movable.iter().enumerate().filter(|(_, sensors)| !sensors.is_empty()) {
            let slack = self.slack(section).max(0);
            let mut cuts: Vec<i64> = sensors.iter().map(|_| random.random_range(0..=slack)).collect();
            cuts.sort_unstable();
            let begin = if section == self.held { self.free.0 } else { random.random_range(0..TURN) };
            for (place, (sensor, cut)) in (0..).zip(sensors.iter().zip(cuts)) {
                steps[*sensor] = (begin + cut + place * self.clearance).rem_euclid(TURN);
            }
        }
    }

    /// Whether all sensors keep the clearance.
    #[must_use]
    pub(super) fn allows(&self, steps: &[i64]) -> bool {
        let apart = |a: i64, b: i64| {
            let gap = (a - b).rem_euclid(TURN);
            gap.min(TURN - gap) >= self.clearance
        };
        self.movable.iter().enumerate().all(|(section, sensors)| {
            let from_first =
                |step: i64| section != self.held || (step - self.free.0).rem_euclid(TURN) <= self.free.1 - self.free.0;
            sensors.iter().enumerate().all(|(place, sensor)| {
                from_first(steps[*sensor]) && sensors[..place].iter().all(|other| apart(steps[*sensor], steps[*other]))
            })
        })
    }

    /// Gives the sensors of each section their places in ascending order, counted from the first sensor in its section.
    pub(super) fn sort(&self, steps: &mut [i64]) {
        for (section, sensors) in self.movable.iter().enumerate() {
            let begin = if section == self.held { self.free.0 } else { 0 };
            let mut places: Vec<i64> = sensors.iter().map(|sensor| steps[*sensor].rem_euclid(TURN)).collect();
            places.sort_unstable_by_key(|step| (step - begin).rem_euclid(TURN));
            sensors.iter().zip(places).for_each(|(sensor, place)| steps[*sensor] = place);
        }
    }
}

/// Smaller of the two ways round from one angle to another, in degrees.
#[must_use]
pub fn distance_deg(a_deg: f64, b_deg: f64) -> f64 {
    let gap = (a_deg - b_deg).rem_euclid(360.0);
    gap.min(360.0 - gap)
}
