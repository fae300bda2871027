//! Texture along the circumference.

/// Arithmetic mean deviation Ra in µm: the mean absolute deviation of the unfiltered circumferential profile about its
/// mean line, as Qiao, Xu, Zhao (2024) compute it. It is not ISO 21920-2's Ra, which is taken after λs and λc.
#[must_use]
pub fn ra_um(form_um: &[f64]) -> f64 {
    let count = form_um.len() as f64;
    let mean = form_um.iter().sum::<f64>() / count;
    form_um.iter().map(|value| (value - mean).abs()).sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::ra_um;

    #[test]
    fn ra_of_a_cosine_is_its_amplitude_times_two_over_pi() {
        let profile: Vec<f64> = (0..36_000)
            .map(|index| 3.0 + 2.0 * (std::f64::consts::TAU * 7.0 * f64::from(index) / 36_000.0).cos())
            .collect();
        // 1e-6: the rectangle rule on |cos| with 36 000 points.
        assert!((ra_um(&profile) - 4.0 / std::f64::consts::PI).abs() < 1e-6);
    }
}
