//! How levels change with the rate and the time constant of a creep, and what that says of their uncertainty.

use runout_numerics::{
    least_squares::dot,
    statistics::{f_tail, student_95},
};

use super::{CreepLaw, Fitted, Sensor, freedom, shape::Shape};

/// How levels change with rate and time constant, in each capture.
pub(super) struct Partials {
    /// `[capture][turn]`.
    pub(super) by_rate: Vec<Vec<f64>>,
    pub(super) by_tau: Vec<Vec<f64>>,
    /// Their products over all captures: rate with rate, rate with τ, τ with τ; the latter two 0 for a straight line.
    pub(super) normal: [f64; 3],
    /// Change of the creep over the capture with rate and τ.
    pub(super) over_capture: [f64; 2],
}

impl Partials {
    pub(super) fn new(sensor: &Sensor, fitted: &Fitted) -> Self {
        let captures = &sensor.captures;
        let by_rate: Vec<Vec<f64>> =
            captures.iter().map(|capture| Shape::new(fitted.course, &capture.middles).values).collect();
        let mut over_capture = [fitted.course.at(sensor.turns), 0.0];
        let mut by_tau: Vec<Vec<f64>> = by_rate.iter().map(|shape| vec![0.0; shape.len()]).collect();
        if let CreepLaw::Settling(tau) = fitted.course {
            let step = 1e-3 * tau;
            let [above, below] = [tau + step, tau - step].map(CreepLaw::Settling);
            let rate = |capture: usize| {
                if fitted.rates.len() > 1 { fitted.shared } else { fitted.rates.get(capture).copied().unwrap_or(0.0) }
            };
            for (index, (capture, by_tau)) in captures.iter().zip(&mut by_tau).enumerate() {
                let [high, low] = [above, below].map(|course| Shape::new(course, &capture.middles).values);
                let each = by_tau.iter_mut().zip(high.iter().zip(&low));
                each.for_each(|(partial, (high, low))| *partial = rate(index) * (high - low) / (2.0 * step));
            }
            over_capture[1] = fitted.shared * (above.at(sensor.turns) - below.at(sensor.turns)) / (2.0 * step);
        }
        let sum = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().zip(b).map(|(a, b)| dot(a, b)).sum();
        let normal = [sum(&by_rate, &by_rate), sum(&by_rate, &by_tau), sum(&by_tau, &by_tau)];
        Self { by_rate, by_tau, normal, over_capture }
    }

    /// Inverse of the normal matrix: rate with rate, rate with τ, τ with τ.
    pub(super) fn inverse(&self) -> [f64; 3] {
        let [aa, ab, bb] = self.normal;
        let determinant = aa * bb - ab * ab;
        if bb <= 0.0 || determinant <= 0.0 {
            return [aa.max(f64::MIN_POSITIVE).recip(), 0.0, 0.0];
        }
        [bb / determinant, -ab / determinant, aa / determinant]
    }

    /// Of rate (0) or τ (1), from the variance of independent turns.
    pub(super) fn std(&self, noise: f64, which: usize) -> f64 {
        (noise * self.inverse()[2 * which]).sqrt()
    }

    /// Standard uncertainties of rate, τ and the creep over the capture.
    pub(super) fn stds(&self, noise: f64, all: &[&Sensor]) -> [f64; 3] {
        let [aa, ab, bb] = self.inverse();
        let [by_rate, by_tau] = self.over_capture;
        let over = by_rate * by_rate * aa + 2.0 * by_rate * by_tau * ab + by_tau * by_tau * bb;
        let white = [aa, bb, over.max(0.0)].map(|square| (noise * square).sqrt());
        match self.between(all) {
            Some(between) => [0, 1, 2].map(|which| white[which].max(between[which])),
            None => white,
        }
    }

    /// Rate, τ and creep over the capture that explain a capture's levels beside those found.
    pub(super) fn solve(&self, capture: usize, curve: &[f64]) -> [f64; 3] {
        let captures = self.by_rate.len() as f64;
        let (a, b) = (dot(&self.by_rate[capture], curve), dot(&self.by_tau[capture], curve));
        let [aa, ab, bb] = self.inverse().map(|entry| entry * captures);
        let (rate, tau) = (aa * a + ab * b, ab * a + bb * b);
        [rate, tau, self.over_capture[0] * rate + self.over_capture[1] * tau]
    }

    /// Chance of captures that only wander agreeing so well on a rate, with τ as it is: Student's distribution, with how far
    /// the rates of all sensors differ from one capture to the other.
    pub(super) fn chance_of_agreement(&self, rate: f64, all: &[&Sensor]) -> f64 {
        let captures = self.by_rate.len();
        if captures < 2 {
            return 1.0;
        }
        let squares: f64 = all
            .iter()
            .map(|sensor| {
                let of = |capture: usize| {
                    let shape = &self.by_rate[capture];
                    dot(shape, &sensor.captures[capture].means_um) / dot(shape, shape).max(f64::MIN_POSITIVE)
                };
                let rates: Vec<f64> = (0..captures).map(of).collect();
                let mean = rates.iter().sum::<f64>() / captures as f64;
                rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>()
            })
            .sum();
        let variance = squares / (captures * (captures - 1) * all.len()) as f64;
        f_tail(rate * rate / variance.max(f64::MIN_POSITIVE), 1.0, freedom(captures, all) as f64)
    }

    /// Standard uncertainties of the means of rate, τ and the creep over the capture, from how captures differ in all sensors:
    /// for few degrees of freedom as much larger as Student's distribution is wider, so that twice it holds 95 %.
    pub(super) fn between(&self, all: &[&Sensor]) -> Option<[f64; 3]> {
        let captures = self.by_rate.len();
        if captures < 2 {
            return None;
        }
        let mut squares = [0.0; 3];
        for sensor in all {
            let each: Vec<[f64; 3]> =
                (0..captures).map(|capture| self.solve(capture, &sensor.captures[capture].means_um)).collect();
            for (which, sum) in squares.iter_mut().enumerate() {
                let mean = each.iter().map(|one| one[which]).sum::<f64>() / captures as f64;
                *sum += each.iter().map(|one| (one[which] - mean).powi(2)).sum::<f64>();
            }
        }
        let wider = (0.5 * student_95(freedom(captures, all) as f64)).max(1.0);
        let count = (captures * (captures - 1) * all.len()) as f64;
        Some(squares.map(|sum| wider * (sum / count).sqrt()))
    }
}
