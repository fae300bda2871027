//! Roundness of one section: values about reference circles.

use std::borrow::Cow;

use super::{Filter, Label, NumberFound, POINTS_A_WAVE, labelled, section::Form};
use crate::Value;
use runout_draws::{Interval, KINDS, LARGEST, angles_for_parabolas, crest_order, drawn_angles};
use runout_numerics::{
    Complex64,
    filter::{Degree, Smoother, robust_gaussian},
    fourier::Fourier,
};
use runout_standards::roundness::{Angles, CircleSearch, Disturbed, Heights, Points, Reference, Series, Sum, Values};

/// Points on a wave where values are found: contacts between them are sought from there.
const FOUND_POINTS_A_WAVE: usize = 12;
/// Points on a wave where errors are drawn: there a value's error is sought, not the value.
const DRAWN_POINTS_A_WAVE: usize = 4;

impl Form {
    /// Values about each reference behind a filter.
    pub(super) fn round(&self, filter: &Filter, references: &[Reference]) -> Vec<Value> {
        let mut labels: Vec<Label> = references.iter().flat_map(|reference| roundness_labels(*reference)).collect();
        if labels.is_empty() {
            return Vec::new();
        }
        let drawn = self.drawn_about(filter, references);
        let drawn = drawn.iter().map(Some).chain(std::iter::repeat(None));
        let found = self.about(filter, references).into_iter().zip(drawn);
        let mut found: Vec<NumberFound> = found.map(|(value, drawn)| NumberFound::of(value, drawn)).collect();
        if let Some(last) = labels.iter().position(|label| label.symbol == "RONq") {
            let steepest = "largest |dr/dθ| of the profile, no standard's symbol";
            let reference = Reference::LeastSquares.symbol();
            labels.insert(last + 1, Label::new("dr/dtheta", "µm/°", steepest, reference));
            found.insert(last + 1, self.steepest(filter));
        }
        labelled(labels, found, filter, &self.held, self.at.coverage(self.angles))
    }

    /// Values about reference circles, of the profile between the angles too.
    fn about(&self, filter: &Filter, references: &[Reference]) -> Vec<f64> {
        self.with_series(filter, |series| {
            let mut found = Vec::new();
            for reference in references {
                if *reference == Reference::LeastSquares {
                    let about = series.about(*reference).ok().map(|found| found.1);
                    add_values(about, *reference, &mut found);
                } else {
                    found.push(series.ront_um(*reference).unwrap_or(f64::NAN));
                }
            }
            found
        })
    }

    /// What is found of the profile behind a filter, on the given angles and others between them, so that no crest is far from one.
    pub(super) fn with_series<T>(&self, filter: &Filter, find: impl FnOnce(&mut Series) -> T) -> T {
        let waves = filter.highest(self.held.highest);
        let angles = self.angles * (FOUND_POINTS_A_WAVE * waves).div_ceil(self.angles).max(1);
        let harmonics = filter.harmonics(&self.harmonics);
        let mut fourier = Fourier::new(angles);
        let mut profile_um = Cow::Borrowed(fourier.synthesise(harmonics.iter().copied()));
        if !self.at.gaps.is_empty() {
            self.at.gaps.blank(profile_um.to_mut());
        }
        find(&mut Series::new(&harmonics, &profile_um, self.radius_mm))
    }

    /// What is known of the same values by draws on fewer angles; nothing without known errors.
    fn drawn_about(&self, filter: &Filter, references: &[Reference]) -> Vec<Interval> {
        let Some(draws) = self.draws() else { return Vec::new() };
        let (harmonics, variance) = (filter.harmonics(&self.harmonics), filter.variance(&self.variance));
        let highest = filter.highest(self.held.highest);
        let angles = Angles::shared(angles_to_draw(DRAWN_POINTS_A_WAVE, &harmonics, &variance, highest));
        let profiles =
            draws.profiles(|order| filter.weight(order), angles.len(), |_, profile_um| self.at.gaps.blank(profile_um));
        let std_um = (0.5 * variance.iter().skip(2).filter(|variance| **variance > 0.0).sum::<f64>()).sqrt();
        // Errors of orders from 2 on do not move the centre of a whole profile.
        let is_fixed = |reference: Reference| reference == Reference::LeastSquares && self.at.gaps.is_empty();
        let largest_um = LARGEST * std_um;
        let undisturbed = |kind: usize| &profiles.undisturbed_um(kind)[0];
        let mut circles: Vec<Vec<About>> = references
            .iter()
            .map(|reference| {
                let mut search = CircleSearch::new(*reference, &angles, self.radius_mm, true);
                let mut about = |kind: usize| {
                    if is_fixed(*reference) {
                        return About::Origin(Heights::new(undisturbed(kind)));
                    }
                    About::Circle(search.disturbed(undisturbed(kind), largest_um).map(Box::new))
                };
                (0..KINDS).map(&mut about).collect()
            })
            .collect();
        let mut sum = Sum::default();
        profiles.values(|kind, noise, found| {
            let noise = noise.map(|noise| &noise[0]);
            for (reference, about) in references.iter().zip(&mut circles) {
                match &mut about[kind] {
                    About::Origin(heights) => {
                        let ([low, high], rms) =
                            noise.map_or_else(|| heights.undisturbed(), |noise| heights.with(noise, &mut sum));
                        found.extend([high - low, high, -low, rms]);
                    }
                    About::Circle(circle) => {
                        let values = circle.as_mut().and_then(|circle| match noise {
                            Some(noise) => circle.values(noise),
                            None => Some(circle.about()),
                        });
                        add_values(values, *reference, found);
                    }
                }
            }
        })
    }

    /// Roundness behind the robust Gaussian (ISO 16610-31), which is applied to each drawn profile.
    pub(super) fn robust(&self, cutoff_upr: f64, references: &[Reference]) -> Vec<Value> {
        let filter = Filter::robust(cutoff_upr);
        let labels: Vec<Label> = references.iter().flat_map(|reference| roundness_labels(*reference)).collect();
        let smoother = Smoother::closed(self.angles, cutoff_upr, Degree::Two);
        let (angles, mut points) = (Angles::equal(self.angles), Points::default());
        let found = self.evaluate(&Filter::low_pass(None), self.angles, |profile_um, found| {
            points.set_profile(&angles, &robust_gaussian(&smoother, profile_um).low_pass, self.radius_mm);
            for reference in references {
                let about = points.reference(*reference).map(|circle| points.values(&circle));
                add_values(about, *reference, found);
            }
        });
        self.labelled(labels, found, &filter)
    }
}

/// Angles on which errors of this variance are drawn, where the profile has these harmonics up to the highest order.
pub(super) fn angles_to_draw(points_a_wave: usize, harmonics: &[Complex64], variance: &[f64], highest: usize) -> usize {
    let up_to = highest + 1;
    let power = || harmonics.iter().take(up_to).map(Complex64::norm_sqr);
    let variance = || variance.iter().take(up_to).copied();
    let finely = angles_for_parabolas(power(), variance()).min(POINTS_A_WAVE * highest);
    let orders = [crest_order(power()), crest_order(variance())];
    drawn_angles(points_a_wave, orders, highest).max(finely)
}

/// A profile that noise is drawn about.
enum About<'a> {
    /// Noise does not move the centre of its circle.
    Origin(Heights<'a>),
    /// A circle that noise moves, where there is one.
    Circle(Option<Box<Disturbed<'a>>>),
}

/// RONt, and about LSCI RONp, RONv and RONq.
fn roundness_labels(reference: Reference) -> Vec<Label> {
    let ron = |symbol, meaning: &str| {
        Label::new(symbol, "µm", format!("ISO 12181-1:2011, {meaning} roundness deviation"), reference.symbol())
    };
    let mut labels = vec![ron("RONt", "peak-to-valley")];
    if reference == Reference::LeastSquares {
        labels.extend([ron("RONp", "peak-to-reference"), ron("RONv", "reference-to-valley")]);
        labels.push(ron("RONq", "root mean square"));
    }
    labels
}

/// The values of [`roundness_labels`]; NaN where there is no such circle.
fn add_values(about: Option<Values>, reference: Reference, found: &mut Vec<f64>) {
    let of = |value: fn(&Values) -> f64| about.as_ref().map_or(f64::NAN, value);
    found.push(of(|values| values.ront_um));
    if reference == Reference::LeastSquares {
        found.extend([of(|values| values.ronp_um), of(|values| values.ronv_um), of(|values| values.ronq_um)]);
    }
}
