"""Small pages for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice

MOST_ROWS = 60


class Shown(str):
    """A piece of HTML that a notebook shows."""

    def _repr_html_(self) -> str:
        return str(self)


def cell(content: object) -> str:
    """A number to six digits, or a text."""
    if content is None:
        return ""
    return f"{content:.6g}" if isinstance(content, float) else escape(str(content))


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of the first rows, and how many there are besides; nothing where there is none."""
    rows = iter(rows)
    shown = list(islice(rows, MOST_ROWS))
    if not shown:
        return ""
    more = sum(1 for _ in rows)
    lines = ["<tr>" + "".join(f"<th>{escape(name)}</th>" for name in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{cell(one)}</td>" for one in row) + "</tr>" for row in shown]
    rest = f"<p>and {more} more</p>" if more else ""
    return "<table>" + "".join(lines) + "</table>" + rest


def page(title: str, warnings: Sequence[str], *parts: str) -> str:
    """A title, warnings, and what is below."""
    listed = "".join(f"<li>{escape(text)}</li>" for text in warnings)
    return f"<h4>{escape(title)}</h4>" + (f"<ul>{listed}</ul>" if listed else "") + "".join(parts)
