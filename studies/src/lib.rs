//! Figures that the READMEs print: simulated campaigns, separated in memory.

pub mod averaging;
pub mod axial;
pub mod blind;
pub mod campaign;
pub mod chance;
pub mod consistency;
pub mod coverage;
pub mod each;
pub mod eccentricity;
pub mod flat;
pub mod minimum_zone_cylinder;
pub mod monte_carlo;
pub mod plot;
pub mod points_pictures;
pub mod results;
pub mod rotor;
pub mod scaling;
pub mod spatial;
pub mod straightness;
pub mod surface;
pub mod values;
pub mod walls;
