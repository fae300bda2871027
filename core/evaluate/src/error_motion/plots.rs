//! Plots of error motion: the polar plot of all turns, and the spectrum of what repeats and what does not.

use super::{
    CENTRE, ErrorMotion,
    polar::{Synchronous, seen_from},
    turns::directions,
};
use runout_numerics::Complex64;
use runout_standards::roundness::{Angles, Points};
use runout_turning::{
    profile::Profile,
    spread::{Direction, Spread},
};

/// All turns in one sensitive direction, about the least-squares centre of the synchronous plot, in µm or µrad.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnsPlot {
    /// The direction as symbols name it: `radial-x`.
    pub direction: String,
    /// Whether it is one of tilt, in µrad.
    pub is_tilt: bool,
    /// Synchronous error motion on equal angles of the spindle from 0.
    pub synchronous: Vec<f64>,
    /// The lowest of all turns around each of these angles.
    pub lowest: Vec<f64>,
    /// The highest of all turns around each of these angles.
    pub highest: Vec<f64>,
}

/// Amplitudes by order from 1 in one fixed sensitive direction, in µm or µrad.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// The direction as symbols name it: `radial-x`.
    pub direction: String,
    /// Whether it is one of tilt, in µrad.
    pub is_tilt: bool,
    /// Mean speed, where it is known.
    pub speed_rpm: Option<f64>,
    /// Amplitude of synchronous error motion; NaN where the order is lost, and at order 1, which holds the centring.
    pub synchronous: Vec<f64>,
    /// Root mean square amplitude of single turns about their mean, with the sensors' noise: √E|δ|² of a turn's coefficient.
    pub asynchronous: Vec<f64>,
}

impl ErrorMotion<'_> {
    /// The polar plot of every radial and tilt direction that is observable, on at most so many angles: of more, the lowest and the
    /// highest turn are those of each stretch. None without a spread over turns.
    #[must_use]
    pub fn plots(&self, most_angles: usize) -> Vec<TurnsPlot> {
        let spreads = self.spreads();
        let plot = |direction: &Direction| self.plot(*direction, &spreads, most_angles.max(1));
        directions(&spreads).iter().filter(|direction| !direction.is_axial()).filter_map(plot).collect()
    }

    fn plot(&self, direction: Direction, spreads: &[&Spread], most_angles: usize) -> Option<TurnsPlot> {
        let synchronous = self.synchronous_plot(direction, spreads)?;
        let told = || spreads.iter().filter_map(|spread| Some((spread, spread.in_direction(direction)?)));
        let count = told().next()?.0.angles;
        let angles = Angles::equal(count);
        let drawn = synchronous.over_angle(&angles);
        let seen = seen_from(CENTRE.of(&angles, &drawn, &mut Points::default())?, &angles, &drawn);
        let stretch = count.div_ceil(most_angles);
        let mut plot = TurnsPlot {
            direction: self.id(direction),
            is_tilt: direction.is_tilt(),
            synchronous: seen.iter().step_by(stretch).copied().collect(),
            lowest: Vec::new(),
            highest: Vec::new(),
        };
        for from in (0..count).step_by(stretch) {
            let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
            for (_, (low, high)) in told().filter(|(spread, _)| spread.angles == count) {
                for angle in from..(from + stretch).min(count) {
                    lowest = lowest.min(seen[angle] + low[angle]);
                    highest = highest.max(seen[angle] + high[angle]);
                }
            }
            plot.lowest.push(lowest);
            plot.highest.push(highest);
        }
        Some(plot)
    }

    /// The spectrum in every fixed direction that is observable, up to this order. None without a spread over turns.
    #[must_use]
    pub fn spectra(&self, highest_order: usize) -> Vec<Spectrum> {
        let spreads = self.spreads();
        let fixed = directions(&spreads).into_iter().filter(|direction| !direction.is_axial() && !direction.rotates());
        fixed.filter_map(|direction| self.spectrum(direction, &spreads, highest_order)).collect()
    }

    fn spectrum(&self, direction: Direction, spreads: &[&Spread], highest_order: usize) -> Option<Spectrum> {
        let synchronous = self.synchronous_plot(direction, spreads)?;
        let highest = highest_order.min(self.separation.max_order());
        let amplitude = |order: usize| {
            let counts = order >= synchronous.band[0] && synchronous.lost.binary_search(&order).is_err();
            synchronous.harmonic(order).filter(|_| counts).map_or(f64::NAN, Complex64::norm)
        };
        let speeds: Vec<f64> = self.profiles.iter().filter_map(|profile| profile.speed_rpm).collect();
        Some(Spectrum {
            direction: self.id(direction),
            is_tilt: direction.is_tilt(),
            speed_rpm: (!speeds.is_empty()).then(|| speeds.iter().sum::<f64>() / speeds.len() as f64),
            synchronous: (1..=highest).map(amplitude).collect(),
            asynchronous: (1..=highest).map(|order| self.of_single_turns(direction, order)).collect(),
        })
    }

    /// √E|δ|² of a single turn's coefficient, over the setups that give the direction; NaN where none does.
    fn of_single_turns(&self, direction: Direction, order: usize) -> f64 {
        let variances = self.profiles.iter().filter_map(|profile| variance(profile, direction, order));
        let (sum, count) = variances.fold((0.0, 0.0), |(sum, count), variance| (sum + variance, count + 1.0));
        (sum / count).sqrt()
    }

    fn spreads(&self) -> Vec<&Spread> {
        self.profiles.iter().filter_map(|profile| profile.spread.as_ref()).collect()
    }

    fn synchronous_plot(&self, direction: Direction, spreads: &[&Spread]) -> Option<Synchronous> {
        let projection = &spreads.first()?.projection;
        let z_mm = projection.z_mm + self.z_mm;
        Synchronous::new(self.separation, projection, direction, z_mm).filter(|plot| !plot.is_lost())
    }
}

/// Variance E|δ|² of a single turn's coefficient in a direction.
fn variance(profile: &Profile, direction: Direction, order: usize) -> Option<f64> {
    let (quantity, _) = direction.parts();
    let (_, weights) = profile.spread.as_ref()?.projection.rows.iter().find(|(known, _)| *known == quantity)?;
    let channels = profile.channels();
    let scatter = profile.scatter.as_ref()?.get(order * channels * channels..(order + 1) * channels * channels)?;
    let channel = |sensor: &usize| profile.sensors.iter().position(|known| known == sensor);
    let mut sum = 0.0;
    for (one, weight) in weights {
        for (other, factor) in weights {
            sum += weight * factor * scatter[channel(one)? * channels + channel(other)?].re;
        }
    }
    Some((profile.turns.used as f64 * sum).max(0.0))
}
