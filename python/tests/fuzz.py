"""Calls with random input: `python fuzz.py [CALLS] [SEED]`. Each must give a result or an exception of the documented kinds."""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import runout  # noqa: E402
from conftest import RIG, small_pipeline, turns  # noqa: E402

EXPECTED = (runout.Error, ValueError, TypeError, OverflowError, UnicodeError)
ODD: list[Any] = [None, 0, -1, 2**70, 1e308, float("nan"), float("-inf"), "", "x", "\x00", b"x", [], {}, (), True, 1j, object(), [[]],
                  np.nan, np.zeros((0, 4)), np.int8(3), Path("x"), {"plugin": 3}, {"plugin": "trim"}, RIG]


def samples(draw: random.Random) -> Any:
    """Samples that may be good."""
    good, _ = turns(count=draw.choice([1, 3, 8]), per_rev=draw.choice([16, 64]), seed=draw.randrange(100))
    change = draw.randrange(10)
    if change == 0:
        return draw.choice(ODD)
    if change == 1:
        return good[:: draw.choice([-1, 2, 3])]
    if change == 2:
        return good.astype(draw.choice(["f2", "f4", "i1", "u8", ">f8", "c16", "O", "S5", "M8[s]", "g"]))
    if change == 3:
        good[draw.randrange(good.shape[0])] = draw.choice([np.nan, np.inf, 1e300, 0.0])
    if change == 4:
        return good[:, : draw.randrange(5)]
    if change == 5:
        return np.asfortranarray(good)
    return good


def marks(draw: random.Random) -> Any:
    """Marks that may be good."""
    change = draw.randrange(6)
    if change == 0:
        return draw.choice(ODD)
    if change == 1:
        return [draw.uniform(-5, 600) for _ in range(draw.randrange(8))]
    return np.arange(draw.randrange(10)) * draw.choice([16.0, 64.0, 0.0, 1e-9])


def mutated(draw: random.Random, table: Any) -> Any:
    """A copy of a configuration with something else in one place."""
    if isinstance(table, dict) and table and draw.random() < 0.9:
        key = draw.choice(list(table))
        return table | {key: mutated(draw, table[key])}
    if isinstance(table, list) and table and draw.random() < 0.9:
        index = draw.randrange(len(table))
        return [*table[:index], mutated(draw, table[index]), *table[index + 1 :]]
    return draw.choice(ODD)


def call(draw: random.Random) -> None:
    """One call."""
    pipeline: Any = small_pipeline()
    if draw.random() < 0.4:
        pipeline = mutated(draw, pipeline)
    if draw.random() < 0.05:
        pipeline = draw.choice(ODD)
    overrides = {draw.choice(["rig.sensors.0.angle_deg", "load", "x", "preprocess.0.min_turns", "", "..", "a.b"]): draw.choice(ODD)}
    settings = overrides if draw.random() < 0.2 else None
    kind = draw.randrange(8)
    if kind == 0:
        runout.plan(mutated(draw, RIG), orders=(2, 8))
    elif kind == 1:
        runout.check(pipeline, set=settings)
    else:
        captures = {setup: {"s1": (samples(draw), marks(draw))} for setup in ("initial", "reversed")}
        recording = runout.Recording.from_arrays(captures, sample_rate_hz=draw.choice([1280.0, 1280.0, None, 0.0]))
        command = runout.run if kind < 7 else runout.diagnose
        result = command(pipeline, recording, set=settings, threads=draw.choice([None, 1, 2]))
        for table in result.tables.values():
            table.__arrow_c_stream__()
        result._repr_html_()


def calls(count: int, seed: int) -> int:
    """So many calls; gives how many there were."""
    draw = random.Random(seed)
    for _ in range(count):
        try:
            call(draw)
        except EXPECTED:
            pass
    return count


if __name__ == "__main__":
    count, seed = ([int(word) for word in sys.argv[1:]] + [10_000, 1][len(sys.argv) - 1 :])[:2]
    print(f"{calls(count, seed)} calls, no crash")
