//! Figures as data: what to draw of a table's rows. A table declares its figures; what draws them knows no domain.

use serde::{Deserialize, Serialize};

/// A figure of a table: panels side by side, each with curves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figure {
    /// Its id, which names its files: `form-polar`.
    pub id: String,
    /// What it shows, without units.
    pub title: String,
    /// Columns of names that part the rows into panels.
    pub panels: Vec<String>,
    /// Columns of names that part the rows of a panel into curves.
    pub curves: Vec<String>,
    /// A column of names, and the names of the rows that are drawn; without it all rows are.
    pub only: Option<(String, Vec<String>)>,
    /// How its rows are drawn.
    pub drawing: Drawing,
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
    /// A height over a rectangle, as colours.
    Map {
        /// Along the horizontal axis.
        x: String,
        /// Along the vertical axis.
        y: String,
        /// The height.
        value: String,
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
}

impl Measure {
    /// Values without uncertainty.
    #[must_use]
    pub fn new(column: impl Into<String>) -> Self {
        Self { column: column.into(), std: None, symbol: None }
    }

    /// The same with a column of standard uncertainties.
    #[must_use]
    pub fn with_std(self, column: impl Into<String>) -> Self {
        Self { std: Some(column.into()), ..self }
    }

    /// The same with a symbol.
    #[must_use]
    pub fn with_symbol(self, symbol: impl Into<String>) -> Self {
        Self { symbol: Some(symbol.into()), ..self }
    }
}

impl Figure {
    fn new(id: impl Into<String>, title: impl Into<String>, drawing: Drawing) -> Self {
        let (panels, curves) = (Vec::new(), Vec::new());
        Self { id: id.into(), title: title.into(), panels, curves, only: None, drawing }
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

    /// A height over a rectangle.
    #[must_use]
    pub fn map(id: impl Into<String>, title: impl Into<String>, [x, y, value]: [&str; 3]) -> Self {
        Self::new(id, title, Drawing::Map { x: x.into(), y: y.into(), value: value.into() })
    }

    /// The same with a panel for each combination of names in these columns.
    #[must_use]
    pub fn panels<T: Into<String>>(self, columns: impl IntoIterator<Item = T>) -> Self {
        Self { panels: columns.into_iter().map(Into::into).collect(), ..self }
    }

    /// The same with a curve for each combination of names in these columns.
    #[must_use]
    pub fn curves<T: Into<String>>(self, columns: impl IntoIterator<Item = T>) -> Self {
        Self { curves: columns.into_iter().map(Into::into).collect(), ..self }
    }

    /// The same of the rows with one of these names in a column.
    #[must_use]
    pub fn only<T: Into<String>>(self, column: impl Into<String>, names: impl IntoIterator<Item = T>) -> Self {
        Self { only: Some((column.into(), names.into_iter().map(Into::into).collect())), ..self }
    }

    /// The columns of its table that it needs.
    #[must_use]
    pub fn columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = self.panels.iter().chain(&self.curves).map(String::as_str).collect();
        columns.extend(self.only.iter().map(|(column, _)| column.as_str()));
        match &self.drawing {
            Drawing::Polar { angle_deg: x, values } | Drawing::Lines { x, values } => {
                columns.push(x);
                columns.extend(
                    values
                        .iter()
                        .flat_map(|value| std::iter::once(&value.column).chain(&value.std))
                        .map(String::as_str),
                );
            }
            Drawing::Amplitudes { order, parts, std } => {
                columns.extend([order.as_str(), parts[0].as_str(), parts[1].as_str()]);
                columns.extend(std.as_deref());
            }
            Drawing::Map { x, y, value } => columns.extend([x.as_str(), y.as_str(), value.as_str()]),
        }
        columns
    }
}
