//! Stages that are programs of their own, in any language: tables go to their stdin and come from their stdout. The same tables go to
//! [code of this process](Code) and come from it.
//!
//! A request and an answer are [frames](frame) that end with `end 0`; `docs/external-programs.md` has the protocol.

mod answer;
mod code;
mod config;
mod conformance;
mod corrector;
mod effect;
mod evaluator;
mod exporter;
mod frame;
mod loader;
mod point_effect;
mod points;
mod process;
mod program;
mod recording;
mod responder;
mod said;
mod session;
mod tables;
mod turns;
mod values;

pub use code::{CodeKind, register_code};
pub use config::{
    ExternalEvaluatorConfig, ExternalExporterConfig, ExternalLoaderConfig, ExternalPreprocessorConfig,
    ExternalSeparatorConfig, Gives,
};
pub use conformance::{Check, CheckResult, Conformance};
pub use effect::{EffectParameter, ExternalEffectConfig};
pub use process::end_all;
pub use responder::{Answers, Code};
pub use values::{Symbol, lasting};

use runout_core::pipeline::{Plugin, Registry};

/// Adds what this crate has.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<ExternalLoaderConfig>());
    registry.preprocessors.add(Plugin::of::<ExternalPreprocessorConfig>());
    registry.separators.add(Plugin::of::<ExternalSeparatorConfig>());
    registry.evaluators.add(Plugin::of::<ExternalEvaluatorConfig>());
    registry.exporters.add(Plugin::of::<ExternalExporterConfig>());
    registry.own_effects.add(Plugin::of::<ExternalEffectConfig>());
}
