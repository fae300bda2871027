//! What is observable with a layout at each order.

use runout_core::{
    Complex64,
    numerics::least_squares::PivotedQr,
    separation::{Assessment, OrderAssessment, Quantity},
};

use super::{FirstOrder, Layout, NULL_TOLERANCE, UM_PER_MM_URAD};

impl Layout {
    /// Whether each unknown is observable at an order.
    ///
    /// At order 1 form is 0 by definition and motion is its counter-rotating part; both are lost where one clamping
    /// does not distinguish eccentricity from co-rotating motion (A₁ is deficient), or no sensor pair measures
    /// the counter-rotating part.
    #[must_use]
    pub fn observable(&self, order: usize) -> Vec<bool> {
        self.observable_unknowns(&self.factor(order), order)
    }

    /// [`observable`](Self::observable) with an order's matrix.
    pub(crate) fn observable_with(&self, matrix: &[Complex64], order: usize) -> Vec<bool> {
        self.observable_unknowns(&self.factor_matrix(self.unknowns.len(), matrix), order)
    }

    fn observable_unknowns(&self, qr: &PivotedQr, order: usize) -> Vec<bool> {
        let mut observable = qr.observable(NULL_TOLERANCE);
        if order == 1 {
            let determined = self.determined_at_first_order();
            for ((quantity, observable), determined) in self.unknowns.iter().zip(&mut observable).zip(determined) {
                // Of the face, 1/rev is how it was clamped, in each setup by itself: the equations of order 1 say all of z.
                *observable = determined && (*observable || *quantity == Quantity::Z);
            }
        } else if self.max_noise_gain.is_finite() {
            for (observable, noisy) in observable.iter_mut().zip(self.too_noisy(qr)) {
                *observable &= !noisy;
            }
        }
        // Motion is reported at the spindle's reference, where shift and tilt mix.
        for (shift, tilt, _) in self.shifts_with_tilts() {
            observable[shift] &= observable[tilt];
        }
        observable
    }

    /// Whether the equations of order 1 determine of each unknown what they have of it: of motion the part that turns against the spindle, also where
    /// its other part is lost in the eccentricity.
    pub(crate) fn determined_at_first_order(&self) -> Vec<bool> {
        let unknowns = self.first_order_unknowns();
        let first = self.factor_matrix(unknowns.len(), &self.first_order_matrix()).observable(NULL_TOLERANCE);
        let is_determined =
            |wanted| !unknowns.contains(&wanted) || unknowns.iter().zip(&first).any(|(u, t)| *u == wanted && *t);
        let of = |quantity: &Quantity| match quantity {
            Quantity::Form(_) | Quantity::FaceForm(_) => true,
            Quantity::Z => is_determined(FirstOrder::Axial),
            motion if motion.is_tilt() => is_determined(FirstOrder::CounterRotatingTilt),
            _ => is_determined(FirstOrder::CounterRotatingShift),
        };
        self.unknowns.iter().map(of).collect()
    }

    /// Which unknowns carry more than [`max_noise_gain`](Self::max_noise_gain) times the readings' noise.
    fn too_noisy(&self, qr: &PivotedQr) -> impl Iterator<Item = bool> {
        let squares: f64 = self.readings.iter().map(|reading| reading.lever_mm.powi(2)).sum();
        let rms_lever = (squares / self.readings.len() as f64).sqrt() * UM_PER_MM_URAD;
        let (width, covariance) = (self.unknowns.len(), qr.covariance());
        self.unknowns.iter().enumerate().map(move |(index, unknown)| {
            let lever = if unknown.is_tilt() { rms_lever } else { 1.0 };
            covariance[index * width + index].re.sqrt() * lever > self.max_noise_gain
        })
    }

    /// What is observable at orders 1 to `max_order`, with plain (unweighted) least squares; motion at the spindle's
    /// reference, with the carriage at 0.
    #[must_use]
    pub fn assess(&self, max_order: usize) -> Assessment {
        let orders = (1..=max_order).map(|order| self.assess_order(order)).collect();
        let notes = self.one_line_note().into_iter().collect();
        Assessment { unknowns: self.unknowns.clone(), orders, unused: Vec::new(), notes }
    }

    fn assess_order(&self, order: usize) -> OrderAssessment {
        let qr = self.factor(order);
        let observable = self.observable_unknowns(&qr, order);
        let covariance = qr.covariance();
        let gains = self.to_reference(self.mean_z_mm).spread(&covariance);
        let by_unknown = observable.iter().zip(gains);
        let noise_gain = by_unknown.map(|(seen, gain)| if *seen { gain.sqrt() } else { f64::NAN }).collect();
        let lost_because = observable.contains(&false).then(|| {
            let lost = self.unknowns.iter().zip(&observable).filter(|(_, seen)| !**seen);
            let mut names: Vec<&str> = lost.clone().map(|(quantity, _)| quantity.id()).collect();
            let along = |quantity: &Quantity| matches!(quantity, Quantity::Z | Quantity::FaceForm(_));
            let lost_along_axis_only = lost.into_iter().all(|(quantity, _)| along(quantity));
            names.dedup();
            if order == 1 && lost_along_axis_only {
                format!("1/rev changes of {} can leave every reading as it is", names.join(", "))
            } else if order == 1 {
                "1/rev: eccentricity of the part and motion that turns with it are the same in every reading".to_owned()
            } else if qr.rank() == self.unknowns.len() {
                let limit = self.max_noise_gain;
                format!("{order}/rev of {} would carry more than {limit} times the readings' noise", names.join(", "))
            } else {
                format!("{order}/rev changes of {} can leave every reading as it is", names.join(", "))
            }
        });
        OrderAssessment {
            order,
            rank: qr.rank(),
            residual_dof: self.readings.len() - qr.rank(),
            observable,
            noise_gain,
            lost_because,
        }
    }
}
