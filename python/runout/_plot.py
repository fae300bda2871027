"""Figures of tables with matplotlib: what a table says is drawn of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._native import Table

Mask = npt.NDArray[np.bool_]


def draw(tables: Mapping[str, Table], name: str, where: Mapping[str, str]) -> Any:
    """A figure of matplotlib: the first one of the table `name`, or the one with this id. Raises LookupError where there is none."""
    table, spec = _found(tables, name)
    rows = _rows(table, spec, where)
    if not rows.any():
        raise LookupError(f"the table `{table.name}` has no rows with {dict(where)}")
    panels = list(_parted(table, spec["panels"], rows))
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    kind, drawing = next(iter(spec["drawing"].items()))
    axes = figure.add_subplot(projection="polar" if kind == "Polar" else None)
    title, rows = panels[0]
    more = f" (1 of {len(panels)}: say which {', '.join(spec['panels'])})" if len(panels) > 1 else ""
    axes.set_title(f"{spec['title']}{', ' if title else ''}{title}{more}")
    if kind == "Map":
        _map(figure, axes, table, drawing, rows)
        return figure
    if kind == "Vectors":
        _vectors(figure, axes, table, drawing, rows)
        return figure
    labelled = [_curves(axes, kind, table, drawing, of, curve) for curve, of in _parted(table, spec["curves"], rows)]
    if spec["level"]:
        axes.axhline(spec["level"]["value"], color="black", linestyle="--", label=spec["level"]["name"])
    if any(labelled):
        axes.legend()
    return figure


def _found(tables: Mapping[str, Table], name: str) -> tuple[Table, dict[str, Any]]:
    known = []
    for table in tables.values():
        for spec in json.loads(table.drawings):
            if name in (table.name, spec["id"]):
                return table, spec
            known.append(spec["id"])
    raise LookupError(f"nothing is drawn by the name `{name}`; there is {', '.join(known)}")


def _rows(table: Table, spec: dict[str, Any], where: Mapping[str, str]) -> Mask:
    """The rows of a figure, at a place."""
    rows = np.ones(len(table), dtype=bool)
    if spec["only"]:
        column, names = spec["only"]
        rows &= np.isin(np.array(table[column], dtype=object), names)
    for column, name in where.items():
        rows &= np.array(table[column], dtype=object) == name
    return rows


def _parted(table: Table, columns: list[str], rows: Mask) -> Iterator[tuple[str, Mask]]:
    """The rows by the names in some columns, in their order."""
    names = list(zip(*(map(str, np.array(table[column], dtype=object)) for column in columns))) or [()] * len(table)
    of: dict[tuple[str, ...], list[int]] = {}
    for row in np.flatnonzero(rows):
        of.setdefault(names[row], []).append(int(row))
    for key, found in of.items():
        mask = np.zeros(len(table), dtype=bool)
        mask[found] = True
        yield " ".join(key), mask


def _label(table: Table, column: str) -> str:
    unit = next(unit for name, unit, _ in table.columns if name == column)
    name = column.removesuffix(f"_{unit}") if unit else column
    shown = unit.replace("um", "µm").replace("urad", "µrad").replace("deg", "°")
    return f"{name} / {shown}" if unit else name


def _curves(axes: Any, kind: str, table: Table, drawing: dict[str, Any], rows: Mask, curve: str) -> bool:
    """Draws the values of one curve; whether it has a name."""
    x = str(next(drawing[key] for key in ("angle_deg", "x", "order") if key in drawing))
    along = table[x][rows]
    if kind == "Amplitudes":
        real, imaginary = (table[part][rows] for part in drawing["parts"])
        axes.bar(along, np.hypot(real, imaginary), label=curve, alpha=0.7)
        values = [drawing["parts"][0]]
    else:
        values = [measure["column"] for measure in drawing["values"]]
        for measure in drawing["values"]:
            column = measure["column"]
            of = table[column][rows]
            label = " ".join(filter(None, [curve, (measure["symbol"] or _label(table, column)) if len(values) > 1 else ""]))
            if kind == "Polar":
                axes.plot(np.radians(along), of, label=label)
            elif kind == "Bars":
                axes.bar(along, of, label=label, alpha=0.7)
            else:
                axes.plot(along, of, "." if kind == "Points" else "-", label=label)
    if kind == "Polar":
        axes.set_rlabel_position(22.5)
        span = np.nanmax(np.abs(axes.get_ylim()))
        axes.set_ylim(-2 * span, span)
        axes.set_ylabel(_label(table, values[0]), labelpad=30)
    else:
        axes.set_xlabel(_label(table, x))
        axes.set_ylabel("amplitude" if kind == "Amplitudes" else _label(table, values[0]))
    return bool(curve) or len(values) > 1


def _vectors(figure: Any, axes: Any, table: Table, drawing: dict[str, Any], rows: Mask) -> None:
    """Vectors seen along the third axis, which gives their colour, in the layer nearest to the middle of it."""
    place, vector = ([np.asarray(table[column], dtype=float)[rows] for column in drawing[of]] for of in ("place", "vector"))
    known = np.isfinite(place).all(axis=0) & np.isfinite(vector).all(axis=0)
    (x, y, z), (dx, dy, dz) = ([of[known] for of in each] for each in (place, vector))
    layer = z[np.argmin(np.abs(z - (z.min() + z.max()) / 2))]
    here = np.isclose(z, layer)
    arrows = axes.quiver(x[here], y[here], dx[here], dy[here], dz[here], angles="xy")
    figure.colorbar(arrows, label=_label(table, drawing["vector"][2]))
    axes.set_xlabel(_label(table, drawing["place"][0]))
    axes.set_ylabel(f"{_label(table, drawing['place'][1])}, at {_label(table, drawing['place'][2])} = {layer:.4g}")
    axes.set_aspect("equal")


def _map(figure: Any, axes: Any, table: Table, drawing: dict[str, Any], rows: Mask) -> None:
    x, y, value = (table[drawing[of]][rows] for of in ("x", "y", "value"))
    (columns, column), (lines, line) = (np.unique(of, return_inverse=True) for of in (x, y))
    grid = np.full((lines.size, columns.size), np.nan)
    grid[line, column] = value
    drawn = axes.pcolormesh(columns, lines, grid, shading="nearest")
    axes.set_xlabel(_label(table, drawing["x"]))
    axes.set_ylabel(_label(table, drawing["y"]))
    figure.colorbar(drawn, label=_label(table, drawing["value"]))
