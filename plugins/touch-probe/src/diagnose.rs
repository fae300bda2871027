//! The touch probe as a model for the closed loop.

use std::collections::BTreeSet;

use runout_core::{
    Error, Result,
    closed_loop::{
        self, Closed, Effect, Fit, Setting, Settings,
        diagnosis::{BiasPerUnit, Blind, Diagnosis, Unexplained, Verdict},
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term},
    },
    consistency::Check,
    points::Points,
    stage::{Outcome, PointDiagnosis, PointModel},
    summary::{Value, moved},
};

use crate::{
    consistency::structure,
    design::{Content, Design, Noise, name},
    effects::{Missing, highest},
    second_order::SecondOrder,
    separate::{Prepared, TouchProbe},
    tables::residual_rows,
    waves::angles,
};

/// Orders above those declared that may be added: more of them describe something local, which they do not explain.
const MOST_ORDERS: usize = 5;
/// Most effects of all kinds.
const MOST_ADDED: usize = 9;
/// Share of a column outside the span of those before it, below which it is none of its own.
const INDEPENDENT: f64 = 1e-7;
/// Amplitude of an order against what the second order makes of it, below which it is not accepted: the latter is known to its
/// size only.
const SECOND_ORDER: f64 = 3.0;
/// Directions that are nearer are one.
const SAME_DEG: f64 = 0.5;
/// Sectors of the ring in which the residual is summed.
const SECTORS: usize = 36;

impl PointModel for TouchProbe {
    fn effects(&self) -> Vec<Effect> {
        self.missing().into_iter().map(Missing::effect).collect()
    }

    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        let prepared = self.prepare(points)?;
        let missing = self.missing();
        let terms = self.terms(points, &prepared, &missing)?;
        let terms = terms.with_known(&settings.known).considering(settings.effects.as_deref());
        let mut settings = Settings { max_added: settings.max_added.min(MOST_ADDED), ..settings.clone() };
        settings.left_out.extend(self.beyond_directions(&prepared, &missing));
        let settings = &settings;
        let mut closed = closed_loop::diagnose(&terms, settings)?;
        let orders: Vec<usize> = orders(&missing).collect();
        let added = |closed: &Closed<LinearFit>| {
            closed.settings.iter().filter(|setting| orders.contains(&setting.effect)).count()
        };
        if added(&closed) > MOST_ORDERS {
            let mut left_out = settings.left_out.clone();
            left_out.extend(orders.iter().copied());
            let settings = Settings { left_out, ..settings.clone() };
            closed = closed_loop::diagnose(&terms, &settings)?;
            closed.diagnosis.warnings.push(format!(
                "more than {MOST_ORDERS} orders above `max_order` would describe what is left: it is local, and no order of lobing \
                 or form"
            ));
        }
        let small = self.of_second_order(&prepared, &missing, &closed);
        if !small.is_empty() {
            let names: Vec<String> = small.iter().map(|effect| missing[*effect].effect().id).collect();
            let mut left_out = settings.left_out.clone();
            left_out.extend(small);
            let settings = Settings { left_out, ..settings.clone() };
            closed = closed_loop::diagnose(&terms, &settings)?;
            closed.diagnosis.warnings.push(format!(
                "{}: not above what the second order of lobing and form makes of them, which the model leaves out",
                names.join(", ")
            ));
        }
        self.diagnosed_outcome(&prepared, &missing, &terms, closed, settings)
    }
}

fn orders(missing: &[Missing]) -> impl Iterator<Item = usize> + '_ {
    let is_order = |one: &Missing| matches!(one, Missing::LobingOrder(_) | Missing::RingFormOrder(_));
    missing.iter().enumerate().filter(move |(_, one)| is_order(one)).map(|(index, _)| index)
}

impl TouchProbe {
    /// Orders of more waves than half of the directions of the touches: each would be another name of a lower one.
    fn beyond_directions(&self, prepared: &Prepared, missing: &[Missing]) -> Vec<usize> {
        let directions = [0, 1].map(|frame| {
            let turns = |touch| (angles(&self.0, touch)[frame] / (SAME_DEG.to_radians())).round();
            let whole = (360.0 / SAME_DEG).round();
            let all: BTreeSet<i64> =
                prepared.touches.all.iter().map(|touch| turns(touch).rem_euclid(whole) as i64).collect();
            all.len()
        });
        let is_beyond = |one: &Missing| match one {
            Missing::LobingOrder(order) => 2 * order >= directions[0],
            Missing::RingFormOrder(order) => 2 * order >= directions[1],
            _ => false,
        };
        (0..missing.len()).filter(|effect| is_beyond(&missing[*effect])).collect()
    }

    /// Orders that were added, and that are no larger than what the second order makes of them.
    fn of_second_order(&self, prepared: &Prepared, missing: &[Missing], closed: &Closed<LinearFit>) -> Vec<usize> {
        let fit = self.fit(prepared, &[], &Content::declared(), &prepared.readings_um());
        let second_order = SecondOrder::of(&self.0, &fit);
        let small = closed.settings.iter().filter(|setting| {
            let (Missing::LobingOrder(order) | Missing::RingFormOrder(order)) = missing[setting.effect] else {
                return false;
            };
            let squares: f64 = setting.values.iter().map(|value| value * value).sum();
            squares.sqrt() < SECOND_ORDER * second_order.amplitude_um(order)
        });
        small.map(|setting| setting.effect).collect()
    }

    /// The terms of the loop for some touches.
    pub(crate) fn linear_terms(&self, points: &Points) -> Result<LinearTerms> {
        self.terms(points, &self.prepare(points)?, &self.missing())
    }

    /// The terms of the loop: of weight 1 each, in µm.
    fn terms(&self, points: &Points, prepared: &Prepared, missing: &[Missing]) -> Result<LinearTerms> {
        let Prepared { touches, weights } = prepared;
        let scale = if weights.noise == Noise::Residual { 1.0 } else { weights.rms_um() };
        let weigh = |column: Vec<f64>| -> Vec<f64> {
            column.into_iter().zip(&weights.std_um).map(|(value, std)| value * scale / std).collect()
        };
        let design = Design::new(&self.0, touches, missing, &Content::declared());
        let columns = design.columns.iter().cloned().map(weigh).collect();
        let declared = design.parameters.iter().zip(independent(columns)).filter_map(|(parameter, column)| {
            Some(Declared { name: name(&self.0, parameter), unit: "um".into(), column: column? })
        });
        let terms = missing.iter().map(|one| Term {
            effect: one.effect(),
            columns: one.columns(&self.0, touches).into_iter().map(weigh).collect(),
            rank: 0,
        });
        let (group, groups) = self.groups(prepared);
        let observations = Observations {
            values: weigh(prepared.readings_um()),
            unit: "um".into(),
            std: (weights.noise != Noise::Residual).then_some(scale),
            std_dof: match weights.noise {
                Noise::Repeats(dof) => Some(dof as f64),
                _ => None,
            },
            group,
            groups,
            structure: structure(&self.0, touches),
        };
        let object = points.input.display().to_string();
        let model = LinearTerms::new(observations, declared.collect(), terms.collect())
            .map_err(|error| Error::caused("fit the probe to", object, error))?;
        let last = highest(self.0.max_order);
        let limit = format!("`separate.max_order` is {}", self.0.max_order);
        Ok(model
            .ending_at(format!("lobing-order-{last}"), limit.clone())
            .ending_at(format!("ring-form-order-{last}"), limit)
            .distinguished_by("more setups, with the ring and the probe each turned by an angle of its own"))
    }

    /// What is held out together: a pass, or every fifth touch of a setup where there is one pass only.
    fn groups(&self, prepared: &Prepared) -> (Vec<usize>, Vec<String>) {
        let touches = &prepared.touches;
        let repeated = touches.repeats.len() > 1;
        let mut names: Vec<String> = Vec::new();
        let mut counts = vec![0_usize; self.0.setups.len()];
        let group = touches.all.iter().map(|touch| {
            let setup = &self.0.setups[touch.setup].id;
            let number = counts[touch.setup];
            counts[touch.setup] += 1;
            let name = if repeated {
                format!("setup {setup}, repeat {}", touch.repeat)
            } else {
                format!("setup {setup}, touches {} of each 5", number % 5 + 1)
            };
            names.iter().position(|known| *known == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            })
        });
        (group.collect(), names)
    }

    fn diagnosed_outcome(
        &self,
        prepared: &Prepared,
        missing: &[Missing],
        terms: &LinearTerms,
        closed: Closed<LinearFit>,
        settings: &Settings,
    ) -> Result<PointDiagnosis> {
        let Closed { mut diagnosis, before, after: fit, .. } = closed;
        let mut readings = prepared.readings_um();
        for Setting { effect, values } in &settings.known {
            for (column, value) in missing[*effect].columns(&self.0, &prepared.touches).iter().zip(values) {
                readings.iter_mut().zip(column).for_each(|(reading, entry)| *reading -= value * entry);
            }
        }
        let (_, declared) = self.fitted_outcome(prepared, missing, &Content::declared(), &readings)?;
        let (_, mut after) = self.fitted_outcome(prepared, missing, &content(missing, &diagnosis), &readings)?;
        diagnosis.moved = moved(&declared.values, &after.values);
        self.of_mean(&mut diagnosis, &after);
        diagnosis.consistency.clone_from(&after.checks);
        if diagnosis.consistency.iter().any(Check::bars_verdict) && diagnosis.verdict != Verdict::Unexplained {
            diagnosis.verdict = Verdict::Unexplained;
            diagnosis.unexplained.extend(fit.unexplained());
        }
        let [before, left] = [&before, &fit].map(|fit| in_order(terms, prepared, fit));
        if !diagnosis.unexplained.is_empty() {
            let place = self.place(prepared, &left);
            for unexplained in &mut diagnosis.unexplained {
                self.name_place(unexplained, &place);
            }
        }
        after.tables.push(residual_rows(&self.0, &prepared.touches, &before, &left)?);
        diagnosis.warnings.append(&mut after.remarks);
        Ok(PointDiagnosis { diagnosis, after })
    }

    /// What the mean pre-travel holds besides: scales of the axes, and the time that it is of.
    fn of_mean(&self, diagnosis: &mut Diagnosis, after: &Outcome) {
        let arm = 1e-3 * self.0.ring_radius_mm;
        diagnosis.blind_to.push(Blind {
            effect: "axis-scale".into(),
            targets: vec!["X and Y in common".into()],
            bias_per_unit: BiasPerUnit { value: arm, unit: "um/(um/m)".into(), on: "mean pre-travel".into() },
        });
        let size = |id: &str, target: Option<&str>, parameter: &str| {
            let found = diagnosis.added.iter().find(|added| {
                added.effect == id && target.is_none_or(|target| added.targets.iter().any(|own| own == target))
            })?;
            found.parameters.iter().find(|one| one.name == parameter).map(|one| one.value)
        };
        let scale = size("axis-scale", None, "scale");
        let drift = size("thermal-drift", Some("radius"), "change");
        if let Some(scale) = scale {
            diagnosis.warnings.push(format!(
                "axis-scale is the difference of X and Y: `pretravel_mean` holds their mean. If only one of them has it, the mean is \
                 wrong by {:.2} µm",
                (0.5 * arm * scale).abs()
            ));
        }
        let mean = after.values.iter().find(|value| value.symbol == "pretravel_mean").and_then(Value::number);
        if let (Some(change), Some(mean)) = (drift, mean) {
            diagnosis.warnings.push(format!(
                "`pretravel_mean` is the mean of those at the first and the last touch; with the drift of the radius by {change:.2} µm it is \
                 {:.2} µm at the first touch and {:.2} µm at the last",
                mean - 0.5 * change,
                mean + 0.5 * change
            ));
        }
    }

    fn name_place(&self, unexplained: &mut Unexplained, (setup, text): &(Option<usize>, String)) {
        unexplained.setup = setup.map(|setup| self.0.setups[setup].id.clone());
        unexplained.place = format!("{}; {text}", unexplained.place);
    }

    /// Where most is left: a setup, or a sector of the ring.
    fn place(&self, prepared: &Prepared, left_um: &[f64]) -> (Option<usize>, String) {
        let touches = &prepared.touches;
        let mut of_setup = vec![[0.0, 0.0]; self.0.setups.len()];
        let mut of_sector = vec![[0.0, 0.0]; SECTORS];
        for ((touch, left), std) in touches.all.iter().zip(left_um).zip(&prepared.weights.std_um) {
            let ring = angles(&self.0, touch)[1].to_degrees().rem_euclid(360.0);
            let sector = ((ring * SECTORS as f64 / 360.0) as usize).min(SECTORS - 1);
            let square = (left / std).powi(2);
            for sum in [&mut of_setup[touch.setup], &mut of_sector[sector]] {
                sum[0] += square;
                sum[1] += 1.0;
            }
        }
        let whole: f64 = of_setup.iter().map(|[squares, _]| squares).sum();
        let worst = |sums: &[[f64; 2]]| -> (usize, f64, f64) {
            let mean = |[squares, count]: &[f64; 2]| if *count > 0.0 { squares / count } else { 0.0 };
            let index = (0..sums.len()).max_by(|a, b| mean(&sums[*a]).total_cmp(&mean(&sums[*b]))).unwrap_or(0);
            let [squares, count] = sums[index];
            (index, 100.0 * squares / whole, 100.0 * count / touches.all.len() as f64)
        };
        let (setup, of_setup, touches_of_setup) = worst(&of_setup);
        let (sector, of_sector, touches_of_sector) = worst(&of_sector);
        let width = 360 / SECTORS;
        let sector = format!(
            "{of_sector:.0} % of the squares at {}° to {}° of the ring ({touches_of_sector:.0} % of the touches)",
            sector * width,
            (sector + 1) * width
        );
        let id = &self.0.setups[setup].id;
        let whole_setup =
            format!("{of_setup:.0} % of the squares in setup {id} ({touches_of_setup:.0} % of the touches), {sector}");
        let is_one = touches.setups.len() > 1 && of_setup > 1.5 * touches_of_setup;
        (is_one.then_some(setup), whole_setup)
    }
}

/// The columns that are not in the span of those before them.
fn independent(columns: Vec<Vec<f64>>) -> Vec<Option<Vec<f64>>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let kept = columns.into_iter().map(|column| {
        let whole = dot(&column, &column).sqrt();
        let mut left = column.clone();
        for _ in 0..2 {
            for known in &basis {
                let share = dot(known, &left);
                left.iter_mut().zip(known).for_each(|(entry, known)| *entry -= share * known);
            }
        }
        let size = dot(&left, &left).sqrt();
        (size > INDEPENDENT * whole).then(|| {
            basis.push(left.iter().map(|entry| entry / size).collect());
            column
        })
    });
    kept.collect()
}

/// What the final fit holds: effects that were added, of a confounded set all members, so that what depends on the choice has a
/// large uncertainty or is lost.
fn content(missing: &[Missing], diagnosis: &Diagnosis) -> Content {
    let mut content = Content::declared();
    for (index, one) in missing.iter().enumerate() {
        let effect = one.effect();
        let name = effect.name();
        let found = diagnosis.added.iter().find(|added| {
            (added.effect == effect.id && added.targets == effect.targets) || added.confounded_with.contains(&name)
        });
        let Some(found) = found else { continue };
        match one {
            Missing::LobingOrder(order) if found.confounded_with.is_empty() => content.more_lobing.push(*order),
            Missing::RingFormOrder(order) if found.confounded_with.is_empty() => content.more_form.push(*order),
            _ => content.effects.push(index),
        }
    }
    content
}

/// The residual of the loop's fit, touch by touch in µm.
fn in_order(terms: &LinearTerms, prepared: &Prepared, fit: &LinearFit) -> Vec<f64> {
    let scale = terms.observations().std.unwrap_or(1.0);
    let mut left = vec![f64::NAN; prepared.touches.all.len()];
    for (value, place) in fit.residual().into_iter().zip(terms.places()) {
        left[*place] = value * prepared.weights.std_um[*place] / scale;
    }
    left
}
