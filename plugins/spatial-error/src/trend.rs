//! Standard uncertainty of the trend where covariances are estimated.
//!
//! A field whose range is near the extent of the measured volume looks like placement in part, and how large it is there is known to
//! a factor only: the likelihood is skew, and a step of one standard deviation to both sides does not show its tail. So covariances
//! of each field are drawn about the estimate of each likely family, and weighted by restricted likelihood and prior, one field after
//! the other given the others (Gibbs sampling; Geman, Geman, IEEE Trans. Pattern Anal. Mach. Intell. 6 (1984) 721). The variance of the
//! trend is the mean of those given each covariance and of the squared distance from the stated trend (law of total variance).

use nalgebra::{DVector, SymmetricEigen};
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::{
    campaign::Campaign,
    families::{Guess, likely},
    joint::{Data, Field, Joint, Sums},
    likelihood::{PARAMETERS, Prior, covariances},
    solve::{Solution, prior},
};

/// Places at random that the draws take at most: how far the uncertainty grows depends on them little.
const MOST_PLACES: usize = 180;
/// Covariances drawn of each field and family.
const DRAWS: usize = 160;
/// Passes over the fields, and the first ones, which only find likely draws.
const PASSES: [usize; 2] = [24, 6];
/// Spreads of the draws, in turn, in standard deviations of the estimate: wider, so that tails are drawn too.
const SPREADS: [f64; 2] = [1.2, 2.4];
/// Precision of the usual ranges as a share of that of the estimate: where ranges are longer than the volume, no reading shows it.
const RANGES: f64 = 0.3;

/// Draws of one field's covariance: sums, and ln of prior over density of the draw.
type Draws = Vec<(Sums, f64)>;

impl Solution {
    /// Standard uncertainty of each column of the trend, with what is not known of estimated covariances.
    #[must_use]
    pub(crate) fn trend_std(&self, campaign: &Campaign) -> Vec<f64> {
        let plain = self.joint.trend_covariance.diagonal();
        let factor = self.growth(campaign).unwrap_or_else(|| DVector::from_element(plain.len(), 1.0));
        plain.iter().zip(&factor).map(|(variance, factor)| (variance * factor).sqrt()).collect()
    }

    /// Factor of the variance of each column.
    fn growth(&self, campaign: &Campaign) -> Option<DVector<f64>> {
        if self.guesses.is_empty() || self.terms.is_empty() {
            return None;
        }
        let count = campaign.places_mm.len();
        let some = (count > MOST_PLACES).then(|| {
            let mut order: Vec<usize> = (0..count).collect();
            order.shuffle(&mut ChaCha8Rng::seed_from_u64(3));
            order.truncate(MOST_PLACES);
            order
        });
        let data = campaign.data(&self.terms, some.as_deref());
        let stated = Joint::new(&data, &self.covariances)?;
        let mut prior = prior(campaign, &data);
        let ranges = (0..prior.precision.len()).filter(|index| (1..4).contains(&(index % PARAMETERS)));
        ranges.for_each(|index| prior.precision[index] *= RANGES);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let of_field = |(field, guesses): (usize, &Vec<Guess>)| {
            let own = prior.of(field);
            likely(guesses).into_iter().flat_map(|(guess, _)| draws(&data, &own, guess, field, &mut random)).collect()
        };
        let fields: Vec<Draws> = self.guesses.iter().enumerate().map(of_field).collect();
        let variance = mean_variance(&data, &fields, &stated.trend, &mut random)?;
        let growth = variance.component_div(&stated.trend_covariance.diagonal());
        growth.iter().all(|factor| factor.is_finite()).then(|| growth.map(|factor| factor.max(1.0)))
    }
}

/// Mean over likely covariances of the variance of the trend and of its squared distance from the stated one.
fn mean_variance(
    data: &Data,
    fields: &[Draws],
    stated: &DVector<f64>,
    random: &mut ChaCha8Rng,
) -> Option<DVector<f64>> {
    let mut chosen = vec![0; fields.len()];
    let mut sum = DVector::<f64>::zeros(stated.len());
    let mut count = 0.0;
    for pass in 0..PASSES[0] {
        for field in 0..fields.len() {
            let mut others = Sums::within(data);
            for (other, draws) in fields.iter().enumerate().filter(|(other, _)| *other != field) {
                others.add(&draws.get(chosen[other])?.0);
            }
            let given: Vec<(f64, DVector<f64>)> = fields[field]
                .iter()
                .map(|(own, ln)| {
                    let mut sums = others.clone();
                    sums.add(own);
                    let Some((trend, covariance, ln_likelihood)) = sums.trend() else {
                        return (f64::NEG_INFINITY, DVector::zeros(stated.len()));
                    };
                    let apart = trend - stated;
                    (ln + ln_likelihood, covariance.diagonal() + apart.component_mul(&apart))
                })
                .collect();
            let most = given.iter().map(|(ln, _)| *ln).fold(f64::NEG_INFINITY, f64::max);
            let weights: Vec<f64> = given.iter().map(|(ln, _)| (ln - most).exp()).collect();
            let total: f64 = weights.iter().sum();
            if !(total.is_finite() && total > 0.0) {
                return None;
            }
            if pass >= PASSES[1] {
                given.iter().zip(&weights).for_each(|((_, variance), weight)| sum += variance * (weight / total));
                count += 1.0;
            }
            let mut left = total * random.random::<f64>();
            chosen[field] = weights.iter().position(|weight| {
                left -= weight;
                left <= 0.0
            })?;
        }
    }
    Some(sum / count)
}

fn draws(data: &Data, prior: &Prior, guess: &Guess, field: usize, random: &mut ChaCha8Rng) -> Draws {
    let directions = SymmetricEigen::new(guess.covariance.clone());
    let sizes = directions.eigenvalues.map(|value| value.max(0.0).sqrt());
    let free = sizes.iter().filter(|size| **size > 0.0).count();
    let ln_size: f64 = sizes.iter().filter(|size| **size > 0.0).map(|size| size.ln()).sum();
    let one = |index: usize| {
        let spread = SPREADS[index % SPREADS.len()];
        let draw =
            |place: usize| if sizes[place] > 0.0 { spread * random.sample::<f64, _>(StandardNormal) } else { 0.0 };
        let moved = DVector::from_iterator(PARAMETERS, (0..PARAMETERS).map(draw));
        let at = &guess.parameters + &directions.eigenvectors * moved.component_mul(&sizes);
        let covariance = covariances(&[guess.family], &at).first().copied()?;
        let (_, _, sums) = Field::new(data, field, &covariance)?;
        // Density of the mixture of all spreads.
        let square = moved.norm_squared();
        let parts = SPREADS.map(|spread| (-0.5 * square / (spread * spread)).exp() / spread.powf(free as f64));
        Some((sums, prior.ln(&at) - parts.iter().sum::<f64>().ln() + ln_size))
    };
    (0..DRAWS).filter_map(one).collect()
}
