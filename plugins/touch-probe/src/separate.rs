//! The separator `touch-probe`.

use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::diagnosis::LostOrders,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
    },
    stage::{EvaluableKind, Outcome, PointModel, PointPlan, PointSeparator, Separator},
    table::TableSpec,
};

use crate::{
    config::{SetupConfig, TouchProbeConfig, listed, lost_orders},
    design::{Content, Design, Fitted, Parameter, Weights, lobing_order},
    effects::{Missing, missing},
    held_out::ranges,
    noise::weights,
    outcome::TouchSolution,
    tables::{residual_rows, tables},
    touches::Touches,
};

/// Passes of moving the centre: the second order of 1 mm of eccentricity in 25 mm leaves less than 1 nm after three.
const RECENTRED: usize = 3;

/// One weighted least-squares fit over all touches.
#[derive(Debug, Clone)]
pub struct TouchProbe(pub(crate) TouchProbeConfig);

impl StageConfig for TouchProbeConfig {
    type Stage = Separator;

    const NAME: &'static str = "touch-probe";
    const ABOUT: &'static str = "pre-travel and lobing of a touch-trigger probe, from touches of a ring";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

impl TouchProbeConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> std::result::Result<TouchProbe, Fault> {
        self.checked()?;
        Ok(TouchProbe(self))
    }
}

const COLUMNS: [PointColumn; 8] = [
    PointColumn::needed("setup", Label, "", "id of the setup"),
    PointColumn::optional(
        "direction_deg",
        Number,
        "deg",
        "direction of the touch in the machine, from the nominal centre; not needed with x_mm and y_mm",
    ),
    PointColumn::optional("radius_mm", Number, "mm", "radius read, from the nominal centre; or x_mm and y_mm")
        .measured(),
    PointColumn::optional("x_mm", Number, "mm", "place read along x, from the nominal centre").measured(),
    PointColumn::optional("y_mm", Number, "mm", "place read along y, from the nominal centre").measured(),
    PointColumn::optional(
        "repeat",
        Number,
        "",
        "number of the repeat; without it, touches of one direction in a setup are counted",
    ),
    PointColumn::optional("time_s", Number, "s", "time, for drifts; without it, touches follow one another evenly"),
    PointColumn::optional("std_um", Number, "um", "standard uncertainty of the touch"),
];

/// Touches and their noise.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    pub touches: Touches,
    pub weights: Weights,
}

impl Prepared {
    /// Readings, in µm.
    pub(crate) fn readings_um(&self) -> Vec<f64> {
        self.touches.all.iter().map(|touch| touch.reading_um).collect()
    }
}

impl PointSeparator for TouchProbe {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        tables()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let prepared = self.prepare(points)?;
        let readings = prepared.readings_um();
        let (fit, mut outcome) = self.fitted_outcome(&prepared, &[], &Content::declared(), &readings)?;
        outcome.tables.push(residual_rows(&self.0, &prepared.touches, &fit.residual_um, &fit.residual_um)?);
        outcome.remarks.splice(..0, self.mistake(points, fit.chi2_per_dof.sqrt()));
        Ok(outcome)
    }

    fn evaluables(&self) -> Vec<EvaluableKind> {
        let all: Vec<usize> = (0..self.0.setups.len()).collect();
        let of_ring = (2..=self.0.max_order).any(|order| self.0.separates(&all, order));
        of_ring.then_some(EvaluableKind::ClosedProfiles).into_iter().collect()
    }

    fn is_one_section(&self) -> bool {
        true
    }

    fn notes(&self) -> Vec<String> {
        let config = &self.0;
        let all: Vec<usize> = (0..config.setups.len()).collect();
        let lost = config.lost(&all);
        let with_first = |orders: &[usize]| listed(&[&[1], orders].concat());
        let lost_lobing: &[usize] = if config.ring_form_um.is_some() { &[] } else { &lost };
        let mut notes = vec![lost_orders(&with_first(lost_lobing), &with_first(&lost))];
        notes.push("order 1 of lobing is centring of the ring: it is lost with any setups".into());
        notes.push(format!(
            "the error of `ring_radius_mm`, and a scale error common to X and Y (10 µm/m are {:.2} µm), go into the mean pre-travel one to \
             one; with a drift of the radius it is the mean over the campaign, not that of the first touch",
            1e-2 * config.ring_radius_mm
        ));
        match (config.ring_form_um, lost.is_empty()) {
            (Some(bound), false) => notes.push(format!(
                "lobing of orders {} is what is read, the form of the ring with it; its uncertainty includes the bound of {bound} µm",
                listed(&lost)
            )),
            (None, false) => notes.push(
                "a ring or a probe turned by another angle separates the lost orders; so does `ring_form_um`, which bounds the ring's \
                 form of these orders"
                    .into(),
            ),
            _ => {}
        }
        if config.positions() == 2 {
            notes.push(
                "with two relative angles of ring and probe, nothing is redundant below `max_order`: a ring that bent or slipped in a \
                 setup does not show; three or more angles show it"
                    .into(),
            );
        }
        let still = |of: fn(&SetupConfig) -> f64| {
            config.setups.iter().all(|setup| (of(setup) - of(&config.setups[0])).abs() < 0.1)
        };
        let machine = "errors of the axes (scale, squareness, reversal)";
        if still(|setup| setup.probe_deg) {
            notes.push(format!(
                "{machine} are not observable where the probe is not turned in the spindle: they count as lobing of the probe, order 2 \
                 first of all"
            ));
        } else if still(|setup| setup.ring_deg) {
            notes.push(format!(
                "{machine} are not observable where the ring is not turned: they count as form of the ring, order 2 first of all"
            ));
        }
        notes
    }

    fn lost_orders(&self) -> Option<LostOrders> {
        Some(self.0.lost_orders(&(0..self.0.setups.len()).collect::<Vec<_>>()))
    }

    fn plan(&self, _points: Option<&Points>) -> Result<Option<PointPlan>> {
        Ok(Some(self.planned()))
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl TouchProbe {
    /// χ² per degree of freedom of the one fit alone, without what a result has besides: for benchmarks.
    ///
    /// # Errors
    /// When the points do not hold what the fit needs.
    pub fn fit_only(&self, points: &Points) -> Result<f64> {
        let prepared = self.prepare(points)?;
        let readings = prepared.readings_um();
        Ok(self.fit(&prepared, &[], &Content::declared(), &readings).chi2_per_dof)
    }

    /// What the model may lack.
    pub(crate) fn missing(&self) -> Vec<Missing> {
        missing(self.0.max_order)
    }

    /// Touches with angles and readings from the centres of the rings.
    pub(crate) fn prepare(&self, points: &Points) -> Result<Prepared> {
        let mut touches = Touches::new(points, &self.0)?;
        let mut weights = weights(&mut touches, &[]);
        let mut unlike = Vec::new();
        for pass in 0..RECENTRED {
            let prepared = Prepared { touches: touches.clone(), weights: weights.clone() };
            let fit = self.fit(&prepared, &[], &Content::declared(), &prepared.readings_um());
            if pass == 0 {
                self.has_enough(points, &prepared, &fit)?;
            }
            let moved = (0..self.0.setups.len()).map(|setup| {
                [0, 1].map(|axis| {
                    let place = fit.design.place(&Parameter::Centre { setup, axis });
                    place
                        .filter(|place| fit.is_observable(&[*place]))
                        .map_or(0.0, |place| fit.solved.coefficients[place])
                })
            });
            touches.recentre(&moved.collect::<Vec<_>>());
            unlike = fit.unlike.map_or_else(Vec::new, |unlike| unlike.rows);
        }
        // Repeats scatter by what a displaced centre leaves of the directions' differences.
        let remarks = touches.remarks.len();
        weights.clone_from(&crate::noise::weights(&mut touches, &unlike));
        touches.remarks.truncate(remarks);
        Ok(Prepared { touches, weights })
    }

    pub(crate) fn fit(
        &self,
        prepared: &Prepared,
        missing: &[Missing],
        content: &Content,
        readings_um: &[f64],
    ) -> Fitted {
        let all: Vec<usize> = (0..readings_um.len()).collect();
        let design = Design::new(&self.0, &prepared.touches, missing, content);
        let mut fit = design.fit(readings_um, &prepared.weights, &all);
        fit.set_apart(&prepared.weights, &all);
        fit
    }

    fn has_enough(&self, points: &Points, prepared: &Prepared, fit: &Fitted) -> Result<()> {
        let count = prepared.touches.all.len();
        let orders = 2..=self.0.max_order;
        let is_observable =
            |order: usize| fit.design.pair(lobing_order, order).is_some_and(|places| fit.is_observable(&places));
        if orders.clone().any(is_observable) && fit.solved.dof > 0 {
            return Ok(());
        }
        let highest = self.0.max_order;
        let mut problem =
            format!("{count} touches do not determine orders up to {highest} and the centring of each setup");
        for remark in &prepared.touches.remarks {
            problem = format!("{problem}; {remark}");
        }
        let help = format!(
            "a setup needs at least {} directions all around for orders up to {highest}; `max_order` lowers it",
            2 * highest + 1
        );
        Err(Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData).help(help))
    }

    /// The result of a fit with more than is declared.
    pub(crate) fn fitted_outcome(
        &self,
        prepared: &Prepared,
        missing: &[Missing],
        content: &Content,
        readings_um: &[f64],
    ) -> Result<(Fitted, Outcome)> {
        let mut fit = self.fit(prepared, missing, content, readings_um);
        let Prepared { touches, weights } = prepared;
        let checks = fit.judge(&self.0, touches, weights);
        let ranges = ranges(&self.0, touches, missing, content, readings_um, weights);
        let mut outcome = TouchSolution { config: &self.0, touches, fit: &fit, weights, ranges }.outcome()?;
        outcome.checks = checks;
        Ok((fit, outcome.refuted()))
    }
}
