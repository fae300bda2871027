"""Writes files of four channels to a folder and measures how long the reference libraries read them: measure_speed.py FOLDER.

    RUNOUT_SPEED=FOLDER cargo nextest run --release -p runout-channels --run-ignored all seconds --no-capture
"""

import pathlib
import sys
import time

import numpy as np
import pyuff
import soundfile
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from scipy.io import loadmat, savemat

FOLDER = pathlib.Path(sys.argv[1])
FOLDER.mkdir(parents=True, exist_ok=True)
RNG = np.random.default_rng(45)
COUNT = 2_000_000
channels = {f"X{number}": RNG.normal(size=COUNT) for number in range(4)}
few = {name: data[: COUNT // 20] for name, data in channels.items()}

with TdmsWriter(FOLDER / "speed.tdms") as file:
    for start in range(0, COUNT, 10_000):
        file.write_segment([ChannelObject("g", name, data[start : start + 10_000]) for name, data in channels.items()])
savemat(FOLDER / "speed.mat", channels)
savemat(FOLDER / "speed-packed.mat", channels, do_compression=True)
np.save(FOLDER / "speed.npy", np.column_stack(list(channels.values())))
soundfile.write(FOLDER / "speed.wav", np.column_stack(list(channels.values())) / 8, 48000, subtype="PCM_24")
(FOLDER / "speed.uff").unlink(missing_ok=True)
for name, data in few.items():
    head = {"type": 58, "binary": 0, "func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": name, "ref_ent_name": "NONE",
            "data": data, "x": np.arange(len(data)) * 0.001, "ord_data_type": 4, "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.001,
            "num_pts": len(data), "id1": "", "id2": "", "id3": "", "id4": "", "id5": "", "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8,
            "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0}
    pyuff.UFF(str(FOLDER / "speed.uff")).write_sets([head], mode="add")


def tdms(path):
    with TdmsFile.open(path) as file:
        return [channel[:] for group in file.groups() for channel in group.channels()]


for name, read in (("speed.tdms", tdms), ("speed.mat", loadmat), ("speed-packed.mat", loadmat), ("speed.npy", np.load),
                   ("speed.wav", lambda path: soundfile.read(path)), ("speed.uff", lambda path: pyuff.UFF(str(path)).read_sets())):
    best = min((lambda begun: (read(FOLDER / name), time.perf_counter() - begun)[1])(time.perf_counter()) for _ in range(3))
    print(f"{name}: {best:.3f} s")
