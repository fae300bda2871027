//! What the declared model may lack: the machine, a drift, and orders above those declared.

use runout_core::closed_loop::{Effect, Parameter};

use crate::{
    config::TouchProbeConfig,
    touches::{Touch, Touches},
    waves::{Part, angles, wave},
};

/// Orders above `max_order` that are looked for, at least and at most.
const MORE_ORDERS: [usize; 2] = [6, 12];

/// Something that the model may lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// Scale of X less that of Y.
    AxisScale,
    /// Angle between X and Y less 90°.
    AxisSquareness,
    /// Lost motion of X (0) or Y (1).
    AxisReversal(usize),
    /// Drift of the centre along x (0) or y (1), or of the radius (2).
    ThermalDrift(usize),
    /// Lobing of an order.
    LobingOrder(usize),
    /// Form of the ring of an order.
    RingFormOrder(usize),
}

/// All of them.
pub(crate) fn missing(max_order: usize) -> Vec<Missing> {
    let mut all = vec![Missing::AxisScale, Missing::AxisSquareness];
    all.extend([0, 1].map(Missing::AxisReversal));
    all.extend([0, 1, 2].map(Missing::ThermalDrift));
    let orders = || max_order + 1..=highest(max_order);
    all.extend(orders().map(Missing::LobingOrder));
    all.extend(orders().map(Missing::RingFormOrder));
    all
}

/// The highest order that is looked for.
pub(crate) fn highest(max_order: usize) -> usize {
    max_order + max_order.clamp(MORE_ORDERS[0], MORE_ORDERS[1])
}

impl Missing {
    /// Its id, where it acts, and its parameters.
    pub(crate) fn effect(self) -> Effect {
        let parameter =
            |name: &str, unit: &str, tolerance| Parameter { name: name.into(), unit: unit.into(), tolerance };
        let waves = |tolerance| vec![parameter("cosine", "um", tolerance), parameter("sine", "um", tolerance)];
        let (id, target, parameters) = match self {
            Self::AxisScale => ("axis-scale".into(), None, vec![parameter("scale", "um/m", 30.0)]),
            Self::AxisSquareness => ("axis-squareness".into(), None, vec![parameter("squareness", "urad", 30.0)]),
            Self::AxisReversal(axis) => {
                ("axis-reversal".into(), Some(["X", "Y"][axis]), vec![parameter("reversal", "um", 5.0)])
            }
            Self::ThermalDrift(what) => {
                let parameters = vec![parameter("change", "um", 5.0), parameter("bend", "um", 2.0)];
                ("thermal-drift".into(), Some(["x", "y", "radius"][what]), parameters)
            }
            Self::LobingOrder(order) => (format!("lobing-order-{order}"), None, waves(1.0)),
            Self::RingFormOrder(order) => (format!("ring-form-order-{order}"), None, waves(0.5)),
        };
        Effect { id, targets: target.map(str::to_owned).into_iter().collect(), parameters }
    }

    /// What one unit of each parameter adds to each reading, in µm.
    pub(crate) fn columns(self, config: &TouchProbeConfig, touches: &Touches) -> Vec<Vec<f64>> {
        let of = |entry: &dyn Fn(&Touch) -> f64| -> Vec<f64> { touches.all.iter().map(entry).collect() };
        // 1 µm/m, or 1 µrad, at a radius in mm, in µm.
        let arm = 1e-3 * config.ring_radius_mm;
        let parts = [Part::Cosine, Part::Sine];
        match self {
            Self::AxisScale => vec![of(&|touch| 0.5 * arm * (2.0 * touch.angle).cos())],
            Self::AxisSquareness => vec![of(&|touch| 0.5 * arm * (2.0 * touch.angle).sin())],
            Self::AxisReversal(axis) => vec![of(&|touch| {
                let (sine, cosine) = touch.angle.sin_cos();
                0.5 * [cosine, sine][axis].abs()
            })],
            Self::ThermalDrift(what) => {
                let where_it_acts = |touch: &Touch| {
                    let (sine, cosine) = touch.angle.sin_cos();
                    [cosine, sine, 1.0][what]
                };
                vec![
                    of(&|touch| 0.5 * touch.time * where_it_acts(touch)),
                    of(&|touch| (1.0 - touch.time * touch.time) * where_it_acts(touch)),
                ]
            }
            Self::LobingOrder(order) => {
                parts.map(|part| of(&|touch| wave(order, part, angles(config, touch)[0]))).into()
            }
            Self::RingFormOrder(order) => {
                parts.map(|part| of(&|touch| wave(order, part, angles(config, touch)[1]))).into()
            }
        }
    }
}
