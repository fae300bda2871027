//! Colour by deviation: a diverging map, blue where material is missing, red where there is too much.

/// Colours in the [`palette`]; the middle one is deviation 0.
pub const STEPS: usize = 257;

/// Colour of what was drawn but not measured.
pub const UNMEASURED: [u8; 3] = [150, 150, 150];

/// sRGB anchors at equal distances, from the lowest to the highest deviation. Lightness falls evenly to both sides.
const ANCHORS: [[f64; 3]; 5] =
    [[28.0, 58.0, 148.0], [108.0, 156.0, 214.0], [236.0, 236.0, 236.0], [228.0, 136.0, 106.0], [158.0, 20.0, 42.0]];

/// From deviations to places in the [`palette`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    steps_per_um: f64,
}

impl ColourScale {
    /// The strongest colours stand for ±`range_um`; with 0 everything is neutral.
    #[must_use]
    pub fn new(range_um: f64) -> Self {
        let half = (STEPS / 2) as f64;
        Self { steps_per_um: if range_um > 0.0 { half / range_um } else { 0.0 } }
    }

    /// Place in the [`palette`], below [`STEPS`].
    #[must_use]
    #[inline]
    pub fn index(self, deviation_um: f64) -> usize {
        /// Beside it, numbers are whole ones: sums end up in their lowest bits. (A cast has to look after what does not fit.)
        const WHOLE: f64 = (1_u64 << 52) as f64;
        let half = (STEPS / 2) as f64;
        let place = (deviation_um * self.steps_per_um).clamp(-half, half) + half;
        // NaN gives 0.
        ((place + WHOLE).to_bits() & 0xFFFF) as usize
    }
}

/// The map's colours in sRGB, from the lowest to the highest deviation.
#[must_use]
pub fn palette() -> [[u8; 3]; STEPS] {
    std::array::from_fn(|step| {
        let place = (ANCHORS.len() - 1) as f64 * step as f64 / (STEPS - 1) as f64;
        let lower = (place as usize).min(ANCHORS.len() - 2);
        let fraction = place - lower as f64;
        std::array::from_fn(|channel| {
            let (from, to) = (ANCHORS[lower][channel], ANCHORS[lower + 1][channel]);
            (from + fraction * (to - from)).round() as u8
        })
    })
}

/// Linear light, 0 to 1, of an sRGB channel (IEC 61966-2-1:1999, 5.2).
#[must_use]
pub fn linear(channel: u8) -> f64 {
    let encoded = f64::from(channel) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_the_middle_and_what_lies_beyond() {
        let scale = ColourScale::new(5.0);
        assert_eq!(scale.index(0.0), STEPS / 2);
        assert_eq!((scale.index(-5.0), scale.index(5.0)), (0, STEPS - 1));
        assert_eq!((scale.index(-1e9), scale.index(1e9)), (0, STEPS - 1));
        assert_eq!(ColourScale::new(0.0).index(3.0), STEPS / 2);
        assert_eq!(scale.index(f64::NAN), 0);
        let colours = palette();
        assert_eq!(colours[0], [28, 58, 148]);
        assert_eq!(colours[STEPS / 2], [236, 236, 236]);
        assert_eq!(colours[STEPS - 1], [158, 20, 42]);
    }

    #[test]
    fn lightness_falls_from_the_middle_to_both_sides() {
        let luminance = |[r, g, b]: [u8; 3]| 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
        let light: Vec<f64> = palette().into_iter().map(luminance).collect();
        let (low, high) = light.split_at(STEPS / 2);
        assert!(low.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(high.windows(2).all(|pair| pair[0] > pair[1]));
    }

    #[test]
    fn known_values_of_the_transfer_curve() {
        // Half of linear light is 187.5 of 255 in sRGB; the straight part begins below 10.31.
        assert!(linear(187) < 0.5 && linear(188) > 0.5);
        assert!((linear(10) - 10.0 / 255.0 / 12.92).abs() < 1e-15);
        assert!((linear(255) - 1.0).abs() < 1e-15);
    }
}
