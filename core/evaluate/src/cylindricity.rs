//! Cylindricity of a wall.

use super::{
    Filter, Label,
    wall::{Look, Wall},
};
use crate::Value;
use runout_draws::{Errors, KINDS, LARGEST};
use runout_numerics::fourier::Fourier;
use runout_standards::cylindricity::{Disturbed, Points, Reference, Section, Series, Values};

impl Wall {
    pub(super) fn cylindricity(&self, filter: &Filter, references: &[Reference]) -> Vec<Value> {
        let mut labels = Vec::new();
        for reference in references {
            let name = if self.placed { "" } else { " of centred sections" };
            let name = format!("{}{name}", reference.cylinder_symbol());
            let cyl = |symbol, meaning: &str| {
                Label::new(symbol, "µm", format!("ISO 12180-1:2011, {meaning} cylindricity deviation"), name.clone())
            };
            labels.push(cyl("CYLt", "peak-to-valley"));
            if *reference == Reference::LeastSquares {
                labels.extend([cyl("CYLp", "peak-to-reference"), cyl("CYLv", "reference-to-valley")]);
                labels.push(cyl("CYLq", "root mean square"));
            }
        }
        let usual_um =
            self.errors(filter).map(|errors| LARGEST * errors.iter().map(Errors::std_um).fold(0.0, f64::max));
        let harmonics: Vec<_> = self.rings.iter().map(|ring| filter.harmonics(&ring.harmonics)).collect();
        let mut disturbed: Vec<Vec<Option<Disturbed>>> = vec![Vec::new(); KINDS];
        self.evaluate(filter, labels, |Look { kind, sections, largest_um }, found| {
            let mut series = kind.is_none().then(|| Series::new(sections, &harmonics, self.radius_mm));
            if let (Some(kind), None) = (kind, largest_um) {
                let points = Points::of_sections(self.radius_mm, sections);
                let prepare = |reference: &Reference| {
                    Disturbed::new(*reference, sections, &points, self.radius_mm, usual_um?, !self.placed)
                };
                disturbed[kind] = references.iter().map(prepare).collect();
            }
            for (index, reference) in references.iter().enumerate() {
                let about = match (&mut series, kind, largest_um) {
                    (Some(series), ..) => series.about(*reference).ok().map(|found| found.1),
                    (None, Some(kind), None) => disturbed[kind][index].as_ref().map(Disturbed::about),
                    (None, Some(kind), Some(largest_um)) => {
                        disturbed[kind][index].as_mut().and_then(|wall| wall.values(sections, largest_um))
                    }
                    (None, None, _) => None,
                };
                let of = |value: fn(&Values) -> f64| about.as_ref().map_or(f64::NAN, value);
                found.push(of(|values| values.cylt_um));
                if *reference == Reference::LeastSquares {
                    found.extend([
                        of(|values| values.cylp_um),
                        of(|values| values.cylv_um),
                        of(|values| values.cylq_um),
                    ]);
                }
            }
        })
    }

    /// Why the wall does not have the reference cylinders that are asked for, each with its reason.
    pub(super) fn missing_cylinders(&self, references: &[Reference]) -> Vec<String> {
        if self.is_whole() {
            return Vec::new();
        }
        let mut fourier = Fourier::new(self.count);
        let forms = self.rings.iter().map(|ring| {
            let mut form_um = fourier.synthesise(ring.harmonics.iter().copied()).to_vec();
            ring.gaps.blank(&mut form_um);
            form_um
        });
        let forms: Vec<Vec<f64>> = forms.collect();
        let sections = self.rings.iter().zip(&forms);
        let sections: Vec<Section> =
            sections.map(|(ring, form_um)| Section { z_mm: ring.z_mm, angles: &self.angles, form_um }).collect();
        let points = Points::of_sections(self.radius_mm, &sections);
        let missing = references.iter().filter_map(|reference| {
            let reason = points.determine(*reference).err()?;
            Some(format!("no CYLt about {}: {reason}", reference.cylinder_symbol()))
        });
        missing.collect()
    }
}
