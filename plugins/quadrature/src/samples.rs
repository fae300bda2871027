//! Samples of a quadrature signal as the model takes them.

use runout_core::{Complex64, Error, Result, model::linear_terms::Declared, points::Points};

use crate::{
    components::{Component, UNIT},
    signal::{Signal, least_squares},
};

/// A reference that does not follow the phase within this, in rad, is none of it.
const FAR_OFF: f64 = 0.5;

/// Samples as the model takes them.
pub(crate) struct Samples {
    pub phase_rad: Vec<f64>,
    pub radius: Vec<f64>,
    /// The true angle with the phase's zero, where it is known.
    pub true_rad: Option<Vec<f64>>,
}

impl Samples {
    pub(crate) fn of(points: &Points) -> Result<Self> {
        let rad = |name: &str| -> Result<Vec<f64>> {
            Ok(points.column(name)?.iter().map(|degrees| degrees.to_radians()).collect())
        };
        let phase_rad = rad("phase_deg")?;
        let radius = points.column("radius_counts")?.to_vec();
        let refuse = |problem: String| Error::new("fit", points.input.display().to_string(), problem);
        let mean = radius.iter().sum::<f64>() / radius.len() as f64;
        if !(mean.is_finite() && mean > 0.0) {
            return Err(refuse(format!("its mean radius is {mean}: there is no circle")));
        }
        let true_rad = rad("reference_deg").ok().map(|reference| {
            let ahead = phase_rad.iter().zip(&reference).map(|(phase, reference)| Complex64::cis(phase - reference));
            let mean = ahead.sum::<Complex64>() / reference.len() as f64;
            // The length of the mean is 1 − σ²/2.
            if 1.0 - mean.norm() > 0.5 * FAR_OFF * FAR_OFF {
                return Err(refuse("the column reference_deg does not follow phase_deg".into())
                    .help("give the reference in degrees of the signal's own period, growing with the phase"));
            }
            Ok(reference.iter().map(|reference| reference + mean.arg()).collect())
        });
        Ok(Self { phase_rad, radius, true_rad: true_rad.transpose()? })
    }

    /// Mean of the radius, in counts.
    pub(crate) fn mean_radius(&self) -> f64 {
        self.radius.iter().sum::<f64>() / self.radius.len() as f64
    }

    /// Where each sample is on the circle: the true angle, or the phase.
    pub(crate) fn angles(&self) -> &[f64] {
        self.true_rad.as_deref().unwrap_or(&self.phase_rad)
    }

    /// The radius; with a reference both parts of z e^{−iθ}, the one along the circle behind the other.
    pub(crate) fn values(&self) -> Vec<f64> {
        let Some(angles) = &self.true_rad else { return self.radius.clone() };
        let z = self.radius.iter().zip(&self.phase_rad).zip(angles);
        let turned: Vec<Complex64> =
            z.map(|((radius, phase), angle)| Complex64::from_polar(*radius, phase - angle)).collect();
        turned.iter().map(|z| z.re).chain(turned.iter().map(|z| z.im)).collect()
    }

    /// What is always fitted: the radius, and with a reference the zero of the angle.
    pub(crate) fn declared(&self) -> Vec<Declared> {
        let count = self.phase_rad.len();
        let rows = if self.true_rad.is_some() { 2 * count } else { count };
        let part = |name: &str, of: std::ops::Range<usize>| {
            let column = (0..rows).map(|row| if of.contains(&row) { 1.0 } else { 0.0 }).collect();
            Declared { name: name.into(), unit: UNIT.into(), column }
        };
        let mut declared = vec![part("radius", 0..count)];
        if rows > count {
            declared.push(part("zero of the angle", count..rows));
        }
        declared
    }

    /// The values of a linear model, exact where it is fitted; radius, and parameters of gain ratio and quadrature angle, there.
    ///
    /// What the radius over the phase has beyond first order is taken out of it, as if all components were backward ones: of
    /// components that the radius alone does not decide, it is not known better.
    pub(crate) fn linearised(&self, max_order: usize) -> Result<(Vec<f64>, f64, [f64; 2])> {
        let mut values = self.values();
        let gain = Component::of_order(2)[0];
        let (radius, waves) = if self.true_rad.is_some() {
            let all = Component::all(max_order);
            let waves = all.iter().flat_map(|component| [0, 1].map(|wave| self.column(*component, wave)));
            let waves = waves.map(|column| Declared { name: "component".into(), unit: UNIT.into(), column });
            let found = least_squares(values.clone(), self.declared().into_iter().chain(waves).collect())?;
            let place = self.declared().len() + 2 * all.iter().position(|component| *component == gain).unwrap_or(0);
            (found[0], [found[place], found[place + 1]])
        } else {
            let backward: Vec<Component> = (1..=max_order).map(|order| Component::of_order(order)[0]).collect();
            let signal = Signal::fit(&self.phase_rad, &self.radius, &[], &backward, &[])?;
            if !signal.is_usable() {
                return Ok((values, self.mean_radius(), [0.0; 2]));
            }
            for (value, phase) in values.iter_mut().zip(&self.phase_rad) {
                let first_order = signal.components.iter().map(|(component, p)| {
                    let [cosine, sine] = component.across(*phase);
                    p.re * cosine + p.im * sine
                });
                *value += signal.radius + first_order.sum::<f64>() - signal.radius_at_phase(*phase);
            }
            let p =
                signal.components.iter().find(|(component, _)| *component == gain).map_or(Complex64::ZERO, |(_, p)| *p);
            (signal.radius, [p.re, p.im])
        };
        let parameters = gain.parameters(radius, waves);
        let slopes = gain.slopes(radius, parameters);
        let beyond: [f64; 2] =
            [0, 1].map(|wave| parameters[0] * slopes[0][wave] + parameters[1] * slopes[1][wave] - waves[wave]);
        for (wave, share) in beyond.into_iter().enumerate() {
            let column = self.column(gain, wave);
            values.iter_mut().zip(column).for_each(|(value, entry)| *value += share * entry);
        }
        Ok((values, radius, parameters))
    }

    /// What the cosine or the sine of a component in the radius adds to the values.
    pub(crate) fn column(&self, component: Component, wave: usize) -> Vec<f64> {
        let across = self.angles().iter().map(|angle| component.across(*angle)[wave]);
        let along = self.true_rad.iter().flatten().map(|angle| component.along(*angle)[wave]);
        across.chain(along).collect()
    }
}
