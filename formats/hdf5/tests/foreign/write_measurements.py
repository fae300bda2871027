"""Writes measurement files the ways that h5py users do: write_measurements.py FOLDER.

Each holds the same readings: S1 is sample / 8 um, S2 its negative; a turn begins every 100 samples, at 0.25.
"""

import pathlib
import sys

import h5py
import numpy

COUNT = 5000
folder = pathlib.Path(sys.argv[1])
rows = numpy.arange(COUNT)
um = numpy.column_stack([rows, -rows]) / 8


def write(name, samples, sensors=("S1", "S2"), encoder=False, kind=float, **attributes):
    with h5py.File(folder / f"{name}.h5", "w") as file:
        file.attrs["format"] = numpy.bytes_("runout-measurement") if name == "fixed-text" else "runout-measurement"
        file.attrs["version"] = 1
        file.attrs["length_unit"] = "um"
        for setup in ("initial", "reversed"):
            group = file.create_group(f"{setup}/only")
            group.attrs["z_mm"] = 5
            group.attrs["speed_rpm"] = numpy.float32(60)
            chunks = {"chunks": (700, 1), "compression": "gzip", "shuffle": True} if name != "plain" else {}
            dataset = group.create_dataset("samples", data=samples, **chunks)
            dataset.attrs["sensors"] = sensors
            dataset.attrs["sample_rate_hz"] = [100.0]
            for key, value in attributes.items():
                dataset.attrs[key] = value
            if encoder:
                # An encoder that counts down, from its zero at 0.25 samples.
                group.create_dataset("angle_deg", data=-(rows - 0.25) * 3.6)
            else:
                group.create_dataset("index", data=numpy.arange(50) * 100 + 0.25)


temperature = numpy.full(COUNT, 20.0)
write(
    "plain",
    numpy.column_stack([um[:, 1], temperature, um[:, 0]]),
    sensors=["S2", "temperature", "S1"],
)
write("big-endian", um.astype(">f8"))
write("float32", um.astype("f4"))
write("codes", numpy.column_stack([rows, -rows]).astype("i2"), scale=0.125, offset=0.0)
write(
    "codes-per-channel",
    numpy.column_stack([rows - 1000, rows]).astype(">i4"),
    scale=[0.125, -0.125],
    offset=[125.0, 0.0],
    converter_limits=[-8_388_608, 8_388_607],
)
write("fixed-text", um, sensors=numpy.array([b"S1", b"S2"]))
write("encoder", um, encoder=True)
