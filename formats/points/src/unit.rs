//! Columns whose names give another unit than the separator's: `dx_um` for `dx_mm`, `dx [µm]`.

use runout_core::length_unit::micrometres;

/// What a name says: the quantity, and its unit.
fn parts(name: &str) -> Option<(&str, &str)> {
    let bracket = name.find(['[', '(']).map(|place| name.split_at(place));
    let (stem, unit) = bracket.or_else(|| name.rsplit_once('_'))?;
    Some((stem.trim().trim_end_matches('_'), unit.trim()))
}

/// The unit in that of its kind: µm, degrees, seconds; and which kind.
fn size(unit: &str) -> Option<(u8, f64)> {
    if let Some(um) = micrometres(unit) {
        return Some((0, um));
    }
    let plain = unit.trim_matches(['[', ']', '(', ')']).trim();
    Some(match plain {
        "deg" | "°" => (1, 1.0),
        "rad" => (1, 1_f64.to_degrees()),
        "mrad" => (1, 1e-3_f64.to_degrees()),
        "urad" | "µrad" | "μrad" => (1, 1e-6_f64.to_degrees()),
        "arcsec" => (1, 1.0 / 3600.0),
        "s" => (2, 1.0),
        "ms" => (2, 1e-3),
        "us" | "µs" | "μs" => (2, 1e-6),
        "min" => (2, 60.0),
        "h" => (2, 3600.0),
        _ => return None,
    })
}

/// The factor from numbers under one name to those under another, where both are of one quantity in units of one kind.
pub(crate) fn factor(from: &str, to: &str) -> Option<f64> {
    let [(stem, unit), (wanted, wanted_unit)] = [parts(from)?, parts(to)?];
    let [(kind, size), (wanted_kind, wanted_size)] = [size(unit)?, size(wanted_unit)?];
    (stem == wanted && kind == wanted_kind).then_some(size / wanted_size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_units() {
        assert_eq!(factor("dx_um", "dx_mm"), Some(1e-3));
        assert_eq!(factor("dx [µm]", "dx_mm"), Some(1e-3));
        assert_eq!(factor("height (mm)", "height_nm"), Some(1e6));
        assert_eq!(factor("time_ms", "time_s"), Some(1e-3));
        assert!(factor("c [rad]", "c_deg").is_some_and(|degrees| (degrees - 57.295_779_513).abs() < 1e-8));
        for (from, to) in [("dx_um", "dy_mm"), ("dx_deg", "dx_mm"), ("radius_counts", "radius_mm"), ("dx", "dx_mm")] {
            assert_eq!(factor(from, to), None, "{from}");
        }
    }
}
