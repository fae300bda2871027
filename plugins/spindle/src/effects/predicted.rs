//! What the fitted model predicts of each reading, part by part, for the effects' partials.

use runout_core::{Complex64, separation::Quantity};

use super::correct::Curve;
use crate::{
    alterations::Alterations,
    layout::{FirstOrder, Layout, SeenPattern, UM_PER_MM_URAD},
    solve::{Estimate, Readings, SecondOrder},
};

/// Harmonics of Re Σ c e^{−inΦ}, `[order][reading]` from order 0, of what each reading is made of.
pub struct Predicted<'a> {
    /// The layout as effects change it.
    pub layout: &'a Layout,
    /// What effects change.
    pub alterations: &'a Alterations,
    /// Equal angles a turn.
    pub samples_per_rev: usize,
    /// In each setup, the equal angles on which single turns were taken apart.
    pub turn_angles: &'a [usize],
    /// Form and eccentricity, in µm.
    pub part: Vec<Complex64>,
    /// Motion along the sensor, in µm.
    pub along: Vec<Complex64>,
    /// Motion across the sensor, a quarter turn ahead of its direction, in µm.
    pub across: Vec<Complex64>,
    /// Tilt towards the sensor, which moves the part along it with z, in µrad.
    pub tilt: Vec<Complex64>,
    /// Displacements as the readings have them, with their level, in µm.
    pub readings: Vec<Complex64>,
    /// How the part changes along z, in µm/mm; 0 where only one section is seen.
    pub along_z: Vec<Complex64>,
    estimate: &'a Estimate,
}

impl<'a> Predicted<'a> {
    /// From a solution; `displacements` are the readings converted to them.
    #[must_use]
    pub(crate) fn new(
        layout: &'a Layout,
        alterations: &'a Alterations,
        estimate: &'a Estimate,
        displacements: &'a Readings,
    ) -> Self {
        let (count, readings) = (layout.readings.len(), &displacements.mean);
        let mut predicted = Self {
            layout,
            alterations,
            samples_per_rev: displacements.samples_per_rev,
            turn_angles: &displacements.turn_angles,
            part: vec![Complex64::ZERO; readings.len()],
            along: vec![Complex64::ZERO; readings.len()],
            across: vec![Complex64::ZERO; readings.len()],
            tilt: vec![Complex64::ZERO; readings.len()],
            readings: readings.clone(),
            along_z: vec![Complex64::ZERO; readings.len()],
            estimate,
        };
        let position = |wanted: Quantity| layout.unknowns.iter().position(|known| *known == wanted);
        let motions: Vec<(usize, [f64; 4])> = (layout.unknowns.iter().enumerate())
            .filter(|(_, quantity)| !quantity.is_form())
            .map(|(unknown, quantity)| (unknown, quantity.cartesian()))
            .collect();
        let first = layout.first_order_unknowns();
        let eccentricity = |setup: usize, section: usize| {
            let wanted = FirstOrder::Eccentricity { setup, section };
            let found = first.iter().position(|known| *known == wanted);
            found.and_then(|index| estimate.first.get(index)).copied().unwrap_or_default()
        };
        // What is the same at every order.
        let fixed: Vec<_> = layout
            .readings
            .iter()
            .map(|reading| {
                let lever = reading.lever_mm * UM_PER_MM_URAD;
                (reading.angle_rad.sin_cos(), lever, predicted.neighbour(reading.section))
            })
            .collect();
        for order in 1..readings.len() / count {
            let of = |unknown: Option<usize>| {
                unknown.map_or(Complex64::ZERO, |unknown| estimate.observable_value(order, unknown))
            };
            let mut motion = [Complex64::ZERO; 4];
            for (unknown, shares) in &motions {
                let value = estimate.observable_value(order, *unknown);
                motion.iter_mut().zip(shares).for_each(|(sum, share)| *sum += value * *share);
            }
            let [x, y, tilt_x, tilt_y] = motion;
            let z = of(position(Quantity::Z));
            let form = |setup: usize, section: usize| {
                let of_section = || position(Quantity::Form(section)).or_else(|| position(Quantity::FaceForm(section)));
                if order == 1 { eccentricity(setup, section) } else { of(of_section()) }
            };
            for (index, (reading, ((sine, cosine), lever, neighbour))) in layout.readings.iter().zip(&fixed).enumerate()
            {
                let at = order * count + index;
                let phase = layout.form_phase(reading, order);
                predicted.part[at] = form(reading.setup, reading.section) * phase;
                let moves = layout.motion_sign(reading.setup, order) * reading.motion_ratio;
                // An axial sensor reads z and, at its lever −ρ, the tilt towards it.
                let [x, y, z] = if reading.view.is_axial() {
                    [Complex64::ZERO, Complex64::ZERO, z]
                } else {
                    [x, y, Complex64::ZERO]
                };
                let (shift_x, shift_y) = (x + tilt_y * *lever, y - tilt_x * *lever);
                predicted.along[at] = (shift_x * cosine + shift_y * sine + z) * moves;
                predicted.across[at] = (shift_y * cosine - shift_x * sine) * moves;
                predicted.tilt[at] = (tilt_y * *cosine - tilt_x * *sine) * moves;
                if let Some((other, distance_mm)) = neighbour {
                    let change = form(reading.setup, *other) - form(reading.setup, reading.section);
                    predicted.along_z[at] = change * phase / distance_mm;
                }
            }
        }
        predicted.add_patterns();
        predicted
    }

    /// Patterns that are applied are part of what a sensor sees.
    fn add_patterns(&mut self) {
        let (layout, count) = (self.layout, self.layout.readings.len());
        for (index, reading) in layout.readings.iter().enumerate() {
            for SeenPattern { order, value, is_form } in &reading.patterns {
                let at = order * count + index;
                if at < self.part.len() {
                    let value = value * layout.part_phase(reading, *order);
                    if *is_form {
                        self.part[at] += value;
                    }
                    self.readings[at] += value;
                }
            }
        }
    }

    /// Another circle around the part and how far along z it is; nothing of a face.
    fn neighbour(&self, section: usize) -> Option<(usize, f64)> {
        let radial = || self.layout.readings.iter().filter(|reading| !reading.view.is_axial());
        let here = radial().find(|reading| reading.section == section).map(|reading| reading.lever_mm)?;
        let others = radial().filter(|reading| reading.section != section);
        others
            .map(|reading| (reading.section, reading.lever_mm - here))
            .filter(|(_, distance)| distance.abs() > 1e-3)
            .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// What exact geometry adds to linear readings of a part whose curvature is so many times that of the layout's, in µm.
    pub(crate) fn beyond_linear(&self, curvature: f64) -> Vec<Complex64> {
        let mut layout = self.layout.clone();
        layout.part_radius_mm /= curvature;
        let first = self.part.iter().skip(layout.readings.len()).take(layout.readings.len());
        let eccentricity_um = first.map(|part| part.norm()).fold(0.0, f64::max);
        let mut beyond = self.nothing();
        SecondOrder::new(&layout, self.samples_per_rev, eccentricity_um).excess(self.estimate, &mut beyond);
        beyond
    }

    /// Nothing, for readings that an effect leaves alone.
    #[must_use]
    pub fn nothing(&self) -> Vec<Complex64> {
        vec![Complex64::ZERO; self.readings.len()]
    }

    /// The equal angles on which the turns behind a place in the arrays were taken apart.
    #[must_use]
    pub fn turn_angles_of(&self, at: usize) -> usize {
        let reading = &self.layout.readings[at % self.layout.readings.len()];
        self.turn_angles.get(reading.setup).copied().unwrap_or_default()
    }

    /// A partial from each harmonic of some readings: `value` gets the order and the place in the arrays.
    #[must_use]
    pub fn each(
        &self,
        on: impl Fn(&crate::layout::Reading) -> bool,
        value: impl Fn(usize, usize) -> Complex64,
    ) -> Vec<Complex64> {
        let count = self.layout.readings.len();
        let mut partial = self.nothing();
        for (index, reading) in self.layout.readings.iter().enumerate().filter(|(_, reading)| on(reading)) {
            let _ = reading;
            for order in 1..partial.len() / count {
                partial[order * count + index] = value(order, order * count + index);
            }
        }
        partial
    }

    /// Some readings of `source` (orders from 1) times cos(nΦ) and times sin(nΦ), as harmonics: with Re(a e^{−inΦ}) in front of Re(c e^{−ikΦ}),
    /// ½·a·c has the order k + n, and ½·a*·c the order k − n.
    #[must_use]
    pub fn modulated(
        &self,
        source: &[Complex64],
        order: usize,
        on: impl Fn(&crate::layout::Reading) -> bool,
    ) -> [Vec<Complex64>; 2] {
        let count = self.layout.readings.len();
        let orders = source.len() / count;
        let mut products = [self.nothing(), self.nothing()];
        for (index, _) in self.layout.readings.iter().enumerate().filter(|(_, reading)| on(reading)) {
            let at = |wanted: usize| if wanted < orders { source[wanted * count + index] } else { Complex64::ZERO };
            for wanted in 1..orders {
                // e^{+ikΦ} folds to the conjugate at order k.
                let below = if wanted >= order { at(wanted - order) } else { at(order - wanted).conj() };
                let above = at(wanted + order);
                products[0][wanted * count + index] = 0.5 * (below + above);
                products[1][wanted * count + index] = 0.5 * Complex64::I * (below - above);
            }
        }
        products
    }

    /// A partial from the curve of some readings over the spindle's angle: `map` gets angle and value of `source`.
    #[must_use]
    pub fn curves(
        &self,
        source: &[Complex64],
        on: impl Fn(&crate::layout::Reading) -> bool,
        map: impl Fn(f64, f64) -> f64,
    ) -> Vec<Complex64> {
        let count = self.layout.readings.len();
        let mut partial = self.nothing();
        let mut curve = Curve::new(self.samples_per_rev);
        for (index, _) in self.layout.readings.iter().enumerate().filter(|(_, reading)| on(reading)) {
            let harmonics: Vec<Complex64> = source.iter().skip(index).step_by(count).copied().collect();
            let mapped = curve.mapped(harmonics.into_iter(), &map);
            partial.iter_mut().skip(index).step_by(count).zip(mapped).for_each(|(to, from)| *to = from);
        }
        partial
    }
}
