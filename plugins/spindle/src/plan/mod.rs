//! Planning a rig before there is one: noise gain fast enough to search with, better sensor angles, and what helps most.

pub mod gain;
pub mod optimise;
pub mod spacing;
pub mod suggest;

pub use gain::{Criterion, FormGain, Score};
pub use optimise::{Arrangement, Optimum, Search, optimise};
pub use spacing::{Spacing, TooTight};
pub use suggest::{Addition, Suggestion, suggest};
