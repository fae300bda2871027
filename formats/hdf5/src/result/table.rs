//! Tables that grow by a station at a time: a group with one extendable dataset a column.

use std::marker::PhantomData;

use hdf5_metno::{Dataset, File, Group, H5Type, Result, types::FixedUnicode};
use ndarray::{ArrayView1, s};
use runout_core::{
    Complex64,
    pipeline::run::StationResult,
    separation::{Quantity, SectionAt, Separation},
};

/// A name in a table.
pub(super) type Name = FixedUnicode<NAME_BYTES>;
/// Longest name in UTF-8: names that repeat on every row compress to nothing only at a fixed length.
const NAME_BYTES: usize = 64;
/// Rows of a chunk: 64 KiB of f64.
const CHUNK_ROWS: usize = 8192;
const DEFLATE: u8 = 4;

/// Quantity, name of its column and of its uncertainty's.
pub(super) const MOTION: [(Quantity, &str, &str); 4] = [
    (Quantity::X, "x_um", "std_x_um"),
    (Quantity::Y, "y_um", "std_y_um"),
    (Quantity::TiltX, "tilt_x_urad", "std_tilt_x_urad"),
    (Quantity::TiltY, "tilt_y_urad", "std_tilt_y_urad"),
];

/// A name of at most 64 bytes.
pub(super) fn name(text: &str) -> Result<Name> {
    text.parse().map_err(|_| format!("a name must be of at most {NAME_BYTES} bytes without NUL: `{text}`").into())
}

struct Column<T> {
    dataset: Dataset,
    rows: usize,
    element: PhantomData<fn(T)>,
}

impl<T: H5Type> Column<T> {
    fn create(group: &Group, name: &str) -> Result<Self> {
        let builder = group.new_dataset_builder().chunk(CHUNK_ROWS).shuffle().deflate(DEFLATE);
        let dataset = builder.empty::<T>().shape(0..).create(name)?;
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

fn angles_deg(angles: usize) -> Vec<f64> {
    (0..angles).map(|angle| 360.0 * angle as f64 / angles as f64).collect()
}

/// Form over the part's angle.
pub(super) struct FormTable {
    section: Column<Name>,
    station: Column<Name>,
    z_mm: Column<f64>,
    angle_deg: Column<f64>,
    form_um: Column<f64>,
    std_um: Column<f64>,
}

impl FormTable {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("form")?;
        Ok(Self {
            section: Column::create(&group, "section")?,
            station: Column::create(&group, "station")?,
            z_mm: Column::create(&group, "z_mm")?,
            angle_deg: Column::create(&group, "angle_deg")?,
            form_um: Column::create(&group, "form_um")?,
            std_um: Column::create(&group, "std_um")?,
        })
    }

    pub(super) fn append(
        &mut self,
        result: &StationResult,
        station: &Name,
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
pub(super) struct MotionTable {
    station: Column<Name>,
    angle_deg: Column<f64>,
    /// Value and standard uncertainty of each of [`MOTION`].
    motions: Vec<[Column<f64>; 2]>,
}

impl MotionTable {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("motion")?;
        let pair = |(_, value, std): &(Quantity, &str, &str)| {
            Ok([Column::create(&group, value)?, Column::create(&group, std)?])
        };
        Ok(Self {
            station: Column::create(&group, "station")?,
            angle_deg: Column::create(&group, "angle_deg")?,
            motions: MOTION.iter().map(pair).collect::<Result<_>>()?,
        })
    }

    /// Adds one station; `unknowns` are those behind [`MOTION`], where they were solved for.
    pub(super) fn append(
        &mut self,
        result: &StationResult,
        station: &Name,
        unknowns: [Option<usize>; 4],
    ) -> Result<()> {
        let rows = result.angles;
        self.station.repeat(station, rows)?;
        self.angle_deg.append(&angles_deg(rows))?;
        for ([value, std], unknown) in self.motions.iter_mut().zip(unknowns) {
            if let Some(unknown) = unknown {
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
pub(super) struct HarmonicsTable {
    quantity: Column<Name>,
    section: Column<Name>,
    station: Column<Name>,
    order: Column<u32>,
    re: Column<f64>,
    im: Column<f64>,
    std: Column<f64>,
    observable: Column<bool>,
}

impl HarmonicsTable {
    pub(super) fn create(file: &File) -> Result<Self> {
        let group = file.create_group("harmonics")?;
        Ok(Self {
            quantity: Column::create(&group, "quantity")?,
            section: Column::create(&group, "section")?,
            station: Column::create(&group, "station")?,
            order: Column::create(&group, "order")?,
            re: Column::create(&group, "re")?,
            im: Column::create(&group, "im")?,
            std: Column::create(&group, "std")?,
            observable: Column::create(&group, "observable")?,
        })
    }

    /// Adds one unknown of one station: orders from 1, and the mean level where the method knows it.
    pub(super) fn append(&mut self, separation: &Separation, station: &Name, unknown: usize) -> Result<()> {
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
