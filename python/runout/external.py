"""Separators of turns and of points and exporters as programs: `serve(MySeparator())` makes one of a class.

    class Mine:
        def separate(self, station):
            form, x, y = ...                                    # arrays over station.orders, NaN where an order is lost
            return {("form", "a"): form, "x": x, "y": y}

    if __name__ == "__main__":
        runout.external.serve(Mine())

A pipeline names the script by `plugin = "external"`, `command = ["python3", "mine.py"]`. What the code raises ends the program with its traceback,
which the error of the run quotes. `print` writes to stderr, which is shown beside the progress.
"""

from __future__ import annotations

import dataclasses
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


@dataclasses.dataclass(frozen=True)
class Value:
    """A value of measured points; `std` is None where no uncertainty is known."""

    symbol: str
    value: float | None
    std: float | None
    unit: str
    of: str | None = None
    about: str | None = None


class TurnSeparator(Protocol):
    """Form and motion of one station."""

    def separate(self, station: Station) -> Harmonics | tuple[Harmonics, Harmonics]:
        """An array over `station.orders` of each quantity, NaN where an order is lost; and the same of standard deviations √E|δ|², where they
        are known."""


class PointSeparator(Protocol):
    """Values of measured points."""

    def values(
        self, points: dict[str, npt.NDArray[Any]], config: dict[str, Any]
    ) -> Sequence[Value] | tuple[Sequence[Value], npt.ArrayLike]:
        """The values; and what the fit leaves of each point, in µm, where that is known."""


class Exporter(Protocol):
    """Files of a result."""

    def export(self, tables: dict[str, pa.Table], summary: dict[str, Any], files: dict[str, str], config: dict[str, Any]) -> None:
        """Writes each of `files` (name and path to write to); `summary` is that of `summary.json`."""


def serve(separator: TurnSeparator | PointSeparator | Exporter, stdin: Optional[BinaryIO] = None, stdout: Optional[BinaryIO] = None) -> None:
    """Answers requests on stdin until it ends. Started from a terminal, which sends none, it ends and says how it is tried."""
    if stdin is None and sys.stdin.isatty():
        raise SystemExit(f"runout starts this program and sends it tables: try it by `runout plugins test -- python3 {sys.argv[0]}`")
    source, sink = stdin or sys.stdin.buffer, stdout or sys.stdout.buffer
    before, sys.stdout = sys.stdout, sys.stderr
    try:
        given: dict[str, list[pa.Table]] = {}
        while (tables := _request(source)) is not None:
            frames = _export(separator, tables, given) if given or "files" in tables else _answer(separator, tables)
            sink.write(b"".join(frames) + b"end 0\n")
            sink.flush()
    finally:
        sys.stdout = before


def _request(source: BinaryIO) -> dict[str, Any] | None:
    tables: dict[str, Any] = {}
    while line := source.readline():
        name, size = line.decode().split()
        if name == "end":
            return tables
        body = source.read(int(size))
        tables[name] = json.loads(body) if name == "summary" else pa.ipc.open_stream(body).read_all()
    return None


def _export(exporter: Any, tables: dict[str, Any], given: dict[str, list[pa.Table]]) -> list[bytes]:
    """Keeps the tables of a result, and has them written when the summary comes."""
    if not hasattr(exporter, "export"):
        raise TypeError(f"{type(exporter).__name__} is asked for export: expected a class with the method `export`")
    if "summary" not in tables:
        for name, table in tables.items():
            given.setdefault(name, []).append(table)
        return []
    files = given.pop("files")[0]
    paths = dict(zip(files["name"].to_pylist(), files["path"].to_pylist()))
    config = json.loads(_about(files)["config"])
    exporter.export({name: pa.concat_tables(parts) for name, parts in given.items()}, tables["summary"], paths, config)
    return []


def _answer(separator: Any, tables: dict[str, pa.Table]) -> list[bytes]:
    about = _about(next(iter(tables.values())))
    stage = about["stage"]
    if about["protocol"] != VERSION:
        raise ValueError(f"expected version {VERSION} of the protocol, found {about['protocol']}")
    if stage == "separate-turns" and hasattr(separator, "separate"):
        station = station_of(tables)
        found = separator.separate(station)
        values, std = found if isinstance(found, tuple) else (found, {})
        return [_frame("harmonics", harmonics(station, values, std)), *(_text("warning", text) for text in station.warnings)]
    if stage == "separate-points" and hasattr(separator, "values"):
        points = {name: tables["points"][name].to_numpy() for name in tables["points"].column_names}
        found = separator.values(points, json.loads(about["config"]))
        values, left = found if isinstance(found, tuple) else (found, None)
        columns = {field.name: [getattr(value, field.name) for value in values] for field in dataclasses.fields(Value)}
        frames = [_frame("values", pa.table(columns, schema=_VALUES))]
        if left is not None:
            left = np.asarray(left, float)
            frames.append(_frame("residual", pa.table({"row": np.arange(len(left)), "residual_um": pa.array(left, mask=np.isnan(left))})))
        return frames
    method = {"separate-turns": "separate", "separate-points": "values"}.get(stage)
    raise TypeError(f"{type(separator).__name__} is asked for {stage}: expected a class with the method `{method}`")


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
