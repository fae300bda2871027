//! What exact geometry carries out of orders that are lost, and out of the form of a face.
//!
//! A surface that moves laterally by t is seen turned by t/R: the reading gains −(t/R)·h'(α) (`docs/appendix/physics.md` section 1).
//! With an eccentricity C in part coordinates, t = −Im C e^{iα}, form H of order n appears at order n + 1 as n·C·H/(2R) and
//! at order n − 1 as −n·C*·H/(2R); motion of order n across the sensor carries form of order p to n + p and |n − p| in the same way. Form and
//! motion of a lost order are not known, so that this is not known either: it is part of the readings' uncertainty. The
//! readings themselves say how large they may be, since each reading is the sum of both.
//!
//! A face that moves laterally by t under an axial sensor at the radius ρ is seen turned by t/ρ in the same way. The separators solve
//! axial readings to first order, so that what the eccentricity carries between orders of a face is part of the readings'
//! uncertainty too, whether orders are lost or not.

use runout_core::Complex64;

use super::readings::Readings;
use crate::layout::{Layout, View};

/// Motion of higher orders is too small to matter.
const MOTION_ORDERS: usize = 256;

/// Adds the covariance of what lost orders carry into others to that of the readings.
pub(crate) fn widen(layout: &Layout, readings: &mut Readings) {
    if readings.covariance.is_none() && readings.scatter.is_none() {
        return;
    }
    let carried = Carried::new(layout, readings);
    let faces = layout.readings.iter().any(|reading| reading.view == View::Axial);
    if !faces && carried.lost.iter().all(|lost| !lost) {
        return;
    }
    let setups = readings.turns.len().max(1);
    let sensors = readings.count / setups;
    for order in 1..=readings.max_order {
        let by_motion = carried.by_motion(order);
        for setup in 0..setups {
            let block = carried.block(order, setup, sensors, by_motion);
            for matrices in [&mut readings.covariance, &mut readings.scatter].into_iter().flatten() {
                let size = sensors * sensors;
                let Some(target) =
                    matrices.get_mut(setup).and_then(|all| all.get_mut(order * size..(order + 1) * size))
                else {
                    continue;
                };
                target.iter_mut().zip(&block).for_each(|(entry, more)| *entry += more);
            }
        }
    }
}

/// What is known of a station before it is solved.
struct Carried<'a> {
    layout: &'a Layout,
    radius_um: f64,
    /// Whether an order (from 0) is lost.
    lost: Vec<bool>,
    /// Mean square of the readings, `[order][section]`: of form and motion together.
    squares: Vec<Vec<f64>>,
    /// Mean square of the axial readings, `[order][section]`: of a face's form and motion along the axis together.
    face_squares: Vec<Vec<f64>>,
    /// Mean square over all sections.
    mean: Vec<f64>,
    /// |C|² of each reading's section in its setup; of an axial reading that of all sections.
    eccentricity: Vec<f64>,
}

impl<'a> Carried<'a> {
    fn new(layout: &'a Layout, readings: &Readings) -> Self {
        let sections = layout.readings.iter().map(|reading| reading.section + 1).max().unwrap_or(0);
        let systems = layout.systems(readings.max_order);
        let is_lost =
            |order: usize| order > 1 && layout.circles().any(|(form, _)| !systems[order - 1].observable[form]);
        let looks = |index: usize, view: View| layout.readings[index].view == view;
        let mean_along = |order: usize, view: View, of: &dyn Fn(usize) -> bool| {
            let seen = readings.order(order).iter().enumerate().filter(|(index, _)| looks(*index, view) && of(*index));
            let (sum, count) = seen.fold((0.0, 0.0), |(sum, count), (_, value)| (sum + value.norm_sqr(), count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let mean_of = |order: usize, of: &dyn Fn(usize) -> bool| mean_along(order, View::Radial, of);
        let section = |index: usize| layout.readings[index].section;
        let setup = |index: usize| layout.readings[index].setup;
        let orders = 0..=readings.max_order;
        Self {
            layout,
            radius_um: 1e3 * layout.part_radius_mm,
            lost: orders.clone().map(is_lost).collect(),
            squares: orders
                .clone()
                .map(|order| (0..sections).map(|wanted| mean_of(order, &|index| section(index) == wanted)).collect())
                .collect(),
            face_squares: orders
                .clone()
                .map(|order| {
                    let of = |wanted| mean_along(order, View::Axial, &|index| section(index) == wanted);
                    (0..sections).map(of).collect()
                })
                .collect(),
            mean: orders.map(|order| mean_of(order, &|_| true)).collect(),
            eccentricity: (0..layout.readings.len())
                .map(|reading| {
                    let any = looks(reading, View::Axial);
                    mean_of(1, &|index| (any || section(index) == section(reading)) && setup(index) == setup(reading))
                })
                .collect(),
        }
    }

    /// Covariance of what an order of one setup's readings gains, `[sensor][sensor]`.
    fn block(&self, order: usize, setup: usize, sensors: usize, by_motion: f64) -> Vec<Complex64> {
        let mut block = vec![Complex64::ZERO; sensors * sensors];
        for row in 0..sensors {
            let (one, place) = (&self.layout.readings[setup * sensors + row], setup * sensors + row);
            if one.view == View::OnAxis {
                continue;
            }
            let by_form = match one.view {
                View::Axial => self.by_face(order, one.section, -1e3 * one.lever_mm),
                _ => self.by_form(order, one.section),
            };
            for column in 0..sensors {
                let other = &self.layout.readings[setup * sensors + column];
                if one.section != other.section {
                    continue;
                }
                let phases = self.layout.part_phase(one, order) * self.layout.part_phase(other, order).conj();
                block[row * sensors + column] += phases * (by_form * self.eccentricity[place]);
            }
            if one.view == View::Radial {
                block[row * (sensors + 1)] += by_motion;
            }
        }
        block
    }

    /// Variance that lost form carries to an order, per square of the eccentricity.
    fn by_form(&self, order: usize, section: usize) -> f64 {
        let from = |lost: usize| {
            let share = 0.5 * lost as f64 / self.radius_um;
            if self.is_lost(lost) { share * share * self.squares[lost][section] } else { 0.0 }
        };
        from(order - 1) + from(order + 1)
    }

    /// Variance that the form of a face carries to an order at a radius, per square of the eccentricity.
    fn by_face(&self, order: usize, section: usize, radius_um: f64) -> f64 {
        let from = |other: usize| {
            let share = 0.5 * other as f64 / radius_um;
            self.face_squares.get(other).map_or(0.0, |squares| share * share * squares[section])
        };
        let below = if order > 1 { from(order - 1) } else { 0.0 };
        below + from(order + 1)
    }

    /// Variance that lost motion carries to an order, with the form of all others.
    fn by_motion(&self, order: usize) -> f64 {
        let slope = |form: usize| self.mean.get(form).map_or(0.0, |square| (form * form) as f64 * square);
        let lost = (2..self.lost.len().min(MOTION_ORDERS)).filter(|motion| self.lost[*motion]);
        let square: f64 = lost
            .map(|motion| {
                let near = order.abs_diff(motion);
                let near = if near > 1 { slope(near) } else { 0.0 };
                self.mean[motion] * (near + slope(order + motion))
            })
            .sum();
        square / (2.0 * self.radius_um).powi(2)
    }

    fn is_lost(&self, order: usize) -> bool {
        self.lost.get(order).copied().unwrap_or(false)
    }
}
