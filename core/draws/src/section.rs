//! What the true profile of one section may be: the least and the most form that its harmonics allow.
//!
//! The least is one profile, what certainly stands out; the same with its crests and valleys as flat as they may be is another, of which noise raises values
//! most. The most is drawn: what may be there.

use std::ops::Range;

use runout_numerics::Complex64;

use crate::{
    flat::cut,
    marks::{Marks, NARROW, WIDTHS_DEG},
    spectrum::{Noise, Power, Spectrum, VarianceFrom},
};

/// Marks that stand out by so many standard deviations are certain; so many at most.
const CERTAIN: (f64, usize) = (5.0, 6);
/// Standard deviations from which a mark is certain in a wall of sections, any of which may have one by chance.
const CERTAIN_OF_WALL: f64 = 5.5;
/// Marks beside them that there may be.
const POSSIBLE: (f64, usize) = (2.5, 2);
/// Waves that noise has beyond this quantile are there; noise alone makes some in one of a few hundred sections.
const SEEN: f64 = 3.3;
/// Quantile of noise beyond which waves are there, for a wall of sections.
const SEEN_OF_WALL: f64 = 4.0;
/// An order of its own is certain, is taken for form, and may be form, where noise has its power with a chance of e to minus this.
const SHOWN_LEAST: f64 = 14.0;
const SHOWN: f64 = 9.0;
const SHOWN_MOST: f64 = 3.0;
/// The error of an order that has more than this share of all noise does not average out: it is left as it is.
const LARGE: f64 = 0.2;
/// The harmonics of a section, and what is known of their errors, by order from 0.
#[derive(Debug, Clone)]
pub struct Measured {
    /// cₙ, profile = Re Σ cₙ e^{inα}.
    pub harmonics: Vec<Complex64>,
    /// E|eₙ|²; orders without a known one or with none are taken as exact.
    pub variance: Vec<f64>,
    /// Squares from which each variance is known; 0: exactly.
    pub squares: Vec<usize>,
    /// Which orders share them.
    pub variance_from: VarianceFrom,
    /// Orders below have no errors.
    pub lowest: usize,
}

/// What the true profile may be.
pub(crate) const FORMS: usize = 3;

/// A profile that the true one may be: its mean, and the share of each order's error by which it is drawn, where it is.
#[derive(Debug, Clone)]
pub(crate) struct Form {
    pub mean: Vec<Complex64>,
    pub spread: Option<Vec<f64>>,
}

/// A section read twice.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    /// The harmonics found.
    pub(crate) found: Vec<Complex64>,
    pub(crate) marks: Marks,
    /// Share of each order that the processing keeps beside marks.
    pub(crate) kept: Vec<f64>,
    /// The least, the same as flat as it may be, and the most.
    pub(crate) forms: [Form; FORMS],
    /// Whether the data have less power than their noise would have.
    pub(crate) refutes_noise: bool,
}

impl Section {
    /// One section alone, or one of those of a wall.
    pub(crate) fn of(measured: &Measured, of_wall: bool) -> Self {
        let Measured { harmonics, variance, squares, variance_from, lowest } = measured;
        let noise = Noise { variance, squares, variance_from: *variance_from, lowest: *lowest };
        let (certain, seen) = if of_wall { (CERTAIN_OF_WALL, SEEN_OF_WALL) } else { (CERTAIN.0, SEEN) };
        if noise.is_refuted_by(harmonics, seen) {
            return Self::of_any_noise(harmonics);
        }
        let mut marks = Marks::default();
        marks.find(harmonics, noise, &WIDTHS_DEG, (certain, CERTAIN.1));
        let mut with_possible = marks.clone();
        with_possible.find(harmonics, noise, &WIDTHS_DEG[NARROW..], POSSIBLE);
        let all: f64 = (0..harmonics.len()).filter_map(|order| noise.of(order)).sum();
        let is_large = |order: usize| noise.of(order).is_some_and(|variance| variance > LARGE * all);
        let whole_where_large = |shares: Vec<f64>| -> Vec<f64> {
            shares.into_iter().enumerate().map(|(order, share)| if is_large(order) { 1.0 } else { share }).collect()
        };
        let rest = marks.without(harmonics);
        let rest_of_most = with_possible.without(harmonics);
        let spectrum = Spectrum::of(&rest, noise);
        let least = spectrum.shares(Power::Least { seen }, SHOWN_LEAST);
        let most = whole_where_large(Spectrum::of(&rest_of_most, noise).shares(Power::Most, SHOWN_MOST));
        let kept = whole_where_large(spectrum.shares(Power::Most, SHOWN));
        let mean = |rest: &[Complex64], share: &[f64]| -> Vec<Complex64> {
            let beside = |order: usize| harmonics[order] - rest[order];
            (0..rest.len()).map(|order| beside(order) + share[order] * rest[order]).collect()
        };
        let least = mean(&rest, &least);
        let flat = Form { mean: cut(&least, noise), spread: None };
        let spread = Some(most.iter().map(|share| share.sqrt()).collect());
        let most = Form { mean: mean(&rest_of_most, &most), spread };
        let forms = [Form { mean: least, spread: None }, flat, most];
        Self { found: harmonics.clone(), marks, kept, forms, refutes_noise: false }
    }

    /// What was found may be anything from noise alone to all form, and nothing is taken out of it.
    fn of_any_noise(found: &[Complex64]) -> Self {
        let nothing = Form { mean: vec![Complex64::ZERO; found.len()], spread: None };
        let forms = [nothing.clone(), nothing, Form { mean: found.to_vec(), spread: Some(vec![0.0; found.len()]) }];
        let (marks, kept) = (Marks::default(), vec![1.0; found.len()]);
        Self { found: found.to_vec(), marks, kept, forms, refutes_noise: true }
    }

    /// What every measured profile is taken for: its certain marks, and of the rest the share that may be form. Noise that raises values is
    /// so less.
    pub(crate) fn processed(&self, harmonics: &[Complex64]) -> Vec<Complex64> {
        let marks = self.marks.sum(&self.marks.heights(harmonics), harmonics.len());
        let each = harmonics.iter().zip(&marks).zip(&self.kept);
        each.map(|((all, mark), kept)| mark + kept * (all - mark)).collect()
    }
}

/// Ranges of orders whose variances are known together, each with the squares that they are known from.
pub(crate) fn known_together(squares: &[usize], most: usize) -> Vec<(Range<usize>, usize)> {
    let mut groups: Vec<(Range<usize>, usize)> = Vec::new();
    for (order, squares) in squares.iter().enumerate() {
        match groups.last_mut() {
            Some((orders, known)) if known == squares && (*squares == 0 || orders.len() < most) => orders.end += 1,
            _ => groups.push((order..order + 1, *squares)),
        }
    }
    groups
}
