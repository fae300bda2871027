//! Fixed directions across the spindle, for motion that is known along one line only, and places at a face.

use std::fmt;

/// Half a turn: a direction and its opposite are one line.
const HALF_TURN: u64 = 180_000_000_000;
const NANO: f64 = 1e9;

/// A line across the spindle, by its angle from x towards y: 0 to below 180°, to a billionth of a degree.
///
/// Two sensors on opposite sides look along the same line, so that rounding must not distinguish their directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Azimuth {
    nano_deg: u64,
}

impl Azimuth {
    /// The line along which a sensor at this angle looks.
    #[must_use]
    pub fn of(angle_rad: f64) -> Self {
        let nano_deg = (angle_rad.to_degrees().rem_euclid(180.0) * NANO).round() as u64;
        Self { nano_deg: nano_deg % HALF_TURN }
    }

    /// In degrees.
    #[must_use]
    pub fn degrees(self) -> f64 {
        self.nano_deg as f64 / NANO
    }

    /// In rad.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.degrees().to_radians()
    }
}

/// "30°".
impl fmt::Display for Azimuth {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}°", self.degrees())
    }
}

/// A place at a face: its distance from the axis, to a nanometre, and its angle from x towards y, 0 to below 360°, to a billionth
/// of a degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FacePlace {
    radius_nm: u64,
    nano_deg: u64,
}

impl FacePlace {
    /// At a radius in mm, 0 or more, and an angle in rad. On the axis there is one place only.
    #[must_use]
    pub fn of(radius_mm: f64, angle_rad: f64) -> Self {
        let radius_nm = (radius_mm.max(0.0) * 1e6).round() as u64;
        let nano_deg = (angle_rad.to_degrees().rem_euclid(360.0) * NANO).round() as u64;
        Self { radius_nm, nano_deg: if radius_nm == 0 { 0 } else { nano_deg % (2 * HALF_TURN) } }
    }

    /// Distance from the axis, in mm.
    #[must_use]
    pub fn radius_mm(self) -> f64 {
        self.radius_nm as f64 * 1e-6
    }

    /// In degrees.
    #[must_use]
    pub fn degrees(self) -> f64 {
        self.nano_deg as f64 / NANO
    }

    /// In rad.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.degrees().to_radians()
    }
}

/// "20mm-90deg".
impl fmt::Display for FacePlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}mm-{}deg", self.radius_mm(), self.degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_sides_are_one_line() {
        for (angle_deg, line) in
            [(30.0, "30°"), (210.0, "30°"), (-150.0, "30°"), (179.999_999_999_9, "0°"), (360.0, "0°")]
        {
            assert_eq!(Azimuth::of(f64::to_radians(angle_deg)).to_string(), line);
        }
        for (radius_mm, angle_deg, place) in
            [(20.0, -90.0, "20mm-270deg"), (12.5, 720.0, "12.5mm-0deg"), (0.0, 30.0, "0mm-0deg")]
        {
            assert_eq!(FacePlace::of(radius_mm, f64::to_radians(angle_deg)).to_string(), place);
        }
        assert!((Azimuth::of(-1.0).radians() - (std::f64::consts::PI - 1.0)).abs() < 1e-10);
    }
}
