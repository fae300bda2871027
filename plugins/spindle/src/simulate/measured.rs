//! A profile that someone measured, as harmonics.

use std::path::Path;

use runout_core::{Complex64, input_file::read_text, numerics::fourier::Fourier};

use super::config::FormHarmonic;

/// Equal angles on which a profile is taken, linearly between its points.
const ANGLES: usize = 4096;
/// Points further apart than this leave form unseen, in degrees.
const WIDEST_GAP_DEG: f64 = 10.0;

/// Orders 2 to `max_order` of the profile in a CSV file with columns `angle_deg` and `form_um`.
///
/// # Errors
/// What is wrong with the file, in words.
pub(super) fn harmonics(path: &Path, max_order: usize) -> Result<Vec<FormHarmonic>, String> {
    let shown = path.display();
    let text = read_text(path).map_err(|error| format!("cannot read {shown}: {error}"))?;
    let points = points(&text).map_err(|problem| format!("cannot read {shown}: {problem}"))?;
    if max_order > ANGLES / 8 {
        return Err(format!("orders up to {} can be taken from a measured profile", ANGLES / 8));
    }
    let mut fourier = Fourier::new(ANGLES);
    let mut found = vec![Complex64::ZERO; max_order + 1];
    fourier.analyse((0..ANGLES).map(|index| at(&points, 360.0 * index as f64 / ANGLES as f64)), &mut found);
    // Order 0 is the size and order 1 where the part lay.
    let from_two = found.into_iter().enumerate().skip(2);
    Ok(from_two
        .map(|(order, value)| FormHarmonic {
            order,
            amplitude_um: value.norm(),
            phase_deg: value.arg().to_degrees(),
            twist_deg_per_mm: 0.0,
        })
        .collect())
}

/// Angle from 0 to 360 and form, in the order of the angle.
fn points(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    let (header, _) = lines.next().ok_or("it is empty")?;
    let delimiter = [';', '\t', ','].into_iter().find(|mark| header.contains(*mark)).unwrap_or(',');
    let names: Vec<&str> = header.trim_start_matches('\u{feff}').split(delimiter).map(str::trim).collect();
    let column =
        |name: &str| names.iter().position(|known| *known == name).ok_or_else(|| format!("it has no column `{name}`"));
    let (angle, form) = (column("angle_deg")?, column("form_um")?);
    let mut points = Vec::new();
    for (line, number) in lines {
        let cells: Vec<&str> = line.split(delimiter).map(str::trim).collect();
        let value = |column: usize| {
            let cell = cells.get(column).and_then(|cell| cell.parse::<f64>().ok());
            cell.filter(|value| value.is_finite()).ok_or_else(|| format!("line {number}: `{line}` has no number there"))
        };
        points.push((value(angle)?.rem_euclid(360.0), value(form)?));
    }
    points.sort_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Err("it has no points".into()) };
    let gaps = points.windows(2).map(|pair| pair[1].0 - pair[0].0);
    let widest = gaps.fold(first.0 + 360.0 - last.0, f64::max);
    if widest > WIDEST_GAP_DEG {
        return Err(format!("its points leave a gap of {widest:.1}°: a profile goes round the part"));
    }
    Ok(points)
}

/// The profile at an angle, linearly between the points beside it.
fn at(points: &[(f64, f64)], angle: f64) -> f64 {
    let after = points.partition_point(|point| point.0 <= angle) % points.len();
    let before = (after + points.len() - 1) % points.len();
    let (a, b) = (points[before], points[after]);
    let [from_a, width] = [angle - a.0, b.0 - a.0].map(|turned| turned.rem_euclid(360.0));
    if width > 0.0 { a.1 + (b.1 - a.1) * from_a / width } else { a.1 }
}

#[cfg(test)]
mod tests {
    use std::{fmt::Write, fs};

    use super::*;

    /// Points at uneven angles, out of order, of 1 cos(3α − 40°) + 0.2 cos(10α) on a shifted circle.
    #[test]
    fn harmonics_of_points() {
        let mut text = String::from("form_um; angle_deg\n");
        for index in 0..2000 {
            let degrees = (f64::from(index) * 77.3).rem_euclid(360.0) - 180.0;
            let angle = degrees.to_radians();
            let form =
                5.0 + 30.0 * angle.cos() + (3.0 * angle - 40.0_f64.to_radians()).cos() + 0.2 * (10.0 * angle).cos();
            writeln!(text, "{form}; {degrees}").unwrap();
        }
        let folder = std::env::temp_dir().join(format!("runout-measured-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("circle.csv");
        fs::write(&path, text).unwrap();
        let found = harmonics(&path, 20).unwrap();
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(found.len(), 19);
        for harmonic in found {
            let (amplitude, phase) = match harmonic.order {
                3 => (1.0, -40.0),
                10 => (0.2, 0.0),
                _ => (0.0, harmonic.phase_deg),
            };
            // Linear between points that are 0.2 to 0.5° apart: ¼ (n·gap)²/2 of an order n, and of the shift of 30 µm.
            assert!((harmonic.amplitude_um - amplitude).abs() < 1e-3, "{harmonic:?}");
            assert!((harmonic.phase_deg - phase).abs() < 0.1, "{harmonic:?}");
        }
    }

    #[test]
    fn files_that_are_no_profile() {
        for (text, problem) in [
            ("", "empty"),
            ("angle_deg,deviation\n0,1", "`form_um`"),
            ("angle_deg,form_um\n0,x", "line 2"),
            ("angle_deg,form_um\n0,1\n120,1\n240,2", "gap of 120.0°"),
        ] {
            assert!(points(text).unwrap_err().contains(problem), "{text}");
        }
    }
}
