//! Level and phase of the scallops: what is always fitted.

use runout_core::numerics::least_squares::dot;

use crate::{
    heights::Heights,
    passes::{Cut, Surface},
};

/// Phases that are tried first, over one feed.
const TRIED: usize = 8;
/// Phases by which lines are ranked.
const NEAR: usize = 4;
/// Steps of a fit at most.
const MAX_STEPS: usize = 8;
/// A fit has settled when a step is below this share of the feed.
const SETTLED: f64 = 1e-7;
/// Standard deviations by which a quarter of the feed has to show, so that the phase is observable.
const VISIBLE: f64 = 3.0;

/// A surface at its best phase and level.
#[derive(Debug, Clone)]
pub(crate) struct Phased {
    /// x of the pass 0 at y = 0, in mm.
    pub phase_mm: f64,
    pub level_nm: f64,
    pub surface: Surface,
    /// The residual, in nm.
    pub residual_nm: Vec<f64>,
    /// Change of the surface with the phase, without its mean, of norm 1; nothing where the scallops do not show.
    pub direction: Vec<f64>,
    /// Norm of that change, in nm/mm, where the scallops show.
    pub norm_nm_per_mm: Option<f64>,
}

/// A surface at a phase.
struct Trial {
    phase_mm: f64,
    level_nm: f64,
    surface: Surface,
    residual_nm: Vec<f64>,
    squares: f64,
}

impl Trial {
    fn new(cut: &Cut, heights: &Heights, phase_mm: f64) -> Self {
        let surface = cut.surface(heights, phase_mm);
        let difference = |(height, model): (&f64, &f64)| height - model;
        let count = heights.len().max(1) as f64;
        let level_nm = heights.height_nm.iter().zip(&surface.height_nm).map(difference).sum::<f64>() / count;
        let residual_nm: Vec<f64> =
            heights.height_nm.iter().zip(&surface.height_nm).map(|(height, model)| height - model - level_nm).collect();
        let squares = residual_nm.iter().map(|value| value * value).sum();
        Self { phase_mm, level_nm, surface, residual_nm, squares }
    }

    /// Change of the surface with the phase, in nm/mm, without its mean.
    fn partial(&self, cut: &Cut, heights: &Heights) -> Vec<f64> {
        let mut column: Vec<f64> = Vec::with_capacity(heights.len());
        for row in &heights.rows {
            let beside = &self.surface.beside_mm[row.points.clone()];
            column.extend(beside.iter().map(|beside| -cut.slope(*beside) * row.cosine));
        }
        without_mean(&mut column);
        column
    }

    /// Gauss-Newton with shortened steps.
    fn refined(mut self, cut: &Cut, heights: &Heights) -> Self {
        for _ in 0..MAX_STEPS {
            let column = self.partial(cut, heights);
            let square = dot(&column, &column);
            if square <= 0.0 {
                break;
            }
            let most = 0.25 * cut.feed_mm;
            let step = (dot(&column, &self.residual_nm) / square).clamp(-most, most);
            let steps = [1.0, 0.25, 0.0625, 0.015_625].map(|share| share * step).into_iter();
            let mut trials = steps
                .filter(|step| step.abs() >= SETTLED * cut.feed_mm)
                .map(|step| Self::new(cut, heights, self.phase_mm + step));
            let Some(trial) = trials.find(|trial| trial.squares < self.squares) else { break };
            self = trial;
        }
        self
    }
}

/// Fits level and phase. `sample` is a part of the points, by which the phase is found before it is refined.
pub(crate) fn fit(cut: &Cut, heights: &Heights, sample: &Heights) -> Phased {
    let tried = (0..TRIED).map(|index| (index as f64 / TRIED as f64 - 0.5) * cut.feed_mm);
    let best = tried
        .map(|phase_mm| Trial::new(cut, sample, phase_mm))
        .min_by(|one, other| one.squares.total_cmp(&other.squares));
    let start_mm = best.map_or(0.0, |best| best.refined(cut, sample).phase_mm);
    let mut trial = Trial::new(cut, heights, start_mm).refined(cut, heights);
    let mut direction = trial.partial(cut, heights);
    let norm = dot(&direction, &direction).sqrt();
    let rms = (trial.squares / heights.len().max(1) as f64).sqrt();
    let noise_nm = heights.std_nm.unwrap_or(rms).max(f64::MIN_POSITIVE);
    let shows = norm * 0.25 * cut.feed_mm >= VISIBLE * noise_nm;
    if !shows {
        // Nothing shows where the passes are: they count from the origin.
        trial = Trial::new(cut, heights, 0.0);
        direction.clear();
    }
    direction.iter_mut().for_each(|entry| *entry /= norm);
    let Trial { phase_mm, level_nm, surface, residual_nm, .. } = trial;
    Phased { phase_mm, level_nm, surface, residual_nm, direction, norm_nm_per_mm: shows.then_some(norm) }
}

/// Squares that the best of some phases leaves of a part of the points: that phase and others evenly over one feed.
pub(crate) fn squares_near(cut: &Cut, sample: &Heights, phase_mm: f64) -> f64 {
    let at = |index: usize| phase_mm + index as f64 / NEAR as f64 * cut.feed_mm;
    (0..NEAR).map(|index| Trial::new(cut, sample, at(index)).squares).fold(f64::INFINITY, f64::min)
}

pub(crate) fn without_mean(column: &mut [f64]) {
    let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
    column.iter_mut().for_each(|entry| *entry -= mean);
}
