//! Several separators on the same preprocessed data: values side by side, and their differences beside those
//! expected from the scatter over the turns.
//!
//! Two methods on the same readings u make errors that are not independent. With δa = P_a δu and δb = P_b δu, the
//! difference of an order has the variance E|δa − δb|² = (P_a − P_b) Σ (P_a − P_b)ᴴ, Σ the covariance of the averaged
//! readings; E_n = |a − b| / (2 u) with u its root (ISO 13528:2022, 9.7, with expanded uncertainties of k = 2). For a
//! complex error that favours no phase, E_n ≤ 1 holds at 1 − e⁻⁴ = 98.2 % of the orders.

mod difference;
mod estimates;
mod methods;
mod points;
mod report;

use runout_error::fault::Fault;
use runout_evaluate::{Evaluate, EvaluatedStation};
use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

pub use super::config::candidate::{Candidate, Method, Refusal};
pub use points::{ComparingPoints, PointMethod};
pub use report::{
    ColumnComparison, ColumnDifference, Comparison, Difference, DifferenceOrders, Harmonics, MethodSummary,
    MethodValue, QuantityComparison, StationComparison, ValueComparison, ValueDifference, ValueOf, Worst,
};

use super::{
    Pipeline, Registry,
    config::{Route, exports::spare_inputs},
    observer::Observer,
    record_reader::{RecordReader, separate},
    registry::Context,
    warnings::of_station,
};
use crate::{
    stage::{Averager, Conditioner, Request, Source, Station, StationSeparator},
    summary::LostOrders,
};
use estimates::{Estimates, Scatter};
use runout_error::{Error, Result};
use runout_turning::station::StationResult;
use runout_turning::{
    measurement::StationTruth,
    provenance::{Provenance, VERSION},
    rig::Rig,
};

/// A pipeline with the separators that it is to compare.
pub struct Comparing<'a> {
    pipeline: &'a Pipeline,
    rig: &'a Rig,
    conditioners: &'a [Box<dyn Conditioner>],
    averager: &'a dyn Averager,
    reference: &'a dyn StationSeparator,
    /// What is compared with the pipeline's own separator.
    pub methods: Vec<Method>,
    /// Separators that cannot take the rig.
    pub refused: Vec<Refusal>,
    names: Vec<String>,
}

impl<'a> Comparing<'a> {
    /// Chooses the separators: those of `with` (by the `[[compare]]` tables of that plugin, or without keys where there
    /// is none), else those of all `[[compare]]` tables, else every other one that takes recorded turns.
    ///
    /// # Errors
    /// When the pipeline does not separate recorded turns, or nothing is left to compare with.
    pub fn new(
        pipeline: &'a mut Pipeline,
        with: &[String],
        registry: &Registry,
        folder: &Path,
    ) -> std::result::Result<Self, Fault> {
        let configured = std::mem::take(&mut pipeline.compare);
        let pipeline = &*pipeline;
        let (Route::Turns { conditioners, averager, separator, .. }, Some(rig)) = (&pipeline.route, &pipeline.rig)
        else {
            return Err(Fault::at("load", "[load] gives measured points, not recorded turns"));
        };
        let context = Context { folder, rig: Some(rig) };
        let candidates = methods::choose(configured, with, &pipeline.separator, registry, &context);
        let mut refused = Vec::new();
        let mut methods = Vec::new();
        for candidate in candidates {
            match candidate.assessed(averager.max_order()) {
                Ok(method) => methods.push(method),
                Err(refusal) => refused.push(refusal),
            }
        }
        if methods.is_empty() {
            let reasons: Vec<String> =
                refused.iter().map(|refusal| format!("{}: {}", refusal.method, refusal.reason)).collect();
            let fault = Fault::at("separate", "no other separator can take this rig: there is nothing to compare");
            return Err(fault.help(reasons.join("; ")));
        }
        let names = methods::distinct_names(&pipeline.separator, methods.iter_mut().map(|method| &mut method.name));
        let reference = &**separator;
        Ok(Self { pipeline, rig, conditioners, averager: &**averager, reference, methods, refused, names })
    }

    /// The pipeline's title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.pipeline.title
    }

    /// Separates every station with every method; `take` gets the stations in their order. The answer has none.
    ///
    /// # Errors
    /// When the data fail, a method fails on them, or an output is what is read.
    pub fn run(
        &self,
        threads: Option<NonZeroUsize>,
        observer: &dyn Observer,
        outputs: Vec<PathBuf>,
        mut take: impl FnMut(StationComparison) -> Result<()> + Send,
    ) -> Result<Comparison> {
        let pipeline = self.pipeline;
        let Source::Turns(recording) = pipeline.loader.open(&Request { rig: Some(self.rig), columns: &[] })? else {
            return Err(Error::new("compare", &pipeline.title, "the loader gave what it did not declare"));
        };
        spare_inputs(&outputs, &recording.inputs())?;
        let line = RecordReader {
            rig: self.rig,
            recording: &*recording,
            conditioners: self.conditioners,
            averager: self.averager,
            hold_out: None,
            projections: Vec::new(),
            puts_right: None,
            alone: false,
        };
        let work = |index, station: Station| self.station(&station, recording.truth(index)?.as_ref(), observer);
        let own = pipeline.assessment.as_ref();
        let assessments = own.into_iter().chain(self.methods.iter().map(|method| &method.assessment));
        let methods = self.names.iter().zip(assessments).map(|(name, found)| MethodSummary {
            method: name.clone(),
            unused: found.unused.clone(),
            lost_orders: LostOrders::from(found),
            notes: found.notes.clone(),
        });
        let mut methods: Vec<MethodSummary> = methods.collect();
        let mut warnings = recording.remarks();
        let inputs = line.run(threads, observer, work, |station: StationComparison| {
            warnings.extend(of_station(&station.station, &station.warnings));
            for quantity in &station.quantities {
                for value in &quantity.values {
                    let method = methods.iter_mut().find(|method| method.method == value.method);
                    method.into_iter().for_each(|method| {
                        method.lost_orders.add(quantity.section.is_some(), &value.lost_orders);
                    });
                }
            }
            take(station)
        })?;
        Ok(Comparison {
            title: pipeline.title.clone(),
            provenance: Provenance {
                program: format!("runout {VERSION}"),
                configuration: pipeline.configuration.clone(),
                inputs,
            },
            reference: pipeline.separator.clone(),
            methods,
            refused: self.refused.clone(),
            stations: Vec::new(),
            values: Vec::new(),
            columns: Vec::new(),
            outputs,
            warnings,
        })
    }

    fn station(
        &self,
        station: &Station,
        truth: Option<&StationTruth>,
        observer: &dyn Observer,
    ) -> Result<StationComparison> {
        let scatter = Scatter::of(station);
        let separators = std::iter::once(self.reference).chain(self.methods.iter().map(|method| &*method.separator));
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let ront = Evaluate::ront();
        let mut results = Vec::new();
        let mut estimates = Vec::new();
        let mut warnings: Vec<String> =
            station.profiles.iter().flat_map(|profile| profile.warnings.iter().cloned()).collect();
        for (separator, name) in separators.zip(&self.names) {
            let separation = separate(separator, station, self.rig)?;
            separator.messages().iter().for_each(|text| observer.message(text));
            warnings.extend(separation.warnings.iter().map(|warning| format!("{name}: {warning}")));
            estimates.push(Estimates::new(&separation, separator.sensitivity(station)?));
            // Profiles are shared; the standards' values need none.
            let (name, z_mm, profiles) = (station.name.clone(), station.z_mm, Vec::new());
            let result = StationResult { station: name, z_mm, angles, separation, profiles, truth: truth.cloned() };
            results.push(EvaluatedStation::of(result, &ront, self.rig.part_radius_mm, Some(self.rig), 1));
        }
        Ok(StationComparison {
            station: station.name.clone(),
            z_mm: station.z_mm,
            quantities: difference::quantities(&self.names, &results, estimates, &scatter),
            warnings,
        })
    }
}
