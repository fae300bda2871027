//! Areal and twist values of the part's surface.

use std::{borrow::Cow, collections::BTreeSet};

use super::{
    ArealFilter, Content, Evaluate, Filter, FormRemoval, Group, Label, NumberFound, PartSummary, labelled,
    section_gaps::SectionGaps,
};
use crate::Value;
use runout_draws::seed;
use runout_error::Result;
use runout_numerics::{
    filter::{areal_gaussian, robust_areal_gaussian},
    fourier::max_order,
    height_map::HeightMap,
    threads,
};
use runout_standards::{
    areal::{self, Areal, MaterialRatio, Spatial, SpatialDraws},
    drawn::{Drawn, Sensitivity, in_pairs},
    twist::{self, Twist},
};
use runout_turning::surface::{Section, Surface, Uncertain};

/// Points that all draws evaluate together, about: a large surface has fewer draws, a small one more.
const POINTS_DRAWN: usize = 8_000_000;
const PAIRS: std::ops::RangeInclusive<usize> = 10..=48;

/// Why hills and dales have no uncertainty.
const COUNTED: &str =
    "errors make and merge hills and dales, and draws about a surface that has some by errors do not undo that";
/// Why values of the areal material ratio curve have none.
const OF_CURVE: &str = "it is read from the material ratio curve at places where few heights decide: intervals by draws hold the truth \
    in 75 to 93 %";
/// Why values of a robust filter have none.
const ROBUST: &str = "no errors are drawn through the robust filter";
/// Why twist has none.
const OF_HELIX: &str = "no errors are drawn for the helix";

/// Adds ISO 25178-2's values, and those of twist, of the unrolled surface, without its form and filtered by λs and λc; where it
/// comes from sections with lost orders, these are in no value. Angles at which something is not known of a section are left
/// out along the whole part. Uncertainties are by draws from the sections' variances, those of orders from `lowest`.
///
/// # Errors
/// When the rings are not at equal distances.
pub fn add_areal(
    part: &mut PartSummary,
    surface: &Surface,
    uncertain: &Uncertain,
    lowest: usize,
    evaluate: &Evaluate,
) -> Result<()> {
    if !(evaluate.has(Group::Areal) || evaluate.has(Group::Twist)) {
        return Ok(());
    }
    let sections = uncertain.sections();
    let blank = blanks(sections, surface.angles);
    let prepared = Prepared::new(surface, uncertain.z_mm(), &blank, evaluate);
    let map = match prepared.map(surface.deviation_um.clone()) {
        Ok(map) => map,
        Err(problem) if evaluate.all => {
            part.remarks.push(format!("no areal values and no twist: {problem}"));
            return Ok(());
        }
        Err(problem) => return Err(problem),
    };
    part.remarks.extend(prepared.remark());
    part.remarks.extend(prepared.gaps.remark());
    let lost: BTreeSet<usize> = sections.iter().flat_map(Section::lost_orders).collect();
    let highest = max_order(surface.angles);
    let orders = sections.iter().map(|section| section.orders.len().saturating_sub(1));
    let held = Content {
        highest,
        all_to: orders.fold(highest, usize::min),
        lost: lost.into_iter().collect(),
        half_power_upr: sections.iter().filter_map(|section| section.half_power_upr).reduce(f64::min),
        shows_weakened: sections.iter().any(Section::shows_weakened),
        shows_absent: sections.iter().any(|section| section.absent_um > 0.0),
    };
    let used = sections.iter().map(|section| section.used).sum::<f64>() / sections.len().max(1) as f64;
    let there = 1.0 - map.missing() as f64 / map.heights_um().len() as f64;
    let add = |values: &mut Vec<Value>, (labels, numbers): (Vec<Label>, Vec<NumberFound>)| {
        let filter = filter(evaluate, surface.radius_mm);
        values.extend(labelled(labels, numbers, &filter, &held, there.min(used)));
    };
    if evaluate.has(Group::Areal) {
        let (draws, found) =
            threads::both(|| prepared.draws(uncertain, lowest), || areal::areal(&map, &areal::Settings::default()));
        part.remarks.extend(found.features.problem());
        add(&mut part.values, prepared.areal(&map, &found.parameters(), &draws));
    }
    if evaluate.has(Group::Twist) {
        match twist::twist(&map) {
            Ok(twist) => add(&mut part.values, prepared.twist(&twist)),
            Err(problem) => part.remarks.push(problem),
        }
    }
    Ok(())
}

/// Of equal angles, whether something is not known of a section there.
fn blanks(sections: &[Section], angles: usize) -> Vec<bool> {
    let mut blank = vec![false; angles];
    for section in sections.iter().filter(|section| !section.gaps.is_empty()) {
        blank.iter_mut().zip(section.gaps.of_equal(angles)).for_each(|(blank, gap)| *blank |= gap);
    }
    blank
}

/// Draws of a surface's values.
enum Draws {
    /// No errors are known.
    Unknown,
    /// Errors are known and none are drawn.
    LeftOut,
    Made(Drawn),
}

/// A surface that errors are drawn about, with mean 0, and what is drawn of its lengths and directions.
struct About {
    map: HeightMap<'static>,
    spatial: Option<SpatialDraws<'static>>,
}

/// Values in the order of [`areal::PARAMETERS`].
fn numbers(found: &Areal) -> Vec<f64> {
    found.parameters().iter().map(|one| one.value).collect()
}

/// What is done to a surface before it is evaluated.
struct Prepared<'a> {
    surface: &'a Surface,
    blank: &'a [bool],
    evaluate: &'a Evaluate,
    gaps: SectionGaps,
    /// Rings at each end that are left out after filtering.
    ends: usize,
}

impl<'a> Prepared<'a> {
    fn new(surface: &'a Surface, measured_mm: &[f64], blank: &'a [bool], evaluate: &'a Evaluate) -> Self {
        let ends = match (&surface.z_mm[..], evaluate.lambda_c_mm) {
            ([first, second, .., last], Some(longest)) => end_rings(second - first, last - first, longest),
            _ => 0,
        };
        Self { surface, blank, evaluate, gaps: SectionGaps::new(measured_mm, evaluate.lambda_c_mm), ends }
    }

    /// What is said of the ends.
    fn remark(&self) -> Option<String> {
        let longest = self.evaluate.lambda_c_mm?;
        let [first, second, .., last] = self.surface.z_mm[..] else { return None };
        if self.ends > 0 {
            let cropped_mm = self.ends as f64 * (second - first);
            return Some(format!(
                "areal values leave out {} rings ({cropped_mm:.3} mm) at each end, where λc = {longest} mm lacks a part of its \
                 Gaussian (ISO 16610-28); further in, what it lacks is below 1 % of the waviness",
                self.ends
            ));
        }
        let reaches = second - first < REACH * longest;
        reaches.then(|| {
            format!(
                "the surface is {} mm long, less than two cut-offs λc = {longest} mm: areal values keep the ends, where the filter \
                 lacks up to half of its Gaussian (ISO 16610-28)",
                last - first
            )
        })
    }

    /// The map of deviations on the surface's grid, without form, filtered and without ends.
    fn map(&self, mut there: Vec<f64>) -> Result<HeightMap<'static>> {
        let whole = self.surface.height_map()?;
        for ring in there.chunks_mut(self.surface.angles) {
            ring.iter_mut().zip(self.blank).filter(|(_, blank)| **blank).for_each(|(height, _)| *height = f64::NAN);
        }
        let map = self.gaps.left_out(whole.with(there), &self.surface.z_mm, 0.0);
        let options = &self.evaluate.areal;
        let mut map = match options.form {
            FormRemoval::None => map,
            FormRemoval::Plane => areal::without_taper(&map)?,
            FormRemoval::Cylinder => areal::without_cylinder(&map)?,
            FormRemoval::Cone => areal::without_turned_body(&map, 1)?,
            FormRemoval::Polynomial => areal::without_turned_body(&map, options.degree)?,
        };
        map = filtered(map, self.evaluate);
        if let Some(longest) = self.evaluate.lambda_c_mm.filter(|_| self.ends > 0) {
            map = self.gaps.left_out(map, &self.surface.z_mm, 0.5 * longest);
        }
        Ok(if self.ends > 0 { map.without_ends(self.ends) } else { map })
    }

    fn reference(&self) -> Cow<'static, str> {
        match self.evaluate.areal.form {
            FormRemoval::None => "mean".into(),
            FormRemoval::Plane => "taper removed, mean".into(),
            FormRemoval::Cylinder => "LSCY removed, mean".into(),
            FormRemoval::Cone => "least-squares cone removed, mean".into(),
            FormRemoval::Polynomial => {
                format!("turned body of degree {} removed, mean", self.evaluate.areal.degree).into()
            }
        }
    }

    /// Draws about the surface without its noise.
    fn draws(&self, uncertain: &Uncertain, lowest: usize) -> Draws {
        let Some(next) = uncertain.errors(lowest, seed(&["areal"])) else { return Draws::Unknown };
        if self.evaluate.areal.filter == ArealFilter::RobustGaussian {
            return Draws::LeftOut;
        }
        let pairs = POINTS_DRAWN / (2 * self.surface.deviation_um.len()).max(1);
        let rings_um = uncertain.without_noise(lowest);
        let mut about: Option<About> = None;
        let both = |[above, below]: [&[f64]; 2]| {
            if std::ptr::eq(above, below) {
                let (found, numbers) = self.about(uncertain, above);
                about = found;
                return [numbers.clone(), numbers];
            }
            let drawn = match &mut about {
                Some(about) => self.beside(about, [above, below]),
                None => self.apart(uncertain, [above, below]),
            };
            // What the measured surface has, a drawn one has; if not, there is no uncertainty.
            drawn.unwrap_or_else(|_| [(); 2].map(|()| vec![f64::NAN; areal::PARAMETERS.len()]))
        };
        let mut drawn = in_pairs(&rings_um, pairs.clamp(*PAIRS.start(), *PAIRS.end()), next, both).behind_filter(SQ);
        // The direction comes round again after 180°.
        drawn.unwrap_period(STD, 180.0);
        Draws::Made(drawn)
    }

    /// Values of a surface that errors are drawn about, and what all draws about it share where everything that is done to
    /// its heights is linear in them: no rings between those measured.
    fn about(&self, uncertain: &Uncertain, rings_um: &[f64]) -> (Option<About>, Vec<f64>) {
        let settings = areal::Settings::default();
        let Ok(map) = self.map(uncertain.laid(rings_um)) else {
            return (None, vec![f64::NAN; areal::PARAMETERS.len()]);
        };
        if !uncertain.is_as_measured() {
            return (None, numbers(&areal::without_curve_and_features(&map, &settings)));
        }
        let map = areal::centred(&map);
        // Filters along the axis make errors of rings depend on each other.
        let filtered = self.evaluate.lambda_s_mm.is_some() || self.evaluate.lambda_c_mm.is_some();
        let spatial = if filtered { None } else { SpatialDraws::new(map.clone(), settings.decay) };
        let found = match &spatial {
            Some((_, spatial)) => areal::heights_and_slopes(&map, *spatial),
            None => areal::of_centred(&map, &settings),
        };
        (Some(About { map, spatial: spatial.map(|(draws, _)| draws) }), numbers(&found))
    }

    /// Values of the surface with errors added and taken away.
    fn beside(&self, About { map, spatial }: &mut About, [above, below]: [&[f64]; 2]) -> Result<[Vec<f64>; 2]> {
        let errors: Vec<f64> = above.iter().zip(below).map(|(above, below)| 0.5 * (above - below)).collect();
        let errors = areal::centred(&self.map(errors)?);
        let with = |sign: f64| {
            let heights = map.heights_um().iter().zip(errors.heights_um()).map(|(height, error)| height + sign * error);
            map.with(heights.collect())
        };
        let settings = areal::Settings::default();
        let Some(spatial) = spatial else {
            let of = |sign| numbers(&areal::of_centred(&with(sign), &settings));
            let (below, above) = threads::both(|| of(-1.0), || of(1.0));
            return Ok([above, below]);
        };
        let ([added, taken], [above, below]) = threads::both(
            || spatial.both(errors.heights_um()),
            || [1.0, -1.0].map(|sign| areal::heights_and_slopes(&with(sign), Spatial::NONE)),
        );
        Ok([(above, added), (below, taken)].map(|(found, spatial)| numbers(&Areal { spatial, ..found })))
    }

    /// Values of two surfaces.
    fn apart(&self, uncertain: &Uncertain, both: [&[f64]; 2]) -> Result<[Vec<f64>; 2]> {
        let [above, below] = both.map(|rings_um| self.map(uncertain.laid(rings_um)));
        let [above, below] = [above?, below?];
        let of = |map: &HeightMap| numbers(&areal::without_curve_and_features(map, &areal::Settings::default()));
        let (below, above) = threads::both(|| of(&below), || of(&above));
        Ok([above, below])
    }

    fn areal(&self, map: &HeightMap, parameters: &[areal::Parameter], draws: &Draws) -> (Vec<Label>, Vec<NumberFound>) {
        let standard = |clause: &str| format!("ISO 25178-2:2021, {clause}");
        let label = |one: &areal::Parameter| Label::new(one.symbol, one.unit, standard(one.clause), self.reference());
        let mut labels: Vec<Label> = parameters.iter().map(label).collect();
        let known = |index: usize, value: f64| match draws {
            Draws::LeftOut => without(value, ROBUST),
            Draws::Made(drawn) => found(Some(drawn), index, value, sensitivity(index)),
            Draws::Unknown => found(None, index, value, sensitivity(index)),
        };
        let mut numbers: Vec<NumberFound> =
            parameters.iter().enumerate().map(|(index, one)| known(index, one.value)).collect();
        let options = &self.evaluate.areal;
        if !(options.heights_um.is_empty() && options.ratios_percent.is_empty()) {
            let curve = MaterialRatio::about_mean(map);
            let heights = options.heights_um.iter().map(|height| {
                let reference = format!("{}, {height} µm above it", self.reference());
                (Label::new("Smr(c)", "%", standard("4.5.1"), reference), curve.smr_percent(*height))
            });
            let ratios = options.ratios_percent.iter().map(|ratio| {
                let reference = format!("{}, at {ratio} %", self.reference());
                (Label::new("Smc(p)", "µm", standard("4.5.2"), reference), curve.smc_um(*ratio))
            });
            for (label, value) in heights.chain(ratios) {
                labels.push(label);
                numbers.push(without(value, NOT_DRAWN));
            }
        }
        (labels, numbers)
    }

    fn twist(&self, twist: &Twist) -> (Vec<Label>, Vec<NumberFound>) {
        let labels = twist::PARAMETERS.iter().map(|(symbol, unit, meaning)| {
            Label::new(symbol, unit, format!("after MBN 31007-07, {meaning}"), self.reference())
        });
        (labels.collect(), twist.values().iter().map(|value| without(*value, OF_HELIX)).collect())
    }
}

/// Why values at one place of the areal material ratio curve have no uncertainty.
const NOT_DRAWN: &str = "no errors are drawn for it";

/// A number without uncertainty.
fn without(value: f64, why: &str) -> NumberFound {
    NumberFound { no_uncertainty: Some(why.to_owned()), ..NumberFound::of(value, None) }
}

/// A map without the wavelengths below λs and above λc.
pub(super) fn filtered(mut map: HeightMap<'static>, evaluate: &Evaluate) -> HeightMap<'static> {
    let low_pass = |map: &HeightMap, cutoff_mm: f64| match evaluate.areal.filter {
        ArealFilter::Gaussian => areal_gaussian(map, cutoff_mm),
        ArealFilter::RobustGaussian => robust_areal_gaussian(map, cutoff_mm).low_pass,
    };
    if let Some(shortest) = evaluate.lambda_s_mm {
        map = map.with(low_pass(&map, shortest));
    }
    if let Some(longest) = evaluate.lambda_c_mm {
        let mut rest = map.heights_um().to_vec();
        rest.iter_mut().zip(low_pass(&map, longest)).for_each(|(height, waviness)| *height -= waviness);
        map = map.with(rest);
    }
    map
}

/// What [`filtered`] is, of a wall of this radius.
pub(super) fn filter(evaluate: &Evaluate, radius_mm: f64) -> Filter {
    let mut filter = Filter::between(evaluate.lambda_s_mm, evaluate.lambda_c_mm, radius_mm);
    if evaluate.areal.filter == ArealFilter::RobustGaussian && filter.name != "none" {
        filter.name = format!("robust {}", filter.name);
    }
    filter
}

/// Half-width of the Gaussian in cut-offs, beyond which it is nothing.
const REACH: f64 = 1.22;

/// Rings at each end where λc lacks more than 1 % of its Gaussian: half a cut-off (ISO 16610-28). None where rings are so far
/// apart that the filter takes each by itself, or where less than half of the length would be left.
fn end_rings(step_mm: f64, length_mm: f64, longest_mm: f64) -> usize {
    if step_mm >= REACH * longest_mm || length_mm < 2.0 * longest_mm {
        return 0;
    }
    (0.5 * longest_mm / step_mm * (1.0 - 1e-9)).ceil() as usize
}

/// Places of Sq and Std in [`areal::PARAMETERS`].
const SQ: usize = 0;
const STD: usize = 9;

/// A number found, with its error as draws give it.
fn found(
    drawn: Option<&Drawn>,
    index: usize,
    value: f64,
    sensitivity: std::result::Result<Sensitivity, &str>,
) -> NumberFound {
    let Some(drawn) = drawn else { return NumberFound::of(value, None) };
    let known = sensitivity.map_err(str::to_owned).and_then(|sensitivity| drawn.uncertainty(index, value, sensitivity));
    let no_uncertainty = known.as_ref().err().cloned();
    NumberFound { uncertainty: known.ok(), no_uncertainty, ..NumberFound::of(value, None) }
}

/// How areal values depend on errors, in the order of [`areal::PARAMETERS`]; or why their intervals do not cover the true value.
fn sensitivity(index: usize) -> std::result::Result<Sensitivity, &'static str> {
    match index {
        // Sq, Ssk, Sku, Sa, Sal … Sdr.
        0..=2 | 6..=12 => Ok(Sensitivity::Mean),
        // Sp, Sv, Sz.
        3..=5 => Ok(Sensitivity::Extreme),
        // Sdc … Vvc.
        13..=27 => Err(OF_CURVE),
        // Spd … Shv.
        _ => Err(COUNTED),
    }
}
