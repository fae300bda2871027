//! Every exporter with every domain: it writes its files, or `check` refuses it in words.

use std::{fmt::Write, fs, path::Path};

use runout_cli::{builtin, documents};
use runout_core::pipeline::{
    Pipeline, Registry,
    document::{ConfigError, Sources},
};

use crate::folder::Folder;

const ROTARY: &str = include_str!("../../../examples/14-rotary-axis/pipeline.toml");
const R_TEST: &str = include_str!("../../../examples/14-rotary-axis/scenario.toml");
const ROTOR: &str = "materials = [{ id = 'steel', youngs_gpa = 210.0, poisson = 0.3, density_kg_per_m3 = 7850.0 }]\n\
    segments = [{ length_mm = 350.0, outer_mm = 60.0, inner_mm = 20.0, material = 'steel', elements = 4 }]\n\
    bearings = [\n{ z_mm = 87.5, kxx_n_per_m = 1.1e8, kyy_n_per_m = 0.9e8 },\n{ z_mm = 350.0, kxx_n_per_m = 1.8e8, kyy_n_per_m = 1.5e8 },\n]\n";

/// A domain: tables of its pipeline but for exporters, its other files, and whether it has form along an axis or heights on a plane.
struct Domain {
    name: &'static str,
    pipeline: String,
    files: Vec<(&'static str, String)>,
    has_surface: bool,
}

fn spindle() -> Domain {
    let rig = "[rig]\npart_radius_mm = 30\nsensors = [\n{ id = 'S1', angle_deg = 0, z_mm = 200, section = 'a' },\n\
        { id = 'S2', angle_deg = 99.844, z_mm = 200, section = 'a' },\n{ id = 'S3', angle_deg = 202.5, z_mm = 200, section = 'a' },\n]\n\
        setups = [{ id = 'only' }]\n";
    let pipeline = format!(
        "{rig}[load]\nplugin = 'hdf5'\npath = 'shaft.h5'\n[[preprocess]]\nplugin = 'synchronous-average'\nsamples_per_rev = 64\n\
        [separate]\nplugin = 'harmonic-least-squares'\n[surface]\nangles = 36\nstep_mm = 1\n"
    );
    let scenario = format!(
        "plugin = 'spindle'\noutput = 'shaft.h5'\nseed = 41\n{rig}[recording]\nrevolutions = 12\nsamples_per_rev = 64\nspeed_rpm = 480\n\
        stations = {{ first_z_mm = 0, step_mm = 3, count = 3 }}\n[form]\nrms_um = 2.0\nmax_order = 9\n[motion]\nx_rms_um = 0.4\n\
        y_rms_um = 0.7\n[noise]\nrms_um = 0.03\n"
    );
    Domain { name: "spindle", pipeline, files: vec![("scenario.toml", scenario)], has_surface: true }
}

fn cylinder() -> Domain {
    let mut points = String::from("trace,kind,z_mm,angle_deg,deviation_um\n");
    for circle in 0..3 {
        for step in 0..72 {
            let angle = f64::from(5 * step);
            let lobes = 1.3 * (3.0 * angle.to_radians()).cos() + 0.01 * f64::from((step * 7 + circle) % 11);
            writeln!(points, "c{circle},circle,{},{angle},{lobes}", 8 * circle).unwrap();
        }
    }
    let pipeline = "[load]\nplugin = 'points'\npath = 'circles.csv'\n[separate]\nplugin = 'least-squares-cylinder'\nradius_mm = 12.0\n\
        max_order = 8\noutlier_order = 8\n[surface]\nangles = 36\nstep_mm = 2\n";
    Domain { name: "cylinder", pipeline: pipeline.into(), files: vec![("circles.csv", points)], has_surface: true }
}

fn straightness() -> Domain {
    let mut traces = String::from("trace;setup;z_mm;reading_um\n");
    for (trace, setup, sign) in [(1, "initial", 1.0), (2, "initial", 1.0), (3, "reversed", -1.0), (4, "reversed", -1.0)]
    {
        for index in 0..30 {
            let z = 4.0 * f64::from(index);
            let noise = 0.02 * f64::from((index * 13 + 5 * trace) % 17);
            let reading = 1.7 * (z / 40.0).sin() - sign * 0.6 * (z / 23.0).cos() + noise;
            writeln!(traces, "{trace};{setup};{z};{reading}").unwrap();
        }
    }
    let pipeline = "[load]\nplugin = 'points'\npath = 'traces.csv'\n[separate]\nplugin = 'axial-reversal'\n";
    Domain { name: "straightness", pipeline: pipeline.into(), files: vec![("traces.csv", traces)], has_surface: false }
}

fn quadrature() -> Domain {
    let mut pairs = String::from("phase_deg,radius_counts,time_s\n");
    for index in 0..400 {
        let phase = (f64::from(index) * 0.37).to_radians() * 20.0;
        let (cosine, sine) = (1000.0 * phase.cos() + 12.0, 970.0 * phase.sin() - 7.0);
        let noise = 0.2 * f64::from((index * 31) % 19);
        let time = 0.001 * f64::from(index);
        writeln!(pairs, "{},{},{time}", sine.atan2(cosine).to_degrees(), cosine.hypot(sine) + noise).unwrap();
    }
    let pipeline = "[load]\nplugin = 'points'\npath = 'pairs.csv'\n[separate]\nplugin = 'quadrature'\n";
    Domain { name: "quadrature", pipeline: pipeline.into(), files: vec![("pairs.csv", pairs)], has_surface: false }
}

fn positioning() -> Domain {
    let mut approaches = String::from("target_mm,deviation_um,direction\n");
    for index in 0..60 {
        let (target, direction) = (index % 6, if index / 6 % 2 == 0 { 1 } else { -1 });
        let noise = 0.01 * f64::from((index * 29) % 23);
        let deviation = 0.3 * f64::from(target) + 0.2 * f64::from(direction) + noise;
        writeln!(approaches, "{},{deviation},{direction}", 50 * target).unwrap();
    }
    let pipeline =
        "[load]\nplugin = 'points'\npath = 'approaches.csv'\n[separate]\nplugin = 'positioning'\naxis = 'X'\n";
    Domain {
        name: "positioning",
        pipeline: pipeline.into(),
        files: vec![("approaches.csv", approaches)],
        has_surface: false,
    }
}

fn rotary_axis() -> Domain {
    let scenario = R_TEST.replace("step_deg = 10, count = 36", "step_deg = 30, count = 12");
    Domain {
        name: "rotary-axis",
        pipeline: without_exports(ROTARY),
        files: vec![("scenario.toml", scenario)],
        has_surface: false,
    }
}

fn touch_probe() -> Domain {
    let setups = "[{ id = 'r0' }, { id = 'r100', ring_deg = 100.0 }]";
    let pipeline = format!(
        "[load]\nplugin = 'points'\npath = 'touches.csv'\n[separate]\nplugin = 'touch-probe'\nring_radius_mm = 20.0\nmax_order = 4\n\
        setups = {setups}\n"
    );
    let scenario = format!(
        "plugin = 'touch-probe'\noutput = 'touches.csv'\nseed = 42\nring_radius_mm = 20.0\ndirections = 24\nrepeats = 2\nstd_um = 0.7\n\
        ring = {{ random_rms_um = 0.5 }}\nsetups = {setups}\n"
    );
    Domain { name: "touch-probe", pipeline, files: vec![("scenario.toml", scenario)], has_surface: false }
}

fn spatial_error() -> Domain {
    let pipeline = "[load]\nplugin = 'points'\npath = 'readings.csv'\n[separate]\nplugin = 'spatial-error'\ndeclared = ['rigid']\n\
        query = { grid_mm = [150.0, 150.0, 150.0] }\ncurves = { pitch_mm = [100.0, 150.0, 100.0] }\n";
    let scenario = "plugin = 'spatial-error'\noutput = 'readings.csv'\nseed = 43\npasses = 2\n\
        layout = { kind = 'grid', from_mm = [0.0, 0.0, 0.0], to_mm = [300.0, 300.0, 200.0], counts = [4, 3, 3] }\n\
        tracker = { at_mm = [-900.0, 100.0, 100.0], noise_um = 0.8, angle_urad = 0.2 }\n\
        field = { std_um = [4.0, 3.0, 5.0], range_mm = [260.0, 220.0, 200.0], smoothness = 2.5 }\n";
    Domain {
        name: "spatial-error",
        pipeline: pipeline.into(),
        files: vec![("scenario.toml", scenario.into())],
        has_surface: false,
    }
}

fn fly_cutting() -> Domain {
    let cut = "nose_radius_mm = 6.0\nfeed_um_per_rev = 8.3\ncutter_radius_mm = 250.0\nspeed_rpm = 390.0\n";
    let pipeline = format!("[load]\nplugin = 'height-map'\npath = 'map.h5'\n[separate]\nplugin = 'fly-cutting'\n{cut}");
    let scenario = format!(
        "plugin = 'fly-cutting'\noutput = 'map.h5'\nseed = 44\nnoise_nm = 0.2\n[cut]\n{cut}[grid]\nrows = 60\ncolumns = 50\n\
        step_x_mm = 0.004\nstep_y_mm = 0.01\n"
    );
    Domain { name: "fly-cutting", pipeline, files: vec![("scenario.toml", scenario)], has_surface: true }
}

fn rotor() -> Domain {
    let pipeline = "[load]\nplugin = 'rotor-model'\npath = 'spindle.toml'\n[separate]\nplugin = 'rotor-modes'\nmodes = 3\n\
        campbell_rpm = [0, 6000]\n";
    Domain { name: "rotor", pipeline: pipeline.into(), files: vec![("spindle.toml", ROTOR.into())], has_surface: false }
}

fn as_measured() -> Domain {
    let mut points = String::from("x_mm,y_mm,height_um\n");
    for (row, column) in (0..40).flat_map(|row| (0..50).map(move |column| (row, column))) {
        let height = f64::from((row * 31 + column * 17) % 23) * 0.02;
        writeln!(points, "{},{},{height}", 0.01 * f64::from(column), 0.02 * f64::from(row)).unwrap();
    }
    let pipeline = "[load]\nplugin = 'points'\npath = 'map.csv'\n[separate]\nplugin = 'as-measured'\n";
    Domain { name: "as-measured", pipeline: pipeline.into(), files: vec![("map.csv", points)], has_surface: true }
}

fn without_exports(pipeline: &str) -> String {
    pipeline.split("[[export]]").next().unwrap_or_default().to_owned()
}

/// The table of an exporter, which writes below a folder of its own name.
fn table(exporter: &str, folder: &str) -> String {
    let file = match exporter {
        "hdf5" => "/result.h5",
        "report" => "/report.html",
        "gltf" => "/part.glb",
        "obj" => "/part.obj",
        "ply" => "/part.ply",
        "stl" => "/part.stl",
        "3mf" => "/part.3mf",
        "x3p" => "/part.x3p",
        "sdf" => "/part.sdf",
        "csv" => "/values.csv",
        "xlsx" => "/values.xlsx",
        "q-das" => "/values.dfq",
        "controller" => "/volumetric.csv",
        _ => "",
    };
    let dialect = if exporter == "controller" { "dialect = 'isg-csv'\n" } else { "" };
    format!("[[export]]\nplugin = '{exporter}'\npath = '{folder}{file}'\n{dialect}")
}

fn pipeline(folder: &Path, text: &str, registry: &Registry) -> Result<Pipeline, ConfigError> {
    let sources = Sources::from_text("pipeline.toml", text, folder.to_owned(), &[], "rig")?;
    Pipeline::from_sources(&sources, registry)
}

#[test]
fn every_exporter_writes_every_domain_or_is_refused_in_words() {
    let registry = builtin::registry();
    // A program of the user is tested with one (`plugins/external`).
    let names = registry.exporters.iter().map(|exporter| exporter.name);
    let exporters: Vec<&str> = names.filter(|name| *name != "external").collect();
    assert!(exporters.len() >= 6, "{exporters:?}");
    let domains = [
        spindle(),
        cylinder(),
        straightness(),
        quadrature(),
        positioning(),
        rotary_axis(),
        touch_probe(),
        spatial_error(),
        fly_cutting(),
        as_measured(),
        rotor(),
    ];
    for Domain { name, pipeline: text, files, has_surface } in domains {
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let folder = Folder::with(&files);
        let path = folder.path();
        if path.join("scenario.toml").is_file() {
            let words = ["simulate".into(), path.join("scenario.toml").into_os_string()];
            documents::of_command(words.into(), &registry).unwrap_or_else(|failure| panic!("{name}: {failure:?}"));
        }
        let mut tables = String::new();
        for exporter in &exporters {
            match pipeline(path, &format!("{text}{}", table(exporter, exporter)), &registry) {
                Ok(_) => tables.push_str(&table(exporter, "out")),
                Err(error) => {
                    let ConfigError::Text(diagnostic) = error else { panic!("{name}, {exporter}: {error}") };
                    if *exporter == "controller" {
                        assert!(
                            diagnostic.message.contains("takes the table `component_curves`"),
                            "{name}: {diagnostic}"
                        );
                        assert!(diagnostic.help.is_some() && !text.contains("curves ="), "{name}");
                        continue;
                    }
                    let is_surface = ["gltf", "obj", "ply", "stl", "3mf", "x3p", "sdf"].contains(exporter);
                    assert!(is_surface && !has_surface, "{name}, {exporter}: {diagnostic}");
                    assert!(diagnostic.message.contains("form along an axis or a height map"), "{name}: {diagnostic}");
                    assert!(diagnostic.help.is_some(), "{name}, {exporter}");
                }
            }
        }
        // All that apply, into one folder.
        let all =
            pipeline(path, &format!("{text}{tables}"), &registry).unwrap_or_else(|error| panic!("{name}: {error}"));
        let summary = all.run().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(tables.contains("gltf"), has_surface, "{name}");
        assert_eq!(tables.contains("controller"), text.contains("curves ="), "{name}");
        for ending in ["parquet", "h5", "html", "svg", "png", "json", "csv", "xlsx"]
            .into_iter()
            .chain(has_surface.then_some("glb"))
        {
            let file = summary.outputs.iter().find(|path| path.extension().is_some_and(|found| found == ending));
            let file = file.unwrap_or_else(|| panic!("{name}: no {ending} in {:?}", summary.outputs));
            assert!(fs::metadata(file).unwrap().len() > 100, "{name}: {}", file.display());
        }
    }
}
