"""Separates the form of a turning part from the error motion of its spindle, with uncertainty.

    result = runout.run("pipeline.toml", set={"preprocess.1.cutoff_hz": 300})
    result.tables["form"]          # pyarrow.table(…), polars.from_arrow(…), pandas, DuckDB take it

Samples are in µm, geometry is in mm, angles in a configuration are in degrees.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._commands import check, compare, diagnose, inspect, plan, run, simulate
from ._native import Layout, Surface, Table, __version__
from .errors import CommandError, ConfigurationError, DataError, Error
from .pipeline import Pipeline
from .recording import Capture, Points, Recording
from .result import Added, Comparison, Diagnosis, Level, Parameter, Plan, Result, Value, values

if TYPE_CHECKING:
    from . import checks as checks
    from . import effects as effects
    from . import evaluators as evaluators
    from . import exporters as exporters
    from . import external as external
    from . import loaders as loaders
    from . import preprocessors as preprocessors
    from . import separators as separators
    from . import tables as tables

_MODULES = ("checks", "effects", "evaluators", "exporters", "external", "loaders", "preprocessors", "separators", "tables")


def __getattr__(name: str) -> Any:
    """The classes of stages, `runout.loaders` and the like, and `runout.external` are imported when they are first used."""
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module `{__name__}` has no attribute `{name}`")


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})


__all__ = [
    "Added",
    "Capture",
    "CommandError",
    "Comparison",
    "ConfigurationError",
    "DataError",
    "Diagnosis",
    "Error",
    "Layout",
    "Level",
    "Parameter",
    "Pipeline",
    "Plan",
    "Points",
    "Recording",
    "Result",
    "Surface",
    "Table",
    "Value",
    "__version__",
    "check",
    "compare",
    "diagnose",
    "inspect",
    "plan",
    "run",
    "simulate",
    "values",
]
