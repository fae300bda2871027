"""Plugins of one's own: objects that are passed to a call beside the stages that come with the package.

    runout.run("pipeline.toml", plugins=[HalfTheSum()], set={"separate": {"plugin": "half-the-sum"}})

One of its methods says what an object is: `operator` a separator that is a linear formula, `transfer` an effect of a channel, `change` one of measured points; `separate` and `values` separators of
turns and of points, `preprocess` a preprocessor of averages, `captures` a loader of recorded turns, `evaluate`, `load` and `export` what they say (`runout.external` has their types). `name` is what pipelines call it, in
kebab-case; of other objects than formulas and effects it is that of the class without it. The first line of the docstring of its class says what it
does.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np
import numpy.typing as npt

from ._native import Layout

if TYPE_CHECKING:
    # It needs pyarrow, which formulas do not.
    from .external import PointSeparator, TurnSeparator

NAME = re.compile("[a-z][a-z0-9]*(-[a-z0-9]+)*")


class Separator(Protocol):
    """A formula that gives form and motion as a linear combination of the readings, one harmonic order at a time.

    From the formula `runout` computes the rest: standard uncertainty, the geometry of second order, the residual and lost orders.
    In a pipeline it takes the keys `sensors`, `setups`, `second_order` and `max_noise_gain`, as `three-point` does.
    """

    @property
    def name(self) -> str:
        """What pipelines call it."""

    def operator(self, layout: Layout) -> npt.ArrayLike:
        """unknowns = operator · readings, as an array `[order, unknown, reading]` over `layout.orders`, `.unknowns` and the readings.

        Readings and motion are Re Σ c exp(−i·n·Φ), form is Re Σ c exp(+i·n·α). Motion is that at the mean z of the sensors. A row of NaN says that the
        formula does not give an unknown at an order, which is then lost.
        """


class Effect(Protocol):
    """A linear change of one channel that the rig does not declare: `diagnose` considers it at each sensor."""

    @property
    def name(self) -> str:
        """What pipelines and diagnoses call it."""

    @property
    def parameters(self) -> Sequence[tuple[str, str, float]]:
        """Name, unit and usual size (a standard deviation, in the unit) of each parameter."""

    def transfer(self, orders: npt.NDArray[np.int64], *values: float) -> npt.ArrayLike:
        """Reading over displacement at each of `orders` (from 0), never 0; 1 where all values are 0.

        A method `partials(orders, *values)` may give its derivatives by the parameters, `[parameter, order]`; without it they are central
        differences.
        """


METHODS = ("operator", "transfer", "change", "preprocess", "separate", "values", "load", "captures", "evaluate", "export")
"""The method that says what an object is."""
_SEPARATORS = ("operator", "separate", "values")
_EXPECTED = (
    "an object with the method `operator`, `separate` or `values` (a separator), `transfer` or `change` (an effect), `preprocess`, `evaluate`, `load`, `captures` or `export`"
)


@dataclasses.dataclass(frozen=True)
class Own:
    """What the compiled part reads of a plugin."""

    name: str
    about: str
    method: str
    parameters: list[tuple[str, str, float]]
    columns: list[str]
    labels: list[str]
    symbols: list[tuple[str, str]]
    plugin: Any


def own(plugin: Any) -> Own:
    """A plugin, checked: TypeError and ValueError say what it lacks."""
    kind = type(plugin).__name__
    found = _methods(plugin)
    if len(found) != 1:
        several = f"one with {', '.join(found)}" if found else kind
        raise TypeError(f"expected {_EXPECTED}, found {several}")
    method = found[0]
    # A formula and an effect are named in results.
    name = getattr(plugin, "name", None if method in ("operator", "transfer", "change") else _kebab(kind))
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise ValueError(f"{kind}: expected a `name` in kebab-case, as in \"half-the-sum\", found {name!r}")
    about = (inspect.getdoc(type(plugin)) or "").strip().partition("\n")[0] or "a plugin in Python"
    columns, labels = (_names(plugin, key) if method in ("values", "change") else [] for key in ("columns", "labels"))
    if method in ("values", "change") and not columns:
        raise ValueError(f"{kind}: expected `columns`, names of the columns of numbers that it takes, as in [\"x_mm\"]")
    symbols = _symbols(plugin) if method in ("values", "evaluate") else []
    if method == "evaluate" and not symbols:
        raise ValueError(f"{kind}: expected `symbols`, pairs of symbol and unit of its values, as in [(\"lobing\", \"um\")]")
    parameters = _parameters(plugin) if method in ("transfer", "change") else []
    return Own(name, about, method, parameters, columns, labels, symbols, plugin)


def _methods(plugin: Any) -> list[str]:
    # A dictionary has `values` too.
    if isinstance(plugin, (type, str, Mapping)):
        return []
    return [method for method in METHODS if callable(getattr(plugin, method, None))]


def _kebab(name: str) -> str:
    return re.sub("(?<=[a-z0-9])(?=[A-Z])|_", "-", name).strip("-").lower()


def _names(plugin: Any, key: str) -> list[str]:
    names = getattr(plugin, key, ())
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{type(plugin).__name__}: expected `{key}`, a list of names of columns, found {names!r}")
    return list(names)


def _symbols(plugin: Any) -> list[tuple[str, str]]:
    try:
        return [(str(symbol), str(unit)) for symbol, unit in getattr(plugin, "symbols", ())]
    except (TypeError, ValueError) as error:
        raise ValueError(f"{type(plugin).__name__}: expected `symbols` of (symbol, unit): {error}") from None


def _parameters(plugin: Any) -> list[tuple[str, str, float]]:
    kind = type(plugin).__name__
    try:
        parameters = [(str(called), str(unit), float(size)) for called, unit, size in plugin.parameters]
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{kind}: expected `parameters` of (name, unit, usual size): {error}") from None
    if not parameters or not all(np.isfinite(size) and size > 0 for _, _, size in parameters):
        raise ValueError(f"{kind}: expected at least one parameter, with a usual size above 0, found {parameters}")
    if not hasattr(plugin, "transfer"):
        return parameters
    neutral = np.asarray(plugin.transfer(np.arange(3), *(0.0 for _ in parameters)))
    if neutral.shape != (3,) or not np.allclose(neutral, 1):
        raise ValueError(f"{kind}: expected a transfer of 1 at each order where all values are 0, found {neutral}")
    return parameters


def named(keys: Mapping[str, Any]) -> tuple[dict[str, Any], list[Any]]:
    """The keys of a pipeline with objects of one's own in the places of stages by their names, and those objects."""
    found: list[Any] = []

    def by_name(stage: Any) -> Any:
        if _methods(stage):
            found.append(stage)
            return {"plugin": own(stage).name}
        if isinstance(stage, Mapping) and _methods(stage.get("plugin")):
            found.append(stage["plugin"])
            return {**stage, "plugin": own(stage["plugin"]).name}
        return stage

    changed = dict(keys)
    for key in ("load", "separate"):
        if key in changed:
            changed[key] = by_name(changed[key])
    for key in ("preprocess", "compare", "evaluator", "export"):
        if isinstance(changed.get(key), (list, tuple)):
            changed[key] = [by_name(stage) for stage in changed[key]]
    return changed, found


def checked(plugins: Iterable[Any]) -> list[Own]:
    """All plugins of a call, each once. ValueError where two have one name."""
    unique = {id(plugin): own(plugin) for plugin in plugins}
    names = [one.name for one in unique.values()]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two plugins have the name {', '.join(twice)}: give each its own")
    return list(unique.values())


Method = Union[str, Separator, "TurnSeparator", "PointSeparator"]
"""A separator, by its name or as an object."""
