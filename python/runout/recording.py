"""Recordings from arrays."""

from __future__ import annotations

import csv
import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _native

Array = npt.ArrayLike


@dataclasses.dataclass(frozen=True)
class Capture:
    """One station in one setup: `runout.Capture(samples, angle_deg=angle)` or `runout.Capture(samples, marks=marks)`.

    `samples` are in µm, `[sample, channel]`. Turns are known by `marks`, the (fractional) sample positions at which they begin, or
    by `angle_deg`, the spindle angle of each sample, which may begin anew each turn. `sensors` names the channels; without it they are the rig's
    sensors in their order.
    """

    samples: Array
    _: dataclasses.KW_ONLY
    marks: Array | None = None
    angle_deg: Array | None = None
    sensors: Sequence[str] | None = None
    sample_rate_hz: float | None = None
    speed_rpm: float | None = None


Captures = Mapping[str, Mapping[str, Union[Capture, tuple[Array, Array]]]]


@dataclasses.dataclass(frozen=True)
class Station:
    """A station with its captures by the id of the setup."""

    name: str
    z_mm: float
    captures: dict[str, _native.Capture]


@dataclasses.dataclass(frozen=True)
class Recording:
    """Recorded turns in memory. It holds the arrays: they live as long as it does."""

    stations: list[Station]

    @classmethod
    def from_arrays(
        cls,
        captures: Captures,
        *,
        sample_rate_hz: float | None = None,
        sensors: Sequence[str] | None = None,
        z_mm: Mapping[str, float] | None = None,
        speed_rpm: float | None = None,
    ) -> Recording:
        """A recording from `{setup: {station: (samples, marks)}}`, or a `Capture` in place of the pair.

        Samples of float64 whose rows are contiguous are read where they lie; others are converted once. Do not write to the arrays
        while a run reads them. `z_mm` gives the carriage position of each station (0 without it); the other arguments
        hold for all captures that do not say otherwise. Stations keep the order of the first setup.

        Raises TypeError for arrays of another kind than numbers, and ValueError for shapes, marks and angles that cannot be.
        """
        if not isinstance(captures, Mapping) or not captures:
            raise ValueError("expected a dictionary {setup: {station: (samples, marks)}} with at least one setup")
        places = dict(z_mm or {})
        stations: dict[str, Station] = {}
        for setup, of_setup in captures.items():
            if not isinstance(of_setup, Mapping) or not of_setup:
                raise ValueError(f"{setup}: expected a dictionary {{station: (samples, marks)}} with at least one station")
            for name, capture in of_setup.items():
                place = f"{setup}/{name}"
                made = _capture(capture, place, sensors, sample_rate_hz, speed_rpm)
                at = stations.setdefault(name, Station(name, float(places.pop(name, 0.0)), {}))
                at.captures[setup] = made
        if places:
            raise ValueError(f"z_mm names stations that are not in the captures: {', '.join(map(repr, places))}")
        if not all(np.isfinite(station.z_mm) for station in stations.values()):
            raise ValueError("expected finite positions in z_mm")
        return cls(list(stations.values()))


@dataclasses.dataclass(frozen=True)
class Points:
    """Measured points in memory, for a separator of points: columns with the names and units that `points` reads from a file."""

    columns: dict[str, list[Any]]

    @classmethod
    def from_arrays(cls, columns: Mapping[str, Array] | None = None, **more: Array) -> Points:
        """Points of columns of one length: `Points.from_arrays(angle_deg=a, x_um=x)`, or a dictionary or frame of them.

        Numbers that are NaN, None or masked were not measured, which a separator may allow of a component; texts are names. Raises ValueError where the lengths differ.
        """
        given = {} if columns is None else {str(name): columns[name] for name in columns}
        given |= more
        if not given:
            raise ValueError("expected columns of points, found none")
        found = {name: _column(of, name) for name, of in given.items()}
        lengths = {name: len(of) for name, of in found.items()}
        if len(set(lengths.values())) != 1:
            raise ValueError(f"expected columns of one length, found {lengths}")
        return cls(found)

    def write(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes them as CSV, without loss: a number that was not measured is an empty cell."""
        with open(path, "w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(self.columns)
            rows.writerows(zip(*self.columns.values()))


def _column(given: Array, name: str) -> list[Any]:
    if isinstance(given, np.ma.MaskedArray):
        masked: Any = given
        given = masked.astype(np.float64).filled(np.nan) if masked.dtype.kind in "fiu" else masked.filled(None)
    array = np.asarray(given)
    if array.ndim != 1 or not len(array):
        raise ValueError(f"{name}: expected a column of at least one value, found the shape {array.shape}")
    if array.dtype.kind in "fiu":
        return ["" if value != value else repr(value) for value in array.tolist()]
    if array.dtype.kind in "OUT" and all(value is None or isinstance(value, (str, float, int)) for value in array):
        return ["" if value is None or value != value else str(value) for value in array.tolist()]
    raise TypeError(f"{name}: expected numbers or texts, found {array.dtype}")


def _capture(
    given: Any, place: str, sensors: Sequence[str] | None, sample_rate_hz: float | None, speed_rpm: float | None
) -> _native.Capture:
    if not isinstance(given, Capture):
        if not (isinstance(given, (tuple, list)) and len(given) == 2):
            raise TypeError(f"{place}: expected (samples, marks) or a Capture, found {type(given).__name__}")
        given = Capture(samples=given[0], marks=given[1])
    samples = _numbers(given.samples, place, "samples", (1, 2))
    if samples.ndim == 1:
        samples = samples.reshape(-1, 1)
    marks = None if given.marks is None else _numbers(given.marks, place, "marks", (1,))
    angle = None if given.angle_deg is None else _unwrapped(_numbers(given.angle_deg, place, "angle_deg", (1,)))
    named = sensors if given.sensors is None else given.sensors
    if isinstance(named, str):
        raise TypeError(f"{place}: expected a list of sensor ids, found a string")
    try:
        return _native.Capture(
            samples,
            marks,
            angle,
            None if named is None else list(named),
            sample_rate_hz if given.sample_rate_hz is None else given.sample_rate_hz,
            speed_rpm if given.speed_rpm is None else given.speed_rpm,
        )
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _unwrapped(angle_deg: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The angle itself where it goes on over the turns; unwrapped where it begins anew each turn."""
    wrapped = angle_deg.size > 1 and np.ptp(angle_deg) <= 360 and np.abs(np.diff(angle_deg)).max() > 180
    return np.unwrap(angle_deg, period=360.0) if wrapped else angle_deg


def _numbers(given: Array, place: str, name: str, dimensions: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """The array itself where it is contiguous float64, else a converted copy."""
    array = np.asarray(given)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{place}: expected {name} of real numbers, found {array.dtype}")
    if array.ndim not in dimensions:
        wanted = " or ".join(str(count) for count in dimensions)
        raise ValueError(f"{place}: expected {name} with {wanted} dimension(s), found the shape {array.shape}")
    return np.require(array, np.float64, ["C_CONTIGUOUS", "ALIGNED"])
