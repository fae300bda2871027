//! Values of a filtered profile.

use super::{Settings, Texture, elements};
use crate::evaluate::areal::derivative;

/// Hills and dales below this share of Rp and Rv are none (ISO 21920-2).
const LOWEST: f64 = 0.1;
/// Hills and dales narrower than this share of a section are none (ISO 4287:1997, 3.2.7).
const NARROWEST: f64 = 0.01;
/// Spacings that differ by less than this share are equal.
const EVEN: f64 = 1e-6;

/// A profile about its mean line.
pub(super) struct Profile<'a> {
    pub(super) positions_mm: &'a [f64],
    /// Heights about the mean, NaN where missing.
    pub(super) heights_um: Vec<f64>,
    /// The circumference of a closed profile.
    pub(super) turn_mm: Option<f64>,
    /// Length that each point stands for.
    cells: Vec<f64>,
    even: bool,
}

impl<'a> Profile<'a> {
    pub(super) fn new(positions_mm: &'a [f64], mut heights_um: Vec<f64>, turn_mm: Option<f64>) -> Self {
        let gaps: Vec<f64> = positions_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let even = gaps.iter().all(|gap| (gap - gaps[0]).abs() <= EVEN * gaps[0]);
        let cells = if even || turn_mm.is_some() {
            vec![1.0; positions_mm.len()]
        } else {
            let (first, last) = (gaps.first(), gaps.last());
            let left = first.into_iter().chain(&gaps);
            left.zip(gaps.iter().chain(last)).map(|(left, right)| 0.5 * (left + right)).collect()
        };
        let mut profile = Self { positions_mm, heights_um: Vec::new(), turn_mm, cells, even };
        std::mem::swap(&mut profile.heights_um, &mut heights_um);
        let mean = profile.mean(|height| height);
        profile.heights_um.iter_mut().for_each(|height| *height -= mean);
        profile
    }

    /// Mean along the profile of a power of its heights, over the points there are.
    fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let known = self.heights_um.iter().zip(&self.cells).filter(|(height, _)| height.is_finite());
        let (sum, length) =
            known.fold((0.0, 0.0), |(sum, length), (height, cell)| (sum + cell * of(*height), length + cell));
        sum / length
    }

    /// First position and length.
    fn extent(&self) -> (f64, f64) {
        match (self.turn_mm, self.positions_mm) {
            (Some(turn), _) => (0.0, turn),
            (None, [first, .., last]) => (*first, last - first),
            _ => (0.0, 0.0),
        }
    }

    pub(super) fn texture(&self, settings: &Settings) -> Texture {
        let (start, length) = self.extent();
        let wanted = settings.section_mm.or(settings.lambda_c_mm).unwrap_or(length / 5.0);
        // A length that is whole sections but for rounding has them all.
        let sections = ((length / wanted * (1.0 + EVEN)) as usize).clamp(1, self.heights_um.len().max(1));
        let section_mm = length / sections as f64;
        let mut extremes = vec![(f64::INFINITY, f64::NEG_INFINITY); sections];
        let known = || self.positions_mm.iter().zip(&self.heights_um).filter(|(_, height)| height.is_finite());
        for (position, height) in known() {
            let section = ((position - start) / section_mm * (1.0 + 1e-12)) as usize;
            let (low, high) = &mut extremes[section.min(sections - 1)];
            (*low, *high) = (low.min(*height), high.max(*height));
        }
        // A section in which nothing was measured has no say.
        extremes.retain(|(low, _)| low.is_finite());
        let over_sections = |of: fn(&(f64, f64)) -> f64| extremes.iter().map(of).sum::<f64>() / extremes.len() as f64;
        let (rp, rv) = (over_sections(|(_, high)| *high), over_sections(|(low, _)| -low));
        let (low, high) = known()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, height)| (low.min(*height), high.max(*height)));
        let variance = self.mean(|height| height * height);
        let points = known().count();
        Texture {
            ra: self.mean(f64::abs),
            rq: variance.sqrt(),
            rp,
            rv,
            rz: rp + rv,
            rt: if points == 0 { f64::NAN } else { high - low },
            rsk: self.mean(|height| height.powi(3)) / variance.powf(1.5),
            rku: self.mean(|height| height.powi(4)) / (variance * variance),
            rsm_mm: elements::spacing(self, [LOWEST * rp, LOWEST * rv], NARROWEST * section_mm),
            rdq: self.gradient(),
            points,
            missing: self.heights_um.len() - points,
            sections,
            section_mm,
        }
    }

    /// Root mean square of the slope, over the points with three measured neighbours on each side.
    fn gradient(&self) -> f64 {
        let count = self.heights_um.len();
        if !self.even || count < 7 {
            return f64::NAN;
        }
        let spacing_um = 1e3 * (self.positions_mm[1] - self.positions_mm[0]);
        let points = if self.turn_mm.is_some() { 0..count } else { 3..count - 3 };
        let squares = points.filter_map(|point| {
            let at =
                |step: isize| self.heights_um[(point.cast_signed() + step).rem_euclid(count.cast_signed()) as usize];
            let square = (derivative(at) / spacing_um).powi(2);
            square.is_finite().then_some(square)
        });
        let (sum, number) = squares.fold((0.0, 0_usize), |(sum, number), square| (sum + square, number + 1));
        (sum / number as f64).sqrt()
    }
}
