//! A filter of closed profiles with its name.

use runout_numerics::{
    Complex64,
    filter::{Band, Kind, upr},
};

/// Orders of which a filter passes less do not matter.
const MATTERS: f64 = 0.01;
/// A filter reaches above the highest order where it passes this much of the next one or more: how high the orders above
/// are, nothing says, and they are many. The Gaussian's 2^−(f/f_c)² is below it from 3.157 f_c on.
const REACHES: f64 = 1e-3;

/// A filter of closed profiles by order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Filter {
    pub name: String,
    kind: Kind,
    band: Band,
}

impl Filter {
    /// Everything passes, or what is below a cut-off of a Gaussian.
    pub(crate) fn low_pass(cutoff_upr: Option<f64>) -> Self {
        Self::round(Kind::Gaussian, None, cutoff_upr)
    }

    /// What is between two cut-offs, as far as there are any.
    pub(crate) fn round(kind: Kind, above_upr: Option<f64>, below_upr: Option<f64>) -> Self {
        Self { name: round_name(kind, above_upr, below_upr), kind, band: Band { above_upr, below_upr } }
    }

    /// The robust Gaussian's name and the band of the Gaussian with its cut-off, which it is not: no weight on orders.
    pub(crate) fn robust(cutoff_upr: f64) -> Self {
        Self { name: robust_name(cutoff_upr), ..Self::low_pass(Some(cutoff_upr)) }
    }

    /// The filter, with its name, for values along the axis: it has no band of orders of a turn.
    pub(crate) fn along_axis(&self) -> Self {
        Self { name: self.name.clone(), kind: self.kind, band: Band::default() }
    }

    /// What lies between λs and λc along the circumference of a radius.
    pub(crate) fn between(lambda_s_mm: Option<f64>, lambda_c_mm: Option<f64>, radius_mm: f64) -> Self {
        let upr = |wavelength_mm| upr(wavelength_mm, radius_mm);
        let band = Band { above_upr: lambda_c_mm.map(upr), below_upr: lambda_s_mm.map(upr) };
        Self { name: between_name(lambda_s_mm, lambda_c_mm), kind: Kind::Gaussian, band }
    }

    /// Share of an order that passes, with its phase. A high-pass leaves level and centre, orders 0 and 1, which are position
    /// and no form, where they are known.
    pub(crate) fn weight(&self, order: usize) -> Complex64 {
        let upr = order as f64;
        let low = self.band.below_upr.map_or(Complex64::ONE, |cutoff| self.kind.low_pass(upr, cutoff));
        let high = self.band.above_upr.filter(|_| order > 1);
        low * high.map_or(Complex64::ONE, |cutoff| self.kind.high_pass(upr, cutoff))
    }

    /// Cut-off of a Gaussian low-pass, 0 where everything passes; `None` of any other filter.
    pub(crate) fn gaussian_upr(&self) -> Option<f64> {
        let low_pass = self.band.above_upr.is_none() && (self.kind == Kind::Gaussian || self.passes_everything());
        low_pass.then_some(self.band.below_upr.unwrap_or(0.0))
    }

    /// Share of an order that its low-pass passes.
    fn passes(&self, order: f64, cutoff: f64) -> f64 {
        self.kind.low_pass(order, cutoff).norm()
    }

    /// What lies between λc and λf, the waviness; without λf, all that is longer than λc.
    pub(crate) fn waviness(lambda_c_mm: f64, lambda_f_mm: Option<f64>, radius_mm: f64) -> Self {
        let upr = |wavelength_mm| upr(wavelength_mm, radius_mm);
        let band = Band { above_upr: lambda_f_mm.map(upr), below_upr: Some(upr(lambda_c_mm)) };
        Self { name: waviness_name(lambda_c_mm, lambda_f_mm), kind: Kind::Gaussian, band }
    }

    /// Harmonics behind the filter.
    pub(crate) fn harmonics(&self, harmonics: &[Complex64]) -> Vec<Complex64> {
        harmonics.iter().enumerate().map(|(order, harmonic)| harmonic * self.weight(order)).collect()
    }

    /// Variances behind the filter.
    pub(crate) fn variance(&self, variance: &[f64]) -> Vec<f64> {
        variance.iter().enumerate().map(|(order, variance)| variance * self.weight(order).norm_sqr()).collect()
    }

    /// Orders between the cut-offs, from 2 to at most `highest`.
    pub(crate) fn band_upr(&self, highest: usize) -> [usize; 2] {
        let low = self.band.above_upr.map_or(2, |cutoff| (cutoff.ceil() as usize).max(2));
        let high = self.band.below_upr.map_or(highest, |cutoff| (cutoff.floor() as usize).min(highest));
        [low.min(high), high]
    }

    /// Whether a hundredth or more passes of an order of which something before has taken half of the power, 29 % of the
    /// amplitude. What lets everything pass asks for nothing.
    pub(crate) fn asks_for_more_than(&self, half_power_upr: f64) -> bool {
        self.band.below_upr.is_some_and(|cutoff| self.passes(half_power_upr, cutoff) >= MATTERS)
    }

    /// Whether it has no cut-off for high orders: its values are of the orders that there are.
    pub(crate) fn passes_everything(&self) -> bool {
        self.band.below_upr.is_none()
    }

    /// Whether it passes a thousandth or more of what is above an order. What lets everything pass is of the orders there
    /// are.
    pub(crate) fn reaches_above(&self, order: usize) -> bool {
        self.band.below_upr.is_some_and(|cutoff| self.passes((order + 1) as f64, cutoff) >= REACHES)
    }

    /// The highest order of which it passes a thousandth or more, 3.157 times its cut-off for a Gaussian; `None` where
    /// everything passes.
    pub(crate) fn reach_upr(&self) -> Option<usize> {
        self.band.below_upr.map(|cutoff| {
            // Every low-pass falls with the order.
            let passes = |order: usize| self.passes(order as f64, cutoff) >= REACHES;
            let (mut low, mut high) = (0, cutoff as usize + 1);
            while passes(high) {
                (low, high) = (high, 2 * high);
            }
            while high - low > 1 {
                let middle = low.midpoint(high);
                if passes(middle) { low = middle } else { high = middle }
            }
            low
        })
    }

    /// The highest order that it passes, of those up to `highest`.
    pub(crate) fn highest(&self, highest: usize) -> usize {
        (0..=highest).rev().find(|order| self.weight(*order).norm() >= MATTERS).unwrap_or(0)
    }

    /// Those of the lost orders that it would pass.
    pub(crate) fn lost(&self, lost: &[usize]) -> Vec<usize> {
        lost.iter().copied().filter(|order| self.weight(*order).norm() >= MATTERS).collect()
    }
}

/// "none", "Gaussian 50 UPR", "spline 15 to 150 UPR", "2RC above 15 UPR".
pub(super) fn round_name(kind: Kind, above_upr: Option<f64>, below_upr: Option<f64>) -> String {
    match (above_upr, below_upr) {
        (None, None) => "none".into(),
        (None, Some(below)) => format!("{} {below} UPR", kind.name()),
        (Some(above), None) => format!("{} above {above} UPR", kind.name()),
        (Some(above), Some(below)) => format!("{} {above} to {below} UPR", kind.name()),
    }
}

/// "robust Gaussian 50 UPR".
pub(super) fn robust_name(cutoff_upr: f64) -> String {
    format!("robust Gaussian {cutoff_upr} UPR")
}

/// "none", "Gaussian λs 0.0025 mm, λc 0.8 mm".
pub(super) fn between_name(lambda_s_mm: Option<f64>, lambda_c_mm: Option<f64>) -> String {
    gaussian_name([("λs", lambda_s_mm), ("λc", lambda_c_mm)])
}

/// "Gaussian λc 0.8 mm, λf 8 mm".
pub(super) fn waviness_name(lambda_c_mm: f64, lambda_f_mm: Option<f64>) -> String {
    gaussian_name([("λc", Some(lambda_c_mm)), ("λf", lambda_f_mm)])
}

fn gaussian_name(named: [(&str, Option<f64>); 2]) -> String {
    let named = named.iter().filter_map(|(name, wavelength)| Some(format!("{name} {} mm", (*wavelength)?)));
    let names: Vec<String> = named.collect();
    if names.is_empty() { "none".into() } else { format!("Gaussian {}", names.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_an_order_at_the_cut_off_passes_and_a_quarter_of_its_variance() {
        let filter = Filter::low_pass(Some(50.0));
        let harmonics = filter.harmonics(&vec![Complex64::new(3.0, -4.0); 101]);
        // ISO 16610-21: 50 % at the cut-off, 2^-4 at twice that.
        assert!((harmonics[50].norm() - 2.5).abs() < 1e-12 && (harmonics[100].norm() - 5.0 / 16.0).abs() < 1e-12);
        assert!((filter.variance(&[1.0; 51])[50] - 0.25).abs() < 1e-12);
        assert_eq!((filter.band_upr(255), filter.band_upr(40)), ([2, 50], [2, 40]));
        // 2^-(129/50)² is 0.0099.
        assert_eq!(filter.lost(&[4, 128, 129]), [4, 128]);
        // 2^-(158/50)² is 0.00099, and of order 157 more than a thousandth passes.
        assert!(filter.reaches_above(156) && !filter.reaches_above(157) && !filter.reaches_above(255));
        assert!(Filter::low_pass(Some(500.0)).reaches_above(1577) && !Filter::low_pass(None).reaches_above(2));
    }

    #[test]
    fn wavelengths_become_orders_of_the_circumference() {
        // 2π·30 mm / 0.8 mm are 235.6 waves a turn.
        let filter = Filter::between(None, Some(0.8), 30.0);
        assert_eq!(filter.band_upr(500), [236, 500]);
        let passed = filter.harmonics(&vec![Complex64::ONE; 501]);
        assert!(passed[2].norm() < 1e-4 && (passed[236].norm() - 0.5).abs() < 2e-3, "{}", passed[236]);
        assert_eq!(filter.name, "Gaussian λc 0.8 mm");
        assert_eq!(Filter::between(Some(0.0025), Some(0.8), 30.0).name, "Gaussian λs 0.0025 mm, λc 0.8 mm");
    }
}
