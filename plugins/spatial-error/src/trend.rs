//! Standard uncertainty of the trend where covariances are estimated.
//!
//! A field whose range is near the extent of the measured volume looks like placement in part, and how large it is there is known to
//! a factor only: the likelihood is skew, and a step of one standard deviation to both sides does not show its tail. So covariances
//! are drawn about the estimate of each family, weighted by restricted likelihood and prior (importance sampling), and the
//! variance of the trend is the mean of those given each draw and of the squared distance from the stated trend (law of total
//! variance).

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::{
    campaign::Campaign,
    joint::{Data, Field, Joint, Sums},
    likelihood::{PARAMETERS, Prior, covariances},
    solve::{Guess, Solution, prior},
};

/// Places at random that the draws take at most: how far the uncertainty grows depends on them little.
const MOST_PLACES: usize = 180;
/// Covariances drawn of each field and family, and combinations of the fields' draws.
const DRAWS: [usize; 2] = [160, 6000];
/// Spreads of the draws, in turn, in standard deviations of the estimate: wider, so that tails are drawn too.
const SPREADS: [f64; 2] = [1.2, 2.4];
/// Families with less ln of the likelihood than the best one by this are left out.
const UNLIKELY: f64 = 7.0;

/// Draws of one field's covariance: sums, and ln of prior over density of the draw.
type Draws = Vec<(Sums, f64)>;

impl Solution {
    /// Standard uncertainty of each column of the trend, with what is not known of estimated covariances.
    #[must_use]
    pub fn trend_std(&self, campaign: &Campaign) -> Vec<f64> {
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
        let prior = prior(campaign, &data);
        let best = self.guesses.iter().map(|guess| guess.ln_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        // ln of the weight, variances, and trend of each combination.
        let mut drawn: Vec<(f64, DVector<f64>, DVector<f64>)> = Vec::new();
        for guess in self.guesses.iter().filter(|guess| guess.ln_likelihood > best - UNLIKELY) {
            let fields: Vec<Draws> =
                (0..self.covariances.len()).map(|field| draws(&data, &prior, guess, field, &mut random)).collect();
            if fields.iter().any(Vec::is_empty) {
                continue;
            }
            for _ in 0..DRAWS[1] {
                let mut sums = Sums::within(&data);
                let mut ln_weight = 0.0;
                for field in &fields {
                    let (of_field, ln) = &field[random.random_range(0..field.len())];
                    sums.add(of_field);
                    ln_weight += ln;
                }
                let Some((trend, covariance, ln_likelihood)) = sums.trend() else { continue };
                drawn.push((ln_weight + ln_likelihood, covariance.diagonal(), trend));
            }
        }
        let most = drawn.iter().map(|(ln, ..)| *ln).fold(f64::NEG_INFINITY, f64::max);
        let mut whole = 0.0;
        let mut variance = DVector::<f64>::zeros(self.terms.len());
        for (ln, given, trend) in &drawn {
            let weight = (ln - most).exp();
            let apart = trend - &stated.trend;
            variance += (given + apart.component_mul(&apart)) * weight;
            whole += weight;
        }
        let ess = whole * whole / drawn.iter().map(|(ln, ..)| (2.0 * (ln - most)).exp()).sum::<f64>();
        eprintln!("DEBUG ess {ess:.0} families {}", drawn.len() as f64 / DRAWS[1] as f64);
        let growth = (variance / whole).component_div(&stated.trend_covariance.diagonal());
        growth.iter().all(|factor| factor.is_finite()).then(|| growth.map(|factor| factor.max(1.0)))
    }
}

fn draws(data: &Data, prior: &Prior, guess: &Guess, field: usize, random: &mut ChaCha8Rng) -> Draws {
    let first = field * PARAMETERS;
    let block: DMatrix<f64> = guess.covariance.view((first, first), (PARAMETERS, PARAMETERS)).into_owned();
    let directions = SymmetricEigen::new(block);
    let sizes = directions.eigenvalues.map(|value| value.max(0.0).sqrt());
    let free = sizes.iter().filter(|size| **size > 0.0).count();
    let ln_size: f64 = sizes.iter().filter(|size| **size > 0.0).map(|size| size.ln()).sum();
    let centre = guess.parameters.rows(first, PARAMETERS).into_owned();
    let one = |index: usize| {
        let spread = SPREADS[index % SPREADS.len()];
        let draw = |place: usize| if sizes[place] > 0.0 { spread * random.sample::<f64, _>(StandardNormal) } else { 0.0 };
        let moved = DVector::from_iterator(PARAMETERS, (0..PARAMETERS).map(draw));
        let at = &centre + &directions.eigenvectors * moved.component_mul(&sizes);
        let covariance = covariances(guess.family, &at).first().copied()?;
        let (_, _, sums) = Field::new(data, field, &covariance)?;
        // Density of the mixture of all spreads.
        let square = moved.norm_squared();
        let parts = SPREADS.map(|spread| (-0.5 * square / (spread * spread)).exp() / spread.powi(free as i32));
        Some((sums, prior.ln_of(field, &at) - parts.iter().sum::<f64>().ln() + ln_size))
    };
    (0..DRAWS[0]).filter_map(one).collect()
}
