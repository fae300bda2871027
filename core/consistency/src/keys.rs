//! Keys of an effect: what has to agree on it, beside the gain in χ². The chance that is stated is the largest of them.

use crate::{
    blocks::agreement,
    order::OrderModels,
    structure::{Kind, Partition, Structure},
};
use runout_numerics::{least_squares::dot, statistics::f_tail};

/// Chance of a key above which an effect is refused, and the same beside many candidates.
const AGREED: [f64; 2] = [0.01, 0.001];
/// Candidates that are many.
const MANY: usize = 30;
/// Chance of a gain along correlated errors, or above that of a family's neighbours, below which an effect is accepted.
const BELIEVED: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const BIC_LIMIT: f64 = -10.0;
/// Members of a family on each side that are left out as its leakage, and those that are compared with.
const NEIGHBOURS: [usize; 2] = [2, 12];

/// What the keys say of an effect.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Keys {
    /// The largest chance of all keys; 0 where there is none.
    pub p: f64,
    /// Why it is refused.
    pub refused: Option<String>,
}

impl Keys {
    fn add(&mut self, p: f64, limit: f64, reason: impl FnOnce() -> String) {
        self.p = self.p.max(p);
        if p > limit && self.refused.is_none() {
            self.refused = Some(reason());
        }
    }
}

impl Keys {
    /// With what blocks say of an effect: the chance of their agreement on it, nothing where they cannot decide.
    #[must_use]
    pub fn beside_blocks(mut self, blocks: &Partition, agreed: Option<f64>, candidates: usize) -> Self {
        let limit = AGREED[usize::from(candidates > MANY)];
        if let Some(p) = agreed {
            self.add(p, limit, || {
                format!("{} {} do not agree on it: p {p:.3}, above {limit}", blocks.count(), blocks.name)
            });
        }
        self
    }

    /// With the chance of its gain among those of its family.
    #[must_use]
    pub fn beside_family(mut self, p: f64) -> Self {
        self.add(p, BELIEVED, || format!("neighbours in the spectrum explain as much: p {p:.3}, above {BELIEVED}"));
        self
    }
}

/// The keys of an effect whose orthonormal columns, outside `basis` and what is found already, are `columns`, among `candidates`.
#[must_use]
pub fn keys(
    columns: &[Vec<f64>],
    candidates: usize,
    residual: &[f64],
    basis: &[Vec<f64>],
    structure: &Structure,
    models: Option<&OrderModels>,
) -> Keys {
    let mut keys = Keys::default();
    let correlated = models.filter(|models| models.is_correlated());
    if let Some((p, bic)) = correlated.and_then(|models| models.evidence(columns)) {
        let along = structure.order.as_ref().map_or("the order", |order| order.name.as_str());
        keys.add((p * candidates as f64).min(1.0), BELIEVED, || {
            format!(
                "errors that depend on each other along {along} explain as much: p {:.3}",
                (p * candidates as f64).min(1.0)
            )
        });
        if bic > BIC_LIMIT && keys.refused.is_none() {
            keys.refused = Some(format!(
                "beside errors that depend on each other along {along} ΔBIC is {bic:.1}, above {BIC_LIMIT}"
            ));
        }
    }
    for partition in structure.of_kind(Kind::Blocks) {
        let agreed = agreement(columns, basis, residual, &partition.members()).map(|(p, ..)| p);
        if agreed.is_none() && correlated.is_some() {
            keys.add(1.0, 0.0, || {
                format!("{} {} cannot check it, and errors depend on each other", partition.count(), partition.name)
            });
        }
        keys = keys.beside_blocks(partition, agreed, candidates);
    }
    keys
}

/// The chance of an effect's gain among those of the other members of its family, each of two columns: F against the mean of its neighbours,
/// times the members. `None` where the family is too small. `gains` are those of all members, in their order.
#[must_use]
pub fn among_family(gains: &[f64], member: usize) -> Option<f64> {
    if gains.len() < MANY {
        return None;
    }
    let [near, far] = NEIGHBOURS;
    let others: Vec<f64> = gains
        .iter()
        .enumerate()
        .filter(|(other, _)| (near..=far).contains(&other.abs_diff(member)))
        .map(|(_, gain)| *gain)
        .collect();
    let mean = others.iter().sum::<f64>() / others.len().max(1) as f64;
    let f = gains.get(member)? / mean.max(f64::MIN_POSITIVE);
    Some((f_tail(f, 2.0, 2.0 * others.len() as f64) * gains.len() as f64).min(1.0))
}

/// χ² that columns explain to first order.
#[must_use]
pub fn gain(columns: &[Vec<f64>], residual: &[f64]) -> f64 {
    columns.iter().map(|column| dot(column, residual).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use runout_numerics::least_squares::Basis;

    /// A slow wander makes any smooth effect likely by its gain; the keys refuse it, and keep one that is there.
    #[test]
    fn a_wander_is_no_effect() {
        let mut random = Random::new(9);
        let (series, each) = (4, 80);
        let circle: Vec<usize> = (0..series * each).map(|at| at / each).collect();
        let structure = Structure::default()
            .along("z", circle.clone(), (0..series * each).map(|at| (at % each) as f64).collect())
            .divided(
                "z-blocks",
                Kind::Blocks,
                (0..series * each).map(|at| at % each / 10).collect(),
                (0..8).map(|block| format!("block {block}")).collect(),
            );
        let level = Basis::of(
            (0..series).map(|one| circle.iter().map(|at| f64::from(u8::from(*at == one))).collect()).collect(),
        );
        let bow: Vec<f64> = (0..series * each)
            .map(|at| if at / each == 1 { ((at % each) as f64 / each as f64 - 0.5).powi(2) * 10.0 } else { 0.0 })
            .collect();
        let with = level.extended(vec![bow.clone()]);
        let effect = &with.columns()[series..];
        let (mut wrong, mut right, mut clean) = (0, 0, 0);
        for trial in 0..90 {
            let walk = trial % 3 != 2;
            let mut values: Vec<f64> = Vec::new();
            for _ in 0..series {
                let mut state = 0.0;
                for _ in 0..each {
                    state += if walk { 0.3 * random.normal() } else { 0.0 };
                    values.push(state + 0.1 * random.normal());
                }
            }
            let there = trial % 3 != 0;
            if there {
                values.iter_mut().zip(&bow).for_each(|(value, bow)| *value += if walk { 20.0 } else { 0.2 } * bow);
            }
            level.remove_from(&mut values);
            let models = OrderModels::of(structure.order.as_ref().unwrap(), &values, level.columns());
            let found = keys(effect, 20, &values, level.columns(), &structure, models.as_ref()).refused.is_none();
            *match (walk, there) {
                (true, false) => &mut wrong,
                (true, true) => &mut right,
                _ => &mut clean,
            } += usize::from(found);
        }
        assert!(wrong < 2 && right > 25 && clean > 25, "{wrong} {right} {clean}");
    }

    #[test]
    fn a_line_stands_above_its_neighbours_or_is_none() {
        let mut gains = vec![4.0; 60];
        assert!(among_family(&gains, 20).unwrap() > 0.9);
        gains[20] = 400.0;
        assert!(among_family(&gains, 20).unwrap() < 1e-6);
        assert!(among_family(&gains[..20], 10).is_none());
    }
}
