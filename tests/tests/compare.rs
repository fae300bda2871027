//! Several separators on the same simulated campaigns: their differences are what their joint covariance allows.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::{Path, PathBuf};

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{
        Context, Pipeline, Plugin, Registry, StageConfig,
        compare::{Comparing, Comparison, QuantityComparison},
        document::Sources,
        run::Silent,
    },
    rig::RigConfig,
    stage::{Loader, Request, Source, SourceKind},
};
use runout_spindle::simulate::{SpindleConfig, SpindleSimulator, simulator};
use schemars::JsonSchema;
use serde::Deserialize;

/// The reference campaign of the studies (60 turns, noise 0.05 µm, asynchronous motion 0.15 µm, form 4 µm rms, motion
/// 1.5 µm rms), on another rig.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Simulated {
    seed: u64,
    rig: RigConfig,
    /// Sensor noise, and no asynchronous motion, where it is not the usual.
    #[serde(default)]
    noise_rms_um: Option<f64>,
    /// S2 reads so much too much, relative.
    #[serde(default)]
    gain: f64,
}

/// A simulator lives as long as the test.
struct SimulatedRecording(&'static SpindleSimulator);

impl Loader for SimulatedRecording {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, _wanted: &Request) -> Result<Source> {
        Ok(Source::Turns(Box::new(self.0.spindle_recording())))
    }
}

impl StageConfig for Simulated {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "simulated";
    const ABOUT: &'static str = "a campaign in memory";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let mut config = SpindleConfig::new(self.rig);
        config.seed = self.seed;
        config.recording.samples_per_rev = 128;
        config.form.rms_um = 4.0;
        config.form.max_order = 25;
        config.motion.x_rms_um = 1.5;
        config.motion.y_rms_um = 1.5;
        config.motion.tilt_rms_urad = 3.0;
        config.eccentricity.offset_um = 4.0;
        config.asynchronous.rms_um = self.noise_rms_um.is_none().then_some(0.15);
        config.noise.rms_um = self.noise_rms_um.unwrap_or(0.05);
        if self.gain != 0.0 {
            let effect = format!("plugin = 'sensor-gain'\ntargets = ['S2']\nrelative_gain = {}", self.gain);
            config.effect.push(toml::from_str(&effect).unwrap());
        }
        Ok(Box::new(SimulatedRecording(Box::leak(Box::new(simulator(&config)?)))))
    }
}

const FIVE: &str = r#"{ part_radius_mm = 30, sensors = [
  { id = "S1", angle_deg = 0, z_mm = 100, section = "a" }, { id = "S2", angle_deg = 90, z_mm = 100, section = "a" },
  { id = "S3", angle_deg = 222.5, z_mm = 100, section = "a" }, { id = "S4", angle_deg = 0, z_mm = 130, section = "b" },
  { id = "S5", angle_deg = 90, z_mm = 130, section = "b" } ],
  setups = [{ id = "k0" }, { id = "k1", part_deg = 180, sensors_deg = 180 }] }"#;

fn registry() -> Registry {
    let mut registry = Registry::default();
    registry.loaders.add(Plugin::of::<Simulated>());
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    registry
}

fn compare(rig: &str, load: &str, stages: &str, with: &[&str]) -> std::result::Result<Comparison, String> {
    let text = format!(
        "rig = {rig}\n[load]\nplugin = \"simulated\"\nrig = {rig}\n{load}\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n{stages}"
    );
    let registry = registry();
    let sources = Sources::from_text("test", &text, PathBuf::new(), &[], "none").map_err(|error| error.to_string())?;
    let mut pipeline = Pipeline::from_sources(&sources, &registry).map_err(|error| error.to_string())?;
    let with: Vec<String> = with.iter().map(|name| (*name).to_owned()).collect();
    let comparing =
        Comparing::new(&mut pipeline, &with, &registry, Path::new("")).map_err(|fault| fault.to_string())?;
    let mut stations = Vec::new();
    let take = |station| {
        stations.push(station);
        Ok(())
    };
    let mut comparison = comparing.run(None, &Silent, Vec::new(), take).map_err(|error| error.to_string())?;
    comparison.stations = stations;
    Ok(comparison)
}

fn quantities(comparison: &Comparison) -> impl Iterator<Item = &QuantityComparison> {
    comparison.stations.iter().flat_map(|station| &station.quantities)
}

const GENERAL: &str = "[separate]\nplugin = \"harmonic-least-squares\"\n";

/// Which quantities.
type OfQuantity = fn(&str) -> bool;

/// Orders compared, those with E_n ≤ 1, and the mean square difference over the expected one, over many seeds.
fn agreement(method: &str, quantity: OfQuantity) -> (usize, f64, f64) {
    let (mut all, mut within, mut ratios, mut count) = (0, 0, 0.0, 0.0);
    for seed in 1..=10 {
        let comparison = compare(FIVE, &format!("seed = {seed}"), GENERAL, &[method]).unwrap();
        let differences = quantities(&comparison).filter(|one| quantity(&one.quantity));
        for one in differences.flat_map(|quantity| &quantity.differences) {
            let e_n = one.by_order.e_n.iter().flatten();
            all += e_n.clone().count();
            within += e_n.filter(|e_n| **e_n <= 1.0).count();
            ratios += (one.rms.unwrap() / one.expected_rms.unwrap()).powi(2);
            count += 1.0;
        }
    }
    let (share, ratio) = (within as f64 / all as f64, ratios / count);
    println!("{method}: E_n ≤ 1 at {share:.4} of {all} orders, mean square {ratio:.2} of the expected");
    (all, share, ratio)
}

#[test]
fn differences_are_what_the_joint_covariance_allows() {
    // Donaldson's motion is another matter: below.
    let cases: [(&str, OfQuantity); 3] = [
        ("four-sensor-reversal", |_| true),
        ("donaldson-reversal", |quantity| quantity == "form"),
        ("three-point", |_| true),
    ];
    for (method, quantity) in cases {
        let (all, share, ratio) = agreement(method, quantity);
        assert!(all > 1000);
        // Scatter alone keeps 98.2 %; the covariance is itself an estimate from 60 turns.
        assert!(share >= 0.95, "{method}: {share}");
        // Nor may the differences be far smaller than stated, or nothing would ever be caught.
        assert!((0.5..2.0).contains(&ratio), "{method}: {ratio}");
    }
}

/// A sensor along x does not see y, of which (y/R)·h' comes into its readings: reversal changes its sign, so it goes
/// into x and not into the form.
#[test]
fn motion_across_a_donaldson_sensor_shows_in_its_motion() {
    let found = compare(FIVE, "seed = 2\nnoise_rms_um = 0.005", GENERAL, &["donaldson-reversal"]).unwrap();
    let difference = |quantity: &str| {
        let one = quantities(&found).find(|one| one.quantity == quantity).unwrap();
        (&one.values[0], &one.differences[0])
    };
    let (form, of_form) = difference("form");
    let (_, of_x) = difference("x");
    // h' in µm/rad; y and h' are independent of each other.
    let slopes = (1..).zip(form.harmonics.re.iter().zip(&form.harmonics.im)).skip(1);
    let square = |(order, (re, im)): (i32, (&Option<f64>, &Option<f64>))| {
        f64::from(order).powi(2) * (re.unwrap().powi(2) + im.unwrap().powi(2))
    };
    let slope = (0.5 * slopes.map(square).sum::<f64>()).sqrt();
    let predicted_um = 1.5 / 30_000.0 * slope;
    let rms_um = of_x.rms.unwrap();
    println!("x: {rms_um:.4} µm rms, (y/R)·h' {predicted_um:.4} µm, scatter {:.4} µm", of_x.expected_rms.unwrap());
    // The product of two curves of some 20 orders has the product of their rms only on the average; and motion at 1/rev,
    // which one direction takes for eccentricity, adds as much again.
    assert!((0.6..3.0).contains(&(rms_um / predicted_um)), "{rms_um} µm against {predicted_um} µm");
    let within = [of_x, of_form].map(|one| one.share_within.unwrap());
    // Scatter alone gives 0.982 ± 0.017 of 62 orders: 0.9 is five standard deviations below.
    assert!(within[0] < 0.9 && within[1] > 0.9, "{within:?}");
}

#[test]
fn a_wrong_gain_is_caught() {
    let found = |gain: f64| {
        let comparison = compare(FIVE, &format!("seed = 3\ngain = {gain}"), GENERAL, &["three-point"]).unwrap();
        let form = quantities(&comparison).find(|quantity| quantity.quantity == "form").unwrap();
        let e_n: Vec<f64> = form.differences[0].by_order.e_n.iter().copied().flatten().collect();
        (e_n.iter().copied().fold(0.0, f64::max), e_n.iter().filter(|e_n| **e_n > 1.0).count())
    };
    let (worst, beyond) = found(0.05);
    println!("gain of S2 5 % too high: worst E_n {worst:.1}, above 1 at {beyond} orders");
    // 5 % of a form of 4 µm in 24 orders is 0.04 µm each, ten times the scatter.
    assert!(worst > 5.0 && beyond >= 5, "{worst}, {beyond}");
    assert!(found(0.0).1 <= 3, "and without it there is nothing to catch");
}

#[test]
fn even_orders_of_fixed_sensors_are_lost_in_every_number() {
    let fixed = FIVE
        .replace("sensors_deg = 180", "sensors_deg = 0")
        .replace("\n  { id = \"S3\", angle_deg = 222.5, z_mm = 100, section = \"a\" },", "");
    let comparison = compare(&fixed, "seed = 1", GENERAL, &["four-sensor-reversal", "donaldson-reversal"]).unwrap();
    assert_eq!(comparison.refused.len(), 1, "Donaldson needs the sensor reversed");
    for method in &comparison.methods {
        assert_eq!(method.lost_orders.form, (2..=63).step_by(2).collect::<Vec<_>>());
    }
    for quantity in quantities(&comparison) {
        for value in &quantity.values {
            for (order, re) in (1..).zip(&value.harmonics.re) {
                assert_eq!(re.is_none(), order % 2 == 0, "{} {order}", quantity.quantity);
            }
        }
        for one in &quantity.differences {
            for (order, difference) in (1..).zip(&one.by_order.difference) {
                let compared = order % 2 == 1 && (order > 1 || quantity.quantity != "form");
                assert_eq!(difference.is_some(), compared, "{} {order}", quantity.quantity);
            }
        }
    }
}

#[test]
fn methods_that_do_the_same_are_equal_to_rounding() {
    let same = "[separate]\nplugin = \"four-sensor-reversal\"\n[[compare]]\nplugin = \"harmonic-least-squares\"\n\
                sensors = [\"S1\", \"S2\", \"S4\", \"S5\"]\nweighting = \"none\"\n";
    let comparison = compare(FIVE, "seed = 1", same, &[]).unwrap();
    for quantity in quantities(&comparison) {
        let one = &quantity.differences[0];
        assert!(one.rms.unwrap() < 1e-9, "{}: {:?} µm or µrad", quantity.quantity, one.rms);
        assert!(one.by_order.e_n.iter().flatten().all(|e_n| *e_n == 0.0), "{}", quantity.quantity);
        assert_eq!(one.share_within, Some(1.0));
    }
}

#[test]
fn who_is_compared() {
    let names = |comparison: &Comparison| -> Vec<String> {
        comparison.methods.iter().map(|method| method.method.clone()).collect()
    };
    let all = compare(FIVE, "seed = 1", GENERAL, &[]).unwrap();
    assert_eq!(names(&all), ["harmonic-least-squares", "donaldson-reversal", "four-sensor-reversal", "three-point"]);
    let reasons: Vec<&str> = all.refused.iter().map(|refusal| refusal.reason.as_str()).collect();
    assert!(matches!(reasons[..], [reason] if reason.contains("two or more angles")), "{reasons:?}");

    let tables = format!("{GENERAL}[[compare]]\nplugin = \"three-point\"\nmax_noise_gain = 2\n");
    let with = compare(FIVE, "seed = 1", &tables, &["three-point", "harmonic-least-squares"]).unwrap();
    assert_eq!(names(&with), ["harmonic-least-squares", "three-point", "harmonic-least-squares (2)"]);
    assert!(with.methods[1].lost_orders.form.len() > all.methods[3].lost_orders.form.len(), "its table counts");

    let unknown = format!("{GENERAL}[[compare]]\nplugin = \"three-point\"\nmax_gain = 2\n");
    assert!(compare(FIVE, "seed = 1", &unknown, &[]).unwrap_err().contains("max_gain"));
    let nothing = compare(FIVE, "seed = 1", GENERAL, &["multi-step"]).unwrap_err();
    assert!(nothing.contains("nothing to compare"), "{nothing}");
}
