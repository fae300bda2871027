//! What a domain declares of its readings, so that core can test them on themselves.

/// Structure of a set of readings. An empty one declares nothing, and nothing is tested.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Structure {
    /// Along what errors may depend on each other.
    pub order: Option<Order>,
    /// Ways to divide the readings.
    pub partitions: Vec<Partition>,
    /// What may be offset against each other: direction, pass, half, first and second reading.
    pub shifts: Vec<Shift>,
    /// Candidates (indices of effects) that are tried at many frequencies or orders: each is measured by the others.
    pub families: Vec<Vec<usize>>,
    /// The name of each reading; without them, they are "reading 17".
    pub rows: Vec<String>,
}

/// Along what the errors of readings may depend on each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// What it is: "z", "angle", "time".
    pub name: String,
    /// The series of each reading: readings of different series are independent.
    pub series: Vec<usize>,
    /// Its place within the series, in any unit.
    pub at: Vec<f64>,
}

/// A way to divide the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Partition {
    /// What the parts are, in the plural: "circles", "passes", "z-blocks".
    pub name: String,
    /// The part of each reading, an index into `levels`; readings that are in none have an index beyond it.
    pub level: Vec<usize>,
    /// Names of the parts.
    pub levels: Vec<String>,
    /// What the noise model says of the parts.
    pub kind: Kind,
}

/// What the noise model says of the parts of a [`Partition`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// They are independent of each other, and an effect has to agree on them.
    Blocks,
    /// They are independent of each other; what an effect is along them is not known well enough while it is looked for.
    Independent,
    /// They have the same noise level.
    Alike,
}

/// Parts of the readings that may be offset against the first one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Shift {
    /// What the parts are, in the plural: "passes", "directions in dx".
    pub name: String,
    /// Names of the parts.
    pub levels: Vec<String>,
    /// What an offset of one unit of each part but the first adds to each reading: `[part][reading]`.
    pub columns: Vec<Vec<f64>>,
}

impl Structure {
    /// Whether nothing is declared.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.order.is_none() && self.partitions.is_empty() && self.shifts.is_empty()
    }

    /// With errors that may depend on each other along `name`: the series of each reading and its place there.
    #[must_use]
    pub fn along(self, name: &str, series: Vec<usize>, at: Vec<f64>) -> Self {
        Self { order: Some(Order { name: name.into(), series, at }), ..self }
    }

    /// With one more way to divide the readings.
    #[must_use]
    pub fn divided(mut self, name: &str, kind: Kind, level: Vec<usize>, levels: Vec<String>) -> Self {
        self.partitions.push(Partition { name: name.into(), level, levels, kind });
        self
    }

    /// With parts that may be offset: the part of each reading, an index into `levels`. Nothing where there is one only.
    #[must_use]
    pub fn shifting(mut self, name: &str, level: &[usize], levels: &[String]) -> Self {
        let used: Vec<usize> = (0..levels.len()).filter(|part| level.contains(part)).collect();
        let columns =
            used.iter().skip(1).map(|part| level.iter().map(|own| f64::from(u8::from(own == part))).collect());
        let levels = used.iter().map(|part| levels[*part].clone()).collect();
        self.shifts.push(Shift { name: name.into(), levels, columns: columns.collect() });
        self.shifts.retain(|shift| !shift.columns.is_empty());
        self
    }

    /// With independent stretches of the readings, one after the other, of these lengths; nothing where there is one only.
    #[must_use]
    pub fn in_stretches(self, name: &str, lengths: &[usize]) -> Self {
        if lengths.len() < 2 {
            return self;
        }
        let stretch = lengths.iter().enumerate().flat_map(|(stretch, length)| std::iter::repeat_n(stretch, *length));
        let names = (1..=lengths.len()).map(|stretch| stretch.to_string()).collect();
        self.divided(name, Kind::Blocks, stretch.collect(), names)
    }

    /// With a family of candidates.
    #[must_use]
    pub fn family(mut self, candidates: Vec<usize>) -> Self {
        self.families.push(candidates);
        self
    }

    /// With names of the readings.
    #[must_use]
    pub fn naming(self, rows: Vec<String>) -> Self {
        Self { rows, ..self }
    }

    /// Partitions into parts that are independent of each other.
    pub fn independent(&self) -> impl Iterator<Item = &Partition> {
        self.partitions.iter().filter(|partition| partition.kind != Kind::Alike)
    }

    /// Partitions of one kind.
    pub fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &Partition> {
        self.partitions.iter().filter(move |partition| partition.kind == kind)
    }

    /// The name of a reading.
    #[must_use]
    pub fn row(&self, reading: usize) -> String {
        self.rows.get(reading).cloned().unwrap_or_else(|| format!("reading {reading}"))
    }

    /// The structure for readings in another order: reading `i` of it was `places[i]`.
    #[must_use]
    pub fn sorted(&self, places: &[usize]) -> Self {
        fn pick<T: Clone>(from: &[T], places: &[usize]) -> Vec<T> {
            places.iter().filter_map(|place| from.get(*place)).cloned().collect()
        }
        let order = self.order.as_ref().map(|order| Order {
            name: order.name.clone(),
            series: pick(&order.series, places),
            at: pick(&order.at, places),
        });
        let partition = |one: &Partition| Partition { level: pick(&one.level, places), ..one.clone() };
        let shift = |one: &Shift| Shift {
            columns: one.columns.iter().map(|column| pick(column, places)).collect(),
            ..one.clone()
        };
        Self {
            order,
            partitions: self.partitions.iter().map(partition).collect(),
            shifts: self.shifts.iter().map(shift).collect(),
            families: self.families.clone(),
            rows: pick(&self.rows, places),
        }
    }
}

impl Partition {
    /// Parts that have readings.
    #[must_use]
    pub fn count(&self) -> usize {
        (0..self.levels.len()).filter(|level| self.level.contains(level)).count()
    }

    /// Readings of each part.
    #[must_use]
    pub fn members(&self) -> Vec<Vec<usize>> {
        let mut members = vec![Vec::new(); self.levels.len()];
        for (reading, level) in self.level.iter().enumerate() {
            if let Some(part) = members.get_mut(*level) {
                part.push(reading);
            }
        }
        members
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_keep_their_parts_in_another_order() {
        let names = ["a", "b"].map(str::to_owned).to_vec();
        let declared = Structure::default()
            .along("z", vec![0, 0, 1, 1], vec![0.0, 1.0, 0.0, 1.0])
            .shifting("halves", &[0, 1, 0, 1], &names)
            .divided("halves", Kind::Blocks, vec![0, 1, 0, 1], names)
            .naming((0..4).map(|row| format!("row {row}")).collect());
        let sorted = declared.sorted(&[2, 0, 3, 1]);
        assert_eq!(sorted.order.as_ref().unwrap().series, [1, 0, 1, 0]);
        assert_eq!(sorted.partitions[0].members(), [vec![0, 1], vec![2, 3]]);
        assert_eq!(sorted.shifts[0].columns, [[0.0, 0.0, 1.0, 1.0]]);
        assert_eq!(declared.clone().shifting("halves", &[1, 1, 1, 1], &sorted.partitions[0].levels).shifts.len(), 1);
        assert_eq!((sorted.row(0).as_str(), sorted.partitions[0].count()), ("row 2", 2));
        assert_eq!(Structure::default().row(7), "reading 7");
    }
}
