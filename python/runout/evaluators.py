"""From the tables of a result to values.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """Values of a result by a program in any language"""

    plugin: ClassVar[str] = "external"

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    symbols: Sequence[Mapping[str, Any]]
    """Values that it gives, at least one, and no others: `symbols = [{ symbol = "lobing", unit = "um" }]`. `[[limit]]` may name
    them."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""
