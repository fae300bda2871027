//! Positions, run-out and lines of a wall, whose sections' centres are known.

use super::{
    Evaluate, Filter, Label, centres,
    wall::{Look, Ring, Wall},
};
use crate::Value;
use runout_draws::{Errors, LARGEST, Uncertainty};
use runout_standards::{
    cylindricity::{Generatrices, MedianLine, Points, Reference, Section},
    position::{Axis, Positions},
};

/// Draws of what is fitted to each of a wall's generatrices.
const DRAWS_OF_LINES: usize = 200;
/// Values of lines, in their order.
const LINES: [&str; 5] = ["CYLtt", "STRsg", "STRsa", "coaxiality", "parallelism"];
/// Those of them that are the largest size of what is linear in the form.
const SIZES: [&str; 3] = ["CYLtt", "STRsg", "parallelism"];
/// More times the largest error than any of these is.
const LARGEST_SIZE: f64 = 6.0;

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
        let mut values = self.evaluate(filter, labels, |Look { sections, .. }, found| {
            let of = |rings: &[usize]| rings.iter().filter_map(|ring| sections.get(*ring).copied()).collect::<Vec<_>>();
            let axis = Axis::through(&of(datums), self.radius_mm);
            let positions = axis.map(|axis| Positions::about(&of(others), self.radius_mm, &axis));
            let each = positions.iter().flat_map(|all| all.eccentricity_um.iter().zip(&all.circular_runout_um));
            let mut all: Vec<f64> = each.flat_map(|(eccentricity, runout)| [*eccentricity, *runout]).collect();
            all.resize(2 * others.len(), f64::NAN);
            found.extend(all);
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.coaxiality_um));
            found.push(positions.as_ref().map_or(f64::NAN, |all| all.total_runout_um));
        });
        for value in values.iter_mut().filter(|value| value.symbol == "eccentricity") {
            let ring = others.iter().find(|ring| Some(name(ring)) == value.reference);
            let std_um = ring.map(|ring| self.centre_std_um(filter, *ring, datums));
            value.uncertainty = value.uncertainty.take().zip(std_um).map(|(known, std_um)| {
                // The centre of an arc takes errors of other orders too.
                let std_um = if self.is_whole() { std_um } else { std_um.max(known.std) };
                Uncertainty::of_amplitude(value.value, std_um, 0)
            });
        }
        self.diameters(&mut values, filter, datums, others);
        values
    }

    /// Gives diameters that contain the centres of sections an interval that covers the true value near 0 too.
    fn diameters(&self, values: &mut [Value], filter: &Filter, datums: &[usize], others: &[usize]) {
        let largest_um = others.iter().map(|ring| self.centre_std_um(filter, *ring, datums)).fold(0.0, f64::max);
        for value in values.iter_mut().filter(|value| ["coaxiality", "STRsa"].contains(&value.symbol.as_str())) {
            let known = value.uncertainty.take();
            value.uncertainty = known.map(|known| centres::of_diameter(known, value.value, largest_um, others.len()));
        }
    }

    /// Standard uncertainty of a section's centre beside the axis through those of others, along x and along y.
    fn centre_std_um(&self, filter: &Filter, ring: usize, datums: &[usize]) -> f64 {
        let z_mm: Vec<f64> = self.rings.iter().map(|ring| ring.z_mm).collect();
        let of_order_1 = |ring: &Ring| {
            let sources = ring.noise.iter().map(|(_, amplitudes)| filter.harmonics(amplitudes));
            sources.filter_map(|amplitudes| Some(amplitudes.get(1)?.norm_sqr())).sum()
        };
        let variance: Vec<f64> = self.rings.iter().map(of_order_1).collect();
        centres::std_um(&z_mm, &variance, ring, datums)
    }

    /// What needs the sections' centres and mean radii.
    pub(super) fn lines(&self) -> Vec<Value> {
        let coaxiality = "ISO 1101:2017, coaxiality: the largest of a section's LSCI centre with the axis";
        let generatrices = "ISO 12180-1:2011, generatrix straightness deviation: the largest STRt of the generatrices";
        let median_line = "ISO 12180-1:2011, straightness deviation of the extracted median line: a diameter";
        let parallelism = "ISO 1101:2017, parallelism: the largest of the generatrices";
        let labels = vec![
            Label::new(LINES[0], "µm", "ISO 12180-1:2011, cylinder taper", "LSCY"),
            Label::new(LINES[1], "µm", generatrices, "LSLI of generatrices"),
            Label::new(LINES[2], "µm", median_line, "LSLI of the median line"),
            Label::new(LINES[3], "µm", coaxiality, "LSCY"),
            Label::new(LINES[4], "µm", parallelism, "LSLI of the opposite generatrix"),
        ];
        let filter = Filter::low_pass(None);
        let mut values =
            self.evaluate(&filter, labels, |Look { sections, .. }, found| found.extend(self.of_lines(sections)));
        let all: Vec<usize> = (0..self.rings.len()).collect();
        self.diameters(&mut values, &filter, &all, &all);
        self.sizes(&mut values, &filter);
        values
    }

    /// The values of [`LINES`]; NaN where there is none.
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

    /// Gives the largest sizes of lines an interval that covers the true value near 0 too.
    fn sizes(&self, values: &mut [Value], filter: &Filter) {
        let errors = self.errors(filter).unwrap_or_default();
        let most_um = LARGEST_SIZE * LARGEST * errors.iter().map(Errors::std_um).fold(0.0, f64::max);
        let is_size =
            |value: &&mut Value| SIZES.contains(&value.symbol.as_str()) && !centres::is_clear(value.value, most_um);
        let mut values: Vec<&mut Value> = values.iter_mut().filter(is_size).collect();
        if values.is_empty() || errors.is_empty() {
            return;
        }
        let of_noise = self.of_noise(filter, DRAWS_OF_LINES, |sections| self.of_lines(sections));
        for value in &mut values {
            let Some(place) = LINES.iter().position(|symbol| *symbol == value.symbol) else { continue };
            let of_noise = of_noise.iter().map(|all| all[place]).collect();
            value.uncertainty = value.uncertainty.take().map(|known| centres::of_size(known, value.value, of_noise));
        }
    }
}
