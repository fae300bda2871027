//! By how much standard uncertainties are larger than the noise makes them.

use crate::{noise::Noise, solve::Fit};

/// Few degrees of freedom of the noise.
const FEW_DEGREES: usize = 30;

/// By how much standard uncertainties are larger than the noise makes them.
pub(crate) struct Scale {
    pub factor: f64,
    pub remark: Option<String>,
    /// Whether more is left than the known noise.
    pub is_more: bool,
}

/// Where the noise is not known, the residual gives it; where more is left than the noise explains, uncertainties grow with it.
pub(crate) fn scale(found: &Fit, noise: Noise) -> Scale {
    let left = found.chi2_per_dof();
    if noise == Noise::Unknown {
        let remark = if found.dof == 0 {
            "neither `std_um` nor repeats give the noise, and no degrees of freedom are left: there are no standard \
             uncertainties"
                .to_owned()
        } else {
            format!(
                "neither `std_um` nor repeats give the noise: standard uncertainties are from what the fit leaves, {:.2} µm \
                 with {} degrees of freedom",
                left.sqrt(),
                found.dof
            )
        };
        return Scale { factor: left.sqrt(), remark: Some(remark), is_more: false };
    }
    let of_noise = if let Noise::Repeats { dof, .. } = noise { 2.0 / dof as f64 } else { 0.0 };
    let chance = 1.0 + 3.0 * (2.0 / found.dof.max(1) as f64 + of_noise).sqrt();
    if left > chance {
        let remark = format!(
            "the fit leaves more than the noise: χ² per degree of freedom is {left:.2}, where chance makes up to {chance:.2}. \
             The standard uncertainties are {:.2} times as large as the noise makes them; `diagnose` looks for the cause",
            left.sqrt()
        );
        return Scale { factor: left.sqrt(), remark: Some(remark), is_more: true };
    }
    Scale { factor: 1.0, remark: None, is_more: false }
}

pub(crate) fn noise_remark(noise: Noise) -> Option<String> {
    match noise {
        Noise::Repeats { std_um, dof } => {
            let few = if dof < FEW_DEGREES { ": few" } else { "" };
            Some(format!(
                "the standard uncertainty of one coordinate of a row is the scatter of repeats after a common smooth drift: \
                 {std_um:.2} µm with {dof} degrees of freedom{few}"
            ))
        }
        _ => None,
    }
}
