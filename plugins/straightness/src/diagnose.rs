//! The closed loop on traces along an axis.

use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::{self, Closed, Effect, Fit, Model, Setting, Settings, diagnosis::Diagnosis},
    consistency::{Check, Test},
    points::Points,
    stage::{PointDiagnosis, PointModel},
};

use crate::{
    AxialReversal,
    data::{Data, Results},
    effects::{Alteration, KINDS, Kind, alterations, candidates},
    grid::smooth,
    interpolate::cubic_slope,
    mixture::{farthest_square, mean, mean_square, moved},
    model::{TracesFit, TracesModel},
    moves::{corrected, cosine, rms},
    positions::{common_range, positions},
    separate::{Traces, finite},
    shifts::{OpenShift, between, between_setups, centre, displacements, open_shift},
    straightness::Straightness,
    trace::AxialTrace,
};

/// Points of a trace for the loop: more are averaged in blocks.
const MOST_POINTS: usize = 4000;
/// Positions on which results are compared in the loop.
const MOST_POSITIONS: usize = 1000;
/// Where no bound on the slide is declared: waves shorter than this share of the range may be the part's alone.
const SHORT: f64 = 0.2;
/// A shift takes away this share of the setups' difference at short waves, or it is no cause of it.
const SHARED: f64 = 0.5;
/// Effects that are looked for when a run only asks whether traces are shifted.
const REGISTRATION: &str = "axial-registration";

impl PointModel for AxialReversal {
    fn effects(&self) -> Vec<Effect> {
        KINDS.iter().map(|kind| kind.at(None)).collect()
    }

    fn points_name_targets(&self) -> bool {
        true
    }

    fn effects_of(&self, points: &Points) -> Result<Vec<Effect>> {
        Ok(self.candidates(&self.traces(points)?).into_iter().map(|one| one.effect).collect())
    }

    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        let (diagnosis, after) = self.diagnosed(points, settings)?;
        Ok(PointDiagnosis { diagnosis, after: after.outcome()? })
    }
}

impl AxialReversal {
    /// Runs the loop; gives the straightness with the effects added.
    ///
    /// # Errors
    /// When the traces do not hold what the model needs.
    pub fn diagnosed(&self, points: &Points, settings: &Settings) -> Result<(Diagnosis, Straightness)> {
        let traces = self.traces(points)?;
        let model = self.traces_model(points, &traces, self.0.slide_cutoff_mm, &settings.known)?;
        let Closed { mut diagnosis, after: fit, .. } = closed_loop::diagnose(&model, settings)?;
        let before = self.with(points, &traces, model.data(), &settings.known)?;
        let (mut after, open) = self.mixture(points, &traces, &model, &fit)?;
        diagnosis.warnings.extend(open);
        diagnosis.warnings.extend(self.common_shift(&after, model.data(), fit.applied()));
        diagnosis.warnings.extend(after.warnings.iter().cloned());
        if fit.remainder().dof == 0 {
            diagnosis.warnings.push(
                "one trace in each setup, and no bound on the slide's waves: the readings do not contradict each other whatever \
                 the traces lack; repeat the traces, or declare `slide_cutoff_mm`"
                    .into(),
            );
        }
        if self.0.slide_cutoff_mm.is_none() {
            diagnosis.warnings.extend(self.likely_shift(points, &traces, fit.applied())?);
        }
        after.checks.clone_from(&diagnosis.consistency);
        diagnosis.moved = moved(&before, &after);
        // The remarks are part of the diagnosis now.
        after.warnings.clear();
        finite(points, &after)?;
        Ok((diagnosis, after))
    }

    fn candidates(&self, traces: &Traces) -> Vec<crate::effects::Candidate> {
        let named = traces.all.iter().zip(&traces.setups).map(|(trace, setup)| (trace.id.clone(), *setup));
        candidates([&self.0.initial, &self.0.reversed], &named.collect::<Vec<_>>())
    }

    fn traces_model(
        &self,
        points: &Points,
        traces: &Traces,
        slide_cutoff_mm: Option<f64>,
        known: &[Setting],
    ) -> Result<TracesModel> {
        let condensed: Vec<AxialTrace> = traces.all.iter().map(|trace| trace.condensed(MOST_POINTS)).collect();
        let all: Vec<&AxialTrace> = condensed.iter().collect();
        let [first, last] = common_range(&points.input, &all)?;
        // Positions that every trace covers wherever it is shifted to.
        let margin = self.0.max_shift_mm.min(0.1 * (last - first));
        let inside = [first + margin, last - margin];
        let mut z_mm = positions(self.0.step_mm, &points.input, &all, [first, last])?;
        let step = z_mm.len().div_ceil(MOST_POSITIONS).max(1);
        z_mm = z_mm.into_iter().step_by(step).filter(|z| (inside[0]..=inside[1]).contains(z)).collect();
        if z_mm.len() < 3 {
            z_mm = vec![inside[0], 0.5 * (first + last), inside[1]];
        }
        let candidates = self.candidates(traces);
        let results = Results { smooth: slide_cutoff_mm.map(|cutoff| smooth(&z_mm, cutoff)), z_mm };
        Ok(TracesModel::new(Data {
            setups: traces.setups.clone(),
            effects: candidates.iter().map(|one| one.effect.clone()).collect(),
            candidates,
            known: known.iter().map(|setting| setting.effect).collect(),
            std_um: self.0.reading_std_um,
            max_shift_mm: self.0.max_shift_mm,
            slide_cutoff_mm,
            middle_mm: 0.5 * (first + last),
            length_mm: last - first,
            results,
            traces: condensed,
        }))
    }

    /// What effects do to each trace. Without a bound on the slide, the shifts that were found count within a setup only.
    fn altered(&self, data: &Data, applied: &[Setting]) -> Vec<Alteration> {
        let mut all = alterations(&data.candidates, applied, data.setups.len());
        if self.0.slide_cutoff_mm.is_none() {
            let (known, found): (Vec<Setting>, Vec<Setting>) =
                applied.iter().cloned().partition(|setting| data.known.contains(&setting.effect));
            let known = alterations(&data.candidates, &known, data.setups.len());
            let mut found = alterations(&data.candidates, &found, data.setups.len());
            centre(&mut found, &data.setups);
            for ((one, known), found) in all.iter_mut().zip(known).zip(found) {
                one.shift_mm = known.shift_mm + found.shift_mm;
            }
        }
        all
    }

    /// The traces with effects taken out of them, and the share of the part's deviation that the reversed setup sees.
    /// Both setups are displaced by these, in mm, besides.
    fn taken_out(&self, traces: &Traces, data: &Data, applied: &[Setting], displaced: [f64; 2]) -> (Traces, f64) {
        let mut all = self.altered(data, applied);
        for (one, setup) in all.iter_mut().zip(&traces.setups) {
            one.shift_mm += displaced[*setup];
        }
        let taken_out = Traces { all: corrected(data, &traces.all, &all), setups: traces.setups.clone() };
        (taken_out, cosine(&traces.setups, &all))
    }

    /// Straightness with effects applied.
    fn with(&self, points: &Points, traces: &Traces, data: &Data, applied: &[Setting]) -> Result<Straightness> {
        let (traces, cosine) = self.taken_out(traces, data, applied, [0.0; 2]);
        Ok(self.straightness(points, &traces, cosine, None, None)?.0)
    }

    /// The weighted mean of equivalent fits, with what is not known of their effects in the standard uncertainties, and
    /// what the user should know of it.
    fn mixture(
        &self,
        points: &Points,
        traces: &Traces,
        model: &TracesModel,
        fit: &TracesFit,
    ) -> Result<(Straightness, Vec<String>)> {
        let data = model.data();
        let mut each: Vec<Equivalent> = Vec::new();
        for (weight, fit) in fit.members() {
            let open = open_shift(data, fit);
            let displaced = displacements(open.as_ref().map_or([0.0; 2], |open| open.setups_mm));
            let displaced = displaced
                .into_iter()
                .map(|(share, by_mm)| (share, self.taken_out(traces, data, fit.applied(), by_mm)))
                .collect();
            each.push(Equivalent { weight, fit, open, displaced });
        }
        let all = each.iter().flat_map(|one| one.displaced.iter().flat_map(|(_, (traces, _))| &traces.all));
        let [first, last] = common_range(&points.input, &all.collect::<Vec<_>>())?;
        let own = each.first().and_then(|one| one.displaced.first());
        let own: Vec<&AxialTrace> = own.map_or_else(Vec::new, |(_, (traces, _))| traces.all.iter().collect());
        let mut z_mm = positions(self.0.step_mm, &points.input, &own, common_range(&points.input, &own)?)?;
        z_mm.retain(|z| (first..=last).contains(z));
        let on = (each.iter().map(|one| one.displaced.len()).sum::<usize>() > 1).then_some(z_mm.as_slice());
        let mut said = Vec::new();
        let mut results = Vec::with_capacity(each.len());
        for one in &each {
            let mut displaced = Vec::with_capacity(one.displaced.len());
            let errors = one.fit.trace_errors();
            for (share, (traces, cosine)) in &one.displaced {
                displaced.push((*share, self.straightness(points, traces, *cosine, on, errors.as_ref())?.0));
            }
            let Some(mut result) = mean(&displaced, mean_square) else { continue };
            said.push(self.widen(&mut result, data, one));
            results.push((one.weight, result));
        }
        let said = said.into_iter().next().unwrap_or_default();
        let mean = mean(&results, farthest_square);
        let none = || {
            Error::new("diagnose", points.input.display().to_string(), "no fit explains the traces")
                .of(ErrorKind::Numerical)
        };
        Ok((mean.ok_or_else(none)?, said))
    }

    /// Takes into the standard uncertainties what is not known of the effects, and what the data leave open of the shift
    /// between the setups. Says what that is.
    fn widen(&self, after: &mut Straightness, data: &Data, Equivalent { fit, open, .. }: &Equivalent) -> Vec<String> {
        let on = Results {
            z_mm: after.z_mm.clone(),
            smooth: self.0.slide_cutoff_mm.map(|cutoff| smooth(&after.z_mm, cutoff)),
        };
        for (effects, covariance) in fit.uncertain() {
            let moves: Vec<_> = effects.iter().flat_map(|effect| on.moves(data, fit.applied(), *effect)).collect();
            for (which, errors) in after.errors.iter_mut().enumerate() {
                let moves: Vec<&[f64]> = moves.iter().map(|both| both[which].as_slice()).collect();
                errors.add(&moves, covariance);
            }
            for (which, std_um) in [&mut after.part_std_um, &mut after.slide_std_um].into_iter().enumerate() {
                for (at, std) in std_um.iter_mut().enumerate() {
                    let of = |row: usize| moves[row][which].get(at).copied().unwrap_or(0.0);
                    let variance: f64 = covariance
                        .iter()
                        .enumerate()
                        .map(|(row, entries)| {
                            of(row) * entries.iter().enumerate().map(|(column, entry)| entry * of(column)).sum::<f64>()
                        })
                        .sum();
                    *std = (*std * *std + variance.max(0.0)).sqrt();
                }
            }
        }
        let Some(open) = open else { return Vec::new() };
        let moves = on.moves(data, fit.applied(), open.effect);
        let Some(both) = moves.first() else { return Vec::new() };
        for (errors, moved) in after.errors.iter_mut().zip(both) {
            errors.common_um.push(moved.iter().map(|moved| moved * open.extra.sqrt()).collect());
        }
        for (std_um, moved) in [&mut after.part_std_um, &mut after.slide_std_um].into_iter().zip(both) {
            for (std, moved) in std_um.iter_mut().zip(moved) {
                *std = (*std * *std + moved * moved * open.extra).sqrt();
            }
        }
        vec![format!(
            "the shifts of the traces scatter by {:.4} mm, so that all traces of {} may be shifted together by ±{:.4} mm against \
             those of {}: these data do not show it, and the stated uncertainties hold it ({:.3} µm rms of the slide)",
            open.scatter_mm,
            self.0.reversed,
            open.std_mm,
            self.0.initial,
            rms(&both[1]) * open.std_mm,
        )]
    }

    /// What a shift of all traces together does, where shifts were found and a bound on the slide makes the others observable.
    fn common_shift(&self, after: &Straightness, data: &Data, applied: &[Setting]) -> Option<String> {
        let shifted = |setting: &Setting| data.candidates[setting.effect].kind == Kind::AxialRegistration;
        if self.0.slide_cutoff_mm.is_none() || !applied.iter().any(shifted) {
            return None;
        }
        let slopes: Vec<f64> = after.z_mm.iter().map(|z| cubic_slope(&after.z_mm, &after.part_um, *z)).collect();
        Some(format!(
            "a shift of all traces together is not observable: it moves the part along z ({:.3} µm rms for 0.1 mm). z counts as in \
             the traces without a shift, and the stated uncertainties do not include an error of their z",
            0.1 * rms(&slopes)
        ))
    }

    /// What traces say against values of a run, which corrects no shift, and the fit without any.
    pub(crate) fn contradictions(&self, points: &Points, traces: &Traces) -> Result<(Vec<Check>, TracesFit)> {
        let model = self.traces_model(points, traces, self.0.slide_cutoff_mm, &[])?;
        let settings =
            Settings { effects: Some(vec![REGISTRATION.into()]), max_added: traces.all.len(), ..Settings::default() };
        let closed = closed_loop::diagnose(&model, &settings)?;
        let mut said = closed.before.consistency();
        let added = &closed.diagnosis.added;
        if !added.is_empty() {
            let shift = |one: &runout_core::closed_loop::diagnosis::Added| {
                let value = one.parameters.first().map_or(f64::NAN, |parameter| parameter.value);
                let others = if one.confounded_with.is_empty() { "" } else { " (or another trace against it)" };
                format!("{} by {value:.3} mm{others}", one.targets.join(", "))
            };
            let [before, after] = [&closed.diagnosis.before, &closed.diagnosis.after];
            let ratio = (before.residual_rms_um / after.residual_rms_um).powi(2);
            let dof = [added.len() as f64, after.degrees_of_freedom as f64];
            let p = added.iter().map(|one| one.p_value).fold(1.0, f64::min);
            said.push(Check::new(Test::Shift, "traces along the axis", ratio, &dof, p).finding(|| format!(
                "traces contradict each other through axial shifts: {}; with them the traces differ by {:.4} µm rms instead of {:.4}: \
                 `runout diagnose` corrects it",
                added.iter().map(shift).collect::<Vec<_>>().join("; "),
                after.residual_rms_um,
                before.residual_rms_um,
            )));
        }
        if self.0.slide_cutoff_mm.is_none() {
            let likely = self.likely_shift(points, traces, closed.after.applied())?;
            said.extend(
                likely.map(|said| Check::new(Test::Shift, "setups along the axis", 0.0, &[], 0.0).finding(|| said)),
            );
        }
        Ok((said, closed.before))
    }

    /// A shift between the setups, where nothing bounds the slide: it is not observable, but likely where it takes away most of
    /// how the setups differ at short waves.
    fn likely_shift(&self, points: &Points, traces: &Traces, applied: &[Setting]) -> Result<Option<String>> {
        let free = self.traces_model(points, traces, None, &[])?;
        let cutoff_mm = SHORT * free.data().length_mm;
        let spacing = traces.all.iter().map(AxialTrace::spacing_mm).fold(0.0, f64::max);
        if cutoff_mm < 8.0 * spacing {
            return Ok(None);
        }
        let model = self.traces_model(points, traces, Some(cutoff_mm), applied)?;
        let Some(effect) = between_setups(model.data()) else { return Ok(None) };
        let left_out = (0..model.effects().len()).filter(|other| *other != effect).collect();
        let settings = Settings { known: applied.to_vec(), left_out, max_added: 1, ..Settings::default() };
        let closed = closed_loop::diagnose(&model, &settings)?;
        if closed.diagnosis.added.is_empty() {
            return Ok(None);
        }
        let bounded = AxialReversal(crate::AxialReversalConfig { slide_cutoff_mm: Some(cutoff_mm), ..self.0.clone() });
        let short = |all: &[Alteration]| -> Result<f64> {
            let all = Traces { all: corrected(model.data(), &traces.all, all), setups: traces.setups.clone() };
            Ok(bounded.straightness(points, &all, 1.0, None, None)?.1.beyond_smooth_um)
        };
        let [without, with] =
            [self.altered(free.data(), applied), bounded.altered(model.data(), closed.after.applied())];
        let (before, after) = (short(&without)?, short(&with)?);
        let [without, with] = [without, with].map(|all| between(&all, &traces.setups));
        let shift = with - without;
        Ok((after < SHARED * before).then(|| {
            format!(
                "{} is likely to be shifted by {shift:.3} mm against {}: then the slide has {after:.4} instead of {before:.4} µm rms \
                 at waves shorter than {cutoff_mm:.1} mm. Without a bound on the slide's waves this is not observable: declare \
                 `slide_cutoff_mm` if the slide has none so short, and `runout diagnose` corrects it",
                self.0.reversed, self.0.initial
            )
        }))
    }
}

/// A fit that explains the data as well as others do.
struct Equivalent<'a> {
    weight: f64,
    fit: &'a TracesFit,
    open: Option<OpenShift>,
    /// Traces and cosine with its effects taken out, and the setups displaced: the share of each in the mean.
    displaced: Vec<(f64, (Traces, f64))>,
}

#[cfg(test)]
mod tests;
