"""Separators, preprocessors, effects, evaluators, loaders and exporters as programs: `serve(MySeparator())` makes one of a class.

    class Mine:
        def separate(self, station):
            form, x, y = ...                                    # arrays over station.orders, NaN where an order is lost
            return {("form", "a"): form, "x": x, "y": y}

    if __name__ == "__main__":
        runout.external.serve(Mine())

A pipeline names the script by `plugin = "external"`, `command = ["python3", "mine.py"]`. What the code raises ends the program with its traceback,
which the error of the run quotes. `print` writes to stderr, which is shown beside the progress. The same object is a plugin of
`runout.run(…, plugins=[Mine()])` without a process.
"""

from __future__ import annotations

import dataclasses
import io
import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO, Optional, Protocol, Union

import numpy as np
import numpy.typing as npt
import pyarrow as pa

VERSION = "1"

Quantity = Union[str, tuple[str, str]]
"""`("form", section)`, `"x"`, `"y"`, `"tilt_x"` or `"tilt_y"`."""
Harmonics = Mapping[Quantity, npt.ArrayLike]


@dataclasses.dataclass
class Station:
    """The averages of one station. Readings and motion are Re Σ c exp(−i·n·Φ), form is Re Σ c exp(+i·n·α); µm and µrad."""

    name: str
    z_mm: float
    turns: list[int]
    """Turns averaged, one number a setup."""
    rig: dict[str, Any]
    """`part_radius_mm`, `rotation`, `sensors` and `setups`."""
    config: dict[str, Any]
    """The keys of `config` in the pipeline."""
    setups: list[str]
    sensors: list[str]
    orders: npt.NDArray[np.int64]
    """From 0."""
    readings: npt.NDArray[np.complex128]
    """`[setup, order, sensor]`."""
    covariance: npt.NDArray[np.complex128] | None
    """Of the averages, E[δ_a δ_b*], `[setup, order, sensor, sensor]`; None below two turns."""
    warnings: list[str] = dataclasses.field(default_factory=list)
    """Texts appended here become warnings of the result."""


@dataclasses.dataclass
class Average:
    """The average over the turns of one capture: readings are Re Σ c exp(−i·n·Φ), µm."""

    capture: str
    """Where it is from, for messages."""
    setup: str
    turns: int
    """Turns averaged."""
    speed_rpm: float | None
    sample_rate_hz: float | None
    rig: dict[str, Any]
    """`part_radius_mm`, `rotation`, `sensors` and `setups`."""
    config: dict[str, Any]
    """The keys of `config` in the pipeline."""
    sensors: list[str]
    orders: npt.NDArray[np.int64]
    """From 0."""
    readings: npt.NDArray[np.complex128]
    """`[order, sensor]`."""
    warnings: list[str] = dataclasses.field(default_factory=list)
    """Texts appended here become warnings of the result."""


@dataclasses.dataclass(frozen=True)
class Value:
    """A value; `std` is None where no uncertainty is known."""

    symbol: str
    value: float | None
    std: float | None
    unit: str
    of: str | None = None
    about: str | None = None


@dataclasses.dataclass(frozen=True)
class Column:
    """A column that a separator takes of measured points."""

    name: str
    unit: str
    kind: str
    """`number`, `flag` (0 or 1), `label`, `trace` or `trace-kind` (texts)."""
    about: str
    optional: bool


class TurnSeparator(Protocol):
    """Form and motion of one station."""

    def separate(self, station: Station) -> Harmonics | tuple[Harmonics, Harmonics]:
        """An array over `station.orders` of each quantity, NaN where an order is lost; and the same of standard deviations √E|δ|², where they
        are known."""


class Preprocessor(Protocol):
    """A change of averages, behind `synchronous-average`."""

    def preprocess(self, average: Average) -> npt.ArrayLike | tuple[npt.ArrayLike, npt.ArrayLike]:
        """The readings as they are taken from now on, `[order, sensor]`, all of them finite; and by what errors of each are multiplied, where that is
        not 1: a factor that a reading is multiplied by belongs here, what is subtracted does not."""


class PointSeparator(Protocol):
    """Values of measured points. As a plugin of a call it has `columns`, names of columns of numbers that it takes, and may have `labels`, those of
    texts, and `symbols`, pairs of symbol and unit that limits may name."""

    def values(
        self, points: dict[str, npt.NDArray[Any]], config: dict[str, Any]
    ) -> Sequence[Value] | tuple[Sequence[Value], npt.ArrayLike]:
        """The values; and what the fit leaves of each point, in µm, where that is known."""


class Effect(Protocol):
    """A linear change of one channel, as `runout.plugins.Effect`."""

    def transfer(self, orders: npt.NDArray[np.int64], *values: float) -> npt.ArrayLike:
        """Reading over displacement at each of `orders` (from 0), never 0; 1 where all values are 0."""


class PointEffect(Protocol):
    """Something that adds to readings at measured points, in proportion to each of its parameters. As a plugin of a call it has `name`, `parameters`
    (name, unit, usual size), `columns` and perhaps `labels`, as a separator of points has them."""

    def change(self, points: dict[str, npt.NDArray[Any]], config: dict[str, Any]) -> Mapping[str, Mapping[str, npt.ArrayLike]]:
        """What one unit of each parameter adds, by its name: an array over the points for each column of readings that it changes."""


class Evaluator(Protocol):
    """Values of a result. As a plugin of a call it has `symbols`, pairs of symbol and unit."""

    def evaluate(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> Sequence[Value]:
        """The values, from all tables of the result by name, that of the standards' values among them."""


class Loader(Protocol):
    """Measured points of a file."""

    def load(self, path: str, columns: Sequence[Column], config: dict[str, Any]) -> Mapping[str, npt.ArrayLike]:
        """The columns by name, one entry a point: those asked for that are not optional, and others of them where the file has them."""


@dataclasses.dataclass(frozen=True)
class Captured:
    """One station in one setup of a recording."""

    station: str
    setup: str
    samples: int
    """Samples of each sensor."""
    marks: npt.ArrayLike
    """Ascending sample positions (fractional) at which a turn begins."""
    z_mm: float = 0.0
    """Carriage position, the same in all setups of a station."""
    sample_rate_hz: float | None = None
    speed_rpm: float | None = None


class Recordings(Protocol):
    """Recorded turns of a file."""

    def captures(self, path: str, rig: dict[str, Any], config: dict[str, Any]) -> Sequence[Captured]:
        """Each station in each setup."""

    def samples(self, station: str, setup: str, first: int, count: int) -> npt.ArrayLike:
        """So many samples from one on, `[sample, sensor]` with the sensors of the rig in their order, as the instrument reads them (their `sign` is
        applied to them); NaN where one is not known. Blocks of several captures may be asked for in turns."""


class Exporter(Protocol):
    """Files of a result."""

    def export(self, tables: dict[str, pa.Table], summary: dict[str, Any], files: dict[str, str], config: dict[str, Any]) -> None:
        """Writes each of `files` (name and path to write to); `summary` is that of `summary.json`."""


Served = Union[TurnSeparator, Preprocessor, PointSeparator, Effect, PointEffect, Evaluator, Loader, Recordings, Exporter]

_METHODS = {
    "separate-turns": "separate",
    "separate-points": "values",
    "preprocess": "preprocess",
    "transfer": "transfer",
    "change": "change",
    "evaluate": "evaluate",
    "load-points": "load",
    "load-samples": "captures",
    "export": "export",
}
"""The method that a stage asks for."""


def serve(plugin: Served, stdin: Optional[BinaryIO] = None, stdout: Optional[BinaryIO] = None) -> None:
    """Answers requests on stdin until it ends. Started from a terminal, which sends none, it ends and says how it is tried."""
    if stdin is None and sys.stdin.isatty():
        raise SystemExit(f"runout starts this program and sends it tables: try it by `runout plugins test -- python3 {sys.argv[0]}`")
    source, sink = stdin or sys.stdin.buffer, stdout or sys.stdout.buffer
    before, sys.stdout = sys.stdout, sys.stderr
    try:
        answering = Answering(plugin)
        while (request := _request(source)) is not None:
            sink.write(answering.of(request))
            sink.flush()
    finally:
        sys.stdout = before


class Answering:
    """Answers the requests of a run by an object. It keeps the tables of a result until all of them are there."""

    def __init__(self, plugin: Any) -> None:
        self._plugin = plugin
        self._given: dict[str, list[pa.Table]] = {}
        self._about: dict[str, str] = {}

    def answer(self, request: bytes) -> bytes:
        """The bytes of the answer to those of a request."""
        frames = _request(io.BytesIO(request))
        return b"" if frames is None else self.of(frames)

    def of(self, request: dict[str, Any]) -> bytes:
        """The bytes of the answer to a request, by the names of its frames."""
        return b"".join(self._frames(request)) + b"end 0\n"

    def _frames(self, tables: dict[str, Any]) -> list[bytes]:
        if "summary" in tables:
            return self._complete(tables["summary"])
        self._about = about = _about(next(iter(tables.values())))
        if about["protocol"] != VERSION:
            raise ValueError(f"expected version {VERSION} of the protocol, found {about['protocol']}")
        method = _METHODS.get(about["stage"], "")
        if not hasattr(self._plugin, method):
            kind = type(self._plugin).__name__
            raise TypeError(f"{kind} is asked for {about['stage']}: expected a class with the method `{method}`")
        if method in ("export", "evaluate"):
            for name, table in tables.items():
                self._given.setdefault(name, []).append(table)
            return []
        frames: list[bytes] = getattr(self, f"_{method}")(tables, json.loads(about["config"]))
        return frames

    def _complete(self, summary: dict[str, Any]) -> list[bytes]:
        """The answer to the last request of an evaluator or an exporter."""
        given, self._given = self._given, {}
        config = json.loads(self._about["config"])
        (first,) = given.pop("symbols" if self._about["stage"] == "evaluate" else "files")
        tables = {name: pa.concat_tables(parts) for name, parts in given.items()}
        if self._about["stage"] == "evaluate":
            return [_frame("values", _values(self._plugin.evaluate(tables, config)))]
        paths = dict(zip(first["name"].to_pylist(), first["path"].to_pylist()))
        self._plugin.export(tables, summary, paths, config)
        return []

    def _separate(self, tables: dict[str, pa.Table], _: dict[str, Any]) -> list[bytes]:
        station = station_of(tables)
        found = self._plugin.separate(station)
        values, std = found if isinstance(found, tuple) else (found, {})
        return [_frame("harmonics", harmonics(station, values, std)), *(_text("warning", text) for text in station.warnings)]

    def _values(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> list[bytes]:
        found = self._plugin.values(_points(tables), config)
        values, left = found if isinstance(found, tuple) else (found, None)
        frames = [_frame("values", _values(values))]
        if left is not None:
            left = np.asarray(left, float)
            frames.append(_frame("residual", pa.table({"row": np.arange(len(left)), "residual_um": pa.array(left, mask=np.isnan(left))})))
        return frames

    def _preprocess(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> list[bytes]:
        given, about = tables["profile"], json.loads(self._about["capture"])
        orders = int(given["order"].to_numpy().max()) + 1
        sensors = given["sensor"][: len(given) // orders].to_pylist()
        readings = _complex(given).reshape(orders, len(sensors))
        average = Average(
            **about, rig=json.loads(self._about["rig"]), config=config, sensors=sensors, orders=np.arange(orders), readings=readings
        )
        found = self._plugin.preprocess(average)
        new, gain = found if isinstance(found, tuple) else (found, None)
        columns = {"sensor": given["sensor"], "order": given["order"]}
        for prefix, array in (("", new), ("gain_", gain)):
            if array is None:
                continue
            array = np.asarray(array, np.complex128)
            if array.shape != readings.shape:
                raise ValueError(f"preprocess: expected the shape {readings.shape}, [order, sensor], found {array.shape}")
            columns |= {f"{prefix}re": array.real.ravel(), f"{prefix}im": array.imag.ravel()}
        return [_frame("profile", pa.table(columns)), *(_text("warning", text) for text in average.warnings)]

    def _transfer(self, tables: dict[str, pa.Table], _: dict[str, Any]) -> list[bytes]:
        orders = tables["orders"]["order"].to_numpy().astype(np.int64)
        found = np.asarray(self._plugin.transfer(orders, *json.loads(self._about["values"]).values()), np.complex128)
        if found.shape != orders.shape:
            raise ValueError(f"transfer: expected one number an order, {len(orders)}, found the shape {found.shape}")
        return [_frame("transfer", pa.table({"order": orders, "re": found.real, "im": found.imag}))]

    def _change(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> list[bytes]:
        points = _points(tables)
        count = tables["points"].num_rows
        found = {parameter: {name: np.asarray(of, float) for name, of in by.items()} for parameter, by in self._plugin.change(points, config).items()}
        names = dict.fromkeys(name for by in found.values() for name in by)
        columns = {name: [by.get(name, np.zeros(count)) for by in found.values()] for name in names}
        for name, parts in columns.items():
            for part in parts:
                if part.shape != (count,):
                    raise ValueError(f"change: expected one number a point, {count}, of `{name}`, found the shape {part.shape}")
        table = {"parameter": [parameter for parameter in found for _ in range(count)], "row": np.tile(np.arange(count), len(found))}
        return [_frame("change", pa.table(table | {name: np.concatenate(parts) for name, parts in columns.items()}))]

    def _load(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> list[bytes]:
        wanted = [Column(**row) for row in tables["columns"].to_pylist()]
        found = self._plugin.load(self._about["path"], wanted, config)
        return [_frame("points", pa.table({name: np.asarray(column) for name, column in found.items()}))]

    def _captures(self, tables: dict[str, pa.Table], config: dict[str, Any]) -> list[bytes]:
        sensors = [sensor["id"] for sensor in json.loads(self._about["rig"])["sensors"]]
        if "block" in tables:
            (block,) = tables["block"].to_pylist()
            read = np.asarray(self._plugin.samples(block["station"], block["setup"], block["first"], block["count"]), float)
            if read.shape != (block["count"], len(sensors)):
                raise ValueError(f"samples: expected the shape {(block['count'], len(sensors))}, found {read.shape}")
            columns = {name: np.ascontiguousarray(read[:, channel]) for channel, name in enumerate(sensors)}
            return [_frame("samples", pa.table({name: pa.array(of, mask=np.isnan(of)) for name, of in columns.items()}))]
        found = list(self._plugin.captures(self._about["path"], json.loads(self._about["rig"]), config))
        rows = [{field.name: getattr(one, field.name) for field in dataclasses.fields(Captured)} for one in found]
        marks = [np.asarray(row.pop("marks"), float) for row in rows]
        counts = [len(of) for of in marks]
        places = {name: np.repeat([row[name] for row in rows], counts).tolist() for name in ("station", "setup")}
        at = np.concatenate([*marks, np.empty(0)])
        return [
            _frame("captures", pa.Table.from_pylist(rows, schema=_CAPTURES)),
            _frame("marks", pa.table({**places, "at": at}, schema=_MARKS)),
        ]


def _points(tables: dict[str, pa.Table]) -> dict[str, npt.NDArray[Any]]:
    return {name: tables["points"][name].to_numpy() for name in tables["points"].column_names}


def _request(source: BinaryIO) -> dict[str, Any] | None:
    tables: dict[str, Any] = {}
    while line := source.readline():
        name, size = line.decode().split()
        if name == "end":
            return tables
        body = source.read(int(size))
        tables[name] = json.loads(body) if name == "summary" else pa.ipc.open_stream(body).read_all()
    return None


def _values(values: Sequence[Value]) -> pa.Table:
    columns = {field.name: [getattr(value, field.name) for value in values] for field in dataclasses.fields(Value)}
    return pa.table(columns, schema=_VALUES)


_NUMBERS = ("z_mm", "sample_rate_hz", "speed_rpm")
_CAPTURES = pa.schema([
    (field.name, pa.float64() if field.name in _NUMBERS else pa.int64() if field.name == "samples" else pa.string())
    for field in dataclasses.fields(Captured)
    if field.name != "marks"
])
_MARKS = pa.schema([("station", pa.string()), ("setup", pa.string()), ("at", pa.float64())])
_VALUES = pa.schema([(name, pa.float64() if name in ("value", "std") else pa.string()) for name in (f.name for f in dataclasses.fields(Value))])


def station_of(tables: dict[str, pa.Table]) -> Station:
    """A request as arrays."""
    profiles, covariance = tables["profiles"], tables["covariance"]
    about = _about(profiles)
    place, rig = json.loads(about["station"]), json.loads(about["rig"])
    setups = list(dict.fromkeys(profiles["setup"].to_pylist()))
    orders = int(profiles["order"].to_numpy().max()) + 1
    shape = (len(setups), orders, len(profiles) // (len(setups) * orders))
    return Station(
        name=place["station"],
        z_mm=place["z_mm"],
        turns=place["turns"],
        rig=rig,
        config=json.loads(about["config"]),
        setups=setups,
        sensors=profiles["sensor"][: shape[2]].to_pylist(),
        orders=np.arange(orders),
        readings=_complex(profiles).reshape(shape),
        covariance=_complex(covariance).reshape(*shape, shape[2]) if len(covariance) else None,
    )


def harmonics(station: Station, values: Harmonics, std: Harmonics) -> pa.Table:
    """What a separator found as the table of an answer. ValueError where an array has another length than `station.orders`."""
    columns: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in ("quantity", "section", "order", "re", "im", "std")}
    for key, found in values.items():
        quantity, section = key if isinstance(key, tuple) else (key, None)
        found, deviation = (np.asarray(array) for array in (found, std.get(key, np.full(len(station.orders), np.nan))))
        for array in (found, deviation):
            if array.shape != station.orders.shape:
                raise ValueError(f"{key}: expected one number an order, {len(station.orders)}, found the shape {array.shape}")
        count = len(station.orders)
        parts = (np.full(count, quantity), np.full(count, section), station.orders, found.real, found.imag, deviation)
        for name, part in zip(columns, parts):
            columns[name].append(part)
    joined = {name: np.concatenate(parts) if parts else np.array([]) for name, parts in columns.items()}
    lost = np.isnan(joined["re"].astype(float)) | np.isnan(joined["im"].astype(float))
    table = {
        "station": pa.array([station.name] * len(lost), pa.string()),
        "quantity": pa.array(joined["quantity"].tolist(), pa.string()),
        "section": pa.array(joined["section"].tolist(), pa.string()),
        "order": pa.array(joined["order"].astype(np.int64)),
    }
    for name in ("re", "im", "std"):
        cells = joined[name].astype(float)
        table[name] = pa.array(cells, mask=lost | np.isnan(cells))
    return pa.table(table)


def _complex(table: pa.Table) -> npt.NDArray[np.complex128]:
    return np.asarray(table["re"].to_numpy() + 1j * table["im"].to_numpy(), dtype=np.complex128)


def _about(table: pa.Table) -> dict[str, str]:
    metadata = table.schema.metadata or {}
    return {key.decode().removeprefix("runout."): value.decode() for key, value in metadata.items() if key.startswith(b"runout.")}


def _frame(name: str, table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    return _body(name, sink.getvalue().to_pybytes())


def _text(name: str, text: str) -> bytes:
    return _body(name, text.encode())


def _body(name: str, body: bytes) -> bytes:
    return f"{name} {len(body)}\n".encode() + body
