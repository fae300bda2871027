//! A loader whose recording stops to give samples when the work is to stop.

use std::{num::NonZeroUsize, path::PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    checksum::Checksum,
    measurement::{Block, Capture, Recording, SampleStream, StationKey, StationTruth},
    stage::{Loader, Request, Source, SourceKind},
};

use crate::work::Stop;

/// The error of work that stops.
pub(crate) fn interrupted(object: &str) -> Error {
    Error::new("read", object, "the work was interrupted").of(ErrorKind::Interrupted)
}

/// A loader, and whether to stop.
pub(crate) struct Interruptible {
    /// What loads.
    pub loader: Box<dyn Loader>,
    /// Whether to stop.
    pub stop: Stop,
}

impl Loader for Interruptible {
    fn kind(&self) -> SourceKind {
        self.loader.kind()
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        Ok(match self.loader.open(wanted)? {
            Source::Turns(recording) => Source::Turns(Box::new(Watched { recording, stop: self.stop.clone() })),
            points @ Source::Points(_) => points,
        })
    }
}

struct Watched {
    recording: Box<dyn Recording>,
    stop: Stop,
}

impl Watched {
    fn stream<'a>(&self, stream: Box<dyn SampleStream + 'a>) -> Box<dyn SampleStream + 'a> {
        Box::new(WatchedStream { stream, stop: self.stop.clone() })
    }
}

impl Recording for Watched {
    fn stations(&self) -> &[StationKey] {
        self.recording.stations()
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        Ok(self.stream(self.recording.open(station, setup)?))
    }

    fn open_with(&self, threads: NonZeroUsize, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        Ok(self.stream(self.recording.open_with(threads, station, setup)?))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.recording.inputs()
    }

    fn checksum(&self) -> Option<&Checksum> {
        self.recording.checksum()
    }

    fn truth(&self, station: usize) -> Result<Option<StationTruth>> {
        self.recording.truth(station)
    }

    fn remarks(&self) -> Vec<String> {
        self.recording.remarks()
    }
}

struct WatchedStream<'a> {
    stream: Box<dyn SampleStream + 'a>,
    stop: Stop,
}

impl SampleStream for WatchedStream<'_> {
    fn capture(&self) -> &Capture {
        self.stream.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        if self.stop.is_set() {
            return Err(interrupted(&self.stream.capture().object));
        }
        self.stream.next_block(block)
    }
}
