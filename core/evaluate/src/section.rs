//! Values of one section around the part.

use std::cell::OnceCell;

use super::{Content, Evaluate, Filter, Group, Label, NumberFound, POINTS_A_WAVE, labelled};
use crate::Value;
use runout_draws::{Draws, Interval, Measured, Uncertainty, VarianceFrom, noise_95, seed, stands_out, student_95};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::roundness::{Angles, Points, Reference, Undetermined};
use runout_turning::{
    separation::{Quantity, SectionAt},
    station::StationResult,
};

/// The values of a section whose nominal radius is known.
#[must_use]
pub fn section_values(result: &StationResult, section: usize, evaluate: &Evaluate, radius_mm: f64) -> Vec<Value> {
    let Some(form) = Form::of(result, section, radius_mm) else { return Vec::new() };
    let mut values = form.values(evaluate);
    let restored = form.restored(&|order| result.passed(order));
    let mut equivalents: Vec<Vec<Value>> =
        (form.equivalents.iter().chain(&restored)).map(|harmonics| form.exactly(harmonics).values(evaluate)).collect();
    equivalents.extend(form.as_declared().map(|form| form.values(evaluate)));
    for value in &mut values {
        let same = |other: &&Value| other.id() == value.id();
        let others: Vec<f64> =
            equivalents.iter().filter_map(|all| all.iter().find(same)).map(|other| other.value).collect();
        value.uncertainty = value.uncertainty.take().map(|known| known.with_equivalents(value.value, &others));
    }
    values
}

/// Which of its values a section lacks for want of a reference circle, each with its reason: an interruption may leave an arc.
pub(crate) fn missing_circles(
    result: &StationResult,
    section: usize,
    evaluate: &Evaluate,
    radius_mm: f64,
    values: &[Value],
) -> Vec<String> {
    let form = Form::of(result, section, radius_mm).filter(|_| evaluate.has(Group::Roundness));
    let Some(form) = form else { return Vec::new() };
    let ront = || values.iter().filter(|value| value.symbol == "RONt");
    let mut filters: Vec<&str> = ront().filter_map(|value| value.filter.as_deref()).collect();
    filters.dedup();
    let lacks = |reference: &Reference| {
        let has = |filter: &str| {
            ront().any(|value| {
                value.reference.as_deref() == Some(reference.symbol()) && value.filter.as_deref() == Some(filter)
            })
        };
        let without: Vec<&str> = filters.iter().copied().filter(|filter| !has(filter)).collect();
        (!without.is_empty() || filters.is_empty()).then_some((*reference, without))
    };
    let lacking: Vec<(Reference, Vec<&str>)> = evaluate.references.iter().filter_map(lacks).collect();
    if lacking.is_empty() {
        return Vec::new();
    }
    let profile_um = form.profile(&Filter::low_pass(None), &mut Fourier::new(form.angles));
    let mut points = Points::default();
    points.set_profile(&Angles::equal(form.angles), &profile_um, radius_mm);
    let reason = |(reference, without): (Reference, Vec<&str>)| {
        let reason = points.determine(reference).err().unwrap_or(Undetermined::NotFound);
        let all = without.len() == filters.len();
        let which = if all { String::new() } else { format!(" (filter: {})", without.join(", ")) };
        format!("section {}: no RONt about {}{which}: {reason}", form.at.id, reference.symbol())
    };
    lacking.into_iter().map(reason).collect()
}

/// The largest |dr/dθ| of a profile on equal angles, by central differences over three points; NaN where no point has
/// both neighbours.
pub(crate) fn steepest_um_per_deg(profile_um: &[f64]) -> f64 {
    let count = profile_um.len();
    let [first, second, .., before, last] = *profile_um else { return f64::NAN };
    // Lanes that do not wait for each other: Monte Carlo asks for this many thousand times.
    let mut steepest = [f64::NAN; 8];
    let mut look = |lane: usize, difference: f64| {
        let slope = difference.abs();
        // Comparisons with NaN are false: the first slope that is a number is taken.
        steepest[lane] = if slope <= steepest[lane] || slope.is_nan() { steepest[lane] } else { slope };
    };
    for (ahead, behind) in profile_um[2..].chunks(8).zip(profile_um[..count - 2].chunks(8)) {
        ahead.iter().zip(behind).enumerate().for_each(|(lane, (ahead, behind))| look(lane, ahead - behind));
    }
    look(0, second - last);
    look(1, first - before);
    steepest.into_iter().fold(f64::NAN, f64::max) * count as f64 / 720.0
}

/// One section's form without level and centring, which are no form deviation also where the method knows them.
pub(super) struct Form {
    pub(super) harmonics: Vec<Complex64>,
    /// Those of the solutions between which the data do not decide, and this is the mean of.
    equivalents: Vec<Vec<Complex64>>,
    /// Of noise.
    pub(super) variance: Vec<f64>,
    /// Real degrees of freedom behind it, by order; 0 where it is taken as exact.
    pub(super) freedom: Vec<usize>,
    /// Which orders share it.
    pub(super) variance_from: VarianceFrom,
    pub(super) held: Content,
    pub(super) angles: usize,
    pub(super) radius_mm: f64,
    pub(super) at: SectionAt,
    /// Seed of its errors.
    pub(super) seed: u64,
    /// What the true form may be and how it would be measured, for all of its values; nothing without known errors.
    draws: OnceCell<Option<Draws>>,
}

/// What a low-pass has taken of the profile is left out where it is below this share of the errors' standard deviation.
const NEGLIGIBLE: f64 = 1e-3;

impl Form {
    pub(super) fn of(result: &StationResult, section: usize, radius_mm: f64) -> Option<Self> {
        let separation = &result.separation;
        let unknown = separation.position(Quantity::Form(section))?;
        let from_two = |harmonics: Vec<Complex64>| {
            let each = harmonics.into_iter().enumerate();
            each.map(|(order, value)| if order < 2 { Complex64::ZERO } else { value }).collect()
        };
        let at = separation.sections.get(section)?.clone();
        let held = Content {
            highest: separation.max_order(),
            all_to: separation.max_order(),
            lost: separation.lost_orders(unknown).into_iter().filter(|order| *order >= 2).collect(),
            half_power_upr: result.half_power_upr(),
            shows_weakened: false,
            shows_absent: result.absent_um(section) > 0.0,
        };
        let variance: Vec<f64> = separation.noise_variance(unknown).collect();
        let above = held.half_power_upr.map_or(usize::MAX, |half| half as usize + 1);
        let weakened = separation.coefficients(unknown).skip(above.max(2));
        let shows_weakened = weakened.zip(variance.iter().skip(above.max(2))).any(|(value, of)| stands_out(value, *of));
        let held = Content { shows_weakened, ..held };
        // A form of which nothing is observable has no values.
        (result.angles > 1 && held.lost.len() < held.highest.saturating_sub(1)).then(|| Self {
            harmonics: from_two(separation.coefficients(unknown).collect()),
            equivalents: separation.equivalent_coefficients(unknown).map(from_two).collect(),
            variance,
            freedom: (0..=separation.max_order()).map(|order| separation.degrees_of_freedom(order)).collect(),
            variance_from: separation.variance_from,
            angles: result.angles,
            radius_mm,
            seed: seed(&[&result.station, &at.id]),
            draws: OnceCell::new(),
            held,
            at,
        })
    }

    /// Another form of the same section, taken as exact.
    fn exactly(&self, harmonics: &[Complex64]) -> Self {
        let (harmonics, equivalents, variance) = (harmonics.to_vec(), Vec::new(), Vec::new());
        let (freedom, held, at) = (self.freedom.clone(), self.held.clone(), self.at.clone());
        Self { harmonics, equivalents, variance, freedom, held, at, draws: OnceCell::new(), ..*self }
    }

    /// The form up to the edges of interruptions as the rig declares them, taken as exact: there it is bridged. `None` where values go as far.
    fn as_declared(&self) -> Option<Self> {
        (self.at.gaps != self.at.declared_gaps).then(|| {
            let at = SectionAt { gaps: self.at.declared_gaps.clone(), ..self.at.clone() };
            Self { at, ..self.exactly(&self.harmonics) }
        })
    }

    /// The form with what a low-pass has taken from the orders that stand out from their noise, as far up as half of their power passes; `None`
    /// where that is nothing beside the errors. Noise is left as it is: nothing says what of it was form.
    fn restored(&self, passed: &impl Fn(usize) -> f64) -> Option<Vec<Complex64>> {
        let half_power_upr = self.held.half_power_upr?;
        let mut taken_um = 0.0;
        let of_order = |(order, harmonic): (usize, &Complex64)| {
            if order as f64 > half_power_upr
                || !self.variance.get(order).is_some_and(|variance| stands_out(*harmonic, *variance))
            {
                return *harmonic;
            }
            let restored = harmonic / passed(order);
            taken_um += (restored - harmonic).norm();
            restored
        };
        let harmonics: Vec<Complex64> = self.harmonics.iter().enumerate().map(of_order).collect();
        let power: f64 = self.variance.iter().skip(2).filter(|variance| **variance > 0.0).sum();
        (taken_um > NEGLIGIBLE * (0.5 * power).sqrt()).then_some(harmonics)
    }

    fn values(&self, evaluate: &Evaluate) -> Vec<Value> {
        let mut values = Vec::new();
        for cutoff in evaluate.cutoffs_upr(self.held.highest) {
            let references: &[Reference] = if evaluate.has(Group::Roundness) { &evaluate.references } else { &[] };
            values.extend(self.round(&evaluate.low_pass(cutoff), references));
            if cutoff.is_none() && evaluate.has(Group::Texture) {
                values.extend(self.papers_ra());
            }
            if let (true, Some(window_deg)) = (evaluate.has(Group::Roundness), evaluate.slope_window_deg) {
                values.extend(self.slope(&evaluate.low_pass(cutoff), window_deg));
            }
        }
        for cutoff in evaluate.robust_filter_upr.iter().filter(|_| evaluate.has(Group::Roundness)) {
            values.extend(self.robust(*cutoff, &evaluate.references));
        }
        if evaluate.has(Group::Harmonics) {
            values.extend(self.harmonics(evaluate.harmonics_upr));
        }
        values.extend(self.texture(evaluate));
        values
    }

    /// The largest change of the profile over a window of angles, r(α + w) − r(α): a profile of its own, with the harmonics
    /// cₙ (e^{inw} − 1).
    fn slope(&self, filter: &Filter, window_deg: f64) -> Vec<Value> {
        let window_rad = window_deg.to_radians();
        let change = |order: usize| Complex64::cis(order as f64 * window_rad) - 1.0;
        let mut gaps = self.at.gaps.clone();
        for [from, length] in self.at.gaps.stretches() {
            gaps.add(from - window_rad, length);
        }
        let waves = filter.highest(self.held.highest);
        let largest = |changes: &[f64]| changes.iter().map(|change| change.abs()).fold(f64::NAN, f64::max);
        let angles = self.angles * (POINTS_A_WAVE * waves).div_ceil(self.angles).max(1);
        let each = filter.harmonics(&self.harmonics).into_iter().enumerate();
        let harmonics = each.map(|(order, harmonic)| harmonic * change(order));
        let mut changes = Fourier::new(angles).synthesise(harmonics).to_vec();
        gaps.blank(&mut changes);
        let value = largest(&changes);
        let found = self.draws().and_then(|draws| {
            let weight = |order: usize| filter.weight(order) * change(order);
            let profiles = draws.profiles(weight, self.drawn_angles(filter), |_, changes| gaps.blank(changes));
            profiles.values_of_section(|changes, found| found.push(largest(changes))).pop()
        });
        let source = "largest change of the profile over a window, no standard's symbol";
        let label = Label::new("slope", "µm", source, format!("LSCI, window {window_deg}°"));
        self.labelled(vec![label], vec![NumberFound::of(value, found.as_ref())], filter)
    }

    /// Amplitude and phase of each order from 2 to at most `highest`.
    ///
    /// Half of an order's variance is along its amplitude and half across it. The phase of an amplitude that may be noise
    /// alone has no uncertainty.
    fn harmonics(&self, highest: usize) -> Vec<Value> {
        let mut values = Vec::new();
        let known = |order: &usize| !self.held.lost.contains(order);
        for order in (2..=highest.min(self.held.highest)).filter(known) {
            let (value, turns) = (self.harmonics[order], order as f64);
            let amplitude = value.norm();
            // The first crest of A cos(n α + φ).
            let phase = (-value.arg().to_degrees() / turns).rem_euclid(360.0 / turns);
            let variance = self.variance.get(order).copied().filter(|variance| variance.is_finite());
            let std = variance.map(|variance| (0.5 * variance).sqrt());
            let freedom = self.freedom.get(order).copied().unwrap_or(0);
            let of_amplitude = std.map(|std| Uncertainty::of_amplitude(amplitude, std, freedom));
            let of_phase = std.filter(|std| amplitude >= noise_95(freedom as f64) * std).map(|std| {
                let std = (std / (amplitude * turns)).to_degrees();
                let reach = student_95(freedom as f64) * std;
                Uncertainty::new(std, [phase - reach, phase + reach], 0)
            });
            let labels = vec![
                Label::new("amplitude", "µm", "amplitude of one order of the form", "LSCI"),
                Label::new("phase", "°", "part's angle of the order's first crest", "LSCI"),
            ];
            let found = [(amplitude, of_amplitude), (phase, of_phase)].map(NumberFound::from).to_vec();
            let both = self.labelled(labels, found, &Filter::low_pass(None));
            let weakened_above_upr = self.held.half_power_upr.filter(|half| turns > *half);
            let of_order = |value| Value { band_upr: [order; 2], lost_orders: Vec::new(), weakened_above_upr, ..value };
            values.extend(both.into_iter().map(of_order));
        }
        values
    }

    /// Everything that is computed from one filtered profile on equal angles, with what is known of its errors.
    pub(super) fn evaluate(
        &self,
        filter: &Filter,
        angles: usize,
        mut values: impl FnMut(&[f64], &mut Vec<f64>),
    ) -> Vec<NumberFound> {
        let known = self.known(|order| filter.weight(order), angles, &mut values);
        if !known.is_empty() {
            return known.iter().map(|known| NumberFound::of(known.found, Some(known))).collect();
        }
        let mut found = Vec::new();
        values(&self.profile(filter, &mut Fourier::new(angles)), &mut found);
        found.into_iter().map(|value| NumberFound::of(value, None)).collect()
    }

    /// What is known of values of the profile whose orders are weighted, on equal angles; nothing without known errors.
    pub(super) fn known(
        &self,
        weight: impl Fn(usize) -> Complex64,
        angles: usize,
        values: impl FnMut(&[f64], &mut Vec<f64>),
    ) -> Vec<Interval> {
        let profiles =
            self.draws().map(|draws| draws.profiles(weight, angles, |_, profile_um| self.at.gaps.blank(profile_um)));
        profiles.map_or_else(Vec::new, |profiles| profiles.values_of_section(values))
    }

    /// Draws of what the true form may be, measured again.
    pub(super) fn draws(&self) -> Option<&Draws> {
        let of = || {
            let (harmonics, variance) = (self.harmonics.clone(), self.variance.clone());
            let (squares, variance_from) = (self.freedom.clone(), self.variance_from);
            Draws::of_section(&Measured { harmonics, variance, squares, variance_from, lowest: 2 }, self.seed)
        };
        self.draws.get_or_init(of).as_ref()
    }

    pub(super) fn profile(&self, filter: &Filter, fourier: &mut Fourier) -> Vec<f64> {
        let mut form_um = fourier.synthesise(filter.harmonics(&self.harmonics)).to_vec();
        self.at.gaps.blank(&mut form_um);
        form_um
    }

    pub(super) fn labelled(&self, labels: Vec<Label>, found: Vec<NumberFound>, filter: &Filter) -> Vec<Value> {
        labelled(labels, found, filter, &self.held, self.at.coverage(self.angles))
    }
}
