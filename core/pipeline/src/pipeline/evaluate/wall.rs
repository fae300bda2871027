//! The wall that all sections make together, and draws of its errors.

use std::collections::BTreeSet;

use super::{Content, Filter, Label, POINTS_A_WAVE, labelled};
use runout_numerics::{
    Complex64,
    fourier::{Fourier, max_order},
};
use runout_standards::{
    Value,
    cylindricity::Section,
    gaps::Gaps,
    roundness::Angles,
    uncertainty::{DRAWS, Errors, TURNS_OF_A_DRAW, Uncertainty, monte_carlo_of, seed, without_noise},
};
use runout_turning::surface;

/// Points that all draws of one filter look at together, about: a wall of many sections has fewer draws, down to
/// [`FEWEST_DRAWS`].
const POINTS_DRAWN: usize = 2_000_000;
const FEWEST_DRAWS: usize = 50;
/// Points at which a wall itself is looked at, at most: angles for [`POINTS_A_WAVE`] of its highest order, where there is room.
const POINTS_FOUND: usize = 500_000;

/// Circles of a wall on common angles.
pub(super) struct Wall {
    pub(super) angles: Angles,
    pub(super) count: usize,
    pub(super) radius_mm: f64,
    pub(super) placed: bool,
    pub(super) rings: Vec<Ring>,
    pub(super) held: Content,
}

/// What errors are drawn about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum About {
    /// The form found.
    Form,
    /// The form found, less the noise that it holds.
    WithoutNoise,
    /// No form: the errors alone.
    Nothing,
}

/// How many sections' errors a value depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecidedBy {
    /// One, or a few.
    OneSection,
    /// All of them.
    AllSections,
}

pub(super) struct Ring {
    pub(super) station: String,
    pub(super) id: String,
    pub(super) z_mm: f64,
    pub(super) harmonics: Vec<Complex64>,
    pub(super) variance: Vec<f64>,
    pub(super) gaps: Gaps,
    pub(super) used: f64,
    /// Sources of its errors: a seed, and what they make of each order.
    pub(super) noise: Vec<(u64, Vec<Complex64>)>,
}

impl Ring {
    /// Whether its section or its station is among these.
    pub(super) fn is_named(&self, names: &[String]) -> bool {
        names.iter().any(|name| [&self.id, &self.station].contains(&name))
    }
}

impl Wall {
    pub(super) fn of(sections: &[&surface::Section], count: usize, radius_mm: f64, placed: bool) -> Self {
        let (lowest, fitting) = (if placed { 0 } else { 2 }, max_order(count) + 1);
        let mut lost = BTreeSet::new();
        let (mut highest, mut all_to) = (0, usize::MAX);
        let rings = sections.iter().map(|section| {
            let orders = || section.orders.iter().take(fitting).enumerate();
            lost.extend(section.lost_orders().filter(|order| *order < fitting));
            let own = orders().count().saturating_sub(1);
            (highest, all_to) = (highest.max(own), all_to.min(own));
            let known = || orders().map(|(order, known)| known.filter(|_| order >= lowest));
            let source = |noise: &surface::Noise| {
                let amplitudes = noise.amplitudes.iter().take(fitting).copied().collect();
                (seed(&[&section.station, &noise.of.to_string()]), amplitudes)
            };
            Ring {
                station: section.station.clone(),
                id: section.id.clone(),
                z_mm: section.z_mm,
                harmonics: known().map(|known| known.map_or(Complex64::ZERO, |known| known.value)).collect(),
                variance: known().map(|known| known.map_or(f64::NAN, |known| known.variance)).collect(),
                gaps: section.gaps.clone(),
                used: section.used,
                noise: section.noise.iter().map(source).collect(),
            }
        });
        let rings: Vec<Ring> = rings.collect();
        let half_power_upr = sections.iter().filter_map(|section| section.half_power_upr).reduce(f64::min);
        let shows_weakened = sections.iter().any(|section| section.shows_weakened());
        let held = Content {
            highest,
            all_to: all_to.min(highest),
            lost: lost.into_iter().collect(),
            half_power_upr,
            shows_weakened,
        };
        Self { angles: Angles::equal(count), count, radius_mm, placed, rings, held }
    }

    /// Draws of what all points decide: fewer of a wall of many sections.
    pub(super) fn draws(&self) -> usize {
        (POINTS_DRAWN / (self.rings.len() * self.count).max(1)).clamp(FEWEST_DRAWS, DRAWS)
    }

    /// Whether no section is interrupted.
    pub(super) fn is_whole(&self) -> bool {
        self.rings.iter().all(|ring| ring.gaps.is_empty())
    }

    /// Errors of each section; a wall of which some sections have no known error has none either.
    pub(super) fn errors(&self, filter: &Filter) -> Option<Vec<Errors>> {
        let lowest = if self.placed { 0 } else { 2 };
        let of = |ring: &Ring| {
            let sources = ring.noise.iter().map(|(seed, amplitudes)| (*seed, filter.harmonics(amplitudes)));
            Errors::of_sources(sources, lowest)
        };
        self.rings.iter().map(of).collect()
    }

    /// Share of the wall that is there.
    fn coverage(&self) -> f64 {
        let each = self.rings.iter().map(|ring| ring.gaps.coverage(self.count).min(ring.used));
        each.sum::<f64>() / self.rings.len().max(1) as f64
    }

    /// Everything that is computed from one filtered wall: on many angles, so that no crest is far from one, with what draws of
    /// its errors make of it on fewer. `values` gets its sections and, of a drawn one, its largest error.
    pub(super) fn evaluate(
        &self,
        filter: &Filter,
        labels: Vec<Label>,
        (draws, decided_by): (usize, DecidedBy),
        about: About,
        mut values: impl FnMut(&[Section], Option<f64>, &mut Vec<f64>),
    ) -> Vec<Value> {
        let drawn = self.on_angles(&self.angles, filter, (draws, decided_by), about, &mut values);
        let room = POINTS_FOUND / (self.rings.len() * self.count).max(1);
        let times = (POINTS_A_WAVE * filter.highest(self.held.highest)).div_ceil(self.count).min(room).max(1);
        if times < 2 && about == About::Form {
            return labelled(labels, drawn, filter, &self.held, self.coverage());
        }
        let angles = Angles::equal(times * self.count);
        let found = self.on_angles(&angles, filter, (0, decided_by), About::Form, &mut values).into_iter().zip(drawn);
        let found = found.map(|((value, _), (drawn, known))| {
            let known = known.map(|known| match about {
                About::Form => known.moved(value - drawn),
                About::WithoutNoise | About::Nothing => known.of_value_with_noise(drawn, value),
            });
            (value, known)
        });
        labelled(labels, found.collect(), filter, &self.held, self.coverage())
    }

    /// The same on these angles only.
    pub(super) fn on_angles(
        &self,
        angles: &Angles,
        filter: &Filter,
        (draws, decided_by): (usize, DecidedBy),
        about: About,
        mut values: impl FnMut(&[Section], Option<f64>, &mut Vec<f64>),
    ) -> Vec<(f64, Option<Uncertainty>)> {
        let mut fourier = Fourier::new(angles.len());
        let forms = self.rings.iter().map(|ring| {
            let harmonics = match about {
                About::Form => filter.harmonics(&ring.harmonics),
                About::WithoutNoise => filter.harmonics(&without_noise(&ring.harmonics, &ring.variance)),
                About::Nothing => Vec::new(),
            };
            let mut form_um = fourier.synthesise(harmonics).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let mut errors = self.errors(filter).unwrap_or_default();
        let draws = if errors.is_empty() { 0 } else { draws };
        let mut drawn = forms.clone();
        // A turned error shows nothing new of a section's centre: where there is time, each draw is one of its own.
        let fresh = draws * self.rings.len() * angles.len() <= POINTS_DRAWN;
        let transforms = if fresh { draws } else { draws.div_ceil(TURNS_OF_A_DRAW) };
        let transforms = if decided_by == DecidedBy::OneSection { transforms } else { transforms * self.rings.len() };
        monte_carlo_of(draws, transforms, |disturbed, found| {
            let mut largest_um = disturbed.then_some(0.0_f64);
            if disturbed {
                for ((errors, form), drawn) in errors.iter_mut().zip(&forms).zip(&mut drawn) {
                    if fresh {
                        errors.fresh(&mut fourier, drawn);
                        let largest = drawn.iter().fold(0.0, |largest: f64, error| largest.max(error.abs()));
                        largest_um = largest_um.map(|largest_um| largest_um.max(largest));
                        drawn.iter_mut().zip(form).for_each(|(error, form)| *error += form);
                    } else {
                        errors.draw(&mut fourier, form, drawn);
                        largest_um = largest_um.map(|largest_um| errors.largest_um().max(largest_um));
                    }
                }
            }
            let sections = self.rings.iter().zip(&drawn);
            let sections: Vec<Section> =
                sections.map(|(ring, form_um)| Section { z_mm: ring.z_mm, angles, form_um }).collect();
            values(&sections, largest_um, found);
        })
    }
}
