//! The table of reference circles.

use super::{CIRCLES, SECTION, STATION};
use runout_evaluate::{EvaluatedStation, ReferenceCircle};
use runout_table::{
    ArrayRef, ColumnSpec, Figure, Measure, TableSpec,
    circles::{CIRCLE, FILTER, RONT, columns},
    numbers, numbers_or_null, texts, texts_or_null,
};
use runout_turning::separation::SectionAt;

/// Where roundness is evaluated.
pub(super) fn circles() -> TableSpec {
    let z = ColumnSpec::number("z_mm", "mm", "place of the section along the axis").repeating();
    let mut all = vec![ColumnSpec::name("section", SECTION), ColumnSpec::name("station", STATION), z];
    all.extend(columns());
    let about = "reference circles of each section, whose angles and origin are those of the table form";
    let ront = Measure::new(RONT[0]).with_std(RONT[1]).with_symbol("RONt");
    let along = Figure::points("roundness-along-z", "Roundness along z", "z_mm", [ront]);
    TableSpec::new(CIRCLES, about, all).figure(along.panels([FILTER]).curves([CIRCLE])).optional()
}

pub(super) fn circle_rows(station: &EvaluatedStation) -> Vec<ArrayRef> {
    let sections = station.result.separation.sections.iter().zip(&station.circles);
    let all: Vec<(&SectionAt, &ReferenceCircle)> =
        sections.flat_map(|(section, circles)| circles.iter().map(move |circle| (section, circle))).collect();
    let number =
        |of: &dyn Fn(&ReferenceCircle) -> f64| numbers(all.iter().map(|(_, circle)| of(circle)).collect::<Vec<_>>());
    let known = |of: &dyn Fn(&ReferenceCircle) -> Option<f64>| {
        numbers_or_null(all.iter().map(|(_, circle)| of(circle)).collect::<Vec<_>>())
    };
    vec![
        texts(all.iter().map(|(section, _)| section.id.as_str())),
        texts(all.iter().map(|_| station.result.station.as_str())),
        numbers(all.iter().map(|(section, _)| section.z_mm)),
        texts(all.iter().map(|(_, circle)| circle.filter.as_str())),
        known(&|circle| circle.gaussian_upr),
        texts(all.iter().map(|(_, circle)| circle.reference.symbol())),
        number(&|circle| circle.centre_um[0]),
        number(&|circle| circle.centre_um[1]),
        number(&|circle| circle.radius_um),
        number(&|circle| circle.ront_um),
        known(&|circle| circle.std_um),
        texts_or_null(all.iter().map(|(_, circle)| circle.refuted_by.as_deref())),
        number(&|circle| circle.peak[0]),
        number(&|circle| circle.peak[1]),
        number(&|circle| circle.valley[0]),
        number(&|circle| circle.valley[1]),
        known(&|circle| circle.eccentricity.map(|[distance, _]| distance)),
        known(&|circle| circle.eccentricity.map(|[_, angle]| angle)),
    ]
}
