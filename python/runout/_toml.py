"""Configurations as TOML."""

from __future__ import annotations

import dataclasses
import numbers
import os
import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

BARE = re.compile("[A-Za-z0-9_-]+")


def value(item: Any, place: str) -> str:
    """A value in one line; `place` names it in the TypeError for what has no TOML."""
    if dataclasses.is_dataclass(item) and not isinstance(item, type):
        item = as_table(item)
    if isinstance(item, (bool, np.bool_)):
        return "true" if item else "false"
    if isinstance(item, numbers.Integral):
        return str(int(item))
    if isinstance(item, numbers.Real):
        return repr(float(item))
    if isinstance(item, (str, os.PathLike)):
        return string(os.fspath(item), place)
    if isinstance(item, Mapping):
        pairs = (f"{key(name, place)} = {value(of, f'{place}.{name}')}" for name, of in item.items() if of is not None)
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(item, Iterable) and not isinstance(item, (bytes, bytearray)):
        return "[" + ", ".join(value(of, f"{place}.{index}") for index, of in enumerate(item)) + "]"
    if isinstance(item, type):
        raise TypeError(f"{place}: expected an object, found the class {item.__name__}: write {item.__name__}(…)")
    raise TypeError(f"{place}: expected a string, number, boolean, list or dictionary, found {type(item).__name__}")


def string(text: str | bytes, place: str) -> str:
    """A string in quotes."""
    if isinstance(text, bytes):
        raise TypeError(f"{place}: expected a path of text, found bytes")
    escaped = (
        {"\\": "\\\\", '"': '\\"'}.get(letter) or (f"\\u{ord(letter):04x}" if ord(letter) < 32 or ord(letter) == 127 else letter)
        for letter in text
    )
    return '"' + "".join(escaped) + '"'


def key(name: Any, place: str) -> str:
    """A key, in quotes where it needs them."""
    if not isinstance(name, str):
        raise TypeError(f"{place}: expected keys of text, found {name!r}")
    return name if BARE.fullmatch(name) else string(name, place)


def document(table: Mapping[str, Any]) -> str:
    """A document with one line a top-level key."""
    return "".join(f"{key(name, name)} = {value(of, name)}\n" for name, of in table.items() if of is not None)


def as_table(stage: Any) -> dict[str, Any]:
    """The keys of a stage's class that were given."""
    plugin = getattr(stage, "plugin", None)
    named = {} if plugin is None else {"plugin": plugin}
    given = {field.name: getattr(stage, field.name) for field in dataclasses.fields(stage)}
    return named | {name: of for name, of in given.items() if of is not None}
