//! A formula in Python that separates form from motion, one linear operator an order.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::{Complex64, PyArray1, PyArray3, PyArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*};
use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::foresight::Foresight,
    effects::EffectCatalogue,
    fault::Fault,
    pipeline::Context,
    rig::Rig,
    separation::{Assessment, Sensitivity, Separation},
    spread::Projection,
    stage::{Station, StationModel, StationSeparator},
};
use runout_spindle::{
    layout,
    separators::{ClosedForm, ClosedFormSeparator, MethodConfig},
};

use super::{Object, numbers};

/// The lowest order that a formula is asked for: order 1 follows the rule of 1/rev.
const FIRST_ORDER: usize = 2;

/// What a formula gets: the rig as it reads form and motion.
#[pyclass(frozen, get_all, module = "runout._native")]
pub(crate) struct Layout {
    /// Orders that are asked for, ascending from 2.
    orders: Py<PyArray1<i64>>,
    /// What is solved for: quantity, and the section of a form.
    unknowns: Vec<(&'static str, Option<String>)>,
    /// Of each reading, the id of its sensor.
    sensors: Vec<String>,
    /// Of each reading, the id of its setup.
    setups: Vec<String>,
    /// Of each reading, the id of its section.
    sections: Vec<String>,
    /// Direction in which each reading looks, in rad.
    angle_rad: Py<PyArray1<f64>>,
    /// Angle of the part that each reading sees at spindle angle 0, in rad.
    part_angle_rad: Py<PyArray1<f64>>,
    /// z of each reading less the mean over the sensors, in mm.
    lever_mm: Py<PyArray1<f64>>,
    /// +1 where the part turns counter-clockwise, else −1.
    direction: f64,
    /// Readings = matrix · unknowns, `[order, reading, unknown]`.
    matrix: Py<PyArray3<Complex64>>,
}

impl Layout {
    fn new(py: Python<'_>, layout: &layout::Layout, rig: &Rig, max_order: usize) -> PyResult<Self> {
        let readings = &layout.readings;
        let section = |index: usize| rig.sections[index].clone();
        let of = |value: fn(&layout::Reading) -> f64| PyArray1::from_iter(py, readings.iter().map(value)).unbind();
        let names = |name: &dyn Fn(&layout::Reading) -> String| readings.iter().map(name).collect();
        let orders = FIRST_ORDER..=max_order;
        let entries: Vec<Complex64> = orders.clone().flat_map(|order| layout.matrix(order)).collect();
        let shape = [orders.clone().count(), readings.len(), layout.unknowns.len()];
        Ok(Self {
            orders: PyArray1::from_iter(py, orders.map(|order| order.cast_signed() as i64)).unbind(),
            unknowns: layout.unknowns.iter().map(|one| (one.id(), one.section().map(section))).collect(),
            sensors: names(&|one| rig.sensors[one.sensor].id.clone()),
            setups: names(&|one| rig.setups[one.setup].id.clone()),
            sections: names(&|one| section(one.section)),
            angle_rad: of(|one| one.angle_rad),
            part_angle_rad: of(|one| one.part_angle_rad),
            lever_mm: of(|one| one.lever_mm),
            direction: layout.direction,
            matrix: PyArray1::from_vec(py, entries).reshape(shape)?.unbind(),
        })
    }
}

/// The operators that a formula gave.
struct Answered {
    /// `[order][unknown][reading]` from order 2; rows that are not given are those of least squares.
    operators: Vec<Vec<Complex64>>,
    /// Whether the formula gives an unknown, `[order][unknown]`.
    given: Vec<Vec<bool>>,
}

impl Answered {
    fn at<T>(all: &[T], order: usize) -> Option<&T> {
        all.get(order.checked_sub(FIRST_ORDER)?)
    }

    /// Whether the formula gives an unknown; orders below 2 are not its own.
    fn gives(&self, order: usize, unknown: usize) -> bool {
        Self::at(&self.given, order).is_none_or(|given| given[unknown])
    }
}

/// A formula for one rig.
struct Formula {
    object: Arc<Object>,
    layout: layout::Layout,
    rig: Rig,
    found: Mutex<Arc<Answered>>,
}

impl Formula {
    /// Its operators to an order; asked for again only when a higher order is wanted than before.
    fn found(&self, max_order: usize) -> Option<Arc<Answered>> {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        if found.operators.len() + FIRST_ORDER <= max_order {
            *found = Arc::new(self.object.ask(|py, plugin| self.call(py, plugin, max_order))?);
        }
        Some(Arc::clone(&found))
    }

    fn call(&self, py: Python<'_>, plugin: &Bound<'_, PyAny>, max_order: usize) -> PyResult<Answered> {
        let method = format!("{}.operator", self.object.name);
        let returned = plugin.call_method1("operator", (Layout::new(py, &self.layout, &self.rig, max_order)?,))?;
        let (unknowns, readings) = (self.layout.unknowns.len(), self.layout.readings.len());
        let shape = [max_order + 1 - FIRST_ORDER, unknowns, readings];
        let array = numbers(&returned, &method, "[order, unknown, reading]", &shape)?;
        let mut found = Answered { operators: Vec::with_capacity(shape[0]), given: Vec::with_capacity(shape[0]) };
        for (order, own) in (FIRST_ORDER..).zip(array.as_slice()?.chunks(unknowns * readings)) {
            if own.iter().any(|entry| entry.re.is_infinite() || entry.im.is_infinite()) {
                let problem = format!(
                    "{method}: expected finite numbers, or NaN for what is not given; order {order} has infinity"
                );
                return Err(PyValueError::new_err(problem));
            }
            let mut operator = own.to_vec();
            let given: Vec<bool> = own.chunks(readings).map(|row| !row.iter().any(|entry| entry.is_nan())).collect();
            if given.contains(&false) {
                // Exact geometry and the residual need all of them.
                let general = self.layout.factor(order).operator();
                for (row, _) in given.iter().enumerate().filter(|(_, given)| !**given) {
                    let row = row * readings..(row + 1) * readings;
                    operator[row.clone()].copy_from_slice(&general[row]);
                }
            }
            found.given.push(self.with_tilts(given));
            found.operators.push(operator);
        }
        Ok(found)
    }

    /// A displacement is reported at the spindle's reference: without the tilt that changes it along z it is not known there.
    fn with_tilts(&self, mut given: Vec<bool>) -> Vec<bool> {
        for (shift, quantity) in self.layout.unknowns.iter().enumerate() {
            let tilt = quantity.moved_by_tilt();
            let tilt = tilt.and_then(|(tilt, _)| self.layout.unknowns.iter().position(|unknown| *unknown == tilt));
            given[shift] &= tilt.is_none_or(|tilt| given[tilt]);
        }
        given
    }

    fn failure(&self, operation: &'static str, station: &Station) -> Error {
        let problem = format!("the code of `{}` raised an exception", self.object.name);
        Error::new(operation, format!("station {}", station.name), problem).of(ErrorKind::Interrupted)
    }
}

/// The formula as the separators' crate takes it.
struct Shared(Arc<Formula>);

impl ClosedForm for Shared {
    fn operator(&self, _layout: &layout::Layout, order: usize) -> Option<Vec<Complex64>> {
        Answered::at(&self.0.found(order)?.operators, order).cloned()
    }
}

/// A separator whose formula is a Python object.
pub(crate) struct OwnSeparator {
    solving: ClosedFormSeparator,
    formula: Arc<Formula>,
}

impl OwnSeparator {
    /// For the rig of a pipeline.
    ///
    /// # Errors
    /// When a key has a value that cannot be, or no formula takes the rig.
    pub(crate) fn new(
        config: &MethodConfig<Object>,
        context: &Context,
        object: &Arc<Object>,
    ) -> std::result::Result<Self, Fault> {
        let mut formula = None;
        let solving = config.build(context, object.name, |rig, layout| {
            let found = Mutex::new(Arc::new(Answered { operators: Vec::new(), given: Vec::new() }));
            let made = Formula { object: Arc::clone(object), layout: layout.clone(), rig: rig.clone(), found };
            let made = formula.insert(Arc::new(made));
            Ok(Box::new(Shared(Arc::clone(made))))
        })?;
        let formula = formula.ok_or_else(|| Fault::here("the separator was not built"))?;
        Ok(Self { solving, formula })
    }

    fn found(&self, operation: &'static str, station: &Station) -> Result<Arc<Answered>> {
        let max_order = station.profiles.iter().map(runout_core::profile::Profile::max_order).max().unwrap_or_default();
        self.formula.found(max_order).ok_or_else(|| self.formula.failure(operation, station))
    }
}

impl StationSeparator for OwnSeparator {
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault> {
        let raised = || Fault::at("plugin", format!("the code of `{}` raised an exception", self.formula.object.name));
        let found = self.formula.found(max_order).ok_or_else(raised)?;
        let mut assessment = self.solving.assess(max_order)?;
        let (layout, readings) = (&self.formula.layout, self.formula.layout.readings.len());
        for assessed in &mut assessment.orders {
            let Some(operator) = Answered::at(&found.operators, assessed.order) else { continue };
            let mut rows = operator.clone();
            layout.to_reference(layout.mean_z_mm).apply(&mut rows);
            for (unknown, row) in rows.chunks(readings).enumerate() {
                if !found.gives(assessed.order, unknown) && assessed.observable[unknown] {
                    assessed.observable[unknown] = false;
                    let quantity = layout.unknowns[unknown].id();
                    let because = || format!("the separator does not give {quantity} at {}/rev", assessed.order);
                    assessed.lost_because.get_or_insert_with(because);
                }
                let gain = row.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
                assessed.noise_gain[unknown] = if assessed.observable[unknown] { gain } else { f64::NAN };
            }
        }
        Ok(assessment)
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        let found = self.found("separate", station)?;
        let mut separation = self.solving.separate(station)?;
        let width = separation.unknowns.len();
        for index in 0..separation.estimate.len() {
            if !found.gives(index / width, index % width) {
                separation.estimate[index] = Complex64::new(f64::NAN, f64::NAN);
                separation.variance[index] = f64::NAN;
                separation.observable[index] = false;
            }
        }
        Ok(separation)
    }

    fn sensitivity(&self, station: &Station) -> Result<Option<Sensitivity>> {
        let found = self.found("compare", station)?;
        let Some(mut sensitivity) = self.solving.sensitivity(station)? else { return Ok(None) };
        let width = self.formula.layout.unknowns.len();
        for (index, row) in sensitivity.operator.chunks_mut(sensitivity.readings).enumerate() {
            if !found.gives(index / width, index % width) {
                row.fill(Complex64::ZERO);
            }
        }
        Ok(Some(sensitivity))
    }

    fn projection(&self, setup: usize) -> Option<Projection> {
        self.solving.projection(setup)
    }

    fn foresee(&self, effects: &EffectCatalogue) -> Option<Result<Foresight>> {
        self.solving.foresee(effects)
    }

    fn model(&self, effects: &EffectCatalogue) -> Option<Box<dyn StationModel>> {
        self.solving.model(effects)
    }
}
