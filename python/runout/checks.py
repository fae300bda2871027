"""What `check` compares a pipeline with.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotorSpeeds:
    """Warns where a rotor has a mode near an order of the speed of the campaign"""

    plugin: ClassVar[str] = "rotor-speeds"

    orders: Union[Sequence[float], None] = None
    """Multiples of the speed that matter."""

    path: str
    """TOML file of the rotor, relative to this one."""

    speed_rpm: Union[Sequence[float], None] = None
    """Speeds of the campaign, in rpm; without them those of the recording."""

    within_percent: Union[float, None] = None
    """How near a mode may not be, in percent of order times speed. Default: 15.0."""
