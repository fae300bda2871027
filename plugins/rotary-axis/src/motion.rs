//! Motion of the axis at the commands, from which the pipeline makes the values of ISO 230-7.
//!
//! x and y are those of the point of the axis at the mean height of the balls, where they are known best: EXC + h·EBC and EYC − h·EAC.

use runout_core::stage::{AxisMotion, MotionErrors};

use crate::{
    axis::Axis,
    campaign::Campaign,
    noise::Noise,
    scale::Scale,
    solve::{Combined, Fit},
};

/// µm in a mm, and µrad in a rad.
const MICRO: [f64; 2] = [1e3, 1e6];

/// The motion of a fit; `others` are fits with other effects, between which and this one the data do not decide.
pub(crate) fn axis_motion(axis: Axis, campaign: &Campaign, found: &Fit, others: &[Fit], scale: &Scale) -> AxisMotion {
    let heights = campaign.layout.balls.iter().map(|ball| ball.z);
    let z_mm = heights.sum::<f64>() / campaign.layout.balls.len() as f64;
    let at = |fit: &Fit| -> Vec<Combined> {
        let rows = rows(z_mm);
        (0..campaign.commands_deg.len()).map(|command| fit.combined(command, &rows)).collect()
    };
    let all = at(found);
    let motion: Vec<[f64; 5]> = all.iter().map(|one| five(|row| one.value[row])).collect();
    let differences = others.iter().map(|other| {
        let pairs = at(other).into_iter().zip(&motion);
        pairs.map(|(other, own)| five(|row| other.value[row] - own[row])).collect()
    });
    let changes = all.first().map_or(0, |one| one.common.ncols());
    let shared = (0..changes)
        .map(|change| all.iter().map(|one| five(|row| scale.factor * one.common[(row, change)])).collect::<Vec<_>>());
    let errors = MotionErrors {
        own: all.iter().map(|one| five(|row| five(|column| scale.factor.powi(2) * one.own[(row, column)]))).collect(),
        common: shared.chain(differences).collect(),
        freedom: freedom(campaign.noise, found.dof, scale.is_more),
    };
    AxisMotion {
        of: axis.letter().to_string(),
        letters: axis.order().map(|coordinate| ['x', 'y', 'z'][coordinate]),
        angle_deg: campaign.commands_deg.clone(),
        z_mm,
        motion,
        errors: if scale.factor.is_finite() { Ok(errors) } else { Err(UNKNOWN.into()) },
    }
}

const UNKNOWN: &str = "neither `std_um` nor repeats give the noise, and no degrees of freedom are left";

/// What each number of the motion takes of three shifts (mm) and three angles (rad), in µm and µrad.
fn rows(z_mm: f64) -> [[f64; 6]; 5] {
    let [um, urad] = MICRO;
    [
        [um, 0.0, 0.0, 0.0, um * z_mm, 0.0],
        [0.0, um, 0.0, -um * z_mm, 0.0, 0.0],
        [0.0, 0.0, um, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, urad, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, urad, 0.0],
    ]
}

fn five<T>(of: impl Fn(usize) -> T) -> [T; 5] {
    std::array::from_fn(of)
}

/// Degrees of freedom behind the noise of one reading; 0 where it is stated.
fn freedom(noise: Noise, left: usize, from_residual: bool) -> f64 {
    match noise {
        Noise::Repeats { dof, .. } if !from_residual => dof as f64,
        Noise::Column | Noise::Stated(_) if !from_residual => 0.0,
        _ => left as f64,
    }
}
