//! Peak memory of a run does not grow with the number of stations; that of the closed loop grows as it says before it begins.
//!
//! One recording in a file, run from loading to exporting with 16 and with 48 stations. An allocator of this test's own
//! counts every byte that Rust code holds; what libhdf5 holds shows in the process's resident memory.
//!
//! Parquet tables are written in groups of 65 536 rows, which are held until they are full: with 4096 angles a turn every
//! table has filled one after 16 stations.

#![allow(unsafe_code, reason = "an allocator that counts is one by nature")]
#![allow(clippy::unwrap_used, reason = "tests")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    fs,
    num::NonZeroUsize,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
};

use runout_core::pipeline::{
    INCLUDE_KEY, Pipeline, Registry,
    diagnose::diagnose,
    document::Sources,
    run::{Silent, run},
};
use runout_hdf5::{WriteOptions, write_measurement};
use runout_spindle::simulate::{SpindleConfig, simulator};

/// The system's allocator, with the bytes that are held and the most that were since the count was last set back.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn taken(bytes: usize) {
    let held = HELD.fetch_add(bytes, Ordering::Relaxed) + bytes;
    PEAK.fetch_max(held, Ordering::Relaxed);
}

// SAFETY: every call goes on to the system's allocator as it came; `realloc` is the trait's own, made of these.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's.
        let place = unsafe { System.alloc(layout) };
        if !place.is_null() {
            taken(layout.size());
        }
        place
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the caller's.
        unsafe { System.dealloc(place, layout) };
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SCENARIO: &str = r#"
    seed = 7
    geometry = "linear"
    [rig]
    part_radius_mm = 30
    sensors = [
      { id = "S1", angle_deg = 0,  z_mm = 200, section = "a" },
      { id = "S2", angle_deg = 90, z_mm = 200, section = "a" },
      { id = "S3", angle_deg = 0,  z_mm = 230, section = "b" },
      { id = "S4", angle_deg = 90, z_mm = 230, section = "b" },
    ]
    setups = [
      { id = "initial" },
      { id = "reversed", part_deg = 180, sensors_deg = 180 },
    ]
    [recording]
    revolutions = 6
    samples_per_rev = 4096
    [form]
    rms_um = 4
    max_order = 30
    [motion]
    x_rms_um = 1
    y_rms_um = 1
    [noise]
    rms_um = 0.05
"#;

const STAGES: &str = r#"
    [[preprocess]]
    plugin = "low-pass"
    cutoff_hz = 8000
    [[preprocess]]
    plugin = "synchronous-average"
    samples_per_rev = 4096
    [separate]
    plugin = "harmonic-least-squares"
    # Cylindricity needs all sections at a time.
    [evaluate]
    values = ["roundness", "texture"]
"#;

/// Samples of one station: 2 setups, 4 sensors, 6 turns of 4096, in f64.
const STATION_BYTES: usize = 2 * 4 * 6 * 4096 * 8;
const FEW: usize = 16;
const MANY: usize = 48;
/// Any campaign fits into this much of resident memory.
const RESIDENT_BYTES: usize = 150_000_000;
/// What a station may leave behind: its lines in the summary and in the tables' indices, as values, then as text.
const LEFT_BYTES: usize = 8 * 1024;
/// Threads that read ahead and write behind meet as chance has it: of more stations, more meet at their worst. The peaks of one number of
/// stations differ by up to 4 MB.
const CHANCE_BYTES: usize = 3 * STATION_BYTES;
/// Runs: the largest peak of few stations is compared with the least of many.
const RUNS: usize = 2;

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_hdf5::register(&mut registry);
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    runout_parquet::register(&mut registry);
    registry
}

/// Writes a recording of so many stations.
fn record(stations: usize, path: &Path) {
    let scenario = format!("{SCENARIO}\n[recording.stations]\ncount = {stations}\n");
    record_scenario(&scenario, path);
}

fn record_scenario(scenario: &str, path: &Path) {
    let config: SpindleConfig = toml::from_str(scenario).unwrap();
    let simulator = simulator(&config).unwrap();
    let options = WriteOptions { deflate: None, ..WriteOptions::default() };
    write_measurement(&simulator.spindle_recording(), simulator.rig(), path, &options, &mut |_| {}).unwrap();
}

/// What a run over so many stations needs.
struct Peaks {
    /// Most bytes of Rust code's at a time, above those held before: the least and the largest of the runs.
    counted: [usize; 2],
    /// Most resident memory of the whole process, where the system reports it.
    resident: Option<usize>,
}

fn measure(stations: usize, folder: &Path) -> Peaks {
    let name = format!("of-{stations}");
    record(stations, &folder.join(format!("{name}.h5")));
    let rig =
        SCENARIO.split("[recording]").next().unwrap().replace("seed = 7", "").replace("geometry = \"linear\"", "");
    let text = format!(
        "{rig}\n[load]\nplugin = \"hdf5\"\npath = \"{name}.h5\"\n{STAGES}\n\
         [[export]]\nplugin = \"parquet\"\npath = \"{name}\"\n\
         [[export]]\nplugin = \"hdf5\"\npath = \"{name}/result.h5\"\n"
    );
    let sources = Sources::from_text("pipeline.toml", &text, folder.to_owned(), &[], INCLUDE_KEY).unwrap();
    let pipeline = Pipeline::from_sources(&sources, &registry()).unwrap();

    let mut peaks = Peaks { counted: [usize::MAX, 0], resident: None };
    for _ in 0..RUNS {
        // Writing 5 there sets the process's peak back to what it holds now (proc(5)).
        let reset = fs::write("/proc/self/clear_refs", "5").is_ok();
        let before = HELD.load(Ordering::Relaxed);
        PEAK.store(before, Ordering::Relaxed);
        let summary = run(&pipeline, NonZeroUsize::new(1), &Silent).unwrap();
        let counted = PEAK.load(Ordering::Relaxed) - before;
        assert_eq!(summary.stations.len(), stations);
        peaks.counted = [peaks.counted[0].min(counted), peaks.counted[1].max(counted)];
        peaks.resident = [peaks.resident, reset.then(resident_peak).flatten()].into_iter().flatten().min();
    }
    peaks
}

/// The closed loop on so many stations of 128 samples a turn: most bytes of Rust code's at a time, or what it says against it.
fn diagnosed(stations: usize, memory_gb: f64, folder: &Path) -> Result<usize, String> {
    let small = SCENARIO
        .replace("samples_per_rev = 4096", "samples_per_rev = 128")
        .replace("revolutions = 6", "revolutions = 20");
    let name = format!("small-{stations}");
    let path = folder.join(format!("{name}.h5"));
    if !path.exists() {
        record_scenario(&format!("{small}\n[recording.stations]\ncount = {stations}\n"), &path);
    }
    let rig = small.split("[recording]").next().unwrap().replace("seed = 7", "").replace("geometry = \"linear\"", "");
    let text = format!(
        "{rig}\n[load]\nplugin = \"hdf5\"\npath = \"{name}.h5\"\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n\
         [separate]\nplugin = \"harmonic-least-squares\"\n[evaluate]\nvalues = []\n\
         [diagnose]\nmemory_gb = {memory_gb}\n[[export]]\nplugin = \"parquet\"\npath = \"{name}\"\n"
    );
    let sources = Sources::from_text("pipeline.toml", &text, folder.to_owned(), &[], INCLUDE_KEY).unwrap();
    let pipeline = Pipeline::from_sources(&sources, &registry()).unwrap();
    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    match diagnose(&pipeline, NonZeroUsize::new(1), &Silent) {
        Ok(_) => Ok(PEAK.load(Ordering::Relaxed) - before),
        Err(error) => Err(error.to_string()),
    }
}

/// The loop holds all stations. What it asks for is enough, and at most three times what it takes.
fn diagnose_takes_what_it_asks_for(folder: &Path) {
    let refused = diagnosed(6, 1e-6, folder).unwrap_err();
    let each_mb = refused.split(" some ").nth(1).and_then(|rest| rest.split(" MB each").next()).unwrap();
    let asked = each_mb.parse::<f64>().unwrap() * 1e6;
    let [few, many] = [6, 30].map(|stations| diagnosed(stations, 4.0, folder).unwrap());
    let taken = many.saturating_sub(few) as f64 / 24.0;
    assert!(taken <= asked && asked < 3.0 * taken, "{taken} bytes a station, {asked} asked for");
}

fn resident_peak() -> Option<usize> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<usize>().ok()? * 1024)
}

#[test]
fn peak_memory_does_not_grow_with_stations() {
    // The C library gives each thread memory of its own, and how much of what they give back stays with the process is chance: resident memory grew by
    // 10 to 42 MB. With one arena for all of them it grows by 8 to 10. Such a setting is read when a process starts.
    const ARENAS: &str = "MALLOC_ARENA_MAX";
    if std::env::var_os(ARENAS).is_none() {
        let mut again = std::process::Command::new(std::env::current_exe().unwrap());
        let again = again.args(["--exact", "peak_memory_does_not_grow_with_stations", "--nocapture"]).env(ARENAS, "1");
        assert!(again.status().unwrap().success(), "with one arena");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // What is made once in a process shall not count for the first of the runs.
    measure(2, folder.path());
    let [few, many] = [FEW, MANY].map(|stations| measure(stations, folder.path()));
    let more = MANY - FEW;
    println!("counted: {:?} bytes with {FEW} stations, {:?} with {MANY}", few.counted, many.counted);
    let grown = many.counted[0].saturating_sub(few.counted[1]);
    assert!(grown < CHANCE_BYTES + more * LEFT_BYTES, "{grown} bytes more with {more} stations more");
    // Samples that were kept would be far more than what is allowed; else this would show nothing.
    const { assert!((MANY - FEW) * STATION_BYTES > 10 * (CHANCE_BYTES + (MANY - FEW) * LEFT_BYTES)) };

    if let (Some(few), Some(many)) = (few.resident, many.resident) {
        println!("resident: {few} bytes with {FEW} stations, {many} with {MANY}");
        let grown = many.saturating_sub(few);
        // libhdf5's caches and free lists fill up meanwhile: 8 to 10 MB were seen. All samples would be 50 MB.
        assert!(grown < more * STATION_BYTES * 2 / 3, "{grown} bytes more resident with {more} stations more");
        assert!(many < RESIDENT_BYTES, "{many} bytes resident");
    }
    // In the same test: what others hold at the same time would count.
    diagnose_takes_what_it_asks_for(folder.path());
}
