//! Public files as the columns that loaders read.

use std::{
    fmt::Write,
    io::{Cursor, Read},
};

use crate::process::Outcome;

/// A trace of a plot: its name, its kind, and points by angle in rad, height and deviation in mm.
struct Trace {
    name: String,
    kind: &'static str,
    points: Vec<[f64; 3]>,
}

/// A cylindricity plot (`.pltx`) as `trace`, `kind`, `z_mm`, `angle_deg`, `deviation_um`, each to 1e-6.
pub(crate) fn traces(pltx: &[u8]) -> Outcome<String> {
    let mut text = String::from("trace,kind,z_mm,angle_deg,deviation_um\n");
    for trace in read(pltx)? {
        for [angle, z_mm, deviation_mm] in trace.points {
            let (angle_deg, deviation_um) = (angle.to_degrees(), 1000.0 * deviation_mm);
            let _ = writeln!(text, "{},{},{z_mm:.6},{angle_deg:.6},{deviation_um:.6}", trace.name, trace.kind);
        }
    }
    Ok(text)
}

/// One circle of such a plot as `angle_deg`, `form_um`.
pub(crate) fn circle(pltx: &[u8], name: &str) -> Outcome<String> {
    let traces = read(pltx)?;
    let trace =
        traces.into_iter().find(|trace| trace.name == name).ok_or_else(|| format!("there is no circle {name}"))?;
    let mut text = String::from("angle_deg,form_um\n");
    for [angle, _, deviation_mm] in trace.points {
        let _ = writeln!(text, "{:.6},{:.6}", angle.to_degrees(), 1000.0 * deviation_mm);
    }
    Ok(text)
}

/// A `.pltx` file is a zip: `header.xml` names the segments and their points, `plotpoints.dat` holds three little-endian f64 a
/// point.
fn read(pltx: &[u8]) -> Outcome<Vec<Trace>> {
    let failure = |error: zip::result::ZipError| format!("no plot: {error}");
    let mut archive = zip::ZipArchive::new(Cursor::new(pltx)).map_err(failure)?;
    let mut entry = |name: &str| -> Outcome<Vec<u8>> {
        let mut bytes = Vec::new();
        archive.by_name(name).map_err(failure)?.read_to_end(&mut bytes).map_err(|error| format!("{name}: {error}"))?;
        Ok(bytes)
    };
    let header = String::from_utf8(entry("header.xml")?).map_err(|error| format!("header.xml: {error}"))?;
    let numbers: Vec<f64> =
        entry("plotpoints.dat")?.as_chunks::<8>().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect();
    let points = numbers.as_chunks::<3>().0;
    let mut traces = Vec::new();
    let (mut circles, mut lines) = (0, 0);
    for segment in header.split("<Segment ").skip(1) {
        let attribute = |name: &str| {
            let tag = segment.split('>').next()?;
            tag.split_once(&format!("{name}=\""))?.1.split('"').next()
        };
        let (kind, letter, count) = match attribute("Type") {
            Some("Circle") => ("circle", 'C', &mut circles),
            Some("Line") => ("generatrix", 'G', &mut lines),
            other => return Err(format!("a segment is neither a circle nor a line but {other:?}")),
        };
        *count += 1;
        let range = attribute("Points").and_then(|range| range.split_once('-'));
        let range = range.and_then(|(first, last)| Some((first.parse::<usize>().ok()?, last.parse::<usize>().ok()?)));
        let own = range.and_then(|(first, last)| points.get(first..=last));
        let own = own.ok_or_else(|| format!("segment {letter}{count} has no points"))?;
        traces.push(Trace { name: format!("{letter}{count}"), kind, points: own.to_vec() });
    }
    Ok(traces)
}

/// Phase and radius as NmmQuad writes them, as `phase_deg`, `radius_counts`, `deviation_counts`: the digits stay as they are.
pub(crate) fn quadrature(table: &[u8]) -> Outcome<String> {
    let table = std::str::from_utf8(table).map_err(|error| error.to_string())?;
    let mut lines = table.lines();
    match lines.next() {
        Some("Phase (deg), Radius, Roundness deviation") => {}
        other => return Err(format!("the columns are {other:?}")),
    }
    let mut text = String::from("phase_deg,radius_counts,deviation_counts\n");
    for line in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::{ZipWriter, write::SimpleFileOptions};

    use super::*;

    fn plot(header: &str, points: &[[f64; 3]]) -> Vec<u8> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        archive.start_file("header.xml", SimpleFileOptions::default()).unwrap();
        archive.write_all(header.as_bytes()).unwrap();
        archive.start_file("plotpoints.dat", SimpleFileOptions::default()).unwrap();
        let bytes: Vec<u8> = points.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        archive.write_all(&bytes).unwrap();
        archive.finish().unwrap().into_inner()
    }

    const HEADER: &str = "<Formplot><Points><Segments><Segment Points=\"0-1\" Type=\"Circle\">a</Segment>\
                          <Segment Points=\"2-2\" Type=\"Line\">b</Segment></Segments></Points></Formplot>";
    const POINTS: [[f64; 3]; 3] =
        [[0.0, 2.0, 1e-3], [std::f64::consts::FRAC_PI_2, 2.5, -2.5e-3], [std::f64::consts::PI, 3.0, 0.0]];

    #[test]
    fn a_plot_becomes_traces() {
        let text = traces(&plot(HEADER, &POINTS)).unwrap();
        assert_eq!(
            text,
            "trace,kind,z_mm,angle_deg,deviation_um\nC1,circle,2.000000,0.000000,1.000000\n\
             C1,circle,2.500000,90.000000,-2.500000\nG1,generatrix,3.000000,180.000000,0.000000\n"
        );
        let text = circle(&plot(HEADER, &POINTS), "C1").unwrap();
        assert_eq!(text, "angle_deg,form_um\n0.000000,1.000000\n90.000000,-2.500000\n");
    }

    #[test]
    fn what_is_no_such_plot_is_refused() {
        assert!(traces(b"no zip").unwrap_err().contains("no plot"));
        assert!(traces(&plot(HEADER, &POINTS[..1])).unwrap_err().contains("C1"));
        assert!(traces(&plot(&HEADER.replace("Line", "Plane"), &POINTS)).unwrap_err().contains("Plane"));
        assert!(circle(&plot(HEADER, &POINTS), "C2").is_err());
        assert!(quadrature(b"a,b\n1,2\n").is_err());
    }

    #[test]
    fn samples_keep_their_digits() {
        let text = quadrature(b"Phase (deg), Radius, Roundness deviation\n   0.114, 501.001, -1.662\n").unwrap();
        assert_eq!(text, "phase_deg,radius_counts,deviation_counts\n0.114,501.001,-1.662\n");
    }
}
