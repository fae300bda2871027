//! Numbers in cells.

/// Powers of ten that f64 holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Powers of ten that a fraction's digits ask for.
const WHOLE_POWERS: [u64; 8] = [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Whole numbers up to here are exact in f64.
const EXACT_WHOLE: u64 = 1 << 53;

/// Reads a plain number at the beginning of `bytes`: its value and its length, or `None` where only the slower way tells.
/// What follows is for the caller to look at: an exponent is none of it.
///
/// Where the digits make a whole number up to 2^53 and the power of ten is at most 22, both are exact and their quotient
/// or product is rounded once, as it should be (W. D. Clinger, How to read floating point numbers accurately, 1990).
#[inline(always)]
#[allow(clippy::inline_always, reason = "five calls a row cost a tenth of reading it")]
pub(crate) fn leading(bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    let negative = bytes.first() == Some(&b'-');
    let (value, length) = at_once(bytes, negative, decimal).or_else(|| one_by_one(bytes, negative, decimal))?;
    // Signs come as they like: no branch foresees them.
    Some((f64::from_bits(value.to_bits() | (u64::from(negative) << 63)), length))
}

/// Characters that a number looked at at once is to be in, with what is behind it: two times seven digits, sign and mark.
const WINDOW: usize = 16;

/// A number with at most seven characters on either side of the decimal mark, sign included: as most are, and without a branch
/// for each digit.
#[inline(always)]
#[allow(clippy::inline_always, reason = "as `leading`")]
fn at_once(bytes: &[u8], negative: bool, decimal: u8) -> Option<(f64, usize)> {
    let window: &[u8; WINDOW] = bytes.first_chunk()?;
    // A minus sign is taken for a zero in front.
    let front = eight(window, 0)? ^ (u64::from(negative) * u64::from(b'-' ^ b'0'));
    let whole = digits(front)?;
    let (back, fraction, length) = if window[whole] == decimal {
        let back = eight(window, whole + 1)?;
        let fraction = digits(back)?;
        (back, fraction, whole + 1 + fraction)
    } else {
        (0, 0, whole)
    };
    if whole + fraction == usize::from(negative) {
        return None;
    }
    // 14 digits are below 2^53.
    let number = joined(front, whole) * WHOLE_POWERS[fraction] + joined(back, fraction);
    // Signed numbers have an instruction for it.
    Some((number.cast_signed() as f64 / EXACT_POWERS[fraction], length))
}

/// Eight characters, the first in the lowest byte.
#[inline]
fn eight(window: &[u8; WINDOW], begin: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*window.get(begin..)?.first_chunk()?))
}

/// How many of eight characters are digits before the first that is none; `None` where all are.
#[inline]
fn digits(characters: u64) -> Option<usize> {
    const EACH: u64 = u64::MAX / 0xFF;
    let digits = characters ^ (EACH * 0x30);
    // A digit's low half is at most 9 and stays below 0x80 with 0x76 added; nothing is carried into the next byte.
    let others = (((digits & (EACH * 0x7F)) + EACH * 0x76) | digits) & (EACH * 0x80);
    (others != 0).then(|| others.trailing_zeros() as usize / 8)
}

/// The number that the first `count` of eight digits make, fewer than eight, the first in the lowest byte: neighbours are
/// joined to pairs, pairs to fours, fours to eight.
#[inline]
fn joined(characters: u64, count: usize) -> u64 {
    // What stands behind them goes out at the top; zeros come in before them.
    let digits = ((characters << 8) << (56 - 8 * count)) & 0x0F0F_0F0F_0F0F_0F0F;
    let odd = 0x00FF_00FF_00FF_00FF;
    let pairs = (digits & odd) * 10 + ((digits >> 8) & odd);
    let odd = 0x0000_FFFF_0000_FFFF;
    let fours = (pairs & odd) * 100 + ((pairs >> 16) & odd);
    (fours & 0xFFFF_FFFF) * 10_000 + (fours >> 32)
}

/// A number of any length, digit by digit.
#[inline(never)]
fn one_by_one(bytes: &[u8], negative: bool, decimal: u8) -> Option<(f64, usize)> {
    let begin = usize::from(negative);
    let mut place = begin;
    let mut digits: u64 = 0;
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
    Some((digits as f64 / EXACT_POWERS[fraction], place))
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
            "1234567.1234567",
            "-7654321.0000001",
            "12345678.5",
            "0.12345678",
        ];
        for text in spellings {
            let expected: f64 = text.parse().unwrap();
            let found = of_cell(text.as_bytes(), b'.').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text}: {found} {expected}");
            let found = of_cell(text.replace('.', ",").as_bytes(), b',').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text} with a comma");
            // With more of the line behind it, eight bytes at a time can be looked at.
            if let Some((found, length)) = leading(format!("{text};1.0000000").as_bytes(), b'.') {
                let plain = text.split(['e', 'E']).next().unwrap();
                assert_eq!((found, length), (plain.parse().unwrap(), plain.len()), "{text} in a line");
            }
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
            if let Some((found, length)) = leading(format!("{text},-12345678").as_bytes(), b'.') {
                assert_eq!((found.to_bits(), length), (expected.to_bits(), text.len()), "{text} in a line");
            }
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
