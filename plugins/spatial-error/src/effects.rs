//! What the declared model may lack: errors of the axes, a drift and a step of the tracker; and jumps that no effect describes.

use runout_core::closed_loop::{Effect, Parameter};

use crate::{
    campaign::Campaign,
    shapes::{Shape, periods_mm, times},
    terms::{Term, Volume},
};

const LETTERS: [&str; 3] = ["X", "Y", "Z"];
const ROTATIONS: [&str; 3] = ["A", "B", "C"];
/// Orders of positioning and straightness, and of angular errors.
const ORDERS: [std::ops::RangeInclusive<usize>; 2] = [2..=5, 1..=3];
/// The first axis moves with the second.
const SQUARENESS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];
/// Planes of a step along an axis at most, and cuts of a box along each.
const CUTS: [usize; 2] = [40, 6];
/// Places that a jump needs on each side.
const FEWEST: usize = 4;

/// Something that the model may lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// Length error of an axis.
    Scale(usize),
    /// Positioning of an axis.
    Positioning(usize),
    /// Angle between two axes.
    Squareness(usize, usize),
    /// Displacement along the first as the second moves.
    Straightness(usize, usize),
    /// Rotation about the first as the second moves.
    Angular(usize, usize),
    /// Drift along an axis.
    Drift(usize),
    /// Periodic positioning error of an axis.
    Pitch(usize),
    /// Displacement of the tracker from a time on.
    TrackerStep,
}

/// An effect at one shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    /// Index into [`missing`].
    pub effect: usize,
    /// Its order, period or time.
    pub shape: Shape,
    /// Its columns.
    pub terms: Vec<Term>,
}

/// All effects.
#[must_use]
pub(crate) fn missing() -> Vec<Missing> {
    let axes = [0, 1, 2];
    let mut all: Vec<Missing> = axes.map(Missing::Scale).into();
    all.extend(axes.map(Missing::Positioning));
    all.extend(SQUARENESS.map(|(moved, with)| Missing::Squareness(moved, with)));
    for axis in axes {
        all.extend(axes.into_iter().filter(|moved| *moved != axis).map(|moved| Missing::Straightness(moved, axis)));
    }
    for axis in axes {
        all.extend(axes.map(|about| Missing::Angular(about, axis)));
    }
    all.extend(axes.map(Missing::Drift));
    all.extend(axes.map(Missing::Pitch));
    all.push(Missing::TrackerStep);
    all
}

impl Missing {
    /// Its id, where it acts, and its parameters.
    #[must_use]
    pub(crate) fn effect(self) -> Effect {
        let parameter =
            |name: &str, unit: &str, tolerance| Parameter { name: name.into(), unit: unit.into(), tolerance };
        let order = || parameter("order", "1", 1.0);
        let linear = |moved: usize, axis: usize| format!("E{}{}", LETTERS[moved], LETTERS[axis]);
        let (id, target, parameters) = match self {
            Self::Scale(axis) => ("scale", LETTERS[axis].into(), vec![parameter("scale", "um/m", 20.0)]),
            Self::Positioning(axis) => {
                ("positioning", linear(axis, axis), vec![order(), parameter("amplitude", "um", 5.0)])
            }
            Self::Squareness(moved, with) => {
                ("squareness", format!("{}{}", LETTERS[moved], LETTERS[with]), vec![parameter("angle", "urad", 20.0)])
            }
            Self::Straightness(moved, axis) => {
                ("straightness", linear(moved, axis), vec![order(), parameter("amplitude", "um", 5.0)])
            }
            Self::Angular(about, axis) => {
                let target = format!("E{}{}", ROTATIONS[about], LETTERS[axis]);
                ("angular", target, vec![order(), parameter("amplitude", "urad", 20.0)])
            }
            Self::Drift(axis) => {
                let parameters = [("change", 5.0), ("bend", 2.0), ("early_bend", 1.0)];
                let parameters = parameters.map(|(name, usual)| parameter(name, "um", usual)).into();
                ("thermal-drift", LETTERS[axis].to_lowercase(), parameters)
            }
            Self::Pitch(axis) => {
                let parameters = vec![
                    parameter("period", "mm", 10.0),
                    parameter("amplitude", "um", 5.0),
                    parameter("phase", "deg", 90.0),
                ];
                ("axis-pitch", LETTERS[axis].into(), parameters)
            }
            Self::TrackerStep => {
                let steps = ["step_x", "step_y", "step_z"].map(|name| parameter(name, "um", 5.0));
                let parameters = std::iter::once(parameter("at", "campaign", 0.5)).chain(steps).collect();
                return Effect { id: "tracker-step".into(), targets: Vec::new(), parameters };
            }
        };
        Effect { id: id.into(), targets: vec![target], parameters }
    }

    /// Whether its first parameter is its shape.
    #[must_use]
    pub(crate) fn has_shape(self) -> bool {
        !matches!(self, Self::Scale(_) | Self::Squareness(..) | Self::Drift(_))
    }

    /// The shape that its first parameter gives; the reason where it is none.
    pub(crate) fn shape(self, value: f64) -> Result<Shape, String> {
        let orders = self.orders();
        let (shape, right, wanted): (_, _, String) = match self {
            Self::Pitch(_) => (Shape::Period { mm: value, declared: true }, value > 0.0, "period is above 0 mm".into()),
            Self::TrackerStep => (
                Shape::From(value),
                (0.0..1.0).contains(&value),
                "`at` is a share of the campaign, from 0 to below 1".into(),
            ),
            _ => {
                let is_one = value.fract() == 0.0 && value >= *orders.start() as f64 && value <= *orders.end() as f64;
                let wanted = format!("order is a whole number from {} to {}", orders.start(), orders.end());
                (Shape::Order(value as usize), is_one, wanted)
            }
        };
        if right { Ok(shape) } else { Err(format!("its {wanted}, found {value}")) }
    }

    /// Its columns at a shape.
    #[must_use]
    pub(crate) fn terms(self, shape: Shape) -> Vec<Term> {
        let order = if let Shape::Order(order) = shape { order } else { 1 };
        match self {
            Self::Scale(axis) => vec![Term::Scale(axis)],
            Self::Positioning(axis) => vec![Term::Linear { moved: axis, axis, order }],
            Self::Squareness(moved, with) => vec![Term::Squareness(moved, with)],
            Self::Straightness(moved, axis) => vec![Term::Linear { moved, axis, order }],
            Self::Angular(about, axis) => vec![Term::Angular { about, axis, order }],
            Self::Drift(axis) => vec![Term::Drift(axis), Term::Bend(axis), Term::EarlyBend(axis)],
            Self::Pitch(axis) => {
                let Shape::Period { mm: period_mm, .. } = shape else { return Vec::new() };
                [false, true].map(|cosine| Term::Pitch { axis, period_mm, cosine }).into()
            }
            Self::TrackerStep => {
                let Shape::From(time) = shape else { return Vec::new() };
                [0, 1, 2].map(|moved| Term::After { moved, time }).into()
            }
        }
    }

    /// Orders that it may have; one entry of no meaning where it has none.
    #[must_use]
    pub(crate) fn orders(self) -> std::ops::RangeInclusive<usize> {
        match self {
            Self::Positioning(_) | Self::Straightness(..) => ORDERS[0].clone(),
            Self::Angular(..) => ORDERS[1].clone(),
            _ => 1..=1,
        }
    }
}

/// Every effect at every shape; of periods those that are declared (0 where one is not), or all that are looked for.
#[must_use]
pub(crate) fn candidates(campaign: &Campaign, pitch_mm: [f64; 3]) -> Vec<Candidate> {
    let shapes = |one: Missing| -> Vec<Shape> {
        match one {
            Missing::Pitch(axis) if pitch_mm[axis] > 0.0 => {
                vec![Shape::Period { mm: pitch_mm[axis], declared: true }]
            }
            Missing::Pitch(axis) => {
                periods_mm(campaign, axis).into_iter().map(|mm| Shape::Period { mm, declared: false }).collect()
            }
            Missing::TrackerStep => times(campaign).into_iter().map(Shape::From).collect(),
            _ if one.has_shape() => one.orders().map(Shape::Order).collect(),
            _ => vec![Shape::None],
        }
    };
    let of = |(effect, one): (usize, Missing)| {
        shapes(one).into_iter().map(move |shape| Candidate {
            effect,
            shape,
            terms: measured(campaign, one.terms(shape)),
        })
    };
    missing().into_iter().enumerate().flat_map(of).collect()
}

/// Steps of the tracker along axes that were measured; all other columns.
pub(crate) fn measured(campaign: &Campaign, mut terms: Vec<Term>) -> Vec<Term> {
    terms.retain(|term| !matches!(term, Term::After { moved, .. } if !campaign.measured.contains(moved)));
    terms
}

/// A jump that no effect describes: across a plane, or within a box at a corner, along all axes that were measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Jump {
    /// Its columns.
    pub terms: Vec<Term>,
    /// Where it is.
    pub place: String,
}

/// All jumps that leave enough places on both sides.
#[must_use]
pub(crate) fn jumps(campaign: &Campaign) -> Vec<Jump> {
    let places = &campaign.places_mm;
    let axes = [0, 1, 2];
    let measured = || campaign.measured.iter().copied();
    let cuts = axes.map(|axis| cuts(places, axis));
    let mut all = Vec::new();
    for axis in axes {
        for at_mm in thinned(&cuts[axis], CUTS[0]) {
            let above = places.iter().filter(|place| place[axis] > at_mm).count();
            if above.min(places.len() - above) >= FEWEST {
                let place = format!("across the plane {} = {at_mm:.1} mm", LETTERS[axis].to_lowercase());
                let terms = measured().map(|moved| Term::Step { moved, axis, at_mm }).collect();
                all.push(Jump { terms, place });
            }
        }
    }
    let wide: Vec<[Vec<f64>; 2]> = axes.iter().map(|axis| near_ends(&cuts[*axis], &campaign.volume, *axis)).collect();
    for corner in 0..8 {
        let above = axes.map(|axis| corner >> axis & 1 == 1);
        for x in &wide[0][usize::from(above[0])] {
            for y in &wide[1][usize::from(above[1])] {
                for z in &wide[2][usize::from(above[2])] {
                    let limit_mm = [*x, *y, *z];
                    let inside =
                        |place: &&[f64; 3]| axes.iter().all(|axis| (place[*axis] > limit_mm[*axis]) == above[*axis]);
                    let count = places.iter().filter(inside).count();
                    if count < FEWEST || 2 * count > places.len() {
                        continue;
                    }
                    let side = |axis: usize| {
                        let sign = if above[axis] { ">" } else { "<" };
                        format!("{} {sign} {:.1}", LETTERS[axis].to_lowercase(), limit_mm[axis])
                    };
                    let place = format!("in the corner {} mm", axes.map(side).join(", "));
                    let terms = measured().map(|moved| Term::Corner { moved, limit_mm, above }).collect();
                    all.push(Jump { terms, place });
                }
            }
        }
    }
    all
}

/// Middles between neighbouring coordinates.
fn cuts(places: &[[f64; 3]], axis: usize) -> Vec<f64> {
    let mut levels: Vec<f64> = places.iter().map(|place| place[axis]).collect();
    levels.sort_by(f64::total_cmp);
    let extent = levels.last().copied().unwrap_or(0.0) - levels.first().copied().unwrap_or(0.0);
    levels.windows(2).filter(|pair| pair[1] - pair[0] > 1e-3 * extent).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

fn thinned(cuts: &[f64], most: usize) -> Vec<f64> {
    if cuts.len() <= most {
        return cuts.to_vec();
    }
    (0..most).map(|index| cuts[index * (cuts.len() - 1) / (most - 1)]).collect()
}

/// Cuts within the lower and within the upper half of an axis.
fn near_ends(cuts: &[f64], volume: &Volume, axis: usize) -> [Vec<f64>; 2] {
    let middle = volume.middle_mm[axis] + 1e-6 * volume.half_mm[axis];
    let (low, high): (Vec<f64>, Vec<f64>) = cuts.iter().partition(|cut| **cut <= middle);
    let near = |cuts: &[f64]| thinned(cuts, CUTS[1]);
    [near(&low), near(&high)]
}
