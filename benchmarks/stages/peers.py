"""Times the peers' stages one by one: prints a line of JSON a stage, its least seconds.

usage: peers.py PEERS SCRATCH STATIONS

SCRATCH holds the record of the campaign's benchmark, and out/ with what runout wrote of it: the same tables are written here by
pyarrow and h5py, with the same packing. One thread, but where a stage's name says otherwise.
"""
import json
import os
import sys
import time

THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": os.environ.get("POLARS_MAX_THREADS", "1")}
os.environ.update(THREADS)

import h5py
import numpy as np
import polars
import pyarrow
import pyarrow.parquet
from scipy import signal

peers, scratch, stations = sys.argv[1], sys.argv[2], int(sys.argv[3])
sys.path.insert(0, peers)
import pipeline as P  # noqa: E402

ROUNDS = 7
PACKINGS = ("BYTE_STREAM_SPLIT", "DELTA_BINARY_PACKED")
CAPTURES = 10
csv = f"{scratch}/stages/capture.csv"
record = f"{scratch}/record-f64-{stations}.h5"


def report(stage, work):
    least = float("inf")
    for _ in range(ROUNDS):
        started = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - started)
    print(json.dumps({"stage": stage, "seconds": least}))


def read_csv():
    return polars.read_csv(csv).to_numpy()


if THREADS["POLARS_MAX_THREADS"] != "1":
    report("csv-read-all-threads", read_csv)
    report("csv-read-two-files", lambda: (read_csv(), read_csv()))
    sys.exit()

pyarrow.set_cpu_count(1)
pyarrow.set_io_thread_count(1)
with h5py.File(f"{scratch}/peers-f64-{stations}.h5") as file:
    n, x, index = int(file.attrs["n"]), file["setup0/section000"][...], file["setup0/index000"][...]
sos = P.lowpass_sos(4, 500.0, n)
operator = P.three_point_operator(n)
report("low-pass", lambda: signal.sosfiltfilt(sos, x, axis=-1))
report("average", lambda: P.sync_average(P.resample_linear(x, index, n), n))
turns = P.resample_linear(x, index, n)
report("motion-of-every-turn", lambda: P.three_point_all_revs(turns, n, *operator))


def read_hdf5():
    with h5py.File(record) as file:
        for station in range(CAPTURES // 2):
            for setup in ("initial", "reversed"):
                file[f"{setup}/s{station:03d}/samples"][...]


report("hdf5-read", read_hdf5)
report("csv-read", read_csv)

out = f"{scratch}/stages/out"
tables = {name: pyarrow.parquet.read_table(f"{out}/{name}.parquet") for name in ("form", "motion", "harmonics")}
packing = {}
for name, table in tables.items():
    column = pyarrow.parquet.ParquetFile(f"{out}/{name}.parquet").metadata.row_group(0).column
    columns = [column(place) for place in range(table.num_columns)]
    encodings = {one.path_in_schema: encoding for one in columns for encoding in PACKINGS if encoding in one.encodings}
    dictionary = [one.path_in_schema for one in columns if "RLE_DICTIONARY" in one.encodings]
    compression = {one.path_in_schema: one.compression.lower().replace("uncompressed", "none") for one in columns}
    packing[name] = {"use_dictionary": dictionary, "column_encoding": encodings, "compression": compression}


def write_parquet():
    for name, table in tables.items():
        pyarrow.parquet.write_table(table, f"{scratch}/stages/{name}-peers.parquet", **packing[name])


report("parquet-write", write_parquet)

datasets = {}
with h5py.File(f"{out}/result.h5") as file:
    def keep(name, item):
        if isinstance(item, h5py.Dataset) and item.size:
            filters = {"chunks": item.chunks, "compression": item.compression, "compression_opts": item.compression_opts,
                       "shuffle": item.shuffle}
            datasets[name] = (item[...], {key: value for key, value in filters.items() if value})
    file.visititems(keep)


def write_hdf5():
    with h5py.File(f"{scratch}/stages/peers.h5", "w") as file:
        for name, (values, filters) in datasets.items():
            file.create_dataset(name, data=values, **filters)


report("hdf5-write", write_hdf5)
