"""The compiled part of the package."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__version__: str

class _Station(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def z_mm(self) -> float: ...
    @property
    def captures(self) -> dict[str, Capture]: ...

class _Own(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def about(self) -> str: ...
    @property
    def method(self) -> str: ...
    @property
    def parameters(self) -> list[tuple[str, str, float]]: ...
    @property
    def columns(self) -> list[str]: ...
    @property
    def labels(self) -> list[str]: ...
    @property
    def symbols(self) -> list[tuple[str, str]]: ...
    @property
    def plugin(self) -> Any: ...

class _Job(Protocol):
    @property
    def path(self) -> str | None: ...
    @property
    def text(self) -> str: ...
    @property
    def folder(self) -> str: ...
    @property
    def set(self) -> list[str]: ...
    @property
    def stations(self) -> Sequence[_Station] | None: ...
    @property
    def plugins(self) -> Sequence[_Own]: ...

class Capture:
    """Samples in µm, `[sample, channel]`, and how turns are known."""

    def __new__(
        cls,
        samples: npt.NDArray[np.float64],
        marks: npt.NDArray[np.float64] | None = None,
        angle_deg: npt.NDArray[np.float64] | None = None,
        sensors: list[str] | None = None,
        sample_rate_hz: float | None = None,
        speed_rpm: float | None = None,
    ) -> Capture: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def samples(self) -> npt.NDArray[np.float64]: ...

class Layout:
    """The rig as a formula gets it: which reading (a sensor in a setup) contains which unknown, order by order."""

    @property
    def orders(self) -> npt.NDArray[np.int64]:
        """Orders that are asked for, ascending from 2. Order 1 follows the rule of 1/rev."""

    @property
    def unknowns(self) -> list[tuple[str, str | None]]:
        """What is solved for: `form` with its section, then `x`, `y`, `tilt_x`, `tilt_y` in µm and µrad, as far as a sensor sees them."""

    @property
    def sensors(self) -> list[str]:
        """Of each reading, the id of its sensor."""

    @property
    def setups(self) -> list[str]:
        """Of each reading, the id of its setup."""

    @property
    def sections(self) -> list[str]:
        """Of each reading, the id of its section."""

    @property
    def angle_rad(self) -> npt.NDArray[np.float64]:
        """Of each reading, the direction in which it looks."""

    @property
    def part_angle_rad(self) -> npt.NDArray[np.float64]:
        """Of each reading, the angle of the part that it sees at spindle angle 0."""

    @property
    def lever_mm(self) -> npt.NDArray[np.float64]:
        """Of each reading, z less the mean over the sensors."""

    @property
    def direction(self) -> float:
        """+1 where the part turns counter-clockwise, else −1."""

    @property
    def matrix(self) -> npt.NDArray[np.complex128]:
        """readings = matrix · unknowns, `[order, reading, unknown]`."""

class Table:
    """A table with units, for any library that takes the Arrow PyCapsule interface."""

    @property
    def name(self) -> str: ...
    @property
    def about(self) -> str: ...
    @property
    def columns(self) -> list[tuple[str, str, str]]:
        """Name, unit and meaning of each column."""

    def __len__(self) -> int: ...
    def __getitem__(self, name: str) -> Any:
        """A column as a NumPy array; texts as a list. Numbers that are null are NaN."""

    @property
    def drawings(self) -> str:
        """What is drawn of it, as JSON: a list of figures."""

    def to_pandas(self) -> Any:
        """A frame of pandas, with the units in its `attrs`."""

    def to_polars(self) -> Any:
        """A frame of polars, which shares its memory."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def __arrow_c_schema__(self) -> object: ...

def figures(tables: Sequence[Table], panels: int) -> str:
    """The figures that tables declare, as HTML with pictures in it; each figure has so many panels at most."""

class Surface:
    """Form over the part's angle and z."""

    @property
    def radius_mm(self) -> float: ...
    @property
    def angle_deg(self) -> npt.NDArray[np.float64]: ...
    @property
    def z_mm(self) -> npt.NDArray[np.float64]: ...
    @property
    def deviation_um(self) -> npt.NDArray[np.float64]:
        """Deviation from the nominal radius, `[ring, angle]`."""

    @property
    def interpolation(self) -> str: ...

_Progress = Callable[[int, int, str], object]

def run(
    job: _Job, threads: int | None = None, progress: _Progress | None = None, surface: bool = False
) -> tuple[str, list[Table], Surface | None]: ...
def diagnose(
    job: _Job, threads: int | None = None, progress: _Progress | None = None, surface: bool = False
) -> tuple[str, list[Table], Surface | None]: ...
def compare(job: _Job, methods: list[str], threads: int | None = None, progress: _Progress | None = None) -> str: ...
def check(job: _Job) -> str: ...
def document(words: Sequence[str]) -> str: ...
def main(words: Sequence[str]) -> int: ...
