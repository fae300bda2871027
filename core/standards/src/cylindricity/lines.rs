//! Lines of a wall: generatrices, taper, and the median line through the sections' centres.

use super::{Cylinder, Points, Section};
use crate::{near::DeviationSpread, roundness, straightness::about_lsli_um};
use runout_numerics::{chebyshev::Chebyshev, cloud::Cloud};

/// Values of the generatrices, in µm: lines along the wall at the sections' common angles, as deviations from LSCY.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Generatrices {
    /// Straightness STRt of each about its least-squares line LSLI (ISO 12780-1); NaN with fewer than three points.
    pub strt_lsli_um: Vec<f64>,
    /// Straightness STRt of each about its minimum-zone line MZLI (ISO 12780-1); NaN with fewer than three points.
    pub strt_mzli_um: Vec<f64>,
    /// Local taper in the plane of each angle and the opposite one (ISO 12180-1): half the difference of the diameters
    /// between the least-squares lines of both at the ends of the wall, without sign; NaN where a line is not known.
    pub local_taper_um: Vec<f64>,
    /// Parallelism of each to the opposite one (ISO 1101:2017, 17.10): the distance of the two lines parallel to the
    /// opposite generatrix' LSLI that hold it; NaN where a line is not known.
    pub parallelism_um: Vec<f64>,
}

impl Generatrices {
    /// Of sections that share their angles; `None` where they do not, or there are fewer than two. `lscy` is the
    /// least-squares cylinder of the same sections.
    ///
    /// Opposite generatrices are half the number of angles apart, which equal angles in an even number are.
    #[must_use]
    pub fn of(sections: &[Section], radius_mm: f64, lscy: &Cylinder) -> Option<Self> {
        let count = sections.first()?.form_um.len();
        let shared = |section: &Section| section.form_um.len() == count && section.angles == sections[0].angles;
        if sections.len() < 2 || count == 0 || !sections.iter().all(shared) {
            return None;
        }
        let deviations: Vec<f64> = Points::of_sections(radius_mm, sections).deviations_um(lscy).collect();
        let lines: Vec<(Vec<f64>, Vec<f64>)> = (0..count)
            .map(|angle| {
                let line = deviations.iter().skip(angle).step_by(count).zip(sections);
                line.filter(|(d, _)| !d.is_nan()).map(|(d, section)| (section.z_mm, *d)).unzip()
            })
            .collect();
        let known = |line: &(Vec<f64>, Vec<f64>)| line.0.len() > 2;
        let strt = |lsli: bool| {
            lines.iter().map(move |line| match (known(line), lsli) {
                (false, _) => f64::NAN,
                (true, true) => roundness::ront_lsci_um(&about_lsli_um(&line.0, &line.1)),
                (true, false) => strt_mzli_um(&line.0, &line.1),
            })
        };
        let heights = || sections.iter().map(|section| section.z_mm);
        let length = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
        let rises: Vec<f64> = lines.iter().map(|(z, d)| length * slope(z, d)).collect();
        let planes = count / 2 * usize::from(count % 2 == 0);
        let local_taper_um = (0..planes).map(|plane| 0.5 * (rises[plane] + rises[plane + planes]).abs()).collect();
        let parallelism = |(index, (z, d)): (usize, &(Vec<f64>, Vec<f64>))| {
            let rise = if planes > 0 { rises[(index + planes) % count] } else { f64::NAN };
            // Outwards on one side is inwards on the other: parallel lines have opposite slopes.
            let turned = DeviationSpread::of(z.iter().zip(d).map(|(z, d)| d + rise / length * z));
            turned.high - turned.low
        };
        let parallelism_um = lines.iter().enumerate().map(parallelism).collect();
        Some(Self {
            parallelism_um,
            strt_lsli_um: strt(true).collect(),
            strt_mzli_um: strt(false).collect(),
            local_taper_um,
        })
    }

    /// The largest straightness deviation of a generatrix about its least-squares line; NaN of none.
    #[must_use]
    pub fn largest_strt_um(&self) -> f64 {
        largest(&self.strt_lsli_um)
    }

    /// The largest parallelism deviation of opposite generatrices; NaN of none.
    #[must_use]
    pub fn largest_parallelism_um(&self) -> f64 {
        largest(&self.parallelism_um)
    }

    /// Cylinder taper CYLtt (ISO 12180-1): the largest local taper; NaN of none.
    #[must_use]
    pub fn cyltt_um(&self) -> f64 {
        largest(&self.local_taper_um)
    }
}

/// The least-squares centres of the sections (ISO 14660-2's extracted median line of a cylinder).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MedianLine {
    /// Heights of the sections.
    pub z_mm: Vec<f64>,
    /// Centre of each section's LSCI; NaN where it is not known.
    pub x_um: Vec<f64>,
    /// Centre of each section's LSCI along y; NaN where it is not known.
    pub y_um: Vec<f64>,
    /// Coaxiality of each section with LSCY: twice the distance of its centre from the axis, in the section's plane.
    pub coaxiality_um: Vec<f64>,
    /// Straightness of the line: the diameter of the cylinder about its least-squares line that holds all centres.
    pub straightness_um: f64,
}

impl MedianLine {
    /// Of sections, each with angles of its own, and the least-squares cylinder of the same sections.
    #[must_use]
    pub fn of(sections: &[Section], radius_mm: f64, lscy: &Cylinder) -> Self {
        let mut points = roundness::Points::default();
        let centres = sections.iter().map(|section| {
            points.set_profile(section.angles, section.form_um, radius_mm);
            let circle = points.reference(roundness::Reference::LeastSquares);
            circle.map_or((f64::NAN, f64::NAN), |circle| (circle.x_um, circle.y_um))
        });
        let (x_um, y_um): (Vec<f64>, Vec<f64>) = centres.unzip();
        let z_mm: Vec<f64> = sections.iter().map(|section| section.z_mm).collect();
        let axis = |z: f64, at: f64, slope: f64| at + 1e-3 * slope * (z - lscy.z_mm);
        let coaxiality_um = z_mm.iter().zip(x_um.iter().zip(&y_um)).map(|(z, (x, y))| {
            let (x_0, y_0) = (axis(*z, lscy.x_um, lscy.slope_x_urad), axis(*z, lscy.y_um, lscy.slope_y_urad));
            2.0 * (x - x_0).hypot(y - y_0)
        });
        let coaxiality_um = coaxiality_um.collect();
        let there = || (0..z_mm.len()).filter(|section| x_um[*section].is_finite());
        let of = |values: &[f64]| there().map(|section| values[section]).collect::<Vec<f64>>();
        let z = of(&z_mm);
        let [x, y] = [&x_um, &y_um].map(|centres| about_lsli_um(&z, &of(centres)));
        let straightness_um = largest(&x.iter().zip(&y).map(|(x, y)| 2.0 * x.hypot(*y)).collect::<Vec<f64>>());
        Self { z_mm, x_um, y_um, coaxiality_um, straightness_um }
    }
}

/// Peak-to-valley straightness STRt about the minimum-zone line MZLI (ISO 12780-1), along the reading, in µm.
fn strt_mzli_um(z_mm: &[f64], profile_um: &[f64]) -> f64 {
    // About the least-squares line first, so that the search's limits are its own size.
    let rest = about_lsli_um(z_mm, profile_um);
    let (bottom, top) = (z_mm[0], z_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    let length = if top > bottom { top - bottom } else { 1.0 };
    let mut cloud = Cloud::<1>::default();
    z_mm.iter().zip(&rest).for_each(|(z, d)| cloud.push([(z - bottom) / length], *d));
    let span = rest.iter().fold(f64::MIN_POSITIVE, |span: f64, d| span.max(d.abs()));
    let line =
        Chebyshev::<1, 3>::new(true, true).solve(&cloud, &[0.0, 1.0, -1.0], &[(-4.0 * span, 4.0 * span)], 1e-14 * span);
    line.map_or(f64::NAN, |line| line.cost)
}

/// Slope of the least-squares line, in µm/mm; NaN of fewer than two heights.
fn slope(z_mm: &[f64], profile_um: &[f64]) -> f64 {
    let mean = z_mm.iter().sum::<f64>() / z_mm.len() as f64;
    let spread: f64 = z_mm.iter().map(|z| (z - mean).powi(2)).sum();
    if spread > 0.0 { z_mm.iter().zip(profile_um).map(|(z, d)| (z - mean) * d).sum::<f64>() / spread } else { f64::NAN }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NAN, f64::max)
}
