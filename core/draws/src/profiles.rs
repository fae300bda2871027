//! Draws of what true profiles may be, each measured again, as profiles on equal angles.

use std::{f64::consts::TAU, ops::Range};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution};
use runout_numerics::{Complex64, fourier::Fourier};

use crate::{
    errors::{DrawnErrors, Errors, largest},
    interval::{Interval, Sides},
    section::{FORMS, Measured, Section, known_together},
    spectrum::VarianceFrom,
};

/// Transforms of each form, of [`TURNS`] draws each: with 100 draws the ends of an interval are the second from each end.
const TRANSFORMS: usize = 25;
/// Transforms of each form, at least, of a wall so large that [`TRANSFORMS`] would take too long.
const FEWEST_TRANSFORMS: usize = 6;
/// Noise has no place: turned by a part of a turn, it is noise again.
const TURNS: usize = 4;
/// Draws of which the middle one is taken, and a number that has no divisor in common with [`TRANSFORMS`].
const OF_EACH: usize = 16;
const STRIDE: usize = 7;
/// Part of a turn between draws of one transform.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Orders of which less than this share passes are left out of draws.
const NEGLIGIBLE: f64 = 1e-6;
/// Squares below which draws of a variance take no more than of this many: its mean would not exist.
const FEWEST_SQUARES: f64 = 24.0;
/// Profiles about which noise is drawn: the ones found, the same processed, and of each form the true ones and those measured again.
pub const KINDS: usize = 2 + 2 * FORMS;
const FOUND: usize = 0;
const PROCESSED: usize = 1;

/// Independent noise of a seed, with what it makes of each order.
pub type Source = (u64, Vec<Complex64>);

/// Draws of one section, or of all sections of a wall together; shared by all values and filters.
#[derive(Debug, Clone)]
pub struct Draws {
    sections: Vec<Section>,
    /// Of each section, sources that it may share with others.
    sources: Vec<Vec<Source>>,
    /// Orders whose variances are known together.
    together: Vec<Range<usize>>,
    /// By form and transform, the factor on the noise of each of them.
    wider: [Vec<Vec<f64>>; FORMS],
    lowest: usize,
    transforms: usize,
}

/// Profiles on equal angles, of which values are computed.
pub struct Profiles<'a> {
    draws: &'a Draws,
    weights: Vec<Complex64>,
    angles: usize,
    /// By kind and section; missing points are NaN.
    undisturbed_um: [Vec<Vec<f64>>; KINDS],
}

impl Draws {
    /// Of one section whose orders have independent errors. `None` where no error is known.
    #[must_use]
    pub fn of_section(measured: &Measured, seed: u64) -> Option<Self> {
        let amplitudes = measured.variance.iter().map(|variance| Complex64::from(variance.max(0.0).sqrt())).collect();
        Self::of(std::slice::from_ref(measured), vec![vec![(seed, amplitudes)]], seed)
    }

    /// Of sections of a wall, each with the sources of its errors. `None` where a section has no known error.
    #[must_use]
    pub fn of(measured: &[Measured], sources: Vec<Vec<Source>>, seed: u64) -> Option<Self> {
        let lowest = measured.iter().map(|section| section.lowest).min().unwrap_or(0);
        let has_errors = |sources: &Vec<Source>| {
            let amplitudes = sources.iter().flat_map(|(_, amplitudes)| amplitudes.iter().skip(lowest));
            amplitudes.into_iter().any(|amplitude| amplitude.is_finite() && *amplitude != Complex64::ZERO)
        };
        if sources.is_empty() || !sources.iter().all(has_errors) {
            return None;
        }
        let sections = measured.iter().map(|section| Section::of(section, measured.len() > 1)).collect();
        let longest = measured.iter().map(|section| &section.squares).max_by_key(|squares| squares.len());
        let variance_from = measured.first().map(|section| section.variance_from).unwrap_or_default();
        let together = known_together(longest.map_or(&[][..], Vec::as_slice), variance_from.together());
        let chances: Vec<Option<ChiSquared<f64>>> =
            together.iter().map(|(_, squares)| ChiSquared::new(*squares as f64).ok()).collect();
        let wider = std::array::from_fn(|form| {
            let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_add(form as u64));
            let mut of_all = || {
                let groups = together.iter().zip(&chances);
                groups.map(|((_, squares), of)| wider(*squares, of.as_ref(), variance_from, &mut random)).collect()
            };
            match variance_from {
                VarianceFrom::OrdersBeside => (0..TRANSFORMS).map(|_| of_all()).collect(),
                VarianceFrom::Readings => evenly(of_all),
            }
        });
        let together = together.into_iter().map(|(orders, _)| orders).collect();
        Some(Self { sections, sources, together, wider, lowest, transforms: TRANSFORMS })
    }

    /// Limits the draws to `draws` in all, or fewer where there are fewer.
    #[must_use]
    pub fn with_draws(self, draws: usize) -> Self {
        Self { transforms: (draws / (4 * TURNS)).clamp(FEWEST_TRANSFORMS, TRANSFORMS), ..self }
    }

    /// Profiles on so many equal angles, of which each order is weighted; `blank` takes out what is missing of a section.
    pub fn profiles(
        &self,
        weight: impl Fn(usize) -> Complex64,
        angles: usize,
        blank: impl Fn(usize, &mut Vec<f64>),
    ) -> Profiles<'_> {
        let orders = self.sections.iter().map(|section| section.found.len()).max().unwrap_or(0);
        let mut weights: Vec<Complex64> = (0..orders).map(weight).collect();
        let largest = weights.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
        let passed = weights.iter().rposition(|weight| weight.norm_sqr() > NEGLIGIBLE * NEGLIGIBLE * largest);
        weights.truncate(passed.map_or(0, |last| last + 1));
        let mut fourier = Fourier::new(angles);
        let mut of_kind = |harmonics: &dyn Fn(&Section) -> Vec<Complex64>| -> Vec<Vec<f64>> {
            let each = self.sections.iter().enumerate().map(|(place, section)| {
                let mut profile_um = over_angles(&harmonics(section), &weights, &mut fourier);
                blank(place, &mut profile_um);
                profile_um
            });
            each.collect()
        };
        let undisturbed_um = std::array::from_fn(|kind| match kind {
            FOUND => of_kind(&|section| section.found.clone()),
            PROCESSED => of_kind(&|section| section.processed(&section.found)),
            kind if kind % 2 == 0 => of_kind(&|section| section.forms[kind / 2 - 1].mean.clone()),
            kind => of_kind(&|section| section.processed(&section.forms[kind / 2 - 1].mean)),
        });
        Profiles { draws: self, weights, angles, undisturbed_um }
    }

    /// Two independent draws of the errors of a section, for one of the forms.
    fn errors(&self, sources: &[Source], form: usize) -> Option<[Errors; 2]> {
        let of = |number: u64| {
            let another = |seed: u64| crate::errors::another(seed, 2 * form as u64 + number);
            let errors = Errors::of_sources(sources.iter().map(|(seed, of)| (another(*seed), of.clone())), self.lowest);
            errors.map(|errors| errors.balanced(self.transforms))
        };
        Some([of(0)?, of(1)?])
    }

    /// Factor on the noise of each order in a draw.
    fn wider(&self, form: usize, transform: usize) -> Vec<f64> {
        let orders = self.sections.iter().map(|section| section.found.len()).max().unwrap_or(0);
        let mut factors = vec![1.0; orders];
        for (orders, factor) in self.together.iter().zip(&self.wider[form][transform]) {
            let end = orders.end.min(factors.len());
            factors[orders.start.min(end)..end].fill(*factor);
        }
        factors
    }
}

/// So many draws of what has one factor at most, evenly from many: the first few of them are spread as all are.
fn evenly(mut draw: impl FnMut() -> Vec<f64>) -> Vec<Vec<f64>> {
    let mut many: Vec<Vec<f64>> = (0..TRANSFORMS * OF_EACH).map(|_| draw()).collect();
    many.sort_by(|one, other| one.partial_cmp(other).unwrap_or(std::cmp::Ordering::Equal));
    (0..TRANSFORMS).map(|transform| many[transform * STRIDE % TRANSFORMS * OF_EACH + OF_EACH / 2].clone()).collect()
}

/// A factor on noise, as wide as its variance is badly known from so many squares: one chance for all orders and sections that share it.
pub(crate) fn wider(
    squares: usize,
    chance: Option<&ChiSquared<f64>>,
    variance_from: VarianceFrom,
    random: &mut ChaCha8Rng,
) -> f64 {
    let Some(chance) = chance else { return 1.0 };
    let squares = squares as f64;
    let factor = (squares / chance.sample(random)).sqrt();
    match variance_from {
        // Weights by 1/variance² favour orders whose variance was found too small by as much again.
        VarianceFrom::OrdersBeside => {
            let few = squares.max(FEWEST_SQUARES);
            factor * (few - 2.0) / (few - 4.0)
        }
        VarianceFrom::Readings => factor,
    }
}

/// A profile of weighted orders on the angles of a transform.
fn over_angles(harmonics: &[Complex64], weights: &[Complex64], fourier: &mut Fourier) -> Vec<f64> {
    fourier.synthesise(harmonics.iter().zip(weights).map(|(harmonic, weight)| harmonic * weight)).to_vec()
}

/// Noise of one section: harmonics as measured again, and what it adds over the angles to the true profile and to the processed one, each with its
/// largest.
#[derive(Default)]
struct Drawn {
    truth: Vec<Complex64>,
    again: Vec<Complex64>,
    over_angles: [(Vec<f64>, f64); 2],
}

const TRUTH: usize = 0;
const AGAIN: usize = 1;

impl Drawn {
    fn turned(&self, which: usize, from: usize) -> DrawnErrors<'_> {
        let (noise_um, largest_um) = &self.over_angles[which];
        DrawnErrors::turned(noise_um, from, *largest_um)
    }
}

impl Profiles<'_> {
    /// Those of one kind, one a section, without noise.
    #[must_use]
    pub fn undisturbed_um(&self, kind: usize) -> &[Vec<f64>] {
        &self.undisturbed_um[kind]
    }

    /// What is known of values: `look` adds the same ones, of any number, of the profiles of a kind, first of all undisturbed, then with noise of
    /// each section.
    pub fn values(&self, mut look: impl FnMut(usize, Option<&[DrawnErrors]>, &mut Vec<f64>)) -> Vec<Interval> {
        let mut undisturbed: Vec<Vec<f64>> = vec![Vec::new(); KINDS];
        undisturbed.iter_mut().enumerate().for_each(|(kind, found)| look(kind, None, found));
        let [found, processed] = [FOUND, PROCESSED].map(|kind| std::mem::take(&mut undisturbed[kind]));
        let mut sides: Vec<[Sides; FORMS]> = found.iter().map(|_| Default::default()).collect();
        let mut values = |kind: usize, noise: &[DrawnErrors], found: &mut Vec<f64>| {
            found.clear();
            look(kind, Some(noise), found);
        };
        let mut of_again = Vec::new();
        for form in 0..FORMS {
            let kind = 2 + 2 * form;
            let mut of_truth = std::mem::take(&mut undisturbed[kind]);
            self.draw(form, |truth, again| {
                if let Some(truth) = truth {
                    values(kind, truth, &mut of_truth);
                }
                values(kind + 1, again, &mut of_again);
                for (sides, (truth, again)) in sides.iter_mut().zip(of_truth.iter().zip(&of_again)) {
                    sides[form].add(*truth, *again);
                }
            });
        }
        let all = found.into_iter().zip(processed).zip(sides);
        let refuted = self.draws.sections.iter().any(|section| section.refutes_noise);
        all.map(|((found, processed), sides)| Interval::of(found, processed, sides, refuted)).collect()
    }

    /// Intervals of values of one whole profile: `look` adds the values of a profile, first undisturbed, then with noise.
    pub fn values_of_section(&self, mut look: impl FnMut(&[f64], &mut Vec<f64>)) -> Vec<Interval> {
        let mut whole = Vec::with_capacity(self.angles);
        self.values(|kind, noise, found| {
            let undisturbed = &self.undisturbed_um[kind][0];
            match noise {
                Some(noise) => {
                    noise[0].added_to(undisturbed, &mut whole);
                    look(&whole, found);
                }
                None => look(undisturbed, found),
            }
        })
    }

    /// Noise of all sections, of true profiles where the form is drawn and of those measured again, draw by draw.
    fn draw(&self, form: usize, mut next: impl FnMut(Option<&[DrawnErrors]>, &[DrawnErrors])) {
        let Self { draws, angles, .. } = *self;
        let sections = &draws.sections;
        let mut fourier = Fourier::new(angles);
        let Some(mut sources) = draws.sources.iter().map(|of| draws.errors(of, form)).collect::<Option<Vec<_>>>()
        else {
            return;
        };
        let marks_um: Vec<Vec<Vec<f64>>> =
            sections.iter().map(|section| self.beside_waves(section, &mut fourier)).collect();
        let mut with_marks: Vec<Vec<f64>> = vec![Vec::new(); sections.len()];
        let mut drawn: Vec<Drawn> = sections.iter().map(|_| Drawn::default()).collect();
        for transform in 0..draws.transforms {
            let wider = draws.wider(form, transform);
            for ((section, errors), drawn) in sections.iter().zip(&mut sources).zip(&mut drawn) {
                self.noise(section, section.forms[form].spread.as_deref(), errors, &wider, &mut fourier, drawn);
            }
            for turn in 0..TURNS {
                // By the golden section, so that neither places nor phases of low orders come again.
                let from = ((GOLDEN * (TURNS * transform + turn) as f64).fract() * angles as f64) as usize;
                for ((drawn, section), (marks_um, sum)) in
                    drawn.iter().zip(sections).zip(marks_um.iter().zip(&mut with_marks))
                {
                    sum.clear();
                    if section.marks.all.is_empty() {
                        continue;
                    }
                    let step = Complex64::cis(TAU * from as f64 / angles as f64);
                    let each = drawn.again.iter().scan(Complex64::ONE, |turn, noise| {
                        let turned = noise * *turn;
                        *turn *= step;
                        Some(turned)
                    });
                    let heights = section.marks.heights(&each.collect::<Vec<_>>());
                    for (height, mark_um) in heights.iter().zip(marks_um) {
                        if sum.is_empty() {
                            sum.extend(drawn.turned(AGAIN, from).iter());
                        }
                        sum.iter_mut().zip(mark_um).for_each(|(noise, mark)| *noise += height * mark);
                    }
                }
                let is_drawn = sections.iter().any(|section| section.forms[form].spread.is_some());
                let truth: Option<Vec<DrawnErrors>> =
                    is_drawn.then(|| drawn.iter().map(|drawn| drawn.turned(TRUTH, from)).collect());
                let again = drawn.iter().zip(&with_marks);
                let again: Vec<DrawnErrors> = again
                    .map(|(drawn, sum)| if sum.is_empty() { drawn.turned(AGAIN, from) } else { DrawnErrors::new(sum) })
                    .collect();
                next(truth.as_deref(), &again);
            }
        }
    }

    /// What the processing keeps of each mark of height 1 beyond what it keeps of waves.
    fn beside_waves(&self, section: &Section, fourier: &mut Fourier) -> Vec<Vec<f64>> {
        let each = section.marks.all.iter().map(|mark| {
            let beside: Vec<Complex64> =
                mark.shape.iter().zip(&section.kept).map(|(shape, kept)| shape * (1.0 - kept)).collect();
            over_angles(&beside, &self.weights, fourier)
        });
        each.collect()
    }

    /// One draw of the noise of a section: of the true profile the share `spread` of each order, where it is drawn.
    fn noise(
        &self,
        section: &Section,
        spread: Option<&[f64]>,
        [of_form, of_measurement]: &mut [Errors; 2],
        wider: &[f64],
        fourier: &mut Fourier,
        drawn: &mut Drawn,
    ) {
        let Drawn { truth, again, over_angles: [of_truth, of_again] } = drawn;
        of_measurement.harmonics(again);
        // Above, marks alone see noise.
        let seen = if section.marks.all.is_empty() { self.weights.len() } else { section.kept.len() };
        again.truncate(seen);
        again.iter_mut().zip(wider).for_each(|(again, wider)| *again *= wider);
        if let Some(spread) = spread {
            of_form.harmonics(truth);
            truth.truncate(seen);
            for ((truth, again), (spread, wider)) in
                truth.iter_mut().zip(again.iter_mut()).zip(spread.iter().zip(wider))
            {
                *truth *= spread * wider;
                *again += *truth;
            }
            let weighted = truth.iter().zip(&self.weights).map(|(noise, weight)| noise * weight);
            fourier.synthesise_into(weighted, &mut of_truth.0);
            of_truth.1 = largest(&of_truth.0);
        }
        let kept = again.iter().zip(&section.kept).zip(&self.weights);
        fourier.synthesise_into(kept.map(|((noise, kept), weight)| noise * weight * *kept), &mut of_again.0);
        of_again.1 = largest(&of_again.0);
    }
}
