"""From samples to profiles.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class Trim:
    """Sets start-up and run-down aside"""

    plugin: ClassVar[str] = "trim"

    end_turns: Union[int, None] = None
    """Turns that are set aside at the end in any case. Default: 0."""

    speed_tolerance_percent: Union[float, None] = None
    """Turns at the ends whose length is off the capture's median by more than this are start-up and run-down, in percent. Default:
    1.0."""

    start_turns: Union[int, None] = None
    """Turns that are set aside at the start in any case. Default: 0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LowPass:
    """Zero-phase Butterworth low-pass, forward and backward"""

    plugin: ClassVar[str] = "low-pass"

    cutoff_hz: float
    """−3 dB frequency of one pass, in Hz; the two passes together are −3 dB somewhat below, as the result says."""

    order: Union[int, None] = None
    """Order of one pass, 1 to 8. Default: 4."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SynchronousAverage:
    """Averages turns on equal angles, one harmonic at a time, with their covariance"""

    plugin: ClassVar[str] = "synchronous-average"

    min_turns: Union[int, None] = None
    """Fewest turns that make an average, at least 1; the covariance needs 2. Default: 5."""

    outlier_sigma: Union[float, None] = None
    """Turns are left out whose distance (root mean square over the turn, any channel) from the median turn around them is more
    than this many times the usual distance; without it, none are."""

    samples_per_rev: int
    """Equal angles per turn of the average, 4 to 131072; it has the orders below half of them, as far as the recording has them.
    Above 4096, and far above the recording's own samples a turn (8 times, rounded up to a power of two), fewer are used, with a
    warning."""

    speed_tolerance_percent: Union[float, None] = None
    """A mean speed that differs from the stated one by more is a warning, in percent. Default: 2.0."""

    turn_tolerance_percent: Union[float, None] = None
    """Turns whose length is off the capture's median by more are left out, in percent, below 50. Default: 5.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """A change of averages, harmonic by harmonic, by a program in any language"""

    plugin: ClassVar[str] = "external"

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""
