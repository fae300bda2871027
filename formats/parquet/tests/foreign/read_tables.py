"""Reads the three tables with pyarrow and checks them against each other: read_tables.py FOLDER."""

import json
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

# Columns of measured numbers. They are written as they are, since packing them takes long and saves little.
MEASURED = {"form_um", "x_um", "y_um", "tilt_x_urad", "tilt_y_urad", "re", "im", "std"}

folder = Path(sys.argv[1])
form, motion, harmonics = (pq.read_table(folder / f"{name}.parquet") for name in ("form", "motion", "harmonics"))

assert form.column_names == ["section", "station", "z_mm", "angle_deg", "form_um", "std_um"]
assert harmonics.schema.field("order").type == pa.uint32()
assert harmonics.schema.field("observable").type == pa.bool_()
assert form.schema.field("form_um").metadata[b"unit"] == b"um"

for name in ("form", "motion", "harmonics"):
    metadata = pq.read_metadata(folder / f"{name}.parquet")
    about = {key.decode(): value.decode() for key, value in metadata.metadata.items()}
    assert about["runout.title"] == "Probelauf µ", about
    assert json.loads(about["runout.lost_orders"]) == {"form": [4], "motion": [4]}
    assert json.loads(about["runout.inputs"])[0]["path"] == "shaft.h5"
    for index in range(metadata.num_columns):
        column = metadata.row_group(0).column(index)
        measured = column.path_in_schema in MEASURED
        assert column.compression == ("UNCOMPRESSED" if measured else "ZSTD"), column
        if column.physical_type == "DOUBLE":
            assert ("PLAIN" if measured else "BYTE_STREAM_SPLIT") in column.encodings, column
        if column.physical_type == "BYTE_ARRAY":
            assert column.has_dictionary_page, column

c = {
    (row["station"], row["quantity"], row["section"], row["order"]): complex(row["re"], row["im"])
    for row in harmonics.to_pylist()
    if row["observable"]
}


def total(station, quantity, section, angle_deg, sign):
    terms = ((key[3], value) for key, value in c.items() if key[:3] == (station, quantity, section))
    return sum((value * np.exp(sign * 1j * order * np.radians(angle_deg))).real for order, value in terms)


worst = 0.0
for row in form.to_pylist():
    expected = total(row["station"], "form", row["section"], row["angle_deg"], 1)
    worst = max(worst, abs(row["form_um"] - expected))
for row in motion.to_pylist():
    for axis in "xy":
        expected = total(row["station"], axis, None, row["angle_deg"], -1)
        worst = max(worst, abs(row[f"{axis}_um"] - expected))
    assert row["tilt_x_urad"] is None and row["std_tilt_y_urad"] is None

# Rounding of a few terms near 1.
assert worst < 1e-13, worst
print(f"pyarrow {pa.__version__}: {form.num_rows} form rows, {motion.num_rows} motion rows, worst difference {worst:.1e} µm")
