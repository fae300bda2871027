//! Numbers in cells.

/// Powers of ten that f64 holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Whole numbers up to here are exact in f64.
const EXACT_WHOLE: u64 = 1 << 53;

/// Reads a plain number at the beginning of `bytes`: its value and its length, or `None` where only the slower way tells.
/// What follows is for the caller to look at: an exponent is none of it.
///
/// Where the digits make a whole number up to 2^53 and the power of ten is at most 22, both are exact and their quotient
/// or product is rounded once, as it should be (W. D. Clinger, How to read floating point numbers accurately, 1990).
#[inline]
pub(crate) fn leading(bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    let negative = bytes.first() == Some(&b'-');
    let mut place = usize::from(negative);
    let mut digits: u64 = 0;
    let begin = place;
    let mut separator = None;
    while let Some(&byte) = bytes.get(place) {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if byte == decimal && separator.is_none() {
            separator = Some(place);
        } else {
            break;
        }
        place += 1;
    }
    let count = place - begin - usize::from(separator.is_some());
    let fraction = separator.map_or(0, |separator| place - separator - 1);
    // 19 digits never overflow 64 bits.
    if count == 0 || count > 19 || digits > EXACT_WHOLE {
        return None;
    }
    let value = digits as f64 / EXACT_POWERS[fraction];
    Some((if negative { -value } else { value }, place))
}

/// The number of a whole cell; NaN where it is empty, `None` where it holds none.
pub(crate) fn of_cell(cell: &[u8], decimal: u8) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    if let Some((value, _)) = leading(cell, decimal).filter(|(_, length)| *length == cell.len()) {
        return Some(value);
    }
    let text = std::str::from_utf8(cell).ok()?;
    match decimal {
        b',' if text.contains('.') => None,
        b',' => text.replacen(',', ".", 1).parse().ok(),
        _ => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn every_spelling_gives_the_nearest_number() {
        // The standard library's parser is the reference.
        let spellings = [
            "0",
            "-0",
            "1",
            "-1.5",
            "12.",
            ".5",
            "-.25",
            "9007199254740992",
            "9007199254740993",
            "0.1",
            "123.456",
            "1e3",
            "-2.5E-7",
            "+4",
            "1e400",
            "0.30000000000000004",
            "3.141592653589793238",
            "1234567890123456789012",
            "0.0000000000000000000000001",
            "8.442911973260991817129021e-309",
            "inf",
            "-inf",
            "00012.50",
            "9007199254740991.5",
            "0.00000000000000000000009",
        ];
        for text in spellings {
            let expected: f64 = text.parse().unwrap();
            let found = of_cell(text.as_bytes(), b'.').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text}: {found} {expected}");
            let found = of_cell(text.replace('.', ",").as_bytes(), b',').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text} with a comma");
        }
        assert!(of_cell(b"", b'.').unwrap().is_nan() && of_cell(b"NaN", b'.').unwrap().is_nan());
    }

    #[test]
    fn random_numbers_of_any_length_are_exact() {
        let mut state = 1_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let places = (state >> 60) as usize;
            let value = (state >> 11) as f64 / 2f64.powi((state % 60) as i32);
            let text = format!("{value:.places$}");
            let expected: f64 = text.parse().unwrap();
            assert_eq!(of_cell(text.as_bytes(), b'.').unwrap().to_bits(), expected.to_bits(), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["abc", "1.2.3", "1,5", "--1", "-", ".", "1 2", "0x10", "1e", "µ", "12abc", "1_000"] {
            assert_eq!(of_cell(text.as_bytes(), b'.'), None, "{text}");
        }
        for text in ["1.5", "1.234,5", "1,2,3", ","] {
            assert_eq!(of_cell(text.as_bytes(), b','), None, "{text}");
        }
    }
}
