//! One station solved: the operators of all orders, what exact geometry adds, and passes until both agree.

mod far_off;

use runout_core::{
    Complex64, Result,
    profile::Profile,
    separation::{Quantity, Sensitivity, Separation},
    stage::Station,
};

use super::{
    algebra::apply,
    estimate::Estimate,
    joint::Joint,
    leak,
    operators::Operators,
    propagation::Propagation,
    readings::Readings,
    residual::{by_reading, judged_residual},
    second_order::{COUPLED, SecondOrder},
    weights,
};
use crate::{
    layout::{FirstOrder, Layout},
    selection::Selection,
};

/// Three passes settle the second order; more are allowed for large eccentricities.
const MAX_PASSES: usize = 8;
/// Orders to each side that say how large form and motion may be at a lost one.
const BESIDE: usize = 3;
/// What the unseen motion may carry into other orders is said in these standard uncertainties.
const CARRIED: [f64; 8] = [3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e5];
/// Passes end when the readings move less than this, rms.
const SETTLED_UM: f64 = 1e-9;
/// Orders one by one are given up when they still move more than this after all passes.
const APART_UM: f64 = 1e-6;
/// Passes of all orders together, at most.
const JOINT_PASSES: usize = 30;
/// They end where so many in a row move the readings no less than one before.
const PASSES_IN_VAIN: usize = 3;
/// Form or motion of an order above so many times its readings is not what they show.
const CANCELLING: f64 = 30.0;

/// Solves one station.
pub(crate) struct Solver<'a> {
    pub selection: &'a Selection,
    pub layout: &'a Layout,
    pub second_order: bool,
}

impl Solver<'_> {
    /// Separates a station with the operators that `method` makes for its readings, and gives the readings.
    ///
    /// # Errors
    /// When the station's profiles do not fit the rig.
    pub(crate) fn separate(
        &self,
        station: &Station,
        method: impl FnOnce(&Readings) -> Operators,
    ) -> Result<(Separation, Readings)> {
        let mut readings = Readings::gather(self.selection, self.layout, station)?;
        weights::smooth_by_order(&mut readings);
        if self.second_order {
            leak::widen(self.layout, &mut readings);
        }
        let operators = method(&readings);
        let (estimate, linear) = self.iterate(&readings, &operators, |_, _| {});
        let beyond = self.eccentricity_um(&readings) > far_off::FAR_OFF * 1e3 * self.layout.part_radius_mm;
        if self.second_order && beyond || self.couples(&readings) && estimate.is_unsettled() {
            return Err(self.unsettled(station, &readings, &estimate));
        }
        let mut propagation = Propagation::of(&readings, &operators);
        let (mut residual, mut factors) = judged_residual(&operators, &readings, &linear, propagation.as_ref());
        let coupled = self.coupled_noise(&readings, &operators, &estimate).unwrap_or_default();
        factors.iter_mut().zip(coupled).for_each(|(factor, coupled)| *factor *= coupled);
        residual.by_reading = by_reading(&operators, &readings, &linear);
        if readings.has_more_than_noise() {
            readings.add_more_than_noise();
            propagation = Propagation::of(&readings, &operators);
        }
        propagation.iter_mut().for_each(|propagation| propagation.times(&factors));
        let mut separation = self.report(station, &operators, &estimate, propagation.as_ref(), residual);
        let carried = self.second_order.then(|| self.carried(&readings, &separation)).flatten();
        separation.warnings.extend(carried);
        separation.warnings.extend(self.far_off_centre(&readings));
        Ok((separation, readings))
    }

    /// What a large eccentricity carries into orders that are observable, of what is not: a surface that moves laterally by e turns
    /// under the sensor by e/R, and order n is then seen by n·e/R of its amplitude one order lower and higher.
    fn carried(&self, readings: &Readings, separation: &Separation) -> Option<String> {
        let width = separation.unknowns.len();
        let eccentricity_um = self.eccentricity_um(readings);
        let share = eccentricity_um / (1e3 * self.layout.part_radius_mm);
        let sees = |wanted| self.layout.unknowns.contains(&wanted);
        // What lost orders carry is in the readings' uncertainty.
        if sees(Quantity::X) && sees(Quantity::Y) {
            return None;
        }
        let mut worst: f64 = 0.0;
        for (unknown, _) in self.layout.circles() {
            let at = |order: usize| order * width + unknown;
            let observable =
                |order: &usize| (2..=readings.max_order).contains(order) && separation.observable[at(*order)];
            for order in 2..=readings.max_order {
                if !observable(&order) {
                    continue;
                }
                let amplitude_um = separation.estimate[at(order)].norm();
                for near in [order - 1, order + 1].iter().filter(|near| observable(near)) {
                    let ratio = 0.5 * order as f64 * share * amplitude_um / separation.variance[at(*near)].sqrt();
                    worst = worst.max(ratio);
                }
            }
        }
        // The estimate is good to a size, and stations that are alike are to say the same.
        let times = CARRIED.into_iter().rfind(|times| worst >= *times)?;
        Some(format!(
            "lateral motion is not observable with these sensors, and an eccentricity of {eccentricity_um:.0} µm couples it into other \
             orders of form: some may be off by {times} times their stated uncertainty or more, and motion with them; centre the part better"
        ))
    }

    /// Solves, adds what exact geometry and `beyond` add to linear readings at that solution, and solves again until it
    /// settles. Gives the solution and the linear readings, `[order][reading]`.
    pub(crate) fn iterate(
        &self,
        readings: &Readings,
        operators: &Operators,
        mut beyond: impl FnMut(&Estimate, &mut [Complex64]),
    ) -> (Estimate, Vec<Complex64>) {
        let mut estimate = self.estimate(operators, &readings.mean, readings.max_order);
        let mut linear = readings.mean.clone();
        let mut geometry = self
            .second_order
            .then(|| SecondOrder::new(self.layout, readings.samples_per_rev, self.eccentricity_um(readings)));
        let mut excess = vec![Complex64::ZERO; readings.mean.len()];
        let rms = |squares: f64| (0.5 * squares / readings.count as f64).sqrt();
        let coupled = self.couples(readings);
        for _ in 0..MAX_PASSES {
            match &mut geometry {
                Some(geometry) => geometry.excess(&estimate, &mut excess),
                None => excess.fill(Complex64::ZERO),
            }
            beyond(&estimate, &mut excess);
            let (mut moved, before) = (0.0, estimate.moved_um);
            for ((linear, reading), excess) in linear.iter_mut().zip(&readings.mean).zip(&excess) {
                let corrected = reading - excess;
                moved += (corrected - *linear).norm_sqr();
                *linear = corrected;
            }
            if moved == 0.0 {
                break;
            }
            estimate = self.estimate(operators, &linear, readings.max_order);
            estimate.moved_um = rms(moved);
            let grows = coupled && before > 0.0 && estimate.moved_um > before;
            if estimate.moved_um < SETTLED_UM || (grows && estimate.moved_um > APART_UM) {
                break;
            }
        }
        match geometry {
            Some(geometry) if coupled && estimate.moves_more_than(APART_UM) => {
                self.together(readings, operators, geometry, beyond)
            }
            _ => (estimate, linear),
        }
    }

    /// Whether the eccentricity takes the highest order to the orders beside it by so much that they do not settle one by
    /// one.
    fn couples(&self, readings: &Readings) -> bool {
        let share = self.eccentricity_um(readings) / (1e3 * self.layout.part_radius_mm);
        self.second_order && share * readings.max_order as f64 > COUPLED
    }

    /// Solves all orders together, pass by pass, until the solution settles. Gives the solution and the linear readings, `[order][reading]`.
    fn together(
        &self,
        readings: &Readings,
        operators: &Operators,
        mut geometry: SecondOrder,
        mut beyond: impl FnMut(&Estimate, &mut [Complex64]),
    ) -> (Estimate, Vec<Complex64>) {
        let count = readings.count;
        // Readings of which each order's own solution is the estimate.
        let mut own = readings.mean.clone();
        let mut linear = own.clone();
        let mut estimate = self.estimate(operators, &own, readings.max_order);
        let mut excess = vec![Complex64::ZERO; own.len()];
        let mut least_um = f64::INFINITY;
        let mut in_vain = 0;
        for _ in 0..JOINT_PASSES {
            geometry.excess(&estimate, &mut excess);
            let mut joint = Joint::new(self.layout, operators, readings.samples_per_rev, geometry.met_rad());
            beyond(&estimate, &mut excess);
            linear.iter_mut().zip(&readings.mean).zip(&excess).for_each(|((linear, reading), excess)| {
                *linear = reading - excess;
            });
            let mut left = linear.clone();
            left[..count].fill(Complex64::ZERO);
            for (index, (order, system)) in operators.orders.iter().zip(&operators.systems).enumerate() {
                let row = (index + 1) * count..(index + 2) * count;
                let fitted = apply(&system.matrix, &apply(&order.operator, &own[row.clone()]));
                left[row].iter_mut().zip(fitted).for_each(|(left, fitted)| *left -= fitted);
            }
            let change = joint.solve(&left);
            own.iter_mut().zip(&change).for_each(|(own, change)| *own += change);
            estimate = self.estimate(operators, &own, readings.max_order);
            let moved = change.iter().map(Complex64::norm_sqr).sum::<f64>();
            estimate.moved_um = (0.5 * moved / count as f64).sqrt();
            in_vain = if estimate.moved_um < least_um { 0 } else { in_vain + 1 };
            least_um = least_um.min(estimate.moved_um);
            if estimate.moved_um < APART_UM || in_vain == PASSES_IN_VAIN {
                break;
            }
        }
        (estimate, linear)
    }

    /// How the estimates follow from all readings of a station, also those that the selection leaves out.
    ///
    /// # Errors
    /// When the station's profiles do not fit the rig.
    pub(crate) fn sensitivity(
        &self,
        station: &Station,
        method: impl FnOnce(&Readings) -> Operators,
    ) -> Result<Sensitivity> {
        let mut readings = Readings::gather(self.selection, self.layout, station)?;
        weights::smooth_by_order(&mut readings);
        let operators = method(&readings);
        let to_reference = self.layout.to_reference(self.layout.mean_z_mm + station.z_mm);
        let (width, count) = (self.layout.unknowns.len(), readings.count);
        let all: usize = station.profiles.iter().map(Profile::channels).sum();
        let mut operator = vec![Complex64::ZERO; (readings.max_order + 1) * width * all];
        for order in 1..=readings.max_order {
            let mut rows = self.order_operator(&operators, order, count);
            to_reference.apply(&mut rows);
            for (unknown, row) in rows.chunks_exact(count).enumerate() {
                if operators.observable(order)[unknown] {
                    let start = (order * width + unknown) * all;
                    row.iter().zip(&readings.places).for_each(|(entry, place)| operator[start + place] = *entry);
                }
            }
        }
        Ok(Sensitivity { readings: all, operator })
    }

    fn estimate(&self, operators: &Operators, readings: &[Complex64], max_order: usize) -> Estimate {
        let (width, count) = (self.layout.unknowns.len(), self.layout.readings.len());
        let mut values = vec![Complex64::ZERO; (max_order + 1) * width];
        let mut observable = vec![true; (max_order + 1) * width];
        let mut first = Vec::new();
        for order in 1..=max_order {
            let solution = apply(&operators.orders[order - 1].operator, &readings[order * count..(order + 1) * count]);
            observable[order * width..(order + 1) * width].copy_from_slice(&operators.systems[order - 1].determined);
            if order == 1 {
                let motion = self.first_order_motion(&solution);
                values[width..2 * width].copy_from_slice(&motion);
                first = solution;
            } else {
                values[order * width..(order + 1) * width].copy_from_slice(&solution);
                // Next to a lost order, form and motion are amplified noise that cancels in every reading; what exact geometry would
                // make of it grows from pass to pass.
                let read = readings[order * count..(order + 1) * count].iter();
                let most = CANCELLING * read.map(|reading| reading.norm()).fold(0.0, f64::max);
                let cancels = |(quantity, value): (&Quantity, &Complex64)| !quantity.is_tilt() && value.norm() > most;
                if self.layout.unknowns.iter().zip(&solution).any(cancels) {
                    observable[order * width..(order + 1) * width].fill(false);
                }
            }
        }
        let likely = self.likely_forms(&values, &observable, readings, max_order);
        Estimate { width, first, values, observable, likely, moved_um: 0.0 }
    }

    /// Form at lost orders: what the section's readings have in common, less the share that motion has at the orders beside it.
    fn likely_forms(
        &self,
        values: &[Complex64],
        observable: &[bool],
        readings: &[Complex64],
        max_order: usize,
    ) -> Vec<Complex64> {
        let (layout, count) = (self.layout, self.layout.readings.len());
        let width = layout.unknowns.len();
        let is_lost = |order: usize, form: usize| !observable[order * width + form];
        let lost: Vec<(usize, usize)> =
            (2..=max_order).flat_map(|order| layout.circles().map(move |(form, _)| (order, form))).collect();
        let lost: Vec<(usize, usize)> = lost.into_iter().filter(|(order, form)| is_lost(*order, *form)).collect();
        if lost.is_empty() {
            return Vec::new();
        }
        let shift = |unknown: &usize| {
            let quantity = layout.unknowns[*unknown];
            !quantity.is_form() && !matches!(quantity, Quantity::TiltX | Quantity::TiltY | Quantity::Z)
        };
        let shifts: Vec<usize> = (0..width).filter(shift).collect();
        let mut likely = vec![Complex64::ZERO; values.len()];
        for (order, form) in lost {
            let beside = order.saturating_sub(BESIDE).max(2)..=(order + BESIDE).min(max_order);
            let (mut of_form, mut of_motion) = (0.0, 0.0);
            for near in beside.filter(|near| !is_lost(*near, form)) {
                of_form += values[near * width + form].norm_sqr();
                let moved: f64 = shifts.iter().map(|shift| values[near * width + shift].norm_sqr()).sum();
                of_motion += moved / shifts.len().max(1) as f64;
            }
            let seen = layout.readings.iter().zip(&readings[order * count..(order + 1) * count]);
            let seen = seen.filter(|(reading, _)| layout.unknowns[form] == Quantity::Form(reading.section));
            let (sum, number) = seen.fold((Complex64::ZERO, 0.0), |(sum, number), (reading, value)| {
                (sum + layout.part_phase(reading, order).conj() * value, number + 1.0)
            });
            // Two sensors at right angles see motions that are independent of each other.
            let share = if of_form > 0.0 { of_form / (of_form + 0.5 * of_motion) } else { 0.0 };
            likely[order * width + form] = sum * (share / f64::max(number, 1.0));
        }
        likely
    }

    /// Order 1 as the other orders' unknowns: form 0, motion its counter-rotating part.
    fn first_order_motion(&self, solution: &[Complex64]) -> Vec<Complex64> {
        let names = self.layout.first_order_unknowns();
        let of =
            |wanted| names.iter().position(|name| *name == wanted).map_or(Complex64::ZERO, |index| solution[index]);
        let shift = of(FirstOrder::CounterRotatingShift);
        let tilt = of(FirstOrder::CounterRotatingTilt);
        let quarter = Complex64::I * self.layout.direction;
        let value = |quantity: &Quantity| match quantity {
            Quantity::Form(_) | Quantity::FaceForm(_) | Quantity::FaceMotion(_) => Complex64::ZERO,
            Quantity::Z => of(FirstOrder::Axial),
            Quantity::X => shift,
            Quantity::Y => -quarter * shift,
            Quantity::TiltX => quarter * tilt,
            Quantity::TiltY => tilt,
            // cos φ·X + sin φ·Y of what turns against the spindle, and cos φ·E_y − sin φ·E_x.
            Quantity::Along(azimuth) => shift * Complex64::cis(-self.layout.direction * azimuth.radians()),
            Quantity::TiltAlong(azimuth) => tilt * Complex64::cis(-self.layout.direction * azimuth.radians()),
        };
        self.layout.unknowns.iter().map(value).collect()
    }

    /// The largest reading of order 1 across the axis: the largest eccentricity, but for motion.
    fn eccentricity_um(&self, readings: &Readings) -> f64 {
        let radial = readings.order(1).iter().zip(&self.layout.readings).filter(|(_, at)| !at.view.is_axial());
        radial.map(|(reading, _)| reading.norm()).fold(0.0, f64::max)
    }

    /// The operator of an order, with the unknowns of orders from 2 as rows.
    pub(crate) fn order_operator(&self, operators: &Operators, order: usize, count: usize) -> Vec<Complex64> {
        self.named_alike(&operators.orders[order - 1].operator, order, count)
    }

    /// Rows, `[unknown][length]`, with the unknowns of orders from 2 also at order 1.
    pub(super) fn named_alike(&self, rows: &[Complex64], order: usize, length: usize) -> Vec<Complex64> {
        if order > 1 {
            return rows.to_vec();
        }
        let columns: Vec<Vec<Complex64>> = (0..length)
            .map(|place| {
                let column: Vec<Complex64> = rows.iter().skip(place).step_by(length).copied().collect();
                self.first_order_motion(&column)
            })
            .collect();
        let width = self.layout.unknowns.len();
        (0..width).flat_map(|unknown| columns.iter().map(move |column| column[unknown])).collect()
    }
}
