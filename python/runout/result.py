"""What a run and a diagnosis give."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _html, _plot
from ._native import Surface, Table, figures

PANELS = 4
"""Panels of a figure in a notebook, evenly spread over all stations; the exporter `report` shows all."""


@dataclasses.dataclass(frozen=True)
class Value:
    """One of the standards' values, or a domain's own.

    `std` and `interval_95` are in `unit`, and None where there is no uncertainty. `where` names what it is of: `station`, `section`,
    `of`. `facts` is the whole entry of the summary: band, filter, reference, source, coverage, lost orders.
    """

    symbol: str
    value: float
    unit: str
    std: float | None
    interval_95: tuple[float, float] | None
    where: dict[str, str]
    facts: dict[str, Any]

    def __float__(self) -> float:
        return self.value

    @property
    def by(self) -> str:
        """Reference and filter: "LSCI, gaussian 50 UPR"; empty where there are none."""
        named = (self.facts.get("reference"), self.facts.get("filter"))
        return ", ".join(str(name) for name in named if name and name != "none")

    def __str__(self) -> str:
        std = "" if self.std is None else f" ± {self.std:.2g}"
        at = "".join(f", {key} {name}" for key, name in self.where.items())
        by = f" ({self.by})" if self.by else ""
        return f"{self.symbol}{by} = {self.value:.6g}{std} {self.unit}{at}"


@dataclasses.dataclass(frozen=True, repr=False)
class _Outcome:
    """What a run and a diagnosis have in common: their document, and the tables and the surface of the final model."""

    document: dataclasses.InitVar[str]
    table_list: dataclasses.InitVar[list[Table]]
    surface: Surface | None
    facts: dict[str, Any] = dataclasses.field(init=False, repr=False)
    tables: dict[str, Table] = dataclasses.field(init=False, repr=False)

    def __post_init__(self, document: str, table_list: list[Table]) -> None:
        object.__setattr__(self, "facts", json.loads(document))
        object.__setattr__(self, "tables", {table.name: table for table in table_list})

    def coefficients(
        self, quantity: str, *, section: str | None = None, station: str | None = None
    ) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.float64]]:
        """Fourier coefficients of `form`, `x`, `y`, `tilt_x` or `tilt_y` by order, and their standard uncertainties.

        Index is the order; lost orders are NaN. Form is Re Σ c exp(+i·n·α), motion Re Σ c exp(−i·n·Φ). `section` and `station` may be left
        out where there is only one. Raises LookupError where they are not unique or the table has no such row.
        """
        table = self.tables.get("harmonics")
        if table is None:
            raise LookupError("the result has no table `harmonics`: its separator gives no form")
        of = np.array(table["quantity"]) == quantity
        for column, name in (("section", section), ("station", station)):
            names = np.array(table[column], dtype=object)
            if name is not None:
                of &= names == name
            elif len(there := set(names[of])) > 1:
                raise LookupError(f"`{quantity}` is there at several: say which {column}: {sorted(map(str, there))}")
        if not of.any():
            raise LookupError(f"there is no `{quantity}` of section {section} at station {station}")
        order = table["order"][of].astype(int)
        values = np.full(order.max() + 1, np.nan + 0j)
        std = np.full(order.max() + 1, np.nan)
        values[order] = table["re"][of] + 1j * table["im"][of]
        std[order] = table["std"][of]
        return values, std

    def plot(self, name: str = "form", **where: str) -> Any:
        """A figure of a table, or of the id of one of its figures, by matplotlib: `result.plot("form", section="a", station="s001")`.

        Without matplotlib it is the figure that `figures` gives, which a notebook shows, of all places. Raises LookupError where nothing
        is drawn by the name or nothing is at the place.
        """
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            table, _ = _plot._found(self.tables, name)
            return _html.Shown(figures([table], PANELS))
        return _plot.draw(self.tables, name, where)

    def figures(self, panels: int = PANELS) -> str:
        """The figures of its tables as HTML: polar plots of form and error motion, harmonics, and those of its domain."""
        return figures(list(self.tables.values()), panels)


class Result(_Outcome):
    """What a run gives. `summary` is the document of `summary.schema.json`; the rest reads it."""

    @property
    def summary(self) -> dict[str, Any]:
        """The whole document."""
        return self.facts

    def __repr__(self) -> str:
        counts = ((len(self.summary["stations"]), "stations"), (len(self.values), "values"), (len(self.warnings), "warnings"))
        return f"<runout.Result {self.title!r}: {', '.join(f'{count} {what}' for count, what in counts)}; tables {', '.join(self.tables)}>"

    @property
    def title(self) -> str:
        """The pipeline's title."""
        return str(self.summary["title"])

    @property
    def warnings(self) -> list[str]:
        """Warnings of the run and of its stations."""
        return [str(text) for text in self.summary["warnings"]]

    @property
    def lost_orders(self) -> dict[str, list[int]]:
        """Orders that the rig cannot separate, by what they are of."""
        return dict(self.summary["lost_orders"])

    @property
    def outputs(self) -> list[str]:
        """The files that were written."""
        return [str(path) for path in self.summary["outputs"]]

    @property
    def values(self) -> list[Value]:
        """All values: of the stations' sections and motion, of the part, of the domain."""
        return list(_values(self.summary))

    def value(self, symbol: str, **where: str) -> Value:
        """The one value of a symbol at a place: `result.value("RONt", section="a", station="s01", reference="LSCI")`.

        Keys other than `station`, `section` and `of` are compared with `facts`. Raises LookupError where there is none or
        more than one.
        """
        found = [one for one in self.values if one.symbol == symbol and _is_at(one, where)]
        if len(found) == 1:
            return found[0]
        if found:
            apart = sorted({key for key in _APART if len({one.where.get(key, one.facts.get(key)) for one in found}) > 1})
            known = "; ".join(map(str, found[:5])) + ("; …" if len(found) > 5 else "")
            raise LookupError(f"{len(found)} values are `{symbol}` with {where}: say which {', '.join(apart)}. They are {known}")
        same = "; ".join(str(one) for one in self.values if one.symbol == symbol) or ", ".join(sorted({one.symbol for one in self.values}))
        raise LookupError(f"no value is `{symbol}` with {where}; there is {same}")

    def _repr_html_(self) -> str:
        rows = ((one.symbol, one.by, one.value, one.std, one.unit, ", ".join(one.where.values())) for one in self.values)
        values = _html.table(("value", "reference, filter", "", "± (standard)", "unit", "of"), rows)
        return _html.page(self.title, self.warnings, values, self.figures())


_APART = ("station", "section", "of", "reference", "filter")


def values(result: Result, symbol: str | None = None, **where: str) -> Any:
    """The values of a result as a frame of pandas, or of polars where pandas is missing: one row a value.

    `symbol` and `where` choose, as in `Result.value`: `runout.values(result, symbol="RONt", reference="LSCI")`.
    """
    found = [one for one in result.values if symbol in (None, one.symbol) and _is_at(one, where)]
    low_high = [one.interval_95 or (None, None) for one in found]
    columns: dict[str, list[Any]] = {
        "symbol": [one.symbol for one in found],
        **{key: [one.where.get(key) for one in found] for key in ("station", "section", "of")},
        **{key: [one.facts.get(key) for one in found] for key in ("reference", "filter")},
        "value": [one.value for one in found],
        "std": [one.std for one in found],
        "low_95": [low for low, _ in low_high],
        "high_95": [high for _, high in low_high],
        "interval": [(one.facts.get("uncertainty") or {}).get("kind", "coverage") if one.interval_95 else None for one in found],
        "unit": [one.unit for one in found],
        "refuted_by": [one.facts.get("refuted_by") for one in found],
    }
    frames: Any
    try:
        frames = import_module("pandas")
    except ImportError:
        frames = import_module("polars")
    return frames.DataFrame(columns)


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A parameter of an effect, in `unit`; `std` is None where the data do not determine it."""

    name: str
    value: float
    std: float | None
    unit: str

    def __str__(self) -> str:
        std = "" if self.std is None else f" ± {self.std:.2g}"
        return f"{self.name} = {self.value:.6g}{std} {self.unit}"


@dataclasses.dataclass(frozen=True)
class Added:
    """An effect that was added to the model. `facts` is its whole entry in `diagnosis.json`."""

    effect: str
    targets: list[str]
    confounded_with: list[str]
    parameters: list[Parameter]
    facts: dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Level:
    """Residual and noise before or after the loop, in `unit`; None where unknown."""

    residual_rms: float
    noise_floor: float | None
    held_out_rms: float | None
    chi2_per_dof: float | None
    unit: str


class Diagnosis(_Outcome):
    """What the closed loop found. `facts` is the document of `diagnosis.schema.json`; tables are those of the final model."""

    def __repr__(self) -> str:
        added = ", ".join(f"{one.effect} {' '.join(one.targets)}" for one in self.added) or "nothing"
        return f"<runout.Diagnosis: {self.verdict}; added: {added}; tables {', '.join(self.tables)}>"

    @property
    def verdict(self) -> str:
        """"at-noise-floor", "explained", "unexplained", "improved" or "nothing-found"."""
        return str(self.facts["verdict"])

    @property
    def added(self) -> list[Added]:
        """Effects that were added, in their order."""
        return [_added(entry) for entry in self.facts["added"]]

    @property
    def before(self) -> Level:
        """As the rig is declared."""
        return _level(self.facts["before"])

    @property
    def after(self) -> Level:
        """With the effects that were added."""
        return _level(self.facts["after"])

    @property
    def warnings(self) -> list[str]:
        """What the user should know."""
        return [str(text) for text in self.facts["warnings"]]

    def _repr_html_(self) -> str:
        levels = (
            (name, level.residual_rms, level.noise_floor, level.held_out_rms, level.chi2_per_dof, level.unit)
            for name, level in (("as declared", self.before), ("after", self.after))
        )
        head = ("", "residual rms", "expected from noise", "held-out rms", "χ² per dof", "unit")
        found = (
            (one.effect, ", ".join(one.targets), "; ".join(map(str, one.parameters)), ", ".join(one.confounded_with))
            for one in self.added
        )
        effects = _html.table(("effect", "targets", "parameters", "confounded with"), found)
        return _html.page(f"Diagnosis: {self.verdict}", self.warnings, _html.table(head, levels), effects, self.figures())


class _Document(dict[str, Any]):
    """The document of a command, with what it says as properties."""

    @property
    def warnings(self) -> list[str]:
        """What the user should know."""
        return [str(text) for text in self.get("warnings", self.get("notes", []))]


class Comparison(_Document):
    """Methods on the same data: the document of `compare.schema.json`."""

    @property
    def methods(self) -> list[str]:
        """The methods that took part, the reference first."""
        return [str(one["method"]) for one in self["methods"]]

    @property
    def refused(self) -> dict[str, str]:
        """Methods that could not take part, with the reason."""
        return {str(one["method"]): str(one["reason"]) for one in self["refused"]}

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One row a quantity and method: root mean square and RONt with the largest E_n against the reference."""
        return [
            {"station": station["station"], "quantity": one["quantity"], "section": one["section"], "unit": one["unit"]}
            | {key: of[key] for key in ("method", "rms", "ront_um", "std")}
            | {"worst_e_n": worst.get(of["method"])}
            for station in self["stations"]
            for one in station["quantities"]
            for worst in [{other["method"]: (other["worst"] or {}).get("e_n") for other in one["differences"]}]
            for of in one["values"]
        ]

    def __repr__(self) -> str:
        return f"<runout.Comparison: {', '.join(self.methods)}; refused: {', '.join(self.refused) or 'none'}>"

    def _repr_html_(self) -> str:
        rows = self.rows
        head = list(rows[0]) if rows else []
        return _html.page(f"Comparison: {self['title']}", self.warnings, _html.table(head, ([*row.values()] for row in rows)))


class Plan(_Document):
    """What a rig can separate and how well: the document of `plan.schema.json`."""

    @property
    def lost_orders(self) -> dict[str, list[int]]:
        """Orders that the rig cannot separate, by what they are of."""
        return dict(self.get("lost_orders") or {})

    @property
    def noise_gain(self) -> dict[int, float]:
        """Noise of the form over that of one reading, by order."""
        return {int(one["order"]): float(one["gain"]) for one in (self.get("noise_gain") or {}).get("form", [])}

    @property
    def blind_to(self) -> list[str]:
        """Effects that data of this rig cannot show."""
        return [" ".join([one["effect"], *one["targets"]]) for one in self.get("blind_to") or []]

    def __repr__(self) -> str:
        lost = "; ".join(f"{of} {orders}" for of, orders in self.lost_orders.items() if orders) or "none"
        return f"<runout.Plan: lost orders: {lost}; not observable: {', '.join(self.blind_to) or 'none'}>"

    def _repr_html_(self) -> str:
        gain = _html.table(("order", "noise gain of the form"), self.noise_gain.items())
        lost = _html.table(("lost orders of", ""), ((of, ", ".join(map(str, orders))) for of, orders in self.lost_orders.items()))
        return _html.page("Plan", self.warnings, lost, gain, _html.table(("not observable",), ([one] for one in self.blind_to)))


def _values(summary: dict[str, Any]) -> Iterator[Value]:
    for station in summary["stations"]:
        at = {"station": station["station"]}
        for section in station["sections"]:
            for entry in section["values"]:
                yield _value(entry, at | {"section": section["section"]})
        for entry in station["motion_values"]:
            yield _value(entry, at)
    for entry in (summary.get("part") or {}).get("values", []):
        yield _value(entry, {})
    for entry in summary.get("values", []):
        yield _value(entry, {"of": entry["of"]} if entry.get("of") else {})


def _value(entry: dict[str, Any], where: dict[str, str]) -> Value:
    known = entry.get("uncertainty") or {}
    number = float("nan") if entry["value"] is None else float(entry["value"])
    interval = known.get("interval_95", entry.get("interval_95"))
    std = known.get("std", entry.get("std"))
    return Value(entry["symbol"], number, entry["unit"], std, None if interval is None else tuple(interval), where, entry)


def _is_at(value: Value, where: dict[str, str]) -> bool:
    return all(value.where.get(key, value.facts.get(key)) == name for key, name in where.items())


def _added(entry: dict[str, Any]) -> Added:
    parameters = [Parameter(one["name"], one["value"], one.get("std"), one["unit"]) for one in entry["parameters"]]
    return Added(entry["effect"], entry["targets"], entry["confounded_with"], parameters, entry)


def _level(entry: dict[str, Any]) -> Level:
    return Level(
        entry["residual_rms_um"],
        entry.get("noise_floor_um"),
        entry.get("held_out_rms_um"),
        entry.get("chi2_per_dof"),
        entry.get("unit") or "um",
    )
