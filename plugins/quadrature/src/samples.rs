//! Samples of a quadrature signal as the model takes them.

use runout_core::{Complex64, Error, Result, closed_loop::linear_terms::Declared, points::Points};

use crate::{
    components::{Component, UNIT},
    signal::{Place, Signal, least_squares},
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

    /// Both parts of z e^{−iθ}, the one along the circle behind the other; the radius without a reference.
    fn values(&self) -> Vec<f64> {
        let Some(angles) = &self.true_rad else { return self.radius.clone() };
        let z = self.radius.iter().zip(&self.phase_rad).zip(angles);
        let turned: Vec<Complex64> =
            z.map(|((radius, phase), angle)| Complex64::from_polar(*radius, phase - angle)).collect();
        turned.iter().map(|z| z.re).chain(turned.iter().map(|z| z.im)).collect()
    }

    /// A linear model of the samples, exact where it is fitted.
    ///
    /// Without a reference what the curve has beyond first order is taken out, as if all components were backward ones: of
    /// components that the radius alone does not decide, it is not known better, and both of one order have the same columns.
    pub(crate) fn linearised(&self, max_order: usize) -> Result<Linearised> {
        let gain = Component::of_order(2)[0];
        let (mut linearised, waves) = if let Some(angles) = &self.true_rad {
            let across = |component: Component, wave: usize| {
                let [across, along] = [Component::across, Component::along]
                    .map(|of| angles.iter().map(move |angle| of(component, *angle)[wave]));
                across.chain(along).collect::<Vec<f64>>()
            };
            let count = angles.len();
            let part = |name: &str, from: usize| {
                let column = (0..2 * count).map(|row| f64::from(u8::from((from..from + count).contains(&row))));
                Declared { name: name.into(), unit: UNIT.into(), column: column.collect() }
            };
            let declared = vec![part("radius", 0), part("zero of the angle", count)];
            let all = Component::all(max_order);
            let columns: Vec<[Vec<f64>; 2]> =
                all.iter().map(|component| [0, 1].map(|wave| across(*component, wave))).collect();
            let waves = columns.iter().flatten().cloned();
            let waves = waves.map(|column| Declared { name: "component".into(), unit: UNIT.into(), column });
            let values = self.values();
            let found = least_squares(values.clone(), declared.iter().cloned().chain(waves).collect())?;
            let place = declared.len() + 2 * all.iter().position(|component| *component == gain).unwrap_or(0);
            let made =
                Linearised { values, radius: found[0], gain_and_angle: [0.0; 2], declared, columns, shared: false };
            (made, [found[place], found[place + 1]])
        } else {
            let backward: Vec<Component> = (1..=max_order).map(|order| Component::of_order(order)[0]).collect();
            let found = Signal::fit(&self.phase_rad, &self.radius, &[], &backward, &[])?;
            let signal =
                if found.is_usable() { found } else { Signal { radius: self.mean_radius(), components: Vec::new() } };
            let places = signal.places(&self.phase_rad, &self.radius);
            let column = |of: &dyn Fn(&Place) -> f64| places.iter().map(of).collect::<Vec<f64>>();
            let columns: Vec<[Vec<f64>; 2]> = (backward.iter())
                .map(|component| [0, 1].map(|wave| column(&|place| place.column(*component, wave))))
                .collect();
            let round = column(&Place::of_radius);
            let mut values = column(&|place| place.distance);
            values.iter_mut().zip(&round).for_each(|(value, round)| *value += signal.radius * round);
            for (component, p) in &signal.components {
                let [cosine, sine] = &columns[component.order() - 1];
                let both = values.iter_mut().zip(cosine).zip(sine);
                both.for_each(|((value, cosine), sine)| *value += p.re * cosine + p.im * sine);
            }
            let p = signal.components.iter().find(|(component, _)| *component == gain);
            let waves = p.map_or([0.0; 2], |(_, p)| [p.re, p.im]);
            let declared = vec![Declared { name: "radius".into(), unit: UNIT.into(), column: round }];
            let made =
                Linearised { values, radius: signal.radius, gain_and_angle: [0.0; 2], declared, columns, shared: true };
            (made, waves)
        };
        linearised.gain_and_angle = gain.parameters(linearised.radius, waves);
        let slopes = gain.slopes(linearised.radius, linearised.gain_and_angle);
        for (wave, share) in waves.into_iter().enumerate() {
            let parameters = linearised.gain_and_angle;
            let beyond = parameters[0] * slopes[0][wave] + parameters[1] * slopes[1][wave] - share;
            let column = linearised.column(gain, wave).to_vec();
            linearised.values.iter_mut().zip(column).for_each(|(value, entry)| *value += beyond * entry);
        }
        Ok(linearised)
    }
}

/// Samples as a linear model has them.
pub(crate) struct Linearised {
    /// Distances of the readings across the curve that is fitted; with a reference both parts of z e^{−iθ}.
    pub values: Vec<f64>,
    /// Radius, and gain ratio less 1 and angle error, about which it is linear.
    pub radius: f64,
    pub gain_and_angle: [f64; 2],
    /// What is always fitted: the radius, and with a reference the zero of the angle.
    pub declared: Vec<Declared>,
    /// Cosine and sine of each component, or of each order where both of one order share them.
    columns: Vec<[Vec<f64>; 2]>,
    shared: bool,
}

impl Linearised {
    /// What the cosine or the sine of a component in the radius adds to the values.
    pub(crate) fn column(&self, component: Component, wave: usize) -> &[f64] {
        let order = component.order() - 1;
        let place = if self.shared { order } else { 2 * order + usize::from(component.is_forward()) };
        &self.columns[place][wave]
    }
}
