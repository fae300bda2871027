//! Numbers without a pattern, and what they do to a text.

/// The generator SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number from 0, below another one.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.next() % end.max(1)
    }

    /// A word of a dictionary, some of them many times.
    pub(crate) fn text(&mut self, dictionary: &[&str], longest: u64) -> String {
        let word = dictionary[self.below(dictionary.len() as u64) as usize];
        let times = if self.below(8) == 0 { 1 + self.below(longest / word.len().max(1) as u64) } else { 1 };
        word.repeat(times as usize)
    }

    /// Bytes with one to four mistakes in them.
    pub(crate) fn mutated(&mut self, bytes: &[u8], dictionary: &[&str]) -> Vec<u8> {
        let mut mutated = bytes.to_vec();
        for _ in 0..=self.below(4) {
            let place = self.below(mutated.len() as u64) as usize;
            let end = (place + self.below(64) as usize).min(mutated.len());
            match self.below(6) {
                0 | 1 => {
                    let bit = self.below(8);
                    mutated.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << bit);
                }
                2 => drop(mutated.drain(place.min(end)..end)),
                3 => mutated.truncate(place),
                4 => {
                    let again = mutated[place.min(end)..end].to_vec();
                    mutated.splice(place..place, again);
                }
                _ => {
                    let text = self.text(dictionary, 20_000);
                    mutated.splice(place..place, text.into_bytes());
                }
            }
        }
        mutated
    }
}
