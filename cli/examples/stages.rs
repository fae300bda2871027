//! Times runout's stages one by one, for `cargo xtask bench-stages`: each with one thread, from memory to memory or between
//! memory and a file in the page cache.
//!
//! Usage: `stages PIPELINE RECORD FOLDER`. PIPELINE is the benchmarked campaign's, RECORD its HDF5 file; FOLDER holds
//! `capture.csv`, and gets the files that are written. Prints a line of JSON a stage: its least seconds.

#![allow(clippy::print_stdout, reason = "a program that prints figures")]

use std::{
    error::Error,
    hint::black_box,
    path::{Path, PathBuf},
    time::Instant,
};

use runout_cli::builtin::registry;
use runout_core::{
    atomic_file::commit_all,
    measurement::{Block, MemoryStream, Recording, SampleStream},
    pipeline::{INCLUDE_KEY, Pipeline, Route, document::Sources, run::StationTables},
    profile::Profile,
    separation::Separation,
    stage::{AverageRequest, Averager, Conditioner, ResultInfo, Source, Station, StationSeparator},
    station::StationResult,
    summary::Summary,
};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

const ROUNDS: usize = 7;
/// Captures that are read at a time.
const CAPTURES: usize = 10;
/// Stations whose results are written.
const STATIONS: usize = 40;

fn main() -> Outcome {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let mut next = || arguments.next().ok_or("usage: stages PIPELINE RECORD FOLDER");
    let (pipeline, record, folder) = (next()?, next()?, next()?);
    let hdf5 = format!("load.path={}", record.display());
    let out = [folder.join("out"), folder.join("out/result.h5")];
    let out: Vec<String> =
        out.iter().enumerate().map(|(index, path)| format!("export.{index}.path={}", path.display())).collect();
    let campaign = built(&pipeline, &[hdf5.clone(), out[0].clone(), out[1].clone()])?;
    let three_point = ["separate.plugin=three-point", r#"separate.sensors=["S1","S2","S4"]"#].map(str::to_owned);
    let three_point = built(&pipeline, &[&[hdf5][..], &three_point, &out].concat())?;
    let recording = opened(&campaign)?;
    let stages = Stages::of(&campaign)?;
    let captures = [in_memory(&mut *recording.open(0, 0)?)?, in_memory(&mut *recording.open(0, 1)?)?];

    report("low-pass", || {
        let record = Box::new(captures[0].clone());
        clocked(|| drain(&mut *stages.conditioner.attach(record)?))
    })?;
    let projection =
        Stages::of(&three_point)?.separator.projection(0).ok_or("motion is not observable with three points")?;
    for (name, projection) in [("average", None), ("average-and-motion-of-every-turn", Some(&projection))] {
        let wanted = AverageRequest { projection, ..AverageRequest::default() };
        report(name, || {
            let record = Box::new(captures[0].clone());
            clocked(|| stages.averager.average_requested(record, wanted).map(black_box).map_err(Into::into))
        })?;
    }
    let read_all = || {
        (0..CAPTURES / 2)
            .try_for_each(|station| (0..2).try_for_each(|setup| drain(&mut *recording.open(station, setup)?)))
    };
    report("hdf5-read", || clocked(read_all))?;
    recording.checksum().ok_or("the record is not read straight from the file")?.begin();
    report("hdf5-read-and-checksum", || clocked(read_all))?;
    let csv = built(&pipeline, &csv_settings(&folder, &out))?;
    let read_csv = || -> Outcome { drain(&mut *opened(&csv)?.open(0, 0)?) };
    report("csv-read", || clocked(read_csv))?;
    let threads = std::thread::available_parallelism()?;
    report("csv-read-all-threads", || clocked(|| drain(&mut *opened(&csv)?.open_with(threads, 0, 0)?)))?;
    report("csv-read-two-files", || {
        clocked(|| {
            std::thread::scope(|scope| {
                // An error of the other thread is passed on as text.
                let beside = scope.spawn(|| read_csv().map_err(|error| error.to_string()));
                read_csv()?;
                beside.join().map_err(|_| "the thread that read a file stopped")?.map_err(Into::into)
            })
        })
    })?;

    let profiles: Vec<Profile> =
        captures.into_iter().map(|record| stages.averager.average(Box::new(record))).collect::<Result<_, _>>()?;
    let station = Station { name: "s000".into(), z_mm: 0.0, profiles };
    let separation = stages.separator.separate(&station)?;
    report("separate", || clocked(|| stages.separator.separate(&station).map(black_box).map_err(Into::into)))?;
    let results: Vec<StationResult> = (0..STATIONS).map(|index| result(index, separation.clone())).collect();
    for (index, name) in ["parquet-write", "hdf5-write"].into_iter().enumerate() {
        report(name, || clocked(|| write(&campaign, index, &results)))?;
    }
    Ok(())
}

/// What is timed of a pipeline.
struct Stages<'a> {
    conditioner: &'a dyn Conditioner,
    averager: &'a dyn Averager,
    separator: &'a dyn StationSeparator,
}

impl<'a> Stages<'a> {
    fn of(pipeline: &'a Pipeline) -> Outcome<Self> {
        match &pipeline.route {
            Route::Turns { conditioners, averager, separator, .. } => {
                let conditioner = &**conditioners.first().ok_or("the pipeline has no filter")?;
                Ok(Self { conditioner, averager: &**averager, separator: &**separator })
            }
            Route::Points { .. } => Err("the pipeline is not one of recorded turns".into()),
        }
    }
}

fn built(path: &Path, settings: &[String]) -> Outcome<Pipeline> {
    Ok(Pipeline::from_sources(&Sources::read(path, settings, INCLUDE_KEY)?, &registry())?)
}

fn csv_settings(folder: &Path, out: &[String]) -> Vec<String> {
    let pattern = folder.join("capture.csv");
    let load = format!(
        "load={{ plugin = \"csv\", pattern = \"{}\", stations = [{{ name = \"s000\" }}], sample_rate_hz = 25600 }}",
        pattern.display()
    );
    let one_setup = r#"rig.setups=[{ id = "initial" }]"#.to_owned();
    let separate = r#"separate={ plugin = "three-point", sensors = ["S1", "S2", "S4"] }"#.to_owned();
    [&[load, one_setup, separate][..], out].concat()
}

fn opened(pipeline: &Pipeline) -> Outcome<Box<dyn Recording>> {
    match pipeline.loader.open(&pipeline.request())? {
        Source::Turns(recording) => Ok(recording),
        Source::Points(_) => Err("the record holds points".into()),
    }
}

/// All samples of a capture, to be handed on in blocks.
fn in_memory(stream: &mut dyn SampleStream) -> Outcome<MemoryStream> {
    let (capture, mut samples, mut block) = (stream.capture().clone(), Vec::new(), Block::default());
    while stream.next_block(&mut block)? {
        samples.append(&mut block.samples);
    }
    Ok(MemoryStream { capture, samples, angle_rev: Vec::new(), block_samples: 8192, next: 0 })
}

fn drain(stream: &mut dyn SampleStream) -> Outcome {
    let mut block = Block::default();
    while stream.next_block(&mut block)? {
        black_box(&block.samples);
    }
    Ok(())
}

fn result(index: usize, separation: Separation) -> StationResult {
    StationResult {
        station: format!("s{index:03}"),
        z_mm: index as f64,
        angles: 2560,
        separation,
        profiles: Vec::new(),
        truth: None,
    }
}

/// Writes all results by one of the pipeline's exporters.
fn write(pipeline: &Pipeline, exporter: usize, results: &[StationResult]) -> Outcome {
    let mut tables = StationTables::new(pipeline.assessment.as_ref(), pipeline.rig.as_ref());
    // As for names of the rig and of stations, which are short here.
    let info = ResultInfo { longest_name: Some(4), ..tables.info(&pipeline.title) };
    let mut export = pipeline.exporters.get(exporter).ok_or("the pipeline has too few exporters")?.begin(&info)?;
    results.iter().try_for_each(|result| tables.write(result, &mut *export))?;
    commit_all(tables.finish(export, &Summary::default(), None)?)?;
    Ok(())
}

/// Seconds of the work itself.
fn clocked<T>(work: impl FnOnce() -> Outcome<T>) -> Outcome<f64> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_secs_f64())
}

fn report(stage: &str, mut round: impl FnMut() -> Outcome<f64>) -> Outcome {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        least = least.min(round()?);
    }
    println!("{{\"stage\": \"{stage}\", \"seconds\": {least:e}}}");
    Ok(())
}
