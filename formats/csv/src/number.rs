//! Numbers in cells.

#![allow(clippy::inline_always, reason = "calls would cost a tenth of reading a row, and leave wide registers")]

/// Powers of ten that f64 holds exactly; what a negative number's digits are divided by, for its sign also where it is 0.
const EXACT_POWERS: [[f64; 23]; 2] = {
    let mut powers = [[1e0; 23], [-1e0; 23]];
    let (mut power, mut whole) = (1, 1_u128);
    while power < 23 {
        whole *= 10;
        powers[0][power] = whole as f64;
        powers[1][power] = -(whole as f64);
        power += 1;
    }
    powers
};

/// Powers of ten that a fraction's digits ask for.
const WHOLE_POWERS: [u64; 8] = [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Whole numbers up to here are exact in f64.
const EXACT_WHOLE: u64 = 1 << 53;

/// Reads a plain number at the beginning of `bytes`: its value and its length, or `None` where only the slower way decides.
/// What follows is for the caller to examine: an exponent is none of it.
///
/// Where the digits make a whole number up to 2^53 and the power of ten is at most 22, both are exact and their quotient
/// or product is rounded once, as it should be (W. D. Clinger, How to read floating point numbers accurately, 1990).
#[inline(always)]
pub(crate) fn leading(reading: impl Reading, bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    let at_once = bytes.first_chunk().and_then(|window| reading.at_once(window, decimal));
    at_once.or_else(|| one_by_one(bytes, decimal))
}

/// How the characters of a number are examined together.
pub(crate) trait Reading: Copy {
    /// Value and length of the number at the beginning of a window; `None` where it is too long for this.
    fn at_once(self, window: &[u8; WINDOW], decimal: u8) -> Option<(f64, usize)>;
}

/// Characters that a number examined at once is to be in, with what is behind it: two times seven digits, sign and mark.
pub(crate) const WINDOW: usize = 16;

/// Eight characters at a time, in whole numbers: at most seven on either side of the decimal mark, sign included, as most
/// numbers have. There is no branch for each digit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eights;

impl Reading for Eights {
    #[inline(always)]
    fn at_once(self, window: &[u8; WINDOW], decimal: u8) -> Option<(f64, usize)> {
        let negative = window[0] == b'-';
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
        Some((number.cast_signed() as f64 / EXACT_POWERS[usize::from(negative)][fraction], length))
    }
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

/// Sixteen characters in one register: a number of up to 15 with its sign, and what is behind it.
///
/// Of the characters that are no digits, the first is the decimal mark or the end. One shuffle puts the digits on the right,
/// without the mark; then neighbours are joined as by [`joined`].
#[cfg(target_arch = "x86_64")]
impl Reading for pulp::x86::V3 {
    #[inline(always)]
    fn at_once(self, window: &[u8; WINDOW], decimal: u8) -> Option<(f64, usize)> {
        let (sse2, ssse3, sse4_1) = (self.sse2, self.ssse3, self.sse4_1);
        let negative = window[0] == b'-';
        let digits = sse2._mm_sub_epi8(pulp::cast(*window), sse2._mm_set1_epi8(b'0'.cast_signed()));
        let are_digits = sse2._mm_cmpeq_epi8(sse2._mm_min_epu8(digits, sse2._mm_set1_epi8(9)), digits);
        // A minus sign is taken for a zero in front. Where no character is, all are ones.
        let others = !sse2._mm_movemask_epi8(are_digits).cast_unsigned() & !u32::from(negative);
        let digits = sse2._mm_and_si128(digits, are_digits);
        let whole = others.trailing_zeros() as usize;
        let marked = *window.get(whole)? == decimal;
        let behind = (others & (others - 1)).trailing_zeros() as usize;
        let length = if marked { behind } else { whole };
        let count = length - usize::from(marked);
        if length == WINDOW || count == usize::from(negative) {
            return None;
        }
        let places = pulp::cast(SHUFFLES[count][whole]);
        let pairs = ssse3._mm_maddubs_epi16(ssse3._mm_shuffle_epi8(digits, places), sse2._mm_set1_epi16(0x010A));
        let fours = sse2._mm_madd_epi16(pairs, sse2._mm_set1_epi32(0x0001_0064));
        let packed = sse4_1._mm_packus_epi32(fours, fours);
        let [eights, _]: [i64; 2] = pulp::cast(sse2._mm_madd_epi16(packed, sse2._mm_set1_epi32(0x0001_2710)));
        // Both halves are below 10⁸, the number below 10¹⁵.
        let number = (eights & 0xFFFF_FFFF) * 100_000_000 + (eights >> 32);
        Some((number as f64 / EXACT_POWERS[usize::from(negative)][count - whole], length))
    }
}

/// Where each of sixteen characters comes from for a count of digits to be on the right, without the mark behind the first
/// `whole` of them, `[count][whole]`. From beyond come zeros.
#[cfg(target_arch = "x86_64")]
static SHUFFLES: [[[u8; WINDOW]; WINDOW]; WINDOW] = {
    let mut shuffles = [[[0x80; WINDOW]; WINDOW]; WINDOW];
    let (mut count, mut whole, mut digit) = (0, 0, 0);
    while count < WINDOW {
        let from = if digit < whole { digit } else { digit + 1 };
        if digit < count {
            shuffles[count][whole][WINDOW - count + digit] = from as u8;
            digit += 1;
        } else if whole + 1 < WINDOW {
            (whole, digit) = (whole + 1, 0);
        } else {
            (count, whole, digit) = (count + 1, 0, 0);
        }
    }
    shuffles
};

/// A number of any length, digit by digit.
#[inline(never)]
fn one_by_one(bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    let digits = Digits::leading(bytes, decimal)?;
    Some((digits.scaled(0)?, digits.length))
}

/// The digits of a number, read one by one.
struct Digits {
    is_negative: bool,
    /// All of them, as a whole number up to 2^53, and how many are behind the decimal mark.
    whole: u64,
    fraction: u8,
    /// Characters, sign and mark included.
    length: usize,
}

impl Digits {
    fn leading(bytes: &[u8], decimal: u8) -> Option<Self> {
        let is_negative = bytes.first() == Some(&b'-');
        let begin = usize::from(is_negative);
        let mut place = begin;
        let mut whole: u64 = 0;
        let mut separator = None;
        while let Some(&byte) = bytes.get(place) {
            let digit = byte.wrapping_sub(b'0');
            if digit < 10 {
                whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
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
        let is_exact = count > 0 && count <= 19 && whole <= EXACT_WHOLE;
        is_exact.then_some(Self { is_negative, whole, fraction: fraction as u8, length: place })
    }

    /// Their number times ten to this power; `None` where the power in all is not exact.
    fn scaled(&self, exponent: i32) -> Option<f64> {
        let power = exponent - i32::from(self.fraction);
        let factor = EXACT_POWERS[usize::from(self.is_negative)].get(power.unsigned_abs() as usize)?;
        let whole = self.whole as f64;
        Some(if power < 0 { whole / factor } else { whole * factor })
    }
}

/// The exponent of a number, `e-07`, or none; `None` of other characters.
fn exponent(rest: &[u8]) -> Option<i32> {
    let (sign, digits) = match rest {
        [] => return Some(0),
        [b'e' | b'E', b'-', digits @ ..] => (-1, digits),
        [b'e' | b'E', b'+', digits @ ..] | [b'e' | b'E', digits @ ..] => (1, digits),
        _ => return None,
    };
    let is_short = (1..=3).contains(&digits.len()) && digits.iter().all(u8::is_ascii_digit);
    is_short.then(|| sign * digits.iter().fold(0, |all, digit| 10 * all + i32::from(digit - b'0')))
}

/// The number of a whole cell with `.` or `,` as its decimal mark; NaN where it is empty, `None` where it holds none.
#[must_use]
pub fn parse_number(cell: &[u8], decimal: u8) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    let at_once = cell.first_chunk().and_then(|window| Eights.at_once(window, decimal));
    if let Some((value, _)) = at_once.filter(|(_, length)| *length == cell.len()) {
        return Some(value);
    }
    let digits = Digits::leading(cell, decimal);
    if let Some(value) = digits.and_then(|digits| digits.scaled(exponent(&cell[digits.length..])?)) {
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

    /// Each way of reading, where the processor has it, as a number in a line.
    fn every_way(bytes: &[u8], decimal: u8) -> Vec<Option<(f64, usize)>> {
        let mut found = vec![leading(Eights, bytes, decimal)];
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = pulp::x86::V3::try_new() {
            found.push(wide.vectorize(|| leading(wide, bytes, decimal)));
        }
        found
    }

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
            "-4.57865206332e-01",
            "1.5E+22",
            "1.5e+24",
            "-123.25e2",
            "9007199254740993e-30",
            "2.5e-0000007",
            "-0e5",
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
            let found = parse_number(text.as_bytes(), b'.').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text}: {found} {expected}");
            let found = parse_number(text.replace('.', ",").as_bytes(), b',').unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text} with a comma");
            // With more of the line behind it, eight bytes at a time can be examined.
            for (found, length) in every_way(format!("{text};1.0000000").as_bytes(), b'.').into_iter().flatten() {
                let plain = text.split(['e', 'E']).next().unwrap();
                assert_eq!((found, length), (plain.parse().unwrap(), plain.len()), "{text} in a line");
            }
        }
        assert!(parse_number(b"", b'.').unwrap().is_nan() && parse_number(b"NaN", b'.').unwrap().is_nan());
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
            assert_eq!(parse_number(text.as_bytes(), b'.').unwrap().to_bits(), expected.to_bits(), "{text}");
            let text_e = format!("{value:.places$e}");
            let expected_e: f64 = text_e.parse().unwrap();
            assert_eq!(parse_number(text_e.as_bytes(), b'.').unwrap().to_bits(), expected_e.to_bits(), "{text_e}");
            for (found, length) in every_way(format!("{text},-12345678").as_bytes(), b'.').into_iter().flatten() {
                assert_eq!((found.to_bits(), length), (expected.to_bits(), text.len()), "{text} in a line");
            }
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in [
            "abc", "1.2.3", "1,5", "--1", "-", ".", "1 2", "0x10", "1e", "1e+", "1e-2.5", "1e5x", "µ", "12abc", "1_000",
        ] {
            assert_eq!(parse_number(text.as_bytes(), b'.'), None, "{text}");
        }
        for text in ["1.5", "1.234,5", "1,2,3", ","] {
            assert_eq!(parse_number(text.as_bytes(), b','), None, "{text}");
        }
    }
}
