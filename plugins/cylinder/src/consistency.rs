//! The tests of measured circles on their own points.

use runout_core::{
    consistency::{Check, Judgement, Kind, LinearFit, Structure, judge, rows},
    numerics::least_squares::Basis,
};

use crate::{
    circle::Harmonics,
    robust::{ROUNDING_UM, rms},
    scan::Scan,
};

/// What is declared of circles of these names: their errors may depend on each other along the angle, circles are independent, have the
/// same noise and may be offset.
pub(crate) fn structure(scans: &[Scan], names: &[String]) -> Structure {
    let circle: Vec<usize> = scans.iter().enumerate().flat_map(|(circle, scan)| vec![circle; scan.len()]).collect();
    let angle: Vec<f64> = scans.iter().flat_map(|scan| scan.angle_rad.iter().copied()).collect();
    let rows =
        circle.iter().zip(&angle).map(|(circle, angle)| format!("{} at {:.1}°", names[*circle], angle.to_degrees()));
    let structure = Structure::default().naming(rows.collect()).along("the angle", circle.clone(), angle);
    if scans.len() < 2 {
        return structure;
    }
    let named = |structure: Structure, kind: Kind| structure.divided("circles", kind, circle.clone(), names.to_vec());
    [Kind::Blocks, Kind::Alike, Kind::Shift].into_iter().fold(structure, named)
}

impl Harmonics {
    /// The tests of a circle about them; their variance is widened by what they find. Points that are not like the others are named, and
    /// the others tested without them.
    pub(crate) fn judge(&mut self, scan: &Scan, name: &str) -> Vec<Check> {
        let declared = structure(std::slice::from_ref(scan), &[name.to_owned()]);
        let all = Basis::of(self.columns(scan));
        let mut left = scan.deviation_um.clone();
        all.remove_from(&mut left);
        if rms(left.iter().copied()) < ROUNDING_UM {
            return Vec::new();
        }
        let unlike = rows::unlike(&left, all.columns());
        let named = unlike.as_ref().map_or(&[][..], |unlike| &unlike.rows);
        let used: Vec<usize> = (0..scan.len()).filter(|point| !named.contains(point)).collect();
        let kept: Vec<bool> = (0..scan.len()).map(|point| !named.contains(&point)).collect();
        let others = scan.keep(&kept);
        let basis = if named.is_empty() { all } else { Basis::of(self.columns(&others)) };
        let mut residual = others.deviation_um.clone();
        basis.remove_from(&mut residual);
        let names: Vec<String> = (0..basis.rank()).map(|column| format!("order {}", column.div_ceil(2))).collect();
        let weights = basis.weights();
        let fit = LinearFit {
            residual: &residual,
            basis: basis.columns(),
            names: &names,
            weights: &weights,
            noise: None,
            unit: "µm",
        };
        let Judgement { mut checks, factors } = judge(fit, &declared.sorted(&used));
        checks.extend(unlike.filter(|unlike| !unlike.rows.is_empty()).map(|unlike| unlike.check(&declared, "µm")));
        for (order, variance) in self.variance.iter_mut().enumerate() {
            let of_order =
                [(2 * order).saturating_sub(1), 2 * order].map(|column| factors.get(column).copied().unwrap_or(1.0));
            *variance *= of_order.into_iter().fold(1.0, f64::max).powi(2);
        }
        checks
    }
}
