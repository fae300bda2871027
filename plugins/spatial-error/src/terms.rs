//! Columns of the trend: what one unit of each parameter adds to a reading.
//!
//! Lever arms and Legendre polynomials count from the middle of the measured volume; u runs from −1 to 1 over it.

/// The measured volume and the chain of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Its middle, in mm.
    pub middle_mm: [f64; 3],
    /// Half its size along each axis, in mm; 0 where all places have one coordinate.
    pub half_mm: [f64; 3],
    /// Offset of the measured point from the last axis of the chain, in mm.
    pub tool_mm: [f64; 3],
    /// Axes from the base to the tool: indices of X, Y, Z.
    pub chain: [usize; 3],
}

/// A parameter of the trend, with its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// Placement along an axis, µm.
    Shift(usize),
    /// Placement about an axis, µrad.
    Turn(usize),
    /// Length error of an axis, µm/m.
    Scale(usize),
    /// Angle between two axes: the first moves with the second, µrad.
    Squareness(usize, usize),
    /// Displacement along `moved` as an axis moves: a Legendre polynomial, µm.
    Linear { moved: usize, axis: usize, order: usize },
    /// Rotation about `about` as an axis moves: a Legendre polynomial, µrad.
    Angular { about: usize, axis: usize, order: usize },
    /// Displacement along `along` (µm), or rotation about it (µrad), at one of evenly spaced nodes of an axis: 1 there, 0 at the others.
    Node { rotates: bool, along: usize, axis: usize, node: usize, nodes: usize, between: Between },
    /// Drift along an axis from the first reading to the last, µm.
    Drift(usize),
    /// Bend of a drift: its course at half time less half its change, µm.
    Bend(usize),
    /// What a drift has at a quarter of the time, and less at three quarters, besides its bend, µm: a warm-up goes fast at first.
    EarlyBend(usize),
    /// Sine or cosine of an axis' place, from the middle of the volume, over a period, µm.
    Pitch { axis: usize, period_mm: f64, cosine: bool },
    /// What a sine and a cosine, in µm, gain as their period grows, of the relative change of the period.
    PitchSlope { axis: usize, period_mm: f64, sine_um: f64, cosine_um: f64 },
    /// Displacement along `moved` from a time on, µm.
    After { moved: usize, time: f64 },
    /// Displacement along `moved` on one side of a plane, µm.
    Step { moved: usize, axis: usize, at_mm: f64 },
    /// Displacement along `moved` within a box at a corner, µm; `above` says at which end of each axis.
    Corner { moved: usize, limit_mm: [f64; 3], above: [bool; 3] },
}

/// What a curve is between its nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// Linear, as controls interpolate.
    Linear,
    /// Cubic convolution, exact for parabolas (Keys, IEEE Trans. Acoust. Speech Signal Process. 29 (1981) 1153).
    Cubic,
}

impl Between {
    /// Share of a node of several at a place, counted in nodes.
    fn size(self, at: f64, node: usize, nodes: usize) -> f64 {
        let linear = |from: f64| (1.0 - from.abs()).max(0.0);
        if self == Self::Linear || nodes < 3 {
            return linear(at - node as f64);
        }
        let kernel = |from: f64| match from.abs() {
            from if from < 1.0 => (1.5 * from - 2.5) * from * from + 1.0,
            from if from < 2.0 => ((-0.5 * from + 2.5) * from - 4.0) * from + 2.0,
            _ => 0.0,
        };
        // A node before the first one, and one after the last, continues the polynomial of four nodes, or three.
        let ends: &[f64] = if nodes > 3 { &[4.0, -6.0, 4.0, -1.0] } else { &[3.0, -3.0, 1.0] };
        let beyond = |from_end: usize| ends.get(from_end).copied().unwrap_or(0.0);
        kernel(at - node as f64)
            + beyond(node) * kernel(at + 1.0)
            + beyond(nodes - 1 - node) * kernel(at - nodes as f64)
    }
}

impl Volume {
    /// The box around places.
    #[must_use]
    pub fn around(places: &[[f64; 3]], tool_mm: [f64; 3], chain: [usize; 3]) -> Self {
        let ends = [0, 1, 2].map(|axis| {
            let each = || places.iter().map(|place| place[axis]);
            [each().fold(f64::INFINITY, f64::min), each().fold(f64::NEG_INFINITY, f64::max)]
        });
        let (middle_mm, half_mm) = (ends.map(|[a, b]| 0.5 * (a + b)), ends.map(|[a, b]| 0.5 * (b - a)));
        Self { middle_mm, half_mm, tool_mm, chain }
    }

    fn unit(&self, axis: usize, place: [f64; 3]) -> f64 {
        if self.half_mm[axis] > 0.0 { (place[axis] - self.middle_mm[axis]) / self.half_mm[axis] } else { 0.0 }
    }

    /// From the axis to the measured point, over the axes that it carries, in mm.
    fn arm(&self, axis: usize, place: [f64; 3]) -> [f64; 3] {
        let position = self.chain.iter().position(|other| *other == axis).unwrap_or(0);
        let mut arm = self.tool_mm;
        for carried in &self.chain[position + 1..] {
            arm[*carried] += place[*carried] - self.middle_mm[*carried];
        }
        arm
    }
}

impl Term {
    /// What one unit adds to a reading, in µm; `time` runs from 0 at the first reading to 1 at the last.
    #[must_use]
    pub fn at(self, volume: &Volume, place: [f64; 3], time: f64) -> [f64; 3] {
        let mut adds = [0.0; 3];
        let from_middle = |axis: usize| place[axis] - volume.middle_mm[axis];
        match self {
            Self::Shift(axis) => adds[axis] = 1.0,
            Self::Turn(about) => return turned(about, [0, 1, 2].map(from_middle)),
            Self::Scale(axis) => adds[axis] = 1e-3 * from_middle(axis),
            Self::Squareness(moved, with) => adds[moved] = 1e-3 * from_middle(with),
            Self::Linear { moved, axis, order } => adds[moved] = legendre(order, volume.unit(axis, place)),
            Self::Angular { about, axis, order } => {
                let size = legendre(order, volume.unit(axis, place));
                return turned(about, volume.arm(axis, place)).map(|entry| size * entry);
            }
            Self::Node { rotates, along, axis, node, nodes, between } => {
                let size = between.size(0.5 * (volume.unit(axis, place) + 1.0) * (nodes - 1) as f64, node, nodes);
                if rotates {
                    return turned(along, volume.arm(axis, place)).map(|entry| size * entry);
                }
                adds[along] = size;
            }
            Self::Drift(axis) => adds[axis] = time,
            Self::Bend(axis) => adds[axis] = 4.0 * time * (1.0 - time),
            Self::EarlyBend(axis) => adds[axis] = 32.0 / 3.0 * time * (1.0 - time) * (1.0 - 2.0 * time),
            Self::Pitch { axis, period_mm, cosine } => {
                let turn = std::f64::consts::TAU * from_middle(axis) / period_mm;
                adds[axis] = if cosine { turn.cos() } else { turn.sin() };
            }
            Self::PitchSlope { axis, period_mm, sine_um, cosine_um } => {
                let turn = std::f64::consts::TAU * from_middle(axis) / period_mm;
                adds[axis] = turn * (cosine_um * turn.sin() - sine_um * turn.cos());
            }
            Self::After { moved, time: from } => adds[moved] = f64::from(u8::from(time > from)),
            Self::Step { moved, axis, at_mm } => adds[moved] = f64::from(u8::from(place[axis] > at_mm)),
            Self::Corner { moved, limit_mm, above } => {
                let inside = (0..3).all(|axis| (place[axis] > limit_mm[axis]) == above[axis]);
                adds[moved] = f64::from(u8::from(inside));
            }
        }
        adds
    }

    /// Whether it depends on time.
    #[must_use]
    pub fn moves_in_time(self) -> bool {
        matches!(self, Self::Drift(_) | Self::Bend(_) | Self::EarlyBend(_) | Self::After { .. })
    }

    /// Whether it is the change of a sine or cosine with its period.
    #[must_use]
    pub fn is_slope_of(self, other: Self) -> bool {
        match (self, other) {
            (Self::PitchSlope { axis, period_mm, .. }, Self::Pitch { axis: of, period_mm: period, .. }) => {
                axis == of && period_mm.to_bits() == period.to_bits()
            }
            _ => false,
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Turn(_) | Self::Squareness(..) | Self::Angular { .. } | Self::Node { rotates: true, .. } => "urad",
            Self::Scale(_) => "um/m",
            Self::PitchSlope { .. } => "1",
            _ => "um",
        }
    }
}

/// A rotation by 1 µrad about an axis, in µm, of a point in mm.
fn turned(about: usize, arm: [f64; 3]) -> [f64; 3] {
    let (next, last) = ((about + 1) % 3, (about + 2) % 3);
    let mut moved = [0.0; 3];
    moved[next] = -1e-3 * arm[last];
    moved[last] = 1e-3 * arm[next];
    moved
}

/// The Legendre polynomial of an order.
#[must_use]
pub(crate) fn legendre(order: usize, u: f64) -> f64 {
    let (mut before, mut last) = (1.0, u);
    if order == 0 {
        return 1.0;
    }
    for degree in 1..order {
        let n = degree as f64;
        (before, last) = (last, ((2.0 * n + 1.0) * u * last - n * before) / (n + 1.0));
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_reproduce_parabolas_and_lines() {
        let of = |between: Between, at: f64, value: &dyn Fn(f64) -> f64| -> f64 {
            (0..5).map(|node| value(f64::from(node)) * between.size(at, node as usize, 5)).sum()
        };
        for step in 0..=40 {
            let at = 0.1 * f64::from(step);
            let parabola = |x: f64| 2.0 - x + 0.7 * x * x;
            assert!((of(Between::Cubic, at, &parabola) - parabola(at)).abs() < 1e-12, "{at}");
            assert!((of(Between::Linear, at, &|x| 3.0 - x) - (3.0 - at)).abs() < 1e-12, "{at}");
        }
    }
}
