//! The spatial error as a model for the closed loop.
//!
//! Long because the loop and what it says of each step belong together.

use runout_core::{
    Result,
    closed_loop::{
        Effect, Settings,
        diagnosis::{Added, BiasPerUnit, Blind, Diagnosis, Level, Refused, Step, Unexplained, Verdict},
    },
    consistency::{Check, linear},
    points::Points,
    stage::{PointDiagnosis, PointModel},
    summary::moved,
};

use crate::{
    campaign::Campaign,
    conclusion::Conclusion,
    config::SpatialError,
    effects::{Candidate, candidates, jumps, missing},
    level::level,
    likelihood::Prior,
    noise::Noise,
    parameters::{parameters, settled, subtract_known},
    solve::{Solution, families, prior, solve},
    suspects::{Group, groups},
    terms::Term,
    trace::{TracedEffect, Tracing, is_observable},
};

/// Effects at most.
const MOST_ADDED: usize = 12;
/// An effect of its usual size that is this many times its standard uncertainty, or less, is not seen.
const VISIBLE: f64 = 3.0;

impl PointModel for SpatialError {
    fn effects(&self) -> Vec<Effect> {
        missing().into_iter().map(crate::effects::Missing::effect).collect()
    }

    #[allow(clippy::too_many_lines, reason = "one part of the diagnosis after the other")]
    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        let mut campaign = self.campaign(points)?;
        subtract_known(&mut campaign, settings)?;
        let before = solve(&campaign, &self.config, &[])?;
        let candidates = candidates(&campaign, self.config.pitch_mm);
        let jumps = jumps(&campaign);
        let kinds = missing();
        let effects = self.effects();
        let declared = before.terms.clone();
        let chosen = |candidate: &Candidate| {
            let wanted = settings.effects.as_ref().is_none_or(|ids| ids.contains(&effects[candidate.effect].id));
            wanted && !settings.left_out.contains(&candidate.effect)
        };
        let observable: Vec<bool> =
            candidates.iter().map(|candidate| is_observable(&campaign, &declared, &candidate.terms)).collect();
        let allowed = candidates
            .iter()
            .zip(&observable)
            .map(|(candidate, observable)| *observable && chosen(candidate))
            .collect();
        let families = match self.config.kriging.fixed() {
            Some(covariance) => vec![covariance.family],
            None => families(&self.config.kriging),
        };
        let given = self.given(&campaign, &before);
        let mut tracing =
            Tracing::new(&campaign, declared.clone(), candidates, &jumps, &families, given.as_ref(), allowed);
        // Readings at wrong places show effects that are not there.
        let is_sound = !campaign.checks.iter().any(Check::bars_verdict);
        let most = if is_sound { settings.max_added.min(MOST_ADDED) } else { 0 };
        let found = tracing.run(most).unwrap_or_default();
        let Tracing { doubts, mut candidates, .. } = tracing;
        let (added, strangers): (Vec<TracedEffect>, Vec<TracedEffect>) =
            found.into_iter().partition(TracedEffect::is_added);
        let mut chosen: Vec<Candidate> = added.iter().map(|found| candidates[found.members[0]].clone()).collect();
        let after = if chosen.is_empty() { before.clone() } else { settled(&campaign, self, &mut chosen)? };
        added.iter().zip(chosen).for_each(|(found, chosen)| candidates[found.members[0]] = chosen);
        let terms_of = |found: &TracedEffect| candidates[found.members[0]].terms.clone();
        let terms: Vec<Term> = added.iter().flat_map(terms_of).collect();
        let name = |candidate: &Candidate| {
            let effect = &effects[candidate.effect];
            (effect.id.clone(), format!("{}{}", effect.targets.join(" "), candidate.shape.words()).trim().to_owned())
        };
        let names: Vec<(String, String, Term)> = added
            .iter()
            .flat_map(|found| {
                let candidate = &candidates[found.members[0]];
                let (id, target) = name(candidate);
                candidate.terms.iter().map(move |term| (id.clone(), target.clone(), *term))
            })
            .collect();
        let declared_outcome =
            Conclusion { separator: self, campaign: &campaign, solution: &before, names: &[] }.outcome()?;
        let mut outcome =
            Conclusion { separator: self, campaign: &campaign, solution: &after, names: &names }.outcome()?;
        let mut unexplained: Vec<Unexplained> = strangers
            .iter()
            .map(|found| {
                let index = found.members[0];
                let columns = if found.jump { &jumps[index].terms } else { &candidates[index].terms };
                let left = self.left(&campaign, &terms, columns)?;
                let what = if found.jump {
                    format!("a jump by {} {}", campaign.displacement(left.by_um), jumps[index].place)
                } else {
                    effects[candidates[index].effect].name()
                };
                let place = std::iter::once(what).chain(found.undecided.clone()).collect::<Vec<_>>().join(": ");
                Ok(unexplained(left.rms_um, place))
            })
            .collect::<Result<_>>()?;
        if unexplained.is_empty() {
            unexplained.extend(groups(&campaign, &after).iter().map(|group| together(&campaign, group)));
        }
        unexplained.extend(outcome.checks.iter().filter(|check| check.bars_verdict()).map(Unexplained::from));
        let levels = [&before, &after].map(|solution| level(&campaign, solution));
        if unexplained.is_empty() {
            unexplained.extend(above_noise(&campaign, &levels[1]));
        }
        let trend_std = after.trend_std(&campaign);
        let steps = self.steps(&campaign, &added, &candidates, &levels)?;
        let mut diagnosis = Diagnosis {
            consistency: outcome.checks.clone(),
            verdict: verdict(&campaign, added.is_empty(), unexplained.is_empty()),
            before: levels[0].clone(),
            added: added
                .iter()
                .zip(steps.windows(2))
                .map(|(found, pair)| {
                    let effect = &effects[candidates[found.members[0]].effect];
                    let others = found.members[1..].iter().map(|member| {
                        let (id, target) = name(&candidates[*member]);
                        format!("{id} {target}")
                    });
                    let confounded_with: Vec<String> = others.collect();
                    let alone = confounded_with.is_empty();
                    Added {
                        effect: effect.id.clone(),
                        targets: effect.targets.clone(),
                        distinguished_by: (!alone).then(|| DISTINGUISHED_BY.to_owned()),
                        confounded_with,
                        parameters: parameters(
                            &candidates[found.members[0]],
                            effect,
                            &after,
                            alone.then_some(&trend_std),
                        ),
                        change: None,
                        residual_rms_um: Step {
                            before: Some(pair[0].residual_rms_um),
                            after: Some(pair[1].residual_rms_um),
                        },
                        held_out_rms_um: Step { before: pair[0].held_out_rms_um, after: pair[1].held_out_rms_um },
                        held_out_expected_rms_um: pair[1].held_out_expected_rms_um,
                        delta_bic: found.gain.bic,
                        p_value: found.gain.p,
                    }
                })
                .collect(),
            after: levels[1].clone(),
            nothing_separated: false,
            moved: moved(&declared_outcome.values, &outcome.values),
            unexplained,
            blind_to: {
                let known: Vec<usize> =
                    added.iter().flat_map(|found| &found.members).map(|member| candidates[*member].effect).collect();
                let others: Vec<usize> = (0..kinds.len()).filter(|effect| !known.contains(effect)).collect();
                blind(&campaign, &after, &candidates, &observable, &effects, &others)
            },
            refused: doubts
                .into_iter()
                .map(|doubt| {
                    let effect = &effects[candidates[doubt.candidate].effect];
                    Refused { effect: effect.id.clone(), targets: effect.targets.clone(), reason: doubt.reason }
                })
                .collect(),
            lost_orders: None,
            truth: None,
            warnings: Vec::new(),
            notes: Vec::new(),
            outputs: Vec::new(),
        };
        diagnosis.warnings.append(&mut outcome.remarks);
        diagnosis.warnings.push(crate::remarks::of_field(&campaign, &after));
        Ok(PointDiagnosis { diagnosis, after: outcome })
    }
}

/// Sizes of columns, where each is along one component, and what they add, root mean square.
struct Left {
    by_um: [f64; 3],
    rms_um: f64,
}

/// What separates effects that one layout confounds.
const DISTINGUISHED_BY: &str = "a second campaign with another `tool_mm`, or in another order of the places";

impl SpatialError {
    /// The covariance that is given, as a prior that leaves nothing free.
    fn given(&self, campaign: &Campaign, before: &Solution) -> Option<Prior> {
        let covariance = self.config.kriging.fixed()?;
        let mut prior = prior(campaign, &before.data);
        for (index, (centre, precision)) in prior.centre.iter_mut().zip(prior.precision.iter_mut()).enumerate() {
            *centre = match index % crate::likelihood::PARAMETERS {
                0 => covariance.sill_um,
                4 => covariance.nugget_um.max(1e-12),
                axis => covariance.range_mm[axis - 1],
            }
            .ln();
            *precision = f64::INFINITY;
        }
        Some(prior)
    }

    /// What columns that are not added would take.
    fn left(&self, campaign: &Campaign, terms: &[Term], columns: &[Term]) -> Result<Left> {
        let all: Vec<Term> = terms.iter().chain(columns).copied().collect();
        let solution = solve(campaign, &self.config, &all)?;
        let size = |wanted: &Term| solution.column(*wanted).map_or(f64::NAN, |column| solution.joint.trend[column]);
        let each = columns.iter().map(|wanted| (wanted, size(wanted))).filter(|(_, size)| size.is_finite());
        let adds = |(place, time): (&usize, &f64)| {
            let at_mm = campaign.places_mm[*place];
            let of = |(wanted, size): (&Term, f64)| wanted.at(&campaign.volume, at_mm, *time).map(|adds| adds * size);
            each.clone().map(of).fold([0.0; 3], |sum, one| [0, 1, 2].map(|axis| sum[axis] + one[axis]))
        };
        let squares: f64 = campaign.place_of.iter().zip(&campaign.time).flat_map(adds).map(|adds| adds * adds).sum();
        Ok(Left {
            by_um: solution.by_axis(columns.iter().map(size), f64::NAN),
            rms_um: (squares / (campaign.measured.len() * campaign.place_of.len()) as f64).sqrt(),
        })
    }

    /// Levels after each effect.
    fn steps(
        &self,
        campaign: &Campaign,
        added: &[TracedEffect],
        candidates: &[Candidate],
        levels: &[Level; 2],
    ) -> Result<Vec<Level>> {
        let mut steps = vec![levels[0].clone()];
        let mut terms = Vec::new();
        for (index, found) in added.iter().enumerate() {
            terms.extend(candidates[found.members[0]].terms.iter().copied());
            if index + 1 == added.len() {
                steps.push(levels[1].clone());
            } else {
                steps.push(level(campaign, &solve(campaign, &self.config, &terms)?));
            }
        }
        Ok(steps)
    }
}

/// The residual of the readings beyond their noise.
fn above_noise(campaign: &Campaign, level: &Level) -> Option<Unexplained> {
    let noise_dof = match campaign.noise {
        Noise::Repeats { dof, .. } => (dof * campaign.measured.len()) as f64,
        _ => f64::INFINITY,
    };
    let check = linear::residual(level.chi2_per_dof?, level.degrees_of_freedom as f64, noise_dof);
    check.bars_verdict().then(|| unexplained(level.residual_rms_um, check.finding))
}

/// Neighbouring places that err together.
fn together(campaign: &Campaign, group: &Group) -> Unexplained {
    let squares: f64 = group.by_um.iter().flatten().filter(|by| by.is_finite()).map(|by| by * by).sum();
    let rms_um = (squares / (campaign.measured.len() * campaign.places_mm.len()) as f64).sqrt();
    unexplained(rms_um, format!("neighbouring places: {}", group.named(campaign)))
}

fn unexplained(rms_um: f64, place: String) -> Unexplained {
    Unexplained { station: None, sensor: None, setup: None, orders: [0, 0], rms_um, place }
}

/// Whether a parameter in a unit is a size.
fn is_size(unit: &str) -> bool {
    unit.starts_with("um") || unit == "urad"
}

fn verdict(campaign: &Campaign, nothing_added: bool, nothing_strange: bool) -> Verdict {
    match (nothing_strange, campaign.noise != Noise::Unknown, nothing_added) {
        (false, ..) => Verdict::Unexplained,
        (true, true, true) => Verdict::AtNoiseFloor,
        (true, true, false) => Verdict::Explained,
        (true, false, true) => Verdict::NothingFound,
        (true, false, false) => Verdict::Improved,
    }
}

/// Effects that these places do not show, at any order.
fn blind(
    campaign: &Campaign,
    solution: &Solution,
    candidates: &[Candidate],
    observable: &[bool],
    effects: &[Effect],
    asked: &[usize],
) -> Vec<Blind> {
    let searched = |effect: usize| candidates.iter().any(|one| one.effect == effect && one.shape.is_searched());
    // Where shapes are searched, some of them are seen.
    let asked: Vec<usize> = asked.iter().copied().filter(|effect| !searched(*effect)).collect();
    let (candidates, observable): (Vec<&Candidate>, Vec<bool>) =
        candidates.iter().zip(observable).filter(|(one, _)| !one.shape.is_searched()).unzip();
    let all: Vec<Term> = candidates.iter().flat_map(|candidate| candidate.terms.iter().copied()).collect();
    let terms: Vec<Term> = solution.terms.iter().chain(&all).copied().collect();
    let (normal, _) = solution.joint.equations(&campaign.data(&terms, solution.fitted.as_deref()));
    let fitted = solution.terms.len();
    let mut blind = Vec::new();
    for effect in asked {
        let size = effects[effect].parameters.iter().find(|parameter| is_size(&parameter.unit));
        let tolerance = size.map_or(1.0, |parameter| parameter.tolerance);
        let mut visible = false;
        let mut largest: f64 = 0.0;
        let mut first = fitted;
        for (candidate, observable) in candidates.iter().zip(&observable) {
            let columns = first..first + candidate.terms.len();
            first = columns.end;
            if candidate.effect != effect {
                continue;
            }
            for (column, term) in columns.zip(&candidate.terms) {
                let across = normal.view((0, column), (fitted, 1)).into_owned();
                let taken = (across.transpose() * &solution.joint.trend_covariance * &across)[(0, 0)];
                let information = normal[(column, column)] - taken;
                visible |= *observable && information.max(0.0).sqrt() * tolerance > VISIBLE;
                let adds = campaign.places_mm.iter().map(|place| term.at(&campaign.volume, *place, 1.0));
                let squares: f64 = adds.flatten().map(|adds| adds * adds).sum();
                largest = largest.max((squares / (3 * campaign.places_mm.len()) as f64).sqrt());
            }
        }
        if !visible {
            let unit = size.map_or("", |parameter| &parameter.unit);
            // Without an arm it displaces no measured point, and another tool by 1 nm per mm of its offset.
            let bias_per_unit = if largest > 0.0 {
                BiasPerUnit { value: largest, unit: format!("um/({unit})"), on: "readings".into() }
            } else {
                BiasPerUnit {
                    value: 0.1,
                    unit: format!("um/({unit})"),
                    on: "a point at another tool offset, 100 mm away".into(),
                }
            };
            blind.push(Blind {
                effect: effects[effect].id.clone(),
                targets: effects[effect].targets.clone(),
                bias_per_unit,
            });
        }
    }
    blind
}
