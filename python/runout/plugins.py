"""Separators and effects of one's own: objects that are passed to a call beside the stages that come with the package.

    runout.run("pipeline.toml", plugins=[HalfTheSum()], set={"separate": {"plugin": "half-the-sum"}})

An object with the method `operator` is a separator, one with `transfer` an effect. `name` is what pipelines call it, in kebab-case; the first line
of the docstring of its class says what it does.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol, Union

import numpy as np
import numpy.typing as npt

from ._native import Layout

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


@dataclasses.dataclass(frozen=True)
class Own:
    """What the compiled part reads of a plugin."""

    name: str
    about: str
    parameters: list[tuple[str, str, float]] | None
    plugin: Any


def own(plugin: Any) -> Own:
    """A separator or an effect, checked: TypeError and ValueError say what it lacks."""
    kind = type(plugin).__name__
    if isinstance(plugin, type) or not is_plugin(plugin):
        raise TypeError(f"expected an object with the method `operator` (a separator) or `transfer` (an effect), found {kind}")
    name = getattr(plugin, "name", None)
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise ValueError(f"{kind}: expected a `name` in kebab-case, as in \"half-the-sum\", found {name!r}")
    about = (inspect.getdoc(type(plugin)) or "").strip().partition("\n")[0] or "a plugin in Python"
    if is_separator(plugin):
        return Own(name, about, None, plugin)
    try:
        parameters = [(str(called), str(unit), float(size)) for called, unit, size in plugin.parameters]
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{kind}: expected `parameters` of (name, unit, usual size): {error}") from None
    if not parameters or not all(np.isfinite(size) and size > 0 for _, _, size in parameters):
        raise ValueError(f"{kind}: expected at least one parameter, with a usual size above 0, found {parameters}")
    neutral = np.asarray(plugin.transfer(np.arange(3), *(0.0 for _ in parameters)))
    if neutral.shape != (3,) or not np.allclose(neutral, 1):
        raise ValueError(f"{kind}: expected a transfer of 1 at each order where all values are 0, found {neutral}")
    return Own(name, about, parameters, plugin)


def is_separator(plugin: Any) -> bool:
    """Whether an object is a separator of one's own."""
    return callable(getattr(plugin, "operator", None)) and not isinstance(plugin, type)


def is_plugin(plugin: Any) -> bool:
    """Whether an object is a separator or an effect of one's own."""
    return is_separator(plugin) or callable(getattr(plugin, "transfer", None))


def named(keys: Mapping[str, Any]) -> tuple[dict[str, Any], list[Any]]:
    """The keys of a pipeline with separators of one's own in `separate` and `compare` by their names, and those objects."""
    found: list[Any] = []

    def by_name(stage: Any) -> Any:
        if not is_separator(stage):
            return stage
        found.append(stage)
        return {"plugin": own(stage).name}

    changed = dict(keys)
    if "separate" in changed:
        changed["separate"] = by_name(changed["separate"])
    if isinstance(changed.get("compare"), (list, tuple)):
        changed["compare"] = [by_name(stage) for stage in changed["compare"]]
    return changed, found


def checked(plugins: Iterable[Any]) -> list[Own]:
    """All plugins of a call, each once. ValueError where two have one name."""
    unique = {id(plugin): own(plugin) for plugin in plugins}
    names = [one.name for one in unique.values()]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two plugins have the name {', '.join(twice)}: give each its own")
    return list(unique.values())


Method = Union[str, Separator]
"""A separator, by its name or as an object."""
