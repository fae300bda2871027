"""The commands of the program, as functions."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

from . import _native, _toml
from .pipeline import Data, Source, job
from .plugins import Effect, Method, Separator, own
from .result import Comparison, Diagnosis, Plan, Result

if TYPE_CHECKING:
    from .external import Served

Progress = Callable[[int, int, str], object]
"""Called with the number of stations that are done, of all, and the name of the last one. What it raises stops the work."""
Path = Union[str, os.PathLike[str]]
Overrides = Mapping[str, Any]
Plugin = Union[Separator, Effect, "Served"]


def run(
    pipeline: Source,
    recording: Data | None = None,
    *,
    set: Overrides | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    surface: bool = False,
    plugins: Sequence[Plugin] = (),
) -> Result:
    """Loads, preprocesses, separates, evaluates and exports.

    `pipeline` is a TOML file, a dictionary with its keys, or a `Pipeline`. `recording`, a
    `Recording` or `Points`, takes the place of its `[load]`. `set`
    overrides keys: `{"preprocess.0.cutoff_hz": 300}`. With `surface` the form over angle and z is kept as well; it is kept
    in any case where an exporter or a value needs it. `plugins` are separators, effects and other stages of one's own (`runout.plugins`), which the pipeline
    may name; what their code raises, the call raises.

    Raises `ConfigurationError` for a mistake in the pipeline, `DataError` for data and files. Ctrl-C stops it; nothing
    half-written remains.
    """
    return Result(*job(pipeline, recording, set, plugins).call(_native.run, threads, progress, surface))


def diagnose(
    pipeline: Source,
    recording: Data | None = None,
    *,
    set: Overrides | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    surface: bool = False,
    plugins: Sequence[Plugin] = (),
) -> Diagnosis:
    """Runs the closed loop: finds what the declared model lacks, and adds it. Arguments and exceptions as of `run`."""
    return Diagnosis(*job(pipeline, recording, set, plugins).call(_native.diagnose, threads, progress, surface))


def compare(
    pipeline: Source,
    methods: Sequence[Method] = (),
    recording: Data | None = None,
    *,
    set: Overrides | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    plugins: Sequence[Plugin] = (),
) -> Comparison:
    """Compares separators on the same data: the document of `compare.schema.json`, with tables of it.

    `methods` are names, or separators of one's own. Without them, all of `[[compare]]`, or else every other separator. Arguments and
    exceptions as of `run`.
    """
    if isinstance(methods, str):
        raise TypeError("expected a list of separators, found a string")
    objects = [method for method in methods if not isinstance(method, str)]
    names = [method if isinstance(method, str) else own(method).name for method in methods]
    return Comparison(_document(job(pipeline, recording, set, [*plugins, *objects]).call(_native.compare, names, threads, progress)))


def check(
    pipeline: Source,
    recording: Data | None = None,
    *,
    set: Overrides | None = None,
    plugins: Sequence[Plugin] = (),
) -> dict[str, Any]:
    """Says what is known without the data, as the document of `check.schema.json`."""
    return _document(job(pipeline, recording, set, plugins).call(_native.check))


def plan(
    rig: Union[Path, Mapping[str, Any]],
    *,
    orders: tuple[int, int] | None = None,
    clearance_deg: float | None = None,
    optimise_angles: bool = False,
    angle_tolerance_deg: float | None = None,
    criterion: str | None = None,
    seed: int | None = None,
    set: Overrides | None = None,
) -> Plan:
    """Says what a rig can separate and how well: the document of `plan.schema.json`, with tables of it.

    `rig` is a file or a dictionary with the keys of `[rig]`; or a pipeline of measured points, as a file or a dictionary.
    `orders` are the first and the last, 2 and 150 without it. The other arguments are the options of `runout plan`.
    """
    words: list[str] = []
    if orders is not None:
        first, last = orders
        words += ["--orders", f"{first}..{last}"]
    words += [] if clearance_deg is None else ["--clearance", f"{clearance_deg}deg"]
    words += ["--optimise", "angles"] if optimise_angles else []
    words += [] if angle_tolerance_deg is None else ["--angle-tolerance", f"{angle_tolerance_deg}deg"]
    words += [] if criterion is None else ["--criterion", criterion]
    words += [] if seed is None else ["--seed", str(seed)]
    return Plan(_of_file("plan", rig, words, set))


def simulate(
    scenario: Union[Path, Mapping[str, Any]], out: Path | None = None, *, set: Overrides | None = None
) -> dict[str, Any]:
    """Makes a campaign with declared truth and effects, and says how large the file is that it wrote.

    `scenario` is a file or a dictionary with its keys; `out` is written in place of its `output`.
    """
    if isinstance(scenario, Mapping) and out is None:
        raise ValueError("a scenario that is a dictionary is in no folder: name the file to write by `out`")
    return _of_file("simulate", scenario, [] if out is None else ["--out", os.fspath(out)], set)


def inspect(file: Path) -> dict[str, Any]:
    """Says what a measurement, a result or a Parquet file holds."""
    return _document(_native.document(["inspect", "--", os.fspath(file)]))


def _of_file(command: str, file: Union[Path, Mapping[str, Any]], words: list[str], overrides: Overrides | None) -> dict[str, Any]:
    words = [command, *words, *(f"--set={name}={_toml.value(of, name)}" for name, of in (overrides or {}).items())]
    if not isinstance(file, Mapping):
        return _document(_native.document([*words, "--", os.fspath(file)]))
    with tempfile.TemporaryDirectory() as folder:
        written = os.path.join(folder, f"{command}.toml")
        with open(written, "w", encoding="utf-8") as text:
            text.write(_toml.document(file))
        return _document(_native.document([*words, "--", written]))


def _document(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text)
    return found
