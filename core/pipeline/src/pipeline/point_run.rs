//! The run and the diagnosis of measured points: load → separate → evaluate → export, all at once.

use super::{
    config::{Pipeline, exports::spare_inputs},
    observer::{Observer, Silent},
    result_writer::{Finished, ResultWriter},
};
use crate::{
    height_grid::HeightGrid,
    points::{Points, measured},
    stage::{Evaluable, EvaluableKind, Exporter, Form, Outcome, PlaneMap, PointSeparator},
};
use runout_closed_loop::{correction::Correction, diagnosis::Diagnosis};
use runout_consistency::refuted_by;
use runout_error::{Error, Result};
use runout_evaluate::{Evaluated, EvaluatedStation};
use runout_numerics::height_map::HeightMap;
use runout_standards::areal::without_polynomial;
use runout_turning::station::StationResult;

pub(super) fn run(
    pipeline: &Pipeline,
    points: &Points,
    separator: &dyn PointSeparator,
    observer: &dyn Observer,
) -> Result<Finished> {
    spare_inputs(&pipeline.outputs(), &points.inputs())?;
    declared(separator, points)?.write(pipeline, &pipeline.exporters, points, observer)
}

/// What a run of these points warns of, without its files.
pub(super) fn findings(pipeline: &Pipeline, points: &Points, separator: &dyn PointSeparator) -> Result<Vec<String>> {
    Ok(declared(separator, points)?.write(pipeline, &[], points, &Silent)?.into_findings())
}

fn declared<'a>(separator: &'a dyn PointSeparator, points: &Points) -> Result<PointResult<'a>> {
    measured::refuse_impossible(points)?;
    let mut outcome = separator.separate(points)?.tested(measured::checks(points, &separator.columns()));
    outcome.remarks.extend(measured::units(points, &separator.columns()));
    Ok(PointResult { outcome, remarks: Some(separator), effects: Vec::new(), diagnosis: None })
}

/// A result of points, to be written.
pub(super) struct PointResult<'a> {
    pub outcome: Outcome,
    /// Who has something to say of the surface.
    pub remarks: Option<&'a dyn PointSeparator>,
    /// Effects that the result is corrected for.
    pub effects: Vec<Correction>,
    /// What the closed loop found, and what a run warns of.
    pub diagnosis: Option<(Diagnosis, Vec<String>)>,
}

impl PointResult<'_> {
    pub(super) fn write(
        self,
        pipeline: &Pipeline,
        exporters: &[Box<dyn Exporter>],
        points: &Points,
        observer: &dyn Observer,
    ) -> Result<Finished> {
        let Outcome { convention, tables, values, checks, evaluables, lost_orders, mut remarks, notes } = self.outcome;
        check_declared(&evaluables, &pipeline.route.evaluables())?;
        let refuted_by = refuted_by(&checks);
        let evaluated = Evaluated::of(&evaluables, &pipeline.evaluate, refuted_by.as_deref())?;
        let mut writer = ResultWriter::begin(pipeline, exporters, &[])?;
        writer.corrected_for(self.effects);
        if let Some((diagnosis, of_run)) = self.diagnosis {
            writer.diagnosed(diagnosis, of_run);
        }
        writer.take_values(values, evaluated, convention);
        writer.take_checks(checks);
        writer.lost_orders(lost_orders);
        writer.note(notes);
        writer.take_heights(evaluables.iter().find_map(Evaluable::plane_map).map(above_plane).transpose()?);
        writer.write(&tables)?;
        let mut surface = None;
        if let Some(Form { sections, radius_mm }) = evaluables.into_iter().find_map(Evaluable::into_form) {
            observer.begin(sections.len());
            for separation in sections {
                // As many angles as the surface has, or a multiple of them that the highest order fits on.
                let angles = pipeline.surface.angles;
                let angles = angles * (2 * separation.max_order() + 1).div_ceil(angles);
                let at = separation.sections.first();
                let (station, z_mm) =
                    at.map_or((String::new(), f64::NAN), |section| (section.id.clone(), section.z_mm));
                let result = StationResult { station, z_mm, angles, separation, profiles: Vec::new(), truth: None };
                let station = EvaluatedStation::of(result, &pipeline.evaluate, radius_mm, None, 1);
                let station = station.refuted_by(refuted_by.as_deref());
                writer.take(&station, None)?;
                observer.station(&station.result.station);
            }
            surface = writer.build_surface(radius_mm)?;
        }
        if let Some(separator) = self.remarks {
            remarks.extend(separator.remarks(points, surface.as_ref())?);
        }
        remarks.extend(points.remarks.iter().cloned());
        writer.finish(points.provenance()?, remarks, surface.as_ref())
    }
}

/// Refuses an outcome that holds what its separator did not declare: `check` and the exporters rely on that.
fn check_declared(evaluables: &[Evaluable], declared: &[EvaluableKind]) -> Result<()> {
    match evaluables.iter().map(Evaluable::kind).find(|kind| !declared.contains(kind)) {
        Some(kind) => {
            let problem = "the separator offers it and did not declare it in `evaluables`";
            Err(Error::new("evaluate", format!("the {}", kind.name()), problem))
        }
        None => Ok(()),
    }
}

/// Heights as files and meshes have them: above their least-squares plane, where the domain has not removed form itself, or none as it was asked for.
fn above_plane(plane: &PlaneMap) -> Result<HeightGrid> {
    if plane.reference.is_some() {
        return Ok(plane.grid.clone());
    }
    let HeightGrid { columns, step_x_mm, step_y_mm, .. } = plane.grid;
    let map = HeightMap::new(&plane.grid.height_nm[..], columns, step_x_mm, step_y_mm, false)?;
    let height_nm = without_polynomial(&map, 1)?.heights_um().to_vec();
    Ok(HeightGrid { height_nm, ..plane.grid })
}
