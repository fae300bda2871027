//! The steepest slope of one section.

use super::{
    Filter, Found,
    roundness::{angles_to_draw, places_of},
    section::Form,
};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::{
    slope::{self, steepest_um_per_rad},
    uncertainty::{DRAWS, LikelyForm, forms_to_draw, likely_values_of, overlooked_by},
};

/// Share of errors in the variance of the slope from which on its intervals hold the truth too rarely: slopes are those of the highest
/// orders, of which errors hide the form first.
const MOST_NOISE_OF_SLOPE: f64 = 0.004;

impl Form {
    /// The steepest slope, µm/°, from the harmonics, and what it may be of the true form.
    pub(super) fn steepest(&self, filter: &Filter) -> Found {
        let harmonics = filter.harmonics(&self.harmonics);
        let value = steepest_um_per_rad(&harmonics, &self.at.gaps).to_radians();
        let um_per_deg = |order: usize| (order as f64).to_radians();
        let slopes: Vec<Complex64> =
            harmonics.iter().enumerate().map(|(order, value)| Complex64::I * um_per_deg(order) * value).collect();
        let widened = self.widened(filter).into_iter().enumerate();
        let variance: Vec<f64> = widened.map(|(order, variance)| variance * um_per_deg(order).powi(2)).collect();
        let of_errors: f64 = variance.iter().skip(2).filter(|variance| **variance > 0.0).sum();
        if of_errors == 0.0 {
            return Found::from((value, None));
        }
        let share = of_errors / slopes.iter().skip(2).map(Complex64::norm_sqr).sum::<f64>();
        if share > MOST_NOISE_OF_SLOPE {
            let reason = format!(
                "errors are {:.1} % of the slope's variance (over {:.1} %), most of them at the highest orders, where the recording does not \
                 show how much is form; a filter with a lower cut-off leaves less of them",
                (100.0 * share).min(100.0),
                100.0 * MOST_NOISE_OF_SLOPE
            );
            return Found { value, uncertainty: None, no_uncertainty: Some(reason) };
        }
        let waves = filter.highest(self.held.highest).max(2);
        let mut fourier = Fourier::new(angles_to_draw(&slopes, &variance, waves, usize::MAX));
        let mut forms = forms_to_draw(self.likely(), &slopes, &variance, DRAWS, &self.noise, &mut fourier);
        forms.iter_mut().for_each(|form| self.at.gaps.blank(&mut form.mean_um));
        let mut found_slopes = fourier.synthesise(slopes).to_vec();
        self.at.gaps.blank(&mut found_slopes);
        // On the angles of the draws, from which the value differs by its crest.
        let about = slope::Drawn::about(&found_slopes).undisturbed();
        let mut of_forms: Vec<_> =
            forms.iter().map(|form| (form.errors(), slope::Drawn::about(&form.mean_um))).collect();
        let transforms = forms.iter().filter(|form| !form.least).map(LikelyForm::transforms).sum();
        let mut places = places_of(&forms);
        let found = likely_values_of(&forms, transforms, |disturbed, found| {
            if !disturbed {
                found.push(about);
                return;
            }
            let Some((errors, slopes)) = places.next().and_then(|place| of_forms.get_mut(place)) else { return };
            found.push(match errors {
                Some(errors) => slopes.steepest(&errors.turned(&mut fourier)),
                None => slopes.undisturbed(),
            });
        });
        let known = found.into_iter().next().and_then(|(_, known)| Some(known?.moved(value - about)));
        // Noise has raised what lies above its interval, at high orders of which a recording shows least how much is form.
        let raised = known.as_ref().is_some_and(|known| known.interval_95[1] < value);
        let any_form = raised || overlooked_by(&forms, &found_slopes).is_some();
        let std = (0.5 * of_errors).sqrt();
        Found::from((value, if any_form { known.map(|known| known.of_any_form(value, std, 1.0)) } else { known }))
    }
}
