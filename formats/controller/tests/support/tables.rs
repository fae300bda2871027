//! Controls of Heidenhain and FANUC: they read tables and add to commands. They share nothing with the exporter.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::controls::{Points, between};

/// Cells of a table by the names of its columns, which begin where their names do.
fn cells(text: &str, name: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines();
    assert_eq!(lines.next().unwrap(), format!("BEGIN {name} MM"));
    let header = lines.next().unwrap();
    let mut columns: Vec<(usize, String)> = Vec::new();
    for word in header.split_whitespace() {
        let from = columns.last().map_or(0, |(at, word): &(usize, String)| at + word.len());
        columns.push((from + header[from..].find(word).unwrap(), word.to_owned()));
    }
    assert_eq!(columns[0], (0, "NR".to_owned()));
    let rows: Vec<&str> = lines.collect();
    assert_eq!(*rows.last().unwrap(), "[END]");
    let row = |(number, row): (usize, &&str)| {
        let of = |(index, (at, name)): (usize, &(usize, String))| {
            let end = columns.get(index + 1).map_or(row.len(), |(next, _)| *next).min(row.len());
            (name.clone(), row.get(*at..end).unwrap_or_default().trim().to_owned())
        };
        let row: BTreeMap<String, String> = columns.iter().enumerate().map(of).collect();
        assert_eq!(row["NR"], number.to_string());
        row
    };
    rows[..rows.len() - 1].iter().enumerate().map(row).collect()
}

/// Tables `.COM`, assigned by a `.CMA`, of a control where a positive value moves the axis in the direction of `sign`.
pub(crate) struct Heidenhain {
    /// Axis whose position counts, axis that moves, points.
    pub dependencies: Vec<(String, String, Points)>,
    pub sign: f64,
}

impl Heidenhain {
    pub(crate) fn read(files: &BTreeMap<String, String>, assignment: &str, sign: f64) -> Self {
        let assigned = cells(&files[assignment], &assignment.to_uppercase());
        let active: Vec<_> = assigned.iter().filter(|row| row["ACTIVE"] == "*").collect();
        assert_eq!(active.len(), 1);
        let mut dependencies = Vec::new();
        for (axis, file) in active[0].iter().filter(|(name, _)| *name != "NR" && *name != "ACTIVE") {
            let table = cells(&files[&file.to_lowercase()], file);
            assert!(table.len() <= 256);
            for output in table[0].keys().filter(|name| *name != "NR" && *name != "AXISPOS") {
                let point = |row: &BTreeMap<String, String>| -> [f64; 2] {
                    [row["AXISPOS"].parse().unwrap(), row[output].parse().unwrap()]
                };
                dependencies.push((axis.clone(), output.clone(), table.iter().map(point).collect()));
            }
        }
        Self { dependencies, sign }
    }

    pub(crate) fn adds_um(&self, place: [f64; 3]) -> Vector3<f64> {
        let index = |name: &str| ["X", "Y", "Z"].iter().position(|letter| name.starts_with(letter)).unwrap();
        let mut adds = Vector3::zeros();
        for (input, output, points) in &self.dependencies {
            adds[index(output)] += 1e3 * self.sign * between(points, place[index(input)]);
        }
        adds
    }
}

/// An axis with stored pitch errors.
#[derive(Clone)]
pub(crate) struct Pitch {
    parameters: BTreeMap<u32, f64>,
    values: BTreeMap<usize, i64>,
    /// Machine coordinate of the reference position, in mm or °.
    reference: f64,
    /// Detection unit, with the direction of a positive value.
    unit: f64,
}

impl Pitch {
    /// The parameters are those that the file says have to be set by hand.
    pub(crate) fn read(text: &str, axis: &str, reference: f64, unit: f64) -> Self {
        let mut lines = text.lines();
        assert_eq!(lines.next().unwrap(), "%");
        let mut values = BTreeMap::new();
        for line in lines.by_ref().take_while(|line| *line != "%") {
            let (number, value) = line.strip_prefix('N').unwrap().split_once('P').unwrap();
            let number = number.parse::<usize>().unwrap().checked_sub(10_000).unwrap();
            assert!(number < 1024 && values.insert(number, value.parse().unwrap()).is_none());
        }
        let set = lines.find_map(|line| line.strip_prefix(&format!("({axis}: "))).unwrap();
        let parameter = |entry: &str| {
            let (number, value) = entry.split_once(" = ").unwrap();
            (number.parse().unwrap(), value.parse().unwrap())
        };
        let parameters = set.trim_end_matches(')').split(", ").map(parameter).collect();
        Self { parameters, values, reference, unit }
    }

    /// What the control has added after a move from the reference position, in mm or °: values in the order in which their sections are passed, their
    /// pulses evenly over the section.
    pub(crate) fn adds(&self, at: f64) -> f64 {
        let of = |number: u32| self.parameters[&number];
        let (origin, first, last) = (of(3620) as i64, of(3621) as i64, of(3622) as i64);
        let mut along = (at - self.reference) / of(3624);
        if let Some(turn) = self.parameters.get(&3625) {
            along = along.rem_euclid(turn / of(3624));
        }
        let mut pulses = 0.0;
        let mut section = 0_i64;
        while along.abs() > 1e-12 {
            let ahead = along > 0.0;
            let number = if ahead { origin + section + 1 } else { origin + section };
            let passed = along.abs().min(1.0);
            if (first..=last).contains(&number) {
                let value = self.values[&(number as usize)] as f64;
                assert!(value.abs() <= 127.0);
                pulses += passed * if ahead { value } else { -value };
            }
            section += if ahead { 1 } else { -1 };
            along -= passed.copysign(along);
        }
        self.unit * of(3623) * pulses
    }

    /// Sum of the values of a turn.
    pub(crate) fn turn(&self) -> i64 {
        let [first, last] = [3621, 3622].map(|number| self.parameters[&number] as usize);
        assert_eq!(first, self.parameters[&3620] as usize);
        assert_eq!(self.values[&first], self.values[&last]);
        (first + 1..=last).map(|number| self.values[&number]).sum()
    }
}

/// Values at vertices: what is between them is linear along each axis.
pub(crate) struct Boxes {
    nodes: [Vec<f64>; 3],
    values: BTreeMap<[usize; 3], Vector3<f64>>,
    unit_mm: f64,
}

impl Boxes {
    pub(crate) fn read(text: &str, unit_mm: f64) -> Self {
        let rows: Vec<Vec<f64>> = text
            .lines()
            .filter(|line| line.starts_with(|letter: char| letter.is_ascii_digit()))
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect();
        let nodes = [1, 2, 3].map(|column| {
            let mut all: Vec<f64> = rows.iter().map(|row| row[column]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        });
        let index = |axis: usize, at: f64| nodes[axis].iter().position(|node| (node - at).abs() < 1e-9).unwrap();
        let of =
            |row: &Vec<f64>| ([0, 1, 2].map(|axis| index(axis, row[axis + 1])), Vector3::new(row[4], row[5], row[6]));
        let values: BTreeMap<_, _> = rows.iter().map(of).collect();
        assert_eq!(values.len(), nodes.iter().map(Vec::len).product::<usize>());
        assert!(rows.iter().enumerate().all(|(row, cells)| (cells[0] - 1.0 - row as f64).abs() < 0.5));
        Self { nodes, values, unit_mm }
    }

    pub(crate) fn adds_um(&self, place: [f64; 3]) -> Vector3<f64> {
        // Along X, then along Y, then along Z.
        let of = |node: [usize; 3]| self.values[&node];
        let along = |axis: usize, value: &dyn Fn(usize) -> Vector3<f64>| {
            Vector3::from_fn(|row, _| {
                let points: Points =
                    self.nodes[axis].iter().enumerate().map(|(node, at)| [*at, value(node)[row]]).collect();
                between(&points, place[axis])
            })
        };
        1e3 * self.unit_mm * along(2, &|z| along(1, &|y| along(0, &|x| of([x, y, z]))))
    }
}
