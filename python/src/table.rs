//! Tables and surfaces, as the memory that Python's libraries share.

use std::sync::Arc;

use arrow_array::{
    Array, BooleanArray, Float64Array, RecordBatch, RecordBatchIterator, StringArray, UInt32Array,
    ffi::FFI_ArrowSchema, ffi_stream::FFI_ArrowArrayStream,
};
use arrow_ipc::{reader::StreamReader, writer::StreamWriter};
use arrow_schema::{ArrowError, Schema};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::{
    exceptions::PyKeyError,
    prelude::*,
    types::{PyBytes, PyCapsule, PyDict},
};
use runout_cli::Failure;
use runout_core::{
    fault::known_names,
    surface,
    table::{ColumnSpec, Figure, Kind, TableSpec},
};
use serde::{Deserialize, Serialize};

use crate::failure::{exception, fault};

/// A table with units. It gives its memory to pyarrow, polars, pandas and DuckDB by the Arrow PyCapsule interface.
#[pyclass(frozen, module = "runout._native")]
pub struct Table {
    spec: TableSpec,
    batches: Vec<RecordBatch>,
}

impl Table {
    /// A table of these rows.
    pub fn new(spec: TableSpec, batches: Vec<RecordBatch>) -> Self {
        Self { spec, batches }
    }

    fn schema(&self) -> Arc<Schema> {
        self.batches.first().map_or_else(|| self.spec.schema(), RecordBatch::schema)
    }

    /// The arrays of a column, each of one type of Arrow's.
    fn pieces<A: Array + 'static>(&self, column: usize) -> impl Iterator<Item = &A> {
        self.batches.iter().filter_map(move |batch| batch.column(column).as_any().downcast_ref::<A>())
    }
}

/// What makes an object of a pickle, and what it is given.
type Restored<'py, Given> = (Bound<'py, PyAny>, Given);

/// A table's declaration as a pickle holds it.
#[derive(Serialize, Deserialize)]
struct Pickled {
    name: String,
    about: String,
    columns: Vec<(char, bool, String, String, String)>,
    figures: Vec<Figure>,
}

impl Pickled {
    fn of(spec: &TableSpec) -> Self {
        let columns = spec.columns.iter().map(|column| {
            let kind = match column.kind {
                Kind::Name => 'n',
                Kind::Text => 't',
                Kind::Number => 'x',
                Kind::Count => 'c',
                Kind::Flag => 'f',
            };
            (kind, column.nullable, column.name.clone(), column.unit.clone(), column.about.clone())
        });
        let columns = columns.collect();
        Self { name: spec.name.clone(), about: spec.about.clone(), columns, figures: spec.figures.clone() }
    }

    fn spec(self) -> TableSpec {
        let columns = self.columns.into_iter().map(|(kind, nullable, name, unit, about)| {
            let column = match kind {
                'n' => ColumnSpec::name(name, about),
                't' => ColumnSpec::text(name, about),
                'c' => ColumnSpec::count(name, unit, about),
                'f' => ColumnSpec::flag(name, about),
                _ => ColumnSpec::number(name, unit, about),
            };
            if nullable { column.or_null() } else { column }
        });
        let spec = TableSpec::new(self.name, self.about, columns.collect());
        self.figures.into_iter().fold(spec, TableSpec::figure)
    }
}

#[pymethods]
impl Table {
    /// A frame of pandas, with the units in its `attrs`.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let (columns, units) = (PyDict::new(py), PyDict::new(py));
        for column in &slf.get().spec.columns {
            columns.set_item(&column.name, slf.get_item(&column.name)?)?;
            units.set_item(&column.name, &column.unit)?;
        }
        let frame = py.import("pandas")?.getattr("DataFrame")?.call1((columns,))?;
        frame.getattr("attrs")?.set_item("units", units)?;
        Ok(frame)
    }

    /// A frame of polars, which shares its memory.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.getattr("DataFrame")?.call1((slf,))
    }

    /// What is drawn of it, as JSON: a list of figures.
    #[getter]
    fn drawings(&self) -> PyResult<String> {
        serde_json::to_string(&self.spec.figures).map_err(|error| fault(&error.to_string()))
    }

    /// As a pickle holds it: its declaration, and its rows in Arrow's IPC.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Restored<'py, (String, Bound<'py, PyBytes>)>> {
        let refuse = |error: ArrowError| fault(&error.to_string());
        let table = slf.get();
        let spec = serde_json::to_string(&Pickled::of(&table.spec)).map_err(|error| fault(&error.to_string()))?;
        let mut writer = StreamWriter::try_new(Vec::new(), &table.schema()).map_err(refuse)?;
        table.batches.iter().try_for_each(|batch| writer.write(batch)).map_err(refuse)?;
        let rows = writer.into_inner().map_err(refuse)?;
        Ok((slf.get_type().getattr("_restored")?, (spec, PyBytes::new(slf.py(), &rows))))
    }

    /// A table of what a pickle holds.
    #[staticmethod]
    fn _restored(spec: &str, rows: &[u8]) -> PyResult<Self> {
        let refuse = |error: ArrowError| fault(&error.to_string());
        let spec: Pickled = serde_json::from_str(spec).map_err(|error| fault(&error.to_string()))?;
        let batches = StreamReader::try_new(rows, None).map_err(refuse)?.collect::<Result<_, _>>().map_err(refuse)?;
        Ok(Self::new(spec.spec(), batches))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.spec.name
    }

    #[getter]
    fn about(&self) -> &str {
        &self.spec.about
    }

    /// Name, unit and meaning of each column.
    #[getter]
    fn columns(&self) -> Vec<(&str, &str, &str)> {
        let columns = self.spec.columns.iter();
        columns.map(|column| (column.name.as_str(), column.unit.as_str(), column.about.as_str())).collect()
    }

    fn __len__(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    /// A column as a NumPy array; texts as a list. Numbers that are null are NaN.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(index) = self.spec.columns.iter().position(|column| column.name == name) else {
            let known = known_names(name, self.spec.columns.iter().map(|column| column.name.as_str()));
            return Err(PyKeyError::new_err(format!("the table `{}` has no column `{name}`: {known}", self.spec.name)));
        };
        let column = &self.spec.columns[index];
        match column.kind {
            Kind::Number => {
                let cells = self.pieces::<Float64Array>(index).flat_map(Float64Array::iter);
                Ok(PyArray1::from_vec(py, cells.map(|cell| cell.unwrap_or(f64::NAN)).collect()).into_any())
            }
            Kind::Count if column.nullable => {
                let cells = self.pieces::<UInt32Array>(index).flat_map(UInt32Array::iter);
                Ok(PyArray1::from_vec(py, cells.map(|cell| cell.map_or(f64::NAN, f64::from)).collect()).into_any())
            }
            Kind::Count => {
                let cells = self.pieces::<UInt32Array>(index).flat_map(|piece| piece.values().iter().copied());
                Ok(PyArray1::from_vec(py, cells.collect()).into_any())
            }
            Kind::Flag => {
                let cells = self.pieces::<BooleanArray>(index).flat_map(BooleanArray::iter);
                Ok(PyArray1::from_vec(py, cells.map(|cell| cell.unwrap_or(false)).collect()).into_any())
            }
            Kind::Name | Kind::Text => {
                let cells = self.pieces::<StringArray>(index).flat_map(StringArray::iter);
                Ok(cells.collect::<Vec<Option<&str>>>().into_pyobject(py)?.into_any())
            }
        }
    }

    /// Its rows as a stream of Arrow's C data interface; no column is copied.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // A consumer that asks for other types converts: the interface leaves the request to the best effort of the producer.
        drop(requested_schema);
        let batches: Vec<Result<RecordBatch, ArrowError>> = self.batches.iter().cloned().map(Ok).collect();
        let stream = FFI_ArrowArrayStream::new(Box::new(RecordBatchIterator::new(batches, self.schema())));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    /// Its schema, by the same interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(&*self.schema()).map_err(|error| fault(&error.to_string()))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }
}

/// The figures that tables declare, as HTML with pictures in it; each figure has so many panels at most.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "what Python gives is owned")]
pub(crate) fn figures(py: Python<'_>, tables: Vec<Py<Table>>, panels: usize) -> PyResult<String> {
    let drawn = tables.iter().map(|table| (&table.get().spec, &table.get().batches[..]));
    py.detach(|| runout_figures::fragment(drawn, panels)).map_err(|error| exception(py, &Failure::Work(error)))
}

/// Form over the part's angle and z.
#[pyclass(frozen, get_all, module = "runout._native")]
pub(crate) struct Surface {
    /// Nominal radius, in mm.
    radius_mm: f64,
    /// Angles of the part, in degrees.
    angle_deg: Py<PyArray1<f64>>,
    /// Positions of the rings, in mm.
    z_mm: Py<PyArray1<f64>>,
    /// Deviation from the nominal radius in µm, `[ring, angle]`.
    deviation_um: Py<PyArray2<f64>>,
    /// How the rings were filled between the sections.
    interpolation: String,
}

/// The fields of a surface, as a pickle holds them.
type Fields = (f64, Py<PyArray1<f64>>, Py<PyArray1<f64>>, Py<PyArray2<f64>>, String);

#[pymethods]
impl Surface {
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Restored<'py, Fields>> {
        let (py, of) = (slf.py(), slf.get());
        let [angle_deg, z_mm] = [&of.angle_deg, &of.z_mm].map(|array| array.clone_ref(py));
        let fields = (of.radius_mm, angle_deg, z_mm, of.deviation_um.clone_ref(py), of.interpolation.clone());
        Ok((slf.get_type().getattr("_restored")?, fields))
    }

    #[staticmethod]
    fn _restored(
        radius_mm: f64,
        angle_deg: Py<PyArray1<f64>>,
        z_mm: Py<PyArray1<f64>>,
        deviation_um: Py<PyArray2<f64>>,
        interpolation: String,
    ) -> Self {
        Self { radius_mm, angle_deg, z_mm, deviation_um, interpolation }
    }
}

impl Surface {
    /// A surface, whose memory Python takes over.
    ///
    /// # Errors
    /// When the grid has not as many deviations as rings and angles say.
    pub(crate) fn new(py: Python<'_>, surface: surface::Surface) -> PyResult<Self> {
        let (rings, angles) = (surface.z_mm.len(), surface.angles);
        let angle_deg: Vec<f64> = (0..angles).map(|index| 360.0 * index as f64 / angles as f64).collect();
        let deviation_um = PyArray1::from_vec(py, surface.deviation_um).reshape([rings, angles])?;
        Ok(Self {
            radius_mm: surface.radius_mm,
            angle_deg: PyArray1::from_vec(py, angle_deg).unbind(),
            z_mm: PyArray1::from_vec(py, surface.z_mm).unbind(),
            deviation_um: deviation_um.unbind(),
            interpolation: surface.interpolation.to_owned(),
        })
    }
}
