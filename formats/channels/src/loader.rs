//! The loader: checked configuration, and the recording that it opens.

use std::path::PathBuf;

use runout_core::{
    Error, ErrorKind, Result,
    fault::Fault,
    measurement::StationKey,
    pipeline::{Context, StageConfig},
    stage::{Loader, Request, Source, SourceKind},
};

use crate::{config::ChannelsConfig, recording::ChannelRecording};

impl StageConfig for ChannelsConfig {
    type Stage = Box<dyn Loader>;
    const NAME: &'static str = "channels";
    const ABOUT: &'static str =
        "named channels of other programs: TDMS, MAT, HDF5, text, LVM, NumPy, Parquet, Arrow, UFF, WAV";

    fn check(mut self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let stations = self.checked(context.rig)?;
        if let Some(path) = &mut self.path {
            *path = context.path(path);
        }
        Ok(Box::new(ChannelLoader { config: self, folder: context.folder.to_owned(), stations }))
    }
}

struct ChannelLoader {
    config: ChannelsConfig,
    folder: PathBuf,
    stations: Vec<StationKey>,
}

impl Loader for ChannelLoader {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let rig = wanted.rig.ok_or_else(|| {
            Error::new("open", "the channels", "recorded turns need a [rig] that names the sensors")
                .of(ErrorKind::Configuration)
        })?;
        let recording = ChannelRecording::open(rig, self.config.clone(), &self.folder, self.stations.clone())?;
        Ok(Source::Turns(Box::new(recording)))
    }
}
