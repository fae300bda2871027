//! Reference circles and vectors as the page's program takes them.

use runout_core::{
    numerics::number::with_std,
    table::panels::{Arrow, Circle, Curve, Panels},
};
use serde::Serialize;

use crate::{numbers::Numbers, one_line, symbol};

/// Vectors that a page holds: more are thinned.
const MOST: usize = 20_000;

/// A reference circle behind a filter by which the page can show the curve.
#[derive(Serialize)]
pub(crate) struct CircleData {
    filter: String,
    /// Cut-off of the Gaussian low-pass; 0 without filter.
    upr: f64,
    name: String,
    /// Centre and radius.
    at: [f64; 3],
    /// RONt about it, as it is shown.
    ront: String,
    peak: [f64; 2],
    valley: [f64; 2],
    /// Where the centre is from the axis: distance and angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    off: Option<[f64; 2]>,
}

/// The circles of a curve, behind filters that the page has.
pub(crate) fn circles(curve: &Curve) -> Vec<CircleData> {
    let shown = curve.circles.iter().filter(|circle| circle.gaussian_upr.is_finite());
    shown.map(CircleData::of).collect()
}

impl CircleData {
    fn of(circle: &Circle) -> Self {
        let [value, std] = circle.ront;
        let mark = if circle.is_refuted { " !" } else { "" };
        Self {
            filter: one_line(&circle.filter),
            upr: circle.gaussian_upr,
            name: circle.symbol.clone(),
            at: [circle.centre[0], circle.centre[1], circle.radius].map(short),
            ront: with_std(value, Some(std).filter(|std| std.is_finite())) + mark,
            peak: circle.peak.map(short),
            valley: circle.valley.map(short),
            off: Some(circle.eccentricity.map(short)).filter(|off| off.iter().all(|one| one.is_finite())),
        }
    }
}

/// A number with as many digits as a drawing shows.
fn short(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return number;
    }
    let scale = 10_f64.powf(5.0 - number.abs().log10().floor());
    (number * scale).round() / scale
}

/// Vectors at places, each coordinate and component by itself.
#[derive(Serialize)]
pub(crate) struct ArrowsData {
    place: Vec<Numbers>,
    vector: Vec<Numbers>,
    /// Names with units of the third coordinate and of the components.
    depth: [String; 2],
    components: Vec<[String; 2]>,
}

impl ArrowsData {
    /// Of a panel's curves, and whether some were left out; nothing where there are none.
    pub(crate) fn of(figure: &Panels, curves: &[Curve]) -> Option<(Self, bool)> {
        let all: Vec<&Arrow> = curves.iter().flat_map(|curve| &curve.arrows).collect();
        let stride = all.len().div_ceil(MOST).max(1);
        let kept: Vec<&Arrow> = all.iter().step_by(stride).copied().collect();
        let three = |of: &dyn Fn(&Arrow, usize) -> f64| {
            let numbers = |axis: usize| kept.iter().map(|arrow| of(arrow, axis)).collect::<Vec<_>>();
            [0, 1, 2].map(|axis| Numbers::of(&numbers(axis))).into()
        };
        let depth = figure.height();
        (!all.is_empty()).then(|| {
            let data = Self {
                place: three(&|arrow, axis| arrow.place[axis]),
                vector: three(&|arrow, axis| arrow.vector[axis]),
                depth: [depth.name.clone(), symbol(&depth.unit)],
                components: figure.vector.iter().map(|axis| [axis.name.clone(), symbol(&axis.unit)]).collect(),
            };
            (data, stride > 1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_keep_six_digits() {
        let circle = |upr: f64| Circle {
            filter: "none".into(),
            gaussian_upr: upr,
            symbol: "MZCI".into(),
            centre: [0.123_456_789, 0.0],
            radius: -1.0,
            ront: [4.321_7, f64::NAN],
            is_refuted: true,
            peak: [359.999_999_9, 2.0],
            valley: [1.0, -2.0],
            eccentricity: [f64::NAN; 2],
        };
        let curve = Curve { circles: vec![circle(0.0), circle(f64::NAN)], ..Curve::default() };
        let [found] = &circles(&curve)[..] else { panic!("a filter that the page does not have") };
        assert_eq!((found.at, found.peak, found.off), ([0.123_457, 0.0, -1.0], [360.0, 2.0], None));
        assert!(found.ront.ends_with(" !") && found.ront.starts_with("4.32"), "{}", found.ront);
    }

    #[test]
    fn vectors_are_thinned() {
        let arrow = |index: u32| Arrow { place: [f64::from(index), 0.0, 1.0], vector: [1.0, 2.0, 3.0] };
        let curve = Curve { arrows: (0..50_000).map(arrow).collect(), ..Curve::default() };
        let axes = ["x", "y", "z", "dx", "dy", "dz"].map(str::to_owned);
        let columns = axes.iter().map(|name| runout_core::table::ColumnSpec::number(name, "um", "")).collect();
        let table = runout_core::table::TableSpec::new("t", "", columns);
        let [x, y, z, dx, dy, dz] = axes;
        let figure = runout_core::table::Figure::vectors("v", "V", [x, y, z], [dx, dy, dz]);
        let panels = Panels::new(&table, &figure, 1);
        let found = panels.ok().and_then(|panels| ArrowsData::of(&panels, &[curve]));
        assert!(found.is_some_and(|(data, thinned)| thinned && data.components.len() == 3));
    }
}
