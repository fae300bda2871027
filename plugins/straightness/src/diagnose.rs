//! The closed loop on traces along an axis.

use runout_core::{
    Error, ErrorKind, Result,
    evaluate::straightness::strt_lsli_um,
    model::{
        Effect, Fit, Model, Setting,
        closed_loop::{self, Closed, Settings},
        diagnosis::{Diagnosis, Moved},
    },
    points::Points,
    stage::{PointDiagnosis, PointModel},
};

use crate::{
    AxialReversal,
    effects::{Alteration, KINDS, Kind, alterations, candidates},
    grid::smooth,
    interpolate::cubic_slope,
    model::{Data, TracesFit, TracesModel},
    moves::{Results, corrected, cosine, rms},
    positions::{common_range, positions},
    separate::{Traces, finite},
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
        Ok(self.straightness(points, &traces, cosine, None)?.0)
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
            for (share, (traces, cosine)) in &one.displaced {
                displaced.push((*share, self.straightness(points, traces, *cosine, on)?.0));
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
                errors.add(&moves, &covariance);
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

    /// What traces say of shifts against each other, for a run that does not look for them.
    pub(crate) fn contradictions(&self, points: &Points, traces: &Traces) -> Result<Vec<String>> {
        let model = self.traces_model(points, traces, self.0.slide_cutoff_mm, &[])?;
        let settings =
            Settings { effects: Some(vec![REGISTRATION.into()]), max_added: traces.all.len(), ..Settings::default() };
        let closed = closed_loop::diagnose(&model, &settings)?;
        let mut said = Vec::new();
        let added = &closed.diagnosis.added;
        if !added.is_empty() {
            let shift = |one: &runout_core::model::diagnosis::Added| {
                let value = one.parameters.first().map_or(f64::NAN, |parameter| parameter.value);
                let others = if one.confounded_with.is_empty() { "" } else { " (or another trace against it)" };
                format!("{} by {value:.3} mm{others}", one.targets.join(", "))
            };
            said.push(format!(
                "traces contradict each other through axial shifts: {}; with them the traces differ by {:.4} µm rms instead of {:.4}. \
                 The straightness and its uncertainty do not hold this: `runout diagnose` corrects it",
                added.iter().map(shift).collect::<Vec<_>>().join("; "),
                closed.diagnosis.after.residual_rms_um,
                closed.diagnosis.before.residual_rms_um,
            ));
        }
        if self.0.slide_cutoff_mm.is_none() {
            said.extend(self.likely_shift(points, traces, closed.after.applied())?);
        }
        Ok(said)
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
            Ok(bounded.straightness(points, &all, 1.0, None)?.1.beyond_smooth_um)
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

/// Only differences of the shifts of a setup's traces are observable. They count from the traces that no shift was found of,
/// where these are more than half of the setup; else from the mean, so that the setup stays where it was without them. Results
/// are then a mean over where the setup may be ([`displacements`]), which has the least mean square error; not over more than the
/// traces scatter, as the mean of traces that are not registered is.
fn centre(all: &mut [Alteration], setups: &[usize]) {
    for own in [0, 1] {
        let members: Vec<usize> = (0..setups.len()).filter(|trace| setups[*trace] == own).collect();
        if majority(&members.iter().map(|trace| all[*trace].shift_mm).collect::<Vec<f64>>()) {
            continue;
        }
        let mean = members.iter().map(|trace| all[*trace].shift_mm).sum::<f64>() / members.len() as f64;
        for trace in members {
            all[trace].shift_mm -= mean;
        }
    }
}

/// Whether no shift was found of more than half of a setup's traces: these then say where the setup is.
fn majority(shifts_mm: &[f64]) -> bool {
    2 * shifts_mm.iter().filter(|shift| **shift == 0.0).count() > shifts_mm.len()
}

/// The mean shift of the reversed setup's traces less that of the initial one's, in mm.
fn between(all: &[Alteration], setups: &[usize]) -> f64 {
    let mean = |own: usize| {
        let shifts = setups.iter().zip(all).filter(|(setup, _)| **setup == own).map(|(_, one)| one.shift_mm);
        shifts.clone().sum::<f64>() / shifts.count() as f64
    };
    mean(1) - mean(0)
}

/// The weighted mean of results, at the positions that all of them have. Its variance is the mean one and what `spread` makes
/// of the weights of the results and their distances from it.
fn mean(results: &[(f64, Straightness)], spread: fn(&[(f64, f64)]) -> f64) -> Option<Straightness> {
    let mut mean = results.first()?.1.clone();
    if results.len() == 1 {
        return Some(mean);
    }
    let at = |one: &Straightness, z: &f64| one.z_mm.binary_search_by(|own| own.total_cmp(z)).ok();
    mean.z_mm.retain(|z| results.iter().all(|(_, one)| at(one, z).is_some()));
    let z_mm = mean.z_mm.clone();
    let mixed = |of: fn(&Straightness) -> [&Vec<f64>; 2]| -> [Vec<f64>; 2] {
        let both = z_mm.iter().map(|z| {
            let each = results.iter().filter_map(|(weight, one)| {
                let [value, std] = of(one).map(|values| at(one, z).and_then(|index| values.get(index)).copied());
                Some((*weight, value?, std?))
            });
            let centre: f64 = each.clone().map(|(weight, value, _)| weight * value).sum();
            let noise: f64 = each.clone().map(|(weight, _, std)| weight * std * std).sum();
            let distances: Vec<(f64, f64)> = each.map(|(weight, value, _)| (weight, value - centre)).collect();
            (centre, (noise + spread(&distances)).sqrt())
        });
        let (values, std): (Vec<f64>, Vec<f64>) = both.unzip();
        [values, std]
    };
    let kept: Vec<usize> = z_mm.iter().filter_map(|z| at(&results[0].1, z)).collect();
    mean.errors = mean.errors.each_ref().map(|errors| errors.at(&kept));
    [mean.part_um, mean.part_std_um] = mixed(|one| [&one.part_um, &one.part_std_um]);
    [mean.slide_um, mean.slide_std_um] = mixed(|one| [&one.slide_um, &one.slide_std_um]);
    // What the results differ by from their mean changes the whole profile.
    let both = [
        (&mean.part_um, (|one| &one.part_um) as fn(&Straightness) -> &Vec<f64>),
        (&mean.slide_um, |one: &Straightness| &one.slide_um),
    ];
    for (errors, (centre, of)) in mean.errors.iter_mut().zip(both) {
        let changes = results.iter().map(|(weight, one)| {
            let value = |z: &f64| at(one, z).and_then(|index| of(one).get(index)).copied();
            let change = z_mm.iter().zip(centre).map(|(z, centre)| value(z).map_or(0.0, |value| value - centre));
            (*weight, change.collect::<Vec<f64>>())
        });
        let changes: Vec<(f64, Vec<f64>)> = changes.collect();
        let distances: Vec<(f64, f64)> = changes.iter().map(|(weight, change)| (*weight, rms(change))).collect();
        let all: f64 = distances.iter().map(|(_, distance)| distance * distance).sum();
        let share = if all > 0.0 { (spread(&distances) / all).sqrt() } else { 0.0 };
        errors.common_um.extend(changes.iter().map(|(_, change)| change.iter().map(|value| share * value).collect()));
    }
    Some(mean)
}

/// The shift of the reversed setup against the initial one.
fn between_setups(data: &Data) -> Option<usize> {
    let whole = |one: &crate::effects::Candidate| {
        one.kind == Kind::AxialRegistration && one.traces.iter().all(|trace| data.setups[*trace] == 1)
    };
    let size = data.setups.iter().filter(|setup| **setup == 1).count();
    data.candidates.iter().position(|one| whole(one) && one.traces.len() == size)
}

/// What the data leave open of the shift between the setups.
struct OpenShift {
    effect: usize,
    /// Standard deviation of the shifts of traces in one setup.
    scatter_mm: f64,
    /// Standard uncertainty of the setups' shift.
    std_mm: f64,
    /// Standard uncertainty of the mean shift of each setup over which results are averaged, in mm; 0 where they are not.
    setups_mm: [f64; 2],
    /// Variance of the setups' shift beyond that and beyond what the effects' covariance holds, in mm².
    extra: f64,
}

/// A fit that explains the data as well as others do.
struct Equivalent<'a> {
    weight: f64,
    fit: &'a TracesFit,
    open: Option<OpenShift>,
    /// Traces and cosine with its effects taken out, and the setups displaced: the share of each in the mean.
    displaced: Vec<(f64, (Traces, f64))>,
}

/// Displacements of the setups in mm, with their shares, by which a mean over normally distributed ones is taken
/// (Gauss-Hermite with three places; the result is a sum over the setups, so that they are displaced one at a time).
fn displacements(setups_mm: [f64; 2]) -> Vec<(f64, [f64; 2])> {
    let mut all = vec![(1.0, [0.0; 2])];
    for (setup, std_mm) in setups_mm.into_iter().enumerate().filter(|(_, std_mm)| *std_mm > 0.0) {
        for sign in [-1.0, 1.0] {
            let mut by_mm = [0.0; 2];
            by_mm[setup] = sign * 3.0_f64.sqrt() * std_mm;
            all.push((1.0 / 6.0, by_mm));
            all[0].0 -= 1.0 / 6.0;
        }
    }
    all
}

/// Weighted mean square of distances from a mean.
fn mean_square(distances: &[(f64, f64)]) -> f64 {
    distances.iter().map(|(weight, distance)| weight * distance * distance).sum()
}

/// Square of the farthest distance from a mean.
fn farthest_square(distances: &[(f64, f64)]) -> f64 {
    distances.iter().map(|(_, distance)| distance * distance).fold(0.0, f64::max)
}

/// Where traces of a setup are shifted against each other, the means of the setups are shifted as much by chance; what
/// shows only in a confounded set or not at all stays open. Shifts are taken for normally distributed with the scatter
/// that was found, and Student's variance counts for how few they are.
fn open_shift(data: &Data, fit: &TracesFit) -> Option<OpenShift> {
    let effect = between_setups(data)?;
    let added = |index: usize| fit.applied().iter().any(|setting| setting.effect == index);
    let of_kind = |index: &usize| data.candidates[*index].kind == Kind::AxialRegistration;
    if added(effect) || !(0..data.candidates.len()).filter(of_kind).any(added) {
        return None;
    }
    let all = alterations(&data.candidates, fit.applied(), data.traces.len());
    let of_setup = |setup: usize| -> Vec<f64> {
        let own = data.setups.iter().zip(&all).filter(|(own, _)| **own == setup);
        own.map(|(_, alteration): (_, &Alteration)| alteration.shift_mm).collect()
    };
    let shifts = [of_setup(0), of_setup(1)];
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = shifts.iter().map(|own| own.iter().map(|shift| (shift - mean(own)).powi(2)).sum::<f64>()).sum();
    let counts = shifts.each_ref().map(|own| own.len() as f64);
    let freedom = counts[0] + counts[1] - 2.0;
    let scatter = squares / freedom;
    let few = if freedom >= 3.0 { freedom / (freedom - 2.0) } else { 3.0 };
    let of_mean = counts.map(|count| few * scatter / count);
    let prior = of_mean[0] + of_mean[1];
    let free = data.slide_cutoff_mm.is_none();
    let setups_mm = [0, 1].map(|setup| {
        let own = &shifts[setup];
        let about = own.iter().map(|shift| (shift - mean(own)).powi(2)).sum::<f64>() / counts[setup];
        if free && !majority(own) { of_mean[setup].min(about).sqrt() } else { 0.0 }
    });
    let signature = fit.signature(effect);
    let unit = if fit.remainder().noise_is_known() { 1.0 } else { fit.remainder().chi2_per_dof() };
    let known: f64 = signature.iter().flatten().map(|entry| entry * entry).sum::<f64>() / unit;
    let open = 1.0 / (1.0 / prior + known);
    let weight = |trace: usize| {
        let setup = data.setups[trace];
        (if setup == 0 { -1.0 } else { 1.0 }) / counts[setup]
    };
    let held: f64 = fit
        .uncertain()
        .iter()
        .map(|(effects, covariance)| {
            let parameters = effects.iter().flat_map(|effect| {
                let one = &data.candidates[*effect];
                let weight = if one.kind == Kind::AxialRegistration {
                    one.traces.iter().map(|trace| weight(*trace)).sum::<f64>()
                } else {
                    0.0
                };
                vec![weight; one.effect.parameters.len()]
            });
            let weights: Vec<f64> = parameters.collect();
            let rows = covariance.iter().zip(&weights);
            rows.map(|(row, weight)| weight * row.iter().zip(&weights).map(|(entry, other)| entry * other).sum::<f64>())
                .sum::<f64>()
        })
        .sum();
    let averaged: f64 = setups_mm.iter().map(|std_mm| std_mm * std_mm).sum();
    Some(OpenShift {
        effect,
        scatter_mm: scatter.sqrt(),
        std_mm: open.sqrt(),
        setups_mm,
        extra: (open - averaged - held).max(0.0),
    })
}

/// STRt and rms of part and slide, before and after.
fn moved(before: &Straightness, after: &Straightness) -> Vec<Moved> {
    let of = |result: &Straightness| {
        [&result.part_um, &result.slide_um].map(|values| [strt_lsli_um(&result.z_mm, values), rms(values)])
    };
    let std = [0, 1].map(|which| after.std_of_values(which));
    let (before, after) = (of(before), of(after));
    let both = ["part", "slide"].into_iter().zip(before.into_iter().zip(after).zip(std));
    both.flat_map(|(section, ((before, after), std))| {
        let one = |value: &str, [before, after]: [f64; 2], std: f64| Moved {
            value: value.into(),
            section: Some(section.into()),
            before,
            after,
            std: std.is_finite().then_some(std),
            unit: "um".into(),
            reference: Some("LSLI".into()),
            filter: Some("none".into()),
            lost_orders: Vec::new(),
        };
        let values = ["STRt", "straightness rms"].into_iter().enumerate();
        values.map(|(which, value)| one(value, [before[which], after[which]], std[which])).collect::<Vec<_>>()
    })
    .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_core::points::{Column, Trace};

    use super::*;
    use crate::AxialReversalConfig;

    /// Two and three traces of two bent profiles, each sampled otherwise.
    fn points() -> Points {
        let (mut z_mm, mut reading_um, mut traces) = (Vec::new(), Vec::new(), Vec::new());
        for (number, setup) in ["initial", "initial", "reversed", "reversed", "reversed"].into_iter().enumerate() {
            let start = z_mm.len();
            let sign = if setup == "initial" { 1.0 } else { -1.0 };
            for index in 0..90 {
                let z = 0.5 * f64::from(index) + 0.07 * number as f64 + 0.05 * f64::from(index % 3);
                let (part, slide) = ((z / 3.0).sin() + 0.02 * (z - 20.0).powi(2) / 20.0, 0.3 * (z / 9.0).cos());
                z_mm.push(z);
                reading_um.push(part + sign * slide + 4.0 * number as f64 + 0.02 * (17.0 * z).sin());
            }
            traces.push(Trace { id: format!("{number}"), kind: setup.into(), points: start..z_mm.len() });
        }
        let columns = vec![
            Column { name: "z_mm".into(), values: z_mm },
            Column { name: "reading_um".into(), values: reading_um },
        ];
        Points { input: "made.csv".into(), columns, traces, ..Points::default() }
    }

    fn model(slide_cutoff_mm: Option<f64>) -> TracesModel {
        let separator = AxialReversalConfig { slide_cutoff_mm, ..AxialReversalConfig::default() }.separator().unwrap();
        let points = points();
        separator.traces_model(&points, &separator.traces(&points).unwrap(), slide_cutoff_mm, &[]).unwrap()
    }

    /// Values of every effect, none of them 0.
    fn much(kind: Kind) -> Vec<f64> {
        match kind {
            Kind::AxialRegistration => vec![0.083],
            Kind::SensorGain => vec![-0.04],
            Kind::PartTilt => vec![0.3],
            Kind::RotationOffset => vec![8.0],
            Kind::ThermalDrift => vec![0.4, 0.22],
        }
    }

    fn zero(kind: Kind) -> Vec<f64> {
        kind.parameters().iter().map(|parameter| if parameter.name == "time_constant" { 0.3 } else { 0.0 }).collect()
    }

    /// Signatures beside differences of what is left, outside the span of everything that is fitted, and moves beside
    /// differences of part and slide: of each effect alone, at nothing and at much, beside another effect.
    #[test]
    fn signatures_and_moves_are_those_of_refits() {
        for cutoff in [None, Some(15.0)] {
            let model = model(cutoff);
            let beside = model.effects().iter().position(|effect| effect.targets == ["4"]).unwrap();
            for effect in (0..model.effects().len()).filter(|effect| *effect != beside) {
                let kind = model.data().candidates[effect].kind;
                for values in [zero(kind), much(kind)] {
                    let with = |values: &[f64]| {
                        vec![
                            Setting { effect: beside, values: much(model.data().candidates[beside].kind) },
                            Setting { effect, values: values.to_vec() },
                        ]
                    };
                    let fit = model.fit(&with(&values)).unwrap();
                    let data = model.data();
                    let moves = data.results.moves(data, fit.applied(), effect).into_iter();
                    let moves: Vec<Vec<f64>> = moves.map(|both| both.into_iter().flatten().collect()).collect();
                    let signature = fit.signature(effect);
                    for parameter in 0..values.len() {
                        let step = 1e-5;
                        let moved = |sign: f64| {
                            let mut values = values.clone();
                            values[parameter] += sign * step;
                            model.fit(&with(&values)).unwrap()
                        };
                        let (up, down) = (moved(1.0), moved(-1.0));
                        let slope = |up: &[f64], down: &[f64]| -> Vec<f64> {
                            up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * step)).collect()
                        };
                        // A refit also turns the span of what is fitted, by as much as is left: that part lies in the span.
                        let change = fit.outside(&slope(&up.remainder().residual, &down.remainder().residual));
                        let distance =
                            |a: &[f64], b: &[f64]| rms(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>());
                        let named = format!("{cutoff:?} {:?} {parameter}", model.effects()[effect]);
                        // 1e-6: rounding of readings near 10 µm over 2e-5, and the step's square.
                        assert!(distance(&signature[parameter], &change) < 1e-6 * (1.0 + rms(&change)), "{named}");
                        let change = slope(&up.results(), &down.results());
                        assert!(distance(&moves[parameter], &change) < 1e-6 * (1.0 + rms(&change)), "{named}");
                    }
                }
            }
        }
    }

    #[test]
    fn shifts_count_from_a_majority_or_the_mean() {
        let shifted = |shift_mm| Alteration { shift_mm, ..Alteration::default() };
        let mut all = [0.0, 0.1, 0.0, 0.3, 0.0, 0.3].map(shifted);
        centre(&mut all, &[0, 0, 0, 1, 1, 1]);
        let found: Vec<f64> = all.iter().map(|one| one.shift_mm).collect();
        for (found, expected) in found.iter().zip([0.0, 0.1, 0.0, 0.1, -0.2, 0.1]) {
            assert!((found - expected).abs() < 1e-15);
        }
    }
}
