//! Values of all sections together: cylindricity. Long because all of them are of one wall, drawn the same way.

use std::collections::BTreeSet;

use super::{Content, Evaluate, Filter, Group, Label, POINTS_A_WAVE, PartSummary, centres, labelled};
use runout_numerics::{
    Complex64,
    fourier::{Fourier, max_order},
    threads,
};
use runout_standards::{
    Value,
    cylindricity::{Disturbed, Generatrices, MedianLine, Points, Reference, Section, Values},
    gaps::Gaps,
    position::{Axis, Positions},
    roundness::Angles,
    uncertainty::{DRAWS, Errors, LARGEST, TURNS_OF_A_DRAW, Uncertainty, monte_carlo_of, seed, without_noise},
};
use runout_turning::surface;

/// Angles at which a wall is looked at, at most: a surface's usual ones.
const MOST_ANGLES: usize = 720;
/// Points that all draws of one filter look at together, about: a wall of many sections has fewer draws, down to
/// [`FEWEST_DRAWS`].
const POINTS_DRAWN: usize = 2_000_000;
const FEWEST_DRAWS: usize = 50;
/// Points at which a wall itself is looked at, at most: angles for [`POINTS_A_WAVE`] of its highest order, where there is room.
const POINTS_FOUND: usize = 500_000;
/// Draws of what is fitted to each of a wall's generatrices.
const DRAWS_OF_LINES: usize = 200;

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
        part.remarks.extend(wall.missing_cylinders(&evaluate.references));
        let known = there.iter().map(|section| section.orders.len().saturating_sub(1)).min().unwrap_or(0);
        let behind = |cutoff: Option<f64>| {
            let filter = evaluate.low_pass(cutoff);
            // What a filter passes and the sections know, needs its angles.
            let wanted = filter.reach_upr().map_or(0, |reach| reach.min(known));
            let finer = (wanted > wall.held.highest).then(|| Wall::of(&there, 2 * wanted + 2, radius_mm, placed));
            finer.as_ref().unwrap_or(&wall).cylindricity(&filter, &evaluate.references)
        };
        part.values.extend(threads::each(evaluate.cutoffs_upr(wall.held.highest), behind).into_iter().flatten());
        if placed {
            part.values.extend(wall.lines());
        } else {
            part.remarks.push(CENTRED.into());
        }
        if !evaluate.datum.is_empty() {
            match wall.about_datum(evaluate) {
                Ok(values) => part.values.extend(values),
                Err(remark) => part.remarks.push(format!("{remark}; no position about the datum is given")),
            }
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
    held: Content,
}

/// What errors are drawn about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum About {
    /// The form found.
    Form,
    /// The form found, less the noise that it holds.
    WithoutNoise,
}

/// How many sections' errors a value depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DecidedBy {
    /// One, or a few.
    OneSection,
    /// All of them.
    AllSections,
}

struct Ring {
    station: String,
    id: String,
    z_mm: f64,
    harmonics: Vec<Complex64>,
    variance: Vec<f64>,
    gaps: Gaps,
    used: f64,
    /// Sources of its errors: a seed, and what they make of each order.
    noise: Vec<(u64, Vec<Complex64>)>,
}

impl Ring {
    /// Whether its section or its station is among these.
    fn is_named(&self, names: &[String]) -> bool {
        names.iter().any(|name| [&self.id, &self.station].contains(&name))
    }
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
        let held = Content { highest, all_to: all_to.min(highest), lost: lost.into_iter().collect(), half_power_upr };
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
        let draws = draws.clamp(FEWEST_DRAWS, DRAWS);
        self.evaluate(
            filter,
            labels,
            (draws, DecidedBy::AllSections),
            About::WithoutNoise,
            |sections, largest_um, found| {
                let points = largest_um.is_none().then(|| Points::of_sections(self.radius_mm, sections));
                for (index, reference) in references.iter().enumerate() {
                    let about = if let (None, Some(points)) = (largest_um, &points) {
                        let prepare = |usual_um| {
                            Disturbed::new(*reference, sections, points, self.radius_mm, usual_um, !self.placed)
                        };
                        let found = || points.reference(*reference).map(|cylinder| points.values(&cylinder));
                        // The first wall is the one that errors are drawn about.
                        if disturbed.len() < references.len() {
                            disturbed.push(usual_um.and_then(prepare));
                            disturbed.last().and_then(Option::as_ref).map_or_else(found, |wall| Some(wall.about()))
                        } else {
                            found()
                        }
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
            },
        )
    }

    /// Why the wall does not have the reference cylinders that are asked for, each with its reason.
    fn missing_cylinders(&self, references: &[Reference]) -> Vec<String> {
        if self.is_whole() {
            return Vec::new();
        }
        let mut fourier = Fourier::new(self.count);
        let forms = self.rings.iter().map(|ring| {
            let mut form_um = fourier.synthesise(ring.harmonics.iter().copied()).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let sections = self.rings.iter().zip(&forms);
        let sections: Vec<Section> =
            sections.map(|(ring, form_um)| Section { z_mm: ring.z_mm, angles: &self.angles, form_um }).collect();
        let points = Points::of_sections(self.radius_mm, &sections);
        let missing = references.iter().filter_map(|reference| {
            let reason = points.determine(*reference).err()?;
            Some(format!("no CYLt about {}: {reason}", reference.cylinder_symbol()))
        });
        missing.collect()
    }

    /// Positions about the datum of the sections that are not in it, or why there are none.
    fn about_datum(&self, evaluate: &Evaluate) -> Result<Vec<Value>, String> {
        let datum = &evaluate.datum;
        let unknown = |name: &&String| !self.rings.iter().any(|ring| ring.is_named(std::slice::from_ref(*name)));
        if let Some(name) = datum.iter().find(unknown) {
            return Err(format!("datum: there is no section `{name}`"));
        }
        if !self.placed {
            return Err("datum: the centres of sections are not known".into());
        }
        let (datums, others): (Vec<usize>, Vec<usize>) =
            (0..self.rings.len()).partition(|ring| self.rings[*ring].is_named(datum));
        let filters = evaluate.cutoffs_upr(self.held.highest).into_iter().map(|cutoff| evaluate.low_pass(cutoff));
        Ok(filters.flat_map(|filter| self.positions(&filter, &datum.join(", "), &datums, &others)).collect())
    }

    /// Positions of sections about the axis through others.
    fn positions(&self, filter: &Filter, datum: &str, datums: &[usize], others: &[usize]) -> Vec<Value> {
        let axis = format!("axis of {datum}");
        let name = |ring: &usize| {
            let Ring { station, id, .. } = &self.rings[*ring];
            format!("section {id} of {station}, {axis}")
        };
        let mut labels: Vec<Label> = Vec::new();
        for ring in others {
            let centre = "distance of the section's LSCI centre from the datum axis";
            labels.push(Label::new("eccentricity", "µm", centre, name(ring)));
            labels.push(Label::new("circular-run-out", "µm", "ISO 1101:2017, circular run-out, radial", name(ring)));
        }
        let coaxiality = "ISO 1101:2017, coaxiality: twice the largest eccentricity";
        labels.push(Label::new("coaxiality", "µm", coaxiality, axis.clone()));
        labels.push(Label::new("total-run-out", "µm", "ISO 1101:2017, total run-out, radial", axis.clone()));
        let draws = (POINTS_DRAWN / (self.rings.len() * self.count).max(1)).clamp(FEWEST_DRAWS, DRAWS);
        let work = (draws, DecidedBy::OneSection);
        let mut values = self.evaluate(filter, labels, work, About::WithoutNoise, |sections, _, found| {
            let of = |rings: &[usize]| rings.iter().filter_map(|ring| sections.get(*ring).copied()).collect::<Vec<_>>();
            let axis = Axis::through(&of(datums), self.radius_mm);
            let positions = axis.map(|axis| Positions::about(&of(others), self.radius_mm, &axis));
            let each = positions.iter().flat_map(|all| all.eccentricity_um.iter().zip(&all.circular_runout_um));
            let mut all: Vec<f64> = each.flat_map(|(eccentricity, runout)| [*eccentricity, *runout]).collect();
            all.resize(2 * others.len(), f64::NAN);
            found.extend(all);
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.coaxiality_um));
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.total_runout_um));
        });
        for value in values.iter_mut().filter(|value| value.symbol == "eccentricity") {
            let ring = others.iter().find(|ring| name(ring) == value.reference);
            let std_um = ring.map(|ring| self.centre_std_um(filter, *ring, datums));
            value.uncertainty = value.uncertainty.take().zip(std_um).map(|(known, std_um)| {
                // The centre of an arc takes errors of other orders too.
                let std_um = if self.is_whole() { std_um } else { std_um.max(known.std) };
                Uncertainty::of_amplitude(value.value, std_um, 0)
            });
        }
        self.diameters(&mut values, filter, datums, others);
        values
    }

    /// Gives diameters that hold the centres of sections an interval that holds near 0 too.
    fn diameters(&self, values: &mut [Value], filter: &Filter, datums: &[usize], others: &[usize]) {
        let largest_um = others.iter().map(|ring| self.centre_std_um(filter, *ring, datums)).fold(0.0, f64::max);
        for value in values.iter_mut().filter(|value| ["coaxiality", "STRsa"].contains(&value.symbol.as_str())) {
            let known = value.uncertainty.take();
            value.uncertainty = known.map(|known| centres::of_diameter(known, value.value, largest_um, others.len()));
        }
    }

    /// Standard uncertainty of a section's centre beside the axis through those of others, along x and along y.
    fn centre_std_um(&self, filter: &Filter, ring: usize, datums: &[usize]) -> f64 {
        let z_mm: Vec<f64> = self.rings.iter().map(|ring| ring.z_mm).collect();
        let of_order_1 = |ring: &Ring| {
            let sources = ring.noise.iter().map(|(_, amplitudes)| filter.harmonics(amplitudes));
            sources.filter_map(|amplitudes| Some(amplitudes.get(1)?.norm_sqr())).sum()
        };
        let variance: Vec<f64> = self.rings.iter().map(of_order_1).collect();
        centres::std_um(&z_mm, &variance, ring, datums)
    }

    /// Whether no section is interrupted.
    fn is_whole(&self) -> bool {
        self.rings.iter().all(|ring| ring.gaps.is_empty())
    }

    /// What needs the sections' centres and mean radii.
    fn lines(&self) -> Vec<Value> {
        let coaxiality = "ISO 1101:2017, coaxiality: the largest of a section's LSCI centre with the axis";
        let generatrices = "ISO 12180-1:2011, generatrix straightness deviation: the largest STRt of the generatrices";
        let median_line = "ISO 12180-1:2011, straightness deviation of the extracted median line: a diameter";
        let parallelism = "ISO 1101:2017, parallelism: the largest of the generatrices";
        let labels = vec![
            Label::new("CYLtt", "µm", "ISO 12180-1:2011, cylinder taper", "LSCY"),
            Label::new("STRsg", "µm", generatrices, "LSLI of generatrices"),
            Label::new("STRsa", "µm", median_line, "LSLI of the median line"),
            Label::new("coaxiality", "µm", coaxiality, "LSCY"),
            Label::new("parallelism", "µm", parallelism, "LSLI of the opposite generatrix"),
        ];
        let draws = (DRAWS_OF_LINES, DecidedBy::OneSection);
        let filter = Filter::low_pass(None);
        let mut values = self.evaluate(&filter, labels, draws, About::Form, |sections, _, found| {
            let lscy = Points::of_sections(self.radius_mm, sections).reference(Reference::LeastSquares);
            let lines = lscy.as_ref().and_then(|lscy| Generatrices::of(sections, self.radius_mm, lscy));
            let median = lscy.as_ref().map(|lscy| MedianLine::of(sections, self.radius_mm, lscy));
            found.push(lines.as_ref().map_or(f64::NAN, Generatrices::cyltt_um));
            found.push(lines.as_ref().map_or(f64::NAN, Generatrices::largest_strt_um));
            found.push(median.as_ref().map_or(f64::NAN, |median| median.straightness_um));
            let coaxiality = median.iter().flat_map(|median| &median.coaxiality_um);
            found.push(coaxiality.copied().fold(f64::NAN, f64::max));
            found.push(lines.as_ref().map_or(f64::NAN, Generatrices::largest_parallelism_um));
        });
        let all: Vec<usize> = (0..self.rings.len()).collect();
        self.diameters(&mut values, &filter, &all, &all);
        values
    }

    /// Errors of each section; a wall of which some sections have no known error has none either.
    fn errors(&self, filter: &Filter) -> Option<Vec<Errors>> {
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
    fn evaluate(
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
                About::WithoutNoise => known.of_value_with_noise(drawn, value),
            });
            (value, known)
        });
        labelled(labels, found.collect(), filter, &self.held, self.coverage())
    }

    /// The same on these angles only.
    fn on_angles(
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
            };
            let mut form_um = fourier.synthesise(harmonics).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let mut errors = self.errors(filter).unwrap_or_default();
        let draws = if errors.is_empty() { 0 } else { draws };
        let mut drawn = forms.clone();
        // A turned error tells nothing new of a section's centre: where there is time, each draw is one of its own.
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
