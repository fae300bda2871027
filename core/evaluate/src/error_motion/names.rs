//! Symbols of error motion values, and what they are of in words.

use super::{Centre, MotionKind};
use crate::{
    Value,
    known::{KnownValue, Referred},
};
use runout_draws::Uncertainty;
use runout_turning::{
    azimuth::{Azimuth, FacePlace},
    spread::{Direction, Spread},
};

pub(super) const STANDARD: &str = "ISO 230-7:2015";

/// Directions as symbols name them, but for those that are chosen: radial, and of tilt.
const RADIAL: [&str; 4] = ["radial-x", "radial-y", "radial-rotating", "radial-along"];
const TILT: [&str; 4] = ["tilt-x", "tilt-y", "tilt-rotating", "tilt-along"];

/// Every value that there may be, with those in chosen directions.
#[must_use]
pub fn symbols(lines: &[Azimuth], faces: &[FacePlace]) -> Vec<KnownValue> {
    let chosen = |of: fn(Azimuth) -> Direction| lines.iter().map(move |line| chosen_id(of(*line)));
    let named = |names: [&'static str; 4]| names.into_iter().map(str::to_owned);
    let radial = named(RADIAL).chain(chosen(Direction::Along)).map(|id| (id, "µm", MotionKind::Synchronous));
    let tilt = named(TILT).chain(chosen(Direction::TiltAlong)).map(|id| (id, "µrad", MotionKind::ResidualSynchronous));
    let mut known = Known::default();
    for (id, unit, synchronous) in radial.chain(tilt) {
        known.both([synchronous, MotionKind::Total], &id, unit, Referred::Centres);
        known.both([MotionKind::Asynchronous], &id, unit, Referred::Other);
        known.one(format!("total-{id}{WITH_FUNDAMENTAL}"), unit, Referred::Chart);
    }
    for id in along_axis(faces) {
        known.both(
            [MotionKind::Synchronous, MotionKind::ResidualSynchronous, MotionKind::Total],
            &id,
            "µm",
            Referred::Chart,
        );
        known.both([MotionKind::Asynchronous], &id, "µm", Referred::Other);
        known.one(format!("fundamental-{id}"), "µm", Referred::Chart);
    }
    known.with_fundamentals()
}

/// Values of error motion that may come.
#[derive(Default)]
struct Known(Vec<KnownValue>);

impl Known {
    fn one(&mut self, symbol: String, unit: &'static str, referred: Referred) {
        self.0.push(KnownValue::new(symbol, unit, referred));
    }

    /// Peak to valley and root mean square of each kind.
    fn both<const N: usize>(&mut self, kinds: [MotionKind; N], id: &str, unit: &'static str, referred: Referred) {
        for kind in kinds {
            self.one(format!("{kind}-{id}"), unit, referred);
            self.one(format!("{kind}-{id}-rms"), unit, referred);
        }
    }

    /// Those of 1/rev across the axis.
    fn with_fundamentals(mut self) -> Vec<KnownValue> {
        self.one("fundamental-radial".to_owned(), "µm", Referred::Chart);
        self.one("fundamental-tilt".to_owned(), "µrad", Referred::Chart);
        self.0
    }
}

/// Axial and of faces.
fn along_axis(faces: &[FacePlace]) -> impl Iterator<Item = String> {
    std::iter::once(Direction::Axial).chain(faces.iter().copied().map(Direction::Face)).map(chosen_id)
}

/// Every value that there may be of an axis at standing positions, with those in chosen directions. Such an axis has no turns: no
/// asynchronous and total values. It may lie along x or y, so that z is across it.
#[must_use]
pub fn standing_symbols(lines: &[Azimuth], faces: &[FacePlace]) -> Vec<KnownValue> {
    let mut known = Known::default();
    let fixed = |kind: &str| XYZ.map(|letter| format!("{kind}-{letter}"));
    for id in fixed("radial").into_iter().chain(lines.iter().map(|line| chosen_id(Direction::Along(*line)))) {
        known.both([MotionKind::Synchronous], &id, "µm", Referred::Centres);
    }
    for id in fixed("tilt").into_iter().chain(lines.iter().map(|line| chosen_id(Direction::TiltAlong(*line)))) {
        known.both([MotionKind::ResidualSynchronous], &id, "µrad", Referred::Centres);
    }
    for id in along_axis(faces) {
        known.both([MotionKind::Synchronous, MotionKind::ResidualSynchronous], &id, "µm", Referred::Chart);
        known.one(format!("fundamental-{id}"), "µm", Referred::Chart);
    }
    known.with_fundamentals()
}

/// Letters of the machine's directions in the places of x, y and z of an axis along z.
pub(super) type Letters = [char; 3];
/// Of an axis along z.
pub(super) const XYZ: Letters = ['x', 'y', 'z'];

/// Kind of the synchronous values across the axis, and the kind in words.
pub(super) fn kind_of(direction: Direction) -> (MotionKind, &'static str) {
    if direction.is_tilt() {
        (MotionKind::ResidualSynchronous, "residual synchronous error motion value")
    } else {
        (MotionKind::Synchronous, "synchronous error motion value")
    }
}

/// End of the symbols of total values with 1/rev. Their centre is that of the polar chart: any other moves with 1/rev.
pub(super) const WITH_FUNDAMENTAL: &str = "-with-fundamental";

/// The turns behind a range.
pub(super) fn over(spreads: &[&Spread]) -> String {
    let turns = spreads.iter().map(|spread| spread.turns);
    let (fewest, most) = (turns.clone().min().unwrap_or(0), turns.max().unwrap_or(0));
    let turns = if fewest == most { most.to_string() } else { format!("{fewest} to {most}") };
    match spreads.len() {
        1 => format!("{turns} turns"),
        setups => format!("{turns} turns in each of {setups} setups"),
    }
}

/// "radial-at-45deg": a direction that was chosen.
pub(super) fn chosen_id(direction: Direction) -> String {
    match direction {
        Direction::Along(line) => format!("radial-at-{}deg", line.degrees()),
        Direction::TiltAlong(line) => format!("tilt-at-{}deg", line.degrees()),
        Direction::Face(place) => format!("face-at-{place}"),
        _ => id(direction).to_owned(),
    }
}

pub(super) fn id(direction: Direction) -> &'static str {
    match direction {
        Direction::X => "radial-x",
        Direction::Y => "radial-y",
        Direction::Rotating => "radial-rotating",
        Direction::TiltX => "tilt-x",
        Direction::TiltY => "tilt-y",
        Direction::RotatingTilt => "tilt-rotating",
        Direction::Along(_) => "radial-along",
        Direction::TiltAlong(_) => "tilt-along",
        Direction::Axial => "axial",
        Direction::Face(_) => "face",
    }
}

/// Id of a direction with the machine's letters; of a chosen one its own id.
pub(super) fn letter_id(direction: Direction, [x, y, _]: Letters) -> String {
    match direction {
        Direction::X => format!("radial-{x}"),
        Direction::Y => format!("radial-{y}"),
        Direction::TiltX => format!("tilt-{x}"),
        Direction::TiltY => format!("tilt-{y}"),
        _ => chosen_id(direction),
    }
}

pub(super) fn unit(direction: Direction) -> &'static str {
    if direction.is_tilt() { "urad" } else { "um" }
}

/// " at z = 60 mm".
pub(super) fn place(z_mm: f64, [.., z]: Letters) -> String {
    format!(" at {z} = {} mm", millimetres(z_mm))
}

pub(super) fn described(direction: Direction, z_mm: f64, letters: Letters) -> String {
    let (at, [x, y, _]) = (place(z_mm, letters), letters);
    match direction {
        Direction::X => format!("radial, fixed sensitive direction {x},{at}"),
        Direction::Y => format!("radial, fixed sensitive direction {y},{at}"),
        Direction::Rotating => format!("radial, rotating sensitive direction,{at}"),
        Direction::TiltX => format!("tilt about {x}, fixed sensitive direction"),
        Direction::TiltY => format!("tilt about {y}, fixed sensitive direction"),
        Direction::RotatingTilt => "tilt, rotating sensitive direction".into(),
        Direction::Along(azimuth) => {
            format!("radial, fixed sensitive direction at {azimuth} from {x} towards {y},{at}")
        }
        Direction::TiltAlong(azimuth) => {
            format!("tilt towards the fixed sensitive direction at {azimuth} from {x} towards {y}")
        }
        Direction::Axial => "axial, fixed sensitive direction".into(),
        Direction::Face(place) => format!(
            "face, fixed sensitive direction, {} mm from the axis at {}° from {x} towards {y}",
            place.radius_mm(),
            place.degrees()
        ),
    }
}

/// The value of the part of 1/rev across the axis that turns against the axis, radial or of tilt. Radial, it is ` at` a place.
pub(super) fn fundamental_across(tilt: bool, value: f64, known: Option<Uncertainty>, turns: &str, at: &str) -> Value {
    let (direction, id, at) = if tilt { (Direction::TiltY, "tilt", "") } else { (Direction::X, "radial", at) };
    let what = format!("value{at}: the part that turns against the {turns}, the rest of 1/rev is centring");
    fundamental(id, direction, &what, value, known)
}

/// The value of 1/rev along the axis.
pub(super) fn fundamental_along(id: &str, value: f64, known: Option<Uncertainty>, described: &str) -> Value {
    let what = format!("value, peak to valley of 1/rev, {described}");
    fundamental(id, Direction::Axial, &what, value, known)
}

fn fundamental(id: &str, direction: Direction, what: &str, value: f64, uncertainty: Option<Uncertainty>) -> Value {
    Value {
        band_upr: [1, 1],
        uncertainty,
        ..Value::referred(
            &format!("fundamental-{id}"),
            value,
            unit(direction),
            &format!("{STANDARD}, fundamental error motion {what}"),
            centre_of_chart().symbol(),
        )
    }
}

/// What axial values are referred to.
pub(super) fn centre_of_chart() -> Centre {
    Centre::PolarChart
}

/// To a micrometre, without trailing zeros.
fn millimetres(z_mm: f64) -> f64 {
    (1e3 * z_mm).round() / 1e3
}
