//! Values of all sections together: cylindricity.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Evaluate, Filter, Group, Held, Label, POINTS_A_WAVE, labelled};
use crate::{
    Complex64,
    evaluate::{
        Value,
        cylindricity::{Disturbed, Generatrices, MedianLine, Points, Reference, Section, Values},
        roundness::Angles,
        uncertainty::{DRAWS, Errors, LARGEST, Uncertainty, monte_carlo_of, seed},
    },
    numerics::fourier::{Fourier, max_order},
    rig::Gaps,
    surface,
};

/// Angles at which a wall is looked at, at most: a surface's usual ones.
const MOST_ANGLES: usize = 720;
/// Points that all draws of one filter look at together, about: a wall of many sections has fewer draws, down to
/// [`FEWEST_DRAWS`].
const POINTS_DRAWN: usize = 2_000_000;
const FEWEST_DRAWS: usize = 50;
/// Points at which a wall itself is looked at, at most: angles for [`POINTS_A_WAVE`] of its highest order, where there is room.
const POINTS_FOUND: usize = 500_000;
/// Draws of what is fitted to each of a wall's generatrices.
const DRAWS_OF_LINES: usize = 100;

/// Values of all sections together.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartSummary {
    /// Sections that they are of.
    pub sections: usize,
    /// First and last place of a section along the axis, in mm.
    pub z_mm: [f64; 2],
    /// Equal angles at which errors of each section were drawn; itself it is looked at on more.
    pub angles: usize,
    /// The standards' values.
    pub values: Vec<Value>,
    /// What the values are not.
    pub remarks: Vec<String>,
}

/// Cylindricity of sections about a nominal radius; `None` where they do not lie at two heights. `placed` says that their
/// centres and mean radii are known relative to each other, which only a measuring machine tells.
pub fn part_summary(
    sections: &[surface::Section],
    angles: usize,
    evaluate: &Evaluate,
    radius_mm: f64,
    placed: bool,
) -> Option<PartSummary> {
    let there: Vec<&surface::Section> = sections.iter().filter(|section| section.z_mm.is_finite()).collect();
    let heights = || there.iter().map(|section| section.z_mm);
    let z_mm = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    if z_mm[0] >= z_mm[1] {
        return None;
    }
    let wall = Wall::of(&there, angles.min(MOST_ANGLES), radius_mm, placed);
    let mut part = PartSummary { sections: there.len(), z_mm, angles: wall.count, ..PartSummary::default() };
    if evaluate.has(Group::Cylindricity) {
        let known = there.iter().map(|section| section.orders.len().saturating_sub(1)).min().unwrap_or(0);
        for cutoff in evaluate.cutoffs_upr(wall.held.highest) {
            let filter = Filter::low_pass(cutoff);
            // What a filter passes and the sections know, needs its angles.
            let wanted = filter.reach_upr().map_or(0, |reach| reach.min(known));
            let finer = (wanted > wall.held.highest).then(|| Wall::of(&there, 2 * wanted + 2, radius_mm, placed));
            part.values.extend(finer.as_ref().unwrap_or(&wall).cylindricity(&filter, &evaluate.references));
        }
        if placed {
            part.values.extend(wall.lines());
        } else {
            part.remarks.push(CENTRED.into());
        }
    }
    if there.len() < sections.len() {
        part.remarks.push(format!("{} sections without a place along z are left out", sections.len() - there.len()));
    }
    Some(part)
}

const CENTRED: &str = "every section is centred, without its 1/rev, and has the nominal radius: displacement sensors do \
    not tell a section's centre and mean radius. Taper (CYLtt), straightness of generatrices and coaxiality are therefore \
    not given, and CYLt holds none of them";

/// Circles of a wall on common angles.
struct Wall {
    angles: Angles,
    count: usize,
    radius_mm: f64,
    placed: bool,
    rings: Vec<Ring>,
    held: Held,
}

struct Ring {
    z_mm: f64,
    harmonics: Vec<Complex64>,
    variance: Vec<f64>,
    gaps: Gaps,
    used: f64,
    seed: u64,
}

impl Wall {
    fn of(sections: &[&surface::Section], count: usize, radius_mm: f64, placed: bool) -> Self {
        let (lowest, fitting) = (if placed { 0 } else { 2 }, max_order(count) + 1);
        let mut lost = BTreeSet::new();
        let (mut highest, mut all_to) = (0, usize::MAX);
        let rings = sections.iter().map(|section| {
            let orders = || section.orders.iter().take(fitting).enumerate();
            lost.extend(section.lost_orders().filter(|order| *order < fitting));
            let own = orders().count().saturating_sub(1);
            (highest, all_to) = (highest.max(own), all_to.min(own));
            let known = || orders().map(|(order, known)| known.filter(|_| order >= lowest));
            Ring {
                z_mm: section.z_mm,
                harmonics: known().map(|known| known.map_or(Complex64::ZERO, |known| known.value)).collect(),
                variance: known().map(|known| known.map_or(f64::NAN, |known| known.variance)).collect(),
                gaps: section.gaps.clone(),
                used: section.used,
                seed: seed(&[&section.station, &section.id]),
            }
        });
        let rings: Vec<Ring> = rings.collect();
        let half_power_upr = sections.iter().filter_map(|section| section.half_power_upr).reduce(f64::min);
        let held = Held { highest, all_to: all_to.min(highest), lost: lost.into_iter().collect(), half_power_upr };
        Self { angles: Angles::equal(count), count, radius_mm, placed, rings, held }
    }

    fn cylindricity(&self, filter: &Filter, references: &[Reference]) -> Vec<Value> {
        let mut labels = Vec::new();
        for reference in references {
            let name = if self.placed { "" } else { " of centred sections" };
            let name = format!("{}{name}", reference.cylinder_symbol());
            let cyl = |symbol, meaning: &str| {
                Label::new(symbol, "µm", format!("ISO 12180-1:2011, {meaning} cylindricity deviation"), name.clone())
            };
            labels.push(cyl("CYLt", "peak-to-valley"));
            if *reference == Reference::LeastSquares {
                labels.extend([cyl("CYLp", "peak-to-reference"), cyl("CYLv", "reference-to-valley")]);
                labels.push(cyl("CYLq", "root mean square"));
            }
        }
        let draws = POINTS_DRAWN / (self.rings.len() * self.count).max(1);
        let usual_um =
            self.errors(filter).map(|errors| LARGEST * errors.iter().map(Errors::std_um).fold(0.0, f64::max));
        let mut disturbed: Vec<Option<Disturbed>> = Vec::new();
        self.evaluate(filter, labels, draws.clamp(FEWEST_DRAWS, DRAWS), |sections, largest_um, found| {
            let points = largest_um.is_none().then(|| Points::of_sections(self.radius_mm, sections));
            for (index, reference) in references.iter().enumerate() {
                let about = if let (None, Some(points)) = (largest_um, &points) {
                    let prepare =
                        |usual_um| Disturbed::new(*reference, sections, self.radius_mm, usual_um, !self.placed);
                    if disturbed.len() < references.len() {
                        disturbed.push(usual_um.and_then(prepare));
                    }
                    points.reference(*reference).map(|cylinder| points.values(&cylinder))
                } else {
                    let prepared = disturbed.get(index).and_then(Option::as_ref);
                    prepared.zip(largest_um).and_then(|(wall, largest_um)| wall.values(sections, largest_um))
                };
                let of = |value: fn(&Values) -> f64| about.as_ref().map_or(f64::NAN, value);
                found.push(of(|values| values.cylt_um));
                if *reference == Reference::LeastSquares {
                    found.extend([
                        of(|values| values.cylp_um),
                        of(|values| values.cylv_um),
                        of(|values| values.cylq_um),
                    ]);
                }
            }
        })
    }

    /// What needs the sections' centres and mean radii.
    fn lines(&self) -> Vec<Value> {
        let coaxiality = "ISO 1101:2017, coaxiality: the largest of a section's LSCI centre with the axis";
        let generatrices = "ISO 12180-1:2011, generatrix straightness deviation: the largest STRt of the generatrices";
        let median_line = "ISO 12180-1:2011, straightness deviation of the extracted median line: a diameter";
        let labels = vec![
            Label::new("CYLtt", "µm", "ISO 12180-1:2011, cylinder taper", "LSCY"),
            Label::new("STRsg", "µm", generatrices, "LSLI of generatrices"),
            Label::new("STRsa", "µm", median_line, "LSLI of the median line"),
            Label::new("coaxiality", "µm", coaxiality, "LSCY"),
        ];
        self.evaluate(&Filter::low_pass(None), labels, DRAWS_OF_LINES, |sections, _, found| {
            let lscy = Points::of_sections(self.radius_mm, sections).reference(Reference::LeastSquares);
            let lines = lscy.as_ref().and_then(|lscy| Generatrices::of(sections, self.radius_mm, lscy));
            let median = lscy.as_ref().map(|lscy| MedianLine::of(sections, self.radius_mm, lscy));
            found.push(lines.as_ref().map_or(f64::NAN, Generatrices::cyltt_um));
            found.push(lines.as_ref().map_or(f64::NAN, Generatrices::largest_strt_um));
            found.push(median.as_ref().map_or(f64::NAN, |median| median.straightness_um));
            let coaxiality = median.iter().flat_map(|median| &median.coaxiality_um);
            found.push(coaxiality.copied().fold(f64::NAN, f64::max));
        })
    }

    /// Errors of each section; a wall of which some sections have no known error has none either.
    fn errors(&self, filter: &Filter) -> Option<Vec<Errors>> {
        let lowest = if self.placed { 0 } else { 2 };
        let each = self.rings.iter().map(|ring| Errors::new(&filter.variance(&ring.variance), lowest, ring.seed));
        each.collect()
    }

    /// Share of the wall that is there.
    fn coverage(&self) -> f64 {
        let each = self.rings.iter().map(|ring| ring.gaps.coverage(self.count).min(ring.used));
        each.sum::<f64>() / self.rings.len().max(1) as f64
    }

    /// Everything that is computed from one filtered wall: on many angles, so that no crest is far from one, with what draws of
    /// its errors make of it on fewer. `values` gets its sections and, of a drawn one, its largest error.
    fn evaluate(
        &self,
        filter: &Filter,
        labels: Vec<Label>,
        draws: usize,
        mut values: impl FnMut(&[Section], Option<f64>, &mut Vec<f64>),
    ) -> Vec<Value> {
        let drawn = self.on_angles(&self.angles, filter, draws, &mut values);
        let room = POINTS_FOUND / (self.rings.len() * self.count).max(1);
        let times = (POINTS_A_WAVE * filter.highest(self.held.highest)).div_ceil(self.count).min(room);
        if times < 2 {
            return labelled(labels, drawn, filter, &self.held, self.coverage());
        }
        let found = self.on_angles(&Angles::equal(times * self.count), filter, 0, &mut values).into_iter().zip(drawn);
        let found = found.map(|((value, _), (about, known))| (value, known.map(|known| known.moved(value - about))));
        labelled(labels, found.collect(), filter, &self.held, self.coverage())
    }

    /// The same on these angles only.
    fn on_angles(
        &self,
        angles: &Angles,
        filter: &Filter,
        draws: usize,
        mut values: impl FnMut(&[Section], Option<f64>, &mut Vec<f64>),
    ) -> Vec<(f64, Option<Uncertainty>)> {
        let mut fourier = Fourier::new(angles.len());
        let forms = self.rings.iter().map(|ring| {
            let mut form_um = fourier.synthesise(filter.harmonics(&ring.harmonics)).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let mut errors = self.errors(filter).unwrap_or_default();
        let draws = if errors.is_empty() { 0 } else { draws };
        let mut drawn = forms.clone();
        monte_carlo_of(draws, |disturbed, found| {
            let mut largest_um = disturbed.then_some(0.0);
            if disturbed {
                for ((errors, form), drawn) in errors.iter_mut().zip(&forms).zip(&mut drawn) {
                    errors.draw(&mut fourier, form, drawn);
                    largest_um = largest_um.map(|largest_um| errors.largest_um().max(largest_um));
                }
            }
            let sections = self.rings.iter().zip(&drawn);
            let sections: Vec<Section> =
                sections.map(|(ring, form_um)| Section { z_mm: ring.z_mm, angles, form_um }).collect();
            values(&sections, largest_um, found);
        })
    }
}
