"""Times a station of example 26 by a Python object, by the program of the same class and by the built-in method:
`python python/tools/own_separator.py [--stations N] [--rounds N]`.

Prints seconds a station of a whole run on one thread, the median of the rounds, without what a run takes before its first station (the program's start).
"""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import runout

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "26-own-program"
SCRIPT = EXAMPLE / "served.py"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stations", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    words = parser.parse_args()
    spec = importlib.util.spec_from_file_location("served", SCRIPT)
    assert spec is not None and spec.loader is not None
    served = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(served)
    methods: dict[str, dict[str, Any]] = {
        "built-in three-point": {"plugin": "three-point", "second_order": False},
        "object": {"plugin": served.ThreePoint()},
        "program": {"plugin": "external", "command": [sys.executable, str(SCRIPT)]},
    }
    with tempfile.TemporaryDirectory() as folder:
        files = {}
        for count in (2, words.stations):
            files[count] = Path(folder) / f"shaft{count}.h5"
            runout.simulate(EXAMPLE / "scenario.toml", files[count], set={"recording.stations.count": count})
        text = (EXAMPLE / "pipeline.toml").read_text(encoding="utf-8")
        stages = Path(folder) / "pipeline.toml"
        stages.write_text(text.partition("# A value that no standard has")[0], encoding="utf-8")
        spent: dict[str, list[float]] = {name: [] for name in methods}
        for _ in range(words.rounds):
            for name, separate in methods.items():
                seconds = []
                for file in files.values():
                    start = time.perf_counter()
                    runout.run(stages, set={"load.path": str(file), "separate": separate}, threads=1)
                    seconds.append(time.perf_counter() - start)
                spent[name].append((seconds[1] - seconds[0]) / (words.stations - 2))
    base = statistics.median(spent["built-in three-point"])
    for name, each in spent.items():
        found = statistics.median(each)
        print(f"{name:22} {1e3 * found:8.2f} ms a station  {100 * (found / base - 1):+6.1f} %")


if __name__ == "__main__":
    main()
