//! The traces for the closed loop.
//!
//! Every reading is fitted at its own place: the part and the slide are cubic splines along z, each trace has an offset and a
//! slope, and the effects are applied to the splines ([`crate::effects`]), so that readings are not interpolated and their
//! noise stays as it is wherever a trace is shifted to. Without a bound on the slide's waves, sum and difference of part and
//! slide, one spline for each setup, say the same: then a setup without repeats has nothing that contradicts it, and is
//! left out. With the bound, part and slide have splines of their own.

use std::sync::{Arc, OnceLock};

use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::{Bias, Effect, Fit, LookedAt, Model, Remainder, Setting, diagnosis::Unexplained, tested::Tested},
    consistency::Check,
    numerics::least_squares::Basis,
};

use crate::{
    contrasts::Contrasts,
    data::Data,
    design::Design,
    effects::{Alteration, Candidate, Content, Kind, USUAL_TIME_CONSTANT, alterations},
    trace::AxialTrace,
};

/// Blocks of z of which every second one is a half of the data.
const BLOCKS: f64 = 16.0;
/// Shifts that are tried on each side.
const MOST_SHIFTS: f64 = 40.0;

/// The traces and what they may lack.
#[derive(Clone)]
pub(crate) struct TracesModel(Arc<Data>);

impl TracesModel {
    pub(crate) fn new(data: Data) -> Self {
        Self(Arc::new(data))
    }

    pub(crate) fn data(&self) -> &Data {
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
        let contrasts = Contrasts::of(&design);
        let remainder = Remainder {
            residual: left.iter().map(|value| value / scale).collect(),
            structure: Arc::new(contrasts.structure()),
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
            contrasts,
            declared: OnceLock::new(),
            judged: OnceLock::new(),
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

    fn is_possible(&self, effect: usize, values: &[f64]) -> bool {
        let Some(candidate) = self.0.candidates.get(effect) else { return true };
        let mut alone = Alteration::default();
        alone.add(candidate.kind, values);
        alone.beyond(self.0.max_shift_mm).is_none()
    }

    /// A shift begins where the traces agree best among shifts a knot apart: features are narrow, so that the error has many
    /// minima. A drift begins with a usual time constant.
    fn start(&self, effect: usize, _fit: &TracesFit, applied: &[Setting]) -> Option<Vec<f64>> {
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
pub(crate) struct TracesFit {
    pub design: Design,
    /// What the tests are made on.
    pub contrasts: Contrasts,
    /// Orthonormal columns of what is declared, in contrasts.
    declared: OnceLock<Basis>,
    pub judged: OnceLock<Tested>,
    /// Part and slide at each reading.
    contents: Vec<Content>,
    pub applied: Vec<Setting>,
    pub remainder: Remainder,
    /// Effects and the covariance of their parameters.
    uncertain: Vec<(Vec<usize>, Vec<Vec<f64>>)>,
    /// Weights of this fit and of the others that explain the data as well.
    weights: Vec<f64>,
    others: Vec<Self>,
}

impl TracesFit {
    /// What everything that is fitted leaves of a column.
    #[cfg(test)]
    pub(crate) fn outside(&self, column: &[f64]) -> Vec<f64> {
        self.design.left(column)
    }

    /// All fits that explain the data as well, this one first, with their weights in the result.
    pub(crate) fn members(&self) -> Vec<(f64, &Self)> {
        self.weights.iter().copied().zip(std::iter::once(self).chain(&self.others)).collect()
    }

    /// Effects applied, with their values.
    pub(crate) fn applied(&self) -> &[Setting] {
        &self.applied
    }

    /// What is not known of the parameters of effects: one after the other, and their covariance.
    pub(crate) fn uncertain(&self) -> &[(Vec<usize>, Vec<Vec<f64>>)] {
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

    fn tested(&self, vector: &[f64]) -> Vec<f64> {
        self.contrasts.made(vector)
    }

    fn averaged(&self) -> f64 {
        self.contrasts.averaged
    }

    fn moves_readings(&self, effect: usize) -> bool {
        self.design.data.candidates.get(effect).is_some_and(|one| one.kind == Kind::AxialRegistration)
    }

    fn declared_columns(&self) -> &[Vec<f64>] {
        let made = || Basis::of(self.design.dense.iter().map(|column| self.contrasts.made(column)).collect());
        self.declared.get_or_init(made).columns()
    }

    fn consistency(&self) -> Vec<Check> {
        self.judged().checks.clone()
    }

    fn tested_std(&self, effect: usize) -> Vec<f64> {
        self.judged().std(effect)
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
    fn values(&self) -> Vec<LookedAt> {
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
            station: None,
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

    fn distinguished_by(&self, effects: &[usize]) -> Option<String> {
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
