//! Lines, their cells, and what is in a cell.

use runout_csv::parse_number;

/// How a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// What is between cells; a blank stands for any number of blanks.
    pub(super) delimiter: u8,
    /// The decimal mark.
    pub(super) decimal: u8,
}

/// Blank lines and comments between rows.
pub(super) fn is_passed_over(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.is_empty() || line.starts_with(b"#")
}

/// The cells of a line, without blanks and quotes around them, and without empty ones at the end where `trimmed`.
pub(super) fn cells(line: &[u8], delimiter: u8) -> Vec<&[u8]> {
    let line = line.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(line);
    if delimiter == b' ' {
        return line.split(u8::is_ascii_whitespace).filter(|cell| !cell.is_empty()).map(bare).collect();
    }
    let (mut cells, mut begin, mut is_quoted) = (Vec::new(), 0, false);
    for (at, byte) in line.iter().enumerate() {
        if *byte == b'"' {
            is_quoted = !is_quoted;
        } else if *byte == delimiter && !is_quoted {
            cells.push(bare(&line[begin..at]));
            begin = at + 1;
        }
    }
    cells.push(bare(&line[begin..]));
    cells
}

/// A cell without blanks and quotes.
fn bare(cell: &[u8]) -> &[u8] {
    let cell = cell.trim_ascii();
    match cell {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        _ => cell,
    }
}

/// Cells without the empty ones at the end.
pub(super) fn without_end<'a, 'b>(cells: &'b [&'a [u8]]) -> &'b [&'a [u8]] {
    let end = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    &cells[..end]
}

/// A number as programs write it; NaN where the cell is empty, nothing where it holds no number.
pub(super) fn number(cell: &[u8], decimal: u8) -> Option<f64> {
    if let Some(value) = parse_number(cell, decimal) {
        return Some(value);
    }
    let text = std::str::from_utf8(cell).ok()?;
    // A minus sign of typographers, blanks within, the exponent of Fortran's double precision.
    let text = text.replace('\u{2212}', "-").replace(['\u{a0}', '\u{202f}'], "");
    if let Some(sign) = match text.as_str() {
        "∞" | "+∞" | "Inf" | "+Inf" | "Infinity" | "1.#INF" | "Over" => Some(1.0),
        "-∞" | "-Inf" | "-Infinity" | "-1.#INF" | "Under" => Some(-1.0),
        _ => None,
    } {
        return Some(sign * f64::INFINITY);
    }
    if matches!(text.as_str(), "NaN" | "nan" | "NAN" | "-NaN" | "1.#QNAN" | "NaN (IND)" | "n/a" | "N/A" | "--" | "---")
    {
        return Some(f64::NAN);
    }
    if !text.starts_with(|first: char| first.is_ascii_digit() || matches!(first, '-' | '+' | '.' | ',')) {
        return None;
    }
    parse_number(text.replace(['D', 'd'], "E").as_bytes(), decimal)
}

/// Seconds of a point of time: `2026-10-15T02:26:06.8`, with a blank or a time of day alone; a zone shifts it.
pub(super) fn instant_s(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?;
    let (date, clock) = match text.split_once(['T', ' ']) {
        Some((date, clock)) => (Some(date), clock),
        None => (None, text),
    };
    let days = match date {
        None => 0.0,
        Some(date) => {
            let parts: Vec<&str> = date.split(['-', '/', '.']).collect();
            let [first, month, last] = parts[..] else { return None };
            let (year, day) = if first.len() == 4 { (first, last) } else { (last, first) };
            days(year.parse().ok()?, month.parse().ok()?, day.parse().ok()?)? as f64
        }
    };
    let (clock, shift_s) = zone(clock);
    let clock = clock.replace(',', ".");
    let parts: Vec<&str> = clock.split(':').collect();
    let [hours, minutes, seconds] = parts[..] else { return None };
    let is_whole = |text: &str| !text.is_empty() && text.len() <= 2 && text.bytes().all(|byte| byte.is_ascii_digit());
    if !is_whole(hours) || !is_whole(minutes) || !seconds.starts_with(|first: char| first.is_ascii_digit()) {
        return None;
    }
    let (hours, minutes, seconds): (f64, f64, f64) =
        (hours.parse().ok()?, minutes.parse().ok()?, seconds.parse().ok()?);
    Some(days * 86_400.0 + hours * 3600.0 + minutes * 60.0 + seconds - shift_s)
}

/// A time of day without its zone, and by how much that shifts it.
fn zone(clock: &str) -> (&str, f64) {
    let clock = clock.trim().trim_end_matches('Z');
    let Some(at) = clock.rfind(['+', '-']) else { return (clock, 0.0) };
    let sign = if clock.as_bytes()[at] == b'-' { -1.0 } else { 1.0 };
    let digits: Vec<f64> = clock[at + 1..].split(':').filter_map(|part| part.parse().ok()).collect();
    let shift_s = match digits[..] {
        [hours, minutes] => hours * 3600.0 + minutes * 60.0,
        [hours] if hours > 100.0 => (hours / 100.0).floor() * 3600.0 + hours % 100.0 * 60.0,
        [hours] => hours * 3600.0,
        _ => 0.0,
    };
    (&clock[..at], sign * shift_s)
}

/// Days since 1970-01-01 (H. Hinnant, chrono-Compatible Low-Level Date Algorithms).
fn days(year: i64, month: i64, day: i64) -> Option<i64> {
    if !((1..=12).contains(&month) && (1..=31).contains(&day) && (0..=9999).contains(&year)) {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn numbers_are_read_as_programs_write_them() {
        for (text, decimal, expected) in [
            ("1.5", b'.', 1.5),
            ("\u{2212}1,5", b',', -1.5),
            ("1.25D-03", b'.', 0.001_25),
            ("0,0000000000000000E+0", b',', 0.0),
            ("-∞", b'.', f64::NEG_INFINITY),
            ("+4", b'.', 4.0),
        ] {
            assert_eq!(number(text.as_bytes(), decimal), Some(expected), "{text}");
        }
        assert!(number(b"", b'.').unwrap().is_nan() && number(b"NaN", b'.').unwrap().is_nan());
        for text in ["abc", "Delta", "1.2.3", "D", "dE"] {
            assert_eq!(number(text.as_bytes(), b'.'), None, "{text}");
        }
    }

    #[test]
    fn instants_are_seconds() {
        let at = |text: &str| instant_s(text.as_bytes());
        assert_eq!(at("1970-01-02T00:00:01.5Z"), Some(86_401.5));
        assert_eq!(at("2000-03-01 00:00:00"), Some(951_868_800.0));
        assert_eq!(at("01.03.2000 01:00:00,25+01:00"), Some(951_868_800.25));
        assert_eq!(at("02:26:06,5"), Some(8766.5));
        for text in ["", "2026-13-01T00:00:00", "12:30", "a:b:c", "1.5", "2026-10-15"] {
            assert_eq!(at(text), None, "{text}");
        }
    }

    #[test]
    fn cells_may_be_quoted() {
        assert_eq!(cells(b"\xEF\xBB\xBF\"a;b\"; 2 ;;", b';'), [&b"a;b"[..], b"2", b"", b""]);
        assert_eq!(cells(b"  1.5   2 ", b' '), [&b"1.5"[..], b"2"]);
        assert_eq!(without_end(&cells(b"1,,2,,", b',')).len(), 3);
    }
}
