//! Readings where the part's surface is interrupted: bridged, so that what is around them keeps its harmonics.

use std::f64::consts::{PI, TAU};

use runout_core::{
    measurement::Capture,
    numerics::fourier::max_order,
    rig::{Gaps, Rig},
};

/// Orders of the smooth course that carries a bridge, at most.
const MOST_ORDERS: usize = 12;

/// What each channel's turns are bridged by.
pub(super) struct Bridges {
    length: usize,
    /// None of a channel whose surface is whole.
    channels: Vec<Option<Bridge>>,
}

impl Bridges {
    /// Without a rig, no surface is interrupted. `length` equal angles make a turn; interruptions are wider by so much at
    /// each end.
    pub(crate) fn new(rig: Option<&Rig>, capture: &Capture, length: usize, beyond_rad: f64) -> Self {
        let bridge = |sensor: &usize| Bridge::new(rig?.gaps_seen(capture.setup, *sensor).widened(beyond_rad), length);
        Self { length, channels: capture.sensors.iter().map(bridge).collect() }
    }

    /// Bridges one turn, `[channel][angle]`.
    pub(crate) fn cross(&self, grid: &mut [f64]) {
        for (bridge, values) in self.channels.iter().zip(grid.chunks_exact_mut(self.length)) {
            if let Some(bridge) = bridge {
                bridge.cross(values);
            }
        }
    }

    /// Whether anything is bridged.
    pub(crate) fn any(&self) -> bool {
        self.channels.iter().any(Option::is_some)
    }

    /// What bridging does not know, where anything is bridged.
    pub(crate) fn warning(&self) -> Option<String> {
        let bridges = || self.channels.iter().flatten();
        let longest_deg = bridges().map(|bridge| bridge.gaps.longest_rad().to_degrees()).fold(0.0, f64::max);
        let orders = bridges().map(|bridge| bridge.courses.len() / 2).min()?;
        Some(format!(
            "readings are bridged over up to {longest_deg:.1}° of each turn, where the part is interrupted: what the axis does there \
             above order {orders}, only other readings say where they are redundant, and no stated uncertainty holds it"
        ))
    }

    /// Whether a bridge of a channel spans everything between two parts of a turn.
    pub(crate) fn span(&self, channel: usize, from_turn: f64, to_turn: f64) -> bool {
        let bridge = self.channels.get(channel).and_then(Option::as_ref);
        bridge.is_some_and(|bridge| bridge.gaps.hold_all(TAU * from_turn, TAU * (to_turn - from_turn)))
    }
}

/// One channel's: the sum of harmonics that is nearest to the readings that are there (least squares), of orders whose
/// half wave is longer than the gap; and a straight line over what that leaves at the gap's two ends.
struct Bridge {
    gaps: Gaps,
    /// Whether each angle is bridged.
    missing: Vec<bool>,
    /// Runs of missing angles: the last one before, the number of them.
    runs: Vec<(usize, usize)>,
    /// Combinations of the harmonics, orthonormal over the angles that are there.
    courses: Vec<Vec<f64>>,
}

impl Bridge {
    fn new(gaps: Gaps, length: usize) -> Option<Self> {
        let missing: Vec<bool> = gaps.of_equal(length).collect();
        let starts = (0..length).filter(|angle| !missing[*angle] && missing[(angle + 1) % length]);
        let run = |before: usize| (before, (1..length).take_while(|step| missing[(before + step) % length]).count());
        let runs: Vec<_> = starts.map(run).collect();
        if runs.is_empty() {
            return None;
        }
        let orders = ((PI / gaps.longest_rad()) as usize).clamp(1, MOST_ORDERS).min(max_order(length));
        let wave = |order: usize, sine: bool| {
            let angle = move |index: usize| TAU * ((order * index) % length) as f64 / length as f64;
            (0..length).map(|index| if sine { angle(index).sin() } else { angle(index).cos() }).collect::<Vec<f64>>()
        };
        let waves = (1..=orders).flat_map(|order| [(order, false), (order, true)]);
        let waves = std::iter::once((0, false)).chain(waves).map(|(order, sine)| wave(order, sine));
        let mut courses: Vec<Vec<f64>> = Vec::new();
        for mut course in waves {
            // Twice: once leaves rounding errors of what is taken away.
            for _ in 0..2 {
                for other in &courses {
                    let share = over_those_there(&missing, other, &course);
                    course.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
                }
            }
            let norm = over_those_there(&missing, &course, &course).sqrt();
            for value in &mut course {
                *value /= norm;
            }
            courses.push(course);
        }
        Some(Self { gaps, missing, runs, courses })
    }

    fn cross(&self, values: &mut [f64]) {
        let length = values.len();
        let shares: Vec<f64> =
            self.courses.iter().map(|course| over_those_there(&self.missing, course, values)).collect();
        let course = |angle: usize| -> f64 {
            self.courses.iter().zip(&shares).map(|(course, share)| share * course[angle]).sum()
        };
        for (before, count) in &self.runs {
            let behind = (before + count + 1) % length;
            let [left, right] = [*before, behind].map(|angle| values[angle] - course(angle));
            for step in 1..=*count {
                let angle = (before + step) % length;
                let along = step as f64 / (count + 1) as f64;
                values[angle] = course(angle) + left + along * (right - left);
            }
        }
    }
}

/// Sum of products over the angles that are there.
fn over_those_there(missing: &[bool], a: &[f64], b: &[f64]) -> f64 {
    missing.iter().zip(a.iter().zip(b)).filter(|(missing, _)| !**missing).map(|(_, (a, b))| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: usize = 720;

    fn gaps() -> Gaps {
        let mut gaps = Gaps::default();
        gaps.add(350_f64.to_radians(), 15_f64.to_radians());
        gaps
    }

    #[test]
    fn a_smooth_course_is_found_again_and_what_is_around_stays() {
        let Some(bridge) = Bridge::new(gaps(), LENGTH) else { panic!("there is a gap") };
        let angle = |index: usize| TAU * index as f64 / LENGTH as f64;
        let smooth: Vec<f64> =
            (0..LENGTH).map(|i| 5.0 + 30.0 * (angle(i) - 1.0).cos() + 2.0 * (7.0 * angle(i)).sin()).collect();
        let mut values = smooth.clone();
        for (value, missing) in values.iter_mut().zip(&bridge.missing) {
            if *missing {
                *value = f64::NAN;
            }
        }
        bridge.cross(&mut values);
        for (found, smooth) in values.iter().zip(&smooth) {
            assert!((found - smooth).abs() < 1e-9, "{found}, not {smooth}");
        }
    }

    #[test]
    fn what_is_not_smooth_is_joined_without_a_step() {
        let Some(bridge) = Bridge::new(gaps(), LENGTH) else { panic!("there is a gap") };
        let mut values: Vec<f64> = (0..LENGTH).map(|index| if index < 300 { 1.0 } else { -1.0 }).collect();
        bridge.cross(&mut values);
        let largest = (0..60).chain(660..LENGTH).map(|i| (values[(i + 1) % LENGTH] - values[i]).abs());
        // 2 µm over 30 steps, and the courses' own slope.
        assert!(largest.fold(0.0, f64::max) < 0.3, "{values:?}");
    }

    #[test]
    fn a_whole_surface_needs_no_bridge() {
        assert!(Bridge::new(Gaps::default(), LENGTH).is_none());
    }
}
