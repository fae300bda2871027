//! What commands say, before it is drawn as text or written as JSON.

pub mod check;
pub mod inspect;
pub mod plan;
