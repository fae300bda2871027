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

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def __arrow_c_schema__(self) -> object: ...

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
