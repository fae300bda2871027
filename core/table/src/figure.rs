//! Figures as data: what to draw of a table's rows. A table declares its figures; what draws them knows no domain.

use serde::{Deserialize, Serialize};

/// A figure of a table: panels side by side, each with curves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Its id, which names its files: `form-polar`.
    pub id: String,
    /// What it shows, without units.
    pub title: String,
    /// Columns of names that part the rows into panels.
    pub panels: Vec<String>,
    /// Whether panels are of different quantities, so that a picture with room for fewer still has each.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub every_panel: bool,
    /// Columns of names that part the rows of a panel into curves.
    pub curves: Vec<String>,
    /// A column of names, and the names of the rows that are drawn; without it all rows are.
    pub only: Option<(String, Vec<String>)>,
    /// A column of names of the places along the horizontal axis.
    pub places: Option<String>,
    /// A limit that all panels show.
    pub level: Option<Level>,
    /// Limits that differ from place to place, which all panels show.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<Line>,
    /// Places along the horizontal axis that all panels name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub named: Vec<(f64, String)>,
    /// Name of a table of [reference circles](crate::circles) about which the curves of a polar figure can be drawn; its rows have the
    /// same columns of names.
    #[serde(default)]
    pub circles: Option<String>,
    /// How its rows are drawn.
    pub drawing: Drawing,
}

/// A horizontal line across every panel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Its name: `limit`.
    pub name: String,
    /// Its height, in the unit of the values.
    pub value: f64,
}

/// A line over every panel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Its name: `limit`.
    pub name: String,
    /// Its points, along the horizontal axis and, in the unit of the values, along the vertical one.
    pub points: Vec<[f64; 2]>,
}

/// How rows are drawn. All fields name columns of the figure's table; rows with NaN or null are left out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Drawing {
    /// Deviations about a reference circle, over an angle in degrees, counterclockwise from the right.
    Polar {
        /// The angle, in degrees.
        angle_deg: String,
        /// The deviations, all of one unit.
        values: Vec<Measure>,
    },
    /// Curves over a common axis.
    Lines {
        /// Along the axis.
        x: String,
        /// The values, all of one unit.
        values: Vec<Measure>,
    },
    /// Absolute values of complex numbers over their order.
    Amplitudes {
        /// The order.
        order: String,
        /// Real and imaginary part.
        parts: [String; 2],
        /// Standard uncertainty of the complex number, both parts together.
        std: Option<String>,
    },
    /// Points that are not joined, over a common axis.
    Points {
        /// Along the axis.
        x: String,
        /// The values, all of one unit.
        values: Vec<Measure>,
    },
    /// Bars over the order; orders without a value are lost.
    Bars {
        /// The order.
        order: String,
        /// The values, all of one unit.
        values: Vec<Measure>,
    },
    /// A height over a rectangle, as colours.
    Map {
        /// Along the horizontal axis.
        x: String,
        /// Along the vertical axis.
        y: String,
        /// The height.
        value: String,
    },
    /// Vectors at places in space, drawn longer than they are.
    Vectors {
        /// The three coordinates of a place, all of one unit.
        place: [String; 3],
        /// The three components of its vector along the same axes, all of one unit.
        vector: [String; 3],
    },
}

/// A column of values, and that of their standard uncertainty where there is one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Measure {
    /// The values.
    pub column: String,
    /// Their standard uncertainties, in the same unit.
    pub std: Option<String>,
    /// Their symbol, where the column's name without its unit is not the usual one.
    pub symbol: Option<String>,
    /// A column of texts: a value with a text is marked with it.
    pub marks: Option<String>,
    /// Whether all curves of a panel have the same values, so that they are drawn once, as a line.
    #[serde(default)]
    pub common: bool,
}

impl Measure {
    /// Values without uncertainty.
    #[must_use]
    pub fn new(column: impl Into<String>) -> Self {
        Self { column: column.into(), std: None, symbol: None, marks: None, common: false }
    }

    /// Adds a column of standard uncertainties.
    #[must_use]
    pub fn with_std(self, column: impl Into<String>) -> Self {
        Self { std: Some(column.into()), ..self }
    }

    /// Sets the symbol of the values.
    #[must_use]
    pub fn with_symbol(self, symbol: impl Into<String>) -> Self {
        Self { symbol: Some(symbol.into()), ..self }
    }

    /// Adds a column of texts that mark values.
    #[must_use]
    pub fn with_marks(self, column: impl Into<String>) -> Self {
        Self { marks: Some(column.into()), ..self }
    }

    /// Marks the values as those that all curves of a panel share.
    #[must_use]
    pub fn common(self) -> Self {
        Self { common: true, ..self }
    }

    /// The columns that it needs.
    fn columns(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.column).chain(&self.std).chain(&self.marks).map(String::as_str)
    }
}

impl Figure {
    fn new(id: impl Into<String>, title: impl Into<String>, drawing: Drawing) -> Self {
        let (panels, curves) = (Vec::new(), Vec::new());
        let (id, title) = (id.into(), title.into());
        let (lines, named) = (Vec::new(), Vec::new());
        Self {
            id,
            title,
            panels,
            every_panel: false,
            curves,
            only: None,
            places: None,
            level: None,
            lines,
            named,
            circles: None,
            drawing,
        }
    }

    /// Deviations about a reference circle.
    #[must_use]
    pub fn polar(
        id: impl Into<String>,
        title: impl Into<String>,
        angle_deg: impl Into<String>,
        values: impl IntoIterator<Item = Measure>,
    ) -> Self {
        let drawing = Drawing::Polar { angle_deg: angle_deg.into(), values: values.into_iter().collect() };
        Self::new(id, title, drawing)
    }

    /// Curves over a common axis.
    #[must_use]
    pub fn lines(
        id: impl Into<String>,
        title: impl Into<String>,
        x: impl Into<String>,
        values: impl IntoIterator<Item = Measure>,
    ) -> Self {
        Self::new(id, title, Drawing::Lines { x: x.into(), values: values.into_iter().collect() })
    }

    /// Absolute values of complex numbers over their order.
    #[must_use]
    pub fn amplitudes(
        id: impl Into<String>,
        title: impl Into<String>,
        order: impl Into<String>,
        [real, imaginary]: [&str; 2],
        std: Option<&str>,
    ) -> Self {
        let (parts, std) = ([real.to_owned(), imaginary.to_owned()], std.map(str::to_owned));
        Self::new(id, title, Drawing::Amplitudes { order: order.into(), parts, std })
    }

    /// Points that are not joined, over a common axis.
    #[must_use]
    pub fn points(
        id: impl Into<String>,
        title: impl Into<String>,
        x: impl Into<String>,
        values: impl IntoIterator<Item = Measure>,
    ) -> Self {
        Self::new(id, title, Drawing::Points { x: x.into(), values: values.into_iter().collect() })
    }

    /// Bars over the order; orders without a value are lost.
    #[must_use]
    pub fn bars(
        id: impl Into<String>,
        title: impl Into<String>,
        order: impl Into<String>,
        values: impl IntoIterator<Item = Measure>,
    ) -> Self {
        Self::new(id, title, Drawing::Bars { order: order.into(), values: values.into_iter().collect() })
    }

    /// A height over a rectangle.
    #[must_use]
    pub fn map(id: impl Into<String>, title: impl Into<String>, [x, y, value]: [&str; 3]) -> Self {
        Self::new(id, title, Drawing::Map { x: x.into(), y: y.into(), value: value.into() })
    }

    /// Vectors at places in space.
    #[must_use]
    pub fn vectors(id: impl Into<String>, title: impl Into<String>, place: [String; 3], vector: [String; 3]) -> Self {
        Self::new(id, title, Drawing::Vectors { place, vector })
    }

    /// Draws a panel for each combination of names in these columns.
    #[must_use]
    pub fn panels<T: Into<String>>(self, columns: impl IntoIterator<Item = T>) -> Self {
        Self { panels: columns.into_iter().map(Into::into).collect(), ..self }
    }

    /// Draws a panel for each quantity that these columns name, of which none is left out.
    #[must_use]
    pub fn quantities<T: Into<String>>(self, columns: impl IntoIterator<Item = T>) -> Self {
        Self { every_panel: true, ..self.panels(columns) }
    }

    /// Draws a curve for each combination of names in these columns.
    #[must_use]
    pub fn curves<T: Into<String>>(self, columns: impl IntoIterator<Item = T>) -> Self {
        Self { curves: columns.into_iter().map(Into::into).collect(), ..self }
    }

    /// Draws only the rows with one of these names in a column.
    #[must_use]
    pub fn only<T: Into<String>>(self, column: impl Into<String>, names: impl IntoIterator<Item = T>) -> Self {
        Self { only: Some((column.into(), names.into_iter().map(Into::into).collect())), ..self }
    }

    /// Takes the names of the places along the horizontal axis from a column.
    #[must_use]
    pub fn places(self, column: impl Into<String>) -> Self {
        Self { places: Some(column.into()), ..self }
    }

    /// Sets a limit with its name.
    #[must_use]
    pub fn level(self, name: impl Into<String>, value: f64) -> Self {
        Self { level: Some(Level { name: name.into(), value }), ..self }
    }

    /// Sets names at places along the horizontal axis.
    #[must_use]
    pub fn named(self, places: impl IntoIterator<Item = (f64, String)>) -> Self {
        Self { named: places.into_iter().collect(), ..self }
    }

    /// Adds a limit that differs from place to place.
    pub fn add_line(&mut self, name: impl Into<String>, points: Vec<[f64; 2]>) {
        self.lines.push(Line { name: name.into(), points });
    }

    /// Draws the reference circles of a table.
    #[must_use]
    pub fn circles(self, table: impl Into<String>) -> Self {
        Self { circles: Some(table.into()), ..self }
    }

    /// The columns of its table that it needs.
    #[must_use]
    pub fn columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = self.panels.iter().chain(&self.curves).map(String::as_str).collect();
        columns.extend(self.only.iter().map(|(column, _)| column.as_str()));
        columns.extend(self.places.as_deref());
        match &self.drawing {
            Drawing::Polar { angle_deg: x, values }
            | Drawing::Lines { x, values }
            | Drawing::Points { x, values }
            | Drawing::Bars { order: x, values } => {
                columns.push(x);
                columns.extend(values.iter().flat_map(Measure::columns));
            }
            Drawing::Amplitudes { order, parts, std } => {
                columns.extend([order.as_str(), parts[0].as_str(), parts[1].as_str()]);
                columns.extend(std.as_deref());
            }
            Drawing::Vectors { place, vector } => columns.extend(place.iter().chain(vector).map(String::as_str)),
            Drawing::Map { x, y, value } => columns.extend([x.as_str(), y.as_str(), value.as_str()]),
        }
        columns
    }
}
