//! Readings that an interruption of the part hides, from what the others say of them.
//!
//! An average bridges each reading by itself, by low orders and the readings beside the interruption. What the axis does meanwhile above these orders is
//! missing, and comes out as form elsewhere. Where readings are redundant, form and motion that the others give say what such a reading would be: it takes
//! the place of the bridge, and form and motion are solved for once more, until nothing is left of the hidden readings (expectation and maximisation,
//! Dempster, Laird and Rubin, J. R. Stat. Soc. B 39, 1977), by the steps of Barzilai and Borwein (IMA J. Numer. Anal. 8, 1988). What the form is inside the
//! interruption stays as it was bridged: no reading says.

use crate::stage::{Station, StationDiagnosis, StationModel, StationSeparator};
use runout_closed_loop::{Settings, diagnosis::Verdict};
use runout_error::Result;
use runout_numerics::{Complex64, fourier::Fourier, least_squares::dot};
use runout_turning::{
    profile::Profile,
    rig::Rig,
    separation::{Residual, Separation},
};

/// How often is solved at most, and what share of the noise in readings is nothing.
#[derive(Clone, Copy)]
struct Until {
    solutions: usize,
    share: f64,
}
const SEPARATED: Until = Until { solutions: 40, share: 3e-3 };
const DIAGNOSED: Until = Until { solutions: 20, share: 0.02 };
/// Searches among all effects: readings that agree with one effect may show the next.
const SEARCHES: usize = 2;
/// Longest step, in those of expectation and maximisation.
const LONGEST_STEP: f64 = 30.0;

/// Separates a station with what the other readings say of the hidden ones.
pub(super) fn separate(separator: &dyn StationSeparator, station: &Station, rig: &Rig) -> Result<Separation> {
    let hidden = Hidden::of(&station.profiles, rig);
    if hidden.is_empty() { separator.separate(station) } else { reveal(separator, &mut station.clone(), &hidden) }
}

/// What the closed loop finds. What the declared model says of hidden readings knows no effects: where some are found, also such as take away a part
/// only, the model that the loop ends with says it anew, until the readings agree with it. Of these, the loop finds what it finds.
pub(super) fn diagnose(
    stations: &mut [Station],
    settings: &Settings,
    rig: &Rig,
    (separator, model): (&dyn StationSeparator, &dyn StationModel),
) -> Result<StationDiagnosis> {
    let hidden: Vec<Hidden> = stations.iter().map(|station| Hidden::of(&station.profiles, rig)).collect();
    if hidden.iter().all(Hidden::is_empty) {
        return model.diagnose(stations, settings);
    }
    for (station, hidden) in stations.iter_mut().zip(&hidden) {
        reveal(separator, station, hidden)?;
    }
    // The loop drops the parts of profiles, which its next run needs.
    let run = |stations: &[Station], settings: &Settings| model.diagnose(&mut stations.to_vec(), settings);
    let with_parts = Settings { keeps_parts: true, ..settings.clone() };
    // By effects of some kinds only: a search among all takes many times as long.
    let reveal_by = |kinds: Vec<String>, stations: &mut [Station]| -> Result<StationDiagnosis> {
        let of_kinds = Settings { effects: Some(kinds), ..with_parts.clone() };
        let first = run(stations, &of_kinds)?;
        solve_again(stations, &hidden, first, DIAGNOSED, |stations| run(stations, &of_kinds), left_after)
    };
    if !settings.known.is_empty() {
        reveal_by(Vec::new(), stations)?;
    }
    let mut revealed = stations.to_vec();
    for _ in 0..SEARCHES {
        let added = run(&revealed, &with_parts)?.diagnosis.added;
        if added.is_empty() {
            break;
        }
        reveal_by(added.into_iter().map(|added| added.effect).collect(), &mut revealed)?;
        let found = run(&revealed, settings)?;
        if found.diagnosis.verdict != Verdict::Unexplained {
            stations.clone_from_slice(&revealed);
            return Ok(found);
        }
    }
    // Readings that agree with an effect that is none would hide what is there.
    model.diagnose(stations, settings)
}

fn left_after(found: &StationDiagnosis, station: usize) -> &Residual {
    &found.after[station].residual
}

/// Replaces the hidden readings of a station by what a separator says of them, and separates it.
fn reveal(separator: &dyn StationSeparator, station: &mut Station, hidden: &Hidden) -> Result<Separation> {
    let first = separator.separate(station)?;
    let (stations, hidden) = (std::slice::from_mut(station), std::slice::from_ref(hidden));
    let solve = |stations: &[Station]| separator.separate(&stations[0]);
    solve_again(stations, hidden, first, SEPARATED, solve, |found, _| &found.residual)
}

/// Replaces hidden readings by what a solution says of them and solves anew, until next to nothing is left of them. The first solution and the readings
/// as they were stay where that leads nowhere: a fit that weighs readings in its own way may not get there.
fn solve_again<T: Clone>(
    stations: &mut [Station],
    hidden: &[Hidden],
    first: T,
    until: Until,
    solve: impl Fn(&[Station]) -> Result<T>,
    residual: impl Fn(&T, usize) -> &Residual,
) -> Result<T> {
    let left_of = |found: &T| -> Vec<f64> {
        let each = hidden.iter().enumerate();
        each.flat_map(|(station, hidden)| hidden.left(residual(found, station))).collect()
    };
    let noise =
        |(station, hidden): (usize, &Hidden)| residual(&first, station).expected_rms_um.powi(2) * hidden.count() as f64;
    let noise: f64 = hidden.iter().enumerate().map(noise).sum();
    let mut left = left_of(&first);
    let at_first = dot(&left, &left);
    let nothing = until.share * until.share * if noise.is_finite() { noise } else { at_first };
    let (before, mut found, mut step) = (stations.to_vec(), first.clone(), 1.0);
    for _ in 1..until.solutions {
        if dot(&left, &left) <= nothing {
            break;
        }
        let change: Vec<f64> = left.iter().map(|left| -step * left).collect();
        let mut rest = &change[..];
        for (station, hidden) in stations.iter_mut().zip(hidden) {
            let (own, others) = rest.split_at(hidden.count());
            hidden.add(own, &mut station.profiles);
            rest = others;
        }
        found = solve(stations)?;
        let next = left_of(&found);
        let turned: Vec<f64> = next.iter().zip(&left).map(|(next, left)| next - left).collect();
        let along = dot(&change, &turned);
        step = if along > 0.0 { (dot(&change, &change) / along).clamp(1.0, LONGEST_STEP) } else { 1.0 };
        left = next;
    }
    if dot(&left, &left) > at_first {
        stations.clone_from_slice(&before);
        return Ok(first);
    }
    Ok(found)
}

/// The readings of a station that are hidden.
struct Hidden {
    /// Equal angles of a turn.
    angles: usize,
    readings: Vec<HiddenReading>,
}

/// A reading with hidden angles.
struct HiddenReading {
    profile: usize,
    channel: usize,
    /// Its place among the channels of all profiles.
    place: usize,
    /// Numbers of the hidden angles.
    at: Vec<usize>,
}

impl Hidden {
    fn of(profiles: &[Profile], rig: &Rig) -> Self {
        let angles = profiles.first().map_or(2, |profile| profile.samples_per_rev.max(2));
        let channels = profiles.iter().enumerate().flat_map(|(number, profile)| {
            profile.sensors.iter().enumerate().map(move |(channel, sensor)| (number, profile, channel, *sensor))
        });
        let hidden = channels.enumerate().map(|(place, (number, profile, channel, sensor))| {
            let gaps = rig.gaps_seen(profile.setup, sensor).widened(profile.bridged_beyond_rad);
            let at = gaps.of_equal(angles).enumerate().filter(|(_, hidden)| *hidden).map(|(angle, _)| angle);
            HiddenReading { profile: number, channel, place, at: at.collect() }
        });
        Self { angles, readings: hidden.filter(|reading| !reading.at.is_empty()).collect() }
    }

    fn is_empty(&self) -> bool {
        self.readings.is_empty()
    }

    /// Angles of all its readings.
    fn count(&self) -> usize {
        self.readings.iter().map(|reading| reading.at.len()).sum()
    }

    /// What a fit leaves of the hidden readings, one after the other, in µm.
    fn left(&self, residual: &Residual) -> Vec<f64> {
        let mut fourier = Fourier::new(self.angles);
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        let mut left = Vec::with_capacity(self.count());
        for HiddenReading { place, at, .. } in &self.readings {
            harmonics.fill(Complex64::ZERO);
            let own = residual.by_reading.iter().filter(|found| found.place == *place);
            for (order, value) in own.flat_map(|found| &found.harmonics) {
                if let Some(harmonic) = harmonics.get_mut(*order) {
                    // Residuals are coefficients of e^{−inΦ}.
                    *harmonic = value.conj();
                }
            }
            let values = fourier.synthesise(harmonics.iter().copied());
            left.extend(at.iter().map(|angle| values[*angle]));
        }
        left
    }

    /// Adds changes of the hidden readings, in µm, to the averages.
    fn add(&self, change_um: &[f64], profiles: &mut [Profile]) {
        let mut fourier = Fourier::new(self.angles);
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        let (mut values, mut rest) = (vec![0.0; self.angles], change_um);
        for HiddenReading { profile, channel, at, .. } in &self.readings {
            let (own, others) = rest.split_at(at.len());
            rest = others;
            values.fill(0.0);
            at.iter().zip(own).for_each(|(angle, change)| values[*angle] = *change);
            fourier.analyse_reversed_in_place(&mut values, &mut harmonics);
            let profile = &mut profiles[*profile];
            let (channels, split) = (profile.channels(), profile.split.as_mut());
            // It is hidden in all turns alike.
            let parts = split.into_iter().flat_map(|split| [&mut split.fit.mean, &mut split.held_out.mean]);
            for mean in std::iter::once(&mut profile.mean).chain(parts) {
                let own = mean.iter_mut().skip(*channel).step_by(channels);
                own.zip(&harmonics).for_each(|(mean, change)| *mean += change);
            }
        }
    }
}
