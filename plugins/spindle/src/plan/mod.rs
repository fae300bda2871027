//! Planning a rig before there is one: noise gain fast enough to search with, better sensor angles, what helps most, which
//! effects would show.

pub mod effects;
pub mod gain;
mod nominal;
pub mod optimise;
pub mod spacing;
pub mod suggest;

pub use effects::{Change, Changes, changes, foresee, foresee_rig};
pub use gain::{Criterion, FormGain, Score};
pub use optimise::{Arrangement, Optimum, Search, optimise};
pub use spacing::{Spacing, TooTight};
pub use suggest::{Addition, Suggestion, suggest};
