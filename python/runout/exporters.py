"""From results to files.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hdf5:
    """One file with the tables of a result and where they came from"""

    plugin: ClassVar[str] = "hdf5"

    path: str
    """The file to write, relative to the TOML."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class X3p:
    """Writes the surface as X3P (ISO 25178-72), heights as f64"""

    plugin: ClassVar[str] = "x3p"

    path: str
    """The file to write, ending in `.x3p`. Of a part its wall, unrolled at the nominal radius."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sdf:
    """Writes the surface as SDF (ISO 25178-71), binary, heights as f64"""

    plugin: ClassVar[str] = "sdf"

    path: str
    """The file to write, ending in `.sdf`. Of a part its wall, unrolled at the nominal radius."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """Files of any format by a program in any language"""

    plugin: ClassVar[str] = "external"

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    files: Sequence[str]
    """Names of the files that the program writes, at least one: `files = ["values.txt"]`."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    path: str
    """Folder of the files, relative to the TOML. Made where it is missing."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Parquet:
    """The tables of a result, one file each"""

    plugin: ClassVar[str] = "parquet"

    path: str
    """Folder for the tables, one file each: form.parquet, motion.parquet, harmonics.parquet, values.parquet; of measured points
    those of their separator. Made where it is missing."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Gltf:
    """Writes the surface as a glTF binary mesh, coloured by deviation"""

    plugin: ClassVar[str] = "gltf"

    capped: Union[bool, None] = None
    """Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends. Default: false."""

    colour_range_um: Union[float, None] = None
    """Deviation of the two strongest colours, ± µm; without it the largest deviation."""

    magnification: Union[float, None] = None
    """Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the heights of a
    map, drawn so many times larger. Above 1, at most 1000000."""

    path: str
    """The file to write; the mesh in it is at true scale."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Obj:
    """Writes the surface as a Wavefront OBJ mesh in mm, coloured by deviation"""

    plugin: ClassVar[str] = "obj"

    capped: Union[bool, None] = None
    """Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends. Default: false."""

    colour_range_um: Union[float, None] = None
    """Deviation of the two strongest colours, ± µm; without it the largest deviation."""

    magnification: Union[float, None] = None
    """Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the heights of a
    map, drawn so many times larger. Above 1, at most 1000000."""

    path: str
    """The file to write; the mesh in it is at true scale."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ply:
    """Writes the surface as a PLY mesh in mm, with colour and the deviation as quality"""

    plugin: ClassVar[str] = "ply"

    capped: Union[bool, None] = None
    """Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends. Default: false."""

    colour_range_um: Union[float, None] = None
    """Deviation of the two strongest colours, ± µm; without it the largest deviation."""

    magnification: Union[float, None] = None
    """Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the heights of a
    map, drawn so many times larger. Above 1, at most 1000000."""

    path: str
    """The file to write; the mesh in it is at true scale."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stl:
    """Writes the surface as a binary STL mesh in mm, without colours"""

    plugin: ClassVar[str] = "stl"

    capped: Union[bool, None] = None
    """Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends. Default: false."""

    colour_range_um: Union[float, None] = None
    """Deviation of the two strongest colours, ± µm; without it the largest deviation."""

    magnification: Union[float, None] = None
    """Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the heights of a
    map, drawn so many times larger. Above 1, at most 1000000."""

    path: str
    """The file to write; the mesh in it is at true scale."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Format3mf:
    """Writes the surface as a 3MF mesh in mm, coloured by deviation, for printing"""

    plugin: ClassVar[str] = "3mf"

    capped: Union[bool, None] = None
    """Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends. Default: false."""

    colour_range_um: Union[float, None] = None
    """Deviation of the two strongest colours, ± µm; without it the largest deviation."""

    magnification: Union[float, None] = None
    """Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the heights of a
    map, drawn so many times larger. Above 1, at most 1000000."""

    path: str
    """The file to write; the mesh in it is at true scale."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Figures:
    """Figures of a result as SVG and PNG"""

    plugin: ClassVar[str] = "figures"

    formats: Union[Sequence[Union[Literal['svg'], Literal['png']]], None] = None
    """The formats: `svg` for print, `png` for pages and mails. Both without it."""

    panels: Union[int, None] = None
    """Panels of a figure, at most: with more stations, panels are spread evenly over them. 12 without it. Default: 12."""

    path: str
    """Folder for the figures. Made where it is missing."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Report:
    """One page with figures, values and limits, for a browser and for print"""

    plugin: ClassVar[str] = "report"

    path: str
    """The file to write, relative to the TOML: `out/report.html`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Csv:
    """Values with their uncertainties, limits and decisions as CSV, one row each"""

    plugin: ClassVar[str] = "csv"

    decimal_comma: Union[bool, None] = None
    """Decimal commas, and semicolons between cells, as spreadsheets of many countries expect. Default: false."""

    path: str
    """The file to write, ending in `.csv`: one row a value and limit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Xlsx:
    """Values with limits as an Excel workbook, coloured by decision, and a sheet a table that is asked for"""

    plugin: ClassVar[str] = "xlsx"

    path: str
    """The file to write, ending in `.xlsx`. Its first sheet has the values."""

    tables: Union[Sequence[str], None] = None
    """Tables of the result that have a sheet too, by their names: `["form", "harmonics"]`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class QDas:
    """Values with their limits in the Q-DAS ASCII transfer format (.dfq)"""

    plugin: ClassVar[str] = "q-das"

    only_limited: Union[bool, None] = None
    """Only values that a limit names; with `false` all values. Default: true."""

    part: Union[str, None] = None
    """Description of the part (K1002); the pipeline's title without it."""

    part_number: Union[str, None] = None
    """Number of the part (K1001)."""

    path: str
    """The file to write, ending in `.dfq`: one characteristic a value and limit."""

    time: Union[str, None] = None
    """When it was measured (K0004), as `28.11.2026/14:30:00`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Controller:
    """Compensation file of a machine control, from component curves"""

    plugin: ClassVar[str] = "controller"

    arms_from_mm: Union[Sequence[float], None] = None
    """isg-csv, etalon: the point of the machine from which the control counts lever arms, in mm."""

    axes: Union[Mapping[str, Any], None] = None
    """Names of the axes at the control: `{ X = "X1", Y = "Y1" }`; their letters without it."""

    axis: Union[str, None] = None
    """The axis of the file (linuxcnc: one file a joint)."""

    bed_z_mm: Union[float, None] = None
    """klipper: height of the bed at which its mesh is computed, in mm."""

    com: Union[Mapping[str, Any], None] = None
    """heidenhain: names of the tables of compensation values, beside `path`, by the axis whose position counts: `{ X = "x.com" }`."""

    detection_unit: Union[Mapping[str, Any], None] = None
    """fanuc-pitch, fanuc-3d: detection unit of each axis, in mm or °: `{ X = 0.001 }`."""

    dialect: Union[Literal['siemens-enc-comp'], Literal['siemens-cec'], Literal['isg-csv'], Literal['etalon'], Literal['linuxcnc'], Literal['klipper'], Literal['heidenhain'], Literal['fanuc-pitch'], Literal['fanuc-3d']]
    """Whose file it is."""

    first_point: Union[int, None] = None
    """fanuc-pitch: number of the first compensation point that the file may use. Default: 0."""

    first_table: Union[int, None] = None
    """siemens-cec: index of the first table. Default: 0."""

    largest_value: Union[int, None] = None
    """fanuc-pitch, fanuc-3d: largest value at a point, without its sign; 7 of pitch errors and 127 of boxes without it."""

    leave_out: Union[Sequence[str], None] = None
    """Errors that the file shall not hold: `["EAX", "EC0Y"]`. What the dialect cannot hold has to be named here."""

    magnification: Union[int, None] = None
    """fanuc-pitch, fanuc-3d: magnification of the values, parameter 3623 of pitch errors. Default: 1."""

    most_points: Union[int, None] = None
    """Points of a table that the control has memory for; more are an error."""

    most_tables: Union[int, None] = None
    """siemens-cec, heidenhain: tables (heidenhain: dependencies of one axis on another or on itself) that the control has."""

    path: str
    """The file to write."""

    positive_moves: Union[Union[Literal['positive'], Literal['negative']], None] = None
    """siemens-cec, heidenhain, fanuc-pitch, fanuc-3d: where a positive value of the table moves the axis. Write one table by hand
    and look: manuals differ."""

    zero_at: Union[Mapping[str, Any], None] = None
    """Position of each axis where its positioning correction is 0, in mm or °: that of its reference point. `{ X = 0.0 }`."""
