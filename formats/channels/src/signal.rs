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
}

/// How the numbers of a channel become those of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conversion {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
}
