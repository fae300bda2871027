//! The wall that all sections make together, and draws of its errors.

use std::collections::BTreeSet;

use super::{Content, Filter, Label, NumberFound, POINTS_A_WAVE, labelled};
use crate::Value;
use runout_draws::{Draws, Errors, Interval, Measured, VarianceFrom, seed};
use runout_numerics::{
    Complex64,
    fourier::{Fourier, max_order},
};
use runout_standards::{cylindricity::Section, gaps::Gaps, roundness::Angles};
use runout_turning::surface;

/// Points that all draws of one filter evaluate together, about: a wall of many sections has fewer draws.
const POINTS_DRAWN: usize = 4_000_000;
/// Points at which a wall itself is evaluated, at most: angles for [`POINTS_A_WAVE`] of its highest order, where there is room.
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

/// A wall that values are asked of.
pub(super) struct Look<'a> {
    /// Which of the [`KINDS`](runout_draws::KINDS) of draws it is from; none of the wall found, on more angles.
    pub kind: Option<usize>,
    pub sections: &'a [Section<'a>],
    /// The largest error of a draw; none of what is undisturbed, which comes first.
    pub largest_um: Option<f64>,
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
    /// Degrees of freedom of the readings that all orders have their variance from; nothing where they do not have it from one.
    pub(super) readings_freedom: Option<usize>,
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
                readings_freedom: section.readings_freedom,
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
            shows_absent: sections.iter().any(|section| section.absent_um > 0.0),
        };
        Self { angles: Angles::equal(count), count, radius_mm, placed, rings, held }
    }

    /// Whether no section is interrupted.
    pub(super) fn is_whole(&self) -> bool {
        self.rings.iter().all(|ring| ring.gaps.is_empty())
    }

    /// Errors of each section; a wall of which some sections have no known error has none either.
    pub(super) fn errors(&self, filter: &Filter) -> Option<Vec<Errors>> {
        let of = |ring: &Ring| {
            let sources = ring.noise.iter().map(|(seed, amplitudes)| (*seed, filter.harmonics(amplitudes)));
            Errors::of_sources(sources, self.lowest())
        };
        self.rings.iter().map(of).collect()
    }

    /// Share of the wall that is there.
    fn coverage(&self) -> f64 {
        let each = self.rings.iter().map(|ring| ring.gaps.coverage(self.count).min(ring.used));
        each.sum::<f64>() / self.rings.len().max(1) as f64
    }

    /// Everything that is computed from one filtered wall, on many angles, so that no crest is far from one; with what is known of it by draws on
    /// fewer.
    pub(super) fn evaluate(
        &self,
        filter: &Filter,
        labels: Vec<Label>,
        mut values: impl FnMut(Look<'_>, &mut Vec<f64>),
    ) -> Vec<Value> {
        let room = POINTS_FOUND / (self.rings.len() * self.count).max(1);
        let times = (POINTS_A_WAVE * filter.highest(self.held.highest)).div_ceil(self.count).min(room).max(1);
        let angles = Angles::equal(times * self.count);
        let mut fourier = Fourier::new(angles.len());
        let forms = self.rings.iter().map(|ring| {
            let mut form_um = fourier.synthesise(filter.harmonics(&ring.harmonics)).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let mut found = Vec::new();
        values(Look { kind: None, sections: &self.sections(&angles, &forms), largest_um: None }, &mut found);
        let known = self.known(filter, values);
        let known = known.iter().map(Some).chain(std::iter::repeat(None));
        let found = found.into_iter().zip(known).map(|(value, known)| NumberFound::of(value, known));
        labelled(labels, found.collect(), filter, &self.held, self.coverage())
    }

    /// What is known of values of the wall; nothing where some section has no known error.
    fn known(&self, filter: &Filter, mut values: impl FnMut(Look<'_>, &mut Vec<f64>)) -> Vec<Interval> {
        let lowest = self.lowest();
        let all_of_readings = self.rings.iter().all(|ring| ring.readings_freedom.is_some());
        let variance_from = if all_of_readings { VarianceFrom::Readings } else { VarianceFrom::OrdersBeside };
        let measured: Vec<Measured> = (self.rings.iter())
            .map(|ring| Measured {
                harmonics: ring.harmonics.clone(),
                variance: ring.variance.clone(),
                // Without them, amplitudes of the sources are as wide as their variances are badly known.
                squares: ring.readings_freedom.map_or_else(Vec::new, |freedom| vec![freedom; ring.harmonics.len()]),
                variance_from,
                lowest,
            })
            .collect();
        let names: Vec<&str> = self.rings.iter().flat_map(|ring| [ring.station.as_str(), ring.id.as_str()]).collect();
        let sources = self.rings.iter().map(|ring| ring.noise.clone()).collect();
        let Some(draws) = Draws::of(&measured, sources, seed(&names)) else { return Vec::new() };
        let draws = draws.with_draws(POINTS_DRAWN / (self.rings.len() * self.count).max(1));
        let blank = |ring: usize, profile_um: &mut Vec<f64>| self.rings[ring].gaps.blank(profile_um);
        let profiles = draws.profiles(|order| filter.weight(order), self.count, blank);
        let mut drawn = profiles.undisturbed_um(0).to_vec();
        profiles.values(|kind, noise, found| {
            let undisturbed = profiles.undisturbed_um(kind);
            let mut largest_um = noise.map(|_| 0.0_f64);
            for (place, (drawn, form)) in drawn.iter_mut().zip(undisturbed).enumerate() {
                drawn.clone_from(form);
                if let Some(noise) = noise {
                    largest_um = largest_um.map(|largest_um| largest_um.max(noise[place].largest_um()));
                    drawn.iter_mut().zip(noise[place].iter()).for_each(|(form, noise)| *form += noise);
                }
            }
            values(Look { kind: Some(kind), sections: &self.sections(&self.angles, &drawn), largest_um }, found);
        })
    }

    /// Orders below are not known.
    fn lowest(&self) -> usize {
        if self.placed { 0 } else { 2 }
    }

    fn sections<'a>(&self, angles: &'a Angles, forms: &'a [Vec<f64>]) -> Vec<Section<'a>> {
        let sections = self.rings.iter().zip(forms);
        sections.map(|(ring, form_um)| Section { z_mm: ring.z_mm, angles, form_um }).collect()
    }
}
