//! Points of one trace.

use std::{
    f64::consts::{PI, TAU},
    ops::Range,
};

use runout_core::{
    Result,
    points::{Points, Trace},
};

/// Points of one trace, in the order measured.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scan {
    pub angle_rad: Vec<f64>,
    pub z_mm: Vec<f64>,
    pub deviation_um: Vec<f64>,
}

impl Scan {
    /// The points of a trace.
    ///
    /// # Errors
    /// When a column is missing or shorter than the trace.
    pub(crate) fn of(points: &Points, trace: &Trace) -> Result<Self> {
        let column = |name: &str| {
            points.column(name)?.get(trace.points.clone()).map(<[f64]>::to_vec).ok_or_else(|| {
                let object = format!("{}: trace {}", points.input.display(), trace.id);
                runout_core::Error::new("read", object, format!("the column {name} ends before it"))
            })
        };
        let angle_rad = column("angle_deg")?.iter().map(|angle| angle.to_radians()).collect();
        Ok(Self { angle_rad, z_mm: column("z_mm")?, deviation_um: column("deviation_um")? })
    }

    pub(crate) fn len(&self) -> usize {
        self.angle_rad.len()
    }

    /// (angle in rad, z in mm, deviation in µm) of each point.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (f64, f64, f64)> + Clone {
        self.angle_rad
            .iter()
            .zip(&self.z_mm)
            .zip(&self.deviation_um)
            .map(|((angle, z), deviation)| (*angle, *z, *deviation))
    }

    pub(crate) fn push(&mut self, angle_rad: f64, z_mm: f64, deviation_um: f64) {
        self.angle_rad.push(angle_rad);
        self.z_mm.push(z_mm);
        self.deviation_um.push(deviation_um);
    }

    /// The points that are kept.
    pub(crate) fn keep(&self, kept: &[bool]) -> Self {
        let mut some = Self::default();
        for ((angle, z, deviation), _) in self.iter().zip(kept).filter(|(_, kept)| **kept) {
            some.push(angle, z, deviation);
        }
        some
    }

    /// The points with their deviation counted from `from` (angle in rad, z in mm).
    pub(crate) fn less(&self, from: impl Fn(f64, f64) -> f64) -> Self {
        let deviation_um = self.iter().map(|(angle, z, deviation)| deviation - from(angle, z)).collect();
        Self { deviation_um, ..self.clone() }
    }

    /// Some consecutive points.
    pub(crate) fn range(&self, points: Range<usize>) -> Self {
        let cut = |values: &[f64]| values.get(points.clone()).map(<[f64]>::to_vec).unwrap_or_default();
        Self { angle_rad: cut(&self.angle_rad), z_mm: cut(&self.z_mm), deviation_um: cut(&self.deviation_um) }
    }

    /// Mean height of the points, in mm.
    pub(crate) fn mean_z_mm(&self) -> f64 {
        self.z_mm.iter().sum::<f64>() / self.len() as f64
    }

    /// Lowest and highest point, in mm.
    pub(crate) fn z_range_mm(&self) -> [f64; 2] {
        let heights = self.z_mm.iter();
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)])
    }
}

/// A trace along which angle and height advance together for more than one turn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Helix {
    /// Advance along z over one turn, in mm.
    pub pitch_mm: f64,
    /// Its whole turns.
    pub turns: Vec<Turn>,
    /// Points behind the last whole turn.
    pub behind: usize,
}

/// One turn of a helix.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Turn {
    /// Its points.
    pub points: Range<usize>,
    /// These and half a turn on either side: there every angle is seen at two heights, so that what changes along z is
    /// separated from what changes around.
    pub window: Range<usize>,
}

/// A trace shorter than this, in turns, sees too few angles at two heights.
const LEAST_TURNS: f64 = 1.5;
/// A pitch is one if it is so many times the scatter of the heights about a straight line over the angle.
const LEAST_PITCH: f64 = 3.0;

impl Helix {
    /// Recognises a helix by its points, whatever the trace is called.
    pub(crate) fn of(scan: &Scan) -> Option<Self> {
        let turned = unwrapped(&scan.angle_rad);
        let last = turned.last()?.abs();
        if last < LEAST_TURNS * TAU {
            return None;
        }
        let count = turned.len() as f64;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
        let (middle, height) = (mean(&turned), mean(&scan.z_mm));
        let pairs = || turned.iter().map(|angle| angle - middle).zip(scan.z_mm.iter().map(|z| z - height));
        let slope =
            pairs().map(|(angle, z)| angle * z).sum::<f64>() / pairs().map(|(angle, _)| angle * angle).sum::<f64>();
        let scatter = (pairs().map(|(angle, z)| (z - slope * angle).powi(2)).sum::<f64>() / count).sqrt();
        let pitch_mm = slope * TAU * turned.last()?.signum();
        if pitch_mm.abs() <= LEAST_PITCH * scatter {
            return None;
        }
        // A last turn that ends one step before its beginning is whole.
        let step = last / (count - 1.0);
        let whole = ((last + 1.5 * step) / TAU).floor();
        let place = |turns: f64| turned.partition_point(|angle| angle.abs() < turns * TAU - 0.5 * step);
        let turn = |index: usize| {
            let from = index as f64;
            let before = (from - 0.5).min(whole - 2.0).max(0.0);
            Turn { points: place(from)..place(from + 1.0), window: place(before)..place(before + 2.0) }
        };
        let turns: Vec<Turn> = (0..whole as usize).map(turn).collect();
        let behind = turned.len() - turns.last()?.points.end;
        Some(Self { pitch_mm, turns, behind })
    }
}

/// Angles from the first one on, without jumps of a turn.
pub(crate) fn unwrapped(angle_rad: &[f64]) -> Vec<f64> {
    let mut turned = 0.0;
    let steps = angle_rad.windows(2).map(|pair| (pair[1] - pair[0] + PI).rem_euclid(TAU) - PI);
    let steps = steps.map(|step| {
        turned += step;
        turned
    });
    angle_rad.first().map(|_| 0.0).into_iter().chain(steps).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(points: usize, turns: f64, z: impl Fn(f64) -> f64) -> Scan {
        let mut scan = Scan::default();
        for index in 0..points {
            let turned = turns * index as f64 / points as f64;
            scan.push((TAU * turned + 3.0).rem_euclid(TAU), z(turned), 0.0);
        }
        scan
    }

    #[test]
    fn a_helix_is_recognised_by_its_points() {
        let up = Helix::of(&scan(1000, 4.0, |turned| 2.0 + 0.5 * turned)).unwrap();
        assert!((up.pitch_mm - 0.5).abs() < 1e-12);
        let points: Vec<_> = up.turns.iter().map(|turn| (turn.points.clone(), turn.window.clone())).collect();
        assert_eq!(points, [(0..250, 0..500), (250..500, 125..625), (500..750, 375..875), (750..1000, 500..1000)]);
        assert_eq!(up.behind, 0);
        let down = Helix::of(&scan(900, 3.6, |turned| -0.5 * turned)).unwrap();
        assert_eq!((down.turns.len(), down.behind), (3, 150));
        // Clockwise, downwards: the pitch is per turn in the direction of the trace.
        let mut back = scan(800, 2.0, |turned| -0.7 * turned);
        back.angle_rad.iter_mut().for_each(|angle| *angle = -*angle);
        assert!((Helix::of(&back).unwrap().pitch_mm + 0.7).abs() < 1e-12);
        // A circle measured twice, one whose height wavers, a helix of one turn.
        assert_eq!(Helix::of(&scan(700, 2.0, |_| 5.0)), None);
        assert_eq!(Helix::of(&scan(700, 2.0, |turned| (9.7 * turned).sin() * 1e-3)), None);
        assert_eq!(Helix::of(&scan(700, 1.1, |turned| turned)), None);
        assert_eq!(Helix::of(&Scan::default()), None);
    }
}
