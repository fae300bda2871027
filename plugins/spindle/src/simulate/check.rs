//! Checks that many keys share.

use runout_core::fault::Fault;

pub(super) fn finite(key: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() { Ok(()) } else { Err(Fault::at(key, format!("expected a finite number, found {value}"))) }
}

pub(super) fn not_negative(key: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(Fault::at(key, format!("expected 0 or more, found {value}")))
    }
}

pub(super) fn positive(key: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(Fault::at(key, format!("expected a number above 0, found {value}")))
    }
}

/// `first` is the lowest order allowed, `end` the first that the sampling cannot carry.
pub(super) fn order(key: &str, order: usize, first: usize, end: usize) -> Result<(), Fault> {
    if (first..end).contains(&order) {
        return Ok(());
    }
    let fault = Fault::at(key, format!("expected an order from {first} to {}, found {order}", end.saturating_sub(1)));
    Err(if order >= end { fault.help("raise `samples_per_rev`: an order needs more than two samples") } else { fault })
}
