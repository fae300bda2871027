//! From sections to a surface.

use super::{
    Meeting, Surface, SurfaceConfig,
    monotone::{STENCIL, Stencil},
    section::{Order, Section, mean, noise, orders},
};
use crate::{
    separation::{Quantity, SectionAt},
    station::StationResult,
};
use runout_draws::{Errors, VarianceFrom};
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::{
    Complex64,
    fourier::{Fourier, max_order},
    threads::both,
};
use runout_standards::drawn::remove_noise;

/// Sections nearer to each other than this lie at one z, in mm: a carriage's repeatability.
const SAME_Z_MM: f64 = 1e-3;

/// Points that a surface may have: 0.8 GB here, and still an index of 32 bits in a mesh.
const MOST_POINTS: f64 = 1e8;

/// Collects sections as stations come in.
#[derive(Debug, Default)]
pub struct SurfaceBuilder {
    config: SurfaceConfig,
    sections: Vec<Section>,
    /// Whether a section had orders that do not fit on the grid.
    band_limited: bool,
}

impl SurfaceBuilder {
    /// For one configuration.
    #[must_use]
    pub fn new(config: &SurfaceConfig) -> Self {
        Self { config: config.clone(), ..Self::default() }
    }

    /// Whether all sections that were added lie at one height: then there is no surface.
    pub fn is_flat(&self) -> bool {
        let heights = || self.sections.iter().map(|section| section.z_mm);
        heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min) <= SAME_Z_MM
    }

    /// What was added.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Adds a station's sections.
    pub fn add(&mut self, result: &StationResult) {
        let separation = &result.separation;
        let mut noise = noise(separation, max_order(self.config.angles) + 1).into_iter();
        for (index, at) in separation.sections.iter().enumerate() {
            let noise = noise.next().unwrap_or_default();
            let Some(unknown) = separation.position(Quantity::Form(index)) else { continue };
            let mut orders = orders(separation, unknown);
            let fitting = max_order(self.config.angles) + 1;
            self.band_limited |= orders.iter().skip(fitting).flatten().any(|order| order.value != Complex64::ZERO);
            orders.truncate(fitting);
            let SectionAt { id, z_mm, gaps, used, .. } = at.clone();
            let (station, half_power_upr) = (result.station.clone(), result.half_power_upr());
            let absent_um = result.absent_um(index);
            let is_of_readings = separation.variance_from == VarianceFrom::Readings;
            let readings_freedom = is_of_readings.then_some(separation.freedom);
            self.sections.push(Section {
                id,
                station,
                z_mm,
                gaps,
                used,
                half_power_upr,
                absent_um,
                orders,
                noise,
                readings_freedom,
            });
        }
    }

    /// The surface, and what is not known of it.
    ///
    /// Sections at one z become one ring, each order their mean, weighted by the inverse variance where all of them
    /// know it.
    ///
    /// # Errors
    /// With fewer than two sections along z, or more points than can be held.
    pub fn build(mut self, radius_mm: f64) -> Result<(Surface, Uncertain)> {
        let failure = |problem: String| Error::new("build", "the surface", problem);
        if let Some(section) = self.sections.iter().find(|section| !section.z_mm.is_finite()) {
            return Err(failure(format!("section {} has no place along z", section.label())));
        }
        self.sections.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm));
        let angles = self.config.angles;
        let mut fourier = Fourier::new(angles);
        let mut rings = Rings { angles, z_mm: Vec::new(), deviation_um: Vec::new() };
        let mut variance = Vec::new();
        let mut meetings = Vec::new();
        let mut rest = self.sections.as_slice();
        while let Some(first) = rest.first() {
            let (group, later) = rest.split_at(rest.partition_point(|other| other.z_mm - first.z_mm <= SAME_Z_MM));
            for (index, section) in group.iter().enumerate() {
                let others = group[index + 1..].iter().filter(|other| other.id != section.id);
                meetings.extend(others.map(|other| meeting(section, other, &mut fourier)));
            }
            rings.z_mm.push(group.iter().map(|section| section.z_mm).sum::<f64>() / group.len() as f64);
            rings.deviation_um.extend_from_slice(fourier.synthesise(mean(group).map(|order| order.value)));
            variance.push(mean(group).map(|order| order.variance).collect());
            rest = later;
        }
        let (start, end) = match rings.z_mm.as_slice() {
            [] => return Err(failure("no section was measured".into()).of(ErrorKind::InsufficientData)),
            [only] => {
                let problem = format!("all sections lie at one z ({only} mm); a surface needs two or more");
                let help = "measure at another station, or export no mesh";
                return Err(failure(problem).of(ErrorKind::InsufficientData).help(help));
            }
            [start, .., end] => (*start, *end),
        };
        let interpolation = describe(rings.z_mm.len(), self.band_limited);
        if let Some(step) = self.config.step_mm {
            let points = ((end - start) / step + 2.0) * angles as f64;
            if points > MOST_POINTS {
                let problem = format!("rings every {step} mm over {} mm are more than memory allows", end - start);
                return Err(failure(problem).of(ErrorKind::Configuration).help("enlarge step_mm or take fewer angles"));
            }
        }
        let Rings { z_mm, deviation_um, .. } = rings.laid(self.config.step_mm);
        let surface = Surface { radius_mm, angles, z_mm, deviation_um, interpolation, meetings };
        Ok((surface, Uncertain { rings, variance, step_mm: self.config.step_mm, sections: self.sections }))
    }
}

/// A surface's measured rings with what is not known of them, from which surfaces are drawn that could be as well.
#[derive(Debug)]
pub struct Uncertain {
    rings: Rings,
    /// Of each ring, E|δ|² by order from 0; NaN where not known.
    variance: Vec<Vec<f64>>,
    step_mm: Option<f64>,
    sections: Vec<Section>,
}

impl Uncertain {
    /// The sections that the surface was made of.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Measured rings: places in mm, ascending.
    #[must_use]
    pub fn z_mm(&self) -> &[f64] {
        &self.rings.z_mm
    }

    /// Harmonics of each measured ring by order from 0, with the power that their errors add taken out where `without_noise`;
    /// errors of orders below `lowest` are taken as none.
    #[must_use]
    pub fn harmonics(&self, lowest: usize, without_noise: bool) -> Vec<Vec<Complex64>> {
        let angles = self.rings.angles;
        let mut fourier = Fourier::new(angles);
        let rings = self.rings.deviation_um.chunks(angles).map(|ring| {
            let mut harmonics = vec![Complex64::ZERO; max_order(angles) + 1];
            fourier.analyse(ring.iter().copied(), &mut harmonics);
            harmonics
        });
        let mut harmonics: Vec<Vec<Complex64>> = rings.collect();
        if without_noise {
            remove_noise(&mut harmonics, &self.variance, lowest);
        }
        harmonics
    }

    /// The measured rings one after the other, without the power that their errors add.
    #[must_use]
    pub fn without_noise(&self, lowest: usize) -> Vec<f64> {
        let mut fourier = Fourier::new(self.rings.angles);
        let rings = self.harmonics(lowest, true);
        rings.into_iter().flat_map(|harmonics| fourier.synthesise(harmonics).to_vec()).collect()
    }

    /// Standard deviation of each measured ring's errors at any one angle, in µm; NaN where nothing is known.
    #[must_use]
    pub fn std_um(&self, lowest: usize) -> Vec<f64> {
        let std = |variance: &Vec<f64>| Errors::new(variance, lowest, 0).map_or(f64::NAN, |errors| errors.std_um());
        self.variance.iter().map(std).collect()
    }

    /// Errors of all measured rings, one after the other, independent from call to call. Orders below `lowest` are taken as
    /// exact. `None` where a ring's errors are not known.
    #[must_use]
    pub fn errors(&self, lowest: usize, seed: u64) -> Option<impl FnMut(&mut [f64]) + '_> {
        let each = self.variance.iter().zip(0..);
        let errors: Option<Vec<Errors>> =
            each.map(|(variance, ring)| Errors::new(variance, lowest, seed.wrapping_add(ring))).collect();
        let mut errors = errors?;
        let angles = self.rings.angles;
        let fill = move |errors: &mut [Errors], rings_um: &mut [f64]| {
            let mut fourier = Fourier::new(angles);
            for (errors, ring) in errors.iter_mut().zip(rings_um.chunks_mut(angles)) {
                errors.fresh(&mut fourier, ring);
            }
        };
        Some(move |rings_um: &mut [f64]| {
            // Rings have numbers of their own, whichever thread draws them.
            let half = errors.len() / 2;
            let (first, rest) = errors.split_at_mut(half);
            let (first_um, rest_um) = rings_um.split_at_mut((half * angles).min(rings_um.len()));
            both(|| fill(first, first_um), || fill(rest, rest_um));
        })
    }

    /// Whether the surface has the measured rings, and none between them.
    #[must_use]
    pub fn is_as_measured(&self) -> bool {
        self.step_mm.is_none()
    }

    /// A surface's deviations from those of its measured rings.
    #[must_use]
    pub fn laid(&self, rings_um: &[f64]) -> Vec<f64> {
        let Rings { angles, z_mm, .. } = &self.rings;
        let rings = Rings { angles: *angles, z_mm: z_mm.clone(), deviation_um: rings_um.to_vec() };
        if self.step_mm.is_some() { rings.laid(self.step_mm).deviation_um } else { rings.deviation_um }
    }
}

/// Form over (angle, z), as in [`Surface`].
#[derive(Debug, Clone)]
struct Rings {
    angles: usize,
    z_mm: Vec<f64>,
    deviation_um: Vec<f64>,
}

impl Rings {
    /// As they are, or at every `step_mm` from the first on, and one where the last is.
    fn laid(&self, step_mm: Option<f64>) -> Self {
        let (Some(step), [start, .., end]) = (step_mm, self.z_mm.as_slice()) else { return self.clone() };
        // A last gap below a thousandth of the step is rounding, not a ring.
        let full = ((end - start) / step - 1e-3).ceil().max(1.0) as usize;
        let z_mm: Vec<f64> = (0..full).map(|ring| start + step * ring as f64).chain([*end]).collect();
        let mut deviation_um = Vec::with_capacity(z_mm.len() * self.angles);
        let ring = |index: usize| &self.deviation_um[index * self.angles..(index + 1) * self.angles];
        for stencil in z_mm.iter().filter_map(|z| Stencil::locate(&self.z_mm, *z)) {
            let known: [&[f64]; STENCIL] = std::array::from_fn(|knot| ring(stencil.knot(knot)));
            deviation_um.extend((0..self.angles).map(|angle| stencil.value(known.map(|ring| ring[angle]))));
        }
        Self { angles: self.angles, z_mm, deviation_um }
    }
}

fn describe(sections: usize, band_limited: bool) -> &'static str {
    match (sections, band_limited) {
        (2, false) => "linear along z between the two sections",
        (2, true) => "linear along z between the two sections; orders from half the angles upwards left out",
        (_, false) => "monotone piecewise cubic along z (Fritsch, Carlson 1980; slopes of Fritsch, Butland 1984)",
        (_, true) => {
            "monotone piecewise cubic along z (Fritsch, Carlson 1980; slopes of Fritsch, Butland 1984); orders from \
             half the angles upwards left out"
        }
    }
}

/// Orders of two sections side by side, where both know them.
fn common<'a>(a: &'a Section, b: &'a Section) -> impl Iterator<Item = Option<(Order, Order)>> + 'a {
    a.orders.iter().zip(&b.orders).map(|(a, b)| a.zip(*b))
}

fn meeting(a: &Section, b: &Section, fourier: &mut Fourier) -> Meeting {
    let difference = common(a, b).map(|pair| pair.map_or(Complex64::ZERO, |(a, b)| a.value - b.value));
    let difference = fourier.synthesise(difference);
    let squares: f64 = difference.iter().map(|value| value * value).sum();
    // As Separation::angle_std: ½ Σ E|δₙ|² from order 1.
    let variance: f64 = common(a, b).skip(1).flatten().map(|(a, b)| a.variance + b.variance).sum();
    let expected = (0.5 * variance).sqrt();
    Meeting {
        z_mm: 0.5 * (a.z_mm + b.z_mm),
        sections: [a.label(), b.label()],
        rms_um: (squares / difference.len() as f64).sqrt(),
        max_um: difference.iter().fold(0.0, |largest: f64, value| largest.max(value.abs())),
        expected_rms_um: (expected.is_finite() && expected > 0.0).then_some(expected),
    }
}
