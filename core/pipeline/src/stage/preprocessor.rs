//! Preprocessing: from raw samples to one profile a capture.

use runout_error::Result;
use runout_turning::{
    measurement::{Capture, SampleStream},
    profile::Profile,
    profile_change::ProfileChange,
    spread::Projection,
};

/// A preprocessor, by what it gives. A pipeline has any number of conditioners, then one averager, then any number of correctors.
pub enum Preprocessor {
    /// Samples in, samples out.
    Conditioner(Box<dyn Conditioner>),
    /// Samples in, a profile out.
    Averager(Box<dyn Averager>),
    /// A profile in, a profile out.
    Corrector(Box<dyn Corrector>),
}

/// Changes samples, or what is known of them, block by block.
pub trait Conditioner: Send + Sync {
    /// Wraps a stream.
    ///
    /// # Errors
    /// When the capture does not have what it needs (a sampling rate, marks).
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>>;
}

/// What an averager is to give besides the average.
#[derive(Debug, Clone, Copy, Default)]
pub struct AverageRequest<'a> {
    /// The last turns of this share (0 to 1) are averaged by themselves: [`Profile::split`].
    pub hold_out: Option<f64>,
    /// The spread of this motion over the turns is kept: [`Profile::spread`].
    pub projection: Option<&'a Projection>,
}

/// Averages turns.
pub trait Averager: Send + Sync {
    /// Highest order that its profiles hold.
    fn max_order(&self) -> usize;

    /// Reads a stream to its end, for the average and what is wanted besides.
    ///
    /// # Errors
    /// When the source fails or too little of it can be used.
    fn average_requested(&self, input: Box<dyn SampleStream + '_>, wanted: AverageRequest) -> Result<Profile>;

    /// Reads a stream to its end.
    ///
    /// # Errors
    /// When the source fails or too little of it can be used.
    fn average(&self, input: Box<dyn SampleStream + '_>) -> Result<Profile> {
        self.average_requested(input, AverageRequest::default())
    }
}

/// Changes the average of a capture, harmonic by harmonic.
pub trait Corrector: Send + Sync {
    /// What becomes of a profile.
    ///
    /// # Errors
    /// When it cannot say.
    fn change(&self, profile: &Profile) -> Result<ProfileChange>;
}

/// An averager whose profiles a corrector changes.
pub(crate) struct Corrected {
    pub averager: Box<dyn Averager>,
    pub corrector: Box<dyn Corrector>,
}

impl Averager for Corrected {
    fn max_order(&self) -> usize {
        self.averager.max_order()
    }

    fn average_requested(&self, input: Box<dyn SampleStream + '_>, wanted: AverageRequest) -> Result<Profile> {
        let profile = self.averager.average_requested(input, wanted)?;
        let change = self.corrector.change(&profile)?;
        Ok(profile.changed(&change))
    }
}

/// The sampling rate of a capture, or a clear answer.
///
/// # Errors
/// When the recording does not state one.
pub fn sample_rate_hz(capture: &Capture, operation: &str) -> Result<f64> {
    capture.sample_rate_hz.ok_or_else(|| {
        runout_error::Error::new(operation, &capture.object, "the recording states no sampling rate")
            .help("give `sample_rate_hz` in the recording or in [load]")
    })
}
