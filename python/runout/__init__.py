"""Separates the form of a turning part from the error motion of its spindle, with uncertainty.

    result = runout.run("pipeline.toml", set={"preprocess.1.cutoff_hz": 300})
    result.tables["form"]          # pyarrow.table(…), polars.from_arrow(…), pandas, DuckDB take it

Samples are in µm, geometry is in mm, angles in a configuration are in degrees.
"""

from ._commands import check, compare, diagnose, inspect, plan, run, simulate
from ._native import Layout, Surface, Table, __version__
from .errors import CommandError, ConfigurationError, DataError, Error
from .pipeline import Pipeline
from .recording import Capture, Recording
from .result import Added, Diagnosis, Level, Parameter, Result, Value

__all__ = [
    "Added",
    "Capture",
    "CommandError",
    "ConfigurationError",
    "DataError",
    "Diagnosis",
    "Error",
    "Layout",
    "Level",
    "Parameter",
    "Pipeline",
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
]
