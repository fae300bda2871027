//! Roundness of one section: values about reference circles.

use std::{borrow::Cow, ops::Add};

use super::{Filter, Found, Label, POINTS_A_WAVE, config::Propagation, labelled_with_reasons, section::Form};
use runout_numerics::{
    Complex64,
    filter::{Degree, Smoother, robust_gaussian},
    fourier::Fourier,
};
use runout_standards::{
    Value,
    roundness::{Angles, CircleSearch, Hold, Points, Reference, Series, Values},
    uncertainty::{
        DRAWS, LARGEST, Lacking, LikelyForm, TURNS_OF_A_DRAW, Uncertainty, angles_for_parabolas, crest_order,
        drawn_angles, forms_to_draw, lacking_at_extreme, likely_values_of, of_rms, overlooked_by,
    },
};

/// Of so many points that may come to touch, errors cost as much as those of whole profiles.
const MOST_POINTS: usize = 128;

/// Points are looked at that are within four times this share of the largest error from the ends. Draws for which that is too little look at
/// all. Twice the largest error suffices where the centre stays; MICI and MCCI have centres that move farther than that of MZCI.
fn reach(reference: Reference) -> f64 {
    match reference {
        Reference::LeastSquares => 0.5,
        Reference::MinimumZone => 0.75,
        Reference::MaximumInscribed | Reference::MinimumCircumscribed => 1.2,
    }
}

/// Share of noise in the form found from which on errors are drawn as whole profiles: crests between few angles are then
/// crests of noise, which draws of the true form do not have.
const MOST_NOISE: f64 = 0.25;

/// A profile's own bend holds the centre of MICI and MCCI where it is so many times the standard deviation of that of the errors.
const MOST_BENT: f64 = 4.0;

/// Draws of what is filtered robustly, point by point and some times over.
const DRAWS_OF_ROBUST: usize = 64;

/// Points on a wave where values are found: contacts between them are sought from there.
const FOUND_POINTS_A_WAVE: usize = 12;

/// Points on a wave where errors are drawn: there a value's error is sought, not the value.
const DRAWN_POINTS_A_WAVE: usize = 6;

/// Values of the profile at fewer angles, with what draws of its errors make of them.
#[derive(Default)]
struct Drawn {
    values: Vec<(f64, Option<Uncertainty>)>,
    /// Standard deviation of the noise, where draws do not show what is found at some angle.
    overlooked: Option<f64>,
    /// What draws may lack of the lowest and the highest height, where none competes with it.
    lacking: [Option<Lacking>; 2],
}

impl Form {
    /// Values about each reference behind a filter.
    pub(super) fn round(&self, filter: &Filter, references: &[Reference], propagation: Propagation) -> Vec<Value> {
        let mut labels: Vec<Label> = references.iter().flat_map(|reference| roundness_labels(*reference)).collect();
        if labels.is_empty() {
            return Vec::new();
        }
        let Drawn { values: drawn, overlooked, lacking } = self.drawn_about(filter, references, propagation);
        let drawn = drawn.into_iter().map(Some).chain(std::iter::repeat(None));
        let found = self.about(filter, references).into_iter().zip(drawn);
        let found = found.zip(&labels).map(|((value, drawn), label)| {
            let known = drawn.and_then(|(about, known)| Some(known?.moved(value - about)));
            let lacking: Vec<Option<Lacking>> = extremes(label).iter().map(|end| lacking[*end as usize]).collect();
            let all: Option<Vec<Lacking>> = lacking.iter().copied().collect();
            let all = all.filter(|all| !all.is_empty()).map(|all| all.into_iter().fold(Lacking::default(), Add::add));
            let is_fixed = label.reference == Reference::LeastSquares.symbol() && self.at.gaps.is_empty();
            let known = known.map(|known| match (overlooked, all) {
                (_, Some(all)) if is_fixed => Uncertainty::of_extremes_alone(value, all.std_um),
                (Some(noise_um), None) if !lacking.is_empty() => {
                    known.of_any_form(value, noise_um, lacking.len() as f64)
                }
                _ => known.with_lacking(lacking.into_iter().flatten().fold(Lacking::default(), Add::add)),
            });
            (value, if has_kinks(label) { known.map(|known| known.on_both_sides(value)) } else { known })
        });
        let mut found: Vec<(f64, Option<Uncertainty>)> = found.collect();
        self.state_loose(filter, references, &labels, &mut found);
        let found = found.into_iter();
        let mut found: Vec<Found> = found.map(Found::from).collect();
        if let Some(last) = labels.iter().position(|label| label.symbol == "RONq") {
            let steepest = "largest |dr/dθ| of the profile, no standard's symbol";
            let reference = Reference::LeastSquares.symbol();
            labels.insert(last + 1, Label::new("dr/dtheta", "µm/°", steepest, reference));
            found.insert(last + 1, self.steepest(filter));
        }
        labelled_with_reasons(labels, found, filter, &self.held, self.at.coverage(self.angles))
    }

    /// States what errors make of RONt about MICI and MCCI whose centre nearly opposite contacts hold loosely.
    fn state_loose(
        &self,
        filter: &Filter,
        references: &[Reference],
        labels: &[Label],
        found: &mut [(f64, Option<Uncertainty>)],
    ) {
        if !references.iter().any(|reference| has_kinks_about(reference.symbol())) || !self.at.gaps.is_empty() {
            return;
        }
        let (harmonics, variance) = (filter.harmonics(&self.harmonics), self.widened(filter));
        let of_order = |power: i32| {
            let orders = variance.iter().enumerate().skip(2).filter(|(_, variance)| **variance > 0.0);
            (0.5 * orders.map(|(order, variance)| (order as f64).powi(power) * variance).sum::<f64>()).sqrt()
        };
        let [std_um, slope_um, bend_um] = [0, 2, 4].map(of_order);
        let highest = filter.highest(self.held.highest);
        let angles = Angles::shared(angles_to_draw(&harmonics, &variance, highest, usize::MAX));
        let mut fourier = Fourier::new(angles.len());
        let profile_um = self.profile(filter, &mut fourier);
        let mut zone_um = None;
        for reference in references {
            let is_own = |label: &Label| label.symbol == "RONt" && label.reference == reference.symbol();
            let Some(place) = labels.iter().position(is_own).filter(|place| found[*place].1.is_some()) else {
                continue;
            };
            let hold = Hold::of(*reference, &angles, &profile_um, self.radius_mm);
            let Some(hold) = hold.filter(|hold| *hold != Hold::Firm) else { continue };
            let zone_um = *zone_um.get_or_insert_with(|| self.about(filter, &[Reference::MinimumZone])[0]);
            let (value, known) = &mut found[place];
            let above_um = *value - zone_um;
            *known = known.take().map(|known| match hold {
                Hold::Firm => known,
                // Errors that bend the profile as much as its form does make several contacts of one.
                Hold::Bent { variance, bend_um: of_form_um } if of_form_um > MOST_BENT * bend_um => {
                    Uncertainty::of_bent_contacts(*value, above_um, std_um, variance.sqrt() * slope_um)
                }
                Hold::Opposite | Hold::Bent { .. } => known.of_loose_centre(*value, above_um, std_um),
            });
        }
    }

    /// Values about reference circles, of the profile between the angles too.
    fn about(&self, filter: &Filter, references: &[Reference]) -> Vec<f64> {
        let waves = filter.highest(self.held.highest);
        // The given angles and others between them, so that no crest is far from one.
        let angles = self.angles * (FOUND_POINTS_A_WAVE * waves).div_ceil(self.angles).max(1);
        let harmonics = filter.harmonics(&self.harmonics);
        let mut fourier = Fourier::new(angles);
        let mut profile_um = Cow::Borrowed(fourier.synthesise(harmonics.iter().copied()));
        if !self.at.gaps.is_empty() {
            self.at.gaps.blank(profile_um.to_mut());
        }
        let mut series = Series::new(&harmonics, &profile_um, self.radius_mm);
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
    }

    /// The same of the profile at fewer angles, with what draws of its errors make of them; nothing without known errors.
    fn drawn_about(&self, filter: &Filter, references: &[Reference], propagation: Propagation) -> Drawn {
        if propagation == Propagation::Linear
            && let Some(found) = self.drawn_where_they_touch(filter, references)
        {
            return found;
        }
        let (variance, noise) = (self.widened(filter), &self.noise);
        if !variance.iter().skip(2).any(|variance| *variance > 0.0) {
            return Drawn::default();
        }
        let harmonics = filter.harmonics(&self.harmonics);
        let angles =
            Angles::shared(angles_to_draw(&harmonics, &variance, filter.highest(self.held.highest), usize::MAX));
        let mut fourier = Fourier::new(angles.len());
        let profile_um = self.profile(filter, &mut fourier);
        let mut forms = forms_to_draw(self.likely(), &harmonics, &variance, DRAWS, noise, &mut fourier);
        forms.iter_mut().for_each(|form| self.at.gaps.blank(&mut form.mean_um));
        let overlooked = overlooked_by(&forms, &profile_um);
        let lacking = [-1.0, 1.0].map(|sign| lacking_at_extreme(&forms, &profile_um, sign));
        let search = |reference: &Reference| CircleSearch::new(*reference, &angles, self.radius_mm, true);
        let mut searches: Vec<CircleSearch> = references.iter().map(search).collect();
        let about: Vec<Option<Values>> =
            searches.iter_mut().map(|search| search.disturbed(&profile_um, 0.0).map(|circle| circle.about())).collect();
        let mut of_forms: Vec<_> = forms
            .iter()
            .map(|form| {
                let largest_um = LARGEST * form.std_um();
                let of_references = references.iter().zip(&mut searches);
                let circles: Vec<_> = of_references
                    .map(|(reference, search)| search.disturbed(&form.mean_um, reach(*reference) * largest_um))
                    .collect();
                (form.errors(), circles)
            })
            .collect();
        let transforms = forms.iter().filter(|form| !form.least).map(LikelyForm::transforms).sum();
        let mut places = places_of(&forms);
        let mut found = likely_values_of(&forms, transforms, |disturbed, found| {
            if !disturbed {
                references.iter().zip(&about).for_each(|(reference, about)| add_values(*about, *reference, found));
                return;
            }
            let Some((errors, circles)) = places.next().and_then(|place| of_forms.get_mut(place)) else { return };
            let drawn = errors.as_mut().map(|errors| errors.turned(&mut fourier));
            for (reference, circle) in references.iter().zip(circles) {
                let values = circle.as_mut().and_then(|circle| match &drawn {
                    Some(drawn) => circle.values(drawn),
                    None => Some(circle.about()),
                });
                add_values(values, *reference, found);
            }
        });
        self.state_rms(filter, references, &mut found);
        Drawn { values: found, overlooked, lacking }
    }

    /// States the uncertainty of RONq in closed form where the section is not interrupted.
    fn state_rms(&self, filter: &Filter, references: &[Reference], found: &mut [(f64, Option<Uncertainty>)]) {
        let of_references = references.iter().flat_map(|reference| roundness_labels(*reference));
        let place = of_references.zip(found).find(|(label, _)| label.symbol == "RONq");
        if let Some((_, (ronq_um, known))) = place.filter(|_| self.at.gaps.is_empty()) {
            let harmonics = filter.harmonics(&self.harmonics);
            let (variance, widened) = (filter.variance(&self.variance), self.widened(filter));
            *known = of_rms(&harmonics, &variance, &widened, &self.freedom, *ronq_um);
        }
    }

    /// The same with errors drawn at the points that may come to touch, and RONq in closed form; `None` where the section is interrupted,
    /// much of the form found is noise, or such points are many.
    fn drawn_where_they_touch(&self, filter: &Filter, references: &[Reference]) -> Option<Drawn> {
        if !self.at.gaps.is_empty() {
            return None;
        }
        let variance = self.widened(filter);
        if !variance.iter().skip(2).any(|variance| *variance > 0.0) {
            return None;
        }
        let harmonics = filter.harmonics(&self.harmonics);
        let few = angles_to_draw(&harmonics, &variance, filter.highest(self.held.highest), self.angles);
        let angles = Angles::shared(few);
        let mut fourier = Fourier::new(angles.len());
        let forms = forms_to_draw(self.likely(), &harmonics, &variance, DRAWS, &self.noise, &mut fourier);
        if forms.iter().any(|form| !form.least && form.share_of_noise() > MOST_NOISE) {
            return None;
        }
        let profile_um = self.profile(filter, &mut fourier);
        let overlooked = overlooked_by(&forms, &profile_um);
        let lacking = [-1.0, 1.0].map(|sign| lacking_at_extreme(&forms, &profile_um, sign));
        let mut found = Vec::new();
        for reference in references {
            let mut search = CircleSearch::new(*reference, &angles, self.radius_mm, false);
            let about = search.disturbed(&profile_um, 0.0)?.about();
            let mut of_forms = Vec::new();
            for form in &forms {
                let largest_um = LARGEST * form.std_um();
                let circle = search.disturbed(&form.mean_um, reach(*reference) * largest_um)?;
                if circle.points().len() > MOST_POINTS {
                    return None;
                }
                let errors = form.errors_at(circle.points(), &mut fourier);
                of_forms.push((largest_um, errors, circle));
            }
            let (mut places, mut certain) = (places_of(&forms), true);
            // As wide as from whole profiles: draws about a form that holds its noise scatter too little.
            let transforms = DRAWS.div_ceil(TURNS_OF_A_DRAW);
            let values = likely_values_of(&forms, transforms, |disturbed, found| {
                if !disturbed {
                    add_values(Some(about), *reference, found);
                    return;
                }
                let of_form = places.next().and_then(|place| of_forms.get_mut(place));
                let Some((largest_um, errors, circle)) = of_form else { return };
                let values = match errors {
                    Some(errors) => circle.values_at(errors.draw(), *largest_um),
                    None => Some(circle.about()),
                };
                certain &= values.is_some();
                add_values(values, *reference, found);
            });
            if !certain {
                return None;
            }
            found.extend(values);
        }
        self.state_rms(filter, references, &mut found);
        Some(Drawn { values: found, overlooked, lacking })
    }

    /// Roundness behind the robust Gaussian (ISO 16610-31), which is applied to each drawn profile.
    pub(super) fn robust(&self, cutoff_upr: f64, references: &[Reference]) -> Vec<Value> {
        let filter = Filter::robust(cutoff_upr);
        let labels: Vec<Label> = references.iter().flat_map(|reference| roundness_labels(*reference)).collect();
        let smoother = Smoother::closed(self.angles, cutoff_upr, Degree::Two);
        let (angles, mut points) = (Angles::equal(self.angles), Points::default());
        let found = self.evaluate(&Filter::low_pass(None), self.angles, DRAWS_OF_ROBUST, |profile_um, found| {
            points.set_profile(&angles, &robust_gaussian(&smoother, profile_um).low_pass, self.radius_mm);
            for reference in references {
                let about = points.reference(*reference).map(|circle| points.values(&circle));
                add_values(about, *reference, found);
            }
        });
        let found = found.into_iter().zip(&labels).map(|((value, known), label)| {
            (value, if has_kinks(label) { known.map(|known| known.on_both_sides(value)) } else { known })
        });
        let found = found.collect();
        self.labelled(labels, found, &filter)
    }
}

/// Angles on which errors of this variance are drawn, where the profile has these harmonics up to the highest order; `most`, unless parabolas need more.
pub(super) fn angles_to_draw(harmonics: &[Complex64], variance: &[f64], highest: usize, most: usize) -> usize {
    let up_to = highest + 1;
    let power = || harmonics.iter().take(up_to).map(Complex64::norm_sqr);
    let variance = || variance.iter().take(up_to).copied();
    let finely = angles_for_parabolas(power(), variance()).min(POINTS_A_WAVE * highest);
    let orders = [crest_order(power()), crest_order(variance())];
    drawn_angles(DRAWN_POINTS_A_WAVE, orders, highest).min(most).max(finely)
}

/// Which of the forms each draw is of.
pub(super) fn places_of(forms: &[LikelyForm]) -> impl Iterator<Item = usize> + '_ {
    forms.iter().enumerate().flat_map(|(place, form)| std::iter::repeat_n(place, form.draws))
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

/// Whether errors change which contacts hold the circle that a value is about, and with them the value's slopes.
fn has_kinks(label: &Label) -> bool {
    label.symbol == "RONt" && has_kinks_about(&label.reference)
}

/// The same of RONt about the reference with this symbol.
fn has_kinks_about(symbol: &str) -> bool {
    [Reference::MaximumInscribed, Reference::MinimumCircumscribed].iter().any(|reference| reference.symbol() == symbol)
}

/// An extreme of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Valley,
    Peak,
}

/// Of which extremes of the profile a value is the distance, from each other or from the reference; none of a mean.
fn extremes(label: &Label) -> &'static [End] {
    match label.symbol {
        "RONt" => &[End::Valley, End::Peak],
        "RONp" => &[End::Peak],
        "RONv" => &[End::Valley],
        _ => &[],
    }
}

/// The values of [`roundness_labels`]; NaN where there is no such circle.
fn add_values(about: Option<Values>, reference: Reference, found: &mut Vec<f64>) {
    let of = |value: fn(&Values) -> f64| about.as_ref().map_or(f64::NAN, value);
    found.push(of(|values| values.ront_um));
    if reference == Reference::LeastSquares {
        found.extend([of(|values| values.ronp_um), of(|values| values.ronv_um), of(|values| values.ronq_um)]);
    }
}
