//! Unit strings as files have them.

use runout_core::rig::Unit;

/// What a unit measures, and how many of the base unit one is: µm, V, s, turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Known {
    LengthUm(f64),
    Volts(f64),
    Seconds(f64),
    Turns(f64),
    /// Pulses of an encoder.
    Counts,
}

/// A unit by its name; nothing where it is none that is known here.
pub(crate) fn known(text: &str) -> Option<Known> {
    use Known::{Counts, LengthUm, Seconds, Turns, Volts};
    let text = text.trim().trim_matches(['[', ']', '(', ')']).trim();
    Some(match text {
        "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometre" | "Micrometer" | "Micrometers"
        | "UM" => LengthUm(1.0),
        "mm" | "MM" | "millimeter" | "millimetre" | "Millimeter" | "Millimeters" => LengthUm(1e3),
        "nm" | "nanometer" | "nanometre" | "Nanometer" | "Nanometers" => LengthUm(1e-3),
        "pm" => LengthUm(1e-6),
        "cm" => LengthUm(1e4),
        "m" | "meter" | "metre" | "Meter" | "Meters" => LengthUm(1e6),
        // 1 in = 25.4 mm exactly.
        "in" | "inch" | "inches" | "Inch" | "Inches" | "\"" => LengthUm(25.4e3),
        "mil" | "mils" | "Mils" | "thou" => LengthUm(25.4),
        "uin" | "µin" | "μin" | "microinch" => LengthUm(0.0254),
        "V" | "v" | "Volt" | "Volts" | "volt" | "volts" => Volts(1.0),
        "mV" | "mv" | "millivolt" | "millivolts" => Volts(1e-3),
        "uV" | "µV" | "μV" => Volts(1e-6),
        "kV" => Volts(1e3),
        "s" | "sec" | "S" | "second" | "seconds" | "Second" | "Seconds" => Seconds(1.0),
        "ms" | "msec" => Seconds(1e-3),
        "us" | "µs" | "μs" => Seconds(1e-6),
        "ns" => Seconds(1e-9),
        "deg" | "°" | "degree" | "degrees" | "Degrees" | "Deg" => Turns(1.0 / 360.0),
        "rad" | "radian" | "radians" | "Radians" => Turns(1.0 / std::f64::consts::TAU),
        "rev" | "turn" | "turns" | "revolutions" => Turns(1.0),
        "counts" | "count" | "pulses" | "ticks" | "Ticks" => Counts,
        _ => return None,
    })
}

/// A name and the unit behind it: `Displ X1 [µm]`, `X1 (mm)`, `t / s`; the name as it is where there is none.
pub(crate) fn split(name: &str) -> (String, Option<String>) {
    let name = name.trim();
    let bracketed = [('[', ']'), ('(', ')')].into_iter().find_map(|(open, close)| {
        let (before, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
        Some((before, unit))
    });
    let slashed = || name.rsplit_once('/').filter(|(_, unit)| known(unit).is_some());
    match bracketed.filter(|(_, unit)| known(unit).is_some()).or_else(slashed) {
        Some((before, unit)) if !before.trim().is_empty() => (before.trim().to_owned(), Some(unit.trim().to_owned())),
        _ => (name.to_owned(), None),
    }
}

/// What the numbers of a unit are multiplied by for the unit of the rig's sensor.
///
/// # Errors
/// What was expected and found, where they measure different things or the unit is not known.
pub(crate) fn factor(text: &str, sensor: Unit) -> Result<f64, String> {
    let ours = match sensor {
        Unit::Millimetre => Known::LengthUm(1e3),
        Unit::Nanometre => Known::LengthUm(1e-3),
        Unit::Volt => Known::Volts(1.0),
        Unit::Millivolt => Known::Volts(1e-3),
        _ => Known::LengthUm(1.0),
    };
    match (known(text), ours) {
        (Some(Known::LengthUm(from)), Known::LengthUm(to)) | (Some(Known::Volts(from)), Known::Volts(to)) => {
            Ok(from / to)
        }
        (Some(Known::Volts(_)), _) => {
            Err(format!("the channel is in {text}, the sensor of the rig in a unit of length"))
        }
        (Some(Known::LengthUm(_)), _) => Err(format!("the channel is in {text}, the sensor of the rig in volts")),
        _ => Err(format!("expected a unit of length or voltage, found `{text}`")),
    }
}

/// What to do about a unit that does not fit.
pub(crate) const HELP: &str = "give the sensor `unit = \"V\"` and `um_per_volt` in [rig] where the channel is a voltage, or state the unit that \
    its numbers are in by `unit` in [load]: \"um\", \"mm\", \"nm\", \"mil\", \"in\", \"V\", \"mV\"";

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests of exact factors")]
    use super::*;

    #[test]
    fn units_become_those_of_the_sensor() {
        for (text, sensor, expected) in [
            ("µm", Unit::Micrometre, 1.0),
            ("mm", Unit::Micrometre, 1e3),
            ("mil", Unit::Micrometre, 25.4),
            ("in", Unit::Millimetre, 25.4),
            ("[mV]", Unit::Volt, 1e-3),
            ("V", Unit::Millivolt, 1e3),
        ] {
            assert_eq!(factor(text, sensor).unwrap(), expected, "{text}");
        }
        for (text, sensor, words) in [
            ("V", Unit::Micrometre, "unit of length"),
            ("mm", Unit::Volt, "in volts"),
            ("g", Unit::Micrometre, "found `g`"),
            ("deg", Unit::Micrometre, "found `deg`"),
        ] {
            assert!(factor(text, sensor).unwrap_err().contains(words), "{text}");
        }
    }
}
