"""Pipelines built in code."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

from . import _toml
from .recording import Recording, Station
from .tables import Diagnose, Evaluate, Limit, Rig, Surface

Stage = Union[Mapping[str, Any], Any]
"""An object of `runout.loaders`, `.preprocessors`, `.separators`, `.exporters` or `.checks`, or a dictionary with `plugin`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pipeline:
    """The same keys as in TOML. Paths are relative to `folder`. `load` may be a `Recording`."""

    separate: Stage
    load: Union[Stage, Recording, None] = None
    rig: Union[Mapping[str, Any], Rig, str, os.PathLike[str], None] = None
    preprocess: Sequence[Stage] = ()
    title: str | None = None
    compare: Sequence[Stage] = ()
    surface: Union[Mapping[str, Any], Surface, None] = None
    evaluate: Union[Mapping[str, Any], Evaluate, None] = None
    limit: Sequence[Union[Mapping[str, Any], Limit]] = ()
    diagnose: Union[Mapping[str, Any], Diagnose, None] = None
    export: Sequence[Stage] = ()
    check: Sequence[Stage] = ()
    folder: Union[str, os.PathLike[str]] = "."

    def to_toml(self) -> str:
        """The pipeline as a file would hold it. A recording in memory is `plugin = "arrays"`, which only Python knows."""
        keys = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "folder"}
        if isinstance(self.load, Recording) or self.load is None:
            keys["load"] = {"plugin": "arrays"}
        empty = {name for name, of in keys.items() if isinstance(of, (list, tuple)) and not of}
        return _toml.document({name: of for name, of in keys.items() if name not in empty})


@dataclasses.dataclass(frozen=True)
class Job:
    """What the compiled part reads of a call."""

    path: str | None
    text: str
    folder: str
    set: list[str]
    stations: list[Station] | None


Source = Union[str, os.PathLike[str], Mapping[str, Any], Pipeline]


def job(pipeline: Source, recording: Recording | None, overrides: Mapping[str, Any] | None) -> Job:
    """The job of a pipeline: a file, a dictionary with the keys of TOML, or a `Pipeline`."""
    if recording is not None and not isinstance(recording, Recording):
        raise TypeError(f"expected a runout.Recording, found {type(recording).__name__}")
    lines = [f"{name}={_toml.value(of, name)}" for name, of in (overrides or {}).items()]
    path, text, folder = None, "", "."
    if isinstance(pipeline, Pipeline):
        text, folder = pipeline.to_toml(), os.fspath(pipeline.folder)
        if isinstance(pipeline.load, Recording) and recording is None:
            recording = pipeline.load
    elif isinstance(pipeline, Mapping):
        text = _toml.document(pipeline)
    elif isinstance(pipeline, (str, os.PathLike)):
        path = os.fspath(pipeline)
    else:
        raise TypeError(f"expected a path, a dictionary or a runout.Pipeline, found {type(pipeline).__name__}")
    if recording is not None:
        lines.append('load={ plugin = "arrays" }')
    return Job(path, text, folder, lines, None if recording is None else recording.stations)
