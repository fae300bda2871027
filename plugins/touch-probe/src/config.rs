//! `[separate] plugin = "touch-probe"`, and what its setups can separate.

use runout_core::fault::{Fault, within};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[separate] plugin = "touch-probe"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TouchProbeConfig {
    /// Calibrated radius of the ring, in mm. Its error goes into the mean pre-travel one to one.
    pub ring_radius_mm: f64,
    /// How the ring and the probe were turned, one entry a setup.
    pub setups: Vec<SetupConfig>,
    /// Highest order of lobing and of ring form, in undulations per revolution.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
    /// Bound of the ring's form, peak-to-valley, in µm: of the orders that the setups cannot separate from lobing. Needed where
    /// they separate none. Lobing of these orders is then what is read, and its uncertainty includes the bound.
    #[serde(default)]
    pub ring_form_um: Option<f64>,
    /// Standard uncertainty of one touch, in µm. Without it: of the column `std_um`, else from repeats, else from the residual.
    #[serde(default)]
    pub std_um: Option<f64>,
}

/// A setup: how the ring and the probe were turned, against the nominal position, right-handed about the axis of the ring.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupConfig {
    /// Its id, as in the column `setup`.
    pub id: String,
    /// Angle by which the ring is turned on the table, in degrees.
    #[serde(default)]
    pub ring_deg: f64,
    /// Angle by which the probe is turned in the spindle, in degrees.
    #[serde(default)]
    pub probe_deg: f64,
}

fn default_max_order() -> usize {
    15
}

const HIGHEST_ORDER: usize = 60;
/// Setups of which the relative angle differs by less than 1.1°, times the order, from whole turns do not separate an order:
/// |1 − e^{inΔ}| is below this. Setting angles are not known better, and noise would be amplified 70 times.
const INSEPARABLE: f64 = 0.02;

impl TouchProbeConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn checked(&self) -> Result<(), Fault> {
        let positive = |key: &str, what: &str, unit: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(Fault::at(key, format!("{what} must be above 0 {unit}, found {value}")))
        };
        positive("ring_radius_mm", "the radius", "mm", self.ring_radius_mm)?;
        if let Some(std_um) = self.std_um {
            positive("std_um", "the uncertainty", "µm", std_um)?;
        }
        if let Some(bound_um) = self.ring_form_um
            && !(bound_um.is_finite() && bound_um >= 0.0)
        {
            return Err(Fault::at("ring_form_um", format!("the bound must be 0 µm or above, found {bound_um}")));
        }
        within("max_order", "an order", self.max_order, 2..=HIGHEST_ORDER)?;
        if self.setups.is_empty() {
            return Err(Fault::at("setups", "there is none: declare each with its id and its angles"));
        }
        for (index, setup) in self.setups.iter().enumerate() {
            let here = |key: &str, problem: String| Fault::at(key, problem).under_item("setups", index);
            if setup.id.is_empty() {
                return Err(here("id", "expected a name".into()));
            }
            if self.setups[..index].iter().any(|other| other.id == setup.id) {
                return Err(here("id", format!("two setups are named `{}`", setup.id)));
            }
            for (key, angle) in [("ring_deg", setup.ring_deg), ("probe_deg", setup.probe_deg)] {
                if !angle.is_finite() {
                    return Err(here(key, format!("expected an angle, found {angle}")));
                }
            }
        }
        let all: Vec<usize> = (0..self.setups.len()).collect();
        if self.ring_form_um.is_none() && !(2..=self.max_order).any(|order| self.separates(&all, order)) {
            let problem = "these setups separate no order of lobing from the form of the ring: declare a bound of that form, \
                           peak-to-valley";
            let help = "or measure again with the ring, or the probe in the spindle, turned by 100°";
            return Err(Fault::at("ring_form_um", problem).help(help));
        }
        Ok(())
    }

    /// Whether setups (indices) separate lobing of an order from form of the ring.
    ///
    /// A setup reads L·e^{−inπ} + F·e^{−inρ} at probe angle π and ring angle ρ: two setups separate both unless n times the
    /// difference of their ρ − π is whole turns.
    pub(crate) fn separates(&self, setups: &[usize], order: usize) -> bool {
        let relative = |setup: &usize| {
            let SetupConfig { ring_deg, probe_deg, .. } = &self.setups[*setup];
            (ring_deg - probe_deg).to_radians()
        };
        let apart = |one: f64, other: f64| 2.0 * (0.5 * order as f64 * (one - other)).sin().abs();
        setups.iter().any(|one| setups.iter().any(|other| apart(relative(one), relative(other)) > INSEPARABLE))
    }

    /// Orders from 2 up to `highest` that setups do not separate.
    pub(crate) fn lost(&self, setups: &[usize]) -> Vec<usize> {
        (2..=self.max_order).filter(|order| !self.separates(setups, *order)).collect()
    }

    /// Relative angles of ring and probe that differ: with two there is nothing redundant.
    pub(crate) fn positions(&self) -> usize {
        let mut relative: Vec<f64> =
            self.setups.iter().map(|setup| (setup.ring_deg - setup.probe_deg).rem_euclid(360.0)).collect();
        relative.sort_by(f64::total_cmp);
        relative.dedup_by(|one, other| (*one - *other).abs() < 0.1);
        relative.len()
    }
}

/// Numbers as people list them, runs of more than two as "2-15".
pub(crate) fn listed(orders: &[usize]) -> String {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for order in orders {
        match runs.last_mut() {
            Some(run) if run[1] + 1 == *order => run[1] = *order,
            _ => runs.push([*order, *order]),
        }
    }
    let one = |[from, to]: &[usize; 2]| match to - from {
        0 => format!("{from}"),
        1 => format!("{from}, {to}"),
        _ => format!("{from}-{to}"),
    };
    if runs.is_empty() { "none".into() } else { runs.iter().map(one).collect::<Vec<_>>().join(", ") }
}

/// Lost orders, in words.
pub(crate) fn lost_orders(lobing: &str, form: &str) -> String {
    format!("lost orders of lobing: {lobing}; of the form of the ring: {form}")
}
