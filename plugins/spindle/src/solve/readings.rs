//! One station's averaged readings, in the layout's order.

use runout_core::{
    Complex64, Error, Result, consistency::turns::TurnCourse, near_tone::NearTone, numerics::statistics::median,
    profile::Profile, stage::Station,
};

use crate::{layout::Layout, selection::Selection};

/// Share of a channel's readings by which resampling may change each order of them. Recordings without noise, as simulators write them, would
/// otherwise contradict every model by what they are computed with.
pub(crate) const RESAMPLING: f64 = 1e-8;

/// Averaged readings of one station: Re Σ uₙ e^{−inΦ}, with their covariance.
#[derive(Debug, Clone)]
pub(crate) struct Readings {
    /// Number of readings: sensors times setups.
    pub count: usize,
    /// Highest order that all profiles hold.
    pub max_order: usize,
    /// Equal angles a turn on which the profiles were averaged.
    pub samples_per_rev: usize,
    /// In each setup, the equal angles on which single turns were taken apart.
    pub turn_angles: Vec<usize>,
    /// Coefficients in µm, `[order][reading]`, orders from 0.
    pub mean: Vec<Complex64>,
    /// Covariance of `mean` in µm², one matrix `[order][channel][channel]` a setup, channels in the rig's order.
    pub covariance: Option<Vec<Vec<Complex64>>>,
    /// What it would be with independent turns, likewise; for weights, without what `covariance` is taken from where that is
    /// known apart.
    pub scatter: Option<Vec<Vec<Complex64>>>,
    /// Turns averaged in each setup.
    pub turns: Vec<usize>,
    /// What tones near whole orders put into the averages of each setup: order, and one coefficient a sensor.
    pub near_tones: Vec<Vec<(usize, Vec<Complex64>)>>,
    /// Standard uncertainty of the spindle angle in each setup, in rad.
    pub angle_std_rad: Vec<f64>,
    /// How the turns of each setup change, channels in the rig's order.
    pub courses: Vec<TurnCourse>,
    /// Place of each reading among the channels of all profiles of the station.
    pub places: Vec<usize>,
}

impl Readings {
    /// Gathers the profiles of a station.
    ///
    /// # Errors
    /// When a setup or a sensor of the rig is missing, or the profiles' angles differ.
    pub(crate) fn gather(selection: &Selection, layout: &Layout, station: &Station) -> Result<Self> {
        let object = || format!("station {}", station.name);
        let rig = &selection.rig;
        let sensors = rig.sensors.len();
        let mut ordered = Vec::with_capacity(rig.setups.len());
        let mut places = Vec::with_capacity(layout.readings.len());
        for (setup, clamping) in selection.setups.iter().zip(&rig.setups) {
            let position = (station.profiles.iter().position(|profile| profile.setup == *setup))
                .ok_or_else(|| Error::new("separate", object(), format!("setup `{}` is missing", clamping.id)))?;
            let profile = &station.profiles[position];
            let before: usize = station.profiles[..position].iter().map(Profile::channels).sum();
            let mut channels = Vec::with_capacity(sensors);
            for (index, sensor) in selection.sensors.iter().zip(&rig.sensors) {
                let channel = profile.sensors.iter().position(|found| found == index);
                channels.push(channel.ok_or_else(|| {
                    Error::new("separate", &profile.object, format!("sensor `{}` was not recorded", sensor.id))
                })?);
            }
            places.extend(channels.iter().map(|channel| before + channel));
            ordered.push((profile, channels));
        }
        let max_order = ordered.iter().map(|(profile, _)| profile.max_order()).min().unwrap_or(0);
        let samples_per_rev = ordered.first().map_or(0, |(profile, _)| profile.samples_per_rev);
        if ordered.iter().any(|(profile, _)| profile.samples_per_rev != samples_per_rev) {
            return Err(Error::new("separate", object(), "the setups were averaged on different numbers of angles"));
        }
        let mut mean = Vec::with_capacity((max_order + 1) * layout.readings.len());
        for order in 0..=max_order {
            for (profile, channels) in &ordered {
                let coefficients = profile.order(order);
                mean.extend(channels.iter().map(|channel| coefficients[*channel]));
            }
        }
        let matrices = |of: fn(&Profile) -> Option<&Vec<Complex64>>| -> Option<Vec<Vec<Complex64>>> {
            let one = |(profile, channels): &(&Profile, Vec<usize>)| {
                let (all, width) = (of(profile)?, profile.channels());
                let mut matrices = Vec::with_capacity((max_order + 1) * channels.len() * channels.len());
                for matrix in all.chunks_exact(width * width).take(max_order + 1) {
                    for row in channels {
                        let row = &matrix[row * width..(row + 1) * width];
                        matrices.extend(channels.iter().map(|column| row[*column]));
                    }
                }
                Some(matrices)
            };
            ordered.iter().map(one).collect()
        };
        let mut readings = Self {
            count: layout.readings.len(),
            max_order,
            samples_per_rev,
            turn_angles: ordered.iter().map(|(profile, _)| profile.turn_angles).collect(),
            mean,
            covariance: matrices(|profile| profile.covariance.as_ref()),
            scatter: matrices(|profile| profile.scatter_beside.as_ref().or(profile.scatter.as_ref())),
            turns: ordered.iter().map(|(profile, _)| profile.turns.used).collect(),
            near_tones: ordered.iter().map(|(profile, channels)| leaks(profile, channels)).collect(),
            angle_std_rad: ordered.iter().map(|(profile, _)| profile.angle_std_rad).collect(),
            courses: (ordered.iter())
                .map(|(profile, channels)| profile.course.of_channels(channels, profile.channels()))
                .collect(),
            places,
        };
        readings.add_resampling();
        Ok(readings)
    }

    /// Adds to covariance and scatter what resampling does to turns that are all alike.
    fn add_resampling(&mut self) {
        let sensors = self.count / self.turns.len().max(1);
        let mut squares = vec![0.0; self.count];
        for order in self.mean.chunks_exact(self.count.max(1)).skip(1) {
            squares.iter_mut().zip(order).for_each(|(sum, value)| *sum += value.norm_sqr());
        }
        for matrices in [&mut self.covariance, &mut self.scatter].into_iter().flatten() {
            for (matrices, squares) in matrices.iter_mut().zip(squares.chunks_exact(sensors.max(1))) {
                for matrix in matrices.chunks_exact_mut(sensors * sensors) {
                    for (sensor, square) in squares.iter().enumerate() {
                        matrix[sensor * (sensors + 1)] += RESAMPLING * RESAMPLING * square;
                    }
                }
            }
        }
    }

    /// About what single samples scatter by, of the quietest channel: from the median over the orders. `None` where it is not known.
    pub(crate) fn sample_noise_um(&self) -> Option<f64> {
        let sensors = self.count / self.turns.len().max(1);
        let of_setup = |(matrices, turns): (&Vec<Complex64>, &usize)| {
            let channel = |channel: usize| {
                let of_orders =
                    matrices.chunks_exact(sensors * sensors).skip(1).map(|matrix| matrix[channel * (sensors + 1)].re);
                // E|c|² of a mean of T turns of N samples with the variance σ² is 4σ²/NT.
                (0.25 * median(of_orders) * (self.samples_per_rev * turns) as f64).sqrt()
            };
            (0..sensors).map(channel).fold(f64::INFINITY, f64::min)
        };
        let all = self.covariance.as_ref()?.iter().zip(&self.turns);
        all.map(of_setup).reduce(f64::min)
    }

    /// Adds to the covariance of the averages what tones near whole orders put into them.
    pub(crate) fn add_near_tones(&mut self) {
        let sensors = self.count / self.turns.len().max(1);
        for (matrices, tones) in self.covariance.iter_mut().flatten().zip(&self.near_tones) {
            for (order, leak) in tones.iter().filter(|(order, _)| *order <= self.max_order) {
                let matrix = &mut matrices[order * sensors * sensors..(order + 1) * sensors * sensors];
                for (row, one) in matrix.chunks_exact_mut(sensors).zip(leak) {
                    row.iter_mut().zip(leak).for_each(|(entry, other)| *entry += one * other.conj());
                }
            }
        }
    }

    /// Whether angles of setups against each other are known to a part of a sample only.
    #[must_use]
    pub(crate) fn has_uncertain_angles(&self) -> bool {
        // The angle of one setup is what all angles are counted from.
        self.turns.len() > 1 && self.angle_std_rad.iter().any(|std_rad| *std_rad > 0.0)
    }

    /// Whether results are uncertain by more than the noise of the averages: by angles, or by turns that change.
    #[must_use]
    pub(crate) fn has_more_than_noise(&self) -> bool {
        self.has_uncertain_angles() || self.courses.iter().any(|course| !course.is_steady())
    }

    /// Adds to the covariance of the averages what their noise does not show: uncertain angles, and what changes from turn to turn.
    pub(crate) fn add_more_than_noise(&mut self) {
        self.add_angle_uncertainty();
        let sensors = self.count / self.turns.len().max(1);
        for (setup, (matrices, course)) in self.covariance.iter_mut().flatten().zip(&self.courses).enumerate() {
            // What a tone near an order does to it from turn to turn is in the covariance already.
            let has_tone = |order: usize| self.near_tones[setup].iter().any(|(near, _)| *near == order);
            let means = self.mean.chunks_exact(self.count).map(|order| &order[setup * sensors..(setup + 1) * sensors]);
            for (order, (matrix, mean)) in matrices.chunks_exact_mut(sensors * sensors).zip(means).enumerate().skip(1) {
                if let Some(course) = course.covariance(order, mean).filter(|_| !has_tone(order)) {
                    matrix.iter_mut().zip(course).for_each(|(entry, course)| *entry += course);
                }
            }
        }
    }

    /// Adds to the covariance of the averages that of the angle which each setup's turns are counted from: at an angle that is off by
    /// δ, order n is off by −i·n·δ·u, in all channels together.
    ///
    /// Weights do not have it: it repeats in every turn, and scatter does not show it.
    fn add_angle_uncertainty(&mut self) {
        if !self.has_uncertain_angles() {
            return;
        }
        let sensors = self.count / self.turns.len();
        for (setup, (matrices, std_rad)) in self.covariance.iter_mut().flatten().zip(&self.angle_std_rad).enumerate() {
            if *std_rad <= 0.0 {
                continue;
            }
            let means = self.mean.chunks_exact(self.count).map(|order| &order[setup * sensors..(setup + 1) * sensors]);
            for (order, (matrix, mean)) in matrices.chunks_exact_mut(sensors * sensors).zip(means).enumerate() {
                let square = (order as f64 * std_rad).powi(2);
                for (row, one) in matrix.chunks_exact_mut(sensors).zip(mean) {
                    row.iter_mut().zip(mean).for_each(|(entry, other)| *entry += square * one * other.conj());
                }
            }
        }
    }

    /// Leaves out the orders above `max_order`.
    pub(crate) fn truncate(&mut self, max_order: usize) {
        if max_order >= self.max_order {
            return;
        }
        let sensors = self.count / self.turns.len().max(1);
        self.max_order = max_order;
        self.mean.truncate((max_order + 1) * self.count);
        for matrices in [&mut self.covariance, &mut self.scatter].into_iter().flatten().flatten() {
            matrices.truncate((max_order + 1) * sensors * sensors);
        }
    }

    /// The readings of one order.
    #[must_use]
    pub(crate) fn order(&self, order: usize) -> &[Complex64] {
        &self.mean[order * self.count..(order + 1) * self.count]
    }
}

/// What tones put into the averages of some channels, by order.
fn leaks(profile: &Profile, channels: &[usize]) -> Vec<(usize, Vec<Complex64>)> {
    let of = |tone: &NearTone| (tone.order, channels.iter().map(|channel| tone.leak[*channel]).collect());
    profile.near_tones.iter().map(of).collect()
}
