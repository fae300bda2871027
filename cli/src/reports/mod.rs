//! What commands say, before it is drawn as text or written as JSON.

pub(crate) mod check;
pub(crate) mod inspect;
pub(crate) mod plan;
