//! What is said of a part that turns far off the axis, and what it makes of noise.

use std::f64::consts::FRAC_1_SQRT_2;

use runout_core::{
    Complex64, Error, ErrorKind,
    draws::{Draw, seed},
    numerics::number::significant,
    stage::Station,
};

use super::{Estimate, Operators, Readings, Solver};

/// From this eccentricity on, as a share of the radius, stated uncertainties lack what badly determined orders carry into others.
const LARGE: f64 = 0.015;
/// No part is clamped so far off centre, as a share of its radius.
pub(super) const FAR_OFF: f64 = 0.1;

/// The highest order times eccentricity over radius from which on what orders carry into each other is a large part of them.
const STRONG: f64 = 0.8;
/// Draws of the readings' noise there, orders to each side that are taken together, and by how much more the variance is to be than order by order.
const DRAWS: usize = 4;
const ORDERS_BESIDE: usize = 2;
const LARGER: f64 = 1.5;

impl Solver<'_> {
    /// By how much the variance of each order from 1 is larger than order by order, where the eccentricity couples the orders: noise is added to the
    /// readings, they are solved again, and what changes is compared with what each order's own solution makes of that noise. `None` where orders
    /// hardly couple, or the noise is not known.
    pub(crate) fn coupled_noise(
        &self,
        readings: &Readings,
        operators: &Operators,
        estimate: &Estimate,
    ) -> Option<Vec<f64>> {
        let share = self.eccentricity_um(readings) / (1e3 * self.layout.part_radius_mm);
        let setups = readings.covariance.as_ref()?;
        if !self.second_order || share * (readings.max_order as f64) < STRONG {
            return None;
        }
        let sensors = readings.count / setups.len().max(1);
        let std_um = |order: usize, reading: usize| {
            let matrix = order * sensors * sensors + reading % sensors * (sensors + 1);
            setups[reading / sensors].get(matrix).map_or(0.0, |variance| variance.re.max(0.0).sqrt())
        };
        let (width, orders) = (self.layout.unknowns.len(), readings.max_order);
        let mut squares = vec![[0.0; 2]; orders + 1];
        for draw in 0..DRAWS {
            let mut random = Draw::new(seed(&["coupled orders", &draw.to_string()]));
            let noise: Vec<Complex64> = (0..readings.mean.len())
                .map(|place| {
                    let of = FRAC_1_SQRT_2 * std_um(place / readings.count, place % readings.count);
                    of * Complex64::new(random.normal(), random.normal())
                })
                .collect();
            let mut noisy = readings.clone();
            noisy.mean.iter_mut().zip(&noise).for_each(|(reading, noise)| *reading += noise);
            let (again, _) = self.iterate(&noisy, operators, |_, _| {});
            let alone = self.estimate(operators, &noise, orders);
            for order in 2..=orders {
                for unknown in 0..width {
                    let [again, alone, before] =
                        [&again, &alone, estimate].map(|one| one.observable_value(order, unknown));
                    squares[order][0] += (again - before).norm_sqr();
                    squares[order][1] += alone.norm_sqr();
                }
            }
        }
        let factor = |order: usize| {
            let near = &squares[order.saturating_sub(ORDERS_BESIDE)..=(order + ORDERS_BESIDE).min(orders)];
            let [coupled, alone] = near.iter().fold([0.0; 2], |[a, b], one| [a + one[0], b + one[1]]);
            if coupled > LARGER * alone && alone > 0.0 { coupled / alone } else { 1.0 }
        };
        Some((1..=orders).map(factor).collect())
    }

    /// Where exact geometry does not settle.
    pub(super) fn unsettled(&self, station: &Station, readings: &Readings, estimate: &Estimate) -> Error {
        let (eccentricity_um, radius_mm) = (self.eccentricity_um(readings), self.layout.part_radius_mm);
        let ratio = format!("an eccentricity of {eccentricity_um:.0} µm on a radius of {radius_mm} mm");
        let check = "check part_radius_mm and the unit of the readings";
        let (problem, help) = if eccentricity_um > FAR_OFF * 1e3 * radius_mm {
            (format!("{ratio} is more than exact geometry is solved for"), check)
        } else if estimate.moved_um.is_finite() {
            let moved_um = estimate.moved_um;
            let problem = format!(
                "{ratio} couples the orders so strongly that no solution settles: the last pass still moves the readings \
                 by {} µm rms",
                significant(moved_um, 2)
            );
            let help = "centre the part better, or average on fewer angles (samples_per_rev): the coupling grows with the order";
            (problem, help)
        } else {
            let problem = format!("{ratio}: sensors' lines do not meet the part, and the result is no number");
            (problem, check)
        };
        Error::new("separate", format!("station {}", station.name), problem).of(ErrorKind::Numerical).help(help)
    }

    /// What the stated uncertainty of order by order lacks where the eccentricity is large.
    pub(super) fn far_off_centre(&self, readings: &Readings) -> Option<String> {
        let (eccentricity_um, radius_mm) = (self.eccentricity_um(readings), self.layout.part_radius_mm);
        let is_large = self.second_order && eccentricity_um > LARGE * 1e3 * radius_mm;
        is_large.then(|| {
            // Stations that are alike are to say the same.
            let share = 100.0 * LARGE;
            format!(
                "the eccentricity is above {share} % of the radius of {radius_mm} mm and couples neighbouring orders: an order that the layout \
                 determines badly carries its error into those beside it, and their stated uncertainties do not include that; centre \
                 the part better"
            )
        })
    }
}
