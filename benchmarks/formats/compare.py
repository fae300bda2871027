"""Writes large files by the reference libraries and reads each by its library and by runout, in turns and on one thread; prints a table.

    compare.py CHANNEL_SECONDS MAP_SECONDS FOLDER [ROUNDS]
"""

import pathlib
import subprocess
import sys
import time

import numpy as np
import pyuff
import soundfile
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from scipy.io import loadmat, savemat
from surfalize import Surface

CHANNELS, MAPS, FOLDER = (pathlib.Path(word) for word in sys.argv[1:4])
ROUNDS = int(sys.argv[4]) if len(sys.argv) > 4 else 5
COUNT = 2_000_000
SIDE = 1500


def write():
    rng = np.random.default_rng(45)
    channels = {f"X{number}": rng.normal(size=COUNT) for number in range(4)}
    with TdmsWriter(FOLDER / "speed.tdms") as file:
        for start in range(0, COUNT, 10_000):
            file.write_segment([ChannelObject("g", name, data[start : start + 10_000]) for name, data in channels.items()])
    savemat(FOLDER / "speed.mat", channels)
    savemat(FOLDER / "packed.mat", channels, do_compression=True)
    np.save(FOLDER / "speed.npy", np.column_stack(list(channels.values())))
    soundfile.write(FOLDER / "speed.wav", np.column_stack(list(channels.values())) / 8, 48000, subtype="PCM_24")
    (FOLDER / "speed.uff").unlink(missing_ok=True)
    for name, data in channels.items():
        data = data[: COUNT // 20]
        head = {"type": 58, "binary": 0, "func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": name,
                "ref_ent_name": "NONE", "data": data, "x": np.arange(len(data)) * 0.001, "ord_data_type": 4, "abscissa_spacing": 1,
                "abscissa_min": 0.0, "abscissa_inc": 0.001, "num_pts": len(data), "id1": "", "id2": "", "id3": "", "id4": "", "id5": "",
                "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0}
        pyuff.UFF(str(FOLDER / "speed.uff")).write_sets([head], mode="add")
    surface = Surface(rng.normal(size=(SIDE, SIDE)), 0.5, 0.5)
    for end in ("x3p", "sdf", "sur"):
        surface.save(FOLDER / f"speed.{end}")


def tdms(path):
    with TdmsFile.open(path) as file:
        return [channel[:] for group in file.groups() for channel in group.channels()]


# File, library, its reader, and how many times as fast runout has to be.
FILES = [
    ("speed.tdms", "npTDMS", tdms, 2),
    ("speed.mat", "SciPy", loadmat, 1),
    ("packed.mat", "SciPy", loadmat, 1),
    ("speed.npy", "NumPy", np.load, 1),
    ("speed.wav", "soundfile", lambda path: soundfile.read(path), 1),
    ("speed.uff", "pyuff", lambda path: pyuff.UFF(str(path)).read_sets(), 5),
    ("speed.x3p", "surfalize", Surface.load, 1),
    ("speed.sdf", "surfalize", Surface.load, 1),
    ("speed.sur", "surfalize", Surface.load, 1),
]


def seconds(read, path):
    begun = time.perf_counter()
    read(path)
    return time.perf_counter() - begun


def of_runout(path):
    program = MAPS if path.suffix in (".x3p", ".sdf", ".sur") else CHANNELS
    return float(subprocess.run([program, path], check=True, capture_output=True, text=True).stdout.split()[0])


FOLDER.mkdir(parents=True, exist_ok=True)
write()
print("| file | MB | library | library, s | runout, s | times as fast | asked for |\n| --- | --- | --- | --- | --- | --- | --- |")
for name, library, read, asked in FILES:
    path = FOLDER / name
    both = [(seconds(read, path), of_runout(path)) for _ in range(ROUNDS)]
    theirs, ours = (sorted(column)[ROUNDS // 2] for column in zip(*both))
    print(f"| {name} | {path.stat().st_size / 1e6:.0f} | {library} | {theirs:.3f} | {ours:.3f} | {theirs / ours:.2f} | {asked} |", flush=True)
