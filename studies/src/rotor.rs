//! Natural frequencies and critical speeds of rotors, beside closed forms and beside a peer's numbers.

use std::{f64::consts::PI, fmt::Write as _, path::Path};

use runout_core::{Error, Result};
use runout_rotor::{Equations, Modal, Mode, RotorModel, Search, assemble, hertz, rpm};
use serde_json::Value;

use crate::plot::{self, Axes, Curve};

/// A number beside its reference.
#[derive(Debug, Clone)]
pub struct Row {
    /// What it is of.
    pub what: String,
    /// Unit of both.
    pub unit: &'static str,
    /// This program's.
    pub found: f64,
    /// The closed form's or the peer's.
    pub reference: f64,
}

impl Row {
    /// Relative difference, in percent.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * (self.found / self.reference - 1.0)
    }
}

/// A slender beam: a tube, in mm, of a material.
struct Beam {
    name: &'static str,
    length: f64,
    outer: f64,
    inner: f64,
    youngs_gpa: f64,
    density: f64,
}

/// Length over diameter 200, 250 and 300.
const BEAMS: [Beam; 3] = [
    Beam { name: "steel rod", length: 1000.0, outer: 5.0, inner: 0.0, youngs_gpa: 210.0, density: 7850.0 },
    Beam { name: "titanium tube", length: 2000.0, outer: 8.0, inner: 6.0, youngs_gpa: 114.0, density: 4430.0 },
    Beam { name: "aluminium rod", length: 3000.0, outer: 10.0, inner: 0.0, youngs_gpa: 70.0, density: 2700.0 },
];

/// Supports at the ends, and β·l of the first three modes: roots of sin = 0, cos·cosh = −1, cos·cosh = 1 (Blevins 1979, table 8-1).
const ENDS: [(&str, [&str; 2], [f64; 3]); 4] = [
    ("pinned-pinned", ["pinned", "pinned"], [PI, 2.0 * PI, 3.0 * PI]),
    ("clamped-free", ["clamped", ""], [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613]),
    ("clamped-clamped", ["clamped", "clamped"], [4.730_040_744_862_704, 7.853_204_624_095_838, 10.995_607_838_001_67]),
    ("free-free", ["", ""], [4.730_040_744_862_704, 7.853_204_624_095_838, 10.995_607_838_001_67]),
];

/// The first three frequencies of slender beams beside those of Euler and Bernoulli, in both planes.
///
/// # Errors
/// When a beam cannot be solved.
pub fn beams() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for beam in &BEAMS {
        let Beam { name, length, outer, inner, youngs_gpa, density } = beam;
        for (ends, kinds, roots) in ENDS {
            let supports = kinds.iter().zip([0.0, *length]).filter(|(kind, _)| !kind.is_empty());
            let supports: Vec<String> =
                supports.map(|(kind, z_mm)| format!("{{ z_mm = {z_mm}, kind = \"{kind}\" }}")).collect();
            let text = format!(
                "materials = [{{ id = \"m\", youngs_gpa = {youngs_gpa}, poisson = 0.3, density_kg_per_m3 = {density} }}]\n\
                 segments = [{{ length_mm = {length}, outer_mm = {outer}, inner_mm = {inner}, material = \"m\", elements = 24 }}]\n\
                 supports = [{}]",
                supports.join(", ")
            );
            let modes = Modal::new(&rotor(name, &text)?)?.at(0.0)?;
            // I/A of a tube, in m².
            let gyration = ((1e-3 * outer).powi(2) + (1e-3 * inner).powi(2)) / 16.0;
            for (index, root) in roots.iter().enumerate() {
                let reference =
                    (root / (1e-3 * length)).powi(2) * (1e9 * youngs_gpa * gyration / density).sqrt() / (2.0 * PI);
                for plane in 0..2 {
                    let found = modes.get(2 * index + plane).map_or(f64::NAN, |mode| hertz(mode.frequency()));
                    let what = format!("{name}, {ends}, mode {}", 2 * index + plane + 1);
                    rows.push(Row { what, unit: "Hz", found, reference });
                }
            }
        }
    }
    Ok(rows)
}

/// Rotors of ross-rotordynamics and its numbers of them.
const PEER: &str = include_str!("../../plugins/rotor/tests/assets/ross.json");
const PEER_ROTORS: [(&str, &str); 2] = [
    ("rotor_example", include_str!("../../plugins/rotor/tests/assets/rotor_example.toml")),
    ("rotor_example_with_damping", include_str!("../../plugins/rotor/tests/assets/rotor_example_with_damping.toml")),
];

/// Numbers of two rotors beside those of the Python package ross-rotordynamics.
#[derive(Debug, Clone, Default)]
pub struct Peer {
    /// Its version.
    pub version: String,
    /// Frequencies over the speed, and critical speeds.
    pub rows: Vec<Row>,
    /// Damping ratios of the same modes.
    pub damping: Vec<Row>,
}

/// The comparison with the peer, from its golden numbers.
///
/// # Errors
/// When a rotor cannot be solved or the golden numbers cannot be read.
pub fn peer() -> Result<Peer> {
    let golden: Value = serde_json::from_str(PEER).map_err(|error| Error::new("read", "ross.json", error))?;
    let mut peer =
        Peer { version: golden["version"]["ross"].as_str().unwrap_or_default().to_owned(), ..Peer::default() };
    for (name, text) in PEER_ROTORS {
        let modal = Modal::new(&rotor(name, text)?)?;
        let numbers = &golden["rotors"][name];
        for line in list(&numbers["campbell"]) {
            let speed_rpm = number(&line["speed_rpm"]);
            let modes = modal.at(speed_rpm * PI / 30.0)?;
            for (index, expected) in list(&line["modes"]).iter().enumerate() {
                let of = |pick: fn(&Mode) -> f64| modes.get(index).map_or(f64::NAN, pick);
                let what = format!("{name}, {speed_rpm:.0} rpm, mode {}", index + 1);
                let [found, ratio] = [of(|mode| hertz(mode.frequency())), of(Mode::damping_ratio)];
                let row =
                    |unit, found, key: &str| Row { what: what.clone(), unit, found, reference: number(&expected[key]) };
                peer.rows.push(row("Hz", found, "frequency_hz"));
                // An undamped rotor has damping ratios of rounding only.
                let damping = row("1", ratio, "damping_ratio");
                if damping.reference.abs() > 1e-9 || ratio.abs() > 1e-9 {
                    peer.damping.push(damping);
                }
            }
        }
        let expected = list(&numbers["critical_rpm"]);
        let found = Search::new(&modal).crossings(1.0, expected.len())?;
        for (index, reference) in expected.iter().enumerate() {
            peer.rows.push(Row {
                what: format!("{name}, critical speed {}", index + 1),
                unit: "rpm",
                found: found.get(index).map_or(f64::NAN, |crossing| rpm(crossing.speed)),
                reference: number(reference),
            });
        }
    }
    Ok(peer)
}

/// Rows as text, and the largest difference.
#[must_use]
pub fn table(rows: &[Row], reference: &str) -> String {
    let wide = rows.iter().map(|row| row.what.chars().count()).max().unwrap_or(0);
    let mut text = format!("{:wide$}  {:>12}  {reference:>12}  unit  difference\n", "", "runout");
    for row in rows {
        let Row { what, unit, found, reference } = row;
        let _ = writeln!(text, "{what:wide$}  {found:12.4}  {reference:12.4}  {unit:<4}  {:+9.4} %", row.percent());
    }
    let worst = rows.iter().map(|row| row.percent().abs()).fold(0.0, f64::max);
    let _ = writeln!(text, "largest difference {worst:.4} %");
    text
}

/// The Campbell diagram of a rotor's file as PNG: `count` frequencies up to `most_rpm`, and the lines of the orders.
///
/// # Errors
/// When the rotor cannot be read or solved, or the picture cannot be drawn.
pub fn campbell(path: &Path, most_rpm: f64, count: usize, orders: &[f64]) -> Result<Vec<u8>> {
    let modal = Modal::new(&runout_rotor::read(path)?.equations)?;
    let speeds: Vec<f64> = (0..=40).map(|step| most_rpm * f64::from(step) / 40.0).collect();
    let lines: Vec<Vec<Mode>> = speeds.iter().map(|speed| modal.at(speed * PI / 30.0)).collect::<Result<_>>()?;
    let mut curves = Vec::new();
    let mut highest: f64 = 0.0;
    for index in 0..count {
        let point = |(speed, modes): (&f64, &Vec<Mode>)| Some((*speed, hertz(modes.get(index)?.frequency())));
        let points: Vec<(f64, f64)> = speeds.iter().zip(&lines).filter_map(point).collect();
        highest = points.iter().fold(highest, |most, (_, frequency)| most.max(*frequency));
        curves.push(Curve {
            name: format!("mode {}", index + 1),
            points,
            colour: COLOURS[index % COLOURS.len()],
            dashed: false,
            dots: false,
        });
    }
    for order in orders {
        let end = most_rpm.min(60.0 * highest / order);
        let points = vec![(0.0, 0.0), (end, order * end / 60.0)];
        curves.push(Curve { name: format!("{order} × speed"), points, colour: "#888888", dashed: true, dots: false });
    }
    let axes = Axes { title: "Campbell diagram (computed)", x: "speed, rpm", y: "natural frequency, Hz" };
    plot::curves(&axes, &curves).map_err(|problem| Error::new("draw", path.display().to_string(), problem))
}

const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

fn rotor(name: &str, text: &str) -> Result<Equations> {
    let model: RotorModel = toml::from_str(text).map_err(|error| Error::new("read", name, error))?;
    model.check().map_err(|fault| Error::new("check", name, fault))?;
    assemble(name, &model)
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}
