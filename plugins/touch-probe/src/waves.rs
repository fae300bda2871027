//! Cosines and sines over the angles of a touch.

use crate::{config::TouchProbeConfig, touches::Touch};

/// Cosine or sine of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    Cosine,
    Sine,
}

/// Angles of a touch: as seen from the probe and from the ring.
pub(crate) fn angles(config: &TouchProbeConfig, touch: &Touch) -> [f64; 2] {
    let setup = &config.setups[touch.setup];
    [touch.angle - setup.probe_deg.to_radians(), touch.angle - setup.ring_deg.to_radians()]
}

/// The value of a part of an order at an angle.
pub(crate) fn wave(order: usize, part: Part, angle: f64) -> f64 {
    match part {
        Part::Cosine => (order as f64 * angle).cos(),
        Part::Sine => (order as f64 * angle).sin(),
    }
}
