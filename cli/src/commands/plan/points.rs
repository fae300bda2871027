//! `runout plan` of measured points: what is observable with their layout, and what to add to it.

use runout_core::{
    pipeline::{
        Pipeline, Registry,
        document::{Document, Sources},
    },
    stage::Source,
};

use crate::{args::PlanArgs, failure::Failure, reports::plan::PointReport};

/// Whether a file is a pipeline of measured points: it has `[separate]` and no `[rig]`.
///
/// # Errors
/// When it is not TOML.
pub(crate) fn is_pipeline(sources: &Sources) -> Result<bool, Failure> {
    let document = Document::parse(sources)?;
    let keys = document.root().get_ref();
    Ok(keys.contains_key("separate") && !keys.contains_key("rig"))
}

/// Plans the layout of a pipeline of measured points, with the points where they are there.
///
/// # Errors
/// When the pipeline is wrong, or has nothing to plan.
pub(crate) fn report(args: &PlanArgs, sources: &Sources, registry: &Registry) -> Result<PointReport, Failure> {
    let of_a_rig = [("--optimise", args.optimise.is_some()), ("--map", args.map.is_some())];
    if let Some((option, _)) = of_a_rig.iter().find(|(_, given)| *given) {
        let message = format!("{option} is for a rig; this is a pipeline of measured points");
        return Err(Failure::Name { message, help: format!("leave {option} out") });
    }
    let pipeline = Pipeline::from_sources(sources, registry)?;
    let nothing = || Failure::Name {
        message: format!("`{}` has nothing to plan", pipeline.separator),
        help: "`runout check` says what is and is not observable".into(),
    };
    let separator = pipeline.route.point_separator().ok_or_else(nothing)?;
    let mut notes = Vec::new();
    let points = match pipeline.loader.open(&pipeline.request()) {
        Ok(Source::Points(points)) => Some(points),
        Ok(Source::Turns(_)) => None,
        Err(error) => {
            notes.push(format!("planned without data, which are not there yet or cannot be used: {error}"));
            None
        }
    };
    let mut plan = separator.plan(points.as_ref())?.ok_or_else(nothing)?;
    plan.notes.extend(notes);
    Ok(PointReport { title: pipeline.title.clone(), separator: pipeline.separator.clone(), plan })
}
