//! Lines with which the search begins: those of which least is left on a sample of the points.

use std::f64::consts::TAU;

use runout_core::{closed_loop::Setting, numerics::least_squares::dot};

use crate::{
    effects::MISSING,
    model::CutFit,
    passes::{Cut, Line},
    phase,
    search::Left,
};

/// Δχ² below which a line is not tried: less is no evidence for its three parameters in any map.
const LEAST_GAIN: f64 = 25.0;
/// Factors of the amplitude that a spectrum shows, where passes bury others.
const ENLARGED: [f64; 3] = [1.0, 2.0, 4.0];
/// Lines that look alike, of which a refit decides.
const ALIKE: usize = 4;
/// Harmonics of a line that passes which bury others may show instead of it.
const HARMONICS: usize = 3;
/// A line is taken as its spectrum shows it where its amplitude is below this share of the height that buries a pass.
const LINEAR: f64 = 0.2;
/// Lines of which the phase of the scallops is fitted anew.
const PHASED: usize = 12;

/// Settings with a line at another ratio.
pub(crate) struct OtherRatio {
    pub ratio: f64,
    /// By how much χ² promises to be worse.
    pub worse: f64,
    pub settings: Vec<Setting>,
}

impl CutFit {
    /// Whether a line may earn its place, by what its spectrum shows: a refit beside it may gain for other reasons.
    fn promises(&self, line: &Line) -> bool {
        let weight: f64 =
            self.data.fitted.rows.iter().map(|row| line.lever(row).powi(2) * row.points.len() as f64).sum();
        let left = dot(&self.phased.residual_nm, &self.phased.residual_nm) / self.data.fitted.len().max(1) as f64;
        0.5 * weight * line.amplitude * line.amplitude >= LEAST_GAIN * left
    }

    /// The lines with which least is left, the best first: one, or a few that look alike. Peaks of a spectrum are in proportion to what they explain only while each pass leaves
    /// something: a pass that is buried by its neighbours adds harmonics, and hides a part of the amplitude.
    pub(crate) fn best_lines(&self, tilts: bool) -> Vec<Line> {
        let highest = self.data.config.max_frequency_ratio;
        let left = self.left();
        let lines = left.lines(tilts, highest);
        let Some(first) = lines.first().copied().filter(|first| self.promises(first)) else { return Vec::new() };
        let buried_nm = 1e6 * self.cut.feed_mm * self.cut.feed_mm / (2.0 * self.cut.nose_mm);
        let lever =
            if tilts { self.data.fitted.rows.iter().map(|row| row.y_mm.abs()).fold(0.0, f64::max) } else { 1.0 };
        if first.amplitude * lever < LINEAR * buried_nm {
            return vec![first];
        }
        let with = |line: &Line| {
            let mut applied = self.cut.applied.clone();
            applied.lines.push(*line);
            let cut = Cut::new(&self.data.config, self.data.extent_mm, applied)?;
            Some((cut, *line))
        };
        // Every line is tried near the phase of the scallops that is known; the best of them with a phase of its own.
        let sorted = |lines: Vec<Line>| -> Vec<Line> {
            let near = |(cut, line): (Cut, Line)| {
                (phase::squares_near(&cut, &self.data.sample, self.phased.phase_mm), cut, line)
            };
            let mut all: Vec<(f64, Cut, Line)> = lines.iter().filter_map(with).map(near).collect();
            all.sort_by(|one, other| one.0.total_cmp(&other.0));
            for (squares, cut, _) in all.iter_mut().take(PHASED) {
                let residual_nm = phase::fit(cut, &self.data.sample, &self.data.sample).residual_nm;
                *squares = dot(&residual_nm, &residual_nm);
            }
            let phased = PHASED.min(all.len());
            all[..phased].sort_by(|one, other| one.0.total_cmp(&other.0));
            all.into_iter().map(|(.., line)| line).collect()
        };
        let least = |lines: Vec<Line>| sorted(lines).first().copied().unwrap_or(first);
        // Buried passes show a line by its harmonics: the line itself may be at a half or a third of what the spectrum shows.
        let parts = lines.iter().flat_map(|line| {
            (1..=HARMONICS)
                .flat_map(move |part| (0..part).map(move |turn| (line.ratio.fract() + turn as f64) / part as f64))
        });
        let strongest = |fraction: f64| {
            let all = left.aliases(fraction, tilts, highest, 1e-3).into_iter();
            let (ratio, size) = all.max_by(|one, other| one.1.norm_sqr().total_cmp(&other.1.norm_sqr()))?;
            Some(Line { ratio, amplitude: first.amplitude, phase: size.arg(), tilts })
        };
        let around = |line: Line, sizes: [f64; 3], turns: &[f64]| -> Vec<Line> {
            let turned = |turn: &f64| {
                sizes.map(|size| Line { amplitude: size * line.amplitude, phase: line.phase + turn, ..line })
            };
            turns.iter().flat_map(turned).collect()
        };
        let quarter = 0.25 * TAU;
        let tried = parts
            .filter_map(strongest)
            .flat_map(|line| around(line, ENLARGED, &[0.0, quarter, 2.0 * quarter, -quarter]));
        let best = least(tried.collect());
        let best = least(around(
            best,
            [0.75, 1.0, 1.4],
            &[-0.5 * quarter, -0.25 * quarter, 0.0, 0.25 * quarter, 0.5 * quarter],
        ));
        let others = left.others(best, highest).into_iter().map(|line| Line { amplitude: best.amplitude, ..line });
        let mut alike = sorted(others.chain([best]).collect());
        alike.truncate(ALIKE);
        alike
    }

    /// Ratios with amplitude, phase, and by how much χ² they promise to be worse than the line itself; and the ratio of the latter.
    pub(crate) fn promising(&self, line: Line, highest: usize) -> (Vec<(f64, f64, f64, f64)>, f64) {
        let heights = self.heights();
        let mut residual_nm = self.phased.residual_nm.clone();
        let mut weight = 0.0;
        for row in &heights.rows {
            let lever = line.lever(row);
            weight += lever * lever * row.points.len() as f64;
            for point in row.points.clone() {
                let pass = f64::from(self.phased.surface.pass[point]);
                residual_nm[point] += line.amplitude * lever * line.at(pass, row).cos();
            }
        }
        let left = Left { heights, surface: &self.phased.surface, residual_nm: &residual_nm };
        let all = left.aliases(line.ratio, line.tilts, highest, 1e-3);
        let own = all.iter().min_by(|one, other| (one.0 - line.ratio).abs().total_cmp(&(other.0 - line.ratio).abs()));
        let (own_ratio, own_size) =
            own.map_or((line.ratio, line.amplitude.powi(2)), |(ratio, size)| (*ratio, size.norm_sqr()));
        let noise_nm = heights.std_nm.unwrap_or(1e3);
        let worse = |size: f64| 0.5 * weight * (own_size - size) / (noise_nm * noise_nm);
        let mut promised: Vec<(f64, f64, f64, f64)> =
            all.iter().map(|(ratio, size)| (*ratio, size.norm(), size.arg(), worse(size.norm_sqr()))).collect();
        promised.sort_by(|one, other| one.3.total_cmp(&other.3));
        (promised, own_ratio)
    }

    /// Settings with each other ratio of the line at a place, the one that promises most first; nothing where there is no line.
    pub(crate) fn other_ratios(&self, settings: &[Setting], place: usize, highest: usize) -> Vec<OtherRatio> {
        let Setting { effect, values } = &settings[place];
        let (Some(tilts), &[ratio, amplitude, phase_deg]) =
            (MISSING.get(*effect).and_then(|missing| missing.line()), &values[..])
        else {
            return Vec::new();
        };
        let line = Line { ratio, amplitude, phase: phase_deg.to_radians(), tilts };
        let (promised, own) = self.promising(line, highest);
        let others = promised.into_iter().filter(|(other, ..)| (other - own).abs() >= 1e-3);
        let with = |(ratio, amplitude, phase, worse): (f64, f64, f64, f64)| {
            let mut settings = settings.to_vec();
            settings[place].values = vec![ratio, amplitude, phase.to_degrees()];
            OtherRatio { ratio, worse, settings }
        };
        others.map(with).collect()
    }
}
