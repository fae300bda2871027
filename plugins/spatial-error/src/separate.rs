//! The separator `spatial-error`.

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, Points},
    stage::{Outcome, PointModel, PointSeparator, Separator},
    table::TableSpec,
};

use crate::{
    campaign::{COLUMNS, Campaign},
    conclusion::Conclusion,
    config::{Declared, SpatialError, SpatialErrorConfig},
    outcome::tables,
    solve::solve,
};

impl StageConfig for SpatialErrorConfig {
    type Stage = Separator;

    const NAME: &'static str = "spatial-error";
    const ABOUT: &'static str = "spatial error of a machine by kriging, and its compensation";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator(context)?)))
    }
}

impl SpatialErrorConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self, context: &Context) -> std::result::Result<SpatialError, Fault> {
        let chain = self.checked(context)?;
        let query = self.query.resolved(context);
        Ok(SpatialError { config: self, chain, query })
    }
}

impl PointSeparator for SpatialError {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        tables(&self.chain, self.config.curves.is_some())
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let campaign = self.campaign(points)?;
        let solution = solve(&campaign, &self.config, &[])?;
        Conclusion { separator: self, campaign: &campaign, solution: &solution, names: &[] }.outcome()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "the error of the machine is known but for a displacement and a rotation, which are those of the tracker too".to_owned(),
        ];
        if self.config.tool_mm.iter().all(|length| length.abs() < 1e-12) {
            let [.., last] = self.config.chain_axes();
            let (axis, before) = (["X", "Y", "Z"][last], ["X", "Y", "Z"][self.config.chain_axes()[1]]);
            notes.push(format!(
                "with `tool_mm` 0, rotations EA{axis}, EB{axis}, EC{axis} and E{}{before} displace no measured point: they are not \
                 observable",
                ["A", "B", "C"][last]
            ));
        }
        if self.config.declared.contains(&Declared::Translation) && self.config.declared.contains(&Declared::Rigid) {
            notes.push("`rigid` contains `translation`".into());
        }
        notes
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl SpatialError {
    pub(crate) fn campaign(&self, points: &Points) -> Result<Campaign> {
        Campaign::of(points, self.config.std_um, self.config.tool_mm, self.config.chain_axes())
    }
}
