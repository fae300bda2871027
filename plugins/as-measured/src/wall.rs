//! A circle or a cylinder as measured: traces for the least-squares cylinder.

use runout_core::{
    Error, ErrorKind, Result,
    numerics::least_squares::Basis,
    points::{Column, Points, Trace},
};
use runout_cylinder::{LeastSquaresCylinder, LeastSquaresCylinderConfig};

use crate::config::{AsMeasuredConfig, ORDERS, Object};

/// Sections that are distinguished by a gap in their heights, at most.
const MOST_SECTIONS: f64 = 200.0;
/// Share of the radius that the heights of one circle may differ by.
const LEVEL: f64 = 1e-3;
/// Share of steps against the direction of a helix.
const BACKWARD: f64 = 0.05;
const UM_PER_MM: f64 = 1e3;

/// The points as traces of a cylinder, and the separator for them.
pub(crate) fn circles(points: &Points, config: &AsMeasuredConfig) -> Result<(Points, LeastSquaresCylinder)> {
    let object = points.input.display().to_string();
    let refuse = |problem: String| Error::new("read the circles of", &object, problem);
    let column =
        |name: &str| points.columns.iter().find(|column| column.name == name).map(|column| column.values.clone());
    let angle_deg = points.column("angle_deg")?.to_vec();
    let (radius_mm, deviation_um) = match (column("radius_mm"), column("deviation_um"), config.radius_mm) {
        (Some(radius), None, nominal) => {
            let nominal = nominal.unwrap_or_else(|| radius.iter().sum::<f64>() / radius.len() as f64);
            (nominal, radius.iter().map(|radius| UM_PER_MM * (radius - nominal)).collect())
        }
        (None, Some(deviation), Some(nominal)) => (nominal, deviation),
        (None, Some(_), None) => {
            return Err(refuse("deviations do not say which radius they count from".into())
                .help("`radius_mm` in [separate] does"));
        }
        (Some(_), Some(_), _) => {
            return Err(refuse("it has both `radius_mm` and `deviation_um`: which one counts?".into()));
        }
        (None, None, _) => {
            let problem = "it has neither `radius_mm` (distance from the axis) nor `deviation_um`";
            return Err(refuse(problem.into())
                .help("coordinates x_mm, y_mm and z_mm become both with `axis = \"z\"` in [load]"));
        }
    };
    if !(radius_mm.is_finite() && radius_mm > 0.0) {
        return Err(refuse(format!("the mean radius is {radius_mm} mm")));
    }
    let z_mm = column("z_mm").unwrap_or_else(|| vec![0.0; angle_deg.len()]);
    let (order, traces) = if points.traces.len() > 1 {
        let kind =
            |trace: &Trace| if trace.kind == "generatrix" { "generatrix".to_owned() } else { "circle".to_owned() };
        let traces = points.traces.iter().map(|trace| Trace { kind: kind(trace), ..trace.clone() });
        ((0..angle_deg.len()).collect(), traces.collect())
    } else {
        sections(&angle_deg, &z_mm, radius_mm).map_err(|problem| refuse(problem).of(ErrorKind::UnsuitableData))?
    };
    if config.object == Object::Roundness && traces.len() > 1 {
        return Err(refuse(format!("it has {} circles", traces.len())).help("`object = \"cylinder\"` takes several"));
    }
    let sorted = |values: &[f64]| order.iter().map(|index| values[*index]).collect::<Vec<f64>>();
    let columns = [("angle_deg", sorted(&angle_deg)), ("z_mm", sorted(&z_mm)), ("deviation_um", sorted(&deviation_um))];
    let around = || traces.iter().filter(|trace| trace.kind == "circle");
    let usual = || around().map(|trace| usual_order(&columns[0].1[trace.points.clone()])).min().unwrap_or(ORDERS);
    let max_order = config.max_order.unwrap_or_else(usual);
    let columns = columns.into_iter().map(|(name, values)| Column { name: name.into(), values });
    let placed = Points { columns: columns.collect(), traces, labels: Vec::new(), ..points.clone() };
    let separator = LeastSquaresCylinderConfig {
        radius_mm,
        used: None,
        hold_out: Vec::new(),
        max_order,
        outlier_mad: config.outlier_mad,
        outlier_order: config.max_order.unwrap_or(50),
        max_lobes: 2,
    };
    let separator = separator.separator().map_err(|fault| refuse(fault.to_string()).of(ErrorKind::Configuration))?;
    Ok((placed, separator))
}

/// Points of a circle that its form leaves to show the noise: so many, and this part of all.
const SPARE: usize = 10;
const SPARE_PART: usize = 10;
/// A quarter of the points is the highest order at least: then half of them are spare.
const POINTS_AN_ORDER: usize = 4;

/// An arc without a point is a gap where it is longer than so many times the next shorter arc.
const GAP: f64 = 2.0;

/// The highest order where none is stated, of a circle with points at these angles: half a wave is longer than the arcs between points.
fn usual_order(angle_deg: &[f64]) -> usize {
    let count = angle_deg.len();
    let spared = count.saturating_sub(SPARE.max(count / SPARE_PART)) / 2;
    let of_arcs = (180.0 / longest_arc_deg(angle_deg) - 1e-6).ceil() as usize;
    spared.max(count / POINTS_AN_ORDER).min(of_arcs.saturating_sub(1)).clamp(2, ORDERS)
}

/// The longest arc between neighbouring points that is no gap; 0 of fewer than two points.
fn longest_arc_deg(angle_deg: &[f64]) -> f64 {
    let mut angles: Vec<f64> = angle_deg.iter().map(|angle| angle.rem_euclid(360.0)).collect();
    angles.sort_by(f64::total_cmp);
    let around = angles.first().map(|first| first + 360.0);
    let next = angles.iter().copied().skip(1).chain(around);
    let mut arcs: Vec<f64> = angles.iter().zip(next).map(|(from, to)| to - from).filter(|arc| *arc > 0.0).collect();
    arcs.sort_by(f64::total_cmp);
    let longer = &arcs[arcs.len() / 2..];
    let gap = longer.windows(2).position(|pair| pair[1] > GAP * pair[0]);
    longer.get(gap.unwrap_or(longer.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// The order of the points by section, and a trace a section: circles at their heights, or all points as one circle or helix.
fn sections(angle_deg: &[f64], z_mm: &[f64], radius_mm: f64) -> std::result::Result<(Vec<usize>, Vec<Trace>), String> {
    let mut order: Vec<usize> = (0..z_mm.len()).collect();
    let whole = |id: &str| Trace { id: id.into(), kind: "circle".into(), points: 0..z_mm.len() };
    let [low, high] =
        z_mm.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)]);
    let range = high - low;
    if range.is_nan() || range <= LEVEL * radius_mm {
        return Ok((order, vec![whole("circle")]));
    }
    order.sort_by(|one, other| z_mm[*one].total_cmp(&z_mm[*other]));
    let apart_mm = (range / MOST_SECTIONS).max(0.1 * LEVEL * radius_mm);
    let breaks: Vec<usize> =
        (1..order.len()).filter(|place| z_mm[order[*place]] - z_mm[order[place - 1]] > apart_mm).collect();
    if breaks.is_empty() {
        let steps = z_mm.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| step.abs() > 0.0);
        let [up, down] =
            steps.fold([0.0, 0.0], |[up, down], step| if step > 0.0 { [up + 1.0, down] } else { [up, down + 1.0] });
        if f64::min(up, down) > BACKWARD * (up + down) {
            return Err(format!(
                "its {} heights are neither those of circles nor of a helix: the points are scattered over the wall",
                z_mm.len()
            ));
        }
        return Ok(((0..z_mm.len()).collect(), vec![whole("helix")]));
    }
    let ends: Vec<usize> = std::iter::once(0).chain(breaks).chain(std::iter::once(order.len())).collect();
    let mut traces = Vec::new();
    for pair in ends.windows(2) {
        let part = &mut order[pair[0]..pair[1]];
        if beside_a_plane_mm(part, angle_deg, z_mm) > LEVEL.max(range / radius_mm / MOST_SECTIONS) * radius_mm {
            let (low, high) = (z_mm[part[0]], z_mm[part[part.len() - 1]]);
            return Err(format!(
                "heights from {low:.4} to {high:.4} mm are no circle: a column `trace` names the circles"
            ));
        }
        let mean = part.iter().map(|index| z_mm[*index]).sum::<f64>() / part.len() as f64;
        // In the order in which they were measured.
        part.sort_unstable();
        traces.push(Trace { id: format!("z={mean:.3}"), kind: "circle".into(), points: pair[0]..pair[1] });
    }
    Ok((order, traces))
}

/// Range of the heights of some points beside the plane through them: a section at one height of the machine is a plane that leans to the axis.
fn beside_a_plane_mm(part: &[usize], angle_deg: &[f64], z_mm: &[f64]) -> f64 {
    let along = |of: fn(f64) -> f64| part.iter().map(|point| of(angle_deg[*point].to_radians())).collect::<Vec<f64>>();
    let mut heights_mm: Vec<f64> = part.iter().map(|point| z_mm[*point]).collect();
    Basis::of(vec![vec![1.0; part.len()], along(f64::cos), along(f64::sin)]).remove_from(&mut heights_mm);
    let [low, high] =
        heights_mm.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)]);
    high - low
}
