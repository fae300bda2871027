//! The ways from a measurement to form, built from their stages.

use std::sync::Arc;

use crate::{
    effects::{EffectCatalogue, PointEffect},
    pipeline::{
        document::{self, Table, table},
        tables::{self, StationTables},
    },
    points::PointColumn,
    stage::{
        Averager, Conditioner, Corrected, EvaluableKind, PointModel, PointSeparator, Preprocessor, Separator,
        StationModel, StationSeparator,
    },
};
use runout_closed_loop::Effect;
use runout_error::fault::Fault;
use runout_table::TableSpec;
use runout_turning::{
    rig::Rig,
    separation::{Assessment, NOTHING_SEPARATED},
};

/// The ways from a measurement to form.
pub enum Route {
    /// Recorded turns, station by station.
    Turns {
        /// Samples to samples.
        conditioners: Vec<Box<dyn Conditioner>>,
        /// Samples to a profile.
        averager: Box<dyn Averager>,
        /// Profiles to form and motion.
        separator: Box<dyn StationSeparator>,
        /// The separator's model for the closed loop, where it has one.
        model: Option<Box<dyn StationModel>>,
    },
    /// Measured points, all at once.
    Points {
        /// Points to tables, values and form.
        separator: Box<dyn PointSeparator>,
        /// The columns that it takes.
        columns: Vec<PointColumn>,
        /// Effects of the pipeline's own.
        effects: Vec<Arc<dyn PointEffect>>,
    },
}

impl Route {
    /// The separator of measured points.
    #[must_use]
    pub fn point_separator(&self) -> Option<&dyn PointSeparator> {
        match self {
            Self::Turns { .. } => None,
            Self::Points { separator, .. } => Some(&**separator),
        }
    }

    /// What its result may hold that the standards' values are computed from.
    #[must_use]
    pub fn evaluables(&self) -> Vec<EvaluableKind> {
        match self {
            Self::Turns { .. } => {
                vec![EvaluableKind::ClosedProfiles, EvaluableKind::AxisMotion, EvaluableKind::TurnSpread]
            }
            Self::Points { separator, .. } => separator.evaluables(),
        }
    }

    /// Whether its result has form.
    #[must_use]
    pub fn gives_form(&self) -> bool {
        self.evaluables().contains(&EvaluableKind::ClosedProfiles)
    }

    /// Whether its result has a surface: form of several sections, or heights on a plane.
    pub(super) fn gives_surface(&self) -> bool {
        let one_section = self.point_separator().is_some_and(PointSeparator::is_one_section);
        (self.gives_form() && !one_section) || self.evaluables().contains(&EvaluableKind::HeightMap)
    }

    /// Whether there is a model for the closed loop.
    pub(super) fn has_model(&self) -> bool {
        match self {
            Self::Turns { model, .. } => model.is_some(),
            Self::Points { separator, .. } => separator.model().is_some(),
        }
    }

    /// What its model may lack.
    pub(super) fn effects(&self) -> Vec<Effect> {
        match self {
            Self::Turns { model, .. } => model.as_ref().map_or_else(Vec::new, |model| model.effects().to_vec()),
            Self::Points { separator, effects, .. } => {
                let of_domain = separator.model().map_or_else(Vec::new, PointModel::effects);
                of_domain.into_iter().chain(effects.iter().map(|own| own.effect())).collect()
            }
        }
    }

    /// Whether only the data name the targets of its effects.
    pub(super) fn data_name_targets(&self) -> bool {
        let model = self.point_separator().and_then(PointSeparator::model);
        model.is_some_and(PointModel::points_name_targets)
    }

    /// The tables of its result; with `evaluators` there are values of their own.
    pub(super) fn tables(
        &self,
        assessment: Option<&Assessment>,
        rig: Option<&Rig>,
        evaluators: bool,
    ) -> Vec<TableSpec> {
        let mut tables = Vec::new();
        if self.gives_form() {
            tables.extend(StationTables::new(assessment, rig).specs());
        }
        tables.extend(self.point_separator().into_iter().flat_map(PointSeparator::tables));
        let own = tables::named_values(self.gives_form());
        match self {
            Self::Turns { .. } if !evaluators => {}
            _ if self.gives_form() => tables.push(own.optional()),
            _ => tables.push(own),
        }
        tables.extend([tables::corrections(), tables::consistency()]);
        tables
    }
}

/// The route of measured points.
pub(super) fn points(
    separator: Separator,
    separate_table: &Table,
    root: &Table,
    effects: &EffectCatalogue,
) -> Result<Route, Fault> {
    match separator {
        Separator::Points(separator) => {
            let gives_form = separator.evaluables().contains(&EvaluableKind::ClosedProfiles);
            if let Some(table) = table(root, "surface")?.filter(|_| !gives_form) {
                return Err(Fault::span(table.span(), "this separator gives no form: it makes no surface"));
            }
            let effects = effects.of::<Arc<dyn PointEffect>>();
            let is_linear = separator.model().is_some_and(|model| model.linear().is_some());
            if let Some(own) = effects.first().filter(|_| !is_linear) {
                let problem = format!("its model takes no effect of a pipeline's own, as `{}` is", own.effect().id);
                let fault = Fault::at("plugin", problem)
                    .help("leave [[effect]] out; models that are linear take them: docs/external-programs.md");
                return Err(document::resolve(fault, separate_table));
            }
            let mut columns = separator.columns();
            for column in effects.iter().flat_map(|own| own.columns()) {
                if columns.iter().all(|known| known.name != column.name) {
                    columns.push(column);
                }
            }
            Ok(Route::Points { separator, columns, effects })
        }
        Separator::Stations(_) => {
            let fault = Fault::at("plugin", "this separator takes recorded turns; [load] gives points");
            Err(document::resolve(fault, separate_table))
        }
    }
}

/// The route of recorded turns, and what is observable by its separator.
pub(super) fn turns(
    preprocessors: Vec<(Preprocessor, Table)>,
    separator: Separator,
    separate_table: &Table,
    root: &Table,
    effects: &EffectCatalogue,
) -> Result<(Route, Option<Assessment>), Fault> {
    let mut conditioners = Vec::new();
    let mut averager: Option<Box<dyn Averager>> = None;
    for (preprocessor, table) in preprocessors {
        averager = match (preprocessor, averager) {
            (Preprocessor::Conditioner(conditioner), None) => {
                conditioners.push(conditioner);
                None
            }
            (Preprocessor::Averager(found), None) => Some(found),
            (Preprocessor::Corrector(corrector), Some(averager)) => Some(Box::new(Corrected { averager, corrector })),
            (Preprocessor::Corrector(_), None) => {
                let fault = Fault::at("plugin", "it changes averages, and nothing has averaged the turns yet");
                return Err(document::resolve(fault.help("move it below plugin = \"synchronous-average\""), &table));
            }
            (Preprocessor::Conditioner(_) | Preprocessor::Averager(_), Some(_)) => {
                let fault =
                    Fault::at("plugin", "no preprocessor of samples can follow the one that averages the turns");
                return Err(document::resolve(fault.help("move it above"), &table));
            }
        };
    }
    let averager = averager.ok_or_else(|| {
        let fault = Fault::at("preprocess", "the turns are never averaged");
        document::resolve(fault.help("end [[preprocess]] with plugin = \"synchronous-average\""), root)
    })?;
    match separator {
        Separator::Stations(separator) => {
            let mut assessment =
                separator.assess(averager.max_order()).map_err(|fault| document::resolve(fault, separate_table))?;
            if assessment.has_no_observable_form() {
                assessment.notes.insert(0, NOTHING_SEPARATED.into());
            }
            let model = separator.model(effects);
            Ok((Route::Turns { conditioners, averager, separator, model }, Some(assessment)))
        }
        Separator::Points(_) => {
            let fault = Fault::at("plugin", "this separator takes measured points; [load] gives recorded turns");
            Err(document::resolve(fault, separate_table))
        }
    }
}
