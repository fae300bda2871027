//! Mistakes of the declaration: angles of ring and probe that count the other way. Exchanged, they leave as much: lobing and form of the ring then
//! have each other's names.

use runout_core::points::{Points, mistakes};

use crate::{config::TouchProbeConfig, design::Content, separate::TouchProbe};

/// Mistakes are looked for where the fit leaves more than so many times the noise, and said where the correction leaves noise.
const FAR: f64 = 1.25;
const NOISE: f64 = 1.1;

impl TouchProbe {
    /// The likeliest mistake, where a fit leaves so many times the noise.
    pub(crate) fn mistake(&self, points: &Points, left: f64) -> Option<String> {
        if left.is_nan() || left < FAR {
            return None;
        }
        let changed = |what: &str, change: &dyn Fn(f64, f64) -> [f64; 2]| {
            let mut config: TouchProbeConfig = self.0.clone();
            for setup in &mut config.setups {
                [setup.ring_deg, setup.probe_deg] = change(setup.ring_deg, setup.probe_deg);
            }
            (what.to_owned(), Self(config))
        };
        let all = [
            changed("`ring_deg` counts the other way", &|ring, probe| [-ring, probe]),
            changed("`probe_deg` counts the other way", &|ring, probe| [ring, -probe]),
            changed("`ring_deg` and `probe_deg` count the other way", &|ring, probe| [-ring, -probe]),
        ];
        let left_of = |(what, probe): (String, Self)| {
            let prepared = probe.prepare(points).ok()?;
            let fit = probe.fit(&prepared, &[], &Content::declared(), &prepared.readings_um());
            Some((what, fit.chi2_per_dof.sqrt()))
        };
        mistakes::likeliest(left, NOISE, all.into_iter().filter_map(left_of))
    }
}
