//! Symbols of error motion values, and what they are of in words.

use super::Centre;
use crate::Value;
use runout_draws::Uncertainty;
use runout_turning::{
    azimuth::{Azimuth, FacePlace},
    spread::{Direction, Spread},
};

pub(super) const STANDARD: &str = "ISO 230-7:2015";

/// Directions as symbols name them, but for those that are chosen.
pub(super) const DIRECTIONS: [&str; 8] =
    ["radial-x", "radial-y", "radial-rotating", "radial-along", "tilt-x", "tilt-y", "tilt-rotating", "tilt-along"];

/// Symbol and unit of every value that there may be, with those in chosen directions.
#[must_use]
pub fn symbols(lines: &[Azimuth], faces: &[FacePlace]) -> Vec<(String, &'static str)> {
    let chosen = lines.iter().flat_map(|line| [Direction::Along(*line), Direction::TiltAlong(*line)]).map(chosen_id);
    let mut symbols = Vec::new();
    for id in DIRECTIONS.into_iter().map(str::to_owned).chain(chosen) {
        let tilt = id.starts_with("tilt");
        let unit = if tilt { "µrad" } else { "µm" };
        for kind in [if tilt { RESIDUAL } else { "synchronous" }, "total", "asynchronous"] {
            symbols.extend([format!("{kind}-{id}"), format!("{kind}-{id}-rms")].map(|symbol| (symbol, unit)));
        }
        symbols.push((format!("total-{id}{WITH_FUNDAMENTAL}"), unit));
    }
    let axial = std::iter::once(Direction::Axial).chain(faces.iter().copied().map(Direction::Face));
    for id in axial.map(chosen_id) {
        for kind in ["synchronous", RESIDUAL, "total", "asynchronous"] {
            symbols.extend([format!("{kind}-{id}"), format!("{kind}-{id}-rms")].map(|symbol| (symbol, "µm")));
        }
        symbols.push((format!("fundamental-{id}"), "µm"));
    }
    symbols.extend([("fundamental-radial".to_owned(), "µm"), ("fundamental-tilt".to_owned(), "µrad")]);
    symbols
}

/// The same of an axis at standing positions, which have no turns: no asynchronous and total values. The axis may lie along x or y, so that
/// z is across it.
#[must_use]
pub fn standing_symbols(lines: &[Azimuth], faces: &[FacePlace]) -> Vec<(String, &'static str)> {
    let fixed = XYZ.iter().flat_map(|letter| [format!("radial-{letter}"), format!("tilt-{letter}")]);
    let chosen = lines.iter().flat_map(|line| [Direction::Along(*line), Direction::TiltAlong(*line)]).map(chosen_id);
    let axial = std::iter::once(Direction::Axial).chain(faces.iter().copied().map(Direction::Face)).map(chosen_id);
    let mut symbols = Vec::new();
    let mut both = |kind: &str, id: &str, unit| {
        symbols.extend([format!("{kind}-{id}"), format!("{kind}-{id}-rms")].map(|symbol| (symbol, unit)));
    };
    for id in fixed.chain(chosen) {
        if id.starts_with("tilt") { both(RESIDUAL, &id, "µrad") } else { both("synchronous", &id, "µm") }
    }
    let axial: Vec<String> = axial.collect();
    for id in &axial {
        both("synchronous", id, "µm");
        both(RESIDUAL, id, "µm");
    }
    symbols.extend(axial.into_iter().map(|id| (format!("fundamental-{id}"), "µm")));
    symbols.extend([("fundamental-radial".to_owned(), "µm"), ("fundamental-tilt".to_owned(), "µrad")]);
    symbols
}

/// Letters of the machine's directions in the places of x, y and z of an axis along z.
pub(super) type Letters = [char; 3];
/// Of an axis along z.
pub(super) const XYZ: Letters = ['x', 'y', 'z'];

/// Kind of the synchronous values across the axis, and the kind in words.
pub(super) fn kind_of(direction: Direction) -> (&'static str, &'static str) {
    if direction.is_tilt() {
        (RESIDUAL, "residual synchronous error motion value")
    } else {
        ("synchronous", "synchronous error motion value")
    }
}

/// Kind of the synchronous values of tilt.
pub(super) const RESIDUAL: &str = "residual-synchronous";
/// End of the symbols of total values with 1/rev. Their centre is that of the polar chart: any other moves with 1/rev.
pub const WITH_FUNDAMENTAL: &str = "-with-fundamental";

/// Whether a symbol is of motion along the axis, axial or of a face: these values are about the centre of the polar chart. Asynchronous
/// ones have no centre.
#[must_use]
pub fn is_along_axis(symbol: &str) -> bool {
    !symbol.starts_with("asynchronous-") && (symbol.contains("-axial") || symbol.contains("-face-at-"))
}

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

/// The same with the machine's letters.
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
