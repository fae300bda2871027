//! Controls: they read a file and add to commands, each as its maker says. They share nothing with the exporter.

#![allow(clippy::unwrap_used, dead_code, reason = "tests")]

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// Points of a table, in the order of their positions.
pub(crate) type Points = Vec<[f64; 2]>;

/// Linear between points, constant beyond.
pub(crate) fn between(points: &[[f64; 2]], at: f64) -> f64 {
    if at <= points[0][0] {
        return points[0][1];
    }
    for pair in points.windows(2) {
        if at <= pair[1][0] {
            return pair[0][1] + (at - pair[0][0]) / (pair[1][0] - pair[0][0]) * (pair[1][1] - pair[0][1]);
        }
    }
    points[points.len() - 1][1]
}

fn axis_index(name: &str) -> usize {
    ["X", "Y", "Z"].iter().position(|letter| name.starts_with(letter)).unwrap()
}

/// Assignments of a SINUMERIK file: name and indices, value.
fn assignments(text: &str) -> Vec<(String, Vec<String>, String)> {
    let code = text.lines().map(|line| line.split(';').next().unwrap().trim()).filter(|line| line.starts_with('$'));
    code.map(|line| {
        let (left, right) = line.split_once('=').unwrap();
        let (name, indices) = left.trim_end_matches(']').split_once('[').unwrap();
        (name.to_owned(), indices.split(',').map(|index| index.trim().to_owned()).collect(), right.trim().to_owned())
    })
    .collect()
}

/// `$AA_ENC_COMP`: a positive value moves the axis in its negative direction.
pub(crate) struct EncComp(pub BTreeMap<String, (Points, bool)>);

impl EncComp {
    pub(crate) fn read(text: &str) -> Self {
        assert!(text.starts_with("%_N_AX_EEC_INI\n") && text.ends_with("M17\n") && text.contains("\nCHANDATA(1)\n"));
        let all = assignments(text);
        let single = |name: &str, axis: &str| -> f64 {
            all.iter().find(|(known, indices, _)| known == name && indices[1] == axis).unwrap().2.parse().unwrap()
        };
        let mut tables: BTreeMap<String, (Points, bool)> = BTreeMap::new();
        for (_, indices, value) in all.iter().filter(|(name, ..)| name == "$AA_ENC_COMP") {
            let axis = indices[2].clone();
            let point: f64 = indices[1].parse().unwrap();
            let at = single("$AA_ENC_COMP_MIN", &axis) + point * single("$AA_ENC_COMP_STEP", &axis);
            let turns = single("$AA_ENC_COMP_IS_MODULO", &axis) > 0.5;
            tables.entry(axis).or_insert((Vec::new(), turns)).0.push([at, value.parse().unwrap()]);
        }
        for (axis, (points, _)) in &tables {
            assert!((points[points.len() - 1][0] - single("$AA_ENC_COMP_MAX", axis)).abs() < 1e-4);
        }
        Self(tables)
    }

    pub(crate) fn adds_um(&self, place: [f64; 3]) -> Vector3<f64> {
        let mut adds = Vector3::zeros();
        for (axis, (points, _)) in &self.0 {
            let own = axis_index(axis);
            adds[own] -= 1e3 * between(points, place[own]);
        }
        adds
    }
}

/// `$AN_CEC` of a control where a positive value moves the output axis in the direction of `sign`.
pub(crate) struct Cec {
    pub tables: Vec<(String, String, Points, bool)>,
    pub sign: f64,
}

impl Cec {
    pub(crate) fn read(text: &str, sign: f64) -> Self {
        assert!(text.starts_with("%_N_NC_CEC_INI\n") && text.ends_with("M17\n"));
        let all = assignments(text);
        let of = |name: &str, table: &str| -> String {
            all.iter().find(|(known, indices, _)| known == name && indices[0] == table).unwrap().2.clone()
        };
        let mut numbers: Vec<String> = all.iter().map(|(_, indices, _)| indices[0].clone()).collect();
        numbers.dedup();
        numbers.sort();
        numbers.dedup();
        let table = |table: &String| {
            let number = |name: &str| of(name, table).parse::<f64>().unwrap();
            let (from, step) = (number("$AN_CEC_MIN"), number("$AN_CEC_STEP"));
            let values = all.iter().filter(|(name, indices, _)| name == "$AN_CEC" && &indices[0] == table);
            let point = |(_, indices, value): &(String, Vec<String>, String)| {
                [from + indices[1].parse::<f64>().unwrap() * step, value.parse().unwrap()]
            };
            let axis = |name: &str| of(name, table).trim_matches(['(', ')']).to_owned();
            assert_eq!((of("$AN_CEC_DIRECTION", table), of("$AN_CEC_MULT_BY_TABLE", table)), ("0".into(), "0".into()));
            let turns = number("$AN_CEC_IS_MODULO") > 0.5;
            (axis("$AN_CEC_INPUT_AXIS"), axis("$AN_CEC_OUTPUT_AXIS"), values.map(point).collect(), turns)
        };
        Self { tables: numbers.iter().map(table).collect(), sign }
    }

    pub(crate) fn adds_um(&self, place: [f64; 3]) -> Vector3<f64> {
        let mut adds = Vector3::zeros();
        for (input, output, points, _) in &self.tables {
            adds[axis_index(output)] += self.sign * 1e3 * between(points, place[axis_index(input)]);
        }
        adds
    }
}

/// Volumetric compensation: parameters in mm and rad over mm, arms from a point.
#[derive(Default)]
pub(crate) struct Volumetric {
    pub curves: BTreeMap<String, Points>,
    pub constants: BTreeMap<String, f64>,
}

impl Volumetric {
    pub(crate) fn read_csv(text: &str) -> Self {
        let mut all = Self::default();
        let plain: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap().trim()).collect();
        for block in plain.join("\n").split('#') {
            let mut rows = block.lines().filter(|line| !line.is_empty());
            let header: Vec<&str> = rows.next().unwrap().split_whitespace().collect();
            for row in rows {
                let numbers: Vec<f64> = row.split_whitespace().map(|cell| cell.parse().unwrap()).collect();
                assert_eq!(numbers.len(), header.len());
                let argument = header[0].len() == 1;
                for (name, value) in header.iter().zip(&numbers).skip(usize::from(argument)) {
                    if argument {
                        all.curves.entry((*name).into()).or_default().push([numbers[0], *value]);
                    } else {
                        all.constants.insert((*name).into(), *value);
                    }
                }
            }
        }
        all
    }

    pub(crate) fn read_etalon(text: &str) -> Self {
        let mut all = Self::default();
        let (mut name, mut inside) = (String::new(), false);
        for line in text.lines().map(|line| line.split("//").next().unwrap().trim()).filter(|line| !line.is_empty()) {
            if line.starts_with('[') {
                name = line.trim_matches(['[', ']']).into();
            } else if let Some(value) = line.strip_prefix("VALUE =") {
                all.constants.insert(name.clone(), value.trim().parse().unwrap());
            } else if line == "Gridpoints = {" {
                inside = true;
            } else if line == "}" {
                inside = false;
            } else {
                assert!(inside, "{line}");
                let (at, value) = line.split_once(' ').unwrap();
                all.curves.entry(name.clone()).or_default().push([at.parse().unwrap(), value.parse().unwrap()]);
            }
        }
        all
    }

    /// Bodies one after the other, X carries Y, Y carries Z; the command is moved by minus the error, to second order.
    pub(crate) fn adds_um(&self, place: [f64; 3], arms_from: [f64; 3]) -> Vector3<f64> {
        let offset = Vector3::from(place) - Vector3::from(arms_from);
        let of = |name: &str, at: f64| self.curves.get(name).map_or(0.0, |points| between(points, at));
        let constant = |name: &str| self.constants.get(name).copied().unwrap_or(0.0);
        let mut carried = Isometry3::identity();
        for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
            let at = place[axis];
            let [x, y, z, a, b, c] = ["X", "Y", "Z", "A", "B", "C"].map(|error| of(&format!("E{error}{letter}"), at));
            let orientation = match letter {
                "Y" => Vector3::new(0.0, 0.0, constant("C0Y")),
                "Z" => Vector3::new(constant("A0Z"), constant("B0Z"), 0.0),
                _ => Vector3::zeros(),
            };
            let mut along = Vector3::zeros();
            along[axis] = offset[axis];
            let along = UnitQuaternion::from_scaled_axis(orientation) * along + Vector3::new(x, y, z);
            carried *= Isometry3::from_parts(
                Translation3::from(along),
                UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
            );
        }
        -1e3 * ((carried * Point3::origin()).coords - offset)
    }
}

/// A joint of LinuxCNC: nominal less forward position.
pub(crate) fn linuxcnc(text: &str) -> [Points; 2] {
    let mut all = [Points::new(), Points::new()];
    for line in text.lines() {
        let numbers: Option<Vec<f64>> = line.split_whitespace().map(|cell| cell.parse().ok()).collect();
        // The control stops at the first line that is no triplet.
        let Some([nominal, forward, reverse]) = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok()) else {
            break;
        };
        assert!(all[0].last().is_none_or(|last| last[0] < nominal));
        all[0].push([nominal, nominal - forward]);
        all[1].push([nominal, nominal - reverse]);
    }
    assert!(all[0].len() <= 256);
    all
}

/// Klipper: skew, and a mesh that is bilinear between its points.
pub(crate) struct Klipper {
    skew: [f64; 3],
    mesh: Vec<Vec<f64>>,
    ends: [f64; 4],
}

impl Klipper {
    pub(crate) fn read(text: &str) -> Self {
        let mut sections: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
        let (mut section, mut key) = (String::new(), String::new());
        for line in text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty()) {
            if line.starts_with('[') {
                section = line.trim_matches(['[', ']']).into();
                sections.entry(section.clone()).or_default();
            } else if line.starts_with(' ') {
                let value = sections.get_mut(&section).unwrap().get_mut(&key).unwrap();
                value.push_str(line.trim());
                value.push('\n');
            } else {
                let (name, value) = line.split_once('=').unwrap();
                key = name.trim().into();
                sections.get_mut(&section).unwrap().insert(key.clone(), value.trim().to_owned());
            }
        }
        let skew = &sections["skew_correction runout"];
        let mesh = &sections["bed_mesh runout"];
        assert!(mesh["version"] == "1" && mesh["mesh_x_pps"] == "0" && mesh["mesh_y_pps"] == "0");
        let points: Vec<Vec<f64>> = mesh["points"]
            .lines()
            .map(|row| row.split(',').map(|cell| cell.trim().parse().unwrap()).collect())
            .collect();
        assert_eq!(points.len(), mesh["y_count"].parse::<usize>().unwrap());
        assert!(points.iter().all(|row| row.len() == mesh["x_count"].parse::<usize>().unwrap()));
        let number = |key: &str| mesh[key].parse::<f64>().unwrap();
        Self {
            skew: ["xy_skew", "xz_skew", "yz_skew"].map(|key| skew[key].parse().unwrap()),
            mesh: points,
            ends: [number("min_x"), number("max_x"), number("min_y"), number("max_y")],
        }
    }

    pub(crate) fn adds_um(&self, [x, y, z]: [f64; 3]) -> Vector3<f64> {
        let [xy, xz, yz] = self.skew;
        let [min_x, max_x, min_y, max_y] = self.ends;
        let grid = |from: f64, to: f64, count: usize| -> Vec<f64> {
            (0..count).map(|index| from + (to - from) * index as f64 / (count - 1) as f64).collect()
        };
        let (at_x, at_y) = (grid(min_x, max_x, self.mesh[0].len()), grid(min_y, max_y, self.mesh.len()));
        let rows: Points = (self.mesh.iter().zip(&at_y))
            .map(|(row, y)| [*y, between(&at_x.iter().zip(row).map(|(x, z)| [*x, *z]).collect::<Points>(), x)])
            .collect();
        1e3 * Vector3::new(-y * xy - z * (xz - xy * yz), -z * yz, between(&rows, y))
    }
}
