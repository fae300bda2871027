//! The closed loop of the separator `rotary-axis`.
//!
//! Component errors are free at each command, so the loop works with the part of the readings that they cannot reach
//! ([`redundant`]). With three balls that is three numbers a command: the distances between the balls. Commands are the groups that
//! are held out. The final result is the joint fit of location errors, component errors, placement and the effects that were added.

use nalgebra::Vector3;
use runout_core::{
    Error, ErrorKind, Result,
    consistency::{Check, Kind, Structure},
    model::{
        Effect, Fit as _, Setting,
        closed_loop::{self, Settings},
        diagnosis::{Diagnosis, Moved, Unexplained, Verdict},
        linear_terms::{Declared, LinearTerms, Observations, Term},
    },
    numerics::least_squares::dot,
    points::Points,
    stage::{Outcome, PointDiagnosis, PointModel, PointSeparator},
    summary::NamedValue,
};

use crate::{
    campaign::Campaign,
    config::RotaryAxis,
    effects::{CANDIDATES, Candidate, TIME_CONSTANTS, USUAL_TIME_CONSTANT},
    nest::{self, Nest},
    noise::Noise,
    scale::scale,
    solve::{Column, Redundant, fit, redundant},
};

/// Parts of the commands that are independent of each other.
const PARTS: usize = 8;
/// Time constants that are tried for an exponential drift.
const TRIED: usize = 24;
/// Runs of the loop in which time constants settle, and the share of a change at which they are settled.
const MOST_RUNS: usize = 5;
const SETTLED: f64 = 0.01;

/// Place of a candidate among all.
fn index_of(candidate: Candidate) -> usize {
    CANDIDATES.iter().position(|known| *known == candidate).unwrap_or_default()
}

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
        self.take_known(&mut campaign, &settings.known);
        // What is taken from the readings is known with 0 more of it, and not looked for.
        settings.known.iter_mut().for_each(|known| known.values.iter_mut().for_each(|value| *value = 0.0));
        let grid: Vec<f64> = (0..TRIED)
            .map(|index| {
                let [low, high] = TIME_CONSTANTS;
                low * (high / low).powf(index as f64 / (TRIED - 1) as f64)
            })
            .collect();
        let mut constants = [USUAL_TIME_CONSTANT; 3];
        let mut run = self.run(&campaign, &settings, constants, &grid).map_err(failure)?;
        for _ in 1..MOST_RUNS {
            let next = run.next_constants(&grid);
            let changed = next.iter().zip(constants).any(|(next, now)| (next / now - 1.0).abs() > SETTLED);
            if !changed {
                break;
            }
            constants = next;
            run = self.run(&campaign, &settings, constants, &grid).map_err(failure)?;
        }
        self.report(points, &campaign, &declared, &before, &settings, run)
    }
}

/// The readings and effects of the loop.
struct Assembled {
    terms: LinearTerms,
    data: Redundant,
    first: Vec<usize>,
    tried: [usize; 3],
    nest: usize,
}

/// One run of the loop at fixed time constants.
struct Run {
    diagnosis: Diagnosis,
    /// Effects that were added, with their values; of each set the first.
    added: Vec<Setting>,
    constants: [f64; 3],
    data: Redundant,
    /// In `data.effects`, the first column of each candidate.
    first: Vec<usize>,
    /// And that of the first time constant tried, of each coordinate.
    tried: [usize; 3],
    /// And those of errors of the nest.
    nest: usize,
    /// Where most is left.
    left: Vec<Unexplained>,
}

impl Run {
    /// Errors of the nest that explain as much as scale and squareness that were added.
    fn nests(&self) -> Vec<Nest> {
        let columns_of = |setting: &Setting| {
            self.data.effects[self.first[setting.effect]..].iter().take(setting.values.len()).cloned().collect()
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
        nest::instead(&self.data, &added, self.nest)
    }

    /// Time constants for the next run: of a drift that was added, its own; else the one that explains most of what is left.
    fn next_constants(&self, grid: &[f64]) -> [f64; 3] {
        let [low, high] = TIME_CONSTANTS;
        [0, 1, 2].map(|coordinate| {
            let own = index_of(Candidate::Exponential(coordinate));
            if let Some([drift, change]) =
                self.added.iter().find(|setting| setting.effect == own).map(|setting| &setting.values[..])
            {
                let next = self.constants[coordinate] + change / drift;
                return if next.is_finite() { next.clamp(low, high) } else { self.constants[coordinate] };
            }
            let mut left = self.data.rows.clone();
            for setting in &self.added {
                for (column, value) in self.data.effects[self.first[setting.effect]..].iter().zip(&setting.values) {
                    left.iter_mut().zip(column).for_each(|(entry, column)| *entry -= value * column);
                }
            }
            remove(&self.data.declared, &mut left);
            let gain = |index: usize| {
                let mut column = self.data.effects[self.tried[coordinate] + index].clone();
                remove(&self.data.declared, &mut column);
                let size = dot(&column, &column);
                if size > 0.0 { dot(&column, &left).powi(2) / size } else { 0.0 }
            };
            let best = (0..grid.len()).max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
            best.map_or(self.constants[coordinate], |index| grid[index])
        })
    }
}

fn remove(basis: &[Vec<f64>], from: &mut [f64]) {
    for column in basis {
        let share = dot(column, from);
        from.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
    }
}

impl RotaryAxis {
    /// Takes effects that are declared with their values out of the readings.
    fn take_known(&self, campaign: &mut Campaign, known: &[Setting]) {
        for setting in known {
            let Some(candidate) = CANDIDATES.get(setting.effect) else { continue };
            let (values, constant) = match (candidate, &setting.values[..]) {
                (Candidate::Exponential(_), [drift, constant]) => {
                    (vec![*drift], if *constant > 0.0 { *constant } else { USUAL_TIME_CONSTANT })
                }
                (_, values) => (values.to_vec(), USUAL_TIME_CONSTANT),
            };
            let columns = candidate.columns(self.0.axis, campaign, constant);
            for (column, value) in columns.iter().zip(values) {
                campaign.readings.iter_mut().zip(column).for_each(|(reading, column)| reading.value -= column * value);
            }
        }
    }

    fn run(
        &self,
        campaign: &Campaign,
        settings: &Settings,
        constants: [f64; 3],
        grid: &[f64],
    ) -> std::result::Result<Run, String> {
        let Assembled { terms, data, first, tried, nest } = self.assembled(campaign, constants, grid)?;
        let terms = terms.with_known(&settings.known).considering(settings.effects.as_deref());
        let closed = closed_loop::diagnose(&terms, settings).map_err(|error| error.to_string())?;
        let added = closed.settings.into_iter().skip(settings.known.len()).collect();
        let left = closed.after.unexplained();
        Ok(Run { diagnosis: closed.diagnosis, added, constants, data, first, tried, nest, left })
    }

    /// The terms of the loop at the usual time constants.
    pub(crate) fn linear_terms(&self, campaign: &Campaign) -> std::result::Result<LinearTerms, String> {
        self.assembled(campaign, [USUAL_TIME_CONSTANT; 3], &[]).map(|assembled| assembled.terms)
    }

    /// The terms of the loop at fixed time constants, and further ones to try.
    fn assembled(
        &self,
        campaign: &Campaign,
        constants: [f64; 3],
        grid: &[f64],
    ) -> std::result::Result<Assembled, String> {
        let axis = self.0.axis;
        let mut columns: Vec<Column> = Vec::new();
        let mut first = Vec::with_capacity(CANDIDATES.len());
        for candidate in CANDIDATES {
            first.push(columns.len());
            columns.extend(candidate.columns(axis, campaign, constant_of(candidate, constants)));
        }
        let tried = [0, 1, 2].map(|coordinate| {
            let start = columns.len();
            let drift = Candidate::Exponential(coordinate);
            columns.extend(grid.iter().filter_map(|tried| drift.columns(axis, campaign, *tried).into_iter().next()));
            start
        });
        let nest = columns.len();
        columns.extend(nest::columns(self.0.axis, campaign)?);
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
            structure: parts(&data.command, campaign.commands_deg.len()),
        };
        let declared = data.declared.iter().enumerate().map(|(index, column)| Declared {
            name: format!("shape {}", index + 1),
            unit: "um".into(),
            column: column.clone(),
        });
        let terms = CANDIDATES.iter().zip(&first).map(|(candidate, first)| {
            let effect = candidate.effect();
            let columns = data.effects[*first..].iter().take(effect.parameters.len()).map(sized).collect();
            Term { effect, columns, rank: 0 }
        });
        let model = LinearTerms::new(observations, declared.collect(), terms.collect())
            .map_err(|error| error.to_string())?
            .distinguished_by(
                "a calibration of the linear axes on their own, or a campaign with the balls in another order of time",
            );
        Ok(Assembled { terms: model, data, first, tried, nest })
    }

    /// Columns of effects that were added.
    fn columns_of(&self, campaign: &Campaign, effects: &[usize], constants: [f64; 3]) -> Vec<Column> {
        let all = effects.iter().filter_map(|effect| CANDIDATES.get(*effect));
        all.flat_map(|candidate| candidate.columns(self.0.axis, campaign, constant_of(*candidate, constants))).collect()
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
        let Run { mut diagnosis, added, constants, left, .. } = run;
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
                alternatives.push(self.columns_of(campaign, &chosen, constants));
            }
        }
        // Errors of the nest that explain as much as errors of the linear axes.
        let of_nest = nest::columns(self.0.axis, campaign).unwrap_or_default();
        for Nest { index, replaced } in &instead {
            let kept: Vec<usize> =
                (0..effects.len()).filter(|place| !replaced.contains(place)).map(|place| effects[place]).collect();
            let mut columns = self.columns_of(campaign, &kept, constants);
            columns.extend(of_nest.get(*index).cloned());
            alternatives.push(columns);
        }
        nest::confound(&mut diagnosis, &instead);
        let columns = self.columns_of(campaign, &effects, constants);
        let mut after = self.fitted_outcome(points, campaign, &columns, before, &alternatives)?;
        let last = fit(&campaign.layout, &campaign.readings, &columns)
            .map_err(|problem| Error::new("fit", points.input.display().to_string(), problem))?;
        if scale(&last, campaign.noise).is_more && diagnosis.verdict != Verdict::Unexplained {
            // As the warning says.
            diagnosis.verdict = Verdict::Unexplained;
            diagnosis.unexplained.extend(left);
        }
        for (found, setting) in diagnosis.added.iter_mut().zip(&added) {
            if let (Some(Candidate::Exponential(coordinate)), [drift, ..]) =
                (CANDIDATES.get(setting.effect), &setting.values[..])
                && let Some(parameter) = found.parameters.get_mut(1)
            {
                // The linear column holds D·ΔT.
                parameter.value = constants[*coordinate] + parameter.value / drift;
                parameter.std = parameter.std.map(|std| std / drift.abs());
            }
        }
        diagnosis.moved = moved(&declared.values, &after.values);
        for blind in &mut diagnosis.blind_to {
            if let Some(bias) = self.bias(campaign, blind, &names, constants) {
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
        diagnosis.consistency.extend(after.checks.iter().cloned());
        if diagnosis.consistency.iter().any(Check::bars_verdict) {
            diagnosis.verdict = Verdict::Unexplained;
        }
        after.checks.clone_from(&diagnosis.consistency);
        diagnosis.warnings.append(&mut after.remarks);
        Ok(PointDiagnosis { diagnosis, after })
    }
}

fn name(effect: &Effect) -> String {
    effect.targets.iter().fold(effect.id.clone(), |name, target| format!("{name} {target}"))
}

pub(crate) fn constant_of(candidate: Candidate, constants: [f64; 3]) -> f64 {
    if let Candidate::Exponential(coordinate) = candidate { constants[coordinate] } else { USUAL_TIME_CONSTANT }
}

/// Neighbouring commands make a part, which is independent of the others.
fn parts(command: &[usize], commands: usize) -> Structure {
    let names = (1..=PARTS).map(|part| format!("part {part} of the commands")).collect();
    let level = command.iter().map(|command| command * PARTS / commands).collect();
    Structure::default().divided("parts of the commands", Kind::Blocks, level, names)
}

/// Root mean square of the readings' standard uncertainties, harmonic: the typical weight.
pub(crate) fn typical_um(campaign: &Campaign) -> f64 {
    let weights: f64 = campaign.readings.iter().map(|reading| reading.std.powi(-2)).sum();
    1e3 * (campaign.readings.len() as f64 / weights).sqrt()
}

/// Values that both results have.
fn moved(before: &[NamedValue], after: &[NamedValue]) -> Vec<Moved> {
    let both = before.iter().filter(|one| one.of.is_none()).filter_map(|one| {
        let other = after.iter().find(|other| other.symbol == one.symbol && other.of == one.of)?;
        Some(Moved {
            value: one.symbol.clone(),
            section: None,
            before: one.value?,
            after: other.value?,
            std: other.std,
            unit: one.unit.clone(),
            reference: None,
            filter: None,
            lost_orders: Vec::new(),
        })
    });
    both.collect()
}
