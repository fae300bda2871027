//! Stages that are programs of their own, in any language: tables go to their stdin and come from their stdout.
//!
//! A request and an answer are [frames](frame) that end with `end 0`; `docs/external-programs.md` has the protocol.

mod answer;
mod config;
mod conformance;
mod exporter;
mod frame;
mod loader;
mod points;
mod process;
mod program;
mod said;
mod session;
mod tables;
mod turns;

pub use config::{ExternalExporterConfig, ExternalLoaderConfig, ExternalSeparatorConfig};
pub use conformance::{Check, Conformance, Found};
pub use process::end_all;

use runout_core::pipeline::{Plugin, Registry};

/// Adds what this crate has.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<ExternalLoaderConfig>());
    registry.separators.add(Plugin::of::<ExternalSeparatorConfig>());
    registry.exporters.add(Plugin::of::<ExternalExporterConfig>());
}
