//! Planning a rig before there is one: noise gain fast enough to search with, better sensor angles, what helps most, which
//! effects would show.

mod effects;
mod gain;
mod nominal;
mod optimise;
mod spacing;
mod suggest;

pub use effects::{Change, Changes, changes, foresee, foresee_rig};
pub use gain::{Criterion, FormGain, Score};
pub use optimise::{Arrangement, Optimum, PROGRESS_STEPS, Search, optimise};
pub use spacing::{Spacing, TooTight, distance_deg};
pub use suggest::{Addition, Suggestion, score, suggest};
