//! Domains of measured points with a blind benchmark: one file each, and a line in [`ALL`].

mod fly_cutting;
mod rotary_axis;
mod spatial_error;
mod touch_probe;

use super::points::Domain;

/// All of them.
pub const ALL: [Domain; 4] = [rotary_axis::DOMAIN, touch_probe::DOMAIN, fly_cutting::DOMAIN, spatial_error::DOMAIN];

/// The domain of a name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Domain> {
    ALL.iter().find(|domain| domain.name == name)
}
