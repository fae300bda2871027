//! Motion of the axis in single turns: how it follows from their readings, and how far turns lie apart.
//!
//! Form and clamping add the same to a reading at an angle in every turn. In whatever combination of one setup's readings
//! that gives motion, turns therefore differ by motion only, and by the sensors' noise and drift.

use crate::{
    azimuth::{Azimuth, FacePlace},
    separation::{Quantity, UM_PER_MM_URAD},
};

/// A sensitive direction (ISO 230-7): where motion of the axis counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Fixed, along x.
    X,
    /// Fixed, along y.
    Y,
    /// Turning with the spindle from x on: x·cos θ + y·sin θ.
    Rotating,
    /// Fixed: tilt about x.
    TiltX,
    /// Fixed: tilt about y.
    TiltY,
    /// Tilt towards the direction that turns with the spindle from x on: ε_y·cos θ − ε_x·sin θ.
    RotatingTilt,
    /// Fixed, along one line that is neither x nor y.
    Along(Azimuth),
    /// Fixed: tilt towards that line.
    TiltAlong(Azimuth),
    /// Along the axis.
    Axial,
    /// Along the axis, at a place of the face.
    Face(FacePlace),
}

impl Direction {
    /// All that x, y and the tilts about them give.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Rotating, Self::TiltX, Self::TiltY, Self::RotatingTilt];

    /// The motion that counts; with a second one and its factor, cos θ of the first and factor · sin θ of the second.
    #[must_use]
    pub fn parts(self) -> (Quantity, Option<(Quantity, f64)>) {
        match self {
            Self::X => (Quantity::X, None),
            Self::Y => (Quantity::Y, None),
            Self::Rotating => (Quantity::X, Some((Quantity::Y, 1.0))),
            Self::TiltX => (Quantity::TiltX, None),
            Self::TiltY => (Quantity::TiltY, None),
            Self::RotatingTilt => (Quantity::TiltY, Some((Quantity::TiltX, -1.0))),
            Self::Along(azimuth) => (Quantity::Along(azimuth), None),
            Self::TiltAlong(azimuth) => (Quantity::TiltAlong(azimuth), None),
            Self::Axial => (Quantity::Z, None),
            Self::Face(place) => (Quantity::FaceMotion(place), None),
        }
    }

    /// Whether it is along the axis: its fundamental is error motion, its level and slow drift are not.
    #[must_use]
    pub fn is_axial(self) -> bool {
        self.parts().0.is_axial()
    }

    /// Whether it is one of tilt, in µrad; the others are in µm.
    #[must_use]
    pub fn is_tilt(self) -> bool {
        self.parts().0.is_tilt()
    }

    /// Whether it turns with the spindle.
    #[must_use]
    pub fn rotates(self) -> bool {
        self.parts().1.is_some()
    }
}

/// How motion of the axis follows from the readings of one setup, but for what form and clamping add to every turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// Motions observable with these sensors, each with the rig's sensors and their weights, µm or µrad per µm.
    pub rows: Vec<(Quantity, Vec<(usize, f64)>)>,
    /// Where x and y are taken, in mm along the spindle, before the station's position is added.
    pub z_mm: f64,
    /// θ over the spindle's angle: +1 where the part turns counter-clockwise, −1 where it turns clockwise.
    pub rotation: f64,
}

impl Projection {
    /// Adds the motion along these lines (and the tilt towards them), where x and y are both there.
    #[must_use]
    pub fn with_lines(mut self, lines: &[Azimuth]) -> Self {
        for line in lines {
            for (wanted, parts) in [
                (Quantity::Along(*line), [Quantity::X, Quantity::Y]),
                (Quantity::TiltAlong(*line), [Quantity::TiltX, Quantity::TiltY]),
            ] {
                let row = |wanted: Quantity| self.rows.iter().find(|(quantity, _)| *quantity == wanted);
                let (None, [Some(first), Some(second)]) = (row(wanted), parts.map(row)) else { continue };
                let [x, y, tilt_x, tilt_y] = wanted.cartesian();
                let factors = if wanted.is_tilt() { [tilt_x, tilt_y] } else { [x, y] };
                let mut weights: Vec<(usize, f64)> = Vec::new();
                for ((_, weighted), factor) in [first, second].into_iter().zip(factors) {
                    for (sensor, weight) in weighted {
                        match weights.iter_mut().find(|(known, _)| known == sensor) {
                            Some((_, sum)) => *sum += factor * weight,
                            None => weights.push((*sensor, factor * weight)),
                        }
                    }
                }
                self.rows.push((wanted, weights));
            }
        }
        self
    }

    /// Adds the motion along the axis at these places of the face, where z and the tilts towards them are there.
    #[must_use]
    pub fn with_faces(mut self, places: &[FacePlace]) -> Self {
        let line = self.rows.iter().find_map(|(quantity, _)| quantity.azimuth());
        for place in places {
            let wanted = Quantity::FaceMotion(*place);
            let shares = std::iter::once((Quantity::Z, 1.0)).chain(face_shares(*place, line));
            let parts: Option<Vec<_>> = shares
                .map(|(quantity, share)| {
                    let (_, weights) = self.rows.iter().find(|(known, _)| *known == quantity)?;
                    Some((weights, share))
                })
                .collect();
            let Some(parts) = parts.filter(|_| self.rows.iter().all(|(known, _)| *known != wanted)) else { continue };
            let mut sum: Vec<(usize, f64)> = Vec::new();
            for (weights, share) in parts {
                for (sensor, weight) in weights {
                    match sum.iter_mut().find(|(known, _)| known == sensor) {
                        Some((_, total)) => *total += share * weight,
                        None => sum.push((*sensor, share * weight)),
                    }
                }
            }
            self.rows.push((wanted, sum));
        }
        self
    }

    /// The directions in which it gives motion.
    #[must_use]
    pub fn directions(&self) -> Vec<Direction> {
        let gives = |wanted: Quantity| self.rows.iter().any(|(quantity, _)| *quantity == wanted);
        let along = self.rows.iter().filter_map(|(quantity, _)| match quantity {
            Quantity::Along(azimuth) => Some(Direction::Along(*azimuth)),
            Quantity::TiltAlong(azimuth) => Some(Direction::TiltAlong(*azimuth)),
            Quantity::Z => Some(Direction::Axial),
            Quantity::FaceMotion(place) => Some(Direction::Face(*place)),
            _ => None,
        });
        let given = |direction: &Direction| {
            let (first, second) = direction.parts();
            gives(first) && second.is_none_or(|(second, _)| gives(second))
        };
        Direction::ALL.into_iter().chain(along).filter(given).collect()
    }
}

/// What a unit of each tilt adds to motion along the axis at a place of the face, µm/µrad: −ρ·(ε_y cos θ − ε_x sin θ). Where tilt
/// is known towards one line only, that of places on the line.
#[must_use]
pub fn face_shares(place: FacePlace, line: Option<Azimuth>) -> Vec<(Quantity, f64)> {
    let (sine, cosine) = place.radians().sin_cos();
    let lever = place.radius_mm() * UM_PER_MM_URAD;
    if let Some(line) = line.filter(|line| (place.radians() - line.radians()).sin().abs() < ALONG_AXIS) {
        return vec![(Quantity::TiltAlong(line), -lever * (place.radians() - line.radians()).cos())];
    }
    let shares = [(Quantity::TiltX, lever * sine), (Quantity::TiltY, -lever * cosine)];
    shares.into_iter().filter(|(_, share)| share.abs() > ALONG_AXIS * lever).collect()
}

/// Sines and cosines below this are those of a place on the other axis.
const ALONG_AXIS: f64 = 1e-9;

/// How far the turns of one capture lie apart, on equal angles of the spindle from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// What motion was computed with.
    pub projection: Projection,
    /// Directions in which it was computed.
    pub directions: Vec<Direction>,
    /// Equal angles a turn.
    pub angles: usize,
    /// Turns.
    pub turns: usize,
    /// Lowest turn at an angle, less the mean of all, µm or µrad, `[direction][angle]`.
    pub low: Vec<f64>,
    /// Highest turn less the mean, likewise.
    pub high: Vec<f64>,
    /// Variance of a turn about the mean of all, its mean over the angles, µm² or µrad², `[direction]`.
    pub variance: Vec<f64>,
}

impl Spread {
    /// Lowest and highest turn less the mean, in one direction, by angle.
    #[must_use]
    pub fn in_direction(&self, direction: Direction) -> Option<(&[f64], &[f64])> {
        let place = self.directions.iter().position(|known| *known == direction)?;
        let range = place * self.angles..(place + 1) * self.angles;
        Some((self.low.get(range.clone())?, self.high.get(range)?))
    }

    /// Root mean square of single turns about the mean of all, over all angles, in one direction.
    #[must_use]
    pub fn rms(&self, direction: Direction) -> Option<f64> {
        let place = self.directions.iter().position(|known| *known == direction)?;
        self.variance.get(place).map(|variance| variance.max(0.0).sqrt())
    }

    /// What 1 µm in every sensor makes in a direction at most, whatever the signs, in µm or µrad.
    #[must_use]
    pub fn reach(&self, direction: Direction) -> f64 {
        let sum = |wanted: Quantity| -> f64 {
            let row = self.projection.rows.iter().find(|(quantity, _)| *quantity == wanted);
            row.map_or(0.0, |(_, weights)| weights.iter().map(|(_, weight)| weight.abs()).sum())
        };
        let (first, second) = direction.parts();
        sum(first).hypot(second.map_or(0.0, |(second, _)| sum(second)))
    }

    /// What noise of 1 µm in every sensor makes in a direction, at the angle where it makes most, in µm or µrad.
    #[must_use]
    pub fn noise_gain(&self, direction: Direction) -> f64 {
        let weights = |wanted: Quantity| -> &[(usize, f64)] {
            let row = self.projection.rows.iter().find(|(quantity, _)| *quantity == wanted);
            row.map_or(&[], |(_, weights)| weights)
        };
        let dot = |one: Quantity, other: Quantity| -> f64 {
            let same = |sensor: usize| weights(other).iter().filter(move |(found, _)| *found == sensor);
            weights(one).iter().flat_map(|(sensor, a)| same(*sensor).map(move |(_, b)| a * b)).sum()
        };
        let (first, second) = direction.parts();
        let Some((second, _)) = second else { return dot(first, first).sqrt() };
        // Largest eigenvalue of the two rows' products.
        let (a, b, c) = (dot(first, first), dot(second, second), dot(first, second));
        (0.5 * (a + b) + (0.5 * (a - b)).hypot(c)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// cos φ·x + sin φ·y, and the tilt towards the same line.
    #[test]
    fn a_line_is_the_sum_of_x_and_y() {
        let rows = vec![
            (Quantity::X, vec![(0, 1.0), (2, 0.5)]),
            (Quantity::Y, vec![(1, 1.0), (2, -0.5)]),
            (Quantity::TiltX, vec![(1, -3.0)]),
            (Quantity::TiltY, vec![(0, 3.0)]),
        ];
        let line = Azimuth::of(30_f64.to_radians());
        let found = Projection { rows, z_mm: 0.0, rotation: 1.0 }.with_lines(&[line, line]);
        assert_eq!(found.rows.len(), 6);
        let (cosine, sine) = (0.75_f64.sqrt(), 0.5);
        let expected =
            [vec![(0, cosine), (2, 0.5 * cosine - 0.5 * sine), (1, sine)], vec![(1, 3.0 * sine), (0, 3.0 * cosine)]];
        for ((_, found), expected) in found.rows[4..].iter().zip(expected) {
            for (found, expected) in found.iter().zip(&expected) {
                assert!(found.0 == expected.0 && (found.1 - expected.1).abs() < 1e-12, "{found:?} {expected:?}");
            }
        }
        assert!(found.directions().contains(&Direction::TiltAlong(line)));
        // Without y there is only x.
        let x = Projection { rows: found.rows[..1].to_vec(), ..found };
        assert_eq!(x.clone().with_lines(&[line]), x);
    }

    #[test]
    fn noise_of_sensors_at_right_angles_and_of_three_at_equal_ones() {
        let spread = |rows| Spread {
            projection: Projection { rows, z_mm: 0.0, rotation: 1.0 },
            directions: Vec::new(),
            angles: 0,
            turns: 2,
            low: Vec::new(),
            high: Vec::new(),
            variance: Vec::new(),
        };
        let square = spread(vec![(Quantity::X, vec![(0, 1.0)]), (Quantity::Y, vec![(1, 1.0)])]);
        // 2/3 of each cosine: the least-squares inverse of three directions at 120°.
        let row = |angles: [f64; 3]| {
            let weight = |(sensor, degrees): (usize, f64)| (sensor, degrees.to_radians().cos() * 2.0 / 3.0);
            angles.into_iter().enumerate().map(weight).collect()
        };
        let three = spread(vec![(Quantity::X, row([0.0, 120.0, 240.0])), (Quantity::Y, row([90.0, 30.0, 150.0]))]);
        for direction in [Direction::X, Direction::Y, Direction::Rotating] {
            assert!((square.noise_gain(direction) - 1.0).abs() < 1e-15);
            assert!((three.noise_gain(direction) - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        }
        // Both sensors look along 45°: noise is largest there.
        let both = spread(vec![(Quantity::X, vec![(0, 1.0)]), (Quantity::Y, vec![(0, 1.0)])]);
        assert!((both.noise_gain(Direction::Rotating) - 2.0_f64.sqrt()).abs() < 1e-15);
    }
}
