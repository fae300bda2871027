//! Symbols of error motion values, and what they are of in words.

use super::Centre;
use crate::{
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

/// Kind of the synchronous values of tilt.
pub(super) const RESIDUAL: &str = "residual-synchronous";
/// End of the symbols of total values with 1/rev. Their centre is that of the polar chart: any other moves with 1/rev.
pub const WITH_FUNDAMENTAL: &str = "-with-fundamental";

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

pub(super) fn unit(direction: Direction) -> String {
    if direction.is_tilt() { "urad".into() } else { "um".into() }
}

pub(super) fn described(direction: Direction, z_mm: f64) -> String {
    let z_mm = millimetres(z_mm);
    match direction {
        Direction::X => format!("radial, fixed sensitive direction x, at z = {z_mm} mm"),
        Direction::Y => format!("radial, fixed sensitive direction y, at z = {z_mm} mm"),
        Direction::Rotating => format!("radial, rotating sensitive direction, at z = {z_mm} mm"),
        Direction::TiltX => "tilt about x, fixed sensitive direction".into(),
        Direction::TiltY => "tilt about y, fixed sensitive direction".into(),
        Direction::RotatingTilt => "tilt, rotating sensitive direction".into(),
        Direction::Along(azimuth) => {
            format!("radial, fixed sensitive direction at {azimuth} from x towards y, at z = {z_mm} mm")
        }
        Direction::TiltAlong(azimuth) => {
            format!("tilt towards the fixed sensitive direction at {azimuth} from x towards y")
        }
        Direction::Axial => "axial, fixed sensitive direction".into(),
        Direction::Face(place) => format!(
            "face, fixed sensitive direction, {} mm from the axis at {}° from x towards y",
            place.radius_mm(),
            place.degrees()
        ),
    }
}

/// What axial values are referred to.
pub(super) fn centre_of_chart() -> &'static str {
    Centre::PolarChart.symbol()
}

/// To a micrometre, without trailing zeros.
pub(super) fn millimetres(z_mm: f64) -> f64 {
    (1e3 * z_mm).round() / 1e3
}
