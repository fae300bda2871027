//! What is observable with setups before a ring is touched, and which one more helps most.
//!
//! A setup k with M touches evenly around reads each order as L·e^{−inπ} + F·e^{−inρ}, with noise of variance 2σ²/M in each part.
//! Over K setups the normal matrix of (L, F) is [K, s; s*, K] with s = Σ e^{in(π − ρ)}; each part of both has the variance
//! (2σ²/M)·K / (K² − |s|²).

use std::collections::BTreeMap;

use runout_core::{
    Complex64,
    closed_loop::{
        diagnosis::LostOrders,
        foresight::{Foresight, foresee},
    },
    points::{Column, Labels, Points},
    stage::{LayoutScore, NoiseGain, PointAddition, PointPlan, PointSeparator},
};

use crate::{
    config::{SetupConfig, TouchProbeConfig},
    effects::highest,
    separate::TouchProbe,
};

/// Touches of a setup that are taken for granted, at least: every 6°.
const DIRECTIONS: usize = 60;
/// Angles of an added setup are tried in steps of this, in degrees.
const STEP_DEG: usize = 1;
/// Noise gains within this factor are about the same.
const ABOUT: f64 = 1.1;

impl TouchProbe {
    /// Plans the setups, each touched around once.
    pub(crate) fn planned(&self) -> PointPlan {
        let foresight = self.foreseen();
        let mut plan = PointPlan {
            noise_gain: self.0.named(),
            lost_orders: self.lost_orders(),
            score: self.0.score(),
            notes: self.notes(),
            ..PointPlan::default()
        };
        for turned in [Turned::Ring, Turned::Probe] {
            let Some((with, setup)) = self.0.best_setup(turned) else { continue };
            let addition = PointAddition {
                add: "setup".into(),
                text: match turned {
                    Turned::Ring => format!("a setup with the ring at {}°", setup.ring_deg),
                    Turned::Probe => format!("a setup with the probe at {}° in the spindle", setup.probe_deg),
                },
                entry: format!(
                    "{{ id = \"{}\", ring_deg = {:?}, probe_deg = {:?} }}",
                    setup.id, setup.ring_deg, setup.probe_deg
                ),
                after: with.score(),
                noise_gain: with.named(),
                reveals: Vec::new(),
                distinguishes: Vec::new(),
            };
            plan.suggestions.push(addition.changing(&foresight, &Self(with).foreseen()));
        }
        plan.suggestions.sort_by(|a, b| {
            a.after.lost.cmp(&b.after.lost).then(b.reveals.len().cmp(&a.reveals.len())).then(a.after.compare(&b.after))
        });
        let assuming = format!("{} touches evenly around in each setup, once, 1 µm of noise in each", self.0.touches());
        plan.foresight = Foresight { assuming, ..foresight };
        plan
    }

    /// Which effects would show in touches of a round ring by a probe without lobing.
    fn foreseen(&self) -> Foresight {
        let config = TouchProbeConfig { std_um: Some(1.0), ..self.0.clone() };
        let setups = config.setups.iter();
        let touches = config.touches();
        let labels: Vec<String> = setups.flat_map(|setup| vec![setup.id.clone(); touches]).collect();
        let count = labels.len();
        let direction = |index: usize| 360.0 * (index % touches) as f64 / touches as f64;
        let columns = vec![
            Column { name: "direction_deg".into(), values: (0..count).map(direction).collect() },
            Column { name: "radius_mm".into(), values: vec![config.ring_radius_mm; count] },
        ];
        let labels = vec![Labels { name: "setup".into(), values: labels }];
        let points = Points { input: "plan".into(), columns, labels, ..Points::default() };
        let terms = Self(config).linear_terms(&points);
        terms.and_then(|terms| foresee(&terms)).unwrap_or_default()
    }
}

/// What an added setup turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Turned {
    Ring,
    Probe,
}

impl TouchProbeConfig {
    /// Touches around, enough for the highest order that is looked for.
    fn touches(&self) -> usize {
        DIRECTIONS.max(2 * highest(self.max_order) + 2)
    }

    /// Noise gain of a part of an order: of lobing and of the form of the ring. NaN where lost.
    fn gains(&self, order: usize) -> [f64; 2] {
        let all: Vec<usize> = (0..self.setups.len()).collect();
        let count = all.len() as f64;
        let of_touches = (2.0 / self.touches() as f64).sqrt();
        if !self.separates(&all, order) {
            // With a bound of the form, lobing is what is read.
            let read = if self.ring_form_um.is_some() { of_touches / count.sqrt() } else { f64::NAN };
            return [read, f64::NAN];
        }
        let turned = self
            .setups
            .iter()
            .map(|setup| Complex64::from_polar(1.0, order as f64 * (setup.probe_deg - setup.ring_deg).to_radians()));
        let sum: Complex64 = turned.sum();
        [of_touches * (count / (count * count - sum.norm_sqr())).sqrt(); 2]
    }

    fn named(&self) -> BTreeMap<String, Vec<NoiseGain>> {
        let of = |place: usize| {
            (2..=self.max_order).map(|order| NoiseGain::of_order(order, self.gains(order)[place])).collect()
        };
        BTreeMap::from([("lobing".to_owned(), of(0)), ("form".to_owned(), of(1))])
    }

    fn score(&self) -> LayoutScore {
        let gain = |order: usize| {
            let [lobing, form] = self.gains(order);
            // A bound of the form does not separate it.
            (format!("order {order}"), if form.is_finite() { lobing } else { f64::NAN })
        };
        LayoutScore::of(&(2..=self.max_order).map(gain).collect::<Vec<_>>())
    }

    /// Orders that setups (indices) do not separate, order 1 with them: it is centring.
    pub(crate) fn lost_orders(&self, setups: &[usize]) -> LostOrders {
        let form: Vec<usize> = std::iter::once(1).chain(self.lost(setups)).collect();
        let lobing = if self.ring_form_um.is_some() { vec![1] } else { form.clone() };
        LostOrders::of([("lobing", lobing), ("form", form)])
    }

    /// One more setup with the fewest lost orders and about the lowest worst noise gain, with what it then is; of a turned probe the one
    /// that best distinguishes order 2 of the machine from lobing.
    fn best_setup(&self, turned: Turned) -> Option<(Self, SetupConfig)> {
        let taken = |id: &str| self.setups.iter().any(|setup| setup.id == id);
        let mut tried: Vec<(LayoutScore, Self, SetupConfig)> = Vec::new();
        for step in 1..360 / STEP_DEG {
            let angle = (step * STEP_DEG) as f64;
            let (ring_deg, probe_deg) = if turned == Turned::Ring { (angle, 0.0) } else { (0.0, angle) };
            let name = if turned == Turned::Ring { "ring" } else { "probe" };
            let id = std::iter::once(format!("{name}-{angle}"))
                .chain((2..).map(|number| format!("{name}-{angle}-{number}")))
                .find(|id| !taken(id))?;
            let setup = SetupConfig { id, ring_deg, probe_deg };
            let mut with = self.clone();
            with.setups.push(setup.clone());
            tried.push((with.score(), with, setup));
        }
        let lost = tried.iter().map(|(score, ..)| score.lost).min()?;
        tried.retain(|(score, ..)| score.lost == lost);
        let worst = |score: &LayoutScore| score.worst.unwrap_or(f64::INFINITY);
        let lowest = tried.iter().map(|(score, ..)| worst(score)).fold(f64::INFINITY, f64::min);
        let apart = |setup: &SetupConfig| setup.probe_deg.to_radians().sin().abs();
        let kept = tried.into_iter().filter(|(score, ..)| worst(score) <= ABOUT * lowest);
        let best = match turned {
            Turned::Ring => kept.min_by(|a, b| worst(&a.0).total_cmp(&worst(&b.0))),
            Turned::Probe => kept.max_by(|a, b| apart(&a.2).total_cmp(&apart(&b.2))),
        };
        best.map(|(_, with, setup)| (with, setup))
    }
}
