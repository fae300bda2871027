//! What single turns show, as people say it.

mod drifts;
mod lines;

pub(crate) use drifts::say as say_drifts;
pub(crate) use lines::say as say_lines;
