//! All tests of a linear fit: what a domain declares of its readings, applied to what the fit leaves.

use runout_numerics::{
    least_squares::{Basis, dot},
    number::significant,
    statistics::f_tail,
};

use crate::{
    blocks::{Dispersion, Errors, agreement, dispersion},
    check::{Check, FINDING, Test, factor, widening},
    groups::{Group, Level, alike},
    order::{Correlated, OrderModels},
    rows,
    structure::{Kind, Partition, Shift, Structure},
};

/// A linear fit, to be tested.
#[derive(Debug, Clone, Copy)]
pub struct LinearFit<'a> {
    /// What the least-squares fit leaves of each reading.
    pub residual: &'a [f64],
    /// The orthonormal columns of everything that is fitted.
    pub basis: &'a [Vec<f64>],
    /// Names of the values.
    pub names: &'a [String],
    /// What each value is of the readings, `[value][reading]`.
    pub weights: &'a [Vec<f64>],
    /// Standard deviation of one reading and the degrees of freedom that it is known from (infinite where it is stated); `None` where
    /// only the residual says it.
    pub noise: Option<(f64, f64)>,
    /// Unit of the readings.
    pub unit: &'a str,
}

/// What the tests say of a linear fit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    /// All tests.
    pub checks: Vec<Check>,
    /// Factor on the standard uncertainty of each value, as it follows from independent errors of the residual's size; at least 1.
    pub factors: Vec<f64>,
}

/// Tests a linear fit on its own residual.
#[must_use]
pub fn judge(fit: LinearFit, structure: &Structure) -> Judgement {
    let dof = fit.residual.len().saturating_sub(fit.basis.len());
    let mut judgement = Judgement { checks: Vec::new(), factors: vec![1.0; fit.weights.len()] };
    let squares = dot(fit.residual, fit.residual);
    if dof == 0 || squares <= 0.0 {
        return judgement;
    }
    let variance = squares / dof as f64;
    let white = Errors::White { variance, dof: dof as f64 };
    let (models, correlated) = judgement.along_the_order(fit, structure, white);
    let effective = correlated.as_ref().map_or(1.0, |errors| (errors.freedom() / dof as f64).min(1.0));
    judgement.between_blocks(fit, structure, white, models.as_ref().zip(correlated.as_ref()));
    for partition in structure.of_kind(Kind::Alike) {
        let groups: Vec<Group> = (partition.levels.iter().zip(partition.members()))
            .map(|(name, members)| group(name, &members, fit, effective))
            .collect();
        let level = match fit.noise {
            Some((std, dof)) if partition.count() < FEWEST_ALIKE => Level::Known { variance: std * std, dof },
            None if partition.count() < 2 => continue,
            _ => Level::Others,
        };
        judgement.checks.extend(alike(
            &partition.name,
            &groups,
            level,
            "its noise is less, or it is smoothed or copied",
        ));
    }
    judgement.checks.extend(structure.shifts.iter().filter_map(|one| shift(fit, one, models.as_ref(), structure)));
    if correlated.is_none() {
        judgement.checks.extend(rows::unlike(fit.residual, fit.basis).map(|rows| rows.check(structure, fit.unit)));
    }
    judgement
}

/// Groups from which one is compared with the others.
const FEWEST_ALIKE: usize = 3;

fn group(name: &str, members: &[usize], fit: LinearFit, effective: f64) -> Group {
    let sum = |column: &[f64]| members.iter().map(|reading| column[*reading].powi(2)).sum::<f64>();
    let fitted: f64 = fit.basis.iter().map(|column| sum(column)).sum();
    let freedom = effective * (members.len() as f64 - fitted).max(0.0);
    Group { name: name.to_owned(), squares: effective * sum(fit.residual), freedom }
}

impl Judgement {
    /// Correlated errors along the declared order: their covariance where they are found, and wider uncertainties of the values.
    fn along_the_order(
        &mut self,
        fit: LinearFit,
        structure: &Structure,
        white: Errors,
    ) -> (Option<OrderModels>, Option<Correlated>) {
        let Some(order) = &structure.order else { return (None, None) };
        let Some(models) = OrderModels::of(order, fit.residual, fit.basis) else { return (None, None) };
        let correlated = models.is_correlated().then(|| models.covariance());
        let mut largest = 1.0_f64;
        if let Some(errors) = &correlated {
            for (value, weights) in self.factors.iter_mut().zip(fit.weights) {
                let stated = white.variance_of(weights).sqrt();
                if stated > 0.0 {
                    let spread = errors.variance_of(&models.summed(weights)).sqrt() / stated;
                    *value = value.max(factor(spread, errors.freedom()));
                    largest = largest.max(*value);
                }
            }
        }
        let mut check = Check::new(Test::Order, &order.name, models.gain, &[2.0], models.p());
        if let Some(errors) = &correlated {
            check = check
                .finding(|| {
                    format!(
                        "errors depend on each other along {}: {:.0} % of their variance over {} steps and more",
                        order.name,
                        100.0 * errors.share,
                        errors.length.max(1.0).round()
                    )
                })
                .replaced_by(largest);
        }
        self.checks.push(check);
        (Some(models), correlated)
    }

    /// Blocks against each other, with independent and with correlated errors: the widest half width counts.
    fn between_blocks(
        &mut self,
        fit: LinearFit,
        structure: &Structure,
        white: Errors,
        correlated: Option<(&OrderModels, &Correlated)>,
    ) {
        let count = structure.independent().count();
        for partition in structure.independent() {
            let blocks = partition.count();
            let chance = widening(blocks) / count as f64;
            let plain = dispersion(fit.weights, fit.basis, fit.residual, &partition.members(), white);
            let before = self.factors.clone();
            if let Some(found) = &plain {
                self.widen(found, chance, |_| 1.0);
            }
            let carried = correlated.and_then(|(models, errors)| {
                let weights: Vec<Vec<f64>> = fit.weights.iter().map(|weights| models.summed(weights)).collect();
                let (residual, basis) = models.averaged();
                let parts = Partition { level: models.parts(&partition.level), ..partition.clone() };
                let found = dispersion(&weights, basis, residual, &parts.members(), Errors::Correlated(errors))?;
                let stated = |value: usize| {
                    (errors.variance_of(&weights[value]) / white.variance_of(&fit.weights[value])).sqrt()
                };
                self.widen(&found, chance, stated);
                Some(found)
            });
            let Some((whole, each)) = carried.or(plain) else { continue };
            let grown = self.factors.iter().zip(&before).map(|(now, before)| now / before).fold(1.0, f64::max);
            let values = each.len() as f64;
            let worst = each.iter().enumerate().min_by(|a, b| a.1.p.total_cmp(&b.1.p));
            let (of, statistic, p) = match worst {
                Some((value, one)) if each.len() > 1 && one.p * values < whole.p => {
                    (fit.names.get(value).map_or("", String::as_str), one, 2.0 * one.p * values)
                }
                _ => ("all values", &whole, whole.p * if each.len() > 1 { 2.0 } else { 1.0 }),
            };
            let dof = [statistic.freedom, statistic.below];
            let check = Check::new(Test::Blocks, &partition.name, statistic.ratio, &dof, p.min(1.0));
            let check = check.finding(|| {
                format!(
                    "{blocks} {} disagree: of {of} they scatter {:.1} times as far as expected from the residual",
                    partition.name,
                    statistic.ratio.sqrt()
                )
            });
            self.checks.push(check.widening(grown));
        }
    }

    fn widen(&mut self, (whole, each): &(Dispersion, Vec<Dispersion>), chance: f64, stated: impl Fn(usize) -> f64) {
        let values = each.len() as f64;
        let pooled = if whole.p < chance { factor(whole.ratio.sqrt(), whole.freedom) } else { 0.0 };
        for (value, (widest, own)) in self.factors.iter_mut().zip(each).enumerate() {
            let own = if own.p * values < chance { factor(own.ratio.sqrt(), own.freedom) } else { 0.0 };
            let wider = own.max(pooled) * stated(value);
            *widest = widest.max(wider);
        }
    }
}

/// Whether parts are offset against each other: F of their offsets, beside everything that is fitted, with the keys of an effect: averaged
/// over the models of correlated errors, and against the scatter of independent blocks.
fn shift(fit: LinearFit, parts: &Shift, models: Option<&OrderModels>, structure: &Structure) -> Option<Check> {
    let declared = Basis::of(fit.basis.to_vec());
    let basis = declared.extended(parts.columns.clone());
    let of_parts = &basis.columns()[declared.rank()..];
    let parameters = of_parts.len();
    let dof = fit.residual.len().saturating_sub(basis.rank());
    if parameters == 0 || dof == 0 {
        return None;
    }
    let mut left = fit.residual.to_vec();
    basis.remove_from(&mut left);
    let gain = dot(fit.residual, fit.residual) - dot(&left, &left);
    let f = gain / parameters as f64 / (dot(&left, &left) / dof as f64).max(f64::MIN_POSITIVE);
    let plain = f_tail(f, parameters as f64, dof as f64);
    let carried = models.filter(|models| models.is_correlated()).and_then(|models| models.evidence(&parts.columns));
    // Parts that are the blocks have nothing beside them that their offsets could be compared with.
    let blocks = structure.independent().filter(|blocks| blocks.name != parts.name);
    let agreed = blocks.filter_map(|blocks| {
        let members = blocks.members();
        agreement(of_parts, fit.basis, fit.residual, &members).map(|(p, ..)| p)
    });
    let p = carried.map(|(p, _)| p).into_iter().chain(agreed).fold(plain, f64::max);
    let p = p * structure.shifts.len() as f64;
    let check = Check::new(Test::Shift, &parts.name, f, &[parameters as f64, dof as f64], p);
    Some(check.finding(|| {
        let coefficients = basis.coefficients(fit.residual);
        let of_parts = &coefficients[coefficients.len() - parts.columns.len()..];
        let offsets = std::iter::once(0.0).chain(of_parts.iter().copied()).zip(&parts.levels);
        let mut offsets: Vec<(f64, &String)> = offsets.collect();
        offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (low, high) = (&offsets[0], &offsets[offsets.len() - 1]);
        format!("{} differs from {} by {:.3} {}", high.1, low.1, high.0 - low.0, fit.unit)
    }))
}

/// The residual as a whole against a noise that is known: χ² per degree of freedom, on both sides. One that is too small is named only.
#[must_use]
pub fn residual(chi2_per_dof: f64, dof: f64, noise_dof: f64) -> Check {
    let group = Group { name: "residual".into(), squares: chi2_per_dof * dof, freedom: dof };
    let level = Level::Known { variance: 1.0, dof: noise_dof };
    let one = crate::groups::compared(std::slice::from_ref(&group), level).first().map_or(1.0, |one| one.p);
    let size = chi2_per_dof.max(0.0).sqrt();
    let check = Check::new(Test::Residual, "residual", chi2_per_dof, &[dof, noise_dof], one);
    if chi2_per_dof > 1.0 {
        return check.finding(|| {
            format!("the residual is {size:.2} times the noise (χ² per degree of freedom {chi2_per_dof:.2})")
        });
    }
    // Uncertainties are too large then, so that values hold.
    let words = || {
        format!(
            "the residual is only {} times the noise: the noise is stated too large, or readings are smoothed or copied",
            significant(size, 2)
        )
    };
    check.finding(words).named()
}

impl Check {
    /// Of correlated errors, whose covariance replaces that of independent ones: values are right again, and wider by `factor`.
    fn replaced_by(mut self, factor: f64) -> Self {
        if self.p < FINDING {
            self.did = crate::check::Action::Widened;
            self.factor = factor;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Circles of a cylinder: level of the part, errors of each circle along the angle.
    fn circles(count: usize, each: usize) -> (Basis, Structure, Vec<String>) {
        let angle = |at: usize| std::f64::consts::TAU * (at % each) as f64 / each as f64;
        let columns: Vec<Vec<f64>> = vec![
            vec![1.0; count * each],
            (0..count * each).map(|at| angle(at).cos()).collect(),
            (0..count * each).map(|at| angle(at).sin()).collect(),
            (0..count * each).map(|at| (3.0 * angle(at)).cos()).collect(),
        ];
        let circle: Vec<usize> = (0..count * each).map(|at| at / each).collect();
        let names: Vec<String> = (0..count).map(|circle| format!("circle {circle}")).collect();
        let structure = Structure::default()
            .along("angle", circle.clone(), (0..count * each).map(angle).collect())
            .divided("circles", Kind::Blocks, circle.clone(), names.clone())
            .divided("circles", Kind::Alike, circle.clone(), names.clone())
            .shifting("circles", &circle, &names);
        (Basis::of(columns), structure, ["radius", "x", "y", "lobes"].map(str::to_owned).to_vec())
    }

    struct Trial {
        said: f64,
        held: f64,
        width: f64,
    }

    fn trial(random: &mut Random, count: usize, noise: &dyn Fn(&mut Random, usize) -> Vec<f64>) -> Trial {
        let (trials, each) = (150, 60);
        let (basis, structure, names) = circles(count, each);
        let weights = basis.weights();
        let (mut said, mut held, mut widths) = (0, 0, Vec::new());
        for _ in 0..trials {
            let values: Vec<f64> = (0..count).flat_map(|_| noise(random, each)).collect();
            let found: Vec<f64> = weights.iter().map(|weights| dot(weights, &values)).collect();
            let mut residual = values;
            basis.remove_from(&mut residual);
            let variance = dot(&residual, &residual) / (residual.len() - 4) as f64;
            let fit = LinearFit {
                residual: &residual,
                basis: basis.columns(),
                names: &names,
                weights: &weights,
                noise: None,
                unit: "µm",
            };
            let judgement = judge(fit, &structure);
            said += usize::from(judgement.checks.iter().any(|check| !check.finding.is_empty()));
            for ((found, factor), weights) in found.iter().zip(&judgement.factors).zip(&weights) {
                held += usize::from(found.abs() < 1.96 * factor * (variance * dot(weights, weights)).sqrt());
                widths.push(*factor);
            }
        }
        widths.sort_by(f64::total_cmp);
        let share = |count: usize, of: usize| count as f64 / of as f64;
        Trial { said: share(said, trials), held: share(held, 4 * trials), width: widths[widths.len() / 2] }
    }

    /// Sound circles keep their uncertainty; circles that sit elsewhere, and errors along the angle, widen it until it holds.
    #[test]
    fn circles_judge_their_own_uncertainty() {
        let mut random = Random::new(8);
        let white = |random: &mut Random, each: usize| (0..each).map(|_| random.normal()).collect();
        let seated = |random: &mut Random, each: usize| {
            let [x, y, level] = [random.normal(), random.normal(), random.normal()];
            let at = |at: usize| std::f64::consts::TAU * at as f64 / each as f64;
            (0..each).map(|i| level + x * at(i).cos() + y * at(i).sin() + random.normal()).collect()
        };
        let walk = |random: &mut Random, each: usize| {
            let mut state = 0.0;
            let step = |random: &mut Random, state: &mut f64| {
                *state = 0.8 * *state + 0.6 * random.normal();
                *state + 0.2 * random.normal()
            };
            (0..each + 30).map(|_| step(random, &mut state)).skip(30).collect()
        };
        for count in [3, 8] {
            let sound = trial(&mut random, count, &white);
            assert!(
                sound.said < 0.04 && sound.held > 0.93 && sound.width < 1.05,
                "{count}: {} {}",
                sound.said,
                sound.held
            );
            let moved = trial(&mut random, count, &seated);
            assert!(moved.held > 0.88 && moved.said > 0.6, "{count}: {} {}", moved.held, moved.said);
            let correlated = trial(&mut random, count, &walk);
            assert!(correlated.held > 0.92 && correlated.said > 0.95, "{count}: {}", correlated.held);
        }
    }

    #[test]
    fn a_residual_is_judged_on_both_sides() {
        assert!(!residual(1.3, 40.0, f64::INFINITY).refutes());
        assert!(residual(104.0, 40.0, 60.0).finding.contains("10.20 times"));
        let small = residual(1e-6, 40.0, f64::INFINITY);
        assert!(small.finding.contains("too large") && !small.refutes());
    }
}
