"""Times runout's stages and the peers' in turns and writes a Markdown table.

usage: compare.py PROGRAM PEERS SCRATCH ROUNDS STATIONS

PROGRAM is the example `stages`. SCRATCH holds the record of the campaign's benchmark.
"""
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

program, peers, scratch = (Path(path).resolve() for path in sys.argv[1:4])
rounds, stations = map(int, sys.argv[4:6])
here = Path(__file__).parent
folder = scratch / "stages"
record = scratch / f"record-f64-{stations}.h5"
ROWS = (
    # name, ours, theirs, how many times the peer's speed is wanted
    ("zero-phase low-pass, order 4", "low-pass", "low-pass", 5),
    ("resample and average; peer: linear", "average", "average", 8),
    ("the same and motion of every turn from three points", "average-and-motion-of-every-turn", "average-and-motion", 3),
    ("read CSV; peer: polars, one thread", "csv-read", "csv-read", 2),
    ("read CSV, all threads; peer: polars, all threads", "csv-read-all-threads", "csv-read-all-threads", 2),
    ("read two CSV files, a thread each; peer: polars, all threads", "csv-read-two-files", "csv-read-two-files", 2),
    ("read HDF5, contiguous; peer: h5py", "hdf5-read", "hdf5-read", 1),
    ("the same with the file's checksum; peer: h5py, without", "hdf5-read-and-checksum", "hdf5-read", None),
    ("write Parquet; peer: pyarrow", "parquet-write", "parquet-write", 1),
    ("write HDF5; peer: h5py", "hdf5-write", "hdf5-write", 1),
)


def write_csv():
    """One capture with its marks, once."""
    path = folder / "capture.csv"
    if path.exists():
        return
    with h5py.File(record) as file:
        samples, marks = file["initial/s000/samples"][...], file["initial/s000/index"][...]
    index = np.zeros((len(samples), 1))
    index[np.minimum(np.ceil(marks).astype(int), len(samples) - 1)] = 1
    formats = ["%.6f"] * samples.shape[1] + ["%d"]
    part = path.with_suffix(".part")
    np.savetxt(part, np.hstack([samples, index]), fmt=formats, delimiter=",", header="S1,S2,S3,S4,index", comments="")
    os.replace(part, path)


def seconds(command, **variables):
    output = subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True, env=os.environ | variables).stdout
    return {line["stage"]: line["seconds"] for line in map(json.loads, output.splitlines())}


def medians(all_rounds):
    return {stage: statistics.median(one[stage] for one in all_rounds) for stage in all_rounds[0]}


folder.mkdir(parents=True, exist_ok=True)
write_csv()
ours, theirs = [], []
for _ in range(rounds):
    ours.append(seconds([program, here.parent / "campaign/pipeline.toml", record, folder]))
    peer = [sys.executable, "-B", here / "peers.py", peers, scratch, stations]
    theirs.append(seconds(peer) | seconds(peer, POLARS_MAX_THREADS=str(os.cpu_count())))
ours, theirs = medians(ours), medians(theirs)
theirs["average-and-motion"] = theirs["average"] + theirs["motion-of-every-turn"]
lines = [
    f"One thread but where two are named, the least of 7 runs, median of {rounds} rounds in turns; {os.cpu_count()} processors, nothing else ran",
    "",
    "| stage | runout, ms | peer, ms | peer / runout | wanted |",
    "| --- | --- | --- | --- | --- |",
]
for name, mine, peer, wanted in ROWS:
    ratio = theirs[peer] / ours[mine]
    lines.append(f"| {name} | {1e3 * ours[mine]:.2f} | {1e3 * theirs[peer]:.2f} | {ratio:.2f} | {wanted or ''} |")
lines.append(f"| separate one station, two setups | {1e3 * ours['separate']:.2f} | | | |")
print("\n".join(lines))
(scratch / "table-stages.md").write_text("\n".join(lines) + "\n")
