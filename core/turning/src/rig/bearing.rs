//! Rolling bearings of the spindle: at which orders their rings, elements and cages move the axis.
//!
//! Orders are per revolution of the shaft, by the kinematics of rolling without slip (R. B. Randall, J. Antoni, *Rolling element bearing
//! diagnostics – a tutorial*, Mech. Syst. Signal Process. 25 (2011) 485-520, equations 1 to 4).

use std::fmt;

use runout_error::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Multiples of an order that have a name.
const MULTIPLES: std::ops::RangeInclusive<u32> = 1..=3;
/// Side bands that have a name, in turns of the shaft.
const SIDE_BANDS: [i32; 4] = [-1, 1, -2, 2];
/// Names of a line that are said, at most.
const MOST_NAMES: usize = 3;
/// More elements are no bearing.
const MOST_ELEMENTS: u32 = 1000;
/// Orders above are a mistake.
const HIGHEST: f64 = 1000.0;

/// The ring that turns with the shaft.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ring {
    /// The inner one.
    #[default]
    Inner,
    /// The outer one.
    Outer,
}

/// One bearing as written in a file: by its geometry, or by its maker's four factors.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct BearingConfig {
    /// Its name: "front".
    pub id: String,
    /// Number of rolling elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling_elements: Option<u32>,
    /// Diameter of a rolling element, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element_diameter_mm: Option<f64>,
    /// Diameter of the circle of the elements' centres, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch_diameter_mm: Option<f64>,
    /// Contact angle, in degrees; 0 without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_angle_deg: Option<f64>,
    /// The ring that turns with the shaft.
    #[serde(default)]
    pub rotating: Ring,
    /// Elements that pass a point of the outer ring, per revolution of the shaft; with the other three factors in place of geometry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bpfo: Option<f64>,
    /// The same of the inner ring.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bpfi: Option<f64>,
    /// Turns of an element about its own axis, per revolution of the shaft, seen from the cage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bsf: Option<f64>,
    /// Turns of the cage, per revolution of the shaft.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ftf: Option<f64>,
    /// How far slip and an unknown contact angle may move its orders, in percent; 0 without it.
    #[serde(default)]
    pub tolerance_percent: f64,
}

/// A checked bearing.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Bearing {
    /// Its name.
    pub id: String,
    /// Elements that pass a point of the outer ring, per revolution of the shaft.
    pub bpfo: f64,
    /// Elements that pass a point of the inner ring, per revolution of the shaft.
    pub bpfi: f64,
    /// Turns of an element about its own axis.
    pub bsf: f64,
    /// Turns of the cage.
    pub ftf: f64,
    /// Share by which its orders may be off.
    pub tolerance: f64,
}

/// An order at which a bearing may move the axis.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BearingLine {
    /// Id of the bearing.
    pub bearing: String,
    /// "BPFO", "2 FTF", "BPFI - 1".
    pub name: String,
    /// Its order, per revolution of the shaft.
    pub order: f64,
}

impl fmt::Display for BearingLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of bearing {} ({:.3}/rev)", self.name, self.bearing, self.order)
    }
}

impl BearingConfig {
    /// Checks it.
    ///
    /// # Errors
    /// The first value that cannot be, with its key.
    pub fn check(self) -> Result<Bearing, Fault> {
        if self.id.is_empty() {
            return Err(Fault::at("id", "a bearing's id must not be empty"));
        }
        if !(0.0..=10.0).contains(&self.tolerance_percent) {
            let message = format!("expected 0 to 10 percent, found {}", self.tolerance_percent);
            return Err(Fault::at("tolerance_percent", message));
        }
        let tolerance = 0.01 * self.tolerance_percent;
        let geometry = [self.element_diameter_mm, self.pitch_diameter_mm, self.contact_angle_deg];
        let by_geometry = self.rolling_elements.is_some() || geometry.iter().any(Option::is_some);
        let named = [("bpfo", self.bpfo), ("bpfi", self.bpfi), ("bsf", self.bsf), ("ftf", self.ftf)];
        let by_factors = named.iter().find(|(_, factor)| factor.is_some());
        match (by_geometry, by_factors) {
            (true, Some((key, _))) => Err(Fault::at(*key, "a bearing has geometry or factors, not both")),
            (true, None) => self.of_geometry(tolerance),
            (false, _) => {
                let mut factors = [0.0; 4];
                for (found, (key, factor)) in factors.iter_mut().zip(named) {
                    let factor = factor.ok_or_else(|| {
                        let help = "`bpfo`, `bpfi`, `bsf` and `ftf`, or `rolling_elements`, `element_diameter_mm` and `pitch_diameter_mm`";
                        Fault::here(format!("the bearing `{}` lacks `{key}`", self.id)).help(help)
                    })?;
                    if !(factor > 0.0 && factor <= HIGHEST) {
                        let message = format!("expected an order above 0 and up to {HIGHEST}, found {factor}");
                        return Err(Fault::at(key, message));
                    }
                    *found = factor;
                }
                let [bpfo, bpfi, bsf, ftf] = factors;
                Ok(Bearing { id: self.id, bpfo, bpfi, bsf, ftf, tolerance })
            }
        }
    }

    fn of_geometry(self, tolerance: f64) -> Result<Bearing, Fault> {
        let missing = |key: &str| Fault::here(format!("the bearing `{}` lacks `{key}`", self.id));
        let elements = self.rolling_elements.ok_or_else(|| missing("rolling_elements"))?;
        if !(2..=MOST_ELEMENTS).contains(&elements) {
            let message = format!("expected 2 to {MOST_ELEMENTS} rolling elements, found {elements}");
            return Err(Fault::at("rolling_elements", message));
        }
        let pitch_mm = self.pitch_diameter_mm.ok_or_else(|| missing("pitch_diameter_mm"))?;
        if !(pitch_mm.is_finite() && pitch_mm > 0.0) {
            return Err(Fault::at("pitch_diameter_mm", format!("expected a diameter above 0 mm, found {pitch_mm}")));
        }
        let element_mm = self.element_diameter_mm.ok_or_else(|| missing("element_diameter_mm"))?;
        if !(element_mm > 0.0 && element_mm < pitch_mm) {
            let message = format!("expected a diameter above 0 mm and below {pitch_mm} mm, found {element_mm}");
            return Err(Fault::at("element_diameter_mm", message));
        }
        let angle_deg = self.contact_angle_deg.unwrap_or(0.0);
        if !(0.0..90.0).contains(&angle_deg) {
            return Err(Fault::at("contact_angle_deg", format!("expected 0° to below 90°, found {angle_deg}")));
        }
        let ratio = element_mm / pitch_mm * angle_deg.to_radians().cos();
        let outer = 0.5 * (1.0 - ratio);
        let inner = 0.5 * (1.0 + ratio);
        Ok(Bearing {
            id: self.id,
            bpfo: f64::from(elements) * outer,
            bpfi: f64::from(elements) * inner,
            bsf: 0.5 * pitch_mm / element_mm * (1.0 - ratio * ratio),
            ftf: if self.rotating == Ring::Inner { outer } else { inner },
            tolerance,
        })
    }
}

impl Bearing {
    /// The orders at which it may move the axis: the four themselves, their multiples, then side bands of the turn's frequency.
    #[must_use]
    pub fn lines(&self) -> Vec<BearingLine> {
        let of = [("FTF", self.ftf), ("BSF", self.bsf), ("BPFO", self.bpfo), ("BPFI", self.bpfi)];
        let line = |name: String, order: f64| BearingLine { bearing: self.id.clone(), name, order };
        let multiples = MULTIPLES.flat_map(|multiple| {
            of.map(|(name, order)| {
                let name = if multiple == 1 { name.to_owned() } else { format!("{multiple} {name}") };
                line(name, f64::from(multiple) * order)
            })
        });
        // The cage's own side bands are its complement.
        let bands = SIDE_BANDS.into_iter().flat_map(|turns| {
            let sign = if turns < 0 { "-" } else { "+" };
            of[1..]
                .iter()
                .map(move |(name, order)| (format!("{name} {sign} {}", turns.abs()), order + f64::from(turns)))
        });
        multiples.chain(bands.map(|(name, order)| line(name, order))).filter(|line| line.order > 0.0).collect()
    }
}

impl Bearing {
    /// Those of its lines that a figure names: the four, and the first side bands of BPFO and BPFI.
    #[must_use]
    pub fn main_lines(&self) -> Vec<BearingLine> {
        let is_main = |line: &BearingLine| {
            !line.name.contains(' ')
                || ["BPFO", "BPFI"]
                    .iter()
                    .any(|ring| ["- 1", "+ 1"].iter().any(|band| line.name == format!("{ring} {band}")))
        };
        self.lines().into_iter().filter(is_main).collect()
    }
}

/// What lines of bearings an order may be, within a resolution and what each bearing allows: those with the simplest names first.
#[must_use]
pub fn bearing_lines_near(bearings: &[Bearing], order: f64, resolution: f64) -> Vec<BearingLine> {
    let mut near: Vec<(usize, BearingLine)> = Vec::new();
    for bearing in bearings {
        let lines = bearing.lines().into_iter().enumerate();
        near.extend(
            lines.filter(|(_, line)| (line.order - order).abs() <= resolution + bearing.tolerance * line.order),
        );
    }
    near.sort_by_key(|(place, _)| *place);
    near.truncate(MOST_NAMES);
    near.into_iter().map(|(_, line)| line).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn checked(text: &str) -> Result<Bearing, Fault> {
        toml::from_str::<BearingConfig>(&format!("id = 'front'\n{text}")).unwrap().check()
    }

    /// A ball that rolls between two cones, turned on by small steps: the surface speeds of the rings at the two contacts give the
    /// speed of its centre and its spin; passages of a mark are counted.
    fn counted(elements: u32, element_mm: f64, pitch_mm: f64, contact_deg: f64, [inner, outer]: [f64; 2]) -> [f64; 4] {
        const TURNS: usize = 400;
        const STEPS: usize = 4000;
        let contact = contact_deg.to_radians().cos();
        let radius = |side: f64| 0.5 * pitch_mm + side * 0.5 * element_mm * contact;
        let (mut cage, mut ring_inner, mut ring_outer, mut spin) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let mut passed = [0_u32; 2];
        let step = 1.0 / STEPS as f64;
        for _ in 0..TURNS * STEPS {
            let speeds = [inner * radius(-1.0), outer * radius(1.0)];
            let centre = 0.5 * (speeds[0] + speeds[1]) / (0.5 * pitch_mm);
            // Seen from the cage, the ball's surface has the ring's speed relative to the cage at the inner contact.
            let relative = (inner - centre) * radius(-1.0);
            spin += step * (relative / (0.5 * element_mm)).abs();
            let before = [cage - ring_outer, cage - ring_inner];
            cage += step * centre;
            ring_inner += step * inner;
            ring_outer += step * outer;
            let gap = 1.0 / f64::from(elements);
            for (count, (before, after)) in
                passed.iter_mut().zip(before.into_iter().zip([cage - ring_outer, cage - ring_inner]))
            {
                *count += u32::from((before / gap).floor() as i64 != (after / gap).floor() as i64);
            }
        }
        let turns = TURNS as f64;
        [f64::from(passed[0]) / turns, f64::from(passed[1]) / turns, spin / turns, cage / turns]
    }

    #[test]
    fn the_four_orders_are_those_of_rolling_balls() {
        for (elements, element_mm, pitch_mm, contact_deg) in
            [(9, 7.94, 39.04, 0.0), (16, 12.7, 82.5, 25.0), (2, 3.0, 10.0, 60.0)]
        {
            for (ring, rings) in [("inner", [1.0, 0.0]), ("outer", [0.0, 1.0])] {
                let bearing = checked(&format!(
                    "rolling_elements = {elements}\nelement_diameter_mm = {element_mm}\npitch_diameter_mm = {pitch_mm}\ncontact_angle_deg = {contact_deg}\nrotating = '{ring}'"
                ))
                .unwrap();
                let found = [bearing.bpfo, bearing.bpfi, bearing.bsf, bearing.ftf];
                let counted = counted(elements, element_mm, pitch_mm, contact_deg, rings);
                for (found, counted) in found.into_iter().zip(counted) {
                    // One passage more or less over 400 turns.
                    assert!((found - counted).abs() < 1.0 / 390.0, "{ring}: {found} and {counted}");
                }
            }
        }
    }

    /// The drive end bearing of the Case Western Reserve University test rig (6205-2RS JEM, SKF): 9 balls of 0.3126 in on 1.537 in. Published per
    /// revolution: inner ring 5.4152, outer ring 3.5848, cage 0.39828, element 4.7135, which is twice its turns.
    #[test]
    fn published_factors_of_a_bearing_come_out() {
        let text = "rolling_elements = 9\nelement_diameter_mm = 7.94004\npitch_diameter_mm = 39.0398";
        let bearing = checked(text).unwrap();
        for (found, published) in
            [(bearing.bpfi, 5.4152), (bearing.bpfo, 3.5848), (bearing.ftf, 0.39828), (2.0 * bearing.bsf, 4.7135)]
        {
            assert!((found - published).abs() < 6e-5, "{found} for {published}");
        }
    }

    #[test]
    fn an_order_has_the_names_that_fit_it() {
        let bearing = checked("bpfo = 3.585\nbpfi = 5.415\nbsf = 2.357\nftf = 0.398").unwrap();
        let near = |order: f64| {
            let lines = bearing_lines_near(std::slice::from_ref(&bearing), order, 0.004);
            lines.into_iter().map(|line| line.name).collect::<Vec<_>>()
        };
        assert_eq!(near(3.586), ["BPFO"]);
        assert_eq!(near(0.796), ["2 FTF"]);
        assert_eq!(near(4.413), ["BPFI - 1"]);
        assert!(near(3.5).is_empty());
        let slipping = Bearing { tolerance: 0.01, ..bearing.clone() };
        let lines = bearing_lines_near(&[slipping], 3.56, 0.004);
        assert_eq!(lines[0].to_string(), "BPFO of bearing front (3.585/rev)");
    }

    #[test]
    fn what_is_no_bearing_has_a_reason() {
        for (text, said) in [
            ("", "lacks `bpfo`"),
            ("bpfo = 3.5\nbpfi = 5.4\nbsf = 2.3", "lacks `ftf`"),
            ("bpfo = 3.5\nrolling_elements = 9", "not both"),
            ("rolling_elements = 9", "lacks `pitch_diameter_mm`"),
            ("rolling_elements = 9\npitch_diameter_mm = 40\nelement_diameter_mm = 40", "below 40 mm"),
            ("rolling_elements = 1\npitch_diameter_mm = 40\nelement_diameter_mm = 4", "found 1"),
            ("bpfo = 3.5\nbpfi = 5.4\nbsf = 2.3\nftf = -1", "above 0"),
            ("bpfo = 3.5\nbpfi = 5.4\nbsf = 2.3\nftf = 0.4\ntolerance_percent = 50", "0 to 10"),
        ] {
            let refused = checked(text).unwrap_err().to_string();
            assert!(refused.contains(said), "{text}: {refused}");
        }
    }
}
