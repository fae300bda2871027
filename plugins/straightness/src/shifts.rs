//! Shifts of traces along z, and what the data leave open of the shift between the setups.

use runout_core::closed_loop::Fit;

use crate::{
    data::Data,
    effects::{Alteration, Candidate, Kind, alterations},
    model::TracesFit,
};

/// Only differences of the shifts of a setup's traces are observable. They count from the traces that no shift was found of,
/// where these are more than half of the setup; else from the mean, so that the setup stays where it was without them. Results
/// are then a mean over where the setup may be ([`displacements`]), which has the least mean square error; not over more than the
/// traces scatter, as the mean of traces that are not registered is.
pub(crate) fn centre(all: &mut [Alteration], setups: &[usize]) {
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
pub(crate) fn majority(shifts_mm: &[f64]) -> bool {
    2 * shifts_mm.iter().filter(|shift| **shift == 0.0).count() > shifts_mm.len()
}

/// The mean shift of the reversed setup's traces less that of the initial one's, in mm.
pub(crate) fn between(all: &[Alteration], setups: &[usize]) -> f64 {
    let mean = |own: usize| {
        let shifts = setups.iter().zip(all).filter(|(setup, _)| **setup == own).map(|(_, one)| one.shift_mm);
        shifts.clone().sum::<f64>() / shifts.count() as f64
    };
    mean(1) - mean(0)
}

/// The shift of the reversed setup against the initial one.
pub(crate) fn between_setups(data: &Data) -> Option<usize> {
    let whole = |one: &Candidate| {
        one.kind == Kind::AxialRegistration && one.traces.iter().all(|trace| data.setups[*trace] == 1)
    };
    let size = data.setups.iter().filter(|setup| **setup == 1).count();
    data.candidates.iter().position(|one| whole(one) && one.traces.len() == size)
}

/// What the data leave open of the shift between the setups.
pub(crate) struct OpenShift {
    pub effect: usize,
    /// Standard deviation of the shifts of traces in one setup.
    pub scatter_mm: f64,
    /// Standard uncertainty of the setups' shift.
    pub std_mm: f64,
    /// Standard uncertainty of the mean shift of each setup over which results are averaged, in mm; 0 where they are not.
    pub setups_mm: [f64; 2],
    /// Variance of the setups' shift beyond that and beyond what the effects' covariance holds, in mm².
    pub extra: f64,
}

/// Displacements of the setups in mm, with their shares, by which a mean over normally distributed ones is taken
/// (Gauss-Hermite with three places; the result is a sum over the setups, so that they are displaced one at a time).
pub(crate) fn displacements(setups_mm: [f64; 2]) -> Vec<(f64, [f64; 2])> {
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

/// Where traces of a setup are shifted against each other, the means of the setups are shifted as much by chance; what
/// shows only in a confounded set or not at all stays open. Shifts are taken for normally distributed with the scatter
/// that was found, and Student's variance counts for how few they are.
pub(crate) fn open_shift(data: &Data, fit: &TracesFit) -> Option<OpenShift> {
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
