"""Pipelines built in code."""

from __future__ import annotations

import dataclasses
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Union

from . import _toml
from .errors import Error
from .plugins import Own, checked, named
from .recording import Points, Recording, Station
from .tables import Diagnose, Evaluate, Limit, Report, Rig, Surface

Stage = Union[Mapping[str, Any], Any]
"""An object of `runout.loaders`, `.preprocessors`, `.separators`, `.evaluators`, `.exporters`, `.effects` or `.checks`, or a dictionary with `plugin`.
`separate`, `compare` and `evaluator` take objects of one's own as well (`runout.plugins`), and so does `plugin` of a dictionary."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pipeline:
    """The same keys as in TOML. Paths are relative to `folder`. `load` may be a `Recording` or `Points`."""

    separate: Stage
    load: Union[Stage, Recording, Points, None] = None
    rig: Union[Mapping[str, Any], Rig, str, os.PathLike[str], None] = None
    preprocess: Sequence[Stage] = ()
    title: str | None = None
    compare: Sequence[Stage] = ()
    surface: Union[Mapping[str, Any], Surface, None] = None
    evaluate: Union[Mapping[str, Any], Evaluate, None] = None
    evaluator: Sequence[Stage] = ()
    limit: Sequence[Union[Mapping[str, Any], Limit]] = ()
    effect: Sequence[Stage] = ()
    diagnose: Union[Mapping[str, Any], Diagnose, None] = None
    report: Union[Mapping[str, Any], Report, None] = None
    export: Sequence[Stage] = ()
    check: Sequence[Stage] = ()
    folder: Union[str, os.PathLike[str]] = "."

    def to_toml(self) -> str:
        """The pipeline as a file would hold it. What is in memory is `plugin = "arrays"`, which only Python knows."""
        keys, _ = self._named()
        if isinstance(self.load, (Recording, Points)) or self.load is None:
            keys["load"] = {"plugin": "arrays"}
        empty = {name for name, of in keys.items() if isinstance(of, (list, tuple)) and not of}
        return _toml.document({name: of for name, of in keys.items() if name not in empty})

    def _named(self) -> tuple[dict[str, Any], list[Any]]:
        return named({field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "folder"})


@dataclasses.dataclass(frozen=True)
class Job:
    """What the compiled part reads of a call."""

    path: str | None
    text: str
    folder: str
    set: list[str]
    stations: list[Station] | None
    plugins: list[Own]
    held: Any = None
    """A folder that lives as long as the call, with points that are in memory."""

    def call(self, work: Callable[..., Any], *rest: Any) -> Any:
        """Calls the compiled part with this job. Its messages name points in memory by their class, not by a file."""
        try:
            return work(self, *rest)
        except Error as error:
            if self.held is None:
                raise
            raise error.renamed(_points_file(self.held), "runout.Points") from None


def _points_file(held: Any) -> str:
    return os.path.join(held.name, "points.csv")



Source = Union[str, os.PathLike[str], Mapping[str, Any], Pipeline]
Data = Union[Recording, Points]


def job(
    pipeline: Source, data: Data | None, overrides: Mapping[str, Any] | None, plugins: Iterable[Any] = ()
) -> Job:
    """The job of a pipeline: a file, a dictionary with the keys of TOML, or a `Pipeline`."""
    if data is not None and not isinstance(data, (Recording, Points)):
        raise TypeError(f"expected a runout.Recording or runout.Points, found {type(data).__name__}")
    changes, found = named(overrides or {})
    lines = [f"{name}={_toml.value(of, name)}" for name, of in changes.items()]
    path, text, folder = None, "", "."
    if isinstance(pipeline, Pipeline):
        text, folder = pipeline.to_toml(), os.fspath(pipeline.folder)
        found += pipeline._named()[1]
        if isinstance(pipeline.load, (Recording, Points)) and data is None:
            data = pipeline.load
    elif isinstance(pipeline, Mapping):
        keys, own = named(pipeline)
        text = _toml.document(keys)
        found += own
    elif isinstance(pipeline, (str, os.PathLike)):
        path = os.fspath(pipeline)
    else:
        raise TypeError(f"expected a path, a dictionary or a runout.Pipeline, found {type(pipeline).__name__}")
    stations, held = None, None
    if isinstance(data, Recording):
        lines.append('load={ plugin = "arrays" }')
        stations = data.stations
    elif isinstance(data, Points):
        held = tempfile.TemporaryDirectory(prefix="runout-")
        file = _points_file(held)
        data.write(file)
        lines.append(f"load={{ plugin = \"points\", path = {_toml.string(file, 'load')} }}")
    if isinstance(plugins, (str, Mapping)) or not isinstance(plugins, Iterable):
        raise TypeError(f"expected a list of plugins, found {type(plugins).__name__}")
    return Job(path, text, folder, lines, stations, checked([*plugins, *found]), held)
