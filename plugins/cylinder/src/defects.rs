//! Local defects of a circle: arcs of neighbouring points far from all others, as an edge, a chip or dirt leaves them. No effect of the
//! cylinder explains them, and one of them bends all others: the closed loop sets them aside, and says where.

use runout_core::{closed_loop::diagnosis::Unexplained, numerics::number::signed};

use crate::{circle::Cleaned, robust::rms, scan::Scan};

/// Orders that a circle may have by itself, at most: higher ones follow an edge. Low ones first: they do not follow a wide one.
const ORDERS: [usize; 3] = [4, 8, 15];
/// Median absolute deviations from the fit of these orders: seven standard deviations of normal noise.
const FAR_MAD: f64 = 10.0;
/// Points of an arc at least: a single one is a bad reading.
const FEWEST: usize = 3;
/// Share of the points at most: what is not like the others is then not local.
const MOST: f64 = 0.2;

/// A circle without its local defects, and these; as it is where there are none.
pub(crate) fn set_aside(scan: &Scan, name: &str) -> (Scan, Vec<Unexplained>) {
    let whole = || (scan.clone(), Vec::new());
    let begin = Cleaned::of(scan, ORDERS[0], None, FAR_MAD);
    let more = |cleaned: Cleaned, order: &usize| Cleaned::beginning_with(cleaned.kept, scan, *order, None, FAR_MAD);
    let Ok(cleaned) = begin.and_then(|begin| ORDERS[1..].iter().try_fold(begin, more)) else { return whole() };
    // Of few points, a form of higher orders cannot be distinguished from a defect.
    if cleaned.max_order < ORDERS[ORDERS.len() - 1] {
        return whole();
    }
    let arcs: Vec<_> = cleaned.arcs().into_iter().filter(|(_, count)| *count >= FEWEST).collect();
    let mut kept = vec![true; scan.len()];
    arcs.iter().for_each(|(points, _)| kept[points.clone()].fill(false));
    let left_out = kept.iter().filter(|kept| !**kept).count();
    if left_out == 0 || left_out as f64 > MOST * scan.len() as f64 {
        return whole();
    }
    let defects = arcs.into_iter().map(|(points, _)| {
        let off = &cleaned.distance_um[points.clone()];
        let farthest = off.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        let [from, to] = [points.start, points.end - 1].map(|point| scan.angle_rad[point].to_degrees());
        Unexplained {
            station: None,
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: rms(off.iter().copied()),
            place: format!(
                "{name}: a local defect from {from:.1}° to {to:.1}° ({} points, up to {} µm), left out of the fit",
                points.len(),
                signed(farthest, 3)
            ),
        }
    });
    let defects = defects.collect();
    (scan.keep(&kept), defects)
}
