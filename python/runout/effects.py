"""What models of a pipeline's own may lack.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """A linear change of one channel, or of readings at points, by a program in any language"""

    plugin: ClassVar[str] = "external"

    about: Union[str, None] = None
    """What it is, in one line."""

    columns: Union[Sequence[str], None] = None
    """Columns of numbers that the program takes of measured points; without it, it changes a channel of turns."""

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    id: str
    """What `[diagnose] effects` and a diagnosis call it: words with `-` between them."""

    labels: Union[Sequence[str], None] = None
    """Columns of texts that it takes of measured points."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    parameters: Sequence[Mapping[str, Any]]
    """Its parameters, at least one: where all are 0, it changes nothing."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""
