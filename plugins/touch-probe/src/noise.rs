//! Noise of a touch: stated, or the scatter of repeats after a common smooth drift.

use runout_core::numerics::least_squares::{SINGULAR, least_norm};

use crate::{
    design::{Noise, Weights},
    touches::Touches,
};

/// Polynomials of time, up to this degree, that the drift of radius and centre consists of.
const DRIFT_DEGREE: i32 = 3;
/// Degrees of freedom from which on repeats determine the noise.
const FEWEST: usize = 8;

/// The standard deviation of each touch; touches that are not like the others are left out of it.
pub(crate) fn weights(touches: &mut Touches, unlike: &[usize]) -> Weights {
    let stated: Option<Vec<f64>> = touches.all.iter().map(|touch| touch.std_um).collect();
    let repeated = repeatability(touches, unlike);
    if let Some(std_um) = stated {
        let weights = Weights { std_um, noise: Noise::Stated };
        if let Some((found, dof)) = repeated {
            let ratio = found / weights.rms_um();
            // Five standard deviations of a ratio with so many degrees of freedom.
            let chance = 5.0 / (2.0 * dof as f64).sqrt();
            if ratio > 1.2 + chance || ratio < 0.8 - chance {
                touches.remarks.push(format!(
                    "repeats scatter by {found:.2} µm after a common drift, and {:.2} µm is stated as standard uncertainty",
                    weights.rms_um()
                ));
            }
        }
        return weights;
    }
    let count = touches.all.len();
    if let Some((std, dof)) = repeated {
        Weights { std_um: vec![std; count], noise: Noise::Repeats(dof) }
    } else {
        let problem = "no direction was touched twice in a setup, and no `std_um` is stated";
        touches.remarks.push(format!(
            "{problem}: the noise is taken from what the fit leaves, so that nothing says whether noise only is left"
        ));
        Weights { std_um: vec![1.0; count], noise: Noise::Residual }
    }
}

/// Scatter of touches of one direction in one setup, after a drift of radius and centre that is common to all; with its degrees
/// of freedom.
fn repeatability(touches: &Touches, unlike: &[usize]) -> Option<(f64, usize)> {
    let all = &touches.all;
    let groups = 1 + all.iter().map(|touch| touch.direction).max()?;
    let mut members = vec![Vec::new(); groups];
    for (row, touch) in all.iter().enumerate().filter(|(row, _)| !unlike.contains(row)) {
        members[touch.direction].push(row);
    }
    members.retain(|rows| rows.len() > 1);
    let repeated: usize = members.iter().map(Vec::len).sum();
    let within = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let group = |rows: &Vec<usize>| {
            let values: Vec<f64> = rows.iter().map(|row| of(*row)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.into_iter().map(|value| value - mean).collect::<Vec<f64>>()
        };
        members.iter().flat_map(group).collect()
    };
    let mut columns = Vec::new();
    for degree in 1..=DRIFT_DEGREE {
        let waves: [fn(f64) -> f64; 3] = [|_| 1.0, f64::cos, f64::sin];
        for wave in waves {
            columns.push(within(&|row| all[row].time.powi(degree) * wave(all[row].angle)));
        }
    }
    let free = (repeated - members.len()).checked_sub(columns.len()).filter(|free| *free >= FEWEST);
    let solved = least_norm(&columns, &within(&|row| all[row].reading_um), SINGULAR);
    let dof = free.map(|_| repeated - members.len() - (repeated - solved.dof))?;
    let squares: f64 = solved.residual.iter().map(|value| value * value).sum();
    (squares > 0.0).then(|| ((squares / dof as f64).sqrt(), dof))
}
