//! Tables that grow by a station at a time: a group with one extendable dataset a column.

use std::marker::PhantomData;

use hdf5_metno::{Dataset, File, Group, H5Type, Result, types::FixedUnicode};
use ndarray::{ArrayView1, s};
use runout_core::{
    Complex64,
    pipeline::run::StationResult,
    separation::{ALONG_COLUMN, MotionColumn, Quantity, SectionAt, Separation, motion_columns},
};

use crate::node;

use Contents::{Measured, Repeated};

/// A name in a table, of at most so many bytes of UTF-8: names that repeat on every row compress to nothing only at a fixed
/// length, and in less time when it is short.
pub(super) type Name<const N: usize> = FixedUnicode<N>;
/// Bytes of names where all are short, and of the longest that there may be.
pub(super) const SHORT: usize = 16;
pub(super) const LONG: usize = 64;
/// Rows of a chunk: 64 KiB of f64.
const CHUNK_ROWS: usize = 8192;
/// Higher levels take several times as long for some percent less.
const DEFLATE: u8 = 1;

/// A name as tables hold it.
pub(super) fn name<const N: usize>(text: &str) -> Result<Name<N>> {
    text.parse().map_err(|_| format!("a name must be of at most {N} bytes without NUL: `{text}`").into())
}

/// What stands in a column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contents {
    /// The same again and again, which packs to little.
    Repeated,
    /// Measured numbers, whose last digits are noise: packing them takes long and saves little.
    Measured,
}

struct Column<T> {
    dataset: Dataset,
    rows: usize,
    element: PhantomData<fn(T)>,
}

impl<T: H5Type> Column<T> {
    fn create(group: &Group, name: &str, unit: &str, contents: Contents, meaning: &str) -> Result<Self> {
        // Rows come in order: only the last chunk is ever written again. The library's own cache keeps megabytes of
        // each column.
        let bytes = CHUNK_ROWS * size_of::<T>();
        let builder = group.new_dataset_builder().chunk(CHUNK_ROWS).chunk_cache(1, bytes, 1.0);
        let builder = match contents {
            Contents::Measured => builder,
            // Of numbers, the first bytes are alike from row to row; names are alike as a whole.
            Contents::Repeated if size_of::<T>() > size_of::<f64>() => builder.deflate(DEFLATE),
            Contents::Repeated => builder.shuffle().deflate(DEFLATE),
        };
        let dataset = builder.empty::<T>().shape(0..).create(name)?;
        node::put_text(&dataset, "unit", unit)?;
        node::put_text(&dataset, "meaning", meaning)?;
        Ok(Self { dataset, rows: 0, element: PhantomData })
    }

    fn append(&mut self, values: &[T]) -> Result<()> {
        let rows = self.rows + values.len();
        self.dataset.resize(rows)?;
        self.dataset.write_slice(ArrayView1::from(values), s![self.rows..rows])?;
        self.rows = rows;
        Ok(())
    }
}

impl<T: H5Type + Clone> Column<T> {
    fn repeat(&mut self, value: &T, times: usize) -> Result<()> {
        self.append(&vec![value.clone(); times])
    }
}

const STATION: &str = "name of the axial station";

fn std_of(column: &str) -> String {
    format!("standard uncertainty of {column} at any one angle, from the scatter; NaN if not known")
}

fn angles_deg(angles: usize) -> Vec<f64> {
    (0..angles).map(|angle| 360.0 * angle as f64 / angles as f64).collect()
}

/// Form over the part's angle.
pub(super) struct FormTable<const N: usize> {
    section: Column<Name<N>>,
    station: Column<Name<N>>,
    z_mm: Column<f64>,
    angle_deg: Column<f64>,
    form_um: Column<f64>,
    std_um: Column<f64>,
}

impl<const N: usize> FormTable<N> {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("form")?;
        Ok(Self {
            section: Column::create(&group, "section", "", Repeated, "id of the section")?,
            station: Column::create(&group, "station", "", Repeated, STATION)?,
            z_mm: Column::create(&group, "z_mm", "mm", Repeated, "place of the section along the axis")?,
            angle_deg: Column::create(&group, "angle_deg", "deg", Repeated, "the part's own angle")?,
            form_um: Column::create(
                &group,
                "form_um",
                "um",
                Measured,
                "deviation of the section's form, outward positive; orders that are lost are left out",
            )?,
            std_um: Column::create(&group, "std_um", "um", Repeated, &std_of("form_um"))?,
        })
    }

    pub(super) fn append(
        &mut self,
        result: &StationResult,
        station: &Name<N>,
        section: &SectionAt,
        unknown: usize,
    ) -> Result<()> {
        let form_um = result.over_angle(unknown);
        let rows = form_um.len();
        self.section.repeat(&name(&section.id)?, rows)?;
        self.station.repeat(station, rows)?;
        self.z_mm.repeat(&section.z_mm, rows)?;
        self.angle_deg.append(&angles_deg(rows))?;
        self.form_um.append(&form_um)?;
        self.std_um.repeat(&result.separation.angle_std(unknown), rows)
    }
}

/// Error motion over the spindle's angle.
pub(super) struct MotionTable<const N: usize> {
    group: Group,
    station: Column<Name<N>>,
    angle_deg: Column<f64>,
    /// The line of the motion, where that is neither x nor y.
    along_deg: Option<Column<f64>>,
    /// Value and standard uncertainty.
    motions: Vec<(Quantity, [Column<f64>; 2])>,
}

impl<const N: usize> MotionTable<N> {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("motion")?;
        let mut table = Self {
            station: Column::create(&group, "station", "", Repeated, STATION)?,
            angle_deg: Column::create(&group, "angle_deg", "deg", Repeated, "the spindle's angle")?,
            along_deg: None,
            motions: Vec::new(),
            group,
        };
        table.add_columns(motion_columns(None))?;
        Ok(table)
    }

    fn add_columns(&mut self, columns: Vec<MotionColumn>) -> Result<()> {
        for MotionColumn { quantity, name, about } in columns {
            if self.motions.iter().any(|(known, _)| *known == quantity) {
                continue;
            }
            let meaning = format!("{about}; orders that are lost are left out; NaN where it was not solved for");
            let value = Column::create(&self.group, name, quantity.unit(), Measured, &meaning)?;
            let std = Column::create(&self.group, &format!("std_{name}"), quantity.unit(), Repeated, &std_of(name))?;
            self.motions.push((quantity, [value, std]));
        }
        Ok(())
    }

    /// Adds one station; the first one tells whether motion is along a line only.
    pub(super) fn append(&mut self, result: &StationResult, station: &Name<N>) -> Result<()> {
        let separation = &result.separation;
        if let (Some(line), None) = (separation.azimuth(), &self.along_deg) {
            let (name, unit, meaning) = ALONG_COLUMN;
            self.along_deg = Some(Column::create(&self.group, name, unit, Repeated, meaning)?);
            self.add_columns(motion_columns(Some(line)))?;
        }
        let rows = result.angles;
        self.station.repeat(station, rows)?;
        self.angle_deg.append(&angles_deg(rows))?;
        if let (Some(line), Some(column)) = (separation.azimuth(), &mut self.along_deg) {
            column.repeat(&line.degrees(), rows)?;
        }
        for (quantity, [value, std]) in &mut self.motions {
            if let Some(unknown) = separation.position(*quantity) {
                value.append(&result.over_angle(unknown))?;
                std.repeat(&result.separation.angle_std(unknown), rows)?;
            } else {
                value.repeat(&f64::NAN, rows)?;
                std.repeat(&f64::NAN, rows)?;
            }
        }
        Ok(())
    }
}

/// Coefficients by order: form is Re Σ c e^{+inα}, motion Re Σ c e^{−inΦ}.
pub(super) struct HarmonicsTable<const N: usize> {
    quantity: Column<Name<N>>,
    section: Column<Name<N>>,
    station: Column<Name<N>>,
    order: Column<u32>,
    re: Column<f64>,
    im: Column<f64>,
    std: Column<f64>,
    observable: Column<bool>,
}

/// Unit of coefficients, whose rows are of all quantities.
const MIXED: &str = "um; urad for tilts";

impl<const N: usize> HarmonicsTable<N> {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("harmonics")?;
        Ok(Self {
            quantity: Column::create(
                &group,
                "quantity",
                "",
                Repeated,
                "form, x, y, tilt_x, tilt_y, along or tilt_along",
            )?,
            section: Column::create(&group, "section", "", Repeated, "id of the section; empty for motion")?,
            station: Column::create(&group, "station", "", Repeated, STATION)?,
            order: Column::create(&group, "order", "1/rev", Repeated, "undulations per revolution")?,
            re: Column::create(&group, "re", MIXED, Measured, "real part of c; NaN where the layout cannot tell it")?,
            im: Column::create(
                &group,
                "im",
                MIXED,
                Measured,
                "imaginary part of c; NaN where the layout cannot tell it",
            )?,
            std: Column::create(
                &group,
                "std",
                MIXED,
                Measured,
                "sqrt(E|delta|^2) of the complex coefficient c, both parts together, from the scatter; NaN if not known",
            )?,
            observable: Column::create(&group, "observable", "", Repeated, "whether the layout can tell this order")?,
        })
    }

    /// Adds one unknown of one station: orders from 1, and the mean level where the method knows it.
    pub(super) fn append(&mut self, separation: &Separation, station: &Name<N>, unknown: usize) -> Result<()> {
        let Some(quantity) = separation.unknowns.get(unknown) else { return Ok(()) };
        let section = match quantity {
            Quantity::Form(section) => separation.sections.get(*section).map_or("", |section| section.id.as_str()),
            _ => "",
        };
        let width = separation.unknowns.len();
        let (mut order, mut re, mut im, mut std, mut observable) = (vec![], vec![], vec![], vec![], vec![]);
        let lines = separation.estimate.iter().zip(&separation.variance).zip(&separation.observable);
        for (index, ((value, variance), seen)) in lines.skip(unknown).step_by(width).enumerate() {
            let level_known = *seen && value.is_finite() && *value != Complex64::ZERO;
            if index == 0 && !level_known {
                continue;
            }
            let told = |number: f64| if *seen { number } else { f64::NAN };
            order.push(index as u32);
            re.push(told(value.re));
            im.push(told(value.im));
            std.push(told(variance.sqrt()));
            observable.push(*seen);
        }
        self.quantity.repeat(&name(quantity.id())?, order.len())?;
        self.section.repeat(&name(section)?, order.len())?;
        self.station.repeat(station, order.len())?;
        self.order.append(&order)?;
        self.re.append(&re)?;
        self.im.append(&im)?;
        self.std.append(&std)?;
        self.observable.append(&observable)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn a_column_caches_its_last_chunk_and_no_more() {
        let folder = tempfile::tempdir().unwrap();
        let file = File::create(folder.path().join("table.h5")).unwrap();
        let mut column = Column::<f64>::create(&file, "z_mm", "mm", Repeated, "").unwrap();
        let rows: Vec<f64> = (0..3 * CHUNK_ROWS + 7).map(|row| row as f64).collect();
        for some in rows.chunks(1000) {
            column.append(some).unwrap();
        }
        assert_eq!(column.dataset.access_plist().unwrap().chunk_cache().nbytes, 8 * CHUNK_ROWS);
        assert_eq!(column.dataset.read_raw::<f64>().unwrap(), rows);
    }
}
