//! `channel-delay`: shifts one channel of a recording by whole samples, to see what a late channel does.

use std::collections::VecDeque;

use runout_core::{
    Error, Result,
    fault::Fault,
    measurement::{Block, Capture, SampleStream},
    pipeline::{Context, StageConfig},
    stage::{Conditioner, Preprocessor},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `plugin = "channel-delay"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelDelayConfig {
    /// The sensor whose readings come late.
    pub sensor: String,
    /// By how many samples.
    pub samples: usize,
}

/// More than a turn of most recordings.
const MOST_SAMPLES: usize = 100_000;

impl StageConfig for ChannelDelayConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "channel-delay";
    const ABOUT: &'static str = "makes one channel late by whole samples";

    fn check(self, _context: &Context) -> std::result::Result<Preprocessor, Fault> {
        if self.samples > MOST_SAMPLES {
            return Err(Fault::at(
                "samples",
                format!("expected at most {MOST_SAMPLES} samples, found {}", self.samples),
            ));
        }
        Ok(Preprocessor::Conditioner(Box::new(ChannelDelay(self))))
    }
}

struct ChannelDelay(ChannelDelayConfig);

impl Conditioner for ChannelDelay {
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>> {
        let Capture { object, sensor_ids, .. } = input.capture();
        let Some(channel) = sensor_ids.iter().position(|id| *id == self.0.sensor) else {
            return Err(Error::new("delay", object, format!("it has no sensor `{}`", self.0.sensor))
                .help(format!("its sensors: {}", sensor_ids.join(", "))));
        };
        Ok(Box::new(Delayed { input, channel, samples: self.0.samples, waiting: VecDeque::new() }))
    }
}

/// The first reading stands for those before it.
struct Delayed<'a> {
    input: Box<dyn SampleStream + 'a>,
    channel: usize,
    samples: usize,
    waiting: VecDeque<f64>,
}

impl SampleStream for Delayed<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        let channels = self.capture().channels();
        for reading in block.samples.iter_mut().skip(self.channel).step_by(channels) {
            self.waiting.push_back(*reading);
            let late = if self.waiting.len() > self.samples {
                self.waiting.pop_front()
            } else {
                self.waiting.front().copied()
            };
            *reading = late.unwrap_or(*reading);
        }
        for defect in block.defects.iter_mut().filter(|defect| defect.channel == self.channel) {
            let late = self.samples as u64;
            defect.samples = defect.samples.start + late..defect.samples.end + late;
        }
        Ok(more)
    }
}
