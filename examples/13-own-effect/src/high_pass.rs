//! `high-pass-channel`: takes the slow part out of one channel of a recording, to see what an AC-coupled input does.

use runout_core::{
    Error, Result,
    fault::Fault,
    measurement::{Block, Capture, SampleStream},
    pipeline::{Context, StageConfig},
    stage::{Conditioner, Preprocessor},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `plugin = "high-pass-channel"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HighPassChannelConfig {
    /// The sensor whose input is AC-coupled.
    pub sensor: String,
    /// −3 dB, in Hz.
    pub cutoff_hz: f64,
}

impl StageConfig for HighPassChannelConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "high-pass-channel";
    const ABOUT: &'static str = "takes the slow part out of one channel";

    fn check(self, _context: &Context) -> std::result::Result<Preprocessor, Fault> {
        if !(self.cutoff_hz.is_finite() && self.cutoff_hz >= 0.0) {
            return Err(Fault::at("cutoff_hz", format!("expected 0 or more, found {}", self.cutoff_hz)));
        }
        Ok(Preprocessor::Conditioner(Box::new(HighPassChannel(self))))
    }
}

struct HighPassChannel(HighPassChannelConfig);

impl Conditioner for HighPassChannel {
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>> {
        let Capture { object, sensor_ids, sample_rate_hz, .. } = input.capture();
        let Some(channel) = sensor_ids.iter().position(|id| *id == self.0.sensor) else {
            return Err(Error::new("filter", object, format!("it has no sensor `{}`", self.0.sensor))
                .help(format!("its sensors: {}", sensor_ids.join(", "))));
        };
        let Some(rate_hz) = *sample_rate_hz else {
            return Err(
                Error::new("filter", object, "it states no sampling rate").help("add `sample_rate_hz` to the file")
            );
        };
        // The bilinear transform of s/(s + ω), with its cut-off kept.
        let k = (std::f64::consts::PI * self.0.cutoff_hz / rate_hz).tan();
        Ok(Box::new(HighPass { input, channel, pole: (1.0 - k) / (1.0 + k), gain: 1.0 / (1.0 + k), last: None }))
    }
}

/// y ← pole·y + gain·(x − x before): as if the first reading had been there for ever.
struct HighPass<'a> {
    input: Box<dyn SampleStream + 'a>,
    channel: usize,
    pole: f64,
    gain: f64,
    /// The reading before, and what was made of it.
    last: Option<[f64; 2]>,
}

impl SampleStream for HighPass<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        let channels = self.capture().channels();
        for reading in block.samples.iter_mut().skip(self.channel).step_by(channels) {
            let [before, made] = self.last.unwrap_or([*reading, 0.0]);
            let made = self.pole * made + self.gain * (*reading - before);
            self.last = Some([*reading, made]);
            *reading = made;
        }
        Ok(more)
    }
}
