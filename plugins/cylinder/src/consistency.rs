//! The tests of measured circles on their own points.

use runout_core::{
    consistency::{Check, Kind, Structure, rows},
    numerics::least_squares::Basis,
};

use crate::{
    circle::Harmonics,
    robust::{ROUNDING_UM, rms},
    scan::Scan,
};

/// What is declared of circles of these names: errors may depend on each other along the angle; circles are independent, have the same noise
/// and may be offset.
pub(crate) fn structure(scans: &[Scan], names: &[String]) -> Structure {
    let of_circle = |(circle, scan): (usize, &Scan)| {
        let name = &names[circle];
        scan.angle_rad.iter().map(|angle| format!("{name} at {:.1}°", angle.to_degrees())).collect::<Vec<String>>()
    };
    let circle: Vec<usize> = scans.iter().enumerate().flat_map(|(circle, scan)| vec![circle; scan.len()]).collect();
    let angle = scans.iter().flat_map(|scan| scan.angle_rad.iter().copied()).collect();
    let structure = Structure::default()
        .along("angle", circle.clone(), angle)
        .naming(scans.iter().enumerate().flat_map(of_circle).collect());
    if scans.len() < 2 {
        return structure;
    }
    structure
        .shifting("circles", &circle, names)
        .divided("circles", Kind::Blocks, circle.clone(), names.to_vec())
        .divided("circles", Kind::Alike, circle, names.to_vec())
}

impl Harmonics {
    /// Names points of a circle that are not like the others about them.
    pub(crate) fn unlike(&self, scan: &Scan, name: &str) -> Option<Check> {
        let basis = Basis::of(self.columns(scan));
        let mut left = scan.deviation_um.clone();
        basis.remove_from(&mut left);
        if rms(left.iter().copied()) < ROUNDING_UM {
            return None;
        }
        let declared = structure(std::slice::from_ref(scan), &[name.to_owned()]);
        Some(rows::unlike(&left, basis.columns())?.check(&declared, "µm"))
    }
}
