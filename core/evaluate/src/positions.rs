//! Positions, run-out and lines of a wall, whose sections' centres are known.

use super::{
    Evaluate, Filter, Label,
    wall::{Look, Ring, Wall},
};
use crate::Value;
use runout_standards::{
    cylindricity::{Generatrices, MedianLine, Points, Reference, Section},
    position::{Axis, Positions},
};

impl Wall {
    /// Positions about the datum of the sections that are not in it, or why there are none.
    pub(super) fn about_datum(&self, evaluate: &Evaluate) -> Result<Vec<Value>, String> {
        let datum = &evaluate.datum;
        let unknown = |name: &&String| !self.rings.iter().any(|ring| ring.is_named(std::slice::from_ref(*name)));
        if let Some(name) = datum.iter().find(unknown) {
            return Err(format!("datum: there is no section `{name}`"));
        }
        if !self.placed {
            return Err("datum: the centres of sections are not known".into());
        }
        let (datums, others): (Vec<usize>, Vec<usize>) =
            (0..self.rings.len()).partition(|ring| self.rings[*ring].is_named(datum));
        let filters = evaluate.cutoffs_upr(self.held.highest).into_iter().map(|cutoff| evaluate.low_pass(cutoff));
        Ok(filters.flat_map(|filter| self.positions(&filter, &datum.join(", "), &datums, &others)).collect())
    }

    /// Positions of sections about the axis through others.
    fn positions(&self, filter: &Filter, datum: &str, datums: &[usize], others: &[usize]) -> Vec<Value> {
        let axis = format!("axis of {datum}");
        let name = |ring: &usize| {
            let Ring { station, id, .. } = &self.rings[*ring];
            format!("section {id} of {station}, {axis}")
        };
        let mut labels: Vec<Label> = Vec::new();
        for ring in others {
            let centre = "distance of the section's LSCI centre from the datum axis";
            labels.push(Label::new("eccentricity", "µm", centre, name(ring)));
            labels.push(Label::new("circular-run-out", "µm", "ISO 1101:2017, circular run-out, radial", name(ring)));
        }
        let coaxiality = "ISO 1101:2017, coaxiality: twice the largest eccentricity";
        labels.push(Label::new("coaxiality", "µm", coaxiality, axis.clone()));
        labels.push(Label::new("total-run-out", "µm", "ISO 1101:2017, total run-out, radial", axis.clone()));
        self.evaluate(filter, labels, |Look { sections, .. }, found| {
            let of = |rings: &[usize]| rings.iter().filter_map(|ring| sections.get(*ring).copied()).collect::<Vec<_>>();
            let axis = Axis::through(&of(datums), self.radius_mm);
            let positions = axis.map(|axis| Positions::about(&of(others), self.radius_mm, &axis));
            let each = positions.iter().flat_map(|all| all.eccentricity_um.iter().zip(&all.circular_runout_um));
            let mut all: Vec<f64> = each.flat_map(|(eccentricity, runout)| [*eccentricity, *runout]).collect();
            all.resize(2 * others.len(), f64::NAN);
            found.extend(all);
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.coaxiality_um));
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.total_runout_um));
        })
    }

    /// What needs the sections' centres and mean radii.
    pub(super) fn lines(&self) -> Vec<Value> {
        let coaxiality = "ISO 1101:2017, coaxiality: the largest of a section's LSCI centre with the axis";
        let generatrices = "ISO 12180-1:2011, generatrix straightness deviation: the largest STRt of the generatrices";
        let median_line = "ISO 12180-1:2011, straightness deviation of the extracted median line: a diameter";
        let parallelism = "ISO 1101:2017, parallelism: the largest of the generatrices";
        let labels = vec![
            Label::new("CYLtt", "µm", "ISO 12180-1:2011, cylinder taper", "LSCY"),
            Label::new("STRsg", "µm", generatrices, "LSLI of generatrices"),
            Label::new("STRsa", "µm", median_line, "LSLI of the median line"),
            Label::new("coaxiality", "µm", coaxiality, "LSCY"),
            Label::new("parallelism", "µm", parallelism, "LSLI of the opposite generatrix"),
        ];
        let filter = Filter::low_pass(None);
        self.evaluate(&filter, labels, |Look { sections, .. }, found| found.extend(self.of_lines(sections)))
    }

    /// Taper, straightness of generatrices and of the median line, coaxiality and parallelism, µm; NaN where there is none.
    fn of_lines(&self, sections: &[Section]) -> [f64; 5] {
        let lscy = Points::of_sections(self.radius_mm, sections).reference(Reference::LeastSquares);
        let lines = lscy.as_ref().and_then(|lscy| Generatrices::of(sections, self.radius_mm, lscy));
        let median = lscy.as_ref().map(|lscy| MedianLine::of(sections, self.radius_mm, lscy));
        let coaxiality = median.iter().flat_map(|median| &median.coaxiality_um).copied().fold(f64::NAN, f64::max);
        [
            lines.as_ref().map_or(f64::NAN, Generatrices::cyltt_um),
            lines.as_ref().map_or(f64::NAN, Generatrices::largest_strt_um),
            median.as_ref().map_or(f64::NAN, |median| median.straightness_um),
            coaxiality,
            lines.as_ref().map_or(f64::NAN, Generatrices::largest_parallelism_um),
        ]
    }
}
