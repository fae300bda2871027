//! A channel of a file, and what its numbers are.

use std::sync::Arc;

use runout_core::{Error, Result};

use crate::channel::{Channel, ChannelFile};

/// Samples that are read at a time.
pub(crate) const BLOCK: usize = 1 << 13;

/// A file and one of its channels.
#[derive(Clone)]
pub(crate) struct Signal {
    pub(crate) file: Arc<dyn ChannelFile>,
    pub(crate) index: usize,
    /// For messages: `run.tdms:Run 0/X1`.
    pub(crate) shown: String,
}

impl Signal {
    pub(crate) fn channel(&self) -> &Channel {
        &self.file.channels()[self.index]
    }

    pub(crate) fn error(&self, problem: impl std::fmt::Display) -> Error {
        Error::new("read", &self.shown, problem)
    }

    /// Passes all samples through once.
    pub(crate) fn each(&self, mut take: impl FnMut(f64) -> Result<()>) -> Result<()> {
        let mut samples = self.file.read(&[self.index])?;
        let mut column = [Vec::new()];
        while samples.next(BLOCK, &mut column)? > 0 {
            column[0].drain(..).try_for_each(&mut take)?;
        }
        Ok(())
    }

    /// Lowest and highest of all samples.
    pub(crate) fn range(&self) -> Result<(f64, f64)> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        self.each(|value| {
            (low, high) = (low.min(value), high.max(value));
            Ok(())
        })?;
        Ok((low, high))
    }

    /// Whether it falls back by more than half of its range, each time against the way that it goes otherwise.
    pub(crate) fn begins_anew(&self, range: f64) -> Result<bool> {
        let (mut last, mut way, mut back) = (f64::NAN, 0.0, Vec::new());
        self.each(|value| {
            let step = value - last;
            if step.abs() > 0.5 * range {
                back.push(step.signum());
            } else if step.is_finite() {
                way += step;
            }
            last = value;
            Ok(())
        })?;
        Ok(!back.is_empty() && back.iter().all(|sign| sign * way < 0.0))
    }
}

/// How the numbers of a channel become those of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conversion {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
}
