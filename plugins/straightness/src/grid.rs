//! Part and slide on common positions, from traces that were brought to them.

use runout_core::{numerics::least_squares::Basis, standards::straightness::about_lsli_um};

use crate::spline::Knots;

/// Passes of filling in what a trace lacks; each leaves less than its share of the traces of what was wrong.
const MOST_PASSES: usize = 200;
/// Filling in ends where it changes readings by less than this, relative to their size.
const SETTLED: f64 = 1e-12;

/// Common positions, and which traces have readings there.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    pub z_mm: Vec<f64>,
    /// Setup of each trace: 0 or 1.
    pub setups: Vec<usize>,
    /// `[trace][position]`; at each position, each setup has a trace.
    pub present: Vec<Vec<bool>>,
    /// a: the share of the part's deviation that the reversed setup sees.
    pub cosine: f64,
    /// The deviations that the slide may have, where they are declared; all without them.
    pub smooth: Option<Basis>,
}

/// Part and slide.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    pub part_um: Vec<f64>,
    pub slide_um: Vec<f64>,
    /// Variance of one trace at each position, in µm²; NaN where not known.
    pub variance: Vec<f64>,
    /// Correlation of a trace's errors over 0, 1, … positions.
    pub correlation: Vec<f64>,
    /// Variances of part and slide for independent errors of variance 1 in each trace.
    pub shares: [Vec<f64>; 2],
    /// Root mean square difference of the setups' half difference from the slide that is declared possible; NaN where
    /// nothing is declared.
    pub beyond_smooth_um: f64,
}

/// The deviations about a straight line that have no waves shorter than `cutoff_mm`.
pub(crate) fn smooth(z_mm: &[f64], cutoff_mm: f64) -> Basis {
    let range = [z_mm.first(), z_mm.last()].map(|z| z.copied().unwrap_or_default());
    let knots = Knots::for_waves(range, cutoff_mm);
    let columns = (0..knots.splines()).map(|spline| {
        let weight = |z: &f64| {
            let at = knots.at(*z);
            spline.checked_sub(at.start).and_then(|index| at.value.get(index)).copied().unwrap_or(0.0)
        };
        let column: Vec<f64> = z_mm.iter().map(weight).collect();
        about_lsli_um(z_mm, &column)
    });
    let mut basis = Basis::of(Vec::new());
    for column in columns {
        let next = basis.extended(vec![column]);
        if !next.dependent() {
            basis = next;
        }
    }
    basis
}

impl Grid {
    fn counts(&self, position: usize) -> [f64; 2] {
        let mut counts = [0.0; 2];
        for (setup, present) in self.setups.iter().zip(&self.present) {
            counts[*setup] += if present[position] { 1.0 } else { 0.0 };
        }
        counts
    }

    /// Means of both setups at a position.
    fn means(&self, aligned: &[Vec<f64>], position: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for ((setup, present), trace) in self.setups.iter().zip(&self.present).zip(aligned) {
            sums[*setup] += if present[position] { trace[position] } else { 0.0 };
        }
        let counts = self.counts(position);
        [sums[0] / counts[0], sums[1] / counts[1]]
    }

    /// Every trace without its own line: with readings everywhere, its least-squares line. Where a trace lacks readings, they
    /// are filled in from the other traces of its setup until they agree, which is the joint least-squares alignment.
    fn align(&self, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let about = |row: &Vec<f64>| about_lsli_um(&self.z_mm, row);
        let lacking = self.present.iter().flatten().any(|present| !present);
        let mut aligned: Vec<Vec<f64>> = rows.iter().map(about).collect();
        if !lacking {
            return aligned;
        }
        let mut rows = rows.to_vec();
        let size = aligned.iter().flatten().map(|value| value.abs()).fold(f64::MIN_POSITIVE, f64::max);
        for _ in 0..MOST_PASSES {
            let means: Vec<[f64; 2]> = (0..self.z_mm.len()).map(|position| self.means(&aligned, position)).collect();
            let mut changed = 0.0_f64;
            for (trace, present) in self.present.iter().enumerate() {
                for position in (0..self.z_mm.len()).filter(|position| !present[*position]) {
                    let change = means[position][self.setups[trace]] - aligned[trace][position];
                    rows[trace][position] += change;
                    changed = changed.max(change.abs());
                }
            }
            aligned = rows.iter().map(about).collect();
            if changed < SETTLED * size {
                break;
            }
        }
        aligned
    }

    /// Part and slide from what each trace has at each position, `[trace][position]`; what is not present is not used.
    pub(crate) fn split(&self, rows: &[Vec<f64>]) -> Split {
        let aligned = self.align(rows);
        let positions = 0..self.z_mm.len();
        let counts: Vec<[f64; 2]> = positions.clone().map(|position| self.counts(position)).collect();
        let means: Vec<[f64; 2]> = positions.clone().map(|position| self.means(&aligned, position)).collect();
        let c = self.cosine;
        let mut slide_um: Vec<f64> = means.iter().map(|[one, other]| (c * one - other) / (1.0 + c)).collect();
        let (mut leverage, mut beyond, mut freedom) = (vec![1.0; slide_um.len()], vec![0.0; slide_um.len()], 0.0);
        if let Some(smooth) = &self.smooth {
            beyond.clone_from(&slide_um);
            smooth.remove_from(&mut beyond);
            slide_um.iter_mut().zip(&beyond).for_each(|(slide, beyond)| *slide -= beyond);
            leverage = if smooth.rank() > 0 { smooth.leverage() } else { vec![0.0; slide_um.len()] };
            // Without the lines of two traces that part and slide share.
            freedom = slide_um.len() as f64 - 2.0 - smooth.rank() as f64;
        }
        let part_um: Vec<f64> = positions
            .clone()
            .map(|at| {
                let ([one, other], [n1, n2], slide) = (means[at], counts[at], slide_um[at]);
                if self.smooth.is_some() {
                    (n1 * (one - slide) + c * n2 * (other + slide)) / (n1 + c * c * n2)
                } else {
                    (one + other) / (1.0 + c)
                }
            })
            .collect();
        // A half difference has the variance (c²/n₁ + 1/n₂)/(1 + c)² of one trace's.
        let share = |[n1, n2]: [f64; 2]| (c * c / n1 + 1.0 / n2) / (1.0 + c).powi(2);
        let squares: f64 = beyond.iter().zip(&counts).map(|(beyond, counts)| beyond * beyond / share(*counts)).sum();
        let variance = self.variance(&aligned, &means, &counts, squares / freedom);
        let shares = |of: &dyn Fn([f64; 2], f64) -> f64| -> Vec<f64> {
            positions.clone().map(|at| of(counts[at], leverage[at])).collect()
        };
        let of_slide = |counts: [f64; 2], leverage: f64| leverage * share(counts);
        let of_part = |[n1, n2]: [f64; 2], leverage: f64| {
            if self.smooth.is_some() {
                let both = n1 + c * c * n2;
                1.0 / both + ((n1 - c * n2) / both).powi(2) * leverage * share([n1, n2])
            } else {
                (1.0 / n1 + 1.0 / n2) / (1.0 + c).powi(2)
            }
        };
        let rms = (beyond.iter().map(|value| value * value).sum::<f64>() / beyond.len().max(1) as f64).sqrt();
        Split {
            shares: [shares(&of_part), shares(&of_slide)],
            part_um,
            slide_um,
            correlation: self.correlation(&aligned, &means),
            variance,
            beyond_smooth_um: if self.smooth.is_some() { rms } else { f64::NAN },
        }
    }

    /// How part and slide change with the share of the part's deviation that the reversed setup sees.
    pub(crate) fn by_cosine(&self, rows: &[Vec<f64>]) -> [Vec<f64>; 2] {
        let aligned = self.align(rows);
        let means: Vec<[f64; 2]> = (0..self.z_mm.len()).map(|position| self.means(&aligned, position)).collect();
        let c = self.cosine;
        let mut slide: Vec<f64> = means.iter().map(|[one, other]| (one + other) / (1.0 + c).powi(2)).collect();
        let Some(smooth) = &self.smooth else {
            return [slide.iter().map(|value| -value).collect(), slide];
        };
        let mut beyond = slide.clone();
        smooth.remove_from(&mut beyond);
        slide.iter_mut().zip(&beyond).for_each(|(slide, beyond)| *slide -= beyond);
        let split = self.split(rows);
        let part = (0..means.len()).map(|at| {
            let [n1, n2] = self.counts(at);
            let both = n1 + c * c * n2;
            let change = n2 * (means[at][1] + split.slide_um[at]) + (c * n2 - n1) * slide[at];
            (change - 2.0 * c * n2 * split.part_um[at]) / both
        });
        [part.collect(), slide]
    }

    /// Scatter of the traces about their setup's mean, pooled over both setups. A position without repeats has that of the
    /// others; without any, `beyond` (NaN: not known).
    fn variance(&self, aligned: &[Vec<f64>], means: &[[f64; 2]], counts: &[[f64; 2]], beyond: f64) -> Vec<f64> {
        let squares = |at: usize| -> f64 {
            let traces = self.setups.iter().zip(&self.present).zip(aligned).filter(|((_, present), _)| present[at]);
            traces.map(|((setup, _), trace)| (trace[at] - means[at][*setup]).powi(2)).sum()
        };
        let freedom = |at: usize| counts[at][0] + counts[at][1] - 2.0;
        let positions = 0..self.z_mm.len();
        let pooled: f64 = positions.clone().map(squares).sum::<f64>() / positions.clone().map(freedom).sum::<f64>();
        let elsewhere = if pooled.is_nan() && beyond.is_finite() { beyond } else { pooled };
        positions.map(|at| if freedom(at) > 0.0 { squares(at) / freedom(at) } else { elsewhere }).collect()
    }
}
