//! From raw samples to one profile a capture: trims, filters, synchronous average.

mod butterworth;
mod cascade;
mod interruptions;
mod low_pass;
mod synchronous_average;
mod trim;

#[cfg(test)]
mod testing;

pub use low_pass::{LowPass, LowPassConfig};
use runout_core::pipeline::{Plugin, Registry};
pub use synchronous_average::{SynchronousAverage, SynchronousAverageConfig};
pub use trim::{EndTrim, TrimConfig};

/// Adds this crate's preprocessors.
pub fn register(registry: &mut Registry) {
    registry.preprocessors.add(Plugin::of::<TrimConfig>());
    registry.preprocessors.add(Plugin::of::<LowPassConfig>());
    registry.preprocessors.add(Plugin::of::<SynchronousAverageConfig>());
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use runout_core::{
        fault::Fault,
        pipeline::{Context, StageConfig},
        stage::Preprocessor,
    };

    use super::*;

    fn refused(config: impl StageConfig<Stage = Preprocessor>) -> Option<Fault> {
        config.check(&Context { folder: Path::new(""), rig: None }).err()
    }

    #[test]
    fn everything_is_registered_under_its_name() {
        let mut registry = Registry::default();
        register(&mut registry);
        let names: Vec<&str> = registry.preprocessors.iter().map(|plugin| plugin.name).collect();
        assert_eq!(names, ["trim", "low-pass", "synchronous-average"]);
    }

    #[test]
    fn values_that_cannot_be_are_faults_of_their_key() {
        for (cutoff_hz, order) in [(0.0, 4), (f64::NAN, 4), (f64::INFINITY, 4), (500.0, 0), (500.0, 9)] {
            assert!(refused(LowPassConfig { cutoff_hz, order }).is_some(), "{cutoff_hz} {order}");
        }
        for speed_tolerance_percent in [0.0, -1.0, f64::NAN] {
            assert!(refused(TrimConfig { speed_tolerance_percent, start_turns: 0, end_turns: 0 }).is_some());
        }
        let good = SynchronousAverageConfig {
            samples_per_rev: 512,
            min_turns: 5,
            turn_tolerance_percent: 5.0,
            outlier_sigma: None,
            speed_tolerance_percent: 2.0,
        };
        assert_eq!(refused(good.clone()), None);
        let fault = refused(SynchronousAverageConfig { samples_per_rev: 3, ..good.clone() });
        assert_eq!(fault, Some(Fault::at("samples_per_rev", "expected 4 to 131072, found 3")));
        for bad in [
            SynchronousAverageConfig { samples_per_rev: usize::MAX, ..good.clone() },
            SynchronousAverageConfig { min_turns: 0, ..good.clone() },
            SynchronousAverageConfig { turn_tolerance_percent: 50.0, ..good.clone() },
            SynchronousAverageConfig { outlier_sigma: Some(f64::NAN), ..good.clone() },
            SynchronousAverageConfig { speed_tolerance_percent: f64::INFINITY, ..good },
        ] {
            assert!(refused(bad).is_some());
        }
    }
}
