//! The closed loop of the separator `rotary-axis`.
//!
//! Component errors are free at each command, so the loop works with the part of the readings that they cannot reach
//! ([`redundant`]). With three balls that is three numbers a command: the distances between the balls. Commands are the groups that
//! are held out. The final result is the joint fit of location errors, component errors, placement and the effects that were added.

use nalgebra::Vector3;
use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::{
        self, Effect, Fit as _, Setting, Settings,
        diagnosis::{Diagnosis, Estimated, Unexplained, Verdict},
        linear_terms::{Declared, LinearTerms, Observations, Term},
    },
    consistency::Check,
    points::Points,
    stage::{Outcome, PointDiagnosis, PointModel, PointSeparator},
    summary::moved,
};

use crate::{
    campaign::Campaign,
    config::RotaryAxis,
    consistency::{Offsets, combination, of_passes},
    effects::{CANDIDATES, Candidate, Shapes, TRIED, USUAL, tried},
    nest::{self, Nest},
    noise::Noise,
    rows::Rows,
    scale::scale,
    solve::{Column, fit, redundant},
};

/// Runs of the loop in which shapes settle, and the share of a change at which they are settled.
const MOST_RUNS: usize = 5;
const SETTLED: f64 = 0.01;
/// Sizes in what is usual of an effect that no machine has.
const ABSURD: f64 = 1000.0;

impl PointModel for RotaryAxis {
    fn effects(&self) -> Vec<Effect> {
        CANDIDATES.iter().map(|candidate| candidate.effect()).collect()
    }

    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        let failure = |problem: String| {
            Error::new("diagnose", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
        };
        let mut campaign = Campaign::of(&self.0, points)?;
        let declared = self.separate(points)?;
        let before = fit(&campaign.layout, &campaign.readings, &[]).map_err(failure)?.residual;
        let mut settings = settings.clone();
        let is_step = |known: &&Setting| matches!(CANDIDATES.get(known.effect), Some(Candidate::Step(_)));
        if settings.known.iter().filter(is_step).any(|known| known.values.get(1).is_none_or(|at| *at <= 0.0)) {
            let problem = "the known `nest-step` has no time".to_owned();
            return Err(failure(problem)
                .of(ErrorKind::Configuration)
                .help("add `at`, the share of the campaign before it: `values = { step = 6.0, at = 0.5 }`"));
        }
        self.take_known(&mut campaign, &settings.known);
        // What is taken from the readings is known with 0 more of it, and not looked for.
        settings.known.iter_mut().for_each(|known| known.values.iter_mut().for_each(|value| *value = 0.0));
        if of_passes(&campaign).is_some_and(|check| check.bars_verdict()) {
            // Readings at wrong places show effects that are not there.
            settings.max_added = 0;
        }
        let mut run = self.settled(&campaign, &settings).map_err(failure)?;
        let doubtful = run.doubtful();
        if !doubtful.is_empty() {
            settings.left_out.extend(doubtful);
            run = self.settled(&campaign, &settings).map_err(failure)?;
        }
        self.report(points, &campaign, &declared, &before, &settings, run)
    }
}

/// One run of the loop at fixed shapes.
struct Run {
    diagnosis: Diagnosis,
    /// Effects that were added, with their values; of each set the first.
    added: Vec<Setting>,
    shapes: Shapes,
    rows: Rows,
    /// Where most is left.
    left: Vec<Unexplained>,
}

impl Run {
    /// Effects that are not accepted: of a size that no machine has, as those have that the rows hardly show; and, where something else is in
    /// the data, steps: their time is free, so that they take a part of much that is none.
    fn doubtful(&self) -> Vec<usize> {
        let absurd = |setting: &Setting| {
            let parameters =
                CANDIDATES.get(setting.effect).map_or_else(Vec::new, |candidate| candidate.effect().parameters);
            setting.values.iter().zip(&parameters).any(|(value, known)| value.abs() > ABSURD * known.tolerance)
        };
        let absurd: Vec<usize> = self.added.iter().filter(|one| absurd(one)).map(|one| one.effect).collect();
        let is_step = |index: &usize| matches!(CANDIDATES[*index], Candidate::Step(_));
        let unexplained = self.diagnosis.verdict == Verdict::Unexplained || !absurd.is_empty();
        if unexplained && self.added.iter().any(|one| is_step(&one.effect)) {
            return absurd.into_iter().chain((0..CANDIDATES.len()).filter(is_step)).collect();
        }
        absurd
    }

    /// Errors of the nest that explain as much as scale and squareness that were added.
    fn nests(&self) -> Vec<Nest> {
        let columns_of = |setting: &Setting| {
            self.rows.data.effects[self.rows.first[setting.effect]..]
                .iter()
                .take(setting.values.len())
                .cloned()
                .collect()
        };
        let added: Vec<(bool, Vec<Vec<f64>>)> = self
            .added
            .iter()
            .map(|setting| {
                let of_axes =
                    matches!(CANDIDATES.get(setting.effect), Some(Candidate::Scale(_) | Candidate::Squareness(..)));
                (of_axes, columns_of(setting))
            })
            .collect();
        nest::instead(&self.rows.data, &added, self.rows.nest)
    }
}

impl RotaryAxis {
    /// Takes effects that are declared with their values out of the readings.
    fn take_known(&self, campaign: &mut Campaign, known: &[Setting]) {
        for setting in known {
            let Some(candidate) = CANDIDATES.get(setting.effect) else { continue };
            let mut shapes = USUAL;
            let mut values = setting.values.clone();
            if let (Some(place), [_, shape]) = (candidate.shape(), &setting.values[..]) {
                shapes[place] = if *shape > 0.0 { *shape } else { USUAL[place] };
                values.truncate(1);
            }
            let columns = candidate.columns(self.0.axis, campaign, &shapes);
            for (column, value) in columns.iter().zip(values) {
                campaign.readings.iter_mut().zip(column).for_each(|(reading, column)| reading.value -= column * value);
            }
        }
    }

    /// Runs until the shapes settle.
    fn settled(&self, campaign: &Campaign, settings: &Settings) -> std::result::Result<Run, String> {
        let mut grids = tried(campaign, &USUAL);
        let (_, rows) = self.assembled(campaign, USUAL, &grids)?;
        let start = rows.shapes(USUAL, &[], &grids);
        grids = tried(campaign, &start);
        let mut run = self.run(campaign, settings, start, &grids)?;
        for _ in 1..MOST_RUNS {
            let next = run.rows.shapes(run.shapes, &run.added, &grids);
            let changed = next.iter().zip(run.shapes).any(|(next, now)| (next / now - 1.0).abs() > SETTLED);
            if !changed {
                break;
            }
            grids = tried(campaign, &next);
            run = self.run(campaign, settings, next, &grids)?;
        }
        Ok(run)
    }

    fn run(
        &self,
        campaign: &Campaign,
        settings: &Settings,
        shapes: Shapes,
        grids: &[Vec<f64>; 6],
    ) -> std::result::Result<Run, String> {
        let (terms, rows) = self.assembled(campaign, shapes, grids)?;
        let terms = terms.with_known(&settings.known).considering(settings.effects.as_deref());
        let closed = closed_loop::diagnose(&terms, settings).map_err(|error| error.to_string())?;
        let added = closed.settings.into_iter().skip(settings.known.len()).collect();
        let left = closed.after.unexplained();
        Ok(Run { diagnosis: closed.diagnosis, added, shapes, rows, left })
    }

    /// The terms of the loop at the usual shapes.
    pub(crate) fn linear_terms(&self, campaign: &Campaign) -> std::result::Result<LinearTerms, String> {
        self.assembled(campaign, USUAL, &Default::default()).map(|(terms, _)| terms)
    }

    /// The terms of the loop at fixed shapes, and further ones to try.
    fn assembled(
        &self,
        campaign: &Campaign,
        shapes: Shapes,
        grids: &[Vec<f64>; 6],
    ) -> std::result::Result<(LinearTerms, Rows), String> {
        let axis = self.0.axis;
        let mut columns: Vec<Column> = Vec::new();
        let mut first = Vec::with_capacity(CANDIDATES.len());
        for candidate in CANDIDATES {
            first.push(columns.len());
            columns.extend(candidate.columns(axis, campaign, &shapes));
        }
        let mut tried = [0; 6];
        for (candidate, place) in CANDIDATES.iter().filter_map(|candidate| Some((candidate, candidate.shape()?))) {
            tried[place] = columns.len();
            let at = |shape: &f64| candidate.columns(axis, campaign, &[*shape; 6]).into_iter().next();
            columns.extend(grids[place].iter().filter_map(at));
        }
        let nest = columns.len();
        columns.extend(nest::columns(self.0.axis, campaign)?);
        let offsets = columns.len();
        let parts = Offsets::of(campaign);
        columns.extend(parts.columns(axis));
        let data = redundant(&campaign.layout, &campaign.readings, &columns)?;
        if data.rows.len() <= data.declared.len() {
            return Err(
                "nothing is redundant: component errors take up every reading. Measure three balls off one line, or \
                        declare `component_errors = false`"
                    .into(),
            );
        }
        // The loop says µm: units of the standard uncertainty times a typical one.
        let typical = typical_um(campaign);
        let sized = |column: &Vec<f64>| column.iter().map(|entry| typical * entry).collect::<Vec<f64>>();
        let observations = Observations {
            values: sized(&data.rows),
            unit: "um".into(),
            std: (campaign.noise != Noise::Unknown).then_some(typical),
            std_dof: match campaign.noise {
                Noise::Repeats { dof, .. } => Some(dof as f64),
                _ => None,
            },
            group: data.command.clone(),
            groups: campaign.commands_deg.iter().map(|deg| format!("{} = {deg}°", axis.letter())).collect(),
            structure: parts.structure(
                &data.command,
                campaign.commands_deg.len(),
                &data.effects[offsets..].iter().map(sized).collect::<Vec<_>>(),
            ),
        };
        let declared = data.declared.iter().enumerate().map(|(index, column)| Declared {
            name: combination(index),
            unit: "um".into(),
            column: column.clone(),
        });
        let terms = CANDIDATES.iter().zip(&first).map(|(candidate, first)| {
            let mut effect = candidate.effect();
            // The time of a step is looked for, and not fitted.
            effect.parameters.truncate(candidate.columns(axis, campaign, &shapes).len());
            let columns = data.effects[*first..].iter().take(effect.parameters.len()).map(sized).collect();
            Term { effect, columns, rank: 0 }
        });
        let model = LinearTerms::new(observations, declared.collect(), terms.collect())
            .map_err(|error| error.to_string())?
            .distinguished_by(
                "a calibration of the linear axes on their own, or a campaign with the balls in another order of time",
            );
        let searched = CANDIDATES.iter().enumerate().filter(|(_, one)| one.shape().is_some());
        let model = searched.fold(model, |model, (effect, _)| model.looked_for(effect, TRIED));
        Ok((model, Rows { data, first, tried, nest }))
    }

    /// Columns of effects that were added.
    fn columns_of(&self, campaign: &Campaign, effects: &[usize], shapes: &Shapes) -> Vec<Column> {
        let all = effects.iter().filter_map(|effect| CANDIDATES.get(*effect));
        all.flat_map(|candidate| candidate.columns(self.0.axis, campaign, shapes)).collect()
    }

    fn report(
        &self,
        points: &Points,
        campaign: &Campaign,
        declared: &Outcome,
        before: &[Vector3<f64>],
        settings: &Settings,
        run: Run,
    ) -> Result<PointDiagnosis> {
        let instead = run.nests();
        let Run { mut diagnosis, added, shapes, left, .. } = run;
        let names: Vec<String> = CANDIDATES.iter().map(|candidate| name(&candidate.effect())).collect();
        let effects: Vec<usize> = added.iter().map(|setting| setting.effect).collect();
        // Members of confounded sets: the results with each of them.
        let mut alternatives = Vec::new();
        for (place, found) in diagnosis.added.iter().enumerate() {
            for other in &found.confounded_with {
                let Some(member) = names.iter().position(|name| name == other) else { continue };
                let mut chosen = effects.clone();
                if let Some(own) = chosen.get_mut(place) {
                    *own = member;
                }
                alternatives.push(self.columns_of(campaign, &chosen, &shapes));
            }
        }
        // Errors of the nest that explain as much as errors of the linear axes.
        let of_nest = nest::columns(self.0.axis, campaign).unwrap_or_default();
        for Nest { index, replaced } in &instead {
            let kept: Vec<usize> =
                (0..effects.len()).filter(|place| !replaced.contains(place)).map(|place| effects[place]).collect();
            let mut columns = self.columns_of(campaign, &kept, &shapes);
            columns.extend(of_nest.get(*index).cloned());
            alternatives.push(columns);
        }
        nest::confound(&mut diagnosis, &instead);
        let columns = self.columns_of(campaign, &effects, &shapes);
        let mut after = self.fitted_outcome(points, campaign, &columns, before, &alternatives)?;
        let last = fit(&campaign.layout, &campaign.readings, &columns)
            .map_err(|problem| Error::new("fit", points.input.display().to_string(), problem))?;
        if scale(&last, campaign.noise).is_more && diagnosis.verdict != Verdict::Unexplained {
            // As the warning says.
            diagnosis.verdict = Verdict::Unexplained;
            diagnosis.unexplained.extend(left);
        }
        for (found, setting) in diagnosis.added.iter_mut().zip(&added) {
            let shape =
                CANDIDATES.get(setting.effect).and_then(|candidate| candidate.shape()).map(|place| shapes[place]);
            match (shape, &setting.values[..], found.parameters.get_mut(1)) {
                (Some(constant), [drift, ..], Some(parameter)) => {
                    // The linear column holds D·ΔT.
                    parameter.value = constant + parameter.value / drift;
                    parameter.std = parameter.std.map(|std| std / drift.abs());
                }
                (Some(at), _, None) => {
                    let (name, unit) = ("at".into(), "campaign".into());
                    found.parameters.push(Estimated { name, value: at, std: None, unit });
                }
                _ => {}
            }
        }
        diagnosis.moved = moved(&declared.values, &after.values);
        diagnosis.moved.retain(|value| value.section.is_none());
        for blind in &mut diagnosis.blind_to {
            if let Some(bias) = self.bias(campaign, blind, &names, &shapes) {
                blind.bias_per_unit = bias;
            }
        }
        if instead.is_empty() {
            diagnosis.blind_to.extend(nest::blind(self.0.axis, &last));
        }
        if !settings.known.is_empty() {
            after.remarks.push("effects that are declared as known are taken out of the readings".into());
        }
        let of_campaign =
            diagnosis.added.iter().any(|found| found.parameters.iter().any(|parameter| parameter.unit == "campaign"));
        if of_campaign && campaign.duration_s.is_finite() {
            diagnosis
                .warnings
                .push(format!("time constants are shares of the campaign, which took {:.0} s", campaign.duration_s));
        }
        diagnosis.consistency.clone_from(&after.checks);
        if diagnosis.consistency.iter().any(Check::bars_verdict) {
            diagnosis.verdict = Verdict::Unexplained;
        }
        diagnosis.warnings.append(&mut after.remarks);
        Ok(PointDiagnosis { diagnosis, after })
    }
}

fn name(effect: &Effect) -> String {
    effect.targets.iter().fold(effect.id.clone(), |name, target| format!("{name} {target}"))
}

/// Root mean square of the readings' standard uncertainties, harmonic: the typical weight.
pub(crate) fn typical_um(campaign: &Campaign) -> f64 {
    let weights: f64 = campaign.readings.iter().map(|reading| reading.std.powi(-2)).sum();
    1e3 * (campaign.readings.len() as f64 / weights).sqrt()
}
