//! What is declared of touches, so that they are tested on themselves, and what the tests make of a fit.

use std::f64::consts::TAU;

use runout_core::{
    consistency::{
        Check, Judgement, Kind, LinearFit, Structure, judge, linear,
        repeats::repeats,
        rows::{self, Rows},
    },
    numerics::least_squares::{Basis, dot},
};

use crate::{
    config::TouchProbeConfig,
    design::{Fitted, Noise, Weights, name},
    touches::Touches,
    waves::angles,
};

/// Sectors of the ring, and of the directions in the machine, whose noise is the same.
const SECTORS: [usize; 2] = [36, 12];

/// Errors depend on each other in time within a setup; setups are independent and may be offset, as may repeats; sectors have the same
/// noise.
pub(crate) fn structure(config: &TouchProbeConfig, touches: &Touches) -> Structure {
    let all = &touches.all;
    let setup: Vec<usize> = all.iter().map(|touch| touch.setup).collect();
    let names: Vec<String> = config.setups.iter().map(|setup| format!("setup {}", setup.id)).collect();
    let sector = |angle: f64, count: usize| ((angle.rem_euclid(TAU) / TAU * count as f64) as usize).min(count - 1);
    let [of_ring, of_machine] = SECTORS;
    let range = |what: &str, count: usize| -> Vec<String> {
        let width = 360 / count;
        (0..count).map(|sector| format!("{what} {}° to {}°", width * sector, width * (sector + 1))).collect()
    };
    let ring = all.iter().map(|touch| sector(angles(config, touch)[1], of_ring)).collect();
    let machine = all.iter().map(|touch| sector(touch.angle, of_machine)).collect();
    let row = |(row, touch): (usize, &crate::touches::Touch)| {
        let direction = touch.place_mm[1].atan2(touch.place_mm[0]).to_degrees().rem_euclid(360.0);
        format!("row {} (setup {}, {direction:.0}°)", row + 1, config.setups[touch.setup].id)
    };
    let mut structure = Structure::default()
        .along("time", setup.clone(), all.iter().map(|touch| touch.time).collect())
        .divided("setups", Kind::Blocks, setup.clone(), names.clone())
        .divided("sectors of the ring", Kind::Alike, ring, range("the ring at", of_ring))
        .divided("directions", Kind::Alike, machine, range("directions from", of_machine))
        .shifting("setups", &setup, &names)
        .naming(all.iter().enumerate().map(row).collect());
    if touches.repeats.len() > 1 {
        let place = |repeat: usize| touches.repeats.iter().position(|known| *known == repeat).unwrap_or(usize::MAX);
        let level: Vec<usize> = all.iter().map(|touch| place(touch.repeat)).collect();
        let names: Vec<String> = touches.repeats.iter().map(|repeat| format!("repeat {repeat}")).collect();
        structure = structure.shifting("repeats", &level, &names);
    }
    structure
}

impl Fitted {
    /// Looks for touches that are not like the others. They stay in the fit; the noise that is left counts without them, and what they
    /// move the parameters by is added to the uncertainty.
    pub(crate) fn set_apart(&mut self, weights: &Weights, used: &[usize]) {
        let columns = self.weighted(weights, used);
        let Some(found) = rows::unlike(&self.solved.residual, Basis::of(columns.clone()).columns()) else { return };
        if !found.rows.is_empty() {
            self.level(weights, found.std[1] * found.std[1]);
            let sums: Vec<f64> = columns
                .iter()
                .map(|column| found.rows.iter().zip(&found.off_by).map(|(row, off)| column[*row] * off).sum())
                .collect();
            let moved = &self.solved.covariance * nalgebra::DVector::from_vec(sums);
            self.solved.covariance += &moved * moved.transpose() / self.variance;
        }
        self.unlike = Some(found);
    }

    /// The tests of the fit on its own touches; its covariance is widened by what they find.
    pub(crate) fn judge(&mut self, config: &TouchProbeConfig, touches: &Touches, weights: &Weights) -> Vec<Check> {
        let named = self.unlike.as_ref().map_or(&[][..], |unlike| &unlike.rows);
        let used: Vec<usize> = (0..self.residual_um.len()).filter(|row| !named.contains(row)).collect();
        let columns = self.weighted(weights, &used);
        let basis = Basis::of(columns);
        let all = basis.weights();
        // A parameter that depends on those before it has no weights of its own.
        let own: Vec<usize> = (0..all.len()).filter(|place| all[*place].iter().any(|weight| *weight != 0.0)).collect();
        let names: Vec<String> = own.iter().map(|place| name(config, &self.design.parameters[*place])).collect();
        let of_values: Vec<Vec<f64>> = own.iter().map(|place| all[*place].clone()).collect();
        let scale = if weights.noise == Noise::Residual { 1.0 } else { weights.rms_um() };
        let known = match weights.noise {
            Noise::Stated => f64::INFINITY,
            Noise::Repeats(dof) => dof as f64,
            Noise::Residual => f64::NAN,
        };
        let mut residual: Vec<f64> =
            used.iter().map(|row| self.residual_um[*row] / weights.std_um[*row] * scale).collect();
        basis.remove_from(&mut residual);
        let fit = LinearFit {
            residual: &residual,
            basis: basis.columns(),
            names: &names,
            weights: &of_values,
            noise: (!known.is_nan()).then_some((scale, known)),
            unit: "µm",
        };
        let declared = structure(config, touches);
        let Judgement { mut checks, factors } = judge(fit, &declared.sorted(&used));
        let dof = used.len().saturating_sub(basis.rank());
        let left = dot(&residual, &residual) / dof.max(1) as f64 / (scale * scale);
        if let Some(unlike) = self.unlike.as_ref().filter(|unlike| !unlike.rows.is_empty()) {
            let off_by = unlike.off_by.iter().map(|off| off * scale).collect();
            let unlike = Rows { off_by, std: unlike.std.map(|std| std * scale), ..unlike.clone() };
            checks.insert(0, unlike.check(&declared, "µm"));
        }
        match weights.noise {
            _ if dof == 0 => {}
            Noise::Repeats(of_repeats) => checks.insert(0, repeats([1.0, of_repeats as f64], [left, dof as f64])),
            Noise::Stated => checks.insert(0, linear::residual(left, dof as f64, f64::INFINITY)),
            Noise::Residual => {}
        }
        for (place, factor) in own.iter().zip(factors) {
            let wider = (factor * (left / self.variance).sqrt()).max(1.0);
            self.solved.covariance.row_mut(*place).scale_mut(wider);
            self.solved.covariance.column_mut(*place).scale_mut(wider);
        }
        checks
    }
}
