//! Values of one section: roundness and texture around the part.

use super::{Evaluate, Filter, Group, Label, labelled};
use crate::{
    Complex64,
    evaluate::{
        Value,
        roundness::{Angles, Points, Reference, Values},
        texture::{self, Settings},
        uncertainty::{DRAWS, Errors, monte_carlo_of, seed},
    },
    numerics::fourier::Fourier,
    pipeline::result::StationResult,
    separation::Quantity,
};

/// The values of a section whose nominal radius is known.
pub fn section_values(result: &StationResult, section: usize, evaluate: &Evaluate, radius_mm: f64) -> Vec<Value> {
    let Some(form) = Form::of(result, section, radius_mm) else { return Vec::new() };
    let mut values = Vec::new();
    for cutoff in evaluate.cutoffs_upr(form.highest) {
        let references: &[Reference] = if evaluate.has(Group::Roundness) { &evaluate.references } else { &[] };
        let papers_ra = cutoff.is_none() && evaluate.has(Group::Texture);
        values.extend(form.round(&Filter::low_pass(cutoff), references, papers_ra));
    }
    if let (true, Some(lambda_c)) = (evaluate.has(Group::Texture), evaluate.lambda_c_mm) {
        values.extend(form.texture(&Filter::between(evaluate.lambda_s_mm, Some(lambda_c), radius_mm), lambda_c));
    }
    values
}

/// One section's form without level and centring, which are no form deviation also where the method knows them.
struct Form {
    harmonics: Vec<Complex64>,
    variance: Vec<f64>,
    highest: usize,
    lost: Vec<usize>,
    angles: usize,
    radius_mm: f64,
    seed: u64,
}

impl Form {
    fn of(result: &StationResult, section: usize, radius_mm: f64) -> Option<Self> {
        let separation = &result.separation;
        let unknown = separation.position(Quantity::Form(section))?;
        let harmonics = separation.coefficients(unknown).enumerate();
        let width = separation.unknowns.len();
        let id = separation.sections.get(section).map_or("", |at| at.id.as_str());
        (result.angles > 1).then(|| Self {
            harmonics: harmonics.map(|(order, value)| if order < 2 { Complex64::ZERO } else { value }).collect(),
            variance: separation.variance.iter().skip(unknown).step_by(width).copied().collect(),
            highest: separation.max_order(),
            lost: separation.lost_orders(unknown).into_iter().filter(|order| *order >= 2).collect(),
            angles: result.angles,
            radius_mm,
            seed: seed(&[&result.station, id]),
        })
    }

    /// Everything that is computed from one filtered profile, from one set of draws.
    fn evaluate(
        &self,
        filter: &Filter,
        labels: Vec<Label>,
        mut values: impl FnMut(&[f64], &mut Vec<f64>),
    ) -> Vec<Value> {
        if labels.is_empty() {
            return Vec::new();
        }
        let mut fourier = Fourier::new(self.angles);
        let form_um = fourier.synthesise(filter.harmonics(&self.harmonics)).to_vec();
        let mut errors = Errors::new(&filter.variance(&self.variance), 2, self.seed);
        let draws = if errors.is_some() { DRAWS } else { 0 };
        let mut drawn = form_um.clone();
        let found = monte_carlo_of(draws, |disturbed, found| {
            if let (true, Some(errors)) = (disturbed, &mut errors) {
                errors.draw(&mut fourier, &form_um, &mut drawn);
            }
            values(&drawn, found);
        });
        labelled(labels, found, filter, self.highest, &self.lost, 1.0)
    }

    fn round(&self, filter: &Filter, references: &[Reference], papers_ra: bool) -> Vec<Value> {
        let mut labels = Vec::new();
        for reference in references {
            let ron = |symbol, meaning: &str| {
                Label::new(symbol, "µm", format!("ISO 12181-1:2011, {meaning} roundness deviation"), reference.symbol())
            };
            labels.push(ron("RONt", "peak-to-valley"));
            if *reference == Reference::LeastSquares {
                labels.extend([ron("RONp", "peak-to-reference"), ron("RONv", "reference-to-valley")]);
                labels.push(ron("RONq", "root mean square"));
            }
        }
        if papers_ra {
            let source = "Qiao, Xu, Zhao 2024: unfiltered circumferential profile";
            labels.push(Label::new("Ra", "µm", source, "mean line"));
        }
        let angles = Angles::equal(self.angles);
        let mut points = Points::default();
        self.evaluate(filter, labels, |profile_um, found| {
            if !references.is_empty() {
                points.set_profile(&angles, profile_um, self.radius_mm);
            }
            for reference in references {
                let about = points.reference(*reference).map(|circle| points.values(&circle));
                let of = |value: fn(&Values) -> f64| about.as_ref().map_or(f64::NAN, value);
                found.push(of(|values| values.ront_um));
                if *reference == Reference::LeastSquares {
                    found.extend([
                        of(|values| values.ronp_um),
                        of(|values| values.ronv_um),
                        of(|values| values.ronq_um),
                    ]);
                }
            }
            if papers_ra {
                found.push(texture::ra_um(profile_um));
            }
        })
    }

    fn texture(&self, filter: &Filter, lambda_c_mm: f64) -> Vec<Value> {
        let label = |(symbol, unit, clause): &(&'static str, &'static str, &str)| {
            Label::new(symbol, unit, format!("ISO 21920-2:2021, {clause}"), "mean line")
        };
        let settings = Settings { section_mm: Some(lambda_c_mm), ..Settings::default() };
        self.evaluate(filter, texture::PARAMETERS.iter().map(label).collect(), |profile_um, found| {
            let texture = texture::around(profile_um, self.radius_mm, &settings);
            found.extend(texture.parameters().iter().map(|parameter| parameter.value));
        })
    }
}
