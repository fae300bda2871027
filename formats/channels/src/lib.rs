//! Recordings of named channels, as other programs write them: one loader, `channels`, for many formats.
//!
//! A format is a module that recognises a file by its first bytes and gives its channels and their samples in blocks
//! ([`ChannelFile`]). Everything else is done once for all formats: which channel is which sensor, setups and stations by groups or
//! files, units, marks, encoders and sampling rates.
//!
//! ```
//! use runout_channels::{FORMATS, Kind};
//!
//! assert!(FORMATS.iter().any(|format| format.name == "tdms"));
//! assert_eq!(Kind::I16.codes(), Some([-32768.0, 32767.0]));
//! ```

mod bytes;
mod capture;
mod channel;
mod clock;
mod config;
mod files;
mod formats;
mod hints;
mod lines;
mod loader;
mod recording;
mod resample;
mod select;
mod signal;
mod source;
mod stream;
mod strided;
mod suggest;
mod turns;
mod unit;

pub use channel::{Channel, ChannelFile, Kind, Samples};
pub use config::{AngleConfig, ChannelConfig, ChannelsConfig, ConvertedConfig, MarkConfig};
pub use formats::{FORMATS, Format, format_of, open};
use runout_core::pipeline::{Plugin, Registry};
pub use suggest::{ChannelReport, ChannelsReport, Suggestion, inspect};

/// Adds the loader `channels`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<ChannelsConfig>());
}
