//! Compensation files of machine controls, from component curves: the exporter `controller`.
//!
//! ```toml
//! [[export]]
//! plugin = "controller"
//! dialect = "linuxcnc"
//! axis = "X"
//! path = "out/x.comp"
//! leave_out = ["EYX", "EZX"]
//! ```
//!
//! A dialect is a file in `dialects/`: what it holds, how it writes it, and what the control then adds to a command. An error that it does
//! not hold has to be named in `leave_out`.

mod chain;
mod config;
mod dialects;
mod export;
mod header;

use runout_core::pipeline::{Plugin, Registry};

pub use config::{ControllerConfig, DialectName, Moves};

/// Adds the exporter `controller`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<ControllerConfig>());
}
