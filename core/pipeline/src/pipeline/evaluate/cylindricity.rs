//! Cylindricity of a wall.

use super::{
    Filter, Label,
    wall::{About, DecidedBy, Wall},
};
use runout_numerics::fourier::Fourier;
use runout_standards::{
    Value,
    cylindricity::{Disturbed, Points, Reference, Section, Series, Values},
    uncertainty::{Errors, LARGEST},
};

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
        let mut disturbed: Vec<Option<Disturbed>> = Vec::new();
        self.evaluate(
            filter,
            labels,
            (self.draws(), DecidedBy::AllSections),
            About::WithoutNoise,
            |sections, largest_um, found| {
                let is_first = disturbed.is_empty();
                let points = is_first.then(|| Points::of_sections(self.radius_mm, sections));
                let mut series =
                    (!is_first && largest_um.is_none()).then(|| Series::new(sections, &harmonics, self.radius_mm));
                for (index, reference) in references.iter().enumerate() {
                    let about = if let Some(points) = &points {
                        // The first wall is the one that errors are drawn about.
                        let prepare = |usual_um| {
                            Disturbed::new(*reference, sections, points, self.radius_mm, usual_um, !self.placed)
                        };
                        disturbed.push(usual_um.and_then(prepare));
                        disturbed.last().and_then(Option::as_ref).map(Disturbed::about)
                    } else if let Some(series) = &mut series {
                        series.about(*reference).ok().map(|found| found.1)
                    } else {
                        let prepared = disturbed.get_mut(index).and_then(Option::as_mut);
                        prepared.zip(largest_um).and_then(|(wall, largest_um)| wall.values(sections, largest_um))
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
            },
        )
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
