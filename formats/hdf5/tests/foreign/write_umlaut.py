"""Writes measurements whose stations have names beyond ASCII, as h5py does by default: write_umlaut.py FOLDER.

umlaut-few.h5 has three stations a setup, umlaut-many.h5 twelve: from nine on, the library keeps the links of a group in a heap.
"""

import pathlib
import sys

import h5py
import numpy as np

TURN, TURNS = 50, 3
for file_name, names in (("few", ["süd", "größe 2", "軸"]), ("many", [f"стан {number}" for number in range(12)])):
    with h5py.File(pathlib.Path(sys.argv[1]) / f"umlaut-{file_name}.h5", "w") as file:
        file.attrs.update(format="runout-measurement", version=1, length_unit="um")
        for setup in ("initial", "reversed"):
            for number, name in enumerate(names):
                station = file.create_group(f"{setup}/{name}")
                station.attrs["z_mm"] = float(number)
                station["index"] = np.arange(0.25, TURN * TURNS, TURN)
                values = np.random.default_rng(number).normal(size=(TURN * TURNS, 2)).round(2).astype("f4")
                station.create_dataset("samples", data=values).attrs["sensors"] = ["S1", "S2"]
