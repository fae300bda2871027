//! A look for mistakes in the rig file: signs, channels or setups that are not where it says.
//!
//! Corrections are compared at low orders by the linear equations, which is fast and enough to choose: a wrong correction of a
//! sound rig leaves far more than exact geometry does.

use runout_core::{
    Complex64,
    closed_loop::foresight,
    consistency::{Check, Test},
    rig::Rig,
};

use crate::{
    alterations::Alterations,
    effects::{Mistake, pair_of, pairs},
    layout::{Layout, Reading},
    selection::Selection,
    solve::{Blocks, Readings, apply},
};

/// Mistakes are looked for above this weighted sum of squares per degree of freedom.
pub(crate) const SUSPICIOUS_CHI2: f64 = 4.0;
/// A correction is suspected where it leaves less than this share.
const SUSPICIOUS_SHARE: f64 = 0.25;
/// Two mistakes at once are looked for where one leaves more than this, and suspected where they leave less than this share of
/// that.
const FAR_FROM_NOISE: f64 = 100.0;
const SHARE_OF_ONE: f64 = 0.1;
/// χ² that differs by less of it, and of what noise leaves, is the same.
const TRACELESS: f64 = 1e-6;
/// `run`, which looks for nothing else, names two mistakes only where they leave less than this share.
const SHARE_OF_TWO: f64 = 1e-3;
/// Corrections that leave up to this many times the least are as likely.
const ALIKE: f64 = 1.5;
/// A gain that is wrong by more is no effect of usual kind: -2 is a wrong sign.
const LARGEST_GAIN: f64 = 0.5;
/// What was measured twice differs by noise only, whatever else is wrong with the rig.
const COPIES: [Mistake; 2] = [Mistake::SensorsIdentical, Mistake::SetupRepeated];
/// Another circle of the part explains much that is none: it has to leave next to nothing.
const ONLY_NEAR_NOISE: [Mistake; 3] =
    [Mistake::SensorsIdentical, Mistake::SetupRepeated, Mistake::SensorInOtherSection];
/// As many are worth a whole fit.
const MOST: usize = 8;
/// Form, motion and eccentricity live in the low orders.
const MAX_ORDER: usize = 24;

/// Mistakes that were made together, as a target of [`ActsOn`] counts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suspect {
    /// One or two.
    pub mistakes: Vec<(Mistake, usize)>,
    /// Per degree of freedom, with them corrected.
    pub chi2: f64,
}

/// Mistakes whose correction leaves far less than the declaration and least of all, with some effects applied.
#[must_use]
pub(crate) fn suspects(
    layout: &Layout,
    applied: &Alterations,
    readings: &Readings,
    weights: Option<&[Blocks]>,
) -> Vec<Suspect> {
    let trial = Trial::new(layout, applied, readings, weights);
    let Some(declared) = trial.left(&[], f64::INFINITY) else { return Vec::new() };
    // Noise leaves as much where little is redundant.
    if weights.is_some() && declared <= SUSPICIOUS_CHI2 {
        return Vec::new();
    }
    let single = single_mistakes(layout);
    let mut found: Vec<Suspect> = Vec::new();
    let noise = if weights.is_some() { FAR_FROM_NOISE } else { SHARE_OF_TWO * declared };
    for mistake in &single {
        let limit = SUSPICIOUS_SHARE * declared;
        let limit = if ONLY_NEAR_NOISE.contains(&mistake.0) { limit.min(noise) } else { limit };
        found.extend(trial.suspect(vec![*mistake], limit));
    }
    let least = |found: &[Suspect]| found.iter().map(|suspect| suspect.chi2).fold(declared, f64::min);
    let far = if weights.is_some() { FAR_FROM_NOISE } else { SHARE_OF_ONE * declared };
    if least(&found) > far {
        let limit = SHARE_OF_ONE * least(&found);
        let single = file_mistakes(layout);
        for (place, first) in single.iter().enumerate() {
            for second in &single[place + 1..] {
                found.extend(trial.suspect(vec![*first, *second], limit));
            }
        }
    }
    let limit = ALIKE * least(&found);
    found.retain(|suspect| suspect.chi2 <= limit);
    found.sort_by(|a, b| a.mistakes.len().cmp(&b.mistakes.len()).then(a.chi2.total_cmp(&b.chi2)));
    found.truncate(MOST);
    found
}

/// Mistakes that change nothing of what low orders leave by the linear equations: single ones, and the signs of all sensors of a
/// section, or of all sensors, together.
#[must_use]
pub(crate) fn traceless(
    layout: &Layout,
    applied: &Alterations,
    readings: &Readings,
    weights: Option<&[Blocks]>,
) -> Vec<Vec<(Mistake, usize)>> {
    let trial = Trial::new(layout, applied, readings, weights);
    let Some(declared) = trial.left(&[], f64::INFINITY) else { return Vec::new() };
    // Where readings are foreseen without noise, next to nothing is left by either.
    let apart = TRACELESS * if weights.is_some() { declared.max(1.0) } else { declared };
    let same = |mistakes: &Vec<(Mistake, usize)>| {
        trial.left(mistakes, declared + apart).is_some_and(|left| left > declared - apart)
    };
    let mut found: Vec<_> = file_mistakes(layout).into_iter().map(|mistake| vec![mistake]).filter(same).collect();
    let signs = |wanted: &dyn Fn(usize) -> bool| -> Vec<(Mistake, usize)> {
        let in_first = layout.readings.iter().filter(|reading| reading.setup == 0 && wanted(reading.section));
        in_first.map(|reading| (Mistake::SensorSign, reading.sensor)).collect()
    };
    let sections = layout.readings.iter().map(|reading| reading.section + 1).max().unwrap_or(0);
    let of_sections = (0..sections).map(|section| signs(&|other| other == section));
    let of_sections: Vec<_> = of_sections.filter(|signs| signs.len() > 1).filter(same).collect();
    if of_sections.is_empty() {
        found.extend(Some(signs(&|_| true)).filter(|signs| signs.len() > 1).filter(same));
    }
    found.extend(of_sections);
    found
}

/// Of values of an effect, the one with which low orders leave least, where far more than noise is left without it and far less with it.
pub(crate) fn far_value(
    layout: &Layout,
    applied: &Alterations,
    readings: &Readings,
    weights: Option<&[Blocks]>,
    values: &[f64],
    alter: impl Fn(f64, &mut Alterations),
) -> Option<f64> {
    let trial = Trial::new(layout, applied, readings, weights);
    let declared =
        trial.left_with(applied, f64::INFINITY).filter(|chi2| weights.is_none() || *chi2 > FAR_FROM_NOISE)?;
    let (mut limit, mut best) = (SUSPICIOUS_SHARE * declared, None);
    for value in values {
        let mut alterations = applied.clone();
        alter(*value, &mut alterations);
        if let Some(chi2) = trial.left_with(&alterations, limit) {
            (limit, best) = (chi2, Some(*value));
        }
    }
    best
}

/// Mistakes of the rig file: the recording holds what was measured, in all setups alike.
fn file_mistakes(layout: &Layout) -> Vec<(Mistake, usize)> {
    let of_file = |(mistake, _): &(Mistake, usize)| !COPIES.contains(mistake) && !mistake.is_of_one_setup();
    single_mistakes(layout).into_iter().filter(of_file).collect()
}

/// Every mistake at each of its targets.
fn single_mistakes(layout: &Layout) -> Vec<(Mistake, usize)> {
    let sensors = layout.declared_signs().len();
    let setups = layout.readings.len() / sensors.max(1);
    let each = Mistake::ALL.into_iter().flat_map(|mistake| {
        let targets = mistake.acts_on().targets(sensors, setups);
        let suited = targets.into_iter().filter(move |target| mistake.suits(*target, layout));
        suited.map(move |target| (mistake, target))
    });
    each.collect()
}

/// Low orders of a station, whitened.
struct Trial<'a> {
    layout: &'a Layout,
    applied: &'a Alterations,
    weights: Option<&'a [Blocks]>,
    /// W·u of each order from 1.
    readings: Vec<Vec<Complex64>>,
}

impl<'a> Trial<'a> {
    fn new(layout: &'a Layout, applied: &'a Alterations, readings: &Readings, weights: Option<&'a [Blocks]>) -> Self {
        let whitened = |order: usize| match weights {
            Some(weights) => weights[order - 1].times(readings.order(order), 1),
            None => readings.order(order).to_vec(),
        };
        Self { layout, applied, weights, readings: (1..=MAX_ORDER.min(readings.max_order)).map(whitened).collect() }
    }

    fn suspect(&self, mistakes: Vec<(Mistake, usize)>, limit: f64) -> Option<Suspect> {
        let chi2 = self.left(&mistakes, limit)?;
        Some(Suspect { mistakes, chi2 })
    }

    /// χ² per degree of freedom with the one wrong gain that explains most; `None` where nothing is redundant.
    fn with_a_gain(&self, readings: &Readings) -> Option<f64> {
        let layout = self.layout.altered(self.applied);
        let (count, sensors) = (layout.readings.len(), layout.declared_signs().len());
        let (mut chi2, mut dof) = (0.0, 0);
        // Of each sensor, products of its own readings with the residual and with themselves, where the fit cannot reach.
        let mut products = vec![[0.0; 2]; sensors];
        for (index, whitened) in self.readings.iter().enumerate() {
            let (order, matrix) = (index + 1, self.matrix(&layout, self.applied, index));
            let qr = layout.factor_matrix(matrix.len() / count, &matrix);
            let operator = qr.operator();
            let left = |values: &[Complex64]| -> Vec<Complex64> {
                let fitted = apply(&matrix, &apply(&operator, values));
                values.iter().zip(fitted).map(|(value, fitted)| value - fitted).collect()
            };
            let residual = left(whitened);
            chi2 += residual.iter().map(Complex64::norm_sqr).sum::<f64>();
            dof += count - qr.rank();
            for (sensor, sums) in products.iter_mut().enumerate() {
                let own = layout.readings.iter().zip(readings.order(order));
                let own: Vec<Complex64> = own
                    .map(|(reading, value)| if reading.sensor == sensor { *value } else { Complex64::ZERO })
                    .collect();
                let own = left(&self.weights.map_or_else(|| own.clone(), |weights| weights[index].times(&own, 1)));
                sums[0] += own.iter().zip(&residual).map(|(own, left)| (own.conj() * left).re).sum::<f64>();
                sums[1] += own.iter().map(Complex64::norm_sqr).sum::<f64>();
            }
        }
        let explained = |[across, along]: &[f64; 2]| {
            if *along > 0.0 && across.abs() < LARGEST_GAIN * along { across * across / along } else { 0.0 }
        };
        let most = products.iter().map(explained).fold(0.0, f64::max);
        (dof > 0).then(|| (chi2 - most) / dof as f64)
    }

    /// W·A of an order, by its index.
    fn matrix(&self, layout: &Layout, alterations: &Alterations, index: usize) -> Vec<Complex64> {
        let order = index + 1;
        let mut matrix = if order == 1 { layout.first_order_matrix() } else { layout.matrix(order) };
        let columns = matrix.len() / layout.readings.len();
        let backwards = |reading: &Reading| alterations.setups[reading.setup].backwards;
        for (reading, row) in layout.readings.iter().zip(matrix.chunks_exact_mut(columns)) {
            let response = alterations.response(reading, order);
            for entry in row {
                *entry = response * if backwards(reading) { entry.conj() } else { *entry };
            }
        }
        let mut matrix = self.weights.map_or_else(|| matrix.clone(), |weights| weights[index].times(&matrix, columns));
        for (_, row) in
            layout.readings.iter().zip(matrix.chunks_exact_mut(columns)).filter(|(reading, _)| backwards(reading))
        {
            row.iter_mut().for_each(|entry| *entry = entry.conj());
        }
        matrix
    }

    /// χ² per degree of freedom with mistakes corrected; `None` where it is above the limit, or nothing is redundant.
    fn left(&self, mistakes: &[(Mistake, usize)], limit: f64) -> Option<f64> {
        let mut alterations = self.applied.clone();
        for (mistake, target) in mistakes {
            mistake.correct(*target, &mut alterations);
        }
        self.left_with(&alterations, limit)
    }

    /// χ² per degree of freedom with effects applied; `None` where it is above the limit, or nothing is redundant.
    fn left_with(&self, alterations: &Alterations, limit: f64) -> Option<f64> {
        let layout = self.layout.altered(alterations);
        let count = layout.readings.len();
        // No more degrees of freedom than real numbers.
        let most = limit * (2 * count * self.readings.len()) as f64;
        let (mut chi2, mut dof) = (0.0, 0);
        for (index, readings) in self.readings.iter().enumerate() {
            let matrix = self.matrix(&layout, alterations, index);
            let qr = layout.factor_matrix(matrix.len() / count, &matrix);
            let turned = |(value, reading): (&Complex64, &Reading)| {
                if alterations.setups[reading.setup].backwards { value.conj() } else { *value }
            };
            let readings: Vec<Complex64> = readings.iter().zip(&layout.readings).map(turned).collect();
            let fitted = apply(&matrix, &apply(&qr.operator(), &readings));
            // A real degree of freedom has half of a complex one's square.
            chi2 += 2.0 * readings.iter().zip(fitted).map(|(read, fitted)| (read - fitted).norm_sqr()).sum::<f64>();
            dof += 2 * (count - qr.rank());
            if chi2 > most {
                return None;
            }
        }
        let chi2 = if dof > 0 { chi2 / dof as f64 } else { return None };
        (chi2 <= limit).then_some(chi2)
    }
}

/// Names the likeliest mistake, where one is suspected, and what to change in the rig file.
pub(crate) fn warning(
    selection: &Selection,
    layout: &Layout,
    readings: &Readings,
    weights: Option<&[Blocks]>,
) -> Option<String> {
    let applied = Alterations::none(layout);
    let found = suspects(layout, &applied, readings, weights);
    let first = found.first()?;
    let trial = Trial::new(layout, &applied, readings, weights);
    let declared = trial.left(&[], f64::INFINITY)?;
    // A wrong gain is no mistake in the file, and explains as much.
    if trial.with_a_gain(readings).is_some_and(|left| left <= ALIKE * first.chi2) {
        return None;
    }
    // One effect of another kind may look like two mistakes.
    if first.mistakes.len() > 1 && first.chi2 > SHARE_OF_TWO * declared {
        return None;
    }
    let rig = &selection.rig;
    let name = |(mistake, target): &(Mistake, usize)| {
        let ids = mistake.acts_on().ids(*target, rig);
        format!("`{}`", foresight::name(mistake.id(), &ids))
    };
    let named = |suspect: &Suspect| suspect.mistakes.iter().map(name).collect::<Vec<_>>().join(" and ");
    let same = |suspect: &&Suspect| suspect.mistakes.len() == first.mistakes.len();
    let all: Vec<String> = found.iter().filter(same).map(named).collect();
    let change = |(mistake, target): &(Mistake, usize)| {
        let change = mistake.change(*target, rig, &selection.sensors, &selection.setups);
        let lines = (!change.is_empty()).then(|| format!("change {}", change.join("; ")));
        lines.or_else(|| mistake.advice(*target, rig))
    };
    let changes: Vec<String> = first.mistakes.iter().filter_map(change).collect();
    Some(format!(
        "a mistake is likely: {} ({}). At orders 1 to {} chi squared per degree of freedom falls from \
         {declared:.0} to {:.1}; `runout diagnose` tests it",
        all.join(" or "),
        changes.join("; "),
        MAX_ORDER.min(readings.max_order),
        first.chi2,
    ))
}

/// What differs by less, relative, is the same recording: rounding of averages.
const SAME: f64 = 1e-12;

/// Setups and channels that hold one recording twice, noise included: they are no readings of their own, and nothing that is said by them holds.
pub(crate) fn copies(rig: &Rig, readings: &Readings) -> Vec<Check> {
    // Without noise, two readings may be the same by right.
    let Some(scatter) = &readings.scatter else { return Vec::new() };
    let (sensors, setups) = (rig.sensors.len(), rig.setups.len());
    let noise = |index: usize| {
        let diagonal = scatter[index / sensors].iter().skip(index % sensors * (sensors + 1)).step_by(sensors * sensors);
        diagonal.map(|entry| entry.re).sum::<f64>()
    };
    let same = |a: usize, b: usize| {
        let each = || readings.mean.chunks_exact(readings.count).skip(1).map(|order| (order[a], order[b]));
        let square: f64 = each().map(|(one, _)| one.norm_sqr()).sum();
        let apart = |sign: f64| each().map(|(one, other)| (one - sign * other).norm_sqr()).sum::<f64>();
        noise(a) > 0.0
            && (noise(a) - noise(b)).abs() <= SAME * noise(a)
            && apart(1.0).min(apart(-1.0)) <= SAME * SAME * square
    };
    let setup_copies = pairs(setups)
        .map(|pair| pair_of(pair, setups))
        .filter(|[first, second]| (0..sensors).all(|sensor| same(first * sensors + sensor, second * sensors + sensor)));
    let check = |of: String, finding: String| Check::new(Test::Measured, of, 0.0, &[], 0.0).finding(|| finding);
    let mut found: Vec<Check> = setup_copies
        .map(|pair| {
            let [first, second] = pair.map(|setup| &rig.setups[setup].id);
            let words =
                format!("setups `{first}` and `{second}` have the same recording: one of them was stored twice");
            check(format!("setups {first} {second}"), words)
        })
        .collect();
    let channel_copies = pairs(sensors)
        .map(|pair| pair_of(pair, sensors))
        .filter(|[first, second]| (0..setups).all(|setup| same(setup * sensors + first, setup * sensors + second)));
    found.extend(channel_copies.map(|pair| {
        let [first, second] = pair.map(|sensor| &rig.sensors[sensor].id);
        let words = format!("channels `{first}` and `{second}` have the same signal: one of them was recorded twice");
        check(format!("channels {first} {second}"), words)
    }));
    found
}
