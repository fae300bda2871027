//! Open profiles: errors at positions along a line, and what they do to values.
//!
//! A parabola and the line through both ends are taken out, so that the profile closes on itself: its forms are then those of a closed one. No noise is taken out of
//! what is evaluated, as it is of closed profiles: where the ends meet, that would round them off (STRp at an end was then too small, its interval right in 86 %).
//! Errors are drawn at the positions, where they may differ in size, depend on each other and have common changes.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use runout_numerics::{
    Complex64,
    fourier::Fourier,
    least_squares::Basis,
    moderated::{Moderated, moderated},
};

use crate::{
    interval::{Interval, Sides},
    profiles::wider,
    section::{FORMS, Form, Measured, Section},
    spectrum::VarianceFrom,
};

/// Draws of each form, and the fewest of a long profile: all of them together evaluate about so many points.
const DRAWS: usize = 100;
const FEWEST_DRAWS: usize = 50;
const POINTS_DRAWN: usize = 4_000_000;
/// Share of the positions at each end whose mean is the place of the line that is taken out.
const END: usize = 50;
/// A bow is certain as far as it is above so many of its standard deviations, which so many pairs of draws show.
const BOW: f64 = 3.0;
const DRAWS_OF_BOW: usize = 20;
/// Share of the mean power of correlated noise that each wave of it has at least: a correlation that is cut off may have a spectrum below 0.
const LEAST_POWER: f64 = 1e-3;

/// What the errors of a profile on positions along a line are. A covariance: diagonal · correlation · diagonal, and whole-profile changes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenErrors {
    /// Standard deviation at each position, in µm, but for `common_um`.
    pub std_um: Vec<f64>,
    /// Degrees of freedom behind the standard deviation at one position; 0 where it is taken as exact.
    pub freedom: f64,
    /// Correlation of these errors over 0, 1, … positions, none beyond its end; empty where they are independent.
    pub correlation: Vec<f64>,
    /// Changes of the whole profile, in µm at each position, each with a factor of its own of standard deviation 1.
    pub common_um: Vec<Vec<f64>>,
}

impl OpenErrors {
    /// Whether there is a number at each of so many positions.
    #[must_use]
    pub fn are_known(&self, positions: usize) -> bool {
        let known = |values: &Vec<f64>| values.len() == positions && values.iter().all(|value| value.is_finite());
        positions > 1 && known(&self.std_um) && self.common_um.iter().all(known)
    }

    /// Mean of the variances at the positions.
    #[must_use]
    pub fn mean_square_um2(&self) -> f64 {
        let of_common = self.common_um.iter().flatten().map(|change| change * change).sum::<f64>();
        (self.std_um.iter().map(|std| std * std).sum::<f64>() + of_common) / self.std_um.len() as f64
    }

    /// What is known of values of a profile, at equal distances or nearly so; `look` adds the same ones, of any number, of a profile. `None`
    /// where the errors are not known at all of its positions, or are all 0.
    #[must_use]
    pub fn values(
        &self,
        profile_um: &[f64],
        seed: u64,
        mut look: impl FnMut(&[f64], &mut Vec<f64>),
    ) -> Option<Vec<Interval>> {
        if !self.are_known(profile_um.len()) {
            return None;
        }
        let mut closing = Closing::of(profile_um)?;
        let mut errors = ErrorDraws::of(self, seed);
        let Closed { taken_um, harmonics, bow_um } = closing.closed(profile_um);
        let uncertain_um = self.uncertain_bow_um(bow_um, seed, &mut closing);
        let certain_um = closing.less_bow(&taken_um, uncertain_um);
        let variance = errors.variance(&mut closing);
        if variance.iter().skip(1).all(|variance| *variance <= 0.0) {
            return None;
        }
        let squares = vec![errors.squares; variance.len()];
        let section = Section::of(
            &Measured { harmonics, variance, squares, variance_from: VarianceFrom::Readings, lowest: 1 },
            false,
        );
        let mut found = Vec::new();
        look(profile_um, &mut found);
        let mut sides: Vec<[Sides; FORMS]> = found.iter().map(|_| Default::default()).collect();
        let draws = (POINTS_DRAWN / (4 * profile_um.len())).clamp(FEWEST_DRAWS, DRAWS);
        let [mut of_truth, mut of_again] = [Vec::new(), Vec::new()];
        for (form, Form { mean, spread }) in section.forms.iter().enumerate() {
            let taken_um = if spread.is_some() { &taken_um } else { &certain_um };
            let mut drawn = Closed { taken_um: taken_um.clone(), harmonics: mean.clone(), bow_um };
            look(&closing.opened(&drawn), emptied(&mut of_truth));
            for _ in 0..draws {
                let [of_form, of_measurement] = errors.next().map(|errors_um| closing.closed(&errors_um));
                if let Some(spread) = spread {
                    let of_orders = of_form.harmonics.iter().zip(spread).map(|(error, spread)| spread * error);
                    drawn.taken_um = sum(taken_um, &of_form.taken_um);
                    drawn.harmonics = sum(mean, &of_orders.collect::<Vec<_>>());
                    look(&closing.opened(&drawn), emptied(&mut of_truth));
                }
                let again = Closed {
                    taken_um: sum(&drawn.taken_um, &of_measurement.taken_um),
                    harmonics: sum(&drawn.harmonics, &of_measurement.harmonics),
                    bow_um,
                };
                look(&closing.opened(&again), emptied(&mut of_again));
                for (sides, (truth, again)) in sides.iter_mut().zip(of_truth.iter().zip(&of_again)) {
                    sides[form].add(*truth, *again);
                }
            }
        }
        let refuted = section.refutes_noise;
        Some(found.into_iter().zip(sides).map(|(found, sides)| Interval::of(found, found, sides, refuted)).collect())
    }

    /// What noise may have made of a bow.
    fn uncertain_bow_um(&self, bow_um: f64, seed: u64, closing: &mut Closing) -> f64 {
        let mut errors = ErrorDraws::of(self, crate::errors::another(seed, 0));
        let each = (0..DRAWS_OF_BOW).flat_map(|_| errors.next().map(|errors_um| closing.closed(&errors_um).bow_um));
        let std_um = (each.map(|bow_um| bow_um * bow_um).sum::<f64>() / (2 * DRAWS_OF_BOW) as f64).sqrt();
        bow_um.clamp(-BOW * std_um, BOW * std_um)
    }

    /// Power of the correlated errors of variance 1 at a phase step per position, in that of independent ones.
    fn power(&self, step: f64) -> f64 {
        let beside = self.correlation.iter().enumerate().skip(1);
        (1.0 + 2.0 * beside.map(|(lag, share)| share * (step * lag as f64).cos()).sum::<f64>()).max(LEAST_POWER)
    }
}

fn emptied(found: &mut Vec<f64>) -> &mut Vec<f64> {
    found.clear();
    found
}

fn sum<T: Copy + std::ops::Add<Output = T>>(one: &[T], other: &[T]) -> Vec<T> {
    one.iter().zip(other).map(|(one, other)| *one + *other).collect()
}

/// A profile as the part that does not close on itself, and harmonics of the rest.
struct Closed {
    taken_um: Vec<f64>,
    harmonics: Vec<Complex64>,
    /// Of the part that does not close, the square of the place from −1 to 1.
    bow_um: f64,
}

/// Makes profiles close on themselves: the parabola that fits best is taken out, and of the rest the line through its ends. Linear in the
/// profile, so that it is done to errors alike.
struct Closing {
    /// Positions with a reading, and all of them from −1 to 1.
    there: Vec<usize>,
    places: Vec<f64>,
    powers: Basis,
    fourier: Fourier,
}

impl Closing {
    /// `None` where there are fewer than three readings.
    fn of(profile_um: &[f64]) -> Option<Self> {
        let count = profile_um.len();
        let there: Vec<usize> = (0..count).filter(|at| profile_um[*at].is_finite()).collect();
        if there.len() < 3 {
            return None;
        }
        let middle = 0.5 * (count - 1) as f64;
        let places: Vec<f64> = (0..count).map(|at| (at as f64 - middle) / middle).collect();
        let column = |power: i32| there.iter().map(|at| places[*at].powi(power)).collect::<Vec<f64>>();
        let powers = Basis::of((0..3).map(column).collect());
        Some(Self { there, places, powers, fourier: Fourier::new(count) })
    }

    fn orders(&self) -> usize {
        self.fourier.max_order() + 1
    }

    fn closed(&mut self, profile_um: &[f64]) -> Closed {
        let values: Vec<f64> = self.there.iter().map(|at| profile_um[*at]).collect();
        let parabola = self.powers.coefficients(&values);
        let of = |place: f64| parabola.iter().rev().fold(0.0, |sum, coefficient| sum * place + coefficient);
        let each = (self.there.len() / END).max(1);
        let mean = |of_end: &[usize]| {
            let left = of_end.iter().map(|at| profile_um[*at] - of(self.places[*at])).sum::<f64>();
            [of_end.iter().map(|at| self.places[*at]).sum::<f64>(), left].map(|sum| sum / of_end.len() as f64)
        };
        let [[first, low], [last, high]] = [mean(&self.there[..each]), mean(&self.there[self.there.len() - each..])];
        let slope = (high - low) / (last - first);
        let taken_um: Vec<f64> = self.places.iter().map(|place| of(*place) + low + slope * (place - first)).collect();
        let mut rest: Vec<f64> = profile_um.iter().zip(&taken_um).map(|(value, taken)| value - taken).collect();
        self.bridge(&mut rest);
        let harmonics = self.transformed(&rest);
        Closed { taken_um, harmonics, bow_um: parabola[2] }
    }

    fn less_bow(&self, taken_um: &[f64], bow_um: f64) -> Vec<f64> {
        taken_um.iter().zip(&self.places).map(|(taken, place)| taken - bow_um * place * place).collect()
    }

    /// Straight lines across positions without a reading.
    fn bridge(&self, rest: &mut [f64]) {
        let (first, last) = (self.there[0], self.there[self.there.len() - 1]);
        let (at_first, at_last) = (rest[first], rest[last]);
        rest[..first].fill(at_first);
        rest[last + 1..].fill(at_last);
        for pair in self.there.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let (low, high) = (rest[from], rest[to]);
            for at in from + 1..to {
                rest[at] = low + (high - low) * (at - from) as f64 / (to - from) as f64;
            }
        }
    }

    fn transformed(&mut self, values: &[f64]) -> Vec<Complex64> {
        let mut harmonics = vec![Complex64::ZERO; self.orders()];
        self.fourier.analyse(values.iter().copied(), &mut harmonics);
        harmonics
    }

    /// The open profile; NaN where there is no reading.
    fn opened(&mut self, closed: &Closed) -> Vec<f64> {
        let rest = self.fourier.synthesise(closed.harmonics.iter().copied());
        let mut open = vec![f64::NAN; self.places.len()];
        self.there.iter().for_each(|at| open[*at] = rest[*at] + closed.taken_um[*at]);
        open
    }
}

/// Draws of the errors at the positions.
struct ErrorDraws<'a> {
    errors: &'a OpenErrors,
    /// Standard deviations, [moderated](runout_numerics::moderated), and the squares that each is known from (0: exactly).
    std_um: Vec<f64>,
    squares: usize,
    chance: Option<ChiSquared<f64>>,
    random: ChaCha8Rng,
    /// Transform of a turn that holds the profile and the reach of the correlation, with the amplitude of each order; none of
    /// independent errors.
    correlated: Option<(Fourier, Vec<f64>)>,
}

impl<'a> ErrorDraws<'a> {
    fn of(errors: &'a OpenErrors, seed: u64) -> Self {
        let count = errors.std_um.len();
        let variance: Vec<f64> = errors.std_um.iter().map(|std| std * std).collect();
        let Moderated { variance, freedom } = moderated(&variance, errors.freedom);
        let squares = if freedom.is_finite() { freedom.round() as usize } else { 0 };
        let correlated = (errors.correlation.len() > 1).then(|| {
            let length = (count + errors.correlation.len()).next_power_of_two();
            let fourier = Fourier::new(length);
            let step = TAU / length as f64;
            let power: Vec<f64> = (0..=fourier.max_order()).map(|order| errors.power(step * order as f64)).collect();
            // Re Σ c e^{inα} has the variance ½ Σ E|c|², and of order 0 its own.
            let all: f64 = power.iter().skip(1).sum::<f64>() + 0.5 * power[0];
            let amplitudes = power.iter().map(|power| (power / all).sqrt()).collect();
            (fourier, amplitudes)
        });
        Self {
            errors,
            std_um: variance.iter().map(|variance| variance.sqrt()).collect(),
            squares,
            chance: ChiSquared::new(squares as f64).ok(),
            random: ChaCha8Rng::seed_from_u64(seed),
            correlated,
        }
    }

    /// E|e|² of each order.
    fn variance(&self, closing: &mut Closing) -> Vec<f64> {
        let count = self.std_um.len() as f64;
        let mean = self.std_um.iter().map(|std| std * std).sum::<f64>() / count;
        let changes: Vec<Vec<Complex64>> =
            self.errors.common_um.iter().map(|change| closing.transformed(change)).collect();
        let of_order = |order: usize| {
            let own = 4.0 * mean / count * self.errors.power(TAU * order as f64 / count);
            own + changes.iter().map(|change| change[order].norm_sqr()).sum::<f64>()
        };
        (0..closing.orders()).map(of_order).collect()
    }

    /// Errors of two draws, of which the standard deviations are off alike.
    fn next(&mut self) -> [Vec<f64>; 2] {
        let factor = wider(self.squares, self.chance.as_ref(), VarianceFrom::Readings, &mut self.random);
        [(); 2].map(|()| {
            let mut errors_um = self.numbers();
            errors_um.iter_mut().zip(&self.std_um).for_each(|(error, std)| *error *= factor * std);
            for change in &self.errors.common_um {
                let size: f64 = StandardNormal.sample(&mut self.random);
                errors_um.iter_mut().zip(change).for_each(|(error, change)| *error += size * change);
            }
            errors_um
        })
    }

    /// Numbers of variance 1 at the positions, correlated as the errors are.
    fn numbers(&mut self) -> Vec<f64> {
        let Self { random, correlated, std_um, .. } = self;
        let mut normal = || -> f64 { StandardNormal.sample(&mut *random) };
        match correlated {
            None => std_um.iter().map(|_| normal()).collect(),
            Some((fourier, amplitudes)) => {
                let waves = amplitudes.iter().enumerate().map(|(order, amplitude)| {
                    let part = if order == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
                    part * amplitude * Complex64::new(normal(), normal())
                });
                fourier.synthesise(waves)[..std_um.len()].to_vec()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(draws: &[Vec<f64>], lag: usize) -> f64 {
        let pairs = draws.iter().flat_map(|one| one.iter().zip(&one[lag..]));
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), (a, b)| (sum + a * b, count + 1.0));
        sum / count
    }

    #[test]
    fn drawn_numbers_have_their_variance_and_correlation() {
        for correlation in [vec![], vec![1.0, 0.6, 0.2]] {
            let errors = OpenErrors { std_um: vec![1.0; 200], correlation, ..OpenErrors::default() };
            let mut draws = ErrorDraws::of(&errors, 7);
            let all: Vec<Vec<f64>> = (0..400).map(|_| draws.numbers()).collect();
            for lag in 0..5 {
                let expected = if lag == 0 { 1.0 } else { errors.correlation.get(lag).copied().unwrap_or(0.0) };
                // 80 000 products, of which some two are correlated: 0.6 %.
                assert!((spread(&all, lag) - expected).abs() < 0.03, "{lag}: {}", spread(&all, lag));
            }
        }
    }

    #[test]
    fn the_variance_of_orders_is_that_of_draws() {
        let ramp: Vec<f64> = (0..150).map(|at| 0.02 * f64::from(at)).collect();
        let errors = OpenErrors {
            std_um: (0..150).map(|at| 0.5 + f64::from(at) / 150.0).collect(),
            correlation: vec![1.0, 0.5, 0.1],
            common_um: vec![ramp.clone()],
            ..OpenErrors::default()
        };
        let mut draws = ErrorDraws::of(&errors, 3);
        let mut closing = Closing::of(&ramp).unwrap();
        let variance = draws.variance(&mut closing);
        let all: Vec<[Vec<Complex64>; 2]> =
            (0..500).map(|_| draws.next().map(|errors_um| closing.transformed(&errors_um))).collect();
        for (order, expected) in variance.iter().enumerate().skip(1).step_by(13) {
            let found = all.iter().flatten().map(|one| one[order].norm_sqr()).sum::<f64>() / 1000.0;
            // A mean of 1000 squares of complex numbers: 3.2 %.
            assert!((found / expected - 1.0).abs() < 0.13, "{order}: {found} for {expected}");
        }
    }

    #[test]
    fn errors_that_are_not_known_draw_nothing() {
        let known = |errors: OpenErrors| errors.values(&[1.0, 2.0, 3.0], 1, |profile, found| found.push(profile[0]));
        assert!(known(OpenErrors { std_um: vec![0.1; 3], ..OpenErrors::default() }).is_some());
        assert!(known(OpenErrors { std_um: vec![0.1, f64::NAN, 0.1], ..OpenErrors::default() }).is_none());
        assert!(known(OpenErrors { std_um: vec![0.1; 2], ..OpenErrors::default() }).is_none());
        assert!(known(OpenErrors { std_um: vec![0.0; 3], ..OpenErrors::default() }).is_none());
    }
}
