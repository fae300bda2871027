//! The closed loop on a surface.

use runout_core::{
    Error, Result,
    closed_loop::{
        self, Closed, Effect, Fit as _, Model, Settings,
        diagnosis::{Diagnosis, Estimated, Moved, Unexplained, Verdict},
    },
    points::Points,
    stage::{Outcome, PointDiagnosis, PointModel},
};

use crate::{
    aliases::{self, Aliases, named},
    effects::{MISSING, SPINDLE_LINE},
    model::{CutFit, CutModel},
    separate::{FlyCutting, Measured, left_of, smaller, too_smooth},
    strangers::{self, Stranger},
};

/// How often unmodelled disturbances are looked for, taken out, and the loop run again.
const ROUNDS: usize = 3;
/// Unmodelled disturbances that are listed.
const LISTED: usize = 5;
/// Key values before and after.
const LOOKED_AT: [&str; 3] = ["Sq", "Sz", "Sa"];
/// What separates ratios of a line.
const DISTINGUISHED_BY: &str =
    "a map that reaches further along y, or with less noise; a recording of the spindle shows the frequency";

impl PointModel for FlyCutting {
    fn effects(&self) -> Vec<Effect> {
        MISSING.iter().map(|missing| missing.effect()).collect()
    }

    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        let measured = self.measured(points)?;
        if let Some(problem) = too_smooth(&measured.heights, &self.0) {
            let help = "`run` shows the map all the same; the key `feed_um_per_rev` and the unit of the heights are worth a look";
            return Err(Error::new("diagnose", points.input.display().to_string(), problem).help(help));
        }
        let mut taken = vec![false; measured.heights.len()];
        let mut strangers: Vec<Stranger> = Vec::new();
        let mut round = 0;
        let (closed, aliases) = loop {
            round += 1;
            let used = measured.heights.part(|_, point| !taken[point]);
            let model = CutModel::new(&self.0, &used, &settings.known);
            let mut closed = closed_loop::diagnose(&model, settings)?;
            let aliases = aliases::find(&model, &mut closed, settings.known.len(), self.0.max_frequency_ratio);
            refresh(&model, &mut closed, settings);
            let found = strangers::find(&measured.heights, &measured.grid, &left_of(&measured.heights, &closed.after));
            let is_new = found.taken.iter().zip(&taken).any(|(found, taken)| *found && !taken);
            if !found.all.is_empty() {
                strangers = found.all;
            }
            if !is_new || round == ROUNDS {
                break (closed, aliases);
            }
            taken.iter_mut().zip(&found.taken).for_each(|(taken, found)| *taken |= found);
        };
        let left_out = taken.iter().filter(|taken| **taken).count();
        self.reported(&measured, closed, &aliases, &strangers, left_out)
    }
}

impl FlyCutting {
    fn reported(
        &self,
        measured: &Measured,
        closed: Closed<CutFit>,
        aliases: &[Aliases],
        strangers: &[Stranger],
        left_out: usize,
    ) -> Result<PointDiagnosis> {
        let Closed { mut diagnosis, before, after: last, settings } = closed;
        let mut after = self.fitted_outcome(measured, (&before, &last), &settings, measured.remarks.clone())?;
        after.checks.clone_from(&diagnosis.consistency);
        diagnosis.moved = moved(&after);
        for set in aliases {
            confound(&mut diagnosis, set);
        }
        if !strangers.is_empty() {
            diagnosis.verdict = Verdict::Unexplained;
            diagnosis.unexplained.splice(0..0, strangers.iter().take(LISTED).map(unexplained));
            diagnosis.warnings.push(format!(
                "{}: {left_out} points are left out of the fit, and are part of all values",
                match strangers.len() {
                    1 => "the residual in one place is no effect of the cut".to_owned(),
                    count => format!("the residual in {count} places is no effect of the cut"),
                }
            ));
        }
        let left = last.remainder();
        let below = smaller(left.noise_is_known(), left.chi2_per_dof(), left.dof);
        if below.is_some() {
            // The noise or the unit of the heights is wrong: nothing says what noise is.
            diagnosis.verdict = match diagnosis.verdict {
                Verdict::Explained => Verdict::Improved,
                Verdict::AtNoiseFloor => Verdict::NothingFound,
                other => other,
            };
        }
        diagnosis.warnings.extend(below);
        diagnosis.warnings.append(&mut after.remarks);
        Ok(PointDiagnosis { diagnosis, after })
    }
}

/// Takes parameters of lines from the final settings: another ratio may have taken the place of the one that was found.
fn refresh(model: &CutModel, closed: &mut Closed<CutFit>, settings: &Settings) {
    for setting in &closed.settings[settings.known.len()..] {
        let effect = MISSING[setting.effect].effect();
        let is = |added: &&mut runout_core::closed_loop::diagnosis::Added| {
            added.effect == effect.id && added.targets == effect.targets
        };
        let Some(added) = closed.diagnosis.added.iter_mut().find(is) else { continue };
        if effect.id != SPINDLE_LINE || added.parameters.len() < setting.values.len() {
            continue;
        }
        let mut values = setting.values.clone();
        if let [ratio, _, phase_deg] = &mut values[..] {
            // At the pass nearest to x = 0, which need not be the pass 0 of the fit.
            *phase_deg -= 360.0 * *ratio * closed.after.feeds_off();
        }
        let parameters = effect.parameters.iter().zip(&values).zip(&added.parameters);
        let estimated = parameters.map(|((parameter, value), known)| Estimated {
            name: parameter.name.clone(),
            value: *value,
            std: known.std,
            unit: parameter.unit.clone(),
        });
        added.parameters = model.present(setting.effect, estimated.collect());
    }
}

/// Names the ratios that the map cannot separate.
fn confound(diagnosis: &mut Diagnosis, set: &Aliases) {
    let effect = MISSING[set.effect].effect();
    let found = diagnosis.added.iter_mut().find(|added| added.effect == effect.id && added.targets == effect.targets);
    let Some(added) = found.filter(|_| !set.ratios.is_empty()) else { return };
    added.confounded_with.extend(set.ratios.iter().map(|ratio| named(*ratio)));
    added.distinguished_by = Some(DISTINGUISHED_BY.into());
    // The value of one member is conditional on a choice that the data do not make.
    added.parameters.iter_mut().for_each(|parameter| parameter.std = None);
}

fn unexplained(stranger: &Stranger) -> Unexplained {
    let Stranger { x_mm, y_mm, points, farthest_nm, rms_nm } = stranger;
    let extent = |[from, to]: [f64; 2]| format!("{from:.3} to {to:.3} mm");
    Unexplained {
        station: None,
        sensor: None,
        setup: None,
        orders: [0, 0],
        rms_um: 1e-3 * rms_nm,
        place: format!(
            "x {}, y {}: {points} points, up to {farthest_nm:.1} nm from the model",
            extent(*x_mm),
            extent(*y_mm)
        ),
    }
}

/// Values of the surface as measured and as corrected.
fn moved(after: &Outcome) -> Vec<Moved> {
    let number = |symbol: &str, of: &str| {
        let found = after.values.iter().find(|value| value.symbol == symbol && value.of.as_deref() == Some(of));
        found.and_then(|value| Some((value.number()?, value.unit.clone())))
    };
    let of = |symbol: &&str| {
        let (before, unit) = number(symbol, "measured")?;
        let (after, _) = number(symbol, "corrected").unwrap_or((before, String::new()));
        Some(Moved {
            value: (*symbol).to_owned(),
            section: None,
            before,
            after,
            std: None,
            unit,
            reference: None,
            filter: None,
            lost_orders: Vec::new(),
        })
    };
    LOOKED_AT.iter().filter_map(of).collect()
}
