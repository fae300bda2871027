//! Recorded turns on their way to profiles, station by station, threads across stations.

use std::{
    num::NonZeroUsize,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
};

use super::{
    overlap::{Captures, read_ahead, read_along},
    run::Observer,
    turnstile::Turnstile,
};
use crate::{
    Error, Result,
    inspection::Inspection,
    measurement::{Recording, SampleStream, StationKey},
    profile::Profile,
    provenance::Input,
    rig::Rig,
    separation::{Quantity, Separation},
    spread::Projection,
    stage::{Averager, Conditioner, Station, StationSeparator, Wanted},
};

/// From recorded turns to the profiles of one station after the other.
pub struct Line<'a> {
    pub rig: &'a Rig,
    pub recording: &'a dyn Recording,
    pub conditioners: &'a [Box<dyn Conditioner>],
    pub averager: &'a dyn Averager,
    /// Share of the turns that are averaged by themselves besides.
    pub hold_out: Option<f64>,
    /// How motion follows from the readings of each setup, where the spread over the turns is wanted.
    pub projections: Vec<Option<Projection>>,
}

impl Line<'_> {
    /// Does `work` on every station (its index and its profiles), and the inputs' checksums meanwhile; `take` gets
    /// what comes of it, in the order of the stations.
    ///
    /// Each worker takes the next station, and waits only where it is too far ahead of the others: few results exist at a
    /// time.
    pub fn run<T: Send>(
        &self,
        threads: Option<NonZeroUsize>,
        observer: &dyn Observer,
        work: impl Fn(usize, Station) -> Result<T> + Sync,
        mut take: impl FnMut(T) -> Result<()> + Send,
    ) -> Result<Vec<Input>> {
        let stations = self.recording.stations();
        observer.begin(stations.len());
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let threads = threads.map_or(processors, NonZeroUsize::get);
        let workers = threads.clamp(1, stations.len().max(1));
        // Where there are fewer stations than threads, some can help to read.
        let readers = NonZeroUsize::new(threads / workers).unwrap_or(NonZeroUsize::MIN);
        let next = AtomicUsize::new(0);
        let failed = AtomicBool::new(false);
        let turnstile = Turnstile::new(|index: usize, result| {
            take(result)?;
            observer.station(&stations[index].name);
            Ok(())
        });
        let setups = self.rig.setups.len();
        let worker = || {
            let claimed = std::iter::from_fn(|| {
                let more = !failed.load(Ordering::Relaxed);
                more.then(|| next.fetch_add(1, Ordering::Relaxed)).filter(|index| *index < stations.len())
            });
            let captures = claimed
                .flat_map(|station| (0..setups).map(move |setup| (station, setup)))
                .map(|(station, setup)| (station, self.recorded(readers, station, setup)));
            let work_on = |captures: &mut dyn Captures<usize>| {
                while let Some(index) = captures.coming() {
                    let result = self.station(&stations[index], captures).and_then(|station| work(index, station));
                    if !turnstile.pass(index, result) {
                        failed.store(true, Ordering::Relaxed);
                    }
                }
            };
            if workers < processors { read_ahead(captures, work_on) } else { read_along(captures, work_on) }
        };
        let along = self.recording.checksum();
        if let Some(checksum) = along {
            checksum.begin();
        }
        let inputs = std::thread::scope(|scope| {
            let apart = || self.recording.inputs().iter().map(|path| Input::of(path)).collect::<Result<Vec<_>>>();
            let checksums = scope.spawn(move || if along.is_some() { Ok(Vec::new()) } else { apart() });
            for _ in 1..workers {
                scope.spawn(worker);
            }
            worker();
            checksums.join()
        });
        turnstile.outcome()?;
        if let Some(checksum) = along {
            return Ok(vec![checksum.finish()?]);
        }
        inputs.unwrap_or_else(|_| Err(Error::new("checksum", "the inputs", "the thread that read them stopped")))
    }

    /// A capture as it is read and conditioned; every sample is looked at before anything else touches it.
    fn recorded(&self, threads: NonZeroUsize, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let opened = self.recording.open_with(threads, station, setup)?;
        let inspected: Box<dyn SampleStream + '_> = Box::new(Inspection::new(opened));
        self.conditioners.iter().try_fold(inspected, |stream, conditioner| conditioner.attach(stream))
    }

    /// Takes all of a station's captures, also behind one that failed.
    fn station(&self, key: &StationKey, captures: &mut dyn Captures<usize>) -> Result<Station> {
        let mut profiles = Ok(Vec::with_capacity(self.rig.setups.len()));
        for setup in 0..self.rig.setups.len() {
            let capture = captures.open();
            let projection = self.projections.get(setup).and_then(Option::as_ref);
            let wanted = Wanted { hold_out: self.hold_out, projection };
            profiles = profiles.and_then(|mut profiles: Vec<Profile>| {
                profiles.push(self.averager.average_wanting(capture?, wanted)?);
                Ok(profiles)
            });
        }
        Ok(Station { name: key.name.clone(), z_mm: key.z_mm, profiles: profiles? })
    }
}

/// Separates a station, and refuses what is not a number where the layout could tell one, and a form that no part of
/// `radius_mm` has.
pub fn separate(separator: &dyn StationSeparator, station: &Station, radius_mm: f64) -> Result<Separation> {
    let separation = separator.separate(station)?;
    let width = separation.unknowns.len().max(1);
    let told = separation.estimate.iter().zip(&separation.observable);
    let number = told.enumerate().find(|(_, (value, told))| **told && !value.is_finite());
    let problem = match number {
        Some((index, _)) => {
            let quantity = separation.unknowns[index % width].id();
            Some(format!("{quantity} of order {} comes out as no number", index / width))
        }
        None => separation.sections.iter().enumerate().find_map(|(section, at)| {
            let unknown = separation.position(Quantity::Form(section))?;
            let squares: f64 = separation.coefficients(unknown).skip(1).map(|value| value.norm_sqr()).sum();
            let rms_mm = 1e-3 * (0.5 * squares).sqrt();
            let problem =
                format!("the form of section {} comes out as {rms_mm:.3e} mm rms on {radius_mm} mm radius", at.id);
            (rms_mm > radius_mm).then_some(problem)
        }),
    };
    problem.map_or(Ok(separation), |problem| {
        Err(Error::new("separate", format!("station {}", station.name), problem)
            .help("look for absurd readings, and check the rig's radius and positions"))
    })
}
