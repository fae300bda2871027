//! Single readings that are not like the others: named, never dropped.
//!
//! Readings are suspected one after the other, each the farthest from the fit without those before it, up to the last one that chance does
//! not explain (generalised extreme studentised deviates: Rosner, Technometrics 25 (1983) 165). The noise is known from the others, and
//! each reading's studentised deviation is that from the fit without the suspects (Belsley, Kuh, Welsch, *Regression Diagnostics*, 1980,
//! 2.1).

use nalgebra::{DMatrix, DVector};
use runout_numerics::{least_squares::dot, statistics::f_tail};

use crate::check::{Check, FINDING, Test, chance};
use crate::structure::Structure;

/// Share of the readings that may be suspect.
const MOST: f64 = 0.05;
/// Readings at most that are suspected.
const MOST_SUSPECTS: usize = 50;
/// Squared length of a reading's column outside the fit below which only that reading shows what it is off by.
const LEAST_FREE: f64 = 1e-9;
/// Degrees of freedom from which single readings are judged.
const FEWEST: usize = 8;
/// Standard deviations that noise of no instrument reaches.
const FAR: f64 = 12.0;
/// Variance of rounding to steps of 1.
const OF_ROUNDING: f64 = 1.0 / 12.0;

/// Least variance that numbers can show: that of rounding to their smallest difference. Of numbers that are not rounded it is next to nothing.
fn of_resolution(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    let size = sorted.iter().fold(0.0_f64, |size, one| size.max(one.abs()));
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > ROUNDING * size);
    let least = steps.fold(f64::INFINITY, f64::min);
    if least.is_finite() { OF_ROUNDING * least * least } else { 0.0 }
}

/// Relative difference that sums of equal numbers have.
const ROUNDING: f64 = 1e-9;

/// Readings that are not like the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Their indices, farthest first.
    pub rows: Vec<usize>,
    /// What each is off by from the fit without them, in the readings' unit.
    pub off_by: Vec<f64>,
    /// The studentised deviation of the farthest reading, named or not.
    pub farthest: f64,
    /// Chance of it, times the readings.
    pub p: f64,
    /// Degrees of freedom of the noise without suspects.
    pub dof: f64,
    /// Standard deviation of one reading with all of them, and without those named.
    pub std: [f64; 2],
}

/// Looks for such readings; `basis` are the orthonormal columns of the least-squares fit that left `residual`. `None` where too few
/// readings are left.
#[must_use]
pub fn unlike(residual: &[f64], basis: &[Vec<f64>]) -> Option<Rows> {
    let count = residual.len();
    let dof = count.checked_sub(basis.len()).filter(|dof| *dof >= FEWEST)?;
    let squares: f64 = residual.iter().map(|value| value * value).sum();
    if squares <= 0.0 {
        return None;
    }
    let all = squares / dof as f64;
    let Suspects { rows: suspects, left, free } = suspects(residual, basis, dof);
    let below = (dof - suspects.len()) as f64;
    let noise = (dot(&left, &left) / below).max(of_resolution(residual.iter().copied())).sqrt();
    // Of suspects: what each is off by from the fit without them is (1 − H)⁻¹r, with the variance (1 − H)⁻¹ in units of the noise.
    let among = DMatrix::from_fn(suspects.len(), suspects.len(), |one, other| {
        let shared: f64 = basis.iter().map(|column| column[suspects[one]] * column[suspects[other]]).sum();
        if one == other { 1.0 - shared } else { -shared }
    });
    let variance = among.cholesky()?.inverse();
    let off = &variance * DVector::from_iterator(suspects.len(), suspects.iter().map(|row| residual[*row]));
    let studentised = |place: usize| off[place].abs() / (noise * variance[(place, place)].sqrt());
    let mut judged: Vec<(usize, f64)> = (0..suspects.len()).map(|place| (place, studentised(place))).collect();
    judged.sort_by(|a, b| b.1.total_cmp(&a.1));
    // Behind the last suspect is the farthest of the others.
    let others = (0..count).filter(|row| !suspects.contains(row));
    let next = others.map(|row| left[row].abs() / (noise * free[row].max(f64::EPSILON).sqrt())).fold(0.0, f64::max);
    let tail = |t: f64| (f_tail(t * t, 1.0, below) * count as f64).min(1.0);
    let behind = |rank: usize| judged.get(rank).map_or(next, |(_, t)| *t);
    let apart = |rank: usize| judged[rank - 1].1 > (1.0 + (rank as f64).sqrt().recip()) * behind(rank);
    let set_apart = (1..=judged.len()).rev().find(|rank| apart(*rank) && tail(judged[*rank - 1].1) < FINDING);
    // Neighbours of a group that a fit has followed may hide it: what is so far is named all the same.
    let named = set_apart.unwrap_or_else(|| judged.iter().take_while(|(_, t)| *t > FAR).count());
    let named = judged[..named].iter().map(|(place, _)| *place);
    let farthest = judged.first().map_or(0.0, |(_, t)| *t);
    Some(Rows {
        off_by: named.clone().map(|place| off[place]).collect(),
        rows: named.map(|place| suspects[place]).collect(),
        farthest,
        p: tail(farthest),
        dof: below,
        std: [all.sqrt(), noise],
    })
}

/// Looks for single readings that are not like the others among readings that repeat places, each place with a mean of its own:
/// in a place whose squares are unlike those of the others (Cochran's test, ISO 5725-2) it is the reading farthest from the
/// others there. Indices count all readings, place by place. `None` where too few are repeated.
#[must_use]
pub fn unlike_repeats(places: &[Vec<f64>]) -> Option<Rows> {
    let mut first = 0;
    let mut repeated = Vec::new();
    for all in places {
        let (count, sum) = (all.len() as f64, all.iter().sum::<f64>());
        let off = |one: f64| one - sum / count;
        let farthest = (0..all.len()).max_by(|one, other| off(all[*one]).abs().total_cmp(&off(all[*other]).abs()));
        if let Some(reading) = farthest.filter(|_| all.len() > 1) {
            repeated.push(Repeated {
                row: first + reading,
                off_by: off(all[reading]) * count / (count - 1.0),
                squares: all.iter().map(|one| off(*one).powi(2)).sum(),
                dof: count - 1.0,
            });
        }
        first += all.len();
    }
    let (squares, dof) =
        (repeated.iter().map(|one| one.squares).sum::<f64>(), repeated.iter().map(|one| one.dof).sum::<f64>());
    let count = repeated.len();
    // One place has no others.
    if count < 2 || dof < FEWEST as f64 || squares <= 0.0 {
        return None;
    }
    repeated.sort_by(|one, other| other.mean_square().total_cmp(&one.mean_square()));
    let most = ((MOST * count as f64).ceil() as usize).clamp(1, MOST_SUSPECTS).min(count - 1);
    // Noise and degrees of freedom behind each rank, from none left out to all suspects.
    let least = of_resolution(places.iter().flatten().copied());
    let mut behind = vec![(squares, dof)];
    for one in &repeated[..most] {
        let (squares, dof) = behind[behind.len() - 1];
        behind.push(((squares - one.squares).max((dof - one.dof) * least), dof - one.dof));
    }
    let ratio =
        |rank: usize, at: usize| repeated[at].mean_square() * behind[rank].1 / behind[rank].0.max(f64::MIN_POSITIVE);
    let tail =
        |rank: usize, at: usize| (f_tail(ratio(rank, at), repeated[at].dof, behind[rank].1) * count as f64).min(1.0);
    let apart = |rank: usize| {
        // A mean square of few readings has a longer tail than a reading: half of what single readings have to be apart by.
        repeated[rank - 1].mean_square() > (1.0 + 0.5 / (rank as f64).sqrt()).powi(2) * repeated[rank].mean_square()
    };
    let named = (1..=most).rev().find(|rank| apart(*rank) && tail(*rank, rank - 1) < FINDING).unwrap_or(0);
    let rank = named.max(1);
    let chosen = &repeated[..named];
    Some(Rows {
        rows: chosen.iter().map(|one| one.row).collect(),
        off_by: chosen.iter().map(|one| one.off_by).collect(),
        farthest: ratio(rank, 0).sqrt(),
        p: tail(rank, 0),
        dof: behind[rank].1,
        std: [(squares / dof).sqrt(), (behind[named].0 / behind[named].1).sqrt()],
    })
}

/// A place with more than one reading.
struct Repeated {
    /// The reading farthest from the others.
    row: usize,
    /// From their mean.
    off_by: f64,
    /// Squares about the mean of all.
    squares: f64,
    dof: f64,
}

impl Repeated {
    fn mean_square(&self) -> f64 {
        self.squares / self.dof
    }
}

/// Readings that a fit does better without.
struct Suspects {
    rows: Vec<usize>,
    /// What the fit without them leaves of the others; 0 of them.
    left: Vec<f64>,
    /// Squared length of each reading's column outside that fit: the variance of the residual, in units of the noise.
    free: Vec<f64>,
}

/// One after the other: each is that whose own column takes most of the residual, and the last one is the last whose chance is small. At least one.
fn suspects(residual: &[f64], basis: &[Vec<f64>], dof: usize) -> Suspects {
    let count = residual.len();
    let most = ((MOST * count as f64).ceil() as usize).min(dof.saturating_sub(FEWEST / 2)).clamp(1, MOST_SUSPECTS);
    let mut left = residual.to_vec();
    // Squared length of each reading's column outside the fit.
    let outside = |row: usize| 1.0 - basis.iter().map(|column| column[row] * column[row]).sum::<f64>();
    let mut free: Vec<f64> = (0..count).map(outside).collect();
    let (mut chosen, mut added): (Vec<usize>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut last = Suspects { rows: Vec::new(), left: left.clone(), free: free.clone() };
    while chosen.len() < most {
        let gain = |row: &usize| left[*row] * left[*row] / free[*row];
        let seen = (0..count).filter(|row| free[*row] > LEAST_FREE);
        let Some(row) = seen.max_by(|one, other| gain(one).total_cmp(&gain(other))) else { break };
        let (taken, below) = (gain(&row), (dof - chosen.len() - 1) as f64);
        let rest = (dot(&left, &left) - taken).max(0.0);
        let p = f_tail(taken / (rest / below).max(f64::MIN_POSITIVE), 1.0, below) * (count - chosen.len()) as f64;
        chosen.push(row);
        let mut direction = vec![0.0; count];
        direction[row] = 1.0;
        for column in basis.iter().chain(&added) {
            let share = column[row];
            direction.iter_mut().zip(column).for_each(|(entry, known)| *entry -= share * known);
        }
        let length = free[row].sqrt();
        direction.iter_mut().for_each(|entry| *entry /= length);
        let along = dot(&direction, &left);
        for ((left, free), entry) in left.iter_mut().zip(&mut free).zip(&direction) {
            *left -= along * entry;
            *free -= entry * entry;
        }
        added.push(direction);
        if p < FINDING || last.rows.is_empty() {
            last = Suspects { rows: chosen.clone(), left: left.clone(), free: free.clone() };
        }
    }
    last
}

impl Rows {
    /// The test in words: which rows, how far off, and what they do to the noise.
    #[must_use]
    pub fn check(&self, structure: &Structure, unit: &str) -> Check {
        let names: Vec<String> = self.rows.iter().map(|row| structure.row(*row)).collect();
        let check = Check::new(Test::Rows, names.join(", "), self.farthest, &[self.dof], self.p);
        if self.rows.is_empty() {
            return check;
        }
        let off = |row: usize| format!("{} is off by {:.3} {unit}", names[row], self.off_by[row]);
        let said: Vec<String> = (0..self.rows.len().min(MOST_NAMED)).map(off).collect();
        let more = if self.rows.len() > MOST_NAMED {
            format!(" and {} more", self.rows.len() - MOST_NAMED)
        } else {
            String::new()
        };
        let finding = format!(
            "{}{more} ({}); without {} one reading has a standard deviation of {:.3} in place of {:.3} {unit}",
            said.join(", "),
            chance(self.p),
            if self.rows.len() == 1 { "it" } else { "them" },
            self.std[1],
            self.std[0]
        );
        Check { finding, did: crate::check::Action::Verdict, ..check }
    }
}

/// Readings or turns named one by one at most.
pub(crate) const MOST_NAMED: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use runout_numerics::least_squares::Basis;

    fn line(count: usize) -> Basis {
        Basis::of(vec![vec![1.0; count], (0..count).map(|at| at as f64).collect()])
    }

    /// Readings that a coarse resolution makes equal but for one are no more than rounded.
    #[test]
    fn a_step_of_the_resolution_is_not_named() {
        let level = Basis::of(vec![vec![1.0; 12]]);
        let left = |one: f64, step: f64| {
            let mut values: Vec<f64> = (0..12).map(|at| step * f64::from(u8::from(at % 4 == 1))).collect();
            values[7] = one;
            level.remove_from(&mut values);
            unlike(&values, level.columns()).unwrap().rows
        };
        assert_eq!(left(1.0, 0.0), [0_usize; 0]);
        assert_eq!(left(2.0, 1.0), [0_usize; 0]);
        assert_eq!(left(20.0, 1.0), [7]);
    }

    #[test]
    fn one_wild_reading_of_many_is_named_and_sound_ones_are_not() {
        let mut random = Random::new(7);
        for count in [24, 540] {
            let basis = line(count);
            let (mut false_names, mut one, mut three, mut edge) = (0, 0, 0, 0);
            for _ in 0..200 {
                let left = |mut values: Vec<f64>| {
                    basis.remove_from(&mut values);
                    unlike(&values, basis.columns()).unwrap()
                };
                let noise: Vec<f64> = (0..count).map(|_| 0.9 * random.normal()).collect();
                false_names += usize::from(!left(noise.clone()).rows.is_empty());
                let mut wild = noise.clone();
                wild[5] += 12.0;
                let found = left(wild.clone());
                one += usize::from(found.rows == [5] && found.std[1] < found.std[0]);
                // At the end of the line, where it decides most of the slope.
                let mut last = noise.clone();
                last[count - 1] -= 12.0;
                edge += usize::from(left(last).rows == [count - 1]);
                wild[7] -= 20.0;
                wild[9] += 15.0;
                let mut rows = left(wild).rows;
                rows.sort_unstable();
                three += usize::from(rows == [5, 7, 9]);
            }
            assert!(false_names < 4 && one > 190 && edge > 185, "{count}: {false_names} {one} {edge}");
            assert!(if count > 100 { three > 190 } else { true }, "{count}: {three}");
        }
    }

    /// A profile of 180 points with 162 free harmonics: the residual of a wild point is spread over its neighbours.
    #[test]
    fn a_wild_point_of_a_profile_with_many_harmonics_is_named() {
        let mut random = Random::new(11);
        let wave = |order: usize, at: usize| {
            let angle = std::f64::consts::TAU * (order.div_ceil(2) * at) as f64 / 180.0;
            if order.is_multiple_of(2) { angle.cos() } else { angle.sin() }
        };
        let basis = Basis::of((0..162).map(|order| (0..180).map(|at| wave(order, at)).collect()).collect());
        let (mut false_names, mut one) = (0, 0);
        for trial in 0..100 {
            let left = |mut values: Vec<f64>| {
                basis.remove_from(&mut values);
                unlike(&values, basis.columns()).unwrap().rows
            };
            let mut values: Vec<f64> = (0..180).map(|_| 0.05 * random.normal()).collect();
            false_names += usize::from(!left(values.clone()).is_empty());
            values[trial] += 8.0;
            one += usize::from(left(values) == [trial]);
        }
        assert!(false_names < 4 && one > 95, "{false_names} {one}");
    }

    /// A chip of four neighbouring points in a profile of 180 with 31 harmonics: these follow it, so that its neighbours hide it.
    #[test]
    fn a_group_that_the_fit_has_followed_is_named() {
        let mut random = Random::new(13);
        let wave = |order: usize, at: usize| {
            let angle = std::f64::consts::TAU * (order.div_ceil(2) * at) as f64 / 180.0;
            if order.is_multiple_of(2) { angle.cos() } else { angle.sin() }
        };
        let basis = Basis::of((0..31).map(|order| (0..180).map(|at| wave(order, at)).collect()).collect());
        let named = |depth: f64, random: &mut Random, at: usize| {
            let mut values: Vec<f64> = (0..180).map(|_| 0.3 * random.normal()).collect();
            values[at..at + 4].iter_mut().for_each(|value| *value -= depth);
            basis.remove_from(&mut values);
            !unlike(&values, basis.columns()).unwrap().rows.is_empty()
        };
        let (mut false_names, mut chips) = (0, 0);
        for trial in 0..60 {
            false_names += usize::from(named(0.0, &mut random, trial));
            chips += usize::from(named(15.0, &mut random, trial));
        }
        assert!(false_names < 3 && chips >= 55, "{false_names} {chips}");
    }

    /// Places with a mean of their own: of three readings, of two, and of two to five.
    #[test]
    fn a_wild_reading_among_repeats_is_named_and_sound_ones_are_not() {
        let mut random = Random::new(19);
        for counts in [vec![3; 700], vec![2; 30], (0..40).map(|place| 2 + place % 4).collect::<Vec<usize>>()] {
            let (mut false_names, mut one, mut three) = (0, 0, 0);
            for _ in 0..200 {
                let mut noise =
                    |place: usize| (0..counts[place]).map(|_| place as f64 + 0.9 * random.normal()).collect();
                let mut places: Vec<Vec<f64>> = (0..counts.len()).map(&mut noise).collect();
                false_names += usize::from(!unlike_repeats(&places).unwrap().rows.is_empty());
                let row = |place: usize, reading: usize| counts[..place].iter().sum::<usize>() + reading;
                places[5][1] += 12.0;
                let found = unlike_repeats(&places).unwrap();
                // Which of two is wild, two do not say.
                one += usize::from(found.rows == [row(5, 1)] || (counts[5] == 2 && found.rows == [row(5, 0)]));
                places[9][1] -= 15.0;
                places[13][0] += 20.0;
                three += usize::from(unlike_repeats(&places).unwrap().rows.len() == 3);
            }
            assert!(false_names < 5 && one > 190, "{} places: {false_names} {one}", counts.len());
            assert!(counts.len() < 100 || three > 190, "{} places: {three}", counts.len());
        }
        assert!(unlike_repeats(&[vec![1.0, 2.0], vec![3.0]]).is_none());
        let one_place: Vec<f64> = (0..12).map(f64::from).collect();
        assert!(unlike_repeats(&[one_place, vec![3.0]]).is_none() && unlike_repeats(&[]).is_none());
    }

    #[test]
    fn words_name_the_row_and_what_it_does() {
        let found = Rows { rows: vec![3], off_by: vec![50.0], farthest: 30.0, p: 1e-20, dof: 500.0, std: [2.39, 0.9] };
        let check = found.check(&Structure::default().naming((0..9).map(|row| format!("touch {row}")).collect()), "µm");
        assert_eq!(
            check.finding,
            "touch 3 is off by 50.000 µm (p 1e-20); without it one reading has a standard deviation of 0.900 in place of 2.390 µm"
        );
        assert!(unlike(&[0.0; 20], &[]).is_none() && unlike(&[1.0; 4], &[]).is_none());
    }
}
