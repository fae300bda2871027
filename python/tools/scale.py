"""Times batches on Ray beside `runout batch`: `python python/tools/scale.py [--recordings N] [--campaigns N] [--rounds N]`.

Prints recordings a second of `runout batch` with one and two jobs and of `runout.ray.run` with one and two tasks at a time, in turns, on recordings of 2 MB; and
campaigns a second of `runout.ray.campaigns`, where asked for. Workers are started before the clock. Processor time is user and system time of all processors of the
machine, less what it had to do for other work: on a machine that others use it says nothing.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import ray

import runout
import runout.ray

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "batch"
PIPELINE = BENCHMARK / "pipeline.toml"
JOBS = (1, 2)


def recordings(folder: Path, count: int) -> list[str]:
    """Recordings that differ in their checksum only."""
    first = folder / "first.h5"
    runout.simulate(BENCHMARK / "scenario.toml", first)
    source = folder / "recordings"
    source.mkdir()
    for number in range(count):
        copy = source / f"part-{number:05}.h5"
        shutil.copy(first, copy)
        # Bytes behind the end of an HDF5 file are not read, and make its checksum its own.
        with copy.open("ab") as file:
            file.write(number.to_bytes(8, "little"))
    return [str(path) for path in sorted(source.iterdir())]


def busy() -> float:
    """Processor seconds of this machine so far; 0 where the system does not say it."""
    try:
        user, nice, system = map(int, Path("/proc/stat").read_text().split()[1:4])
    except OSError:
        return 0.0
    return (user + nice + system) / os.sysconf("SC_CLK_TCK")


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds of some work, and processor seconds of the machine meanwhile."""
    start, before = time.perf_counter(), busy()
    work()
    return time.perf_counter() - start, busy() - before


def batch(paths: list[str], out: Path, jobs: int) -> None:
    """The batch of the command line."""
    words = [sys.executable, "-m", "runout", "batch", str(PIPELINE), *paths, "--out", str(out), "--jobs", str(jobs)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def on_ray(paths: list[str], out: Path, tasks: int) -> None:
    """The same on Ray."""
    report = runout.ray.run(PIPELINE, paths, out, concurrency=tasks)
    assert len(report.of("done")) == len(paths), report.failed


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--recordings", type=int, default=100)
    words.add_argument("--campaigns", type=int, default=0)
    words.add_argument("--rounds", type=int, default=1)
    asked = words.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="runout-scale-"))
    ray.init(num_cpus=max(JOBS), include_dashboard=False, log_to_driver=False)
    try:
        paths = recordings(folder, asked.recordings)
        on_ray(paths[: 2 * max(JOBS)], folder / "warm", max(JOBS))
        ways = [(f"{name}, {jobs}", way, jobs) for name, way in (("batch", batch), ("Ray", on_ray)) for jobs in JOBS]
        found: dict[str, list[tuple[float, float]]] = {name: [] for name, _, _ in ways}
        for round in range(asked.rounds):
            for number, (name, way, jobs) in enumerate(ways):
                # All go at the end: some file systems slow down after a removal of many files.
                out = folder / f"out-{round}-{number}"
                found[name].append(timed(lambda: way(paths, out, jobs)))  # noqa: B023
        print(f"{len(paths)} recordings of {Path(paths[0]).stat().st_size / 1e6:.1f} MB, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}\n")
        print("| jobs or tasks | time, s | processor time, s | recordings a second | times one job or task | time over that of `batch` |\n| --- | --- | --- | --- | --- | --- |")
        seconds = {name: [statistics.median(column) for column in zip(*times)] for name, times in found.items()}
        for name, (elapsed, spent) in seconds.items():
            way, jobs = name.split(", ")
            one, of_batch = seconds[f"{way}, {JOBS[0]}"][0], seconds[f"batch, {jobs}"][0]
            print(f"| {name} | {elapsed:.1f} | {spent:.1f} | {len(paths) / elapsed:.2f} | {one / elapsed:.2f} | {elapsed / of_batch:.2f} |")
        if asked.campaigns:
            few = {"recording.revolutions": 24}
            elapsed, _ = timed(lambda: runout.ray.campaigns(
                BENCHMARK / "scenario.toml", PIPELINE, range(asked.campaigns), folder / "campaigns", vary=lambda seed: few))
            print(f"\n{asked.campaigns} campaigns in {elapsed:.1f} s: {asked.campaigns / elapsed:.2f} a second")
    finally:
        ray.shutdown()
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
