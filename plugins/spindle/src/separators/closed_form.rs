//! What methods with a formula of their own share: their configuration, and the way from a formula to a separation.

use std::{f64::consts::TAU, marker::PhantomData};

use runout_core::{
    Complex64, Result,
    closed_loop::foresight::Foresight,
    effects::EffectCatalogue,
    fault::Fault,
    pipeline::{Context, StageConfig},
    rig::Rig,
    separation::{Assessment, Quantity, Sensitivity, Separation},
    spread::Projection,
    stage::{Separator, Station, StationModel, StationSeparator, require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    keys::{checked_gain, yes},
    station::separate,
};
use crate::{
    diagnose::DeclaredSpindle,
    layout::{Layout, UM_PER_MM_URAD},
    plan,
    selection::Selection,
    solve::{Operators, OrderOperator, Readings, Solver, projection},
};

/// Angles that differ by less are the same; what is off by more is for the general separator.
const ANGLE_TOLERANCE_RAD: f64 = 1e-9;

/// A formula for form and motion, one order at a time.
pub trait ClosedForm: Send + Sync {
    /// Unknowns = operator · readings at an order from 2, `[unknown][reading]`; `None` where the formula has a pole.
    fn operator(&self, layout: &Layout, order: usize) -> Option<Vec<Complex64>>;

    /// What the user should know before any data, besides what follows from the layout.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A method that a rig fits or not.
pub trait Method: ClosedForm + Sized + 'static {
    /// Its id.
    const NAME: &'static str;
    /// One line about it.
    const ABOUT: &'static str;
    /// Where the configuration gives no limit.
    const MAX_NOISE_GAIN: f64 = f64::INFINITY;

    /// Sensors and setups that it takes from a rig with more than it needs.
    fn choose(rig: &Rig) -> (Vec<usize>, Vec<usize>);

    /// For a rig.
    ///
    /// # Errors
    /// What it needs and the rig has not.
    fn new(rig: &Rig) -> std::result::Result<Self, String>;
}

/// Keys of a method with a formula of its own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "")]
#[schemars(bound = "")]
pub struct MethodConfig<M> {
    /// Sensors to use; without it, the first of the rig that the method can take.
    #[serde(default)]
    pub sensors: Option<Vec<String>>,
    /// Setups to use; without it, the first of the rig that the method can take.
    #[serde(default)]
    pub setups: Option<Vec<String>>,
    /// Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations.
    #[serde(default = "yes")]
    pub second_order: bool,
    /// An order is lost where form or motion would carry more than this many times the readings' noise, as near the
    /// zeros of a transfer function; without it, 30 for three-point, and no limit for the others.
    #[serde(default)]
    pub max_noise_gain: Option<f64>,
    /// Which method.
    #[serde(skip)]
    pub method: PhantomData<M>,
}

impl<M: Method> StageConfig for MethodConfig<M> {
    type Stage = Separator;

    const NAME: &'static str = M::NAME;
    const ABOUT: &'static str = M::ABOUT;

    fn check(self, context: &Context) -> std::result::Result<Separator, Fault> {
        let selection = self.selection(context, M::choose)?;
        let max_noise_gain = self.noise_limit(M::MAX_NOISE_GAIN)?;
        let separator = ClosedFormSeparator::of::<M>(selection, self.second_order, max_noise_gain)?;
        Ok(Separator::Stations(Box::new(separator)))
    }
}

impl<M> MethodConfig<M> {
    /// A formula that takes any sensors and setups, for those that are configured; `make` gets them and their layout.
    ///
    /// # Errors
    /// A key with a value that cannot be, a rig with sensors that no formula takes, and what `make` refuses.
    pub fn build(
        &self,
        context: &Context,
        name: &str,
        make: impl FnOnce(&Rig, &Layout) -> std::result::Result<Box<dyn ClosedForm>, Fault>,
    ) -> std::result::Result<ClosedFormSeparator, Fault> {
        let all = |rig: &Rig| ((0..rig.sensors.len()).collect(), (0..rig.setups.len()).collect());
        let selection = self.selection(context, all)?;
        takes_sensors(&selection.rig).map_err(|problem| refusal(name, &problem))?;
        let layout = Layout::new(&selection.rig, false).limited_to(self.noise_limit(f64::INFINITY)?);
        let method = make(&selection.rig, &layout)?;
        Ok(ClosedFormSeparator::new(selection, layout, self.second_order, method))
    }

    fn selection(
        &self,
        context: &Context,
        choose: impl FnOnce(&Rig) -> (Vec<usize>, Vec<usize>),
    ) -> std::result::Result<Selection, Fault> {
        Selection::named(require_rig(context.rig)?, self.sensors.as_deref(), self.setups.as_deref(), choose)
    }

    fn noise_limit(&self, usual: f64) -> std::result::Result<f64, Fault> {
        Ok(checked_gain(self.max_noise_gain)?.unwrap_or(usual))
    }
}

/// A method for one rig.
pub struct ClosedFormSeparator {
    selection: Selection,
    layout: Layout,
    second_order: bool,
    method: Box<dyn ClosedForm>,
}

impl ClosedFormSeparator {
    /// Any formula for the layout of a selection.
    #[must_use]
    pub fn new(selection: Selection, layout: Layout, second_order: bool, method: Box<dyn ClosedForm>) -> Self {
        Self { selection, layout, second_order, method }
    }

    /// One of the methods.
    ///
    /// # Errors
    /// When the selected part of the rig does not fit it.
    pub fn of<M: Method>(
        selection: Selection,
        second_order: bool,
        max_noise_gain: f64,
    ) -> std::result::Result<Self, Fault> {
        takes_sensors(&selection.rig).map_err(|problem| refusal(M::NAME, &problem))?;
        let method = M::new(&selection.rig).map_err(|problem| refusal(M::NAME, &problem))?;
        let layout = Layout::new(&selection.rig, false).limited_to(max_noise_gain);
        Ok(Self::new(selection, layout, second_order, Box::new(method)))
    }

    fn solver(&self) -> Solver<'_> {
        Solver { selection: &self.selection, layout: &self.layout, second_order: self.second_order }
    }

    fn operators(&self, readings: &Readings) -> Operators {
        // Order 1 follows the 1/rev rule, which is the general separator's.
        let general = Operators::least_squares(&self.layout, 1, None);
        let mut orders = general.orders;
        for order in 2..=readings.max_order {
            let qr = self.layout.factor(order);
            // A lost order still has a residual: any least-squares solution shows it.
            let operator = self.method.operator(&self.layout, order).unwrap_or_else(|| qr.operator());
            orders.push(OrderOperator { operator, rank: qr.rank() });
        }
        Operators { orders, systems: self.layout.systems(readings.max_order), weights: None }
    }
}

impl StationSeparator for ClosedFormSeparator {
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault> {
        let mut assessment = self.layout.assess(max_order);
        self.selection.note_unused(&mut assessment);
        assessment.notes.extend(self.method.notes());
        Ok(assessment)
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        separate(&self.solver(), station, |readings| self.operators(readings))
    }

    fn sensitivity(&self, station: &Station) -> Result<Option<Sensitivity>> {
        self.solver().sensitivity(station, |readings| self.operators(readings)).map(Some)
    }

    fn projection(&self, setup: usize) -> Option<Projection> {
        projection(&self.selection, &self.layout, setup)
    }

    fn foresee(&self, effects: &EffectCatalogue) -> Option<Result<Foresight>> {
        Some(plan::foresee(&self.selection, &self.layout, self.second_order, effects.of()))
    }

    fn model(&self, effects: &EffectCatalogue) -> Option<Box<dyn StationModel>> {
        let (selection, layout) = (self.selection.clone(), self.layout.clone());
        Some(Box::new(DeclaredSpindle::new(selection, layout, self.second_order, effects)))
    }
}

/// A rig that does not fit a method.
pub(super) fn refusal(method: &str, problem: &str) -> Fault {
    Fault::unfit(format!("{method} {problem}")).help("plugin = \"harmonic-least-squares\" takes any rig")
}

/// Whether a formula can take the sensors of a rig.
///
/// # Errors
/// Where one looks along the axis, or its form is declared.
pub(super) fn takes_sensors(rig: &Rig) -> std::result::Result<(), String> {
    if let Some(axial) = rig.sensors.iter().find(|sensor| sensor.axial_radius_mm.is_some()) {
        return Err(format!("cannot use the axial sensor `{}`: it takes sensors across the axis only", axial.id));
    }
    let declared = |sensor: &&runout_core::rig::Sensor| rig.form_bounds_um[sensor.section].is_some();
    match rig.sensors.iter().find(declared) {
        Some(sensor) => {
            let section = &rig.sections[sensor.section];
            Err(format!("finds the form of section `{section}` itself: it cannot take `form_um`"))
        }
        None => Ok(()),
    }
}

/// Whether two angles are the same direction.
pub(super) fn same_angle(angle_rad: f64, other_rad: f64) -> bool {
    let difference = (angle_rad - other_rad).rem_euclid(TAU);
    difference.min(TAU - difference) < ANGLE_TOLERANCE_RAD
}

/// Motion along a direction, as a row over the readings, in a section at a lever from the sensors' mean z.
pub(super) struct SectionMotion {
    pub lever_mm: f64,
    pub row: Vec<Complex64>,
}

/// Adds to an operator what motion along a direction (cos, sin) in one or two sections says of shift and tilt.
///
/// With m = shift + z·tilt in each of two sections, tilt = (m_b − m_a)/L and shift = (z_b m_a − z_a m_b)/L.
pub(super) fn add_motion(operator: &mut [Complex64], layout: &Layout, along: [f64; 2], sections: &[SectionMotion]) {
    let count = layout.readings.len();
    let [cosine, sine] = along;
    // A motion m along the direction is m·(cos, sin) in (x, y), and what of that is along an unknown's own direction; a tilt e
    // towards it is e·(−sin, cos) in the tilts about (x, y).
    let share = |quantity: &Quantity| -> f64 {
        quantity.cartesian().into_iter().zip([cosine, sine, -sine, cosine]).map(|(own, part)| own * part).sum()
    };
    let mut add = |of: fn(Quantity) -> bool, factor: f64, row: &[Complex64]| {
        for (unknown, quantity) in layout.unknowns.iter().enumerate().filter(|(_, quantity)| of(**quantity)) {
            let target = &mut operator[unknown * count..(unknown + 1) * count];
            let share = factor * share(quantity);
            target.iter_mut().zip(row).for_each(|(entry, reading)| *entry += reading * share);
        }
    };
    match sections {
        [near, far] => {
            let distance_mm = far.lever_mm - near.lever_mm;
            for (section, shift_mm, sign) in [(near, far.lever_mm, -1.0), (far, -near.lever_mm, 1.0)] {
                add(Quantity::is_shift, shift_mm / distance_mm, &section.row);
                add(Quantity::is_tilt, sign / (distance_mm * UM_PER_MM_URAD), &section.row);
            }
        }
        sections => {
            for section in sections {
                add(Quantity::is_shift, 1.0, &section.row);
            }
        }
    }
}

/// The sensors of the first two sections at different z that `count` sensors or more look at.
pub(super) fn sections_with(rig: &Rig, count: usize) -> Vec<Vec<usize>> {
    let of = |section: usize| -> Vec<usize> {
        let radial = |sensor: &usize| rig.sensors[*sensor].axial_radius_mm.is_none();
        (0..rig.sensors.len()).filter(radial).filter(|sensor| rig.sensors[*sensor].section == section).collect()
    };
    let mut chosen: Vec<Vec<usize>> = Vec::new();
    for sensors in (0..rig.sections.len()).map(of).filter(|sensors| sensors.len() >= count) {
        let z_mm = |sensors: &[usize]| sensors.first().map_or(f64::NAN, |sensor| rig.sensors[*sensor].z_mm);
        let elsewhere = |known: &Vec<usize>| (z_mm(known) - z_mm(&sensors)).abs() > f64::EPSILON;
        if chosen.len() < 2 && chosen.iter().all(elsewhere) {
            chosen.push(sensors);
        }
    }
    chosen
}
