"""Times a batch on Ray: `python python/tools/scale.py [RECORDINGS]`. Prints recordings a second for 1 and 2 tasks at a time."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

import ray

import runout
import runout.ray

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "01-four-sensor"


def main(count: int) -> None:
    folder = Path(tempfile.mkdtemp(prefix="runout-scale-"))
    try:
        first = folder / "first.h5"
        few = {"recording.stations.count": 2, "recording.revolutions": 120, "recording.format": "i16"}
        runout.simulate(EXAMPLE / "scenario.toml", first, set=few)
        source = folder / "recordings"
        source.mkdir()
        for number in range(count):
            copy = source / f"part-{number:05}.h5"
            shutil.copy(first, copy)
            # Bytes behind the end of an HDF5 file are not read, and make its checksum its own.
            with copy.open("ab") as file:
                file.write(number.to_bytes(8, "little"))
        set_of = {"load.path": str(first), "export": []}
        start = time.perf_counter()
        for _ in range(10):
            runout.run(EXAMPLE / "pipeline.toml", set=set_of, threads=1)
        alone = (time.perf_counter() - start) / 10
        print(json.dumps({"recording_mb": first.stat().st_size / 1e6, "seconds_a_run_in_one_process": alone}))
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        for tasks in (1, 2):
            start = time.perf_counter()
            report = runout.ray.run(EXAMPLE / "pipeline.toml", source, folder / f"out-{tasks}", concurrency=tasks)
            seconds = time.perf_counter() - start
            done = len(report.of("done"))
            print(json.dumps({"tasks": tasks, "done": done, "seconds": seconds, "recordings_a_second": done / seconds}))
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
