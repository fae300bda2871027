//! Preprocessing: from raw samples to one profile a capture.

use crate::{
    Result,
    measurement::{Capture, SampleStream},
    profile::Profile,
};

/// A preprocessor, by what it gives. A pipeline has any number of conditioners and then one averager.
pub enum Preprocessor {
    /// Samples in, samples out.
    Conditioner(Box<dyn Conditioner>),
    /// Samples in, a profile out.
    Averager(Box<dyn Averager>),
}

/// Changes samples, or what is known of them, block by block.
pub trait Conditioner: Send + Sync {
    /// Wraps a stream.
    ///
    /// # Errors
    /// When the capture does not have what it needs (a sampling rate, marks).
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>>;
}

/// Averages turns.
pub trait Averager: Send + Sync {
    /// Highest order that its profiles hold.
    fn max_order(&self) -> usize;

    /// Reads a stream to its end. With a share to hold out, the last turns of that share (0 to 1) are averaged by themselves
    /// besides: [`Profile::split`].
    ///
    /// # Errors
    /// When the source fails or too little of it can be used.
    fn average_holding_out(&self, input: Box<dyn SampleStream + '_>, share: Option<f64>) -> Result<Profile>;

    /// Reads a stream to its end.
    ///
    /// # Errors
    /// When the source fails or too little of it can be used.
    fn average(&self, input: Box<dyn SampleStream + '_>) -> Result<Profile> {
        self.average_holding_out(input, None)
    }
}

/// The sampling rate of a capture, or a clear answer.
///
/// # Errors
/// When the recording does not state one.
pub fn sample_rate_hz(capture: &Capture, operation: &str) -> Result<f64> {
    capture.sample_rate_hz.ok_or_else(|| {
        crate::Error::new(operation, &capture.object, "the recording states no sampling rate")
            .help("give `sample_rate_hz` in the recording or in [load]")
    })
}
