//! Tables of reference circles, about which a polar figure draws its curves: one row a circle, beside the columns of names of the figure.

use crate::ColumnSpec;

/// The filter of the curve.
pub const FILTER: &str = "filter";
/// Cut-off of a Gaussian low-pass in undulations per revolution.
pub const GAUSSIAN_UPR: &str = "gaussian_upr";
/// Symbol of the circle.
pub const CIRCLE: &str = "circle";
/// Its centre from the origin of the curve.
pub const CENTRE: [&str; 2] = ["centre_x_um", "centre_y_um"];
/// Its radius less the nominal one.
pub const RADIUS: &str = "radius_um";
/// Peak to valley of the curve about it, and its standard uncertainty.
pub const RONT: [&str; 2] = ["ront_um", "std_ront_um"];
/// What refutes that value.
pub const REFUTED_BY: &str = "refuted_by";
/// Angle and deviation of the highest point.
pub const PEAK: [&str; 2] = ["peak_deg", "peak_um"];
/// Angle and deviation of the lowest point.
pub const VALLEY: [&str; 2] = ["valley_deg", "valley_um"];
/// Distance of the centre from the axis, and the angle to it.
pub const ECCENTRICITY: [&str; 2] = ["eccentricity_um", "eccentricity_deg"];

/// The columns beside those of names.
#[must_use]
pub fn columns() -> Vec<ColumnSpec> {
    let um = |name: &str, about: &str| ColumnSpec::number(name, "um", about);
    let deg = |name: &str, about: &str| ColumnSpec::number(name, "deg", about);
    vec![
        ColumnSpec::text(FILTER, "the filter of the profile"),
        ColumnSpec::number(
            GAUSSIAN_UPR,
            "1/rev",
            "cut-off where that is a Gaussian low-pass, 0 without filter; null for other filters",
        )
        .or_null(),
        ColumnSpec::text(CIRCLE, "symbol of the reference circle (ISO 12181-1)"),
        um(CENTRE[0], "its centre from the origin of the profile, towards 0°"),
        um(CENTRE[1], "its centre from the origin of the profile, towards 90°"),
        um(RADIUS, "its radius less the nominal one; less the mean radius where the level is not observable"),
        um(RONT[0], "RONt about it"),
        um(RONT[1], "standard uncertainty of RONt; null where it is not known or not one of the values").or_null(),
        ColumnSpec::text(REFUTED_BY, "what of its own data refutes RONt; null otherwise").or_null(),
        deg(PEAK[0], "angle of the highest point about the circle"),
        um(PEAK[1], "deviation of the highest point"),
        deg(VALLEY[0], "angle of the lowest point about the circle"),
        um(VALLEY[1], "deviation of the lowest point"),
        um(
            ECCENTRICITY[0],
            "distance of its centre from the axis of the part, where order 1 is observable, else from the axis of rotation in the \
             first setup, with 1/rev motion; null where neither is known",
        )
        .or_null(),
        deg(ECCENTRICITY[1], "angle to the centre; null as the distance").or_null(),
    ]
}
