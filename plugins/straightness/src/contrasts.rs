//! Contrasts between traces: sums of what traces have at one place, in which part and slide drop out whatever they are there.
//!
//! With the traces' factors f (gain, and the cosine of the turn) at one place, rows h with h·f = 0 take out what is free there: the part and
//! the slide, or the part alone where a bound leaves the slide a few splines. Errors of one noise level keep their covariance in orthonormal rows: what is
//! correlated along z in the traces is correlated alike in their contrasts.

use runout_core::{
    consistency::{Kind, Structure, order::OrderModels},
    numerics::least_squares::{Basis, norm, orthonormal},
};

use crate::{design::Design, trace::AxialTrace};

/// Places along z at most.
const MOST_PLACES: f64 = 199.0;
/// Blocks of z that have to agree on an effect.
const BLOCKS: usize = 8;
/// Changes of a whole profile that correlated errors are made of, at most.
const MOST_CHANGES: usize = 40;

/// Contrasts of the readings of a [`Design`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Contrasts {
    /// Rows of contrasts, `[contrast][trace]`, orthonormal; first those between the traces of one setup.
    rows: Vec<Vec<f64>>,
    /// How many of them are of one setup.
    within: usize,
    /// z of the places, in mm.
    z_mm: Vec<f64>,
    /// Readings of each trace at each place, `[place][trace]`.
    cells: Vec<Vec<Vec<usize>>>,
    /// Readings that each is a mean of.
    pub averaged: f64,
}

/// Errors of one trace, about its own line, as its contrasts show them.
#[derive(Debug, Clone)]
pub(crate) struct TraceErrors {
    pub z_mm: Vec<f64>,
    /// Changes of the whole trace, each with a factor of its own of variance 1, in µm.
    pub changes_um: Vec<Vec<f64>>,
    /// Variance beside them that is correlated, at each place, in µm².
    pub left_um2: Vec<f64>,
    /// Variance of a reading that is independent of its neighbours, in µm².
    pub independent_um2: f64,
}

impl Contrasts {
    pub(crate) fn of(design: &Design) -> Self {
        let traces = design.data.traces.len();
        let mut used = vec![false; traces];
        design.readings.of.iter().for_each(|(trace, _)| used[*trace] = true);
        let shifted = |(trace, point): &(usize, usize)| {
            design.data.traces[*trace].z_mm[*point] + design.alterations[*trace].shift_mm
        };
        let ends = |trace: usize| {
            let shift_mm = design.alterations[trace].shift_mm;
            design.data.traces[trace].range_mm().map(|z| z + shift_mm)
        };
        let members = || (0..traces).filter(|trace| used[*trace]);
        let first = members().map(|trace| ends(trace)[0]).fold(f64::NEG_INFINITY, f64::max);
        let last = members().map(|trace| ends(trace)[1]).fold(f64::INFINITY, f64::min);
        let spacing = members().map(|trace| AxialTrace::spacing_mm(&design.data.traces[trace])).fold(0.0, f64::max);
        let steps = ((last - first) / spacing).round().min(MOST_PLACES);
        let unit = |trace: usize| (0..traces).map(|other| f64::from(u8::from(other == trace))).collect::<Vec<f64>>();
        let free = orthonormal(design.free(), &[], 1e-9);
        // A trace beside the others of its setup.
        let beside = |trace: usize| {
            let setup = design.data.setups[trace];
            let others: Vec<usize> = members().filter(|other| design.data.setups[*other] == setup).collect();
            let mut row = unit(trace);
            others.iter().for_each(|other| row[*other] -= (others.len() as f64).recip());
            row
        };
        let beside: Vec<Vec<f64>> = members().map(beside).filter(|row| norm(row) > 1e-6).collect();
        let within = orthonormal(beside.clone(), &free, 1e-6).len();
        let rows = orthonormal(beside.into_iter().chain(members().map(unit)).collect(), &free, 1e-6);
        if rows.is_empty() || steps.is_nan() || steps < 2.0 {
            return Self { averaged: 1.0, ..Self::default() };
        }
        let width = (last - first) / steps;
        let mut cells = vec![vec![Vec::new(); traces]; steps as usize + 1];
        for (reading, place) in design.readings.of.iter().enumerate() {
            let at = ((shifted(place) - first) / width).round();
            if at >= 0.0
                && let Some(cell) = cells.get_mut(at as usize)
            {
                cell[place.0].push(reading);
            }
        }
        let is_full = |cell: &Vec<Vec<usize>>| cell.iter().zip(&used).all(|(own, used)| !used || !own.is_empty());
        let (z_mm, cells): (Vec<f64>, Vec<_>) = (cells.into_iter().enumerate())
            .filter(|(_, cell)| is_full(cell))
            .map(|(at, cell)| (first + width * at as f64, cell))
            .unzip();
        let readings: usize = cells.iter().flatten().map(Vec::len).sum();
        let averaged = readings as f64 / (cells.len() * members().count()).max(1) as f64;
        Self { rows, within, z_mm, cells, averaged }
    }

    /// The contrasts of what is given at each reading, one contrast after the other.
    pub(crate) fn made(&self, values: &[f64]) -> Vec<f64> {
        let mean = |own: &Vec<usize>| own.iter().map(|reading| values[*reading]).sum::<f64>() / own.len().max(1) as f64;
        let means: Vec<Vec<f64>> = self.cells.iter().map(|cell| cell.iter().map(mean).collect()).collect();
        let of = |row: &Vec<f64>, means: &Vec<f64>| row.iter().zip(means).map(|(weight, mean)| weight * mean).sum();
        self.rows.iter().flat_map(|row| means.iter().map(move |means| of(row, means))).collect()
    }

    /// What is declared of them: errors along z, and blocks of z.
    pub(crate) fn structure(&self) -> Structure {
        let places = self.z_mm.len();
        let each = || (0..self.rows.len()).flat_map(|row| (0..places).map(move |place| (row, place)));
        let names = (1..=BLOCKS).map(|block| block.to_string()).collect();
        let structure = Structure::default()
            .along("z", each().map(|(row, _)| row).collect(), each().map(|(_, place)| self.z_mm[place]).collect())
            .divided("z-blocks", Kind::Blocks, each().map(|(_, place)| place * BLOCKS / places).collect(), names);
        if self.within == 0 || self.within == self.rows.len() {
            return structure;
        }
        // What the setups contradict each other by is as small as what the traces of one do, or the model lacks something.
        let names = ["the difference of traces of one setup", "the difference between the setups"];
        let level = each().map(|(row, _)| usize::from(row >= self.within)).collect();
        structure.divided("differences", Kind::Alike, level, names.map(str::to_owned).to_vec())
    }

    /// Errors of one trace from models of those of its contrasts, which are of one covariance.
    pub(crate) fn trace_errors(&self, models: &OrderModels) -> TraceErrors {
        let covariance = models.covariance();
        let line = Basis::of(vec![vec![1.0; self.z_mm.len()], self.z_mm.clone()]);
        let (mut changes_um, mut left_um2) = covariance.principal(0, line.columns(), MOST_CHANGES);
        // Few independent numbers know the size badly.
        let wider = runout_core::consistency::check::factor(1.0, covariance.freedom());
        changes_um.iter_mut().flatten().for_each(|change| *change *= wider);
        left_um2.iter_mut().for_each(|variance| *variance *= wider * wider);
        let independent_um2 = covariance.independent * self.averaged * wider * wider;
        TraceErrors { z_mm: self.z_mm.clone(), changes_um, left_um2, independent_um2 }
    }
}

impl TraceErrors {
    /// Values at its places, at others.
    pub(crate) fn at(&self, values: &[f64], z_mm: &[f64]) -> Vec<f64> {
        let of = |z: &f64| {
            let after = self.z_mm.partition_point(|own| own < z).clamp(1, self.z_mm.len().max(2) - 1);
            let [from, to] = [after - 1, after].map(|at| (self.z_mm[at], values[at]));
            let share = ((z - from.0) / (to.0 - from.0)).clamp(0.0, 1.0);
            from.1 + share * (to.1 - from.1)
        };
        z_mm.iter().map(of).collect()
    }
}
