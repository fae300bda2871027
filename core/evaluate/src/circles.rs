//! The reference circles of a section, for whoever draws its profile about them.

use super::{Evaluate, Filter, Group, section::Form};
use crate::{Value, ValueId, run_out};
use runout_numerics::Complex64;
use runout_standards::roundness::{Located, Reference};
use runout_turning::{rig::Rig, separation::Quantity, station::StationResult};

/// A reference circle (ISO 12181-1) of a section's profile behind a filter. Its place is that of the profile as the table `form` has it:
/// with the centre, where the method observes order 1.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceCircle {
    /// The filter, as values name it.
    pub filter: String,
    /// Cut-off of a Gaussian low-pass in undulations per revolution, 0 without filter; none of other filters.
    pub gaussian_upr: Option<f64>,
    /// Which circle it is.
    pub reference: Reference,
    /// Its centre from the origin of the profile, in µm, along the part angles 0° and 90°.
    pub centre_um: [f64; 2],
    /// Its radius less the nominal one, in µm; less the mean radius where the level is not observable.
    pub radius_um: f64,
    /// Part angle of the highest point in degrees, and its deviation from the circle in µm.
    pub peak: [f64; 2],
    /// Part angle of the lowest point in degrees, and its deviation from the circle in µm.
    pub valley: [f64; 2],
    /// RONt about it, in µm.
    pub ront_um: f64,
    /// Its standard uncertainty, where it is one of the values and that is known.
    pub std_um: Option<f64>,
    /// What of its own data refutes the value.
    pub refuted_by: Option<String>,
    /// Distance of its centre from the axis in µm, and the part angle to it in degrees: the axis of the part where the method observes
    /// order 1, else the axis of rotation in the first setup; none where neither is known.
    pub eccentricity: Option<[f64; 2]>,
}

/// All four circles of a section behind each filter of its roundness; `values` are those of the section.
pub(crate) fn section_circles(
    result: &StationResult,
    section: usize,
    evaluate: &Evaluate,
    radius_mm: f64,
    rig: Option<&Rig>,
    values: &[Value],
) -> Vec<ReferenceCircle> {
    let form = Form::of(result, section, radius_mm).filter(|_| evaluate.has(Group::Roundness));
    let Some(form) = form else { return Vec::new() };
    let place = Place::of(result, section, rig);
    let mut circles = Vec::new();
    for cutoff in evaluate.cutoffs_upr(form.held.highest) {
        let filter = evaluate.low_pass(cutoff);
        let found = form.with_series(&filter, |series| Reference::ALL.map(|one| series.located(one).ok()));
        for (reference, located) in Reference::ALL.into_iter().zip(found) {
            let Some(located) = located else { continue };
            let id = ValueId {
                symbol: "RONt",
                reference: Some(reference.symbol()),
                filter: Some(&filter.name),
                band_upr: filter.band_upr(form.held.highest_passed()),
                of: None,
            };
            circles.push(place.circle(&filter, reference, &located, values.iter().find(|value| value.id() == id)));
        }
    }
    circles
}

/// Where the profile without level and centre is in the profile as the table has it.
struct Place {
    level_um: f64,
    /// Order 1 of the form.
    centre: Complex64,
    /// Order 1 about the axis, where that is known.
    about_axis: Option<Complex64>,
}

impl Place {
    fn of(result: &StationResult, section: usize, rig: Option<&Rig>) -> Self {
        let separation = &result.separation;
        let unknown = separation.position(Quantity::Form(section));
        let mut orders = unknown.into_iter().flat_map(|unknown| separation.coefficients(unknown));
        let [level, centre] = [orders.next(), orders.next()].map(Option::unwrap_or_default);
        // Exactly 0 is an order 1 that the method leaves out.
        let is_known = centre != Complex64::ZERO;
        let read = || rig.and_then(|rig| run_out::first_centre_um(&result.profiles, rig, section));
        Self { level_um: level.re, centre, about_axis: if is_known { Some(centre) } else { read() } }
    }

    fn circle(
        &self,
        filter: &Filter,
        reference: Reference,
        Located { circle, peak, valley }: &Located,
        value: Option<&Value>,
    ) -> ReferenceCircle {
        // Order 1 is Re C e^{iα}: a centre at (Re C, −Im C).
        let from = |order_one: Complex64| [circle.x_um + order_one.re, circle.y_um - order_one.im];
        let eccentricity = self.about_axis.map(|axis| {
            let [x, y] = from(axis);
            [x.hypot(y), y.atan2(x).to_degrees().rem_euclid(360.0)]
        });
        ReferenceCircle {
            filter: filter.name.clone(),
            gaussian_upr: filter.gaussian_upr(),
            reference,
            centre_um: from(self.centre),
            radius_um: self.level_um + circle.deviation_um,
            peak: [peak[0].to_degrees(), peak[1]],
            valley: [valley[0].to_degrees(), valley[1]],
            ront_um: value.map_or(peak[1] - valley[1], |value| value.value),
            std_um: value.and_then(|value| value.uncertainty.as_ref()).map(|known| known.std),
            refuted_by: value.and_then(|value| value.refuted_by.clone()),
            eccentricity,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::{
        section_values,
        tests::{evaluate, find, lobes, station},
    };

    const RADIUS_MM: f64 = 30.0;

    /// Three lobes beside the axis: all circles are about the same centre, 5 µm away from it, and RONt is that of the values.
    #[test]
    fn circles_lie_where_the_profile_is() {
        let evaluate = evaluate("filter_upr = [15]").unwrap();
        let waves = [lobes(0, 7.0), lobes(1, 5.0), lobes(3, 2.0)];
        let result = station(0.0, &waves, 60, 0.01, &[]);
        let values = section_values(&result, 0, &evaluate, RADIUS_MM);
        let circles = section_circles(&result, 0, &evaluate, RADIUS_MM, None, &values);
        let names: Vec<_> = circles.iter().map(|one| (one.gaussian_upr.unwrap(), one.reference.symbol())).collect();
        let four = |upr: f64| ["LSCI", "MZCI", "MICI", "MCCI"].map(|circle| (upr, circle));
        assert_eq!(names, [four(0.0), four(15.0)].concat());
        let first = lobes(1, 5.0).1;
        for one in &circles {
            let [x, y] = one.centre_um;
            assert!((x - first.re).abs() < 1e-3 && (y + first.im).abs() < 1e-3, "{one:?}");
            let [distance, angle] = one.eccentricity.unwrap();
            assert!((distance - 5.0).abs() < 1e-3, "{one:?}");
            let turned = angle.to_radians() - (-first.im).atan2(first.re);
            assert!(turned.sin().abs() < 1e-3 && turned.cos() > 0.0, "{one:?}");
            assert!((one.peak[1] - one.valley[1] - one.ront_um).abs() < 1e-9, "{one:?}");
            // A crest of the three lobes.
            let crest = (3.0 * one.peak[0].to_radians() + lobes(3, 2.0).1.arg()).cos();
            assert!(crest > 0.999, "{one:?}");
            if matches!(one.reference, Reference::LeastSquares | Reference::MinimumZone) {
                let value = find(&values, "RONt", one.reference.symbol(), &one.filter);
                assert_eq!((one.ront_um, one.std_um), (value.value, value.uncertainty.as_ref().map(|known| known.std)));
                assert!(one.std_um.is_some());
            } else {
                assert_eq!(one.std_um, None);
            }
        }
        let radius = |reference| circles.iter().find(|one| one.reference == reference).unwrap().radius_um;
        for (reference, radius_um) in [
            (Reference::LeastSquares, 7.0),
            (Reference::MinimumZone, 7.0),
            (Reference::MaximumInscribed, 5.0),
            (Reference::MinimumCircumscribed, 9.0),
        ] {
            assert!((radius(reference) - radius_um).abs() < 1e-3, "{reference:?} {}", radius(reference));
        }
    }

    #[test]
    fn without_order_one_the_centre_is_not_known() {
        let evaluate = evaluate("").unwrap();
        // Not observable, and left out by the method.
        for lost in [&[1][..], &[]] {
            let result = station(0.0, &[lobes(3, 2.0)], 60, f64::NAN, lost);
            let circles = section_circles(&result, 0, &evaluate, RADIUS_MM, None, &[]);
            assert!(!circles.is_empty() && circles.iter().all(|one| one.eccentricity.is_none()), "{circles:?}");
            assert_eq!(section_circles(&result, 0, &Evaluate::nothing(), RADIUS_MM, None, &[]), []);
        }
    }
}
