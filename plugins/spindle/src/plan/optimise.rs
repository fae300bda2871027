//! Better angles for a rig's sensors: random search, then local refinement of the best.

use std::{cmp::Ordering, ops::RangeInclusive};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::rig::Rig;

use super::{
    gain::{Criterion, FormGain, Score},
    spacing::{STEPS_PER_DEG, Spacing, TooTight, distance_deg},
};

/// Random arrangements tried, and those of them that are refined.
const DRAWS: usize = 60_000;
const REFINED: usize = 60;
/// Arrangements near one that are tried before the search for a better one ends.
const NEIGHBOURS: usize = 2000;
/// Arrangements near one that are tried, where each is tried at many placements within the tolerance.
const NEIGHBOURS_WITHIN_TOLERANCE: usize = 300;
/// Longest step of the refinement: 5°.
const LONGEST_STEP: f64 = 500.0;
/// With more sensors than this, corners of the tolerance are drawn instead of all being tried.
const ALL_CORNERS: usize = 6;
/// Placements inside the tolerance at which a result is evaluated besides.
const INSIDE: usize = 500;
/// Two arrangements are different when some distance between two sensors differs by this much, in degrees.
const DIFFERENT_DEG: f64 = 2.0;
/// Arrangements reported.
const REPORTED: usize = 5;

/// Draws between two words of progress.
const DRAWS_A_STEP: usize = 2000;
/// How often [`optimise`] reports its progress.
pub const PROGRESS_STEPS: usize = DRAWS / DRAWS_A_STEP + REFINED;

/// What to look for.
#[derive(Debug, Clone)]
pub struct Search {
    /// Orders whose noise gain counts.
    pub orders: RangeInclusive<usize>,
    /// Smallest distance between sensors of one section, in degrees.
    pub clearance_deg: f64,
    /// How far each sensor may stand from where it should, in degrees.
    pub angle_tolerance_deg: f64,
    /// What is to be low.
    pub criterion: Criterion,
    /// Another seed searches along another way.
    pub seed: u64,
}

/// Sensors' angles and what they give.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrangement {
    /// By sensor, in degrees.
    pub angles_deg: Vec<f64>,
    /// With every sensor at its nominal angle.
    pub nominal: Score,
    /// The worst of all placements tried within the angle tolerance.
    pub within_tolerance: Score,
}

/// The declared arrangement and better ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// The rig's own.
    pub declared: Arrangement,
    /// Whether the rig's own sensors keep the clearance.
    pub declared_keeps_clearance: bool,
    /// Best first, none a mirror image or a rotation of another; only what is better than the rig's own, unless that
    /// breaks the clearance.
    pub found: Vec<Arrangement>,
}

/// Looks for angles of all sensors but the first that give form a lower noise gain, with the rig's setups as they are.
///
/// Arrangements are ranked by lost orders, then by the criterion, at the worst placement within the tolerance: the
/// nominal one and the corners ±tolerance of every sensor (64 drawn corners for more than six sensors). What is said of an
/// arrangement holds 500 drawn placements inside the tolerance besides, and 500 near the worst of these.
///
/// # Errors
/// When a section has no room for its sensors.
pub fn optimise(rig: &Rig, search: &Search, progress: &mut dyn FnMut(&str)) -> Result<Optimum, TooTight> {
    let mut random = ChaCha8Rng::seed_from_u64(search.seed);
    let mut bench = Bench::new(rig, search, &mut random)?;
    let own = rig.sensors.iter().map(|sensor| tidy(sensor.angle_rad.to_degrees())).collect();
    let declared = bench.arrangement(own);
    let keeps = bench.keeps_clearance(&declared.angles_deg);
    if rig.sensors.len() < 2 {
        return Ok(Optimum { declared, declared_keeps_clearance: keeps, found: Vec::new() });
    }
    let mut pool: Vec<(Score, Vec<i64>)> = Vec::with_capacity(REFINED + 1);
    for draw in 1..=DRAWS {
        let mut steps = vec![0; rig.sensors.len()];
        bench.spacing.draw(&mut steps, &mut random);
        let limit = pool.get(REFINED - 1).map(|(score, _)| *score);
        if let Some(score) = bench.nominal(&steps, limit) {
            let place = pool.partition_point(|(known, _)| known.compare(&score, search.criterion) != Ordering::Greater);
            pool.insert(place, (score, steps));
            pool.truncate(REFINED);
        }
        if draw.is_multiple_of(DRAWS_A_STEP) {
            progress(&bench.words(pool.first().map(|(score, _)| score)));
        }
    }
    let mut best: Option<Score> = None;
    let mut found = Vec::with_capacity(REFINED);
    for (score, mut steps) in pool {
        let mut final_score = bench.refine(&mut steps, score, NEIGHBOURS, Bench::nominal, &mut random);
        if bench.corners.len() > 1
            && let Some(score) = bench.toleranced(&steps, None)
        {
            final_score = bench.refine(&mut steps, score, NEIGHBOURS_WITHIN_TOLERANCE, Bench::toleranced, &mut random);
        }
        if best.is_none_or(|best| bench.is_better(&final_score, &best)) {
            best = Some(final_score);
        }
        progress(&bench.words(best.as_ref()));
        bench.spacing.sort(&mut steps);
        found.push(bench.arrangement(bench.degrees(&steps)));
    }
    found.sort_by(|a, b| a.within_tolerance.compare(&b.within_tolerance, search.criterion));
    let limit = keeps.then_some(declared.within_tolerance);
    found.retain(|found| limit.is_none_or(|limit| bench.is_better(&found.within_tolerance, &limit)));
    let mut different: Vec<(Arrangement, Vec<f64>)> = Vec::new();
    for arrangement in found {
        let distances = bench.distances(&arrangement.angles_deg);
        let same = |known: &[f64]| known.iter().zip(&distances).all(|(a, b)| (a - b).abs() < DIFFERENT_DEG);
        if different.len() < REPORTED && !different.iter().any(|(_, known)| same(known)) {
            different.push((arrangement, distances));
        }
    }
    let found = different.into_iter().map(|(arrangement, _)| arrangement).collect();
    Ok(Optimum { declared, declared_keeps_clearance: keeps, found })
}

/// What arrangements are tried on. An arrangement is the sensors' angles in hundredths of a degree; the first's is not
/// used.
struct Bench<'a> {
    rig: &'a Rig,
    search: &'a Search,
    spacing: Spacing,
    gain: FormGain,
    /// What is added to the sensors' angles, in rad, the nominal placement (nothing) among them.
    corners: Vec<Vec<f64>>,
    /// Angles inside the tolerance that are added to the sensors' angles, in rad: a high order may be worse there than at any corner.
    inside: Vec<Vec<f64>>,
}

type Judge<'a> = fn(&mut Bench<'a>, &[i64], Option<Score>) -> Option<Score>;

impl<'a> Bench<'a> {
    fn new(rig: &'a Rig, search: &'a Search, random: &mut ChaCha8Rng) -> Result<Self, TooTight> {
        let sensors = rig.sensors.len();
        let tolerance_rad = search.angle_tolerance_deg.to_radians();
        let side = |high: bool| if high { tolerance_rad } else { -tolerance_rad };
        let mut corners = vec![vec![0.0; sensors]];
        if tolerance_rad > 0.0 {
            corners.extend((0..1_usize << sensors.min(ALL_CORNERS)).map(|corner| {
                let every = |sensor: usize| side(corner >> sensor & 1 == 1);
                if sensors <= ALL_CORNERS {
                    (0..sensors).map(every).collect()
                } else {
                    (0..sensors).map(|_| side(random.random())).collect::<Vec<f64>>()
                }
            }));
        }
        let somewhere = |_| (0..sensors).map(|_| tolerance_rad * random.random_range(-1.0..=1.0)).collect();
        let inside = (0..if tolerance_rad > 0.0 { INSIDE } else { 0 }).map(somewhere).collect();
        let spacing = Spacing::new(rig, search.clearance_deg)?;
        Ok(Self { rig, search, spacing, gain: FormGain::new(rig), corners, inside })
    }

    fn nominal(&mut self, steps: &[i64], limit: Option<Score>) -> Option<Score> {
        let angles = radians(&self.degrees(steps));
        self.judge(&angles, limit)
    }

    /// The worst over the placements within the tolerance, where it is better than `limit`.
    fn toleranced(&mut self, steps: &[i64], limit: Option<Score>) -> Option<Score> {
        let angles = radians(&self.degrees(steps));
        let mut worst: Option<Score> = None;
        for index in 0..self.corners.len() {
            let placed: Vec<f64> = angles.iter().zip(&self.corners[index]).map(|(angle, off)| angle + off).collect();
            let Some(score) = self.judge(&placed, limit) else {
                // The corner that spoils one arrangement is likely to spoil its neighbours: it comes first next time.
                self.corners.swap(0, index);
                return None;
            };
            worst = Some(worst.map_or(score, |worst| worst.or_worse(score)));
        }
        let better = |score: &Score| limit.is_none_or(|limit| self.is_better(score, &limit));
        worst.filter(better)
    }

    fn judge(&mut self, angles_rad: &[f64], limit: Option<Score>) -> Option<Score> {
        let Search { orders, criterion, .. } = self.search;
        match limit {
            Some(limit) => self.gain.better(angles_rad, orders, &limit, *criterion),
            None => Some(self.gain.score(angles_rad, orders)),
        }
    }

    fn is_better(&self, score: &Score, than: &Score) -> bool {
        score.compare(than, self.search.criterion) == Ordering::Less
    }

    /// Tries neighbours, from far to near at random, and moves to each that is better.
    fn refine(
        &mut self,
        steps: &mut Vec<i64>,
        mut score: Score,
        tries: usize,
        judge: Judge<'a>,
        random: &mut ChaCha8Rng,
    ) -> Score {
        let sensors = steps.len();
        for _ in 0..tries {
            let reach = LONGEST_STEP.powf(random.random_range(0.0..=1.0)).round() as i64;
            let mut neighbour = steps.clone();
            let only = random.random_bool(0.5).then(|| random.random_range(1..sensors));
            for (sensor, step) in neighbour.iter_mut().enumerate().skip(1) {
                if only.is_none_or(|only| only == sensor) {
                    *step += random.random_range(-reach..=reach);
                }
            }
            if !self.spacing.allows(&neighbour) {
                continue;
            }
            if let Some(better) = judge(self, &neighbour, Some(score)) {
                (*steps, score) = (neighbour, better);
            }
        }
        score
    }

    fn degrees(&self, steps: &[i64]) -> Vec<f64> {
        let first = self.rig.sensors.first().map(|sensor| tidy(sensor.angle_rad.to_degrees()));
        let others = steps.iter().skip(1).map(|step| *step as f64 / STEPS_PER_DEG);
        first.into_iter().chain(others).collect()
    }

    fn arrangement(&mut self, angles_deg: Vec<f64>) -> Arrangement {
        let angles = radians(&angles_deg);
        let orders = &self.search.orders;
        let nominal = self.gain.score(&angles, orders);
        let mut score = |off: &[f64]| {
            let placed: Vec<f64> = angles.iter().zip(off).map(|(angle, off)| angle + off).collect();
            self.gain.score(&placed, orders)
        };
        let mut within_tolerance = nominal;
        let mut worst = (nominal, vec![0.0; angles.len()]);
        let mut look = |off: &[f64], worst: &mut (Score, Vec<f64>)| {
            let found = score(off);
            within_tolerance = within_tolerance.or_worse(found);
            if worst.0.compare(&found, self.search.criterion) == Ordering::Less {
                *worst = (found, off.to_vec());
            }
        };
        for off in self.corners.iter().chain(&self.inside) {
            look(off, &mut worst);
        }
        // From the worst of them on, in ever shorter steps.
        let tolerance_rad = self.search.angle_tolerance_deg.to_radians();
        for (step, towards) in self.inside.iter().enumerate() {
            let share = 0.5 * (1.0 - step as f64 / self.inside.len() as f64);
            let near =
                worst.1.iter().zip(towards).map(|(at, step)| (at + share * step).clamp(-tolerance_rad, tolerance_rad));
            look(&near.collect::<Vec<f64>>(), &mut worst);
        }
        Arrangement { angles_deg, nominal, within_tolerance }
    }

    /// Distances between sensors, those of one section first, each kind ascending: the same after a rotation and in a
    /// mirror.
    fn distances(&self, angles_deg: &[f64]) -> Vec<f64> {
        let mut distances: Vec<(bool, f64)> = self.pairs(angles_deg).collect();
        distances.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        distances.into_iter().map(|(_, distance)| distance).collect()
    }

    fn keeps_clearance(&self, angles_deg: &[f64]) -> bool {
        // 1e-6°: angles went through radians.
        self.pairs(angles_deg).all(|(apart, distance)| apart || distance >= self.search.clearance_deg - 1e-6)
    }

    /// Of every two sensors: whether they look at different sections, and their distance in degrees.
    fn pairs(&self, angles_deg: &[f64]) -> impl Iterator<Item = (bool, f64)> {
        let placed = move || self.rig.sensors.iter().zip(angles_deg);
        placed().enumerate().flat_map(move |(index, (sensor, angle))| {
            let others = placed().take(index);
            others.map(move |(other, at)| (sensor.section != other.section, distance_deg(*angle, *at)))
        })
    }

    fn words(&self, best: Option<&Score>) -> String {
        let value = |score: &Score| match self.search.criterion {
            Criterion::Worst => format!("worst {:.3}", score.worst),
            Criterion::Rms => format!("rms {:.3}", score.rms),
        };
        best.map(value).unwrap_or_default()
    }
}

fn radians(degrees: &[f64]) -> Vec<f64> {
    degrees.iter().map(|angle| angle.to_radians()).collect()
}

/// Degrees as they stood in the file, before they became radians.
fn tidy(degrees: f64) -> f64 {
    (degrees * 1e9).round() / 1e9
}
