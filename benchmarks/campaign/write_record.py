"""Writes the peers' record once, as the peers and as runout read it; with --i16 also as a converter's codes.

usage: write_record.py PEERS SCRATCH SAMPLES_PER_REV TURNS STATIONS [--i16]

PEERS/record.py computes it, a section in a setup at a time. What is already there with the same settings stays.
"""
import os
import sys

import h5py
import numpy as np

peers, scratch = sys.argv[1:3]
n, m, stations = map(int, sys.argv[3:6])
sys.path.insert(0, peers)
from record import section  # noqa: E402

SPEED_RPM = 600.0
SCALE_UM = 20.0 / 32768  # a code of the 16-bit converter
SETUPS = ("initial", "reversed")


def same(path):
    try:
        with h5py.File(path) as file:
            return (file.attrs["n"], file.attrs["m"], file.attrs["sections"]) == (n, m, stations)
    except (OSError, KeyError):
        return False


def write(name, dtype):
    """One pair of files: SCRATCH/peers-NAME-STATIONS.h5, and SCRATCH/record-… in the measurement format."""
    paths = [f"{scratch}/{kind}-{name}-{stations}.h5" for kind in ("peers", "record")]
    if all(same(path) for path in paths):
        return
    parts = [path + ".part" for path in paths]
    with h5py.File(parts[0], "w") as theirs, h5py.File(parts[1], "w", libver="v110") as ours:
        ours.attrs.update(format="runout-measurement", version=1, length_unit="um")
        for file in (theirs, ours):
            file.attrs.update(n=n, m=m, sections=stations, scale=SCALE_UM)
        for k in range(stations):
            for s, setup in enumerate(SETUPS):
                data, index = section(n, m, k, s)
                if dtype == "i2":
                    data = np.clip(np.round(data / SCALE_UM), -32768, 32767).astype("i2")
                theirs[f"setup{s}/section{k:03d}"] = data
                theirs[f"setup{s}/index{k:03d}"] = index
                station = ours.create_group(f"{setup}/s{k:03d}")
                station.attrs.update(z_mm=float(k), speed_rpm=SPEED_RPM)
                samples = station.create_dataset("samples", data=np.ascontiguousarray(data.T))
                samples.attrs["sensors"] = ["S1", "S2", "S3", "S4"]
                samples.attrs["sample_rate_hz"] = n * SPEED_RPM / 60
                if dtype == "i2":
                    samples.attrs.update(scale=SCALE_UM, offset=0.0)
                station["index"] = index
    for part, path in zip(parts, paths):
        os.replace(part, path)
    print(f"wrote {', '.join(paths)}", file=sys.stderr)


os.makedirs(scratch, exist_ok=True)
write("f64", "f8")
if "--i16" in sys.argv:
    write("i16", "i2")
