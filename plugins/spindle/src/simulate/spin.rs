//! The spindle's angle over time, and its inverse.
//!
//! Positions are counted in samples from the start of the capture. At first the *path* is what a spindle without ripple
//! would have turned by then, in samples at nominal speed; the angle is the path plus small periodic deviations. Both
//! steps rise strictly, so that the position of any angle can be found.

use std::f64::consts::TAU;

use runout_core::fault::Fault;

use super::{
    check,
    config::RecordingConfig,
    random::{Place, Purpose, phase, stream},
};

/// How a capture runs, before chance has its say.
#[derive(Debug, Clone)]
pub(super) struct SpinCourse {
    samples_per_rev: f64,
    margin: f64,
    /// Turns between the first mark and the last.
    turns: usize,
    start_up: f64,
    run_down: f64,
    wobble: f64,
    ripples: Vec<Ripple>,
    /// Those of single setups, by their index.
    in_setups: Vec<(usize, Ripple)>,
}

/// amplitude · (sin(2π·order·b + phase) − sin phase) turns at path b turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ripple {
    pub order: f64,
    pub amplitude_turns: f64,
    pub phase_rad: f64,
}

/// The angle over time in one capture.
#[derive(Debug, Clone)]
pub(super) struct Spin {
    course: SpinCourse,
}

/// Turns that a capture may have: positions stay far below 2^53 samples.
const MOST: usize = 1_000_000;
/// Far below any angle that matters, far above rounding, in samples.
const HAIR: f64 = 1e-9;
/// Terms of the wandering speed: 1 to this many periods in a capture.
const WOBBLES: usize = 6;

impl SpinCourse {
    pub(crate) fn new(config: &RecordingConfig) -> Result<Self, Fault> {
        let within = |key: &str, value: usize, first: usize| {
            if (first..=MOST).contains(&value) {
                Ok(value as f64)
            } else {
                Err(Fault::at(key, format!("expected {first} to {MOST}, found {value}")))
            }
        };
        let samples_per_rev = within("samples_per_rev", config.samples_per_rev, 8)?;
        within("revolutions", config.revolutions, 1)?;
        check::not_negative("speed_wobble_percent", config.speed_wobble_percent)?;
        let course = Self {
            samples_per_rev,
            margin: within("margin_samples", config.margin_samples, 0)?,
            turns: config.start_up_turns + config.revolutions + config.run_down_turns,
            start_up: within("start_up_turns", config.start_up_turns, 0)? * samples_per_rev,
            run_down: within("run_down_turns", config.run_down_turns, 0)? * samples_per_rev,
            wobble: config.speed_wobble_percent / 100.0,
            ripples: Vec::new(),
            in_setups: Vec::new(),
        };
        // Every term at its largest at once still leaves the spindle turning forwards.
        if course.wobble * (2.0 * WOBBLES as f64).sqrt() >= 0.9 {
            return Err(Fault::at("speed_wobble_percent", "the spindle would turn backwards"));
        }
        Ok(course)
    }

    /// In some setups, or in all.
    pub(crate) fn add_ripple(&mut self, ripple: Ripple, setups: Option<Vec<usize>>) -> Result<(), Fault> {
        match setups {
            None => self.ripples.push(ripple),
            Some(setups) => self.in_setups.extend(setups.into_iter().map(|setup| (setup, ripple))),
        }
        // All at once, whichever setups they are in.
        let all = self.ripples.iter().chain(self.in_setups.iter().map(|(_, ripple)| ripple));
        let steepest: f64 = all.map(|ripple| TAU * (ripple.order * ripple.amplitude_turns).abs()).sum();
        if steepest + self.wobble * (2.0 * WOBBLES as f64).sqrt() >= 0.95 {
            return Err(Fault::at("amplitude_deg", "with this ripple the spindle would turn backwards"));
        }
        Ok(())
    }

    /// The path at the end of the capture, in samples.
    fn length(&self) -> f64 {
        self.turns as f64 * self.samples_per_rev + 2.0 * self.margin
    }

    /// Samples in the capture: those of the ramps last twice as long, and one more closes the last turn.
    pub(crate) fn samples(&self) -> u64 {
        (self.length() + self.start_up + self.run_down).round() as u64 + 1
    }

    /// One capture's course: wandering of the speed as chance has it.
    pub(crate) fn spin(&self, seed: u64, setup: usize, station: usize) -> Spin {
        let mut course = self.clone();
        let in_setup = self.in_setups.iter().filter(|(place, _)| *place == setup);
        course.ripples.extend(in_setup.map(|(_, ripple)| *ripple));
        if self.wobble > 0.0 {
            let mut random = stream(seed, Purpose::Wobble, Place { setup, station, item: 0 });
            for periods in 1..=WOBBLES {
                // Whole periods between the first mark and the last: the marks at both ends stay where they are.
                let order = periods as f64 / self.turns as f64;
                let speed = self.wobble * (2.0 / WOBBLES as f64).sqrt();
                let phase_rad = phase(&mut random).arg();
                course.ripples.push(Ripple { order, amplitude_turns: speed / (TAU * order), phase_rad });
            }
        }
        Spin { course }
    }
}

impl Spin {
    /// Path in samples at nominal speed, at a position in samples.
    fn path(&self, position: f64) -> f64 {
        let SpinCourse { start_up, run_down, .. } = self.course;
        let end = self.course.length() + start_up + run_down;
        if start_up > 0.0 && position < 2.0 * start_up {
            position * position / (4.0 * start_up)
        } else if position > end - 2.0 * run_down {
            let left = (end - position).max(0.0);
            self.course.length() - left * left / (4.0 * run_down)
        } else {
            position - start_up
        }
    }

    fn position(&self, path: f64) -> f64 {
        let SpinCourse { start_up, run_down, .. } = self.course;
        if path < start_up {
            2.0 * (start_up * path).sqrt()
        } else if path > self.course.length() - run_down {
            let left = 2.0 * (run_down * (self.course.length() - path)).max(0.0).sqrt();
            self.course.length() + start_up + run_down - left
        } else {
            path + start_up
        }
    }

    /// Deviation of the angle in turns and its slope, at a path in turns from the first mark.
    fn deviation(&self, turns: f64) -> (f64, f64) {
        self.course.ripples.iter().fold((0.0, 0.0), |(value, slope), ripple| {
            let argument = TAU * (ripple.order * turns).fract() + ripple.phase_rad;
            (
                value + ripple.amplitude_turns * (argument.sin() - ripple.phase_rad.sin()),
                slope + ripple.amplitude_turns * TAU * ripple.order * argument.cos(),
            )
        })
    }

    /// The spindle's angle at a position in samples: whole turns since the first mark, and the rest in turns.
    ///
    /// Kept apart, so that the rest does not lose digits to the turns before it.
    pub(crate) fn turns(&self, position: f64) -> (f64, f64) {
        let SpinCourse { samples_per_rev, margin, .. } = self.course;
        let path = self.path(position) - margin;
        let whole = (path / samples_per_rev).floor();
        let rest = (path - whole * samples_per_rev) / samples_per_rev;
        (whole, rest + self.deviation(path / samples_per_rev).0)
    }

    /// Fractional sample positions of the marks, as many as lie within the capture.
    pub(crate) fn marks(&self, of: &Marks) -> Vec<f64> {
        let last = (self.course.samples() - 1) as f64;
        let marks = (0..=self.course.turns).map(|turn| self.mark(turn as f64 + of.late_turns(turn as f64)));
        // Rounding may put the closing mark a hair behind the last sample.
        marks.filter(|mark| (-HAIR..=last + HAIR).contains(mark)).map(|mark| mark.clamp(0.0, last)).collect()
    }

    /// Newton's steps on turns + deviation(turns) = angle; the slope lies between 0.05 and 2.
    fn mark(&self, angle: f64) -> f64 {
        let mut turns = angle;
        for _ in 0..50 {
            let (value, slope) = self.deviation(turns);
            let step = (turns + value - angle) / (1.0 + slope);
            turns -= step;
            if step.abs() <= f64::EPSILON * (1.0 + angle) {
                break;
            }
        }
        self.position(turns * self.course.samples_per_rev + self.course.margin)
    }
}

/// Where the marks of a setup come.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Marks {
    /// How far behind the spindle's whole turns the first comes, in turns.
    pub offset_turns: f64,
    /// By how much each is earlier than the one before it would have it, in turns.
    pub run_turns: f64,
}

impl Marks {
    /// How late a mark is after so many turns, in turns.
    pub(crate) fn late_turns(&self, turns: f64) -> f64 {
        self.offset_turns - self.run_turns * turns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(start_up_turns: usize, run_down_turns: usize, speed_wobble_percent: f64) -> SpinCourse {
        let config = RecordingConfig {
            revolutions: 20,
            samples_per_rev: 360,
            start_up_turns,
            run_down_turns,
            speed_wobble_percent,
            ..RecordingConfig::default()
        };
        SpinCourse::new(&config).unwrap()
    }

    #[test]
    fn steady_turns_have_marks_on_whole_samples() {
        let spin = course(0, 0, 0.0).spin(1, 0, 0);
        let expected: Vec<f64> = (0..=20).map(|turn| f64::from(16 + 360 * turn)).collect();
        assert_eq!(spin.marks(&Marks::default()), expected);
        assert_eq!(spin.turns(106.0), (0.0, 0.25));
        assert_eq!(spin.turns(7.0), (-1.0, 351.0 / 360.0));
    }

    /// The angle at a mark, interpolated by the cubic through four samples around it, is a whole turn.
    #[test]
    fn marks_are_whole_turns_at_any_speed() {
        let mut course = course(3, 2, 0.4);
        course.add_ripple(Ripple { order: 2.0, amplitude_turns: 0.002, phase_rad: 0.4 }, None).unwrap();
        course.add_ripple(Ripple { order: 0.37, amplitude_turns: 0.01, phase_rad: 2.0 }, None).unwrap();
        let spin = course.spin(5, 1, 3);
        let marks = spin.marks(&Marks::default());
        assert_eq!(marks.len(), 26);
        for (turn, mark) in marks.iter().enumerate() {
            let first = mark.floor() as u64 - 1;
            let at = |offset: u64| {
                let (whole, rest) = spin.turns((first + offset) as f64);
                whole - turn as f64 + rest
            };
            let x = mark - first as f64;
            let angle = (0..4u32).map(|i| {
                let weight = (0..4u32).filter(|j| *j != i).map(|j| (x - f64::from(j)) / (f64::from(i) - f64::from(j)));
                weight.product::<f64>() * at(u64::from(i))
            });
            let angle: f64 = angle.sum();
            // 1e-8 turns: the cubic's own error on ripple, (2π·2/360)⁴ · 0.002; the ramps are parabolas.
            assert!(angle.abs() < 1e-8, "turn {turn}: {angle:e}");
        }
    }

    #[test]
    fn ramps_take_twice_the_time_of_their_turns() {
        let spin = course(3, 2, 0.0).spin(0, 0, 0);
        let marks = spin.marks(&Marks::default());
        assert_eq!(spin.course.samples(), 360 * (20 + 2 * 3 + 2 * 2) + 2 * 16 + 1);
        let lengths: Vec<f64> = marks.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(lengths[..3].windows(2).all(|pair| pair[0] > pair[1]), "the start-up speeds up: {lengths:?}");
        assert!(lengths[3..23].iter().all(|length| (length - 360.0).abs() < 1e-9));
        assert!(lengths[23..].windows(2).all(|pair| pair[0] < pair[1]) && lengths[24] > 400.0, "{lengths:?}");
    }

    #[test]
    fn the_speed_wanders_as_far_as_asked() {
        let spin = course(0, 0, 0.5).spin(9, 0, 0);
        let (mut square, mut count) = (0.0, 0.0);
        let turn = |sample: u64| {
            let (whole, rest) = spin.turns(sample as f64);
            whole + rest
        };
        for sample in 16..16 + 20 * 360 {
            let speed = (turn(sample + 1) - turn(sample)) * 360.0 - 1.0;
            square += speed * speed;
            count += 1.0;
        }
        // Whole periods: the mean square is exact but for differences over a sample.
        assert!(((square / count).sqrt() - 0.005).abs() < 1e-6, "{}", (square / count).sqrt());
    }
}
