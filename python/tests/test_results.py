"""Results: tables for every library, surfaces and coefficients as arrays, values with units."""

from __future__ import annotations

import json
import pickle

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


def test_tables_become_frames(result: runout.Result) -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    form = result.tables["form"]
    frame = form.to_pandas()
    assert list(frame.columns) == [name for name, _, _ in form.columns] and len(frame) == len(form)
    assert frame.attrs["units"]["form_um"] == "um"
    assert np.array_equal(frame["form_um"], form.to_polars()["form_um"].to_numpy(), equal_nan=True)
    assert isinstance(frame, pandas.DataFrame) and isinstance(form.to_polars(), polars.DataFrame)


def test_values_are_a_frame(result: runout.Result) -> None:
    pytest.importorskip("pandas")
    frame = runout.values(result, symbol="RONt", reference="LSCI", filter="none")
    assert len(frame) == 6 and set(frame["section"]) == {"a", "b"} and (frame["std"] > 0).all()
    first = frame.iloc[0]
    assert first["value"] == result.value("RONt", section=first["section"], station=first["station"], reference="LSCI", filter="none").value
    assert len(runout.values(result)) == len(result.values)


def test_a_value_that_is_not_one_says_what_sets_them_apart(result: runout.Result) -> None:
    with pytest.raises(LookupError, match="say which .*filter.*reference.*section.*station"):
        result.value("RONt")
    with pytest.raises(LookupError, match="no value is `RONt` .*there is RONt .LSCI"):
        result.value("RONt", section="c")


def test_results_travel_between_processes(result: runout.Result) -> None:
    same = pickle.loads(pickle.dumps(result))
    assert same.summary == result.summary and list(same.tables) == list(result.tables)
    for name, table in result.tables.items():
        assert same.tables[name].columns == table.columns and same.tables[name].drawings == table.drawings
        assert same.tables[name].to_polars().equals(table.to_polars())
    assert same.surface is not None and np.array_equal(same.surface.deviation_um, result.surface.deviation_um)
    assert "RONt" in same._repr_html_()


def test_tables_are_drawn(result: runout.Result) -> None:
    station = result.summary["stations"][0]["station"]
    pytest.importorskip("matplotlib")
    figure = result.plot("form", section="a", station=station)
    (axes,) = figure.axes
    form = result.tables["form"]
    rows = (np.array(form["section"]) == "a") & (np.array(form["station"]) == station)
    (line,) = (one for one in axes.lines if len(one.get_ydata()) == rows.sum())
    assert axes.name == "polar" and np.array_equal(line.get_ydata(), form["form_um"][rows]) and "µm" in axes.get_ylabel()
    for name in result.tables:
        if json.loads(result.tables[name].drawings):
            assert result.plot(name).axes
    with pytest.raises(LookupError, match="there is form"):
        result.plot("nothing")
    with pytest.raises(LookupError, match="no rows"):
        result.plot("form", section="c")
