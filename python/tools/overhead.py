"""Times runs from Python beside the command line, in turns: `python python/tools/overhead.py [--program FILE] [--record FILE] [--rounds N]`.

Prints three tables: the campaign of `cargo xtask bench-campaign` (its record is made by that command), one station of 60 turns, and peak memory of a run on arrays.
Each run from Python is in a process of its own with `runout` imported before the clock starts; that of the command line runs from the start of the program to its
end. Processor time is user and system.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import runout

ROOT = Path(__file__).resolve().parents[2]
CAMPAIGN = ROOT / "benchmarks" / "campaign" / "pipeline.toml"
STATION = ROOT / "examples" / "01-four-sensor"
MEBIBYTE = 1 << 20

FROM_PYTHON = """
import json, resource, sys, time
import runout
def spent():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
pipeline, settings, calls = sys.argv[1], json.loads(sys.argv[2]), int(sys.argv[3])
for call in range(calls):
    before, start = spent(), time.perf_counter()
    runout.run(pipeline, set=settings)
    print(json.dumps([time.perf_counter() - start, spent() - before]))
"""

ON_ARRAYS = """
import sys
import numpy, runout
def peak():
    return int(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1]) / 1024
turns, per_rev = int(sys.argv[1]), 2560
angle = numpy.arange(turns * per_rev) * (2 * numpy.pi / per_rev)
samples = numpy.empty((angle.size, 4))
for channel in range(4):
    numpy.cos(3 * angle + channel, out=samples[:, channel])
marks = numpy.arange(turns + 1) * float(per_rev)
rig = {"part_radius_mm": 30, "sensors": [{"id": f"S{n}", "angle_deg": 90 * (n % 2), "z_mm": 30 * (n // 2), "section": "ab"[n // 2]} for n in range(4)],
       "setups": [{"id": "a"}, {"id": "b", "part_deg": 180, "sensors_deg": 180}]}
average = {"plugin": "synchronous-average", "samples_per_rev": 512}
del angle
# From here on the peak counts anew.
with open("/proc/self/clear_refs", "w") as file:
    file.write("5")
before = peak()
recording = runout.Recording.from_arrays({"a": {"s1": (samples, marks)}, "b": {"s1": (samples, marks)}}, sample_rate_hz=25600)
pipeline = {"rig": rig, "load": {"plugin": "arrays"}, "preprocess": [average], "separate": {"plugin": "four-sensor-reversal"}}
runout.run(pipeline, recording)
print(samples.nbytes / 2**20, before, peak())
"""


def of_children(words: list[str]) -> tuple[float, float]:
    """Seconds and processor seconds of a program."""
    used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])  # noqa: E731
    before, start = used(), time.perf_counter()
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start, used() - before


def from_python(pipeline: Path, settings: dict[str, object], calls: int) -> list[tuple[float, float]]:
    """Seconds and processor seconds of each of some calls in one process."""
    words = [sys.executable, "-c", FROM_PYTHON, str(pipeline), json.dumps(settings), str(calls)]
    said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    return [tuple(json.loads(line)) for line in said.splitlines()]


def beside(name: str, program: str, pipeline: Path, settings: dict[str, object], rounds: int, calls: int) -> None:
    """One line for each way, the medians over the rounds, and what Python takes more."""
    words = [f"--set={key}={value if isinstance(value, list) else json.dumps(value)}" for key, value in settings.items()]
    lines: list[tuple[float, float]] = []
    calls_made: list[tuple[float, float]] = []
    for _ in range(rounds):
        lines.append(of_children([program, "run", str(pipeline), *words]))
        # The first call of a process reads the program's pages.
        calls_made.extend(from_python(pipeline, settings, calls)[calls > 1 :])
    median: Callable[[int, list[tuple[float, float]]], float] = lambda of, all_of: statistics.median(one[of] for one in all_of)  # noqa: E731
    line, call = [[median(of, found) for of in (0, 1)] for found in (lines, calls_made)]
    print(f"| {name} | {1e3 * line[0]:.1f} | {1e3 * line[1]:.1f} | {1e3 * call[0]:.1f} | {1e3 * call[1]:.1f} "
          f"| {1e3 * (call[1] - line[1]):+.1f} ({100 * (call[1] / line[1] - 1):+.1f} %) |")


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--program", default=shutil.which("runout") or str(ROOT / "target" / "release" / "runout"))
    words.add_argument("--record", type=lambda text: Path(text).resolve(), default=ROOT / "target" / "bench" / "record-f64-40.h5")
    words.add_argument("--rounds", type=int, default=5)
    asked = words.parse_args()
    print(f"Load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; medians of {asked.rounds} rounds in turns\n")
    print("| run | command line, ms | its CPU, ms | from Python, ms | its CPU, ms | more CPU from Python, ms |\n| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        if asked.record.is_file():
            settings: dict[str, object] = {"load.path": str(asked.record), "export": []}
            beside("campaign, 40 stations", asked.program, CAMPAIGN, settings, asked.rounds, 1)
        else:
            print(f"(no {asked.record}: `cargo xtask bench-campaign` makes it)")
        station = Path(folder) / "station.h5"
        runout.simulate(STATION / "scenario.toml", station, set={"recording.stations.count": 1, "recording.revolutions": 60})
        beside("one station, 60 turns", asked.program, STATION / "pipeline.toml", {"load.path": str(station), "export": []}, asked.rounds, 10)
    print("\n| samples in memory, MiB | peak before the run, MiB | peak of the run, MiB | more, MiB |\n| --- | --- | --- | --- |")
    for turns in (500, 4000):
        found = subprocess.run([sys.executable, "-c", ON_ARRAYS, str(turns)], check=True, capture_output=True, text=True)
        held, before, peak = map(float, found.stdout.split())
        print(f"| {held:.0f} | {before:.0f} | {peak:.0f} | {peak - before:.0f} |")


if __name__ == "__main__":
    main()
