//! The run of traces along an axis: load → separate → evaluate → export, all at once.

use super::{
    config::{Pipeline, summary_path},
    run::{Finished, begun},
    summary::Summary,
};
use crate::{
    Error, Result,
    model::diagnosis::Correction,
    points::Points,
    provenance::Input,
    stage::{Exporter, TraceSeparator},
    straightness::{LIMIT, Straightness},
};

pub(super) fn run(pipeline: &Pipeline, points: &Points, separator: &dyn TraceSeparator) -> Result<Summary> {
    let result = separator.separate(points)?;
    finished(pipeline, &pipeline.exporters, points, result, Vec::new(), Vec::new())?.commit(None)
}

/// Writes a result to these exporters, with what else the user should know and the effects that it is corrected for.
pub(super) fn finished(
    pipeline: &Pipeline,
    exporters: &[Box<dyn Exporter>],
    points: &Points,
    mut result: Straightness,
    remarks: Vec<String>,
    effects: Vec<Correction>,
) -> Result<Finished> {
    finite(points, &result)?;
    let mut summary = begun(pipeline);
    summary.provenance.inputs = vec![Input::of(&points.input)?];
    summary.straightness = Some((&result).into());
    summary.effects = effects;
    summary.warnings.push(LIMIT.to_owned());
    summary.warnings.extend(remarks);
    summary.warnings.append(&mut result.warnings);
    let mut complete = Vec::new();
    for exporter in exporters {
        let exporter = exporter
            .straightness()
            .ok_or_else(|| Error::new("export", &pipeline.title, "an exporter has no place for straightness"))?;
        complete.extend(exporter.write(&result, &summary)?);
    }
    Ok(Finished::new(summary, complete, summary_path(exporters)))
}

/// Refuses what is not a number.
fn finite(points: &Points, result: &Straightness) -> Result<()> {
    if [&result.z_mm, &result.part_um, &result.slide_um].into_iter().flatten().all(|value| value.is_finite()) {
        return Ok(());
    }
    let problem = "the straightness comes out as no number";
    Err(Error::new("separate", points.input.display().to_string(), problem).help("look for absurd readings"))
}
