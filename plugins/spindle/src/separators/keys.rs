//! Keys that separators share.

use runout_core::fault::Fault;

/// What a switch is without its key.
pub(super) fn yes() -> bool {
    true
}

/// A limit of noise gain, as a file gives it.
///
/// # Errors
/// When it is no positive number.
pub(super) fn checked_gain(gain: Option<f64>) -> Result<Option<f64>, Fault> {
    match gain {
        Some(gain) if gain <= 0.0 || gain.is_nan() => {
            Err(Fault::at("max_noise_gain", format!("expected a factor above 0, found {gain}")))
        }
        gain => Ok(gain),
    }
}
