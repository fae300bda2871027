//! The standards' values: of closed and open profiles, walls and height maps.

pub mod areal;
pub mod control_chart;
pub mod cylindricity;
pub mod drawn;
mod extremes;
pub mod gaps;
mod near;
pub mod parameter;
pub mod position;
pub mod reference;
pub mod roundness;
pub mod slope;
pub mod straightness;
pub mod texture;
pub mod twist;
