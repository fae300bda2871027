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
    let begin = usize::from(negative);
    let (value, place) = by_eights(bytes, begin, decimal).or_else(|| one_by_one(bytes, begin, decimal))?;
    // Signs come as they like: no branch foresees them.
    Some((f64::from_bits(value.to_bits() | (u64::from(negative) << 63)), place))
}

/// A number of up to seven digits, a decimal mark and up to seven digits, with eight bytes left to look at from each part's
/// beginning: as most are, and without a branch for each digit.
#[inline]
fn by_eights(bytes: &[u8], begin: usize, decimal: u8) -> Option<(f64, usize)> {
    let whole = Eight::of(bytes, begin)?;
    let mark = begin + whole.count;
    if whole.count == 8 || bytes.get(mark) != Some(&decimal) {
        return None;
    }
    let fraction = Eight::of(bytes, mark + 1)?;
    if fraction.count == 8 || whole.count + fraction.count == 0 {
        return None;
    }
    // 14 digits are below 2^53.
    let power = EXACT_POWERS[fraction.count];
    Some(((whole.value() * power + fraction.value()) / power, mark + 1 + fraction.count))
}

/// Eight characters, the first in the lowest byte, and how many of them are digits before the first that is none.
struct Eight {
    characters: u64,
    count: usize,
}

impl Eight {
    #[inline]
    fn of(bytes: &[u8], begin: usize) -> Option<Self> {
        let eight: &[u8; 8] = bytes.get(begin..begin + 8)?.try_into().ok()?;
        let characters = u64::from_le_bytes(*eight);
        // A digit's high half is 3, and adding 6 to its low half does not carry into it.
        let high = 0xF0F0_F0F0_F0F0_F0F0;
        let threes = 0x3030_3030_3030_3030;
        let sixes = 0x0606_0606_0606_0606;
        let others = ((characters & high) ^ threes) | ((characters.wrapping_add(sixes) & high) ^ threes);
        Some(Self { characters, count: others.trailing_zeros() as usize / 8 })
    }

    /// The number that its digits make: neighbours are joined to pairs, pairs to fours, fours to eight.
    #[inline]
    fn value(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        let low_halves = 0x0F0F_0F0F_0F0F_0F0F;
        // What is no digit goes out at the top; zeros that lead come in below.
        let digits = (self.characters << (64 - 8 * self.count)) & low_halves;
        let odd = 0x00FF_00FF_00FF_00FF;
        let pairs = (digits & odd) * 10 + ((digits >> 8) & odd);
        let odd = 0x0000_FFFF_0000_FFFF;
        let fours = (pairs & odd) * 100 + ((pairs >> 16) & odd);
        ((fours & 0xFFFF_FFFF) * 10_000 + (fours >> 32)) as f64
    }
}

/// A number of any length, digit by digit.
fn one_by_one(bytes: &[u8], begin: usize, decimal: u8) -> Option<(f64, usize)> {
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
