//! One axis: means over windows, what noise may have made of their range, and windows that are unlike those beside them.

use runout_core::draws::Draw;

use super::course::{OF_SECOND_DIFFERENCES, noise_of, range, smoothed, within_ends};

/// Means on each side of one that stability is evaluated over.
pub(super) const BESIDE: usize = 2;
/// Windows so many standard deviations of a mean below the farthest one are not farther out: noise does that to one in 1e6 pairs.
const REACH: f64 = 7.0;
/// Share of a range that one window alone may be of it.
const MATTERS: f64 = 0.05;

/// One axis: means over the windows, smoothed a little, and the noise of one.
pub(super) struct Axis {
    pub name: &'static str,
    pub means: Vec<f64>,
    pub smooth: Vec<f64>,
    pub noise_um: f64,
    /// By how much readings may be rounded that stay as they are for most of the time.
    pub rounding_um: f64,
    /// Readings that are far from the others of their window.
    pub left_out: usize,
}

impl Axis {
    pub(super) fn new(name: &'static str, means: Vec<f64>, rounding_um: f64) -> Self {
        let (smooth, noise_um) = (smoothed(&means, BESIDE), noise_of(&means));
        Self { name, means, smooth, noise_um, rounding_um, left_out: 0 }
    }

    /// One draw of the noise: the range less what it may have raised it by, and the range with what it may have taken from it and means over windows.
    ///
    /// Its size is known from the means alone. Numbers that are drawn have the size that is found of them in the same way: how far that is off is in
    /// the draws.
    pub(super) fn ends(&self, draw: &mut Draw) -> (f64, f64) {
        let mut noise: Vec<f64> = (0..self.means.len()).map(|_| draw.normal()).collect();
        let found = noise_of(&noise);
        noise.iter_mut().for_each(|one| *one *= self.noise_um / found);
        let farthest = |sign: f64| {
            let out = self.means.iter().map(|mean| sign * mean).fold(f64::NEG_INFINITY, f64::max);
            let near = self.means.iter().zip(&noise).filter(|(mean, _)| sign * **mean >= out - REACH * self.noise_um);
            near.map(|(_, noise)| sign * noise).fold(f64::NEG_INFINITY, f64::max)
        };
        let found = range(&self.means);
        let low = found - farthest(1.0) - farthest(-1.0);
        let high = found + within_ends(&self.means) + noise[0] - noise[1];
        (low.max(0.0), high.max(0.0))
    }

    /// Windows that are farther from the middle of those beside them than noise is, and than those are.
    fn unlike(&self) -> impl Iterator<Item = usize> + '_ {
        let far = REACH * OF_SECOND_DIFFERENCES.sqrt() * self.noise_um;
        let last = self.means.len() - 1;
        let off = move |place: usize| {
            if (1..last).contains(&place) { (self.means[place] - self.between(place)).abs() } else { 0.0 }
        };
        (1..last).filter(move |place| off(*place) > far.max(off(place - 1)).max(off(place + 1)))
    }

    fn between(&self, place: usize) -> f64 {
        0.5 * (self.means[place - 1] + self.means[place + 1])
    }

    /// The axis with such windows in the middle of those beside them.
    pub(super) fn put_right(&self) -> Self {
        let mut means = self.means.clone();
        self.unlike().for_each(|place| means[place] = self.between(place));
        Self::new(self.name, means, self.rounding_um)
    }

    /// What refutes the range where it is that of one window, unlike those beside it.
    pub(super) fn alone(&self, times_min: &[f64]) -> Option<String> {
        let whole = range(&self.means);
        self.unlike().find_map(|place| {
            let others = range(&[&self.means[..place], &self.means[place + 1..]].concat());
            (others < (1.0 - MATTERS) * whole).then(|| {
                format!(
                    "the range of {} is {whole:.3} µm by one window alone, at {:.1} min: {others:.3} µm without it; look at its readings",
                    self.name, times_min[place]
                )
            })
        })
    }
}
