//! How firmly contacts hold the centre of MICI and MCCI.

use std::f64::consts::TAU;

use super::{Angles, Points, Reference};

/// Contacts nearer to each other than this share of a turn act as one: with the one opposite, they hold the centre along their chord only.
const TOGETHER: f64 = 1.0 / 18.0;
/// The same in steps between angles: the profile touches there between the angles, and its curvature holds the centre.
const STEPS: usize = 2;

/// How firmly contacts hold the centre of a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// By three contacts that are apart.
    Firm,
    /// By two that are nearly opposite, one of them two peaks that are close together.
    Opposite,
    /// By two that are nearly opposite, at each of which the profile bends away: across their chord, the centre is the mean of where the profile's slope
    /// at either contact is 0.
    Bent {
        /// Of independent slopes with the variance 1, that of that mean.
        variance: f64,
        /// How much the profile bends at the flatter contact, in µm/rad².
        bend_um: f64,
    },
}

impl Hold {
    /// Of MICI or MCCI of a profile on equal angles; `None` where there is no such circle, or for another reference.
    #[must_use]
    pub fn of(reference: Reference, angles: &Angles, form_um: &[f64], radius_mm: f64) -> Option<Self> {
        if ![Reference::MaximumInscribed, Reference::MinimumCircumscribed].contains(&reference) {
            return None;
        }
        let mut points = Points::default();
        points.set_profile(angles, form_um, radius_mm);
        let circle = points.reference(reference)?;
        let contacts = [circle.inner, circle.outer].concat();
        let count = form_um.len();
        let apart = |a: usize, b: usize| a.abs_diff(b).min(count - a.abs_diff(b));
        let pairs = || contacts.iter().enumerate().flat_map(|(index, a)| contacts[..index].iter().map(|b| (*a, *b)));
        let nearest = pairs().map(|(a, b)| apart(a, b)).min()?;
        if contacts.len() > 2 && nearest as f64 > TOGETHER * count as f64 {
            return Some(Self::Firm);
        }
        if contacts.len() > 2 && nearest > STEPS {
            return Some(Self::Opposite);
        }
        let (one, opposite) = pairs().max_by_key(|(a, b)| apart(*a, *b))?;
        let step = TAU / count as f64;
        // The flatter the profile, the farther does a slope move the contact, and the centre with it.
        let flatness = |place: usize| {
            let at = |by: usize| form_um[(place + by) % count];
            let bend = (at(count - 1) - 2.0 * at(0) + at(1)).abs() / (step * step);
            bend.max(f64::MIN_POSITIVE).recip()
        };
        let [one, opposite] = [one, opposite].map(flatness);
        let sum = one + opposite;
        let variance = (one / sum).powi(2) + (opposite / sum).powi(2);
        Some(Self::Bent { variance, bend_um: one.max(opposite).recip() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_lobes_bend_away_and_three_hold_firmly() {
        let angles = Angles::equal(720);
        let of = |waves: &[(f64, f64, f64)]| {
            let form_um: Vec<f64> = (0..720)
                .map(|index| {
                    let angle = TAU * f64::from(index) / 720.0;
                    waves.iter().map(|(order, amplitude, phase)| amplitude * (order * angle + phase).cos()).sum()
                })
                .collect();
            [Reference::MaximumInscribed, Reference::MinimumCircumscribed]
                .map(|reference| Hold::of(reference, &angles, &form_um, 20.0))
        };
        for hold in of(&[(2.0, 2.0, 0.3), (3.0, 0.001, 1.0)]) {
            assert!(
                matches!(hold, Some(Hold::Bent { variance, bend_um }) if (variance - 0.5).abs() < 0.02 && (bend_um - 8.0).abs() < 0.1),
                "{hold:?}"
            );
        }
        assert_eq!(of(&[(3.0, 2.0, 0.3), (5.0, 0.1, 1.0)]), [Some(Hold::Firm); 2]);
        // Ripple on two lobes: of either contact several peaks are close together.
        for hold in of(&[(2.0, 2.0, 0.3), (90.0, 0.1, 1.0), (37.0, 0.05, 2.0)]) {
            assert!(matches!(hold, Some(Hold::Opposite)), "{hold:?}");
        }
        assert_eq!(Hold::of(Reference::MinimumZone, &angles, &[0.0; 720], 20.0), None);
    }
}
