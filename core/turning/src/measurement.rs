//! Recorded turns: what a loader offers, read in blocks so that a station may be larger than memory.

use std::{
    f64::consts::{FRAC_PI_2, SQRT_2},
    num::NonZeroUsize,
    ops::Range,
    path::PathBuf,
};

use crate::{checksum::Checksum, input_file::InputFile};
use runout_error::Result;
use runout_numerics::statistics::upper_median;

/// A recording of all stations in all setups.
pub trait Recording: Send + Sync {
    /// The axial stations, in the order in which they are to be worked on.
    fn stations(&self) -> &[StationKey];

    /// Opens the samples of one station in one setup (an index into the rig's setups).
    ///
    /// # Errors
    /// When the capture is missing or cannot be read.
    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>>;

    /// Opens the samples of one station in one setup, where so many threads may work on it.
    ///
    /// # Errors
    /// When the capture is missing or cannot be read.
    fn open_with(&self, _threads: NonZeroUsize, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        self.open(station, setup)
    }

    /// The files behind it, for their checksums.
    fn inputs(&self) -> Vec<PathBuf>;

    /// The files behind it as they were when they were first opened; as they are now where a recording does not remember them.
    ///
    /// # Errors
    /// When one cannot be read.
    fn opened(&self) -> Result<Vec<InputFile>> {
        self.inputs().iter().map(|path| InputFile::new(path)).collect()
    }

    /// Where its checksum can be taken from what is read anyway, that checksum: complete when everything was read since it was
    /// [begun](Checksum::begin).
    fn checksum(&self) -> Option<&Checksum> {
        None
    }

    /// What the recording itself says is true, at one station: only simulations and certified artefacts carry it.
    ///
    /// # Errors
    /// When there is a truth and it cannot be read.
    fn truth(&self, _station: usize) -> Result<Option<StationTruth>> {
        Ok(None)
    }

    /// What a reader should know about the recording as a whole: extra channels, setups that the rig does not name.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// An axial station: the carriage stands still while every setup is recorded there.
#[derive(Debug, Clone, PartialEq)]
pub struct StationKey {
    /// Its name in the recording.
    pub name: String,
    /// Carriage position that is added to each sensor's z, in mm.
    pub z_mm: f64,
}

/// What is known of one capture (one station in one setup) before its samples are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// Where it stands, for messages: `shaft.h5:/initial/s01`.
    pub object: String,
    /// Index into the rig's setups.
    pub setup: usize,
    /// Name of the station.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Speed as the recording states it.
    pub stated_speed_rpm: Option<f64>,
    /// Sampling rate, where known.
    pub sample_rate_hz: Option<f64>,
    /// Number of samples per channel.
    pub samples: u64,
    /// The rig's sensor behind each channel.
    pub sensors: Vec<usize>,
    /// Id of the sensor behind each channel, for messages.
    pub sensor_ids: Vec<String>,
    /// Lowest and highest reading that the converter can give, in µm per channel, where the samples are integers.
    pub converter_limits_um: Option<Vec<[f64; 2]>>,
    /// Sample positions (fractional, ascending) at which a turn begins: the once-per-turn mark, or the encoder's zero.
    pub marks: Vec<f64>,
    /// Half of the interval in which each of them lies, in samples: 0.5 where only the samples before and behind it are known, 0
    /// where it is timed.
    pub marks_within_samples: f64,
    /// Whether each block brings the encoder's angle of each sample.
    pub encoder: bool,
    /// Turns that a preprocessor has set aside at the ends, with its reason.
    pub trimmed: Vec<Trim>,
    /// What was done to the signal by harmonic filters: effective amplitude response.
    pub responses: Vec<Response>,
}

impl Capture {
    /// Number of channels.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.sensors.len()
    }

    /// Median length of a turn in samples; `None` with fewer than two marks.
    #[must_use]
    pub fn median_turn_samples(&self) -> Option<f64> {
        let mut lengths: Vec<f64> = self.marks.windows(2).map(|pair| pair[1] - pair[0]).collect();
        upper_median(&mut lengths)
    }

    /// Number of the turn that begins at the first mark still there, counted from 0 before anything was trimmed.
    #[must_use]
    pub fn first_turn(&self) -> usize {
        let mut leading: Vec<&Trim> = self.trimmed.iter().collect();
        leading.sort_by_key(|trim| trim.first_turn);
        leading.iter().fold(0, |next, trim| if trim.first_turn == next { next + trim.turns } else { next })
    }
}

/// Turns set aside at one end of a capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Trim {
    /// Number of the first of them, counted from 0 at the capture's first mark.
    pub first_turn: usize,
    /// Number of whole turns.
    pub turns: usize,
    /// "start-up", "run-down" or what the user asked for.
    pub reason: String,
}

/// A filter that was applied, and what it does to each frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// For the summary: "low-pass, zero-phase Butterworth, order 4 twice, −3 dB at 451 Hz".
    pub description: String,
    /// Effective −3 dB frequency, in Hz.
    pub half_power_hz: f64,
    /// Order of the Butterworth low-pass that is applied twice, or that has about the same effect.
    pub order: usize,
    /// Sampling rate of the filter, in Hz; infinite where it has none.
    pub sample_rate_hz: f64,
}

impl Response {
    /// Share of the amplitude that passes: 1/(1 + (√2 − 1) r²ᴺ), where r is the frequency over that of −3 dB, both as the bilinear transform
    /// warps them.
    #[must_use]
    pub fn amplitude(&self, frequency_hz: f64) -> f64 {
        let nyquist_hz = 0.5 * self.sample_rate_hz;
        if frequency_hz >= nyquist_hz {
            return 0.0;
        }
        let warped = |hz: f64| if nyquist_hz.is_finite() { (FRAC_PI_2 * hz / nyquist_hz).tan() } else { hz };
        let ratio = warped(frequency_hz) / warped(self.half_power_hz);
        (1.0 + (SQRT_2 - 1.0) * ratio.powf(2.0 * self.order as f64)).recip()
    }
}

/// Samples of one capture, block after block.
pub trait SampleStream: Send {
    /// What is known before reading.
    fn capture(&self) -> &Capture;

    /// Fills `block` with the next samples in place of what it holds; false at the end, when `block` is left empty.
    ///
    /// # Errors
    /// When the source fails.
    fn next_block(&mut self, block: &mut Block) -> Result<bool>;
}

/// A run of consecutive samples, all channels of one instant side by side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Block {
    /// Index of its first sample in the capture.
    pub start: u64,
    /// Readings in µm, `[sample][channel]`.
    pub samples: Vec<f64>,
    /// Encoder angle of each sample in turns, unwrapped; empty without an encoder.
    pub angle_rev: Vec<f64>,
    /// Places that became known to be unusable: none may lie before samples that were already handed on.
    pub defects: Vec<Defect>,
}

impl Block {
    /// Empties it, keeping its memory.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.angle_rev.clear();
        self.defects.clear();
    }
}

/// A capture that is in memory as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryStream {
    /// What is known of it.
    pub capture: Capture,
    /// Readings in µm, `[sample][channel]`.
    pub samples: Vec<f64>,
    /// Encoder angle of each sample in turns; empty without an encoder.
    pub angle_rev: Vec<f64>,
    /// Samples of each channel in a block, at least 1.
    pub block_samples: usize,
    /// The next sample to be handed on.
    pub next: usize,
}

impl SampleStream for MemoryStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        let channels = self.capture.channels().max(1);
        let end = self.next.saturating_add(self.block_samples.max(1)).min(self.samples.len() / channels);
        let range = self.next.min(end)..end;
        block.start = range.start as u64;
        block.samples.extend_from_slice(&self.samples[range.start * channels..range.end * channels]);
        block.angle_rev.extend_from_slice(self.angle_rev.get(range.clone()).unwrap_or_default());
        self.next = end;
        Ok(!range.is_empty())
    }
}

/// A run of samples of one channel that cannot be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect {
    /// Sample indices in the capture.
    pub samples: Range<u64>,
    /// Index of the channel in the capture.
    pub channel: usize,
    /// What is wrong with it.
    pub kind: DefectKind,
}

/// What can be wrong with a run of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DefectKind {
    /// Not a number, or infinite.
    NotFinite,
    /// Farther than [`FARTHEST_UM`](crate::inspection::FARTHEST_UM).
    OutOfReach,
    /// At the converter's limit, or flat at the channel's extreme.
    Clipped,
    /// Behind a step of nearly the converter's range: the reading has passed one limit and goes on from the other.
    WrappedRound,
    /// Exactly equal for a good part of a turn, anywhere.
    Stuck,
    /// Among samples where some were lost.
    Lost,
}

impl std::fmt::Display for DefectKind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::NotFinite => "not a number",
            Self::OutOfReach => "farther than 1 m",
            Self::Clipped => "clipped",
            Self::WrappedRound => "wrapped round (a step of nearly the converter's range)",
            Self::Stuck => "stuck at one value",
            Self::Lost => "where samples were lost",
        })
    }
}

/// The true form and motion at one station, on equally spaced angles from 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StationTruth {
    /// Form of each of the rig's sections over the part's angle, in µm; of a face at the radius of its sensors, towards +z.
    pub form_um: Vec<Vec<f64>>,
    /// Error motion over the spindle's angle: x and y in µm, tilt about x and y in µrad.
    pub motion: Option<[Vec<f64>; 4]>,
    /// Error motion along the axis over the spindle's angle, without its mean, in µm.
    pub z_um: Option<Vec<f64>>,
}
