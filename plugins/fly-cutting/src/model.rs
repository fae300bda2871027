//! A cut with its effects, as a model for the closed loop.
//!
//! Long because a fit answers all that the closed loop asks of it, each in a few lines.

use std::sync::{Arc, OnceLock};

use runout_core::{
    Error, Result,
    closed_loop::{
        Bias, Effect, Fit, LookedAt, Model, Remainder, Setting,
        diagnosis::{Estimated, Unexplained},
        fit::refit,
        tested::Tested,
    },
    consistency::{Check, Partition, Test, keys::among_family},
    numerics::least_squares::{Basis, dot},
};

use crate::{
    cells::Cells,
    config::FlyCuttingConfig,
    effects::{MISSING, Missing, applied, tidy},
    heights::{Heights, Row},
    passes::{Cut, Line},
    phase::{self, Phased, without_mean},
    search::{self, FEWEST_PERIODS, Left, Shift},
};

/// Other ratios of a line that are tried where another effect was found beside it.
const ELSEWHERE: usize = 6;
/// Points that the search evaluates, and those of the final fit.
const SEARCHED: usize = 160_000;
const FITTED: usize = 640_000;
/// Points by which the phase of the scallops is found.
const SAMPLED: usize = 4_000;
/// Every so many rows one is held out.
const HELD_OUT: usize = 5;
/// A nose radius of less than this share of the declared one, or of more than its inverse, is none.
const LEAST_RADIUS: f64 = 0.1;
/// Angles of a map in µrad, and changes of the cutter's radius as a share of it, that are evaluated.
const ROTATIONS_URAD: f64 = 3e4;
const CUTTERS: f64 = 0.2;

/// The data of a model.
#[derive(Debug)]
pub(crate) struct Data {
    pub config: FlyCuttingConfig,
    pub fitted: Heights,
    held_out: Heights,
    pub sample: Heights,
    pub extent_mm: [[f64; 2]; 2],
    /// Effects that are declared with their values.
    known: Vec<usize>,
}

impl Data {
    /// How an effect that shifts rows is looked for.
    fn searched(&self, missing: Missing) -> Option<Shift> {
        let (shift_mm, farthest): (fn(&Row) -> f64, f64) = match missing {
            Missing::MapRotation => (|row| 1e-6 * row.y_mm, ROTATIONS_URAD),
            Missing::CutterRadius => (|row| row.cosine.recip() - 1.0, CUTTERS * self.config.cutter_radius_mm),
            _ => return None,
        };
        Shift::new(&self.fitted.rows, shift_mm, farthest, 1e-3 * self.config.feed_um_per_rev)
    }
}

/// The model.
#[derive(Debug, Clone)]
pub(crate) struct CutModel {
    data: Arc<Data>,
    whole: Option<Arc<CutModel>>,
    effects: Vec<Effect>,
}

impl CutModel {
    /// Of a map, whose points are thinned for the search; every fifth row is held out.
    pub(crate) fn new(config: &FlyCuttingConfig, heights: &Heights, known: &[Setting]) -> Self {
        let known: Vec<usize> = known.iter().map(|setting| setting.effect).collect();
        let extent_mm = heights.extent_mm();
        let of = |fitted: Heights, held_out: Heights, whole: Option<CutModel>| {
            let sample = fitted.thinned(SAMPLED);
            let data = Data { config: config.clone(), fitted, held_out, sample, extent_mm, known: known.clone() };
            let effects = MISSING.iter().map(|missing| missing.effect()).collect();
            Self { data: Arc::new(data), whole: whole.map(Arc::new), effects }
        };
        let whole = of(heights.thinned(FITTED), heights.part(|_, _| false), None);
        let searched = heights.thinned(SEARCHED);
        let by_row = searched.rows.len() >= 2 * HELD_OUT;
        let is_held = |row: usize, point: usize| {
            let number = if by_row { row } else { point / 16 };
            number % HELD_OUT == HELD_OUT / 2
        };
        let fitted = searched.part(|row, point| !is_held(row, point));
        let held_out = searched.part(is_held);
        of(fitted, held_out, Some(whole))
    }

    /// A cut with some effects applied.
    pub(crate) fn cut(&self, settings: &[Setting]) -> Result<Cut> {
        Cut::new(&self.data.config, self.data.extent_mm, applied(settings))
            .ok_or_else(|| Error::new("fit", "the cut", "a feed or a nose radius is beyond all bounds"))
    }
}

impl CutModel {
    /// Of lines that look alike at one y, the one with which least is left of all points.
    fn best_start(&self, effect: usize, applied: &[Setting], starts: &[[f64; 3]]) -> Option<Vec<f64>> {
        let start = starts.first()?;
        let refitted = |values: &[f64]| {
            let mut settings = applied.to_vec();
            settings.push(Setting { effect, values: values.to_vec() });
            let refit = refit(self, settings, applied.len()).ok()?;
            Some((refit.chi2, refit.settings.last()?.values.clone(), refit.fit))
        };
        let Some((chi2, values, fit)) = refitted(start) else { return Some(start.to_vec()) };
        let [ratio, amplitude, phase_deg] = values[..] else { return Some(values) };
        if starts.len() == 1 {
            let tilts = MISSING[effect].line() == Some(true);
            let line = Line { ratio, amplitude, phase: phase_deg.to_radians(), tilts };
            let (promised, own) = fit.promising(line, self.data.config.max_frequency_ratio);
            let best = promised.first().filter(|best| (best.0 - own).abs() > 1e-3);
            let other =
                best.and_then(|(ratio, amplitude, phase, _)| refitted(&[*ratio, *amplitude, phase.to_degrees()]));
            return Some(other.filter(|(other, ..)| *other < chi2).map_or(values, |(_, other, _)| other));
        }
        // At the middle of the rows, where an alias has the same height, only the slope of its phase along y differs.
        let angles = self.data.fitted.rows.iter().map(|row| row.angle.to_degrees());
        let middle_deg = angles.sum::<f64>() / self.data.fitted.rows.len().max(1) as f64;
        #[allow(clippy::cast_possible_wrap, reason = "ratios up to some tens")]
        let highest = self.data.config.max_frequency_ratio as i32;
        let whole = ratio.floor() as i32;
        let shifted = (0..highest).map(|other| {
            let by = f64::from(other - whole);
            [ratio + by, amplitude, phase_deg - by * middle_deg]
        });
        let mirrored = (1..=highest).map(|other| {
            let sum = f64::from(other + whole);
            [sum - ratio, amplitude, -phase_deg - sum * middle_deg]
        });
        let left_with = |values: [f64; 3]| {
            let mut settings = applied.to_vec();
            settings.push(Setting { effect, values: values.to_vec() });
            Some((self.fit(&settings).ok()?.remainder().chi2(), values))
        };
        let others = shifted.chain(mirrored).filter(|other| (other[0] - ratio).abs() > 1e-3 && other[0] > 0.0);
        let best = others.filter_map(left_with).min_by(|one, other| one.0.total_cmp(&other.0));
        let other = best.and_then(|(_, other)| refitted(&other)).filter(|(other, ..)| *other < chi2);
        Some(other.map_or(values, |(_, other, _)| other))
    }
}

impl Model for CutModel {
    type Fit = CutFit;

    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn fit(&self, applied: &[Setting]) -> Result<CutFit> {
        if applied.iter().flat_map(|setting| &setting.values).any(|value| !value.is_finite()) {
            return Err(Error::new("fit", "the cut", "a parameter is no finite number"));
        }
        let cut = self.cut(applied)?;
        let phased = phase::fit(&cut, &self.data.fitted, &self.data.sample);
        Ok(CutFit::new(Arc::clone(&self.data), cut, phased, applied))
    }

    fn is_possible(&self, effect: usize, values: &[f64]) -> bool {
        match (MISSING.get(effect).map(|missing| missing.line()), values) {
            (Some(None), [change]) if MISSING.get(effect) == Some(&Missing::NoseRadius) => {
                let share = 1.0 + change / self.data.config.nose_radius_mm;
                (LEAST_RADIUS..=1.0 / LEAST_RADIUS).contains(&share)
            }
            (Some(Some(_)), [ratio, ..]) => {
                // Nearer to a whole ratio it is a shape that all passes have, or a bend of the table.
                let [from, to] = self.data.extent_mm[0];
                let periods = (ratio - ratio.round()).abs() * (to - from) / (1e-3 * self.data.config.feed_um_per_rev);
                let most = self.data.config.max_frequency_ratio as f64 + 0.5;
                *ratio > 0.0 && *ratio <= most && periods >= 0.5 * FEWEST_PERIODS
            }
            _ => true,
        }
    }

    fn start(&self, effect: usize, fit: &CutFit, applied: &[Setting]) -> Option<Vec<f64>> {
        let missing = MISSING.get(effect)?;
        match missing {
            Missing::FeedScale => fit.left().feed_scale(&fit.cut).map(|scale| vec![1e6 * scale]),
            Missing::MapRotation | Missing::CutterRadius => {
                let searched = self.data.searched(*missing)?;
                fit.left().shifted(&fit.cut, &searched).map(|change| vec![change])
            }
            Missing::SpindleLine(_) | Missing::TiltLine => self.best_start(effect, applied, fit.starts(*missing)),
            _ => None,
        }
    }

    fn elsewhere(&self, fit: &CutFit, applied: &[Setting], known: usize) -> Vec<Vec<Setting>> {
        let highest = self.data.config.max_frequency_ratio;
        let of_line = |place: usize| fit.other_ratios(applied, place, highest).into_iter().take(ELSEWHERE);
        // Shifts of the rows are searched anew beside what else was found.
        let of_shift = |place: usize| {
            let effect = applied[place].effect;
            MISSING.get(effect).filter(|missing| self.data.searched(**missing).is_some())?;
            let mut settings = applied.to_vec();
            settings.remove(place);
            let values = self.start(effect, &self.fit(&settings).ok()?, &settings)?;
            settings.insert(place, Setting { effect, values });
            Some(settings)
        };
        let lines = (known..applied.len()).flat_map(of_line).map(|other| other.settings);
        lines.chain((known..applied.len()).filter_map(of_shift)).collect()
    }

    fn whole(&self) -> &Self {
        self.whole.as_deref().unwrap_or(self)
    }

    fn present(&self, effect: usize, mut estimated: Vec<Estimated>) -> Vec<Estimated> {
        // A parameter that no datum moves has no uncertainty that says anything.
        for one in &mut estimated {
            one.std = one.std.filter(|std| *std > 0.0);
        }
        if MISSING.get(effect).is_some_and(|missing| missing.line().is_some())
            && let [ratio, amplitude, phase] = &mut estimated[..]
        {
            [ratio.value, amplitude.value, phase.value] = tidy([ratio.value, amplitude.value, phase.value]);
            let turns_hz = self.data.config.speed_rpm / 60.0;
            let frequency = Estimated {
                name: "frequency".into(),
                value: turns_hz * ratio.value,
                std: ratio.std.map(|std| turns_hz * std),
                unit: "Hz".into(),
            };
            estimated.push(frequency);
        }
        estimated
    }
}

/// A fitted cut.
#[derive(Debug)]
pub(crate) struct CutFit {
    pub data: Arc<Data>,
    pub cut: Cut,
    pub phased: Phased,
    settings: Vec<Setting>,
    remainder: Remainder,
    /// What the tests are made on.
    cells: Cells,
    /// Orthonormal columns of level and phase there.
    declared: OnceLock<Basis>,
    judged: OnceLock<Tested>,
    /// Starts of a line in the height and in the tilt, once they were asked for.
    starts: [OnceLock<Vec<[f64; 3]>>; 2],
}

impl CutFit {
    fn new(data: Arc<Data>, cut: Cut, phased: Phased, applied: &[Setting]) -> Self {
        let std_um = data.fitted.std_nm.map(|std_nm| 1e-3 * std_nm);
        let count = data.fitted.len();
        let free = applied.iter().filter(|setting| !data.known.contains(&setting.effect));
        let parameters =
            1 + usize::from(!phased.direction.is_empty()) + free.map(|setting| setting.values.len()).sum::<usize>();
        let dof = count.saturating_sub(parameters);
        let scale = 1e-3 / std_um.unwrap_or(1.0);
        let residual: Vec<f64> = phased.residual_nm.iter().map(|value| value * scale).collect();
        let held_out = cut.surface(&data.held_out, phased.phase_mm);
        let left = data.held_out.height_nm.iter().zip(&held_out.height_nm);
        let held_out_chi2: f64 = left.map(|(height, model)| ((height - model - phased.level_nm) * scale).powi(2)).sum();
        let rms = |chi2: f64, count: usize| (chi2 / count as f64).sqrt() * std_um.unwrap_or(1.0);
        let cells = Cells::of(&data.fitted, &phased.surface);
        let remainder = Remainder {
            rms: rms(dot(&residual, &residual), count),
            noise_floor: std_um.map_or(f64::NAN, |std| std * (dof as f64 / count.max(1) as f64).sqrt()),
            held_out_rms: rms(held_out_chi2, data.held_out.len()),
            held_out_expected_rms: std_um
                .map_or(f64::NAN, |std| std * (1.0 + parameters as f64 / count.max(1) as f64).sqrt()),
            held_out_chi2: if data.held_out.len() > 0 { held_out_chi2 } else { f64::NAN },
            disturbed_chi2: 0.0,
            structure: Arc::new(cells.structure()),
            residual,
            dof,
            unit: "um".into(),
        };
        let (declared, judged, starts) = (OnceLock::new(), OnceLock::new(), [OnceLock::new(), OnceLock::new()]);
        Self { data, cut, phased, settings: applied.to_vec(), remainder, cells, declared, judged, starts }
    }

    /// What the tests of the passes say.
    fn judged(&self) -> &Tested {
        self.judged.get_or_init(|| {
            let free: Vec<&Setting> =
                self.settings.iter().filter(|setting| !self.data.known.contains(&setting.effect)).collect();
            let effects: Vec<Effect> = MISSING.iter().map(|missing| missing.effect()).collect();
            let mut tested = Tested::of(self, &free, &effects, self.data.fitted.std_nm.unwrap_or(1e3), "nm");
            // Single places are found point by point ([`crate::strangers`]).
            tested.checks.retain(|check| check.test != Test::Rows);
            tested
        })
    }

    pub(crate) fn left(&self) -> Left<'_> {
        Left { heights: &self.data.fitted, surface: &self.phased.surface, residual_nm: &self.phased.residual_nm }
    }

    /// Values of an effect that are applied.
    fn values(&self, missing: Missing) -> Option<&[f64]> {
        let is = |setting: &&Setting| MISSING.get(setting.effect) == Some(&missing);
        self.settings.iter().find(is).map(|setting| setting.values.as_slice())
    }

    /// Values at which the search of a line begins, the best first. One after the other: the second line is looked for beside the first.
    fn starts(&self, missing: Missing) -> &[[f64; 3]] {
        let Some(tilts) = missing.line() else { return &[] };
        if let Missing::SpindleLine(number) = missing
            && number > 0
            && self.values(Missing::SpindleLine(number - 1)).is_none()
        {
            return &[];
        }
        let values = |line: Line| [line.ratio, line.amplitude, line.phase.to_degrees()];
        self.starts[usize::from(tilts)].get_or_init(|| self.best_lines(tilts).into_iter().map(values).collect())
    }

    /// Feeds from the pass nearest to x = 0 to the pass 0 of the fit: the same surface has every whole number of them.
    pub(crate) fn feeds_off(&self) -> f64 {
        (self.phased.phase_mm / self.cut.feed_mm).round()
    }

    /// Phase of the scallops and its standard uncertainty, in µm, where it shows.
    pub(crate) fn phase_um(&self) -> Option<[f64; 2]> {
        let norm = self.phased.norm_nm_per_mm?;
        let level = self.remainder.chi2_per_dof();
        let noise_nm = match self.data.fitted.std_nm {
            Some(std_nm) => std_nm * level.max(1.0).sqrt(),
            None => 1e3 * level.sqrt(),
        };
        let nearest_mm = self.phased.phase_mm - self.cut.feed_mm * self.feeds_off();
        Some([1e3 * nearest_mm, 1e3 * noise_nm / norm])
    }

    /// Points that were fitted.
    pub(crate) fn heights(&self) -> &Heights {
        &self.data.fitted
    }
}

impl Fit for CutFit {
    fn remainder(&self) -> &Remainder {
        &self.remainder
    }

    fn signature(&self, effect: usize) -> Vec<Vec<f64>> {
        let Some(missing) = MISSING.get(effect).copied() else { return Vec::new() };
        let values = match (self.values(missing), missing.line()) {
            (Some(values), _) => values.to_vec(),
            (None, Some(_)) => match self.starts(missing).first() {
                Some(start) => start.to_vec(),
                None => return vec![vec![0.0; self.data.fitted.len()]; 3],
            },
            (None, None) => vec![0.0; missing.effect().parameters.len()],
        };
        let mut columns = missing.partials(&values, &self.cut, &self.data.fitted, &self.phased.surface);
        let scale = -self.data.fitted.std_nm.unwrap_or(1e3).recip();
        let direction = &self.phased.direction;
        for column in &mut columns {
            without_mean(column);
            let share = dot(direction, column);
            column.iter_mut().zip(direction).for_each(|(entry, along)| *entry -= share * along);
            column.iter_mut().for_each(|entry| *entry *= scale);
        }
        columns
    }

    fn tested(&self, vector: &[f64]) -> Vec<f64> {
        self.cells.means(vector)
    }

    fn averaged(&self) -> f64 {
        self.cells.averaged()
    }

    fn declared_columns(&self) -> &[Vec<f64>] {
        let made = || {
            let level = vec![1.0; self.data.fitted.len()];
            let columns = [&level, &self.phased.direction].into_iter().filter(|column| !column.is_empty());
            Basis::of(columns.map(|column| self.cells.means(column)).collect())
        };
        self.declared.get_or_init(made).columns()
    }

    fn blocks_of_entries(&self) -> Option<Partition> {
        Some(self.cells.groups_of_points())
    }

    fn tried(&self, effect: usize) -> usize {
        let passes = self.cells.passes().max(1);
        match MISSING.get(effect) {
            Some(missing) if missing.line().is_some() => passes * self.data.config.max_frequency_ratio,
            Some(Missing::FeedScale) => search::feeds(passes),
            Some(missing) => self.data.searched(*missing).map_or(1, |searched| searched.tried()),
            _ => 1,
        }
    }

    /// Neighbours count by what they explain beside the line: a line that buries passes makes some of its own.
    fn among_family(&self, effect: usize, found: &[f64], left: &[f64]) -> Option<f64> {
        let (tilts, ratio) = (MISSING.get(effect)?.line()?, *found.first()?);
        let spectrum =
            |residual: &[f64]| self.cells.spectrum(&self.cells.means(residual), ratio, tilts, FEWEST_PERIODS);
        let (own, place) = spectrum(&self.remainder.residual);
        let (mut gains, _) = spectrum(left);
        *gains.get_mut(place)? = *own.get(place)?;
        among_family(&gains, place)
    }

    fn consistency(&self) -> Vec<Check> {
        self.judged().checks.clone()
    }

    fn tested_std(&self, effect: usize) -> Vec<f64> {
        self.judged().std(effect)
    }

    /// What one unit does to the surface; a line is always looked for, so that its bias says nothing.
    fn bias(&self, effect: usize) -> Vec<Bias> {
        let Some(missing) = MISSING.get(effect).copied().filter(|missing| missing.line().is_none()) else {
            return Vec::new();
        };
        let parameters = missing.effect().parameters;
        let columns =
            missing.partials(&vec![0.0; parameters.len()], &self.cut, &self.data.fitted, &self.phased.surface);
        let of = |(parameter, column): (runout_core::closed_loop::Parameter, Vec<f64>)| Bias {
            on: "surface".into(),
            value: (dot(&column, &column) / column.len().max(1) as f64).sqrt(),
            unit: format!("nm/{}", parameter.unit),
        };
        parameters.into_iter().zip(columns).map(of).collect()
    }

    fn values(&self) -> Vec<LookedAt> {
        Vec::new()
    }

    fn unexplained(&self) -> Vec<Unexplained> {
        let left = &self.remainder;
        if !left.noise_is_known() {
            return Vec::new();
        }
        let excess = left.rms.powi(2) - left.noise_floor.powi(2);
        let extent = |of: [f64; 2]| format!("{:.3} to {:.3} mm", of[0], of[1]);
        vec![Unexplained {
            station: None,
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: excess.max(0.0).sqrt(),
            place: format!(
                "all over the map: x {}, y {}",
                extent(self.data.extent_mm[0]),
                extent(self.data.extent_mm[1])
            ),
        }]
    }
}
