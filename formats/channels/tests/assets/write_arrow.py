"""Writes the Parquet and Arrow files of the tests with pyarrow 26, which reads them back.

    python write_arrow.py
"""

import decimal

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.ipc
import pyarrow.parquet as pq

from references import FOLDER, expect

RNG = np.random.default_rng(45)
ROWS = 40

columns, numbers, units = {}, {}, {}
for kind in "int8 int16 int32 int64 uint8 uint16 uint32 uint64 float16 float32 float64".split():
    values = (RNG.normal(size=ROWS) * 50).astype(kind)
    columns[kind], numbers[kind] = pa.array(values), values
columns["bool"] = pa.array(RNG.normal(size=ROWS) > 0)
numbers["bool"] = columns["bool"].to_numpy(zero_copy_only=False)
some = [None if number % 7 == 3 else float(value) for number, value in enumerate(RNG.normal(size=ROWS))]
columns["with nulls"], numbers["with nulls"] = pa.array(some, pa.float64()), [np.nan if value is None else value for value in some]
exact = [decimal.Decimal(int(value)).scaleb(-3) for value in RNG.integers(-99999, 99999, ROWS)]
for name, kind in (("decimal", pa.decimal128(12, 3)), ("long decimal", pa.decimal256(40, 3))):
    columns[name], numbers[name] = pa.array(exact, kind), [float(value) for value in exact]
for unit, per_second in (("ms", 10**3), ("ns", 10**9)):
    stamps = 1_790_000_000 * per_second + np.arange(ROWS) * per_second // 500
    columns[f"stamp {unit}"] = pa.array(stamps, pa.timestamp(unit, tz="UTC"))
    numbers[f"stamp {unit}"], units[f"stamp {unit}"] = (stamps - stamps[0]) * (1 / per_second), "s"
columns["text"] = pa.array(["a"] * ROWS)
columns["Weg 軸"], numbers["Weg 軸"], units["Weg 軸"] = pa.array(RNG.normal(size=ROWS)), None, "µm"
numbers["Weg 軸"] = columns["Weg 軸"].to_numpy()
fields = [pa.field(name, column.type, metadata={"unit": units[name]} if name == "Weg 軸" else None) for name, column in columns.items()]
table = pa.table(list(columns.values()), pa.schema(fields))
expected = [(name, units.get(name), None, values) for name, values in numbers.items()]


def done(name, of=expected):
    expect(name, of)


few = table.select(["int16", "float64", "Weg 軸"])
of_few = [each for each in expected if each[0] in few.column_names]
pq.write_table(table, FOLDER / "types.parquet", row_group_size=15, compression="snappy")
done("types.parquet")
for codec in ("none", "gzip", "brotli", "lz4", "zstd"):
    pq.write_table(few, FOLDER / f"{codec}.parquet", compression=codec, row_group_size=25, use_dictionary=codec != "none", data_page_version="2.0" if codec == "zstd" else "1.0")
    done(f"{codec}.parquet", of_few)
pq.write_table(few.slice(0, 0), FOLDER / "no-rows.parquet")
done("no-rows.parquet", [(name, unit, rate, []) for name, unit, rate, _ in of_few])
for codec in (None, "lz4", "zstd"):
    options = pa.ipc.IpcWriteOptions(compression=codec)
    name = f"{codec or 'plain'}.arrow"
    with pa.ipc.new_file(str(FOLDER / name), (table if codec is None else few).schema, options=options) as file:
        file.write_table(table if codec is None else few, max_chunksize=15)
    done(name, expected if codec is None else of_few)
with pa.ipc.new_stream(str(FOLDER / "stream.arrows"), few.schema) as file:
    file.write_table(few, max_chunksize=15)
done("stream.arrows", of_few)
