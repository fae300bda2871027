//! Units of length as files write them.

/// A unit as files write it: without blanks, and with one sign for micro.
fn plain(unit: &str) -> String {
    // U+00B5 and U+03BC are both micro; Latin-1 and MS-DOS files that were read as text leave U+FFFD and `æ` in its place.
    let letters = unit.trim().trim_matches(['[', ']', '(', ')', '"']).trim().chars();
    letters
        .map(|letter| if ['\u{b5}', '\u{3bc}', '\u{fffd}', '\u{e6}'].contains(&letter) { 'u' } else { letter })
        .collect()
}

/// µm in one of a unit of length: `m`, `cm`, `mm`, `um`, `µm`, `nm`, `pm`, `Å`, `in`, `mil`, `ft`, and their names in words. `None` for what is no length.
#[must_use]
pub fn micrometres(unit: &str) -> Option<f64> {
    Some(match plain(unit).as_str() {
        "m" | "metre" | "meter" | "metres" | "meters" => 1e6,
        "cm" => 1e4,
        "mm" | "millimetre" | "millimeter" | "millimetres" | "millimeters" => 1e3,
        "um" | "micron" | "microns" | "micrometre" | "micrometer" | "Micrometer" | "micrometres" | "micrometers" => 1.0,
        "nm" | "nanometre" | "nanometer" | "nanometres" | "nanometers" => 1e-3,
        "pm" => 1e-6,
        "\u{c5}" | "\u{212b}" | "A" | "Angstrom" | "angstrom" => 1e-4,
        "in" | "inch" | "inches" | "\u{2033}" => 25_400.0,
        "mil" | "mils" | "thou" => 25.4,
        "uin" | "microinch" => 0.0254,
        "ft" => 304_800.0,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_as_files_write_them() {
        for (written, um) in
            [("µm", 1.0), ("\u{3bc}m", 1.0), (" [um] ", 1.0), ("mil", 25.4), ("m", 1e6), ("(nm)", 1e-3)]
        {
            assert_eq!(micrometres(written), Some(um), "{written}");
        }
        assert_eq!(["a.u.", "", "V", "deg"].map(micrometres), [None; 4]);
    }
}
