//! The run of traces along an axis: load → separate → evaluate → export, all at once.

use super::{
    config::Pipeline,
    run::{begun, conclude},
    summary::Summary,
};
use crate::{
    Error, Result,
    points::Points,
    provenance::Input,
    stage::TraceSeparator,
    straightness::{LIMIT, Straightness},
};

pub(super) fn run(pipeline: &Pipeline, points: &Points, separator: &dyn TraceSeparator) -> Result<Summary> {
    let mut result = separator.separate(points)?;
    finite(points, &result)?;
    let mut summary = begun(pipeline);
    summary.provenance.inputs = vec![Input::of(&points.input)?];
    summary.straightness = Some((&result).into());
    summary.warnings.push(LIMIT.to_owned());
    summary.warnings.append(&mut result.warnings);
    let mut complete = Vec::new();
    for exporter in &pipeline.exporters {
        let exporter = exporter
            .straightness()
            .ok_or_else(|| Error::new("export", &pipeline.title, "an exporter has no place for straightness"))?;
        complete.extend(exporter.write(&result, &summary)?);
    }
    conclude(summary, complete, pipeline.summary_path())
}

/// Refuses what is not a number.
fn finite(points: &Points, result: &Straightness) -> Result<()> {
    if [&result.z_mm, &result.part_um, &result.slide_um].into_iter().flatten().all(|value| value.is_finite()) {
        return Ok(());
    }
    let problem = "the straightness comes out as no number";
    Err(Error::new("separate", points.input.display().to_string(), problem).help("look for absurd readings"))
}
