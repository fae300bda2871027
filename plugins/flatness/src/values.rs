//! Flatness deviations of heights at places (ISO 12781-1): about the least-squares plane, and between the two parallel planes that are
//! nearest to each other.

use runout_core::numerics::{chebyshev::Chebyshev, cloud::Cloud, least_squares::Basis};

/// Symbols with what they are, in the order of [`flatness`].
pub(crate) const SYMBOLS: [(&str, &str, &str); 5] = [
    ("FLTt", "LSPL", "peak-to-valley flatness deviation (ISO 12781-1)"),
    ("FLTp", "LSPL", "peak-to-reference flatness deviation (ISO 12781-1)"),
    ("FLTv", "LSPL", "reference-to-valley flatness deviation (ISO 12781-1)"),
    ("FLTq", "LSPL", "root mean square flatness deviation (ISO 12781-1)"),
    ("FLTt", "MZPL", "peak-to-valley flatness deviation (ISO 12781-1)"),
];

/// The least-squares plane of places.
pub(crate) fn plane(nodes_mm: &[[f64; 2]]) -> Basis {
    let column = |of: &dyn Fn(&[f64; 2]) -> f64| nodes_mm.iter().map(of).collect::<Vec<f64>>();
    Basis::of(vec![column(&|_| 1.0), column(&|place| place[0]), column(&|place| place[1])])
}

/// Values of heights in µm.
pub(crate) fn flatness(nodes_mm: &[[f64; 2]], plane: &Basis, heights_um: &[f64]) -> [f64; 5] {
    let mut about = heights_um.to_vec();
    plane.remove_from(&mut about);
    let (low, high) = about.iter().fold((0.0_f64, 0.0_f64), |(low, high), one| (low.min(*one), high.max(*one)));
    let rms = (about.iter().map(|one| one * one).sum::<f64>() / about.len() as f64).sqrt();
    [high - low, high, -low, rms, zone_um(nodes_mm, &about).unwrap_or(f64::NAN)]
}

/// The least distance of two parallel planes that contain all.
fn zone_um(nodes_mm: &[[f64; 2]], about_um: &[f64]) -> Option<f64> {
    let range = about_um.iter().map(|one| one.abs()).fold(0.0, f64::max);
    if range <= 0.0 {
        return Some(0.0);
    }
    // Places of −1 to 1: tilts are then heights.
    let reach = nodes_mm.iter().flatten().map(|one| one.abs()).fold(0.0, f64::max);
    let mut cloud = Cloud::<2>::default();
    nodes_mm.iter().zip(about_um).for_each(|(place, height)| cloud.push(place.map(|one| one / reach), *height));
    let most = 100.0 * range;
    let found =
        Chebyshev::<2, 4>::new(true, true).solve(&cloud, &[0.0, 0.0, 1.0, -1.0], &[(-most, most); 2], 1e-12 * range);
    found.map(|found| found.cost)
}
