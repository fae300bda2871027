//! The traces for the closed loop.
//!
//! Every reading is fitted at its own place: the part and the slide are cubic splines along z, each trace has an offset and a
//! slope, and the effects are applied to the splines ([`crate::effects`]), so that readings are not interpolated and their
//! noise stays as it is wherever a trace is shifted to. Without a bound on the slide's waves, sum and difference of part and
//! slide, one spline for each setup, say the same: then a setup without repeats has nothing that contradicts it, and is
//! left out. With the bound, part and slide have splines of their own.

use std::sync::Arc;

use runout_core::{
    Error, ErrorKind, Result,
    model::{Bias, Effect, Fit, Model, Outcome, Remainder, Setting, diagnosis::Unexplained},
    numerics::least_squares::{Basis, norm},
};

use crate::{
    data::Data,
    effects::{Alteration, Candidate, Content, Kind, USUAL_TIME_CONSTANT, alterations},
    spline::{Banded, Knots, Local},
    trace::AxialTrace,
};

/// Knots of the splines are this many spacings of the coarsest trace apart.
const KNOT_SPACINGS: f64 = 1.5;
/// Blocks of z of which every second one is a half of the data.
const BLOCKS: f64 = 16.0;
/// Stretches of z that have to agree on an effect.
const STRETCHES: usize = 8;
/// Shifts that are tried on each side.
const MOST_SHIFTS: f64 = 40.0;
/// A column of which the splines leave less than this share is in their span.
const INDEPENDENT: f64 = 1e-7;

/// The traces and what they may lack.
#[derive(Clone)]
pub struct TracesModel(Arc<Data>);

/// Readings that something contradicts, and the splines that they are fitted by.
struct Readings {
    /// Trace and point, in the order of z.
    of: Vec<(usize, usize)>,
    part: Knots,
    slide: Option<Knots>,
    /// The first spline of each setup's own; the same where the slide has its own.
    first: [usize; 2],
    splines: usize,
}

impl Data {
    fn repeats(&self, setup: usize) -> usize {
        self.setups.iter().filter(|own| **own == setup).count()
    }

    fn readings(&self) -> Readings {
        let used = |trace: usize| self.slide_cutoff_mm.is_some() || self.repeats(self.setups[trace]) > 1;
        let mut of: Vec<(usize, usize)> = (0..self.traces.len())
            .filter(|trace| used(*trace))
            .flat_map(|trace| (0..self.traces[trace].z_mm.len()).map(move |point| (trace, point)))
            .collect();
        of.sort_by(|a, b| self.traces[a.0].z_mm[a.1].total_cmp(&self.traces[b.0].z_mm[b.1]));
        let ends = |end: usize| self.traces.iter().map(move |trace| trace.range_mm()[end]);
        let range = [ends(0).fold(f64::INFINITY, f64::min), ends(1).fold(f64::NEG_INFINITY, f64::max)];
        let spacing = self.traces.iter().map(AxialTrace::spacing_mm).fold(0.0, f64::max);
        let part = Knots::over(range, KNOT_SPACINGS * spacing);
        let slide = self.slide_cutoff_mm.map(|cutoff| Knots::over(range, 0.5 * cutoff));
        let first = [0, if slide.is_some() { 0 } else { part.splines() }];
        Readings { of, part, slide, first, splines: first[1] + part.splines() }
    }
}

impl TracesModel {
    pub fn new(data: Data) -> Self {
        Self(Arc::new(data))
    }

    pub fn data(&self) -> &Data {
        &self.0
    }

    fn alterations(&self, applied: &[Setting]) -> Result<Vec<Alteration>> {
        let all = alterations(&self.0.candidates, applied, self.0.traces.len());
        for (alteration, trace) in all.iter().zip(&self.0.traces) {
            if let Some(problem) = alteration.beyond(self.0.max_shift_mm) {
                return Err(Error::new("fit", format!("trace {}", trace.id), problem).of(ErrorKind::Numerical));
            }
        }
        Ok(all)
    }

    /// χ² with these effects, in units of 1 µm or the known noise.
    fn chi2(&self, applied: &[Setting]) -> Result<f64> {
        let design = Design::new(&self.0, self.alterations(applied)?);
        let left = design.left(&design.readings_um());
        Ok(left.iter().map(|value| value * value).sum::<f64>() / self.0.std_um.unwrap_or(1.0).powi(2))
    }
}

/// The linear part of the model with some effects applied.
struct Design {
    data: Arc<Data>,
    readings: Readings,
    alterations: Vec<Alteration>,
    /// The part's splines at each reading, and what they count there.
    local: Vec<(Local, f64)>,
    /// Of the slide's.
    slide: Vec<(Local, f64)>,
    /// Lines of the traces and splines of the slide, `[column][reading]`, without those in the span of others.
    dense: Vec<Vec<f64>>,
    /// Which of the slide's splines each column is; nothing for lines.
    dense_slide: Vec<Option<usize>>,
    /// What the part's splines leave of them.
    basis: Basis,
    rank: usize,
}

impl Design {
    fn new(data: &Arc<Data>, mut alterations: Vec<Alteration>) -> Self {
        let readings = data.readings();
        if readings.slide.is_none() {
            // A setup's own splines are what the probe sees of the part, turned or not, and move with its traces: only the
            // differences of their shifts count.
            for alteration in &mut alterations {
                alteration.turned_deg = 0.0;
            }
            for setup in [0, 1] {
                let of = |own: &(usize, &usize)| *own.1 == setup;
                let members: Vec<usize> = data.setups.iter().enumerate().filter(of).map(|(trace, _)| trace).collect();
                let mean = members.iter().map(|trace| alterations[*trace].shift_mm).sum::<f64>() / members.len() as f64;
                for trace in members {
                    alterations[trace].shift_mm -= mean;
                }
            }
        }
        let at = |knots: &Knots, (trace, point): (usize, usize)| {
            knots.at(data.traces[trace].z_mm[point] + alterations[trace].shift_mm)
        };
        let sign = |trace: usize| if data.setups[trace] == 0 { 1.0 } else { -1.0 };
        let gain = |trace: usize| 1.0 + alterations[trace].gain;
        let local = readings.of.iter().map(|place| {
            let mut local = at(&readings.part, *place);
            local.start += readings.first[data.setups[place.0]];
            (local, gain(place.0) * alterations[place.0].cosine())
        });
        let local: Vec<(Local, f64)> = local.collect();
        let slide = match &readings.slide {
            Some(knots) => {
                let own = readings.of.iter().map(|place| (at(knots, *place), gain(place.0) * sign(place.0)));
                own.collect()
            }
            None => Vec::new(),
        };
        let mut design = Self {
            data: Arc::clone(data),
            readings,
            alterations,
            local,
            slide,
            dense: Vec::new(),
            dense_slide: Vec::new(),
            basis: Basis::of(Vec::new()),
            rank: 0,
        };
        design.add_dense();
        design
    }

    /// Lines and the slide's splines, as far as they are independent of the part's splines and of each other.
    fn add_dense(&mut self) {
        let data = Arc::clone(&self.data);
        let of = &self.readings.of;
        let line = |own: usize, power: i32| -> Vec<f64> {
            let value = |(trace, point): &(usize, usize)| {
                let z_mm = data.traces[*trace].z_mm[*point];
                if *trace == own { ((z_mm - data.middle_mm) / data.length_mm).powi(power) } else { 0.0 }
            };
            of.iter().map(value).collect()
        };
        let lines = (0..data.traces.len()).flat_map(|trace| [(None, line(trace, 0)), (None, line(trace, 1))]);
        let splines = (0..self.readings.slide.map_or(0, |knots| knots.splines())).map(|spline| {
            let value = |(local, factor): &(Local, f64)| {
                let own = spline.checked_sub(local.start).and_then(|index| local.value.get(index));
                factor * own.copied().unwrap_or(0.0)
            };
            (Some(spline), self.slide.iter().map(value).collect::<Vec<f64>>())
        });
        let columns: Vec<(Option<usize>, Vec<f64>)> =
            lines.chain(splines).filter(|(_, column)| column.iter().any(|value| *value != 0.0)).collect();
        let (solutions, rank) =
            self.splines_of(&columns.iter().map(|(_, column)| column.as_slice()).collect::<Vec<_>>());
        self.rank = rank;
        for ((slide, column), solution) in columns.into_iter().zip(solutions) {
            let left = self.less_splines(&column, &solution);
            if norm(&left) < INDEPENDENT * norm(&column) {
                continue;
            }
            let next = self.basis.extended(vec![left]);
            if !next.dependent() {
                self.basis = next;
                self.dense.push(column);
                self.dense_slide.push(slide);
            }
        }
        self.rank += self.basis.rank();
    }

    /// Least-squares coefficients of the part's splines for some columns, and their rank.
    fn splines_of(&self, columns: &[&[f64]]) -> (Vec<Vec<f64>>, usize) {
        let mut problem = Banded::new(self.readings.splines, columns.len());
        let mut sides = vec![0.0; columns.len()];
        for (reading, (local, factor)) in self.local.iter().enumerate() {
            sides.iter_mut().zip(columns).for_each(|(side, column)| *side = column[reading]);
            problem.add(local.start, local.value.map(|value| value * factor), &mut sides);
        }
        (problem.solve(), problem.rank())
    }

    fn less_splines(&self, column: &[f64], coefficients: &[f64]) -> Vec<f64> {
        let rows = column.iter().zip(&self.local);
        rows.map(|(value, (local, factor))| value - factor * local.of(coefficients)).collect()
    }

    /// What everything that is fitted leaves of a column.
    fn left(&self, column: &[f64]) -> Vec<f64> {
        let (solutions, _) = self.splines_of(&[column]);
        let mut left = solutions.first().map_or_else(Vec::new, |solution| self.less_splines(column, solution));
        self.basis.remove_from(&mut left);
        left
    }

    /// The readings less what is added to them whatever part and slide are.
    fn readings_um(&self) -> Vec<f64> {
        let value = |(trace, point): &(usize, usize)| {
            let alteration = &self.alterations[*trace];
            let added = (1.0 + alteration.gain) * alteration.added(&self.data.place(*trace, *point));
            self.data.traces[*trace].reading_um[*point] - added
        };
        self.readings.of.iter().map(value).collect()
    }

    /// Part and slide at each reading. Where the slide has no splines of its own, the part's are those of the sum of both.
    fn contents(&self, readings_um: &[f64]) -> Vec<Content> {
        let (solutions, _) = self.splines_of(&[readings_um]);
        let Some(alone) = solutions.first() else { return Vec::new() };
        let dense = self.basis.coefficients(&self.less_splines(readings_um, alone));
        let mut rest = readings_um.to_vec();
        for (column, value) in self.dense.iter().zip(&dense) {
            rest.iter_mut().zip(column).for_each(|(entry, column)| *entry -= value * column);
        }
        let (solutions, _) = self.splines_of(&[rest.as_slice()]);
        let mut slide = vec![0.0; self.readings.slide.map_or(0, |knots| knots.splines())];
        for (spline, value) in self.dense_slide.iter().zip(&dense) {
            if let Some(entry) = spline.and_then(|spline| slide.get_mut(spline)) {
                *entry = *value;
            }
        }
        let part = solutions.first().map_or(&[][..], Vec::as_slice);
        let content = |(reading, (local, _)): (usize, &(Local, f64))| {
            let slide =
                self.slide.get(reading).map_or([0.0; 2], |(local, _)| [local.of(&slide), local.slope_of(&slide)]);
            Content { part: [local.of(part), local.slope_of(part)], slide }
        };
        self.local.iter().enumerate().map(content).collect()
    }
}

impl Model for TracesModel {
    type Fit = TracesFit;

    fn effects(&self) -> &[Effect] {
        &self.0.effects
    }

    fn fit(&self, applied: &[Setting]) -> Result<TracesFit> {
        let data = Arc::clone(&self.0);
        let design = Design::new(&data, self.alterations(applied)?);
        let readings_um = design.readings_um();
        let left = design.left(&readings_um);
        let contents = design.contents(&readings_um);
        let (count, dof) = (left.len(), left.len().saturating_sub(design.rank));
        let scale = data.std_um.unwrap_or(1.0);
        let squares: f64 = left.iter().map(|value| value * value).sum();
        let stretch = count.div_ceil(STRETCHES).max(1);
        let remainder = Remainder {
            residual: left.iter().map(|value| value / scale).collect(),
            stretches: (0..count).step_by(stretch).map(|start| stretch.min(count - start)).collect(),
            dof,
            rms: (squares / count.max(1) as f64).sqrt(),
            noise_floor: data.std_um.map_or(f64::NAN, |std| std * (dof as f64 / count.max(1) as f64).sqrt()),
            held_out_rms: f64::NAN,
            disturbed_chi2: 0.0,
            held_out_expected_rms: f64::NAN,
            held_out_chi2: f64::NAN,
            unit: "um".into(),
        };
        let mut fit = TracesFit {
            design,
            contents,
            applied: applied.to_vec(),
            remainder,
            uncertain: Vec::new(),
            weights: vec![1.0],
            others: Vec::new(),
        };
        let held_out = fit.held_out(&left);
        let squares: f64 = held_out.iter().map(|value| value * value).sum();
        if count > 0 {
            fit.remainder.held_out_rms = (squares / count as f64).sqrt();
            fit.remainder.held_out_chi2 = squares / (scale * scale);
            fit.remainder.held_out_expected_rms = fit.held_out_expected_um();
        }
        Ok(fit)
    }

    /// A shift begins where the traces agree best among shifts a knot apart: features are narrow, so that the error has many
    /// minima. A drift begins with a usual time constant.
    fn start(&self, effect: usize, applied: &[Setting]) -> Option<Vec<f64>> {
        let candidate = self.0.candidates.get(effect)?;
        match candidate.kind {
            Kind::ThermalDrift => Some(vec![0.0, USUAL_TIME_CONSTANT]),
            Kind::AxialRegistration => {
                let spacing = self.0.traces.iter().map(AxialTrace::spacing_mm).fold(0.0, f64::max);
                let step = spacing.max(self.0.max_shift_mm / MOST_SHIFTS);
                let most = (self.0.max_shift_mm / step).floor();
                let shifts = (-most as i32..=most as i32).map(|index| f64::from(index) * step);
                let chi2 = |shift: f64| {
                    let setting = Setting { effect, values: vec![shift] };
                    self.chi2(&[applied, &[setting]].concat()).unwrap_or(f64::INFINITY)
                };
                let best = shifts.map(|shift| (chi2(shift), shift)).min_by(|a, b| a.0.total_cmp(&b.0))?;
                (best.1 != 0.0).then(|| vec![best.1])
            }
            // The cosine has no slope at 0.
            Kind::RotationOffset => Some(vec![5.0]),
            Kind::SensorGain | Kind::PartTilt => None,
        }
    }
}

/// A fit of the traces.
pub struct TracesFit {
    design: Design,
    /// Part and slide at each reading.
    contents: Vec<Content>,
    applied: Vec<Setting>,
    remainder: Remainder,
    /// Effects and the covariance of their parameters.
    uncertain: Vec<(Vec<usize>, Vec<Vec<f64>>)>,
    /// Weights of this fit and of the others that explain the data as well.
    weights: Vec<f64>,
    others: Vec<Self>,
}

impl TracesFit {
    /// What everything that is fitted leaves of a column.
    #[cfg(test)]
    pub fn outside(&self, column: &[f64]) -> Vec<f64> {
        self.design.left(column)
    }

    /// All fits that explain the data as well, this one first, with their weights in the result.
    pub fn members(&self) -> Vec<(f64, &Self)> {
        self.weights.iter().copied().zip(std::iter::once(self).chain(&self.others)).collect()
    }

    /// Effects applied, with their values.
    pub fn applied(&self) -> &[Setting] {
        &self.applied
    }

    /// What is not known of the parameters of effects: one after the other, and their covariance.
    pub fn uncertain(&self) -> &[(Vec<usize>, Vec<Vec<f64>>)] {
        &self.uncertain
    }

    fn values_of(&self, effect: usize) -> Option<&[f64]> {
        self.applied.iter().find(|setting| setting.effect == effect).map(|setting| setting.values.as_slice())
    }

    /// How much of an effect acts on a trace. Where shifts count from the mean of a setup, each acts on all of its traces.
    fn share(&self, candidate: &Candidate, trace: usize) -> f64 {
        let data = &self.design.data;
        let own = f64::from(u8::from(candidate.traces.contains(&trace)));
        if candidate.kind != Kind::AxialRegistration || data.slide_cutoff_mm.is_some() {
            return own;
        }
        let setup = data.setups[trace];
        let acted_on = candidate.traces.iter().filter(|other| data.setups[**other] == setup).count();
        own - acted_on as f64 / data.repeats(setup) as f64
    }

    /// Derivatives of the readings by an effect's parameters, `[parameter][reading]`.
    fn columns(&self, effect: usize) -> Vec<Vec<f64>> {
        let Some(candidate) = self.design.data.candidates.get(effect) else { return Vec::new() };
        let mut columns = vec![vec![0.0; self.contents.len()]; candidate.effect.parameters.len()];
        let mut partials = vec![0.0; columns.len()];
        for (reading, ((trace, point), content)) in self.design.readings.of.iter().zip(&self.contents).enumerate() {
            let share = self.share(candidate, *trace);
            if share != 0.0 {
                // Without splines of its own, the slide is in those of the part, with its sign.
                let place = self.design.data.place(*trace, *point);
                let alteration = &self.design.alterations[*trace];
                alteration.partials(candidate.kind, self.values_of(effect), &place, content, &mut partials);
                columns.iter_mut().zip(&partials).for_each(|(column, partial)| column[reading] = share * partial);
            }
        }
        columns
    }

    /// What the fit leaves of each reading where effects are fitted to the other half of z, and its trace is predicted by the
    /// others (as generalised cross-validation does: Craven, Wahba, Numer. Math. 31 (1979) 377).
    fn held_out(&self, left: &[f64]) -> Vec<f64> {
        let data = &self.design.data;
        let share = self.design.rank as f64 / left.len().max(1) as f64;
        let half = |reading: usize| {
            let (trace, point) = self.design.readings.of[reading];
            let along = (data.traces[trace].z_mm[point] - data.middle_mm) / data.length_mm + 0.5;
            (along * BLOCKS).floor().rem_euclid(2.0) < 0.5
        };
        let free = self.applied.iter().filter(|setting| !data.known.contains(&setting.effect));
        let columns: Vec<Vec<f64>> = free.flat_map(|setting| self.signature_um(setting.effect)).collect();
        let mut found = left.to_vec();
        for own in [true, false] {
            let others: Vec<usize> = (0..left.len()).filter(|reading| half(*reading) != own).collect();
            let of = |column: &[f64]| -> Vec<f64> { others.iter().map(|reading| column[*reading]).collect() };
            let mut basis = Basis::of(Vec::new());
            let mut kept = Vec::new();
            for column in &columns {
                let next = basis.extended(vec![of(column)]);
                if !next.dependent() {
                    basis = next;
                    kept.push(column);
                }
            }
            let changes = basis.coefficients(&of(left));
            for reading in (0..left.len()).filter(|reading| half(*reading) == own) {
                let change: f64 = kept.iter().zip(&changes).map(|(column, change)| column[reading] * change).sum();
                found[reading] = (left[reading] - change) / (1.0 - share);
            }
        }
        found
    }

    /// What noise leaves of [`held_out`](Self::held_out), in µm: of n readings with the share h of what is fitted,
    /// σ²·(1 − h)·(n + 2p)/(1 − h)², since the p parameters of the effects come from the other half, which is taken to be
    /// like the first. NaN where the noise is not known.
    fn held_out_expected_um(&self) -> f64 {
        let Some(std_um) = self.design.data.std_um else { return f64::NAN };
        let count = self.contents.len() as f64;
        let free = self.applied.iter().filter(|setting| !self.design.data.known.contains(&setting.effect));
        let parameters = free.map(|setting| setting.values.len()).sum::<usize>() as f64;
        let share = self.design.rank as f64 / count;
        std_um * ((1.0 + 2.0 * parameters / count) / (1.0 - share)).sqrt()
    }

    /// [`Fit::signature`] in µm, of the readings.
    fn signature_um(&self, effect: usize) -> Vec<Vec<f64>> {
        self.columns(effect).iter().map(|column| self.design.left(column)).collect()
    }
}

impl Fit for TracesFit {
    fn remainder(&self) -> &Remainder {
        &self.remainder
    }

    fn signature(&self, effect: usize) -> Vec<Vec<f64>> {
        let scale = -self.design.data.std_um.unwrap_or(1.0).recip();
        let mut columns = self.signature_um(effect);
        columns.iter_mut().flatten().for_each(|entry| *entry *= scale);
        columns
    }

    fn bias(&self, effect: usize) -> Vec<Bias> {
        self.design.data.results.bias(&self.design.data, &self.applied, effect)
    }

    fn results(&self) -> Vec<f64> {
        self.design.data.results.of(&self.design.data, &self.applied).into_iter().flatten().collect()
    }

    fn mix(&mut self, weights: &[f64], others: Vec<Self>) {
        self.weights = weights.to_vec();
        self.others = others;
    }

    /// Left to who has the final straightness.
    fn values(&self) -> Vec<Outcome> {
        Vec::new()
    }

    fn widen(&mut self, effects: &[usize], covariance: &[Vec<f64>]) {
        self.uncertain.push((effects.to_vec(), covariance.to_vec()));
    }

    fn unexplained(&self) -> Vec<Unexplained> {
        let data = &self.design.data;
        let of = |trace: usize| -> f64 {
            let own = self.design.readings.of.iter().zip(&self.remainder.residual).filter(|((at, _), _)| *at == trace);
            own.map(|(_, value)| value * value).sum()
        };
        let worst = (0..data.traces.len()).map(|trace| (of(trace), trace)).max_by(|a, b| a.0.total_cmp(&b.0));
        let excess = self.remainder.rms.powi(2) - self.remainder.noise_floor.powi(2);
        let report = |(sum, trace): (f64, usize)| Unexplained {
            sensor: None,
            setup: data
                .candidates
                .iter()
                .find(|one| one.traces.contains(&trace))
                .and_then(|one| one.effect.targets.first().cloned()),
            orders: [0, 0],
            rms_um: excess.max(0.0).sqrt(),
            place: format!(
                "most of it in trace {} ({:.0} % of the squares)",
                data.traces[trace].id,
                100.0 * sum / self.remainder.chi2()
            ),
        };
        worst.map(report).into_iter().collect()
    }

    fn told_apart_by(&self, effects: &[usize]) -> Option<String> {
        let members: Vec<&Candidate> =
            effects.iter().filter_map(|effect| self.design.data.candidates.get(*effect)).collect();
        let has = |kind: Kind| members.iter().any(|one| one.kind == kind);
        let traces = members.iter().flat_map(|one| &one.traces);
        let setups: Vec<usize> = traces.filter_map(|trace| self.design.data.setups.get(*trace).copied()).collect();
        let two = setups.first().is_some_and(|setup| self.design.data.repeats(*setup) == 2);
        if has(Kind::PartTilt) && has(Kind::ThermalDrift) {
            Some("a trace measured backwards: a drift turns round with it, a tilt does not".into())
        } else if members.len() > 1 && two && members.iter().all(|one| one.traces.len() == 1) {
            Some("a third trace in the same setup".into())
        } else if has(Kind::SensorGain) {
            Some("a calibration of the probe before each setup".into())
        } else {
            None
        }
    }
}
