"""Results: tables for every library, surfaces and coefficients as arrays, values with units."""

from __future__ import annotations

import numpy as np
import pytest

import runout

from conftest import pipeline


@pytest.fixture(scope="module")
def result(arrays: runout.Recording) -> runout.Result:
    return runout.run(pipeline(), arrays, surface=True)


def test_every_library_takes_every_table(result: runout.Result) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    polars = pytest.importorskip("polars")
    pandas = pytest.importorskip("pandas")
    duckdb = pytest.importorskip("duckdb")
    assert {"form", "motion", "harmonics", "values"} <= set(result.tables)
    for table in result.tables.values():
        arrow = pyarrow.table(table)
        assert arrow.num_rows == len(table) and arrow.column_names == [name for name, _, _ in table.columns]
        for name, unit, about in table.columns:
            metadata = arrow.schema.field(name).metadata or {}
            assert metadata.get(b"unit", b"").decode() == unit and about
        assert polars.DataFrame(table).shape == arrow.shape
        assert pandas.DataFrame.from_arrow(table).shape == arrow.shape if hasattr(pandas.DataFrame, "from_arrow") else True
        reader = pyarrow.RecordBatchReader.from_stream(table)
        assert duckdb.sql("select count(*) from reader").fetchall() == [(len(table),)]


def test_columns_are_arrays_and_the_stream_shares_them(result: runout.Result) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    form = result.tables["form"]
    assert np.array_equal(form["form_um"], pyarrow.table(form)["form_um"].to_numpy())
    first, second = (pyarrow.table(form)["form_um"].chunk(0).buffers()[1].address for _ in range(2))
    assert first == second, "two streams of one table share its memory"
    with pytest.raises(KeyError, match="did you mean `form_um`"):
        form["form"]


def test_a_stream_outlives_its_table(arrays: runout.Recording) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    form = pyarrow.table(runout.run(pipeline(), arrays).tables["form"])
    assert np.isfinite(form["form_um"].to_numpy()).all()


def test_an_unused_stream_is_released(result: runout.Result) -> None:
    for _ in range(100):
        result.tables["form"].__arrow_c_stream__()
        result.tables["form"].__arrow_c_schema__()


def test_surface_and_coefficients_are_arrays(result: runout.Result) -> None:
    surface = result.surface
    assert surface is not None
    assert surface.deviation_um.shape == (surface.z_mm.size, surface.angle_deg.size) == (6, 720)
    coefficients, std = result.coefficients("form", section="a", station=result.summary["stations"][0]["station"])
    assert coefficients.dtype == complex and np.isfinite(coefficients[2:20]).all() and (std[2:20] > 0).all()
    form = result.tables["form"]
    rows = (np.array(form["section"]) == "a") & (np.array(form["station"]) == result.summary["stations"][0]["station"])
    angle = np.radians(form["angle_deg"][rows])
    orders = np.arange(coefficients.size)[:, None]
    rebuilt = np.nansum((coefficients[:, None] * np.exp(1j * orders * angle)).real[2:], axis=0)
    assert np.abs(rebuilt - (form["form_um"][rows] - form["form_um"][rows].mean())).max() < 20
    with pytest.raises(LookupError, match="say which"):
        result.coefficients("form")


def test_values_have_units_and_places(result: runout.Result) -> None:
    station = result.summary["stations"][0]["station"]
    value = result.value("RONt", section="a", station=station, reference="LSCI", filter="none")
    assert value.unit == "um" and value.std and value.interval_95
    assert value.interval_95[0] <= value.value <= value.interval_95[1]
    assert "RONt" in str(value) and float(value) == value.value
    with pytest.raises(LookupError):
        result.value("RONt")
    with pytest.raises(LookupError):
        result.value("nothing")


def test_it_prints_in_one_line(result: runout.Result) -> None:
    line = repr(result)
    assert line.startswith("<runout.Result 'Turned shaft': 3 stations, ") and "tables form, " in line and "\n" not in line


def test_a_notebook_shows_it(result: runout.Result) -> None:
    page = result._repr_html_()
    assert page.count("<img") >= 2 and "data:image/svg+xml;base64," in page
    assert "<table>" in page and "RONt" in page and "Turned shaft" in page
    assert "<b>" not in runout.Result('{"title": "<b>", "warnings": [], "stations": [], "values": []}', [], None)._repr_html_()
