//! What single turns show, as people say it.

mod drifts;
mod lines;

pub use drifts::say as say_drifts;
pub use lines::say as say_lines;
