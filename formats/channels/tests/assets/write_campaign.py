"""Writes one small campaign in all formats with their reference libraries: three probes around a part of three lobes of ±1.5 µm.

    python write_campaign.py

The probes look at 0°, 99.84375° and 202.5°; the channel `Index` has a pulse of 5 V a turn.
"""

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.ipc
import pyarrow.parquet as pq
import pyuff
import soundfile
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from references import FOLDER

OUT = FOLDER / "campaign"
PER_TURN, TURNS, RATE_HZ = 64, 9, 640.0
angle = (np.arange(PER_TURN * TURNS) - 20.3) * 2 * np.pi / PER_TURN
noise = np.random.default_rng(45)
channels = {}
for name, place_deg in (("A", 0.0), ("B", 99.84375), ("C", 202.5)):
    place = np.radians(place_deg)
    lobes = 1.5 * np.cos(3 * (place - angle)) + 4.0 * np.cos(place - angle)
    channels[name] = (lobes + noise.normal(0, 0.01, len(angle))).astype("f4")
# A pulse of trapezoid shape, whose rising edge crosses half of its height where the angle is a whole number of turns.
phase = (angle / (2 * np.pi) + 0.5) % 1.0 - 0.5
channels["Index"] = (5.0 * np.clip(0.5 + phase * PER_TURN / 4, 0, 1) * (phase < 0.3)).astype("f4")
units = {name: "V" if name == "Index" else "µm" for name in channels}
time = np.arange(len(angle)) / RATE_HZ

with TdmsWriter(OUT / "campaign.tdms") as file:
    file.write_segment([ChannelObject("Run 0", name, data, {"unit_string": units[name], "wf_increment": 1 / RATE_HZ}) for name, data in channels.items()])
savemat(OUT / "campaign.mat", {"Run0": {**channels, "unit": "um", "fs": RATE_HZ}}, do_compression=True)
with h5py.File(OUT / "campaign-7.3.mat", "w", userblock_size=512) as file:
    for name, data in channels.items():
        file.create_dataset(f"Run0/{name}", data=data[None, :]).attrs["MATLAB_class"] = np.bytes_("single")
    file.create_dataset("fs", data=[[RATE_HZ]]).attrs["MATLAB_class"] = np.bytes_("double")
with open(OUT / "campaign-7.3.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
with h5py.File(OUT / "campaign.h5", "w") as file:
    for name, data in channels.items():
        dataset = file.create_dataset(f"runs/Run 0/{name}/values", data=data * 1e-3 if name != "Index" else data, chunks=(200,), compression="gzip")
        dataset.attrs.update(unit="mm" if name != "Index" else "V", fs=RATE_HZ)
lines = ["Logger,7", "", "time_s," + ",".join(f"{name} [{units[name]}]" for name in channels)]
lines += [",".join(f"{value:.6f}" for value in row) for row in zip(time, *channels.values())]
(OUT / "campaign.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
lines = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t,", "X_Columns\tNo", "***End_of_Header***\t", "\t", "Channels\t4",
         "Y_Unit_Label\tµm\tµm\tµm\tVolts", "Delta_X" + f"\t{1 / RATE_HZ:.7f}".replace(".", ",") * 4, "***End_of_Header***",
         "X_Value\tA\tB\tC\tIndex\tComment"]
lines += ["\t" + "\t".join(f"{value:.6f}".replace(".", ",") for value in row) for row in zip(*channels.values())]
(OUT / "campaign.lvm").write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")
np.savez_compressed(OUT / "campaign.npz", **channels, fs=RATE_HZ)
np.save(OUT / "campaign.npy", np.column_stack(list(channels.values())))
table = pa.table(list(channels.values()), pa.schema([pa.field(name, pa.float32(), metadata={"unit": units[name]}) for name in channels]))
pq.write_table(table, OUT / "campaign.parquet", compression="gzip")
with pa.ipc.new_file(str(OUT / "campaign.arrow"), table.schema) as file:
    file.write_table(table)
(OUT / "campaign.uff").unlink(missing_ok=True)
for name, data in channels.items():
    none = {f"{axis}_axis_{kind}": "NONE" for axis in ("orddenom", "z_axis") for kind in ("lab", "units_lab")}
    pyuff.UFF(str(OUT / "campaign.uff")).write_sets([{
        "type": 58, "binary": 0, "ord_data_type": 2, "id1": "Run 0", "id2": "", "id3": "", "id4": "", "id5": "", "func_type": 1, "rsp_node": 0, "rsp_dir": 0, "ref_node": 0,
        "ref_dir": 0, "rsp_ent_name": name, "ref_ent_name": "NONE", "data": data.astype("f8"), "x": time, "abscissa_spacing": 1, "abscissa_min": 0.0,
        "abscissa_inc": 1 / RATE_HZ, "num_pts": len(data), "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0, "abscissa_axis_lab": "Time", "abscissa_axis_units_lab": "s", "ordinate_axis_lab": "Displacement",
        "ordinate_axis_units_lab": units[name].replace("µ", "u"), **none}], mode="add", force_double=False)
# Full scale is 10 µm, of the mark 10 V.
soundfile.write(OUT / "campaign.wav", np.column_stack(list(channels.values())) / 10, int(RATE_HZ), subtype="FLOAT")
