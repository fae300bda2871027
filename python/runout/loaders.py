"""From files to recordings or points.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hdf5:
    """A measurement file: setups and stations with their samples, read in blocks"""

    plugin: ClassVar[str] = "hdf5"

    follow_links: Union[bool, None] = None
    """Follows external links, virtual data sets and data in other files, all of which are then inputs with a checksum; by default
    they are refused. Default: false."""

    marker: Union[Mapping[str, Any], None] = None
    """The once-per-turn mark as an analogue trace, instead of a dataset `index`: a channel of the samples, or a dataset of the
    station. A turn begins where it crosses a threshold, between two samples."""

    path: str
    """The file, relative to the TOML."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class HeightMap:
    """Heights of a surface on a grid, or a profile: X3P, SDF, SUR, HDF5, text"""

    plugin: ClassVar[str] = "height-map"

    follow_links: Union[bool, None] = None
    """HDF5: follows external links, virtual data sets and data in other files, all of which are then inputs. Default: false."""

    layer: Union[str, None] = None
    """Name or number, from 1, of the map in a file of several; without it the first one."""

    path: str
    """File with heights on a grid, or a profile, relative to the TOML: X3P (ISO 25178-72), SDF (ISO 25178-71), SUR (Digital Surf),
    HDF5 (runout-surface, version 1), or text (`x y z`, or a row of heights a line). Its first bytes decide."""

    step_x_mm: Union[float, None] = None
    """Distance of the columns of a matrix as text that does not give it, in mm."""

    step_y_mm: Union[float, None] = None
    """Distance of its rows, in mm; without it that of its columns."""

    unit: Union[str, None] = None
    """Unit of the heights of a file that names none; of text also that of its coordinates: m, mm, um, nm, in, mil."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Csv:
    """Text files of columns, one a setup and station; comma, semicolon or tab"""

    plugin: ClassVar[str] = "csv"

    files: Union[Sequence[Mapping[str, Any]], None] = None
    """The files one by one, instead of a pattern."""

    marker: Union[Mapping[str, Any], None] = None
    """The once-per-turn mark as an analogue trace in a column of its own, instead of a column `index` of 0 and 1: a turn begins
    where it crosses a threshold, between two samples."""

    pattern: Union[str, None] = None
    """Paths of the files, relative to the TOML, with `{setup}` and `{station}` in the place of their names."""

    sample_rate_hz: Union[float, None] = None
    """Sampling rate in Hz, where the files have no column `time_s`."""

    speed_rpm: Union[float, None] = None
    """Speed of the spindle as set, in rpm."""

    stations: Sequence[Mapping[str, Any]]
    """The axial stations."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Channels:
    """Named channels of other programs: TDMS, MAT, HDF5, text, LVM, NumPy, Parquet, Arrow, UFF, WAV"""

    plugin: ClassVar[str] = "channels"

    angle: Union[Mapping[str, Any], None] = None
    """The angle of the spindle, sample by sample; it may begin anew with each turn."""

    channel_path: Union[str, None] = None
    """Where channels lie in the file, with `{setup}`, `{station}` and `{channel}` in the place of their names:
    `"runs/{setup}/{channel}/values"`."""

    channels: Union[Mapping[str, Any], None] = None
    """Of each sensor of the rig, its channel; without it the channel named like the sensor. Where a format has levels, groups
    stand before the name: `"Group/Channel"`, `"struct.field"`; a column of a matrix is `"data[:, 3]"`, counted from 0."""

    format: Union[str, None] = None
    """The format, where the first bytes of the file do not say it: `tdms`, `mat`, `hdf5`, `text`, `npy`, `npz`, `parquet`,
    `arrow`, `uff` or `wav`."""

    marker: Union[Mapping[str, Any], None] = None
    """The once-per-turn mark, as a trace of pulses or a channel of 0 and 1: a turn begins where it crosses the threshold."""

    path: Union[str, None] = None
    """The file, relative to the TOML."""

    pattern: Union[str, None] = None
    """Paths of several files, relative to the TOML, instead of `path`: `{setup}`, `{station}` and `{channel}` are in the place of
    their names, as in `"{setup}_{station}.tdms"`."""

    pulses_per_turn: Union[int, None] = None
    """Pulses of an encoder in one turn: `marker` then has so many pulses a turn, or `angle` and `times` count them."""

    sample_rate_hz: Union[float, None] = None
    """Sampling rate in Hz, where the file has none."""

    setups: Union[Mapping[str, Any], None] = None
    """Of each setup of the rig, its group, variable or part of the file's name; without it the names as they are."""

    speed_rpm: Union[float, None] = None
    """Speed of the spindle as set, in rpm."""

    stations: Union[Sequence[Mapping[str, Any]], None] = None
    """The axial stations; one without a name where it is left out. Their names are parts of the files' names, or groups in the
    groups of the setups."""

    time: Union[str, None] = None
    """The channel of the times of the samples, where it is not named like one."""

    times: Union[str, None] = None
    """The channel of the times of the marks, in s unless the file says otherwise, counted as those of the samples."""

    unit: Union[str, None] = None
    """Unit of the sensors' numbers, where the file has none: `um`, `mm`, `nm`, `mil`, `in`, `V` or `mV`."""

    zero: Union[Mapping[str, Any], None] = None
    """The once-per-turn mark beside the pulses of an encoder: where the angle is 0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Points:
    """Measured points from text, XLSX or Parquet, for any separator of points"""

    plugin: ClassVar[str] = "points"

    axis: Union[Union[Literal['x'], Literal['y'], Literal['z']], None] = None
    """Direction near which the axis of the part lies, of coordinates `x_mm`, `y_mm`, `z_mm` for a separator that takes places
    about an axis (`angle_deg`, `radius_mm`, `z_mm`). The axis is found from the points; without the key its direction too."""

    columns: Union[Mapping[str, Any], None] = None
    """The file's names of columns that differ from the separator's: `columns = { "ΔX" = "dx_mm" }`. Names that differ by the unit
    alone (`dx_um`, `dx [µm]` for `dx_mm`) are found and converted."""

    names: Union[Sequence[str], None] = None
    """Names of the columns of a text without a header, in their order: `names = ["x_mm", "y_mm", "z_mm"]`."""

    path: str
    """CSV, XLSX or Parquet file with one row a point, relative to the TOML. The separator says which columns it takes; `check`
    lists them. Text is separated by comma, semicolon, tab or blanks; all but the first allow a decimal comma."""

    sheet: Union[str, None] = None
    """Sheet of an XLSX file; without it the first one."""

    where: Union[Mapping[str, Any], None] = None
    """Only rows with these values are read: `where = { a_deg = 0 }`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotorModel:
    """A rotor from materials, segments, disks and bearings, or from its matrices"""

    plugin: ClassVar[str] = "rotor-model"

    bearings: Union[Sequence[Mapping[str, Any]], None] = None
    """Springs and dampers between shaft and ground."""

    disks: Union[Sequence[Mapping[str, Any]], None] = None
    """Rigid disks: wheels, pulleys, chucks, parts."""

    materials: Union[Sequence[Mapping[str, Any]], None] = None
    """Materials of the segments."""

    matrices: Union[Mapping[str, Any], None] = None
    """Matrices of the equations of motion, instead of all the above."""

    path: Union[str, None] = None
    """TOML file with the keys below, relative to this one."""

    segments: Union[Sequence[Mapping[str, Any]], None] = None
    """Cylindrical segments of the shaft, one after the other from z = 0."""

    supports: Union[Sequence[Mapping[str, Any]], None] = None
    """Places that cannot move."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """Measured points or recorded turns by a program in any language"""

    plugin: ClassVar[str] = "external"

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    gives: Union[Union[Literal['points'], Literal['samples']], None] = None
    """What it gives."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    path: str
    """The file that the program reads, relative to the TOML. Its checksum belongs to the result."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""
