//! What part and slide come to with effects applied, and how they change with each parameter.

use runout_core::{
    closed_loop::{Bias, Setting},
    numerics::least_squares::Basis,
};

use crate::{
    data::{Data, Results},
    effects::{Alteration, Candidate, Kind, alterations},
    grid::Grid,
    interpolate::{cubic, cubic_slope},
    trace::AxialTrace,
};

/// Of part and slide.
pub(crate) type Both = [Vec<f64>; 2];

/// A trace with its readings and positions corrected.
pub(crate) fn corrected(data: &Data, traces: &[AxialTrace], all: &[Alteration]) -> Vec<AxialTrace> {
    let of = |(index, (trace, alteration)): (usize, (&AxialTrace, &Alteration))| {
        let readings = trace.reading_um.iter().enumerate();
        let reading =
            |(point, reading): (usize, &f64)| alteration.corrected(*reading, &data.place_of(trace, index, point));
        AxialTrace {
            z_mm: trace.z_mm.iter().map(|z| z + alteration.shift_mm).collect(),
            reading_um: readings.map(reading).collect(),
            ..trace.clone()
        }
    };
    traces.iter().zip(all).enumerate().map(of).collect()
}

/// The grid of traces on some positions.
pub(crate) fn grid(z_mm: &[f64], smooth: Option<Basis>, setups: &[usize], traces: &[AxialTrace], cosine: f64) -> Grid {
    let range = [z_mm.first(), z_mm.last()].map(|z| z.copied().unwrap_or_default());
    let step = (range[1] - range[0]) / (z_mm.len().max(2) - 1) as f64;
    let present = traces.iter().map(|trace| {
        let gaps = trace.gaps(range, step);
        z_mm.iter().map(|z| gaps.iter().all(|[from, to]| *z <= *from || *z >= *to)).collect()
    });
    let present: Vec<Vec<bool>> = present.collect();
    let measured = |at: &usize| {
        let has = |own: usize| setups.iter().zip(&present).any(|(setup, present)| *setup == own && present[*at]);
        has(0) && has(1)
    };
    let kept: Vec<usize> = (0..z_mm.len()).filter(measured).collect();
    let smooth = smooth.filter(|_| kept.len() == z_mm.len());
    Grid {
        present: present.iter().map(|own| kept.iter().map(|at| own[*at]).collect()).collect(),
        z_mm: kept.iter().map(|at| z_mm[*at]).collect(),
        setups: setups.to_vec(),
        cosine,
        smooth,
    }
}

/// What each trace has on a grid's positions.
pub(crate) fn rows(grid: &Grid, traces: &[AxialTrace]) -> Vec<Vec<f64>> {
    let row = |trace: &AxialTrace| grid.z_mm.iter().map(|at| cubic(&trace.z_mm, &trace.reading_um, *at)).collect();
    traces.iter().map(row).collect()
}

/// a of the reversed setup.
pub(crate) fn cosine(setups: &[usize], all: &[Alteration]) -> f64 {
    setups.iter().zip(all).find(|(setup, _)| **setup == 1).map_or(1.0, |(_, alteration)| alteration.cosine())
}

impl Results {
    fn corrected(&self, data: &Data, applied: &[Setting]) -> (Vec<Alteration>, Vec<AxialTrace>, Grid) {
        let all = alterations(&data.candidates, applied, data.traces.len());
        let traces = corrected(data, &data.traces, &all);
        let grid = grid(&self.z_mm, self.smooth.clone(), &data.setups, &traces, cosine(&data.setups, &all));
        (all, traces, grid)
    }

    /// Part and slide with effects applied.
    pub(crate) fn of(&self, data: &Data, applied: &[Setting]) -> Both {
        let (_, traces, grid) = self.corrected(data, applied);
        let split = grid.split(&rows(&grid, &traces));
        [split.part_um, split.slide_um]
    }

    /// How they change with each parameter of an effect.
    pub(crate) fn moves(&self, data: &Data, applied: &[Setting], effect: usize) -> Vec<Both> {
        let Some(Candidate { kind, traces: acted_on, effect: named }) = data.candidates.get(effect) else {
            return Vec::new();
        };
        let values = applied.iter().find(|setting| setting.effect == effect).map(|setting| setting.values.as_slice());
        let (all, traces, grid) = self.corrected(data, applied);
        if *kind == Kind::RotationOffset {
            let turned = acted_on.first().and_then(|trace| all.get(*trace)).map_or(0.0, |one| one.turned_deg);
            let change = -turned.to_radians().sin() * 1.0_f64.to_radians();
            let both = grid.by_cosine(&rows(&grid, &traces));
            return vec![both.map(|values| values.into_iter().map(|value| change * value).collect())];
        }
        let of_parameter = |parameter: usize| -> Both {
            let row = |(index, trace): (usize, &AxialTrace)| -> Vec<f64> {
                if !acted_on.contains(&index) {
                    return vec![0.0; grid.z_mm.len()];
                }
                if *kind == Kind::AxialRegistration {
                    return grid.z_mm.iter().map(|at| -cubic_slope(&trace.z_mm, &trace.reading_um, *at)).collect();
                }
                let readings = data.traces[index].reading_um.iter().enumerate();
                let column: Vec<f64> = readings
                    .map(|(point, reading)| {
                        let place = data.place(index, point);
                        all[index].corrected_partials(*kind, values, *reading, &place)[parameter]
                    })
                    .collect();
                grid.z_mm.iter().map(|at| cubic(&trace.z_mm, &column, *at)).collect()
            };
            let split = grid.split(&traces.iter().enumerate().map(row).collect::<Vec<_>>());
            [split.part_um, split.slide_um]
        };
        (0..named.parameters.len()).map(of_parameter).collect()
    }

    /// Root mean square of what one unit of each parameter does to part and slide. A part that was turned by 180° + ε shows
    /// another generatrix, a·p + q·sin ε: q is not measured, and is taken to be as large as p.
    pub(crate) fn bias(&self, data: &Data, applied: &[Setting], effect: usize) -> Vec<Bias> {
        let Some(candidate) = data.candidates.get(effect) else { return Vec::new() };
        let of = |parameter: usize, both: Both| {
            let unit = format!("um/{}", candidate.effect.parameters[parameter].unit);
            let both = both.into_iter().zip(["part", "slide"]);
            both.map(|(values, on)| Bias { on: on.into(), value: rms(&values), unit: unit.clone() }).collect::<Vec<_>>()
        };
        if candidate.kind == Kind::RotationOffset {
            let [part, _] = self.of(data, applied);
            let half: Vec<f64> = part.iter().map(|part| 0.5 * part * 1.0_f64.to_radians()).collect();
            return of(0, [half.clone(), half]);
        }
        let moves = self.moves(data, applied, effect).into_iter().enumerate();
        moves.flat_map(|(parameter, both)| of(parameter, both)).collect()
    }
}

/// Root mean square; NaN of nothing.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
