//! What a batch found, for people and programs.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    recording::Recording,
    speed::{AtSpeed, SpeedSeries},
    trend::Series,
};
use crate::{
    pipeline::config::Pipeline,
    summary::{Decision, Limit, Summary},
};
use runout_error::Error;

/// What a batch found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BatchReport {
    /// The pipeline's title.
    pub title: String,
    /// The folder of the data set.
    pub folder: PathBuf,
    /// Recordings of this call that were run.
    pub done: usize,
    /// Recordings of this call whose result was up to date.
    pub skipped: usize,
    /// Recordings of earlier calls with the same configuration; they count in the limits and in the trend.
    pub earlier: usize,
    /// Recordings that failed; nothing is kept of them.
    pub failed: Vec<Failed>,
    /// Recordings of the data set with warnings.
    pub warned: usize,
    /// Warnings of all of them together.
    pub warning_count: usize,
    /// What the first of them warn of, in the order of this call; those of earlier calls come last.
    pub warnings: Vec<Warned>,
    /// Recordings in the data set whose results are of another configuration or version: they are in no value and no trend. Given
    /// again they are brought up to date.
    pub other_configuration: Vec<String>,
    /// The limits of the pipeline, in their order.
    pub limits: Vec<LimitCount>,
    /// Control charts of all values.
    pub trend: Vec<Series>,
    /// Error motion and axis shift over the speeds of the recordings; absent where they have one speed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub against_speed: Vec<SpeedSeries>,
    /// Recordings whose speed is not known, beside others in `against_speed`: they state no sampling rate.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub without_speed: Vec<String>,
    /// Files of the whole batch.
    pub outputs: Vec<PathBuf>,
}

/// A recording that failed.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Failed {
    /// Its name.
    pub recording: String,
    /// Its path.
    pub path: PathBuf,
    /// The kind of the error: `missing-file`, `damaged-data`.
    pub kind: String,
    /// The error.
    pub message: String,
    /// What to do, where that is known.
    pub help: Option<String>,
}

/// A recording with warnings.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Warned {
    /// Its name.
    pub recording: String,
    /// How many warnings it has.
    pub count: usize,
    /// The first of them; its summary has all.
    pub first: Vec<String>,
}

/// Recordings whose warnings are in the report: memory does not grow with the others.
const MOST_WARNED: usize = 100;
/// Warnings of one of them.
const MOST_OF_ONE: usize = 3;

/// How many recordings keep a limit.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LimitCount {
    /// The limit.
    pub limit: Limit,
    /// Recordings that are proven to keep it.
    pub conforms: usize,
    /// Recordings that are proven not to keep it.
    pub does_not_conform: usize,
    /// Recordings of which neither is proven.
    pub undecided: usize,
}

/// What a batch keeps of the summary of one recording.
pub(super) struct RecordingSummary {
    decisions: Vec<Decision>,
    warnings: usize,
    first: Vec<String>,
    /// Its speed; nothing where that is not known.
    at_speed: Option<AtSpeed>,
}

impl RecordingSummary {
    /// Its speed, where that is known.
    pub(super) fn speed(&self) -> Option<AtSpeed> {
        self.at_speed.clone()
    }

    pub(super) fn of(recording: &str, summary: &Summary) -> Self {
        Self {
            at_speed: AtSpeed::of(recording, summary),
            decisions: summary.limits.iter().map(|limit| limit.decision).collect(),
            warnings: summary.findings().count(),
            first: summary.findings().take(MOST_OF_ONE).cloned().collect(),
        }
    }
}

impl Failed {
    pub(super) fn of(recording: &Recording, error: &Error) -> Self {
        Self {
            recording: recording.name.clone(),
            path: recording.path.clone(),
            kind: error.kind().name().to_owned(),
            message: error.to_string(),
            help: error.advice().map(str::to_owned),
        }
    }
}

impl BatchReport {
    pub(super) fn begun(pipeline: &Pipeline, folder: &Path) -> Self {
        let count = |limit: &Limit| LimitCount { limit: limit.clone(), conforms: 0, does_not_conform: 0, undecided: 0 };
        Self {
            title: pipeline.title.clone(),
            folder: folder.to_owned(),
            done: 0,
            skipped: 0,
            earlier: 0,
            failed: Vec::new(),
            warned: 0,
            warning_count: 0,
            warnings: Vec::new(),
            other_configuration: Vec::new(),
            limits: pipeline.evaluate.limits().iter().map(count).collect(),
            trend: Vec::new(),
            against_speed: Vec::new(),
            without_speed: Vec::new(),
            outputs: Vec::new(),
        }
    }

    /// Counts what was decided of one recording, and keeps what it warns of.
    pub(super) fn count(&mut self, recording: &str, found: RecordingSummary) {
        if found.at_speed.is_none() {
            self.without_speed.push(recording.to_owned());
        }
        if found.warnings > 0 {
            self.warned += 1;
            self.warning_count += found.warnings;
            if self.warnings.len() < MOST_WARNED {
                let RecordingSummary { warnings: count, first, .. } = found;
                self.warnings.push(Warned { recording: recording.to_owned(), count, first });
            }
        }
        for (limit, decision) in self.limits.iter_mut().zip(found.decisions) {
            *match decision {
                Decision::Conforms => &mut limit.conforms,
                Decision::DoesNotConform => &mut limit.does_not_conform,
                Decision::Undecided => &mut limit.undecided,
            } += 1;
        }
    }
}
