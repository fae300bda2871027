//! A fixed direction across the spindle, for motion that is known along one line only.

use std::fmt;

/// Half a turn: a direction and its opposite are one line.
const HALF_TURN: u64 = 180_000_000_000;
const NANO: f64 = 1e9;

/// A line across the spindle, by its angle from x towards y: 0 to below 180°, to a billionth of a degree.
///
/// Two sensors on opposite sides look along the same line, so that rounding must not tell their directions apart.
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
        assert!((Azimuth::of(-1.0).radians() - (std::f64::consts::PI - 1.0)).abs() < 1e-10);
    }
}
