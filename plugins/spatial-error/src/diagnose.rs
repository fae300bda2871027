//! The spatial error as a model for the closed loop.
//!
//! Long because the loop and what it says of each step belong together.

use runout_core::{
    Error, Result,
    model::{
        Effect,
        closed_loop::Settings,
        diagnosis::{
            Added, BiasPerUnit, Blind, Diagnosis, Estimated, Level, Moved, Refused, Step, Unexplained, Verdict,
        },
    },
    points::Points,
    stage::{Outcome, PointDiagnosis, PointModel},
    summary::NamedValue,
};

use crate::{
    campaign::Campaign,
    conclusion::Conclusion,
    config::SpatialError,
    effects::{Candidate, candidates, jumps, missing},
    level::level,
    likelihood::Prior,
    noise::Noise,
    solve::{Solution, families, prior, solve},
    suspects::{Group, groups},
    terms::Term,
    trace::{Found, Tracing, is_observable},
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
        let candidates = candidates();
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
            Tracing::new(&campaign, declared.clone(), &candidates, &jumps, &families, given.as_ref(), allowed);
        let found = tracing.run(settings.max_added.min(MOST_ADDED)).unwrap_or_default();
        let doubts = std::mem::take(&mut tracing.doubts);
        let (strangers, added): (Vec<Found>, Vec<Found>) = found.into_iter().partition(|found| found.jump);
        let terms_of = |found: &Found| candidates[found.members[0]].terms.clone();
        let terms: Vec<Term> = added.iter().flat_map(terms_of).collect();
        let after = if terms.is_empty() { before.clone() } else { solve(&campaign, &self.config, &terms)? };
        let name = |candidate: &Candidate| {
            let effect = &effects[candidate.effect];
            let order = candidate.order.map_or_else(String::new, |order| format!(" order {order}"));
            (effect.id.clone(), format!("{}{order}", effect.targets.join(" ")))
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
            .map(|found| self.unexplained(&campaign, &terms, &jumps[found.members[0]]))
            .collect::<Result<_>>()?;
        if unexplained.is_empty() {
            unexplained.extend(groups(&campaign, &after).iter().map(|group| together(&campaign, group)));
        }
        unexplained.extend(outcome.checks.iter().filter(|check| check.bars_verdict()).map(Unexplained::from));
        let levels = [&before, &after].map(|solution| level(&campaign, solution));
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
            moved: moved(&declared_outcome, &outcome),
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

    /// Size and place of a jump.
    fn unexplained(&self, campaign: &Campaign, terms: &[Term], jump: &crate::effects::Jump) -> Result<Unexplained> {
        let all: Vec<Term> = terms.iter().chain(&jump.terms).copied().collect();
        let solution = solve(campaign, &self.config, &all)?;
        let size = |wanted: &Term| {
            let column = solution.terms.iter().position(|term| term == wanted);
            column.map_or(f64::NAN, |column| solution.joint.trend[column])
        };
        let mut squares = 0.0;
        for (wanted, size) in
            jump.terms.iter().map(|wanted| (wanted, size(wanted))).filter(|(_, size)| size.is_finite())
        {
            let adds = campaign.places_mm.iter().map(|place| wanted.at(&campaign.volume, *place, 0.0));
            squares += adds.flatten().map(|adds| (adds * size).powi(2)).sum::<f64>();
        }
        let by_um = solution.by_axis(jump.terms.iter().map(size), f64::NAN);
        Ok(Unexplained {
            station: None,
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: (squares / (campaign.measured.len() * campaign.places_mm.len()) as f64).sqrt(),
            place: format!("a jump by {} {}", campaign.displacement(by_um), jump.place),
        })
    }

    /// Levels after each effect.
    fn steps(
        &self,
        campaign: &Campaign,
        added: &[Found],
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

/// Neighbouring places that err together.
fn together(campaign: &Campaign, group: &Group) -> Unexplained {
    let squares: f64 = group.by_um.iter().flatten().filter(|by| by.is_finite()).map(|by| by * by).sum();
    Unexplained {
        station: None,
        sensor: None,
        setup: None,
        orders: [0, 0],
        rms_um: (squares / (campaign.measured.len() * campaign.places_mm.len()) as f64).sqrt(),
        place: format!("neighbouring places: {}", group.named(campaign)),
    }
}

/// Takes effects that are declared with their values out of the readings.
fn subtract_known(campaign: &mut Campaign, settings: &Settings) -> Result<()> {
    let kinds = missing();
    for setting in &settings.known {
        let kind = kinds[setting.effect];
        let (order, values) = match (kind.has_order(), setting.values.split_first()) {
            (true, Some((order, rest))) => {
                let orders = kind.orders();
                let is_one = order.fract() == 0.0 && *order >= *orders.start() as f64 && *order <= *orders.end() as f64;
                if !is_one {
                    let effect = kind.effect();
                    let problem = format!(
                        "its order is a whole number from {} to {}, found {order}",
                        orders.start(),
                        orders.end()
                    );
                    return Err(Error::new("take out the known effect", effect.name(), problem));
                }
                (*order as usize, rest.to_vec())
            }
            _ => (1, setting.values.clone()),
        };
        for (term, value) in kind.terms(order).into_iter().zip(values) {
            for row in 0..campaign.place_of.len() {
                let place = campaign.places_mm[campaign.place_of[row]];
                let adds = term.at(&campaign.volume, place, campaign.time[row]);
                campaign.readings_um[row].iter_mut().zip(adds).for_each(|(reading, adds)| *reading -= value * adds);
            }
        }
    }
    Ok(())
}

fn parameters(
    candidate: &Candidate,
    effect: &Effect,
    solution: &Solution,
    trend_std: Option<&Vec<f64>>,
) -> Vec<Estimated> {
    let names = &effect.parameters;
    let mut all = Vec::new();
    if let Some(order) = candidate.order {
        all.push(Estimated {
            name: names[0].name.clone(),
            value: order as f64,
            std: None,
            unit: names[0].unit.clone(),
        });
    }
    let rest = &names[usize::from(candidate.order.is_some())..];
    for (parameter, wanted) in rest.iter().zip(&candidate.terms) {
        let Some(column) = solution.terms.iter().position(|term| term == wanted) else { continue };
        all.push(Estimated {
            name: parameter.name.clone(),
            value: solution.joint.trend[column],
            std: trend_std.map(|std| std[column]),
            unit: parameter.unit.clone(),
        });
    }
    all
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
    let all: Vec<Term> = candidates.iter().flat_map(|candidate| candidate.terms.iter().copied()).collect();
    let terms: Vec<Term> = solution.terms.iter().chain(&all).copied().collect();
    let (normal, _) = solution.joint.equations(&campaign.data(&terms, solution.fitted.as_deref()));
    let fitted = solution.terms.len();
    let mut blind = Vec::new();
    for effect in asked.iter().copied() {
        let tolerance = effects[effect].parameters.last().map_or(1.0, |parameter| parameter.tolerance);
        let mut visible = false;
        let mut largest: f64 = 0.0;
        let mut first = fitted;
        for (candidate, observable) in candidates.iter().zip(observable) {
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
            let unit = effects[effect].parameters.last().map_or("", |parameter| &parameter.unit);
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

/// Values that both results have.
fn moved(before: &Outcome, after: &Outcome) -> Vec<Moved> {
    let number = |values: &[NamedValue], like: &NamedValue| {
        values.iter().find(|one| one.id() == like.id()).and_then(|one| one.value)
    };
    let of = |value: &NamedValue| {
        Some(Moved {
            value: value.symbol.clone(),
            section: value.of.clone(),
            before: number(&before.values, value)?,
            after: value.value?,
            std: value.std,
            unit: value.unit.clone(),
            reference: None,
            filter: None,
            lost_orders: Vec::new(),
        })
    };
    after.values.iter().filter_map(of).collect()
}
