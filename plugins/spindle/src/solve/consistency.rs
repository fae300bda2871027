//! What a station's residual says of its uncertainty: all orders together, and each by itself, against the noise that the turns show.

use runout_core::{
    consistency::{
        Check,
        check::FINDING,
        groups::{Group, Level, compared, said},
        linear,
    },
    profile::{NEIGHBOURS, SMOOTHING, orders_beside},
    separation::{OrderResidual, Residual},
};

/// Real degrees of freedom behind the covariance of one order by itself: of the neighbours that captures of so many turns have, and of both
/// parts of each.
pub(crate) fn noise_freedom(turns: impl IntoIterator<Item = usize>) -> usize {
    let of = |turns: usize| match turns {
        0 | 1 => 0,
        2 => 2,
        turns => 4 * NEIGHBOURS.min((turns - 1) / 2),
    };
    turns.into_iter().map(of).sum()
}

/// Classes of orders, by how many neighbours their covariance is averaged over.
const CLASSES: f64 = (SMOOTHING + 1) as f64;
/// Turns from which single orders are judged: with fewer, most frequencies between two orders are neighbours, and a tone of asynchronous motion
/// next to a whole order cannot be distinguished from it.
const FEWEST_TURNS: usize = 8;
/// Share of the noise of all orders below which what one of the many higher orders has more refutes no value: it is named, and is in the uncertainty of
/// that order. A tone of asynchronous motion at a whole order, to a part of a period over the recording, is no more.
const LITTLE: f64 = 0.05;
/// Degrees of freedom of the noise of all orders together, at most and at least: the few turns' scatter that weights are taken from biases it by
/// some percent however many orders there are, and asynchronous motion of low frequency makes it scatter as from so few.
const MOST_FREEDOM: f64 = 400.0;
const LEAST_FREEDOM: f64 = 8.0;

/// Judges the residual: its checks are set, and what the covariance of each of so many orders from 1 is to be taken times is given.
///
/// Where all orders together are above the noise, each is uncertain by as much more, or by its own residual where that is larger; an order
/// that is above it by itself, by its own.
pub(super) fn judge(residual: &mut Residual, turns: &[usize], sensors: usize, orders: usize) -> Vec<f64> {
    let mut factors = vec![1.0; orders];
    let known: Vec<OrderResidual> = residual.by_order.iter().filter(|order| order.expected > 0.0).copied().collect();
    let freedom = noise_freedom(turns.iter().copied()) as f64;
    if known.is_empty() || freedom <= 0.0 {
        return factors;
    }
    let whole: f64 = known.iter().map(|order| order.expected).sum();
    let effective = |of: &dyn Fn(&OrderResidual) -> f64| {
        whole * whole / known.iter().map(|order| order.expected * order.expected / of(order)).sum::<f64>()
    };
    let dof = effective(&|order| order.dof as f64);
    // Known no better than the residual, and to some percent at best: weights follow a part of the noise.
    let weights = |beside| Weights::of(turns, sensors, beside);
    let below = effective(&|_| freedom).min(dof).min(weights(SMOOTHING).freedom()).clamp(LEAST_FREEDOM, MOST_FREEDOM);
    let pooled = linear::residual(residual.chi2_per_dof, dof, below);
    let above = if pooled.refutes() && residual.chi2_per_dof > 1.0 { residual.chi2_per_dof } else { 1.0 };
    factors.fill(above);
    // Orders whose covariance is averaged over as many neighbours have noise that is known as well.
    let mut single: Vec<Check> = Vec::new();
    let fewest = turns.iter().copied().min().unwrap_or(0);
    for beside in (0..=SMOOTHING).filter(|_| fewest >= FEWEST_TURNS) {
        let alike_orders: Vec<&OrderResidual> =
            known.iter().filter(|order| orders_beside(order.order) == beside).collect();
        let groups: Vec<Group> = alike_orders.iter().map(|order| group(order)).collect();
        let weights = weights(beside);
        let dof = (freedom * (2 * beside + 1) as f64).min(weights.freedom());
        let level = Level::Known { variance: weights.inflation(), dof };
        let all = compared(&groups, level);
        for one in &all {
            let place = alike_orders[one.group].order - 1;
            let is_above = one.ratio > 1.0 && (above > 1.0 || one.p * CLASSES < FINDING);
            if is_above && let Some(factor) = factors.get_mut(place) {
                *factor = factor.max(one.ratio * weights.inflation());
            }
        }
        let checks = said("orders", &groups, all, level, "the noise there is overestimated");
        // Less than the noise is no finding of an order: a low-pass leaves less than what its covariance is at least.
        let above = checks.into_iter().filter(|check| check.statistic > 1.0).map(|check| check.among(CLASSES as usize));
        single.extend(above.map(|check| {
            let order = known.iter().find(|order| name(order) == check.of);
            let excess = order.map_or(f64::INFINITY, |order| (check.statistic - 1.0) * order.expected);
            let is_little = beside == SMOOTHING && excess < LITTLE * whole;
            if is_little { check.named() } else { check }
        }));
    }
    // Of those that are as they should be, the least likely one is enough.
    single.sort_by(|a, b| a.p.total_cmp(&b.p));
    let said = single.iter().filter(|check| !check.finding.is_empty()).count();
    // What all orders have is no finding of each.
    let pooled_above = above > 1.0;
    single.truncate(if pooled_above { 1 } else { said.max(1) });
    if pooled_above {
        single = single.into_iter().map(Check::named).collect();
    }
    let largest = factors.iter().copied().fold(1.0, f64::max).sqrt();
    let pooled = pooled.widening(if above > 1.0 { largest } else { 1.0 });
    residual.checks = std::iter::once(pooled).chain(single).collect();
    factors
}

/// Weights that are the inverse of a covariance from few turns: what they weigh is larger than the noise by chance (Hotelling's T², Anderson, *An
/// Introduction to Multivariate Statistical Analysis*, theorem 5.2.2).
struct Weights {
    setups: f64,
    sensors: f64,
    /// Turns less 1 in a setup, times the orders averaged.
    own: f64,
}

impl Weights {
    fn of(turns: &[usize], sensors: usize, beside: usize) -> Self {
        let fewest = turns.iter().copied().min().unwrap_or(0).saturating_sub(1);
        Self { setups: turns.len() as f64, sensors: sensors as f64, own: (fewest * (2 * beside + 1)) as f64 }
    }

    /// Complex degrees of freedom of one setup.
    fn left(&self) -> f64 {
        (self.own - self.sensors + 1.0).max(0.5)
    }

    /// By how much weighted squares are larger.
    fn inflation(&self) -> f64 {
        (self.own / self.left()).max(1.0)
    }

    /// Real degrees of freedom of all setups.
    fn freedom(&self) -> f64 {
        2.0 * self.setups * self.left()
    }
}

fn name(order: &OrderResidual) -> String {
    format!("order {}", order.order)
}

fn group(order: &OrderResidual) -> Group {
    let freedom = order.dof as f64;
    Group { name: name(order), squares: order.chi2_per_dof() * freedom, freedom }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residual(chi2: impl Fn(usize) -> f64) -> Residual {
        let order = |order| OrderResidual { order, squares: 3.0 * chi2(order), expected: 3.0, dof: 6 };
        let by_order: Vec<OrderResidual> = (2..=128).map(order).collect();
        let chi2_per_dof = by_order.iter().map(OrderResidual::chi2_per_dof).sum::<f64>() / 127.0;
        Residual { chi2_per_dof, dof: 6 * 127, by_order, ..Residual::default() }
    }

    #[test]
    fn one_order_of_many_is_named_and_widened_by_its_own_residual() {
        for at in [3, 40] {
            let mut found = residual(|order| if order == at { 30.0 } else { 1.0 });
            let factors = judge(&mut found, &[60, 60, 60], 4, 128);
            let named: Vec<&str> =
                found.checks.iter().filter(|check| check.refutes()).map(|check| &*check.of).collect();
            assert_eq!(named, [format!("order {at}")], "{:?}", found.checks);
            assert!((factors[at - 1] - 30.0).abs() < 1e-9 && (factors[at] - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn all_orders_are_widened_where_all_are_above_the_noise() {
        let mut found = residual(|order| if order == 5 { 1000.0 } else { 100.0 });
        let factors = judge(&mut found, &[60, 60, 60], 4, 130);
        assert!(found.checks[0].refutes() && (found.checks[0].factor - 1000_f64.sqrt()).abs() < 1e-9);
        // Orders at which nothing is redundant have no residual of their own.
        assert!((factors[0] - found.chi2_per_dof).abs() < 1e-9 && (factors[4] - 1000.0).abs() < 1e-9);
    }

    /// Of five turns, four sensors and one order, no weight is known: 16 times the noise are no finding.
    #[test]
    fn few_turns_refute_little() {
        let found = |turns: usize| {
            let mut found = residual(|order| if order == 3 { 16.0 } else { 1.0 });
            judge(&mut found, &[turns; 3], 4, 128);
            found.checks.iter().any(Check::refutes)
        };
        assert!(!found(5) && found(60));
    }

    #[test]
    fn less_than_the_noise_refutes_nothing() {
        let mut found = residual(|_| 0.1);
        let factors = judge(&mut found, &[60, 60, 60], 4, 128);
        assert!(found.checks[0].finding.contains("only") && !found.checks.iter().any(Check::bars_verdict));
        assert!(factors.iter().all(|factor| (*factor - 1.0).abs() < 1e-12));
        assert_eq!([0, 1, 2, 3, 4, 60].map(|turns| noise_freedom([turns])), [0, 0, 2, 4, 4, 8]);
    }
}
