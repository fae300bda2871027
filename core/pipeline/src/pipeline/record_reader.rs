//! Recorded turns on their way to profiles, station by station, threads across stations.

use std::{
    num::NonZeroUsize,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use super::{
    hidden_readings,
    observer::Observer,
    ordered_collector::OrderedCollector,
    put_right,
    read_ahead::{Captures, read_ahead, read_along, work_behind},
};
use crate::stage::{AverageRequest, Averager, Conditioner, Station, StationSeparator};
use runout_closed_loop::Settings;
use runout_consistency::{Check, Test, turns::PhaseCourse};
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::{number::significant, threads};
use runout_turning::{
    calibrated::calibrated,
    counted_turns,
    input_file::InputFile,
    inspection::{HeldChannel, Inspection, Spike, UnusualReadings},
    measurement::{Capture, Recording, SampleStream, StationKey},
    profile::{Profile, RejectedTurn},
    provenance::Input,
    rig::Rig,
    separation::{Quantity, Separation},
    spread::Projection,
};

/// From recorded turns to the profiles of one station after the other.
#[non_exhaustive]
pub(crate) struct RecordReader<'a> {
    pub rig: &'a Rig,
    pub recording: &'a dyn Recording,
    pub conditioners: &'a [Box<dyn Conditioner>],
    pub averager: &'a dyn Averager,
    /// Share of the turns that are averaged by themselves besides.
    pub hold_out: Option<f64>,
    /// How motion follows from the readings of each setup, where the spread over the turns is wanted.
    pub projections: Vec<Option<Projection>>,
    /// What turns are counted anew for, where the recorded marks do not count them; nothing where they are taken as they are.
    pub puts_right: Option<&'a Settings>,
    /// Whether one thread does all: the others have recordings of their own.
    pub alone: bool,
}

impl RecordReader<'_> {
    /// Does `work` on every station (its index and its profiles), and the inputs' checksums meanwhile; `take` gets
    /// what comes of it, in the order of the stations.
    ///
    /// Each worker takes the next station, and waits only where it is too far ahead of the others: few results exist at a
    /// time. Where a processor is left, it averages the turns only, and a thread of its own does the rest.
    pub(crate) fn run<T: Send>(
        &self,
        threads: Option<NonZeroUsize>,
        observer: &dyn Observer,
        work: impl Fn(usize, Station) -> Result<T> + Sync,
        mut take: impl FnMut(T) -> Result<()> + Send,
    ) -> Result<Vec<Input>> {
        let stations = self.recording.stations();
        observer.begin(stations.len());
        let processors = if self.alone { 1 } else { std::thread::available_parallelism().map_or(1, NonZeroUsize::get) };
        let threads = threads.map_or(processors, NonZeroUsize::get);
        let workers = threads.clamp(1, stations.len().max(1));
        // Where there are fewer stations than threads, some can help to read.
        let readers = NonZeroUsize::new(threads / workers).unwrap_or(NonZeroUsize::MIN);
        let next = AtomicUsize::new(0);
        let failed = AtomicBool::new(false);
        let ordered_collector = OrderedCollector::new(|index: usize, result| {
            take(result)?;
            observer.station(&stations[index].name);
            Ok(())
        });
        let setups = self.rig.setups.len();
        // What is unusual in a capture, `[station][setup]`.
        let unusual: Vec<Mutex<UnusualReadings>> = (0..stations.len() * setups).map(|_| Mutex::default()).collect();
        let worker = || {
            let claimed = std::iter::from_fn(|| {
                let more = !failed.load(Ordering::Relaxed);
                more.then(|| next.fetch_add(1, Ordering::Relaxed)).filter(|index| *index < stations.len())
            });
            let captures =
                claimed.flat_map(|station| (0..setups).map(move |setup| (station, setup))).map(|(station, setup)| {
                    let unusual = &unusual[station * setups + setup];
                    (station, self.recorded(readers, station, setup, &[], unusual))
                });
            let average = |captures: &mut dyn Captures<usize>,
                           hand_on: &mut dyn FnMut((usize, Result<Station>)) -> bool| {
                while let Some(index) = captures.coming() {
                    let unusual = &unusual[index * setups..(index + 1) * setups];
                    if !hand_on((index, self.station((index, &stations[index]), captures, unusual))) {
                        break;
                    }
                }
            };
            let complete = |(index, station): (usize, Result<Station>)| {
                if !ordered_collector.pass(index, station.and_then(|station| work(index, station))) {
                    failed.store(true, Ordering::Relaxed);
                }
            };
            if workers < processors {
                read_ahead(captures, |captures| work_behind(complete, |hand_on| average(captures, hand_on)));
            } else {
                let mut complete = |station| {
                    complete(station);
                    true
                };
                read_along(captures, |captures| average(captures, &mut complete));
            }
        };
        let along = self.recording.checksum();
        if let Some(checksum) = along {
            checksum.begin();
        }
        let files = self.recording.opened()?;
        let checksums = || match along {
            Some(_) => Ok(Vec::new()),
            None => files.iter().map(InputFile::checksum).collect::<Result<Vec<_>>>(),
        };
        let (inputs, ()) = threads::both(checksums, || {
            std::thread::scope(|scope| {
                for _ in 1..workers {
                    scope.spawn(worker);
                }
                worker();
            });
        });
        ordered_collector.outcome()?;
        // The checksums may have been taken before the last sample was read.
        files.iter().try_for_each(InputFile::check)?;
        if let Some(checksum) = along {
            return Ok(vec![checksum.finish()?]);
        }
        inputs
    }

    /// A capture as it is read, its turns counted and conditioned; every sample is examined before any other use.
    fn recorded<'b>(
        &'b self,
        threads: NonZeroUsize,
        station: usize,
        setup: usize,
        counted_by: &[PhaseCourse],
        unusual: &'b Mutex<UnusualReadings>,
    ) -> Result<Box<dyn SampleStream + 'b>> {
        let opened = calibrated(self.recording.open_with(threads, station, setup)?, self.rig);
        let opened = counted_turns::declared(opened, self.rig.setups[setup].turns_per_mark);
        let opened = counted_by.iter().fold(opened, counted_turns::counted);
        let report = |found| *unusual.lock().unwrap_or_else(PoisonError::into_inner) = found;
        let inspected: Box<dyn SampleStream + '_> = Box::new(Inspection::reporting(opened, report));
        self.conditioners.iter().try_fold(inspected, |stream, conditioner| conditioner.attach(stream))
    }

    /// Takes all of a station's captures, also behind one that failed.
    fn station(
        &self,
        (index, key): (usize, &StationKey),
        captures: &mut dyn Captures<usize>,
        unusual: &[Mutex<UnusualReadings>],
    ) -> Result<Station> {
        let mut profiles = Ok(Vec::with_capacity(self.rig.setups.len()));
        for (setup, unusual) in unusual.iter().enumerate() {
            let capture = captures.open();
            let projection = self.projections.get(setup).and_then(Option::as_ref);
            let wanted = AverageRequest { hold_out: self.hold_out, projection };
            profiles = profiles.and_then(|mut profiles: Vec<Profile>| {
                let stream = capture?;
                let capture = stream.capture().clone();
                let mut profile = self.averager.average_requested(stream, wanted)?;
                let UnusualReadings { spikes, held } =
                    std::mem::take(&mut *unusual.lock().unwrap_or_else(PoisonError::into_inner));
                profile.warnings.extend(far_from_others(&spikes, &capture, &profile));
                profile.course.checks.extend(faster_than_sensors(&held, &capture));
                if let Some(settings) = self.puts_right {
                    let is_wanted = |phase: &PhaseCourse| put_right::marks::is_wanted(phase, settings);
                    profile = put_right::marks::recounted(profile, is_wanted, |by| {
                        let unusual = Mutex::default();
                        let stream = self.recorded(NonZeroUsize::MIN, index, setup, by, &unusual)?;
                        self.averager.average_requested(stream, wanted)
                    });
                }
                profiles.push(profile);
                Ok(profiles)
            });
        }
        let mut profiles = profiles?;
        // Where the averager has fewer angles than configured, captures of slightly different turns may differ in their number.
        let angles = profiles.iter().map(|profile| profile.samples_per_rev).max().unwrap_or(0);
        profiles.iter_mut().for_each(|profile| profile.samples_per_rev = angles);
        Ok(Station { name: key.name.clone(), z_mm: key.z_mm, profiles })
    }
}

/// That readings stand for several samples: between them, angles go on and readings do not.
fn faster_than_sensors(held: &[HeldChannel], capture: &Capture) -> Option<Check> {
    let samples = held.iter().map(|one| one.samples).max()?;
    let sensors: Vec<&str> =
        held.iter().filter_map(|one| capture.sensor_ids.get(one.channel).map(String::as_str)).collect();
    Some(Check::new(Test::Measured, sensors.join(", "), samples as f64, &[], 0.0).finding(|| {
        format!(
            "{}: each reading of {} stands for about {samples} samples: the recorder is faster than the sensor, and angles and readings do not \
             belong together; record at the sensor's rate, or keep one sample of {samples}",
            capture.object,
            sensors.join(", ")
        )
    }))
}

/// Says which readings, far from all others, are in an average.
fn far_from_others(spikes: &[Spike], capture: &Capture, profile: &Profile) -> Vec<String> {
    let turn_samples = capture.median_turn_samples().unwrap_or(0.0);
    let left_out = |spike: &Spike| {
        let (sample, within) = (spike.near_sample as f64, spike.within_samples as f64);
        let rejected = |turn: &RejectedTurn| {
            let start = turn.start_sample as f64 - within;
            (start..start + turn_samples + 2.0 * within).contains(&sample)
        };
        let marks = capture.marks.first().zip(capture.marks.last());
        profile.turns.rejected.iter().any(rejected)
            || marks.is_none_or(|(first, last)| !(*first..*last).contains(&sample))
    };
    let in_average = spikes.iter().filter(|spike| !left_out(spike));
    let messages = in_average.map(|spike| {
        let Spike { channel, near_sample, within_samples, reading_um, usual_um, stretches } = spike;
        let sensor = capture.sensor_ids.get(*channel).map_or("", String::as_str);
        let times = if *stretches > 1 { format!(" ({stretches} turns or so have such readings)") } else { String::new() };
        let usually = if reading_um > usual_um { "at most" } else { "at least" };
        let at = if *within_samples == 0 { "at" } else { "near" };
        format!(
            "{}: {sensor} reads {reading_um:.4} µm {at} sample {near_sample}{times}, in other turns {usually} {usual_um:.4} µm; if that is \
             a disturbance, `outlier_sigma` of the synchronous average leaves such turns out",
            capture.object
        )
    });
    messages.collect()
}

/// Separates a station, and refuses what is not a number where it is observable, and a form that no part of
/// the rig's radius has.
pub(crate) fn separate(separator: &dyn StationSeparator, station: &Station, rig: &Rig) -> Result<Separation> {
    let separation = hidden_readings::separate(separator, station, rig)?;
    let width = separation.unknowns.len().max(1);
    let estimates = separation.estimate.iter().zip(&separation.observable);
    let number = estimates.enumerate().find(|(_, (value, observable))| **observable && !value.is_finite());
    let problem = match number {
        Some((index, _)) => {
            let quantity = separation.unknowns[index % width].id();
            Some(format!("{quantity} of order {} comes out as no number", index / width))
        }
        None => separation.sections.iter().enumerate().find_map(|(section, at)| {
            let unknown = separation.position(Quantity::Form(section))?;
            let squares: f64 = separation.coefficients(unknown).skip(1).map(|value| value.norm_sqr()).sum();
            let (rms_mm, radius_mm) = (1e-3 * (0.5 * squares).sqrt(), rig.part_radius_mm);
            let problem = format!(
                "the form of section {} comes out as {} mm rms on {radius_mm} mm radius",
                at.id,
                significant(rms_mm, 3)
            );
            (rms_mm > radius_mm).then_some(problem)
        }),
    };
    problem.map_or(Ok(separation), |problem| {
        Err(Error::new("separate", format!("station {}", station.name), problem)
            .of(ErrorKind::Numerical)
            .help("look for absurd readings, and check the rig's radius and positions"))
    })
}
