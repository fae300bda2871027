"""Reads a data set of `runout batch` as one table a folder: read_data_set.py FOLDER RECORDING…"""

import pathlib
import sys

import duckdb
import polars
import pyarrow.dataset
import pyarrow.parquet

folder, recordings = pathlib.Path(sys.argv[1]), set(sys.argv[2:])
for table in ["form", "motion", "harmonics", "values"]:
    files = sorted((folder / table).glob("**/*.parquet"))
    assert len(files) == len(recordings), files
    rows = sum(pyarrow.parquet.ParquetFile(file).metadata.num_rows for file in files)
    read = pyarrow.dataset.dataset(folder / table, partitioning="hive").to_table()
    assert read.num_rows == rows and set(read["recording"].to_pylist()) == recordings, table
    read = polars.read_parquet(f"{folder / table}/**/*.parquet", hive_partitioning=True)
    assert read.height == rows and set(read["recording"]) == recordings, (table, read["recording"].unique())
    pattern = f"{folder / table}/**/*.parquet"
    read = duckdb.sql(f"select recording, count(*) from read_parquet('{pattern}', hive_partitioning=true) group by 1").fetchall()
    assert {name for name, _ in read} == recordings and sum(count for _, count in read) == rows, (table, read)
    print(f"{table}: {rows} rows of {len(recordings)} recordings by pyarrow, polars and duckdb")

every = pyarrow.parquet.read_table(folder / "values.parquet")
parts = pyarrow.dataset.dataset(folder / "values", partitioning="hive").to_table()
assert every.num_rows == parts.num_rows and every.column_names[0] == "recording"
assert set(every["recording"].to_pylist()) == recordings
assert sorted(every["value"].to_pylist(), key=repr) == sorted(parts["value"].to_pylist(), key=repr)
trend = pyarrow.parquet.read_table(folder / "trend.parquet")
assert trend.num_rows == every.num_rows
field = trend.schema.field("mean")
assert field.metadata[b"about"].startswith("X̄".encode())
