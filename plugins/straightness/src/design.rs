//! The linear part of the model: splines of part and slide, and a line for each trace.

use std::sync::Arc;

use runout_core::numerics::least_squares::{Basis, norm};

use crate::{
    data::Data,
    effects::{Alteration, Content},
    spline::{Banded, Knots, Local},
    trace::AxialTrace,
};

/// Knots of the splines are this many spacings of the coarsest trace apart.
const KNOT_SPACINGS: f64 = 1.5;
/// A column of which the splines leave less than this share is in their span.
const INDEPENDENT: f64 = 1e-7;

/// Readings that something contradicts, and the splines that they are fitted by.
pub(crate) struct Readings {
    /// Trace and point, in the order of z.
    pub of: Vec<(usize, usize)>,
    part: Knots,
    slide: Option<Knots>,
    /// The first spline of each setup's own; the same where the slide has its own.
    first: [usize; 2],
    splines: usize,
}

impl Data {
    /// Traces of a setup.
    pub(crate) fn repeats(&self, setup: usize) -> usize {
        self.setups.iter().filter(|own| **own == setup).count()
    }

    fn readings(&self) -> Readings {
        let used = |trace: usize| self.slide_cutoff_mm.is_some() || self.repeats(self.setups[trace]) > 1;
        let mut of: Vec<(usize, usize)> = (0..self.traces.len())
            .filter(|trace| used(*trace))
            .flat_map(|trace| (0..self.traces[trace].z_mm.len()).map(move |point| (trace, point)))
            .collect();
        of.sort_by(|a, b| self.traces[a.0].z_mm[a.1].total_cmp(&self.traces[b.0].z_mm[b.1]));
        let ends = |end: usize| self.traces.iter().map(move |trace| trace.range_mm()[end]);
        let range = [ends(0).fold(f64::INFINITY, f64::min), ends(1).fold(f64::NEG_INFINITY, f64::max)];
        let spacing = self.traces.iter().map(AxialTrace::spacing_mm).fold(0.0, f64::max);
        let part = Knots::over(range, KNOT_SPACINGS * spacing);
        let slide = self.slide_cutoff_mm.map(|cutoff| Knots::for_waves(range, cutoff));
        let first = [0, if slide.is_some() { 0 } else { part.splines() }];
        Readings { of, part, slide, first, splines: first[1] + part.splines() }
    }
}

/// The linear part of the model with some effects applied.
pub(crate) struct Design {
    pub data: Arc<Data>,
    pub readings: Readings,
    pub alterations: Vec<Alteration>,
    /// The part's splines at each reading, and what they count there.
    local: Vec<(Local, f64)>,
    /// Of the slide's.
    slide: Vec<(Local, f64)>,
    /// Lines of the traces and splines of the slide, `[column][reading]`, without those in the span of others.
    pub dense: Vec<Vec<f64>>,
    /// Which of the slide's splines each column is; nothing for lines.
    dense_slide: Vec<Option<usize>>,
    /// What the part's splines leave of them.
    basis: Basis,
    pub rank: usize,
}

impl Design {
    /// Of these traces, altered so.
    pub(crate) fn new(data: &Arc<Data>, mut alterations: Vec<Alteration>) -> Self {
        let readings = data.readings();
        if readings.slide.is_none() {
            // A setup's own splines are what the probe sees of the part, turned or not, and move with its traces: only the
            // differences of their shifts count.
            for alteration in &mut alterations {
                alteration.turned_deg = 0.0;
            }
            for setup in [0, 1] {
                let of = |own: &(usize, &usize)| *own.1 == setup;
                let members: Vec<usize> = data.setups.iter().enumerate().filter(of).map(|(trace, _)| trace).collect();
                let mean = members.iter().map(|trace| alterations[*trace].shift_mm).sum::<f64>() / members.len() as f64;
                for trace in members {
                    alterations[trace].shift_mm -= mean;
                }
            }
        }
        let at = |knots: &Knots, (trace, point): (usize, usize)| {
            knots.at(data.traces[trace].z_mm[point] + alterations[trace].shift_mm)
        };
        let sign = |trace: usize| if data.setups[trace] == 0 { 1.0 } else { -1.0 };
        let gain = |trace: usize| 1.0 + alterations[trace].gain;
        let local = readings.of.iter().map(|place| {
            let mut local = at(&readings.part, *place);
            local.start += readings.first[data.setups[place.0]];
            (local, gain(place.0) * alterations[place.0].cosine())
        });
        let local: Vec<(Local, f64)> = local.collect();
        let slide = match &readings.slide {
            Some(knots) => {
                let own = readings.of.iter().map(|place| (at(knots, *place), gain(place.0) * sign(place.0)));
                own.collect()
            }
            None => Vec::new(),
        };
        let mut design = Self {
            data: Arc::clone(data),
            readings,
            alterations,
            local,
            slide,
            dense: Vec::new(),
            dense_slide: Vec::new(),
            basis: Basis::of(Vec::new()),
            rank: 0,
        };
        design.add_dense();
        design
    }

    /// Lines and the slide's splines, as far as they are independent of the part's splines and of each other.
    fn add_dense(&mut self) {
        let data = Arc::clone(&self.data);
        let of = &self.readings.of;
        let line = |own: usize, power: i32| -> Vec<f64> {
            let value = |(trace, point): &(usize, usize)| {
                let z_mm = data.traces[*trace].z_mm[*point];
                if *trace == own { ((z_mm - data.middle_mm) / data.length_mm).powi(power) } else { 0.0 }
            };
            of.iter().map(value).collect()
        };
        let lines = (0..data.traces.len()).flat_map(|trace| [(None, line(trace, 0)), (None, line(trace, 1))]);
        let splines = (0..self.readings.slide.map_or(0, |knots| knots.splines())).map(|spline| {
            let value = |(local, factor): &(Local, f64)| {
                let own = spline.checked_sub(local.start).and_then(|index| local.value.get(index));
                factor * own.copied().unwrap_or(0.0)
            };
            (Some(spline), self.slide.iter().map(value).collect::<Vec<f64>>())
        });
        let columns: Vec<(Option<usize>, Vec<f64>)> =
            lines.chain(splines).filter(|(_, column)| column.iter().any(|value| *value != 0.0)).collect();
        let (solutions, rank) =
            self.splines_of(&columns.iter().map(|(_, column)| column.as_slice()).collect::<Vec<_>>());
        self.rank = rank;
        for ((slide, column), solution) in columns.into_iter().zip(solutions) {
            let left = self.less_splines(&column, &solution);
            if norm(&left) < INDEPENDENT * norm(&column) {
                continue;
            }
            let next = self.basis.extended(vec![left]);
            if !next.dependent() {
                self.basis = next;
                self.dense.push(column);
                self.dense_slide.push(slide);
            }
        }
        self.rank += self.basis.rank();
    }

    /// Least-squares coefficients of the part's splines for some columns, and their rank.
    fn splines_of(&self, columns: &[&[f64]]) -> (Vec<Vec<f64>>, usize) {
        let mut problem = Banded::new(self.readings.splines, columns.len());
        let mut sides = vec![0.0; columns.len()];
        for (reading, (local, factor)) in self.local.iter().enumerate() {
            sides.iter_mut().zip(columns).for_each(|(side, column)| *side = column[reading]);
            problem.add(local.start, local.value.map(|value| value * factor), &mut sides);
        }
        (problem.solve(), problem.rank())
    }

    fn less_splines(&self, column: &[f64], coefficients: &[f64]) -> Vec<f64> {
        let rows = column.iter().zip(&self.local);
        rows.map(|(value, (local, factor))| value - factor * local.of(coefficients)).collect()
    }

    /// What each trace has of the deviations that are free at each place, `[deviation][trace]`.
    pub(crate) fn free(&self) -> Vec<Vec<f64>> {
        let each = self.alterations.iter().zip(&self.data.setups);
        let seen = each.map(|(one, setup)| ((1.0 + one.gain) * one.cosine(), *setup));
        if self.readings.slide.is_some() {
            return vec![seen.map(|(seen, _)| seen).collect()];
        }
        let of = |own: usize| seen.clone().map(|(seen, setup)| if setup == own { seen } else { 0.0 }).collect();
        vec![of(0), of(1)]
    }

    /// The share of the readings' degrees of freedom that splines leave to each setup's.
    pub(crate) fn left_by_splines(&self) -> [f64; 2] {
        let own = |setup: usize| self.readings.of.iter().filter(|(trace, _)| self.data.setups[*trace] == setup).count();
        let share = |splines: usize, readings: usize| 1.0 - splines as f64 / readings.max(1) as f64;
        if self.readings.slide.is_some() {
            return [share(self.readings.splines, self.readings.of.len()); 2];
        }
        [0, 1].map(|setup| share(self.readings.part.splines(), own(setup)).max(0.0))
    }

    /// The lines of the traces among the columns beside the splines.
    pub(crate) fn lines(&self) -> Vec<Vec<f64>> {
        let all = self.dense.iter().zip(&self.dense_slide);
        all.filter(|(_, slide)| slide.is_none()).map(|(column, _)| column.clone()).collect()
    }

    /// What everything that is fitted leaves of a column.
    pub(crate) fn left(&self, column: &[f64]) -> Vec<f64> {
        let (solutions, _) = self.splines_of(&[column]);
        let mut left = solutions.first().map_or_else(Vec::new, |solution| self.less_splines(column, solution));
        self.basis.remove_from(&mut left);
        left
    }

    /// The readings less what is added to them whatever part and slide are.
    pub(crate) fn readings_um(&self) -> Vec<f64> {
        let value = |(trace, point): &(usize, usize)| {
            let alteration = &self.alterations[*trace];
            let added = (1.0 + alteration.gain) * alteration.added(&self.data.place(*trace, *point));
            self.data.traces[*trace].reading_um[*point] - added
        };
        self.readings.of.iter().map(value).collect()
    }

    /// Part and slide at each reading. Where the slide has no splines of its own, the part's are those of the sum of both.
    pub(crate) fn contents(&self, readings_um: &[f64]) -> Vec<Content> {
        let (solutions, _) = self.splines_of(&[readings_um]);
        let Some(alone) = solutions.first() else { return Vec::new() };
        let dense = self.basis.coefficients(&self.less_splines(readings_um, alone));
        let mut rest = readings_um.to_vec();
        for (column, value) in self.dense.iter().zip(&dense) {
            rest.iter_mut().zip(column).for_each(|(entry, column)| *entry -= value * column);
        }
        let (solutions, _) = self.splines_of(&[rest.as_slice()]);
        let mut slide = vec![0.0; self.readings.slide.map_or(0, |knots| knots.splines())];
        for (spline, value) in self.dense_slide.iter().zip(&dense) {
            if let Some(entry) = spline.and_then(|spline| slide.get_mut(spline)) {
                *entry = *value;
            }
        }
        let part = solutions.first().map_or(&[][..], Vec::as_slice);
        let content = |(reading, (local, _)): (usize, &(Local, f64))| {
            let slide =
                self.slide.get(reading).map_or([0.0; 2], |(local, _)| [local.of(&slide), local.slope_of(&slide)]);
            Content { part: [local.of(part), local.slope_of(part)], slide }
        };
        self.local.iter().enumerate().map(content).collect()
    }
}
