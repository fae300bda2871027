//! Where the numbers of curves are in a table.

use arrow_array::RecordBatch;

use super::{Axis, Kind, columns::Numbers};
use crate::figure::{Drawing, Measure};

/// Where the numbers of a curve are: x, y, and the third number.
pub(super) struct Source {
    /// Name of the curve among those of its rows; empty where there is one only.
    pub name: String,
    x: String,
    y: [Option<String>; 2],
    third: Option<String>,
    pub marks: Option<String>,
    pub common: bool,
}

/// What a drawing needs of a table.
pub(super) struct Drawn {
    pub kind: Kind,
    pub axes: [Axis; 2],
    /// Of the heights of a map, or of the third coordinate of vectors.
    pub height: Axis,
    /// The components of vectors.
    pub vector: Vec<Axis>,
    pub values: Vec<Source>,
}

impl Source {
    fn new(name: &str, x: &str, y: [Option<&str>; 2], third: Option<&str>) -> Self {
        let y = y.map(|column| column.map(str::to_owned));
        let third = third.map(str::to_owned);
        Self { name: name.into(), x: x.into(), y, third, marks: None, common: false }
    }

    pub(super) fn columns<'a>(&self, rows: &'a RecordBatch) -> [Option<Numbers<'a>>; 4] {
        let column = |name: Option<&String>| name.and_then(|name| Numbers::of(rows, name));
        [column(Some(&self.x)), column(self.y[0].as_ref()), column(self.y[1].as_ref()), column(self.third.as_ref())]
    }
}

/// The columns of a drawing, with the axes that they are shown on.
pub(super) fn drawn(drawing: &Drawing, axis: &dyn Fn(&str) -> Axis) -> Drawn {
    let of = |kind, x: &str, values: &[Measure]| {
        let y = match values {
            [one] => {
                let named = axis(&one.column);
                Axis { name: one.symbol.clone().unwrap_or(named.name), ..named }
            }
            several => {
                Axis { name: String::new(), ..several.first().map_or_else(|| axis(""), |one| axis(&one.column)) }
            }
        };
        let (height, vector) = (axis(""), Vec::new());
        Drawn { kind, axes: [axis(x), y], height, vector, values: curves(x, values, axis) }
    };
    match drawing {
        Drawing::Polar { angle_deg: x, values } => of(Kind::Polar, x, values),
        Drawing::Lines { x, values } => of(Kind::Lines, x, values),
        Drawing::Points { x, values } => of(Kind::Points, x, values),
        Drawing::Bars { order: x, values } => of(Kind::Bars, x, values),
        Drawing::Amplitudes { order, parts: [real, imaginary], std } => {
            let amplitude = Axis { name: "amplitude".into(), ..axis(real) };
            Drawn {
                kind: Kind::Amplitudes,
                axes: [axis(order), amplitude],
                height: axis(""),
                vector: Vec::new(),
                values: vec![Source::new("", order, [Some(real), Some(imaginary)], std.as_deref())],
            }
        }
        Drawing::Map { x, y, value } => Drawn {
            kind: Kind::Map,
            axes: [axis(x), axis(y)],
            height: axis(value),
            vector: Vec::new(),
            values: vec![Source::new(value, x, [Some(y), None], Some(value))],
        },
        Drawing::Vectors { place: [x, y, z], vector } => Drawn {
            kind: Kind::Vectors,
            axes: [axis(x), axis(y)],
            height: axis(z),
            vector: vector.iter().map(|component| axis(component)).collect(),
            values: vec![
                Source::new("", x, [Some(y), None], Some(z)),
                Source::new("", &vector[0], [Some(&vector[1]), None], Some(&vector[2])),
            ],
        },
    }
}

fn curves(x: &str, values: &[Measure], axis: &dyn Fn(&str) -> Axis) -> Vec<Source> {
    let source = |value: &Measure| Source {
        name: match &value.symbol {
            Some(symbol) => symbol.clone(),
            None if values.iter().filter(|value| !value.common).count() > 1 || value.common => axis(&value.column).name,
            None => String::new(),
        },
        marks: value.marks.clone(),
        common: value.common,
        ..Source::new("", x, [Some(&value.column), None], value.std.as_deref())
    };
    values.iter().map(source).collect()
}
