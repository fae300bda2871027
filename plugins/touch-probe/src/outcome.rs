//! From a fit to lobes, rows of tables and values.

use std::{collections::HashSet, f64::consts::TAU};

use runout_core::{
    Complex64, Result,
    closed_loop::diagnosis::LostOrders,
    draws::Uncertainty,
    separation::{Quantity, Residual, SectionAt, Separation, VarianceFrom},
    stage::{Evaluable, Form, Outcome, far_below_noise},
    summary::Value,
    table::{TableRows, counts, flags, numbers},
};

use crate::{
    config::{TouchProbeConfig, listed, lost_orders},
    design::{Fitted, Noise, Parameter, Weights, form_order},
    held_out::Ranges,
    lobe::{Lobe, pretravel_um},
    second_order::SecondOrder,
    tables::rows,
    touches::Touches,
    waves::{Part, wave},
};

/// Directions of the tables `pretravel` and `compensation`: every 6°.
const DIRECTIONS: usize = 60;

/// What a result is made of.
pub(crate) struct TouchSolution<'a> {
    pub config: &'a TouchProbeConfig,
    pub touches: &'a Touches,
    pub fit: &'a Fitted,
    pub weights: &'a Weights,
    pub ranges: Ranges,
}

impl TouchSolution<'_> {
    /// Orders that are lost: of lobing (order 1 always), and of form.
    pub(crate) fn lost(&self, lobes: &[Lobe]) -> [Vec<usize>; 2] {
        let lobing = lobes.iter().filter(|lobe| !lobe.observable).map(|lobe| lobe.order);
        let form = (2..=self.config.max_order).filter(|order| self.form_places(*order).is_none());
        [std::iter::once(1).chain(lobing).collect(), std::iter::once(1).chain(form).collect()]
    }

    fn form_places(&self, order: usize) -> Option<[usize; 2]> {
        self.fit.design.pair(form_order, order).filter(|places| self.fit.is_observable(places))
    }

    /// Tables, values, form and remarks; without the table `residual`.
    pub(crate) fn outcome(&self) -> Result<Outcome> {
        let lobes = Lobe::all(self.config, self.fit);
        let mut tables = vec![self.pretravel(&lobes)?, self.compensation(&lobes)?, self.lobing(&lobes)?];
        tables.retain(|table| table.rows.num_rows() > 0);
        let [lobing, form] = self.lost(&lobes);
        Ok(Outcome {
            convention: "pre-travel moves the place that is read outward (positive); angles are right-handed about the axis of the \
                         ring, directions from its centre"
                .into(),
            tables,
            values: self.values(&lobes),
            evaluables: self.form(&lobes).map(Evaluable::ClosedProfiles).into_iter().collect(),
            lost_orders: Some(LostOrders::of([("lobing", lobing), ("form", form)])),
            remarks: self.remarks(&lobes),
            notes: self.notes(&lobes),
            ..Outcome::default()
        })
    }

    fn pretravel(&self, lobes: &[Lobe]) -> Result<TableRows> {
        let angles: Vec<f64> = (0..DIRECTIONS).map(|index| TAU * index as f64 / DIRECTIONS as f64).collect();
        let (bound_um, besides_um2) = (self.config.ring_form_um, self.second_order().variance_um2());
        let at = |angle: &f64| pretravel_um(self.fit, lobes, *angle, bound_um, besides_um2);
        let each: Vec<[f64; 2]> = angles.iter().map(at).collect();
        let columns = vec![
            numbers(angles.iter().map(|angle| angle.to_degrees())),
            numbers(each.iter().map(|[number, _]| *number)),
            numbers(each.iter().map(|[_, std]| *std)),
        ];
        rows("pretravel", columns)
    }

    fn compensation(&self, lobes: &[Lobe]) -> Result<TableRows> {
        let angles: Vec<f64> = (0..DIRECTIONS).map(|index| TAU * index as f64 / DIRECTIONS as f64).collect();
        let known = lobes.iter().any(|lobe| lobe.observable) && self.mean().is_some();
        let radial = |angle: f64| {
            if !known {
                return f64::NAN;
            }
            let lobing = lobes.iter().filter(|lobe| lobe.evident).map(|lobe| {
                let [a, b] = lobe.parts_um;
                a * wave(lobe.order, Part::Cosine, angle) + b * wave(lobe.order, Part::Sine, angle)
            });
            self.mean().map_or(f64::NAN, |[mean, _]| mean) + lobing.sum::<f64>()
        };
        let columns = vec![
            numbers(angles.iter().map(|angle| angle.to_degrees())),
            numbers(angles.iter().map(|angle| -1e-3 * radial(*angle) * angle.cos())),
            numbers(angles.iter().map(|angle| -1e-3 * radial(*angle) * angle.sin())),
        ];
        rows("compensation", columns)
    }

    fn lobing(&self, lobes: &[Lobe]) -> Result<TableRows> {
        let or_nan = |lobe: &Lobe, number: f64| if lobe.observable { number } else { f64::NAN };
        let forms: Vec<[f64; 2]> = lobes.iter().map(|lobe| self.form_amplitude(lobe.order)).collect();
        let columns = vec![
            counts(lobes.iter().map(|lobe| lobe.order)),
            flags(lobes.iter().map(|lobe| !lobe.observable)),
            flags(lobes.iter().map(|lobe| self.form_places(lobe.order).is_none())),
            flags(lobes.iter().map(|lobe| lobe.bounded)),
            flags(lobes.iter().map(|lobe| lobe.evident)),
            numbers(lobes.iter().map(|lobe| or_nan(lobe, lobe.amplitude_um()))),
            numbers(lobes.iter().map(|lobe| or_nan(lobe, lobe.std_um()[0]))),
            numbers(lobes.iter().map(|lobe| or_nan(lobe, lobe.phase_deg()))),
            numbers(
                lobes.iter().map(|lobe| or_nan(lobe, (lobe.std_um()[1] / lobe.amplitude_um()).to_degrees().min(180.0))),
            ),
            numbers(forms.iter().map(|[number, _]| *number)),
            numbers(forms.iter().map(|[_, std]| *std)),
        ];
        rows("lobing", columns)
    }

    fn form_amplitude(&self, order: usize) -> [f64; 2] {
        let Some(places) = self.form_places(order) else { return [f64::NAN; 2] };
        let [a, b] = places.map(|place| self.fit.solved.coefficients[place]);
        let amplitude = a.hypot(b);
        let [[aa, ab], [_, bb]] = places.map(|row| places.map(|column| self.fit.covariance(row, column)));
        let noise_um2 = (a * a * aa + 2.0 * a * b * ab + b * b * bb).max(0.0) / (amplitude * amplitude);
        [amplitude, (noise_um2 + 0.5 * self.second_order().amplitude_um(order).powi(2)).sqrt()]
    }

    fn second_order(&self) -> SecondOrder {
        SecondOrder::of(self.config, self.fit)
    }

    fn mean(&self) -> Option<[f64; 2]> {
        let place = self.fit.design.place(&Parameter::Mean).filter(|place| self.fit.is_observable(&[*place]))?;
        let std_um = self.fit.covariance(place, place).sqrt().hypot(self.second_order().amplitude_um(0));
        Some([self.fit.solved.coefficients[place], std_um])
    }

    fn values(&self, lobes: &[Lobe]) -> Vec<Value> {
        let [mean, std] = self.mean().unwrap_or([f64::NAN; 2]);
        let about = "mean pre-travel and stylus, over the time of the campaign: reading less ring radius; holds the error of the ring's radius, \
             and a scale error common to X and Y, one to one";
        let mut values = vec![Value::new("pretravel_mean", mean, std, "um", about).key()];
        let Ranges { before, after, without_form, by_repeats, .. } = self.ranges;
        let held = if by_repeats { "a repeat" } else { "touches" };
        let of_ranges = [
            ("range_before", before, "radius of one pass about its least-squares circle, as read".to_owned()),
            ("range_after", after, format!("the same, compensated for lobing; {held} left out of the fit")),
            (
                "range_after_without_form",
                without_form,
                format!("the same, compensated, and the form of the ring taken out; {held} left out of the fit"),
            ),
        ];
        for (symbol, range, about) in of_ranges {
            let about = format!("range, mean over passes: {about}");
            values.push(Value::new(symbol, range.um, range.std_um, "um", &about).not_negative().key());
        }
        for lobe in lobes {
            let of = |number: f64| if lobe.observable { number } else { f64::NAN };
            let [along, across] = lobe.std_um();
            let order = lobe.order;
            let about = format!("amplitude of lobing of order {order}");
            let symbol = format!("lobe_{order}_amplitude");
            let amplitude_um = lobe.amplitude_um();
            let known = Uncertainty::of_amplitude(amplitude_um, along, self.freedom());
            values.push(Value {
                uncertainty: lobe.observable.then_some(known),
                ..Value::new(&symbol, of(amplitude_um), f64::NAN, "um", &about)
            });
            let about = format!(
                "phase of lobing of order {order}: A cos({order} direction + phase), probe's frame; null without \
                                 evidence of the order"
            );
            let evident = |number: f64| if lobe.evident { of(number) } else { f64::NAN };
            let std = (across / lobe.amplitude_um()).to_degrees();
            values.push(Value::new(
                &format!("lobe_{order}_phase"),
                evident(lobe.phase_deg()),
                evident(std),
                "deg",
                &about,
            ));
        }
        for setup in &self.touches.setups {
            for (axis, symbol) in ["centre_x", "centre_y"].into_iter().enumerate() {
                let parameter = Parameter::Centre { setup: *setup, axis };
                let place = self.fit.design.place(&parameter).filter(|place| self.fit.is_observable(&[*place]));
                let [number, std] = place.map_or([f64::NAN; 2], |place| {
                    let moved = self.touches.centre_um[*setup][axis];
                    [moved + self.fit.solved.coefficients[place], self.fit.covariance(place, place).sqrt()]
                });
                let about = "centre of the ring, from the nominal one; contains lobing of order 1";
                values.push(Value::new(symbol, number, std, "um", about).of(&self.config.setups[*setup].id));
            }
        }
        let about = match self.weights.noise {
            Noise::Stated => "standard uncertainty of a touch, as stated (rms)".to_owned(),
            Noise::Repeats(dof) => format!("standard deviation of a touch, from repeats ({dof} degrees of freedom)"),
            Noise::Residual => "standard deviation of a touch, from what the fit leaves".to_owned(),
        };
        let noise = self.weights.rms_um();
        let (noise, std) = match self.weights.noise {
            Noise::Stated => (noise, f64::NAN),
            Noise::Repeats(dof) => (noise, noise / (2.0 * dof as f64).sqrt()),
            Noise::Residual => {
                let noise = self.fit.variance.sqrt();
                (noise, noise / (2.0 * self.fit.solved.dof as f64).sqrt())
            }
        };
        values.push(Value::new("touch_std", noise, std, "um", &about).not_negative());
        values
    }

    /// The ring as a section, where any order of its form may be observable.
    fn form(&self, lobes: &[Lobe]) -> Option<Form> {
        let all: Vec<usize> = (0..self.config.setups.len()).collect();
        (2..=self.config.max_order).any(|order| self.config.separates(&all, order)).then_some(())?;
        let highest = lobes.iter().map(|lobe| lobe.order).max().unwrap_or(0).max(self.config.max_order);
        let lost = Complex64::new(f64::NAN, f64::NAN);
        let second_order = self.second_order();
        let (mut estimate, mut variance) = (vec![lost; highest + 1], vec![f64::NAN; highest + 1]);
        let mut observable = vec![false; highest + 1];
        // Level and centring are not form.
        for order in 0..2 {
            (estimate[order], variance[order], observable[order]) = (Complex64::ZERO, 0.0, true);
        }
        for order in 2..=highest {
            let Some(places) = self.form_places(order) else {
                // Above the declared orders form is taken as 0 unless it was found.
                if order > self.config.max_order {
                    (estimate[order], variance[order], observable[order]) = (Complex64::ZERO, 0.0, true);
                }
                continue;
            };
            // a cos nα + b sin nα = Re (a − ib) e^{inα}.
            let [a, b] = places.map(|place| self.fit.solved.coefficients[place]);
            estimate[order] = Complex64::new(a, -b);
            let of_noise: f64 = places.iter().map(|place| self.fit.covariance(*place, *place)).sum();
            variance[order] = of_noise + second_order.amplitude_um(order).powi(2);
            observable[order] = true;
        }
        let left = &self.fit.residual_um;
        let rms_um = (left.iter().map(|value| value * value).sum::<f64>() / left.len().max(1) as f64).sqrt();
        let share = (self.fit.solved.dof as f64 / left.len().max(1) as f64).sqrt();
        let expected = if self.weights.noise == Noise::Residual { f64::NAN } else { self.weights.rms_um() * share };
        let separation = Separation {
            sections: vec![SectionAt::whole("ring", 0.0)],
            unknowns: vec![Quantity::Form(0)],
            estimate,
            variance,
            freedom: self.freedom(),
            variance_from: VarianceFrom::Readings,
            observable,
            residual: Residual {
                rms_um,
                expected_rms_um: expected,
                chi2_per_dof: self.fit.chi2_per_dof,
                dof: self.fit.solved.dof,
                ..Residual::default()
            },
            ..Separation::default()
        };
        Some(Form { sections: vec![separation], radius_mm: self.config.ring_radius_mm })
    }

    /// Degrees of freedom behind the variances; 0 where the noise is stated.
    fn freedom(&self) -> usize {
        match self.weights.noise {
            Noise::Stated => 0,
            Noise::Repeats(dof) => dof,
            Noise::Residual => self.fit.solved.dof,
        }
    }

    /// What the result is made of.
    fn notes(&self, lobes: &[Lobe]) -> Vec<String> {
        let mut notes = Vec::new();
        let bounded: Vec<usize> = lobes.iter().filter(|lobe| lobe.bounded).map(|lobe| lobe.order).collect();
        if let (Some(bound), false) = (self.config.ring_form_um, bounded.is_empty()) {
            notes.push(format!(
                "lobing of orders {} is what is read, with the form of the ring: its uncertainty includes the bound of {bound} µm",
                listed(&bounded)
            ));
        }
        let evident: Vec<usize> = lobes.iter().filter(|lobe| lobe.evident).map(|lobe| lobe.order).collect();
        notes.push(format!("orders of lobing with evidence, which the compensation has: {}", listed(&evident)));
        notes
    }

    fn remarks(&self, lobes: &[Lobe]) -> Vec<String> {
        let mut remarks = self.touches.remarks.clone();
        let [lobing, form] = self.lost(lobes);
        // What the declared setups lose is a note of the separator; touches may lose more.
        let all: Vec<usize> = (0..self.config.setups.len()).collect();
        let declared = self.config.lost(&all);
        let declared_lobing: &[usize] = if self.config.ring_form_um.is_some() { &[] } else { &declared };
        if lobing[1..] != *declared_lobing || form[1..] != declared[..] {
            remarks.push(lost_orders(&listed(&lobing), &listed(&form)));
        }
        let directions = self.touches.setups.iter().map(|setup| {
            let of_setup = self.touches.all.iter().filter(|touch| touch.setup == *setup);
            of_setup.map(|touch| touch.direction).collect::<HashSet<usize>>().len()
        });
        let directions = directions.max().unwrap_or(0);
        let needed = 2 * self.config.max_order + 1;
        if directions < needed {
            remarks.push(format!(
                "{directions} directions determine orders up to {}: set `max_order` to that, or touch in {needed} directions and more",
                directions.saturating_sub(1) / 2
            ));
        }
        let silent: Vec<&str> = (0..self.config.setups.len())
            .filter(|setup| !self.touches.setups.contains(setup))
            .map(|setup| self.config.setups[setup].id.as_str())
            .collect();
        if !silent.is_empty() {
            remarks.push(format!("setups without touches: {}", silent.join(", ")));
        }
        if self.fit.solved.dof == 0 {
            remarks.push("as many parameters as touches: nothing is left for a residual".into());
        }
        if self.weights.noise != Noise::Residual {
            remarks.extend(far_below_noise(self.fit.chi2_per_dof, self.fit.solved.dof));
        }
        let centres = self.touches.setups.iter().map(|setup| {
            let [x, y] = self.touches.centre_um[*setup];
            x.hypot(y)
        });
        let far = centres.fold(0.0, f64::max);
        if far > 0.01 * 1e3 * self.config.ring_radius_mm {
            remarks.push(format!(
                "the ring was up to {far:.0} µm off the nominal centre: touches were not normal to its wall"
            ));
        }
        remarks
    }
}
