"""Programs that do not keep the protocol: `hostile.py WHAT PID_FILE`."""
import os
import subprocess
import sys
import time
from pathlib import Path

what = sys.argv[1]
with Path(sys.argv[2]).open("w") as file:
    file.write(str(os.getpid()))


def request():
    out = {}
    while line := sys.stdin.buffer.readline():
        name, size = line.split()
        if name == b"end":
            return out
        out[name.decode()] = sys.stdin.buffer.read(int(size))
    return out


def answer(columns, metadata=None, name=b"harmonics", end=b"end 0\n"):
    import pyarrow as pa

    table = pa.table(columns).replace_schema_metadata(metadata)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(name + b" %d\n" % len(body) + body + end)
    sys.stdout.buffer.flush()


def row(**other):
    return {"station": [station], "quantity": ["form"], "section": ["a"], "order": [2], "re": [1.0], "im": [0.5]} | other


if what == "never-reads":
    time.sleep(600)
tables = request()
if what in {"null-order", "schema", "nan", "version", "unasked", "order", "twice", "half", "column", "text-order", "std", "compressed"}:
    import pyarrow as pa

    station = pa.ipc.open_stream(tables["profiles"]).read_all()["station"][0].as_py()
if what == "hangs":
    time.sleep(600)
elif what == "hangs-with-a-child":
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    Path(sys.argv[2]).write_text(f"{os.getpid()} {child.pid}")
    time.sleep(600)
elif what == "exits":
    sys.exit("the probe of section a is\x1b[31m not calibrated")
elif what == "exits-well":
    sys.exit(0)
elif what == "garbage":
    print("separating station 1 ...", flush=True)
    time.sleep(600)
elif what == "not-arrow":
    sys.stdout.buffer.write(b"harmonics 12\nno arrow herend 0\n")
    sys.stdout.buffer.flush()
    time.sleep(600)
elif what == "flood":
    line = b"x" * 999 + b"\n"
    for _ in range(100):
        os.write(2, line * 1000)
    sys.stderr.write("the last word\n")
    sys.exit(3)
elif what == "ten-gigabytes":
    sys.stdout.buffer.write(b"harmonics 10000000000\n")
    try:
        while True:
            sys.stdout.buffer.write(bytes(1 << 20))
    except BrokenPipeError:
        os._exit(1)
elif what == "empty-frames":
    try:
        while True:
            sys.stdout.buffer.write(b"warning 0\n" * 1000)
    except BrokenPipeError:
        os._exit(1)
elif what == "cut-off":
    sys.stdout.buffer.write(b"harmonics 500\nabc")
elif what == "eats-memory":
    kept = bytearray(1 << 30)
    sys.exit("there was room")
elif what == "schema":
    answer(row(re=["one"]))
elif what == "column":
    answer(row(sdt=[0.1]))
elif what == "missing-column":
    answer({"station": ["s"]})
elif what == "text-order":
    answer(row(order=[2.5]))
elif what == "nan":
    answer(row(re=[float("nan")]))
elif what == "version":
    answer(row(), {"runout.protocol": "2"})
elif what == "unasked":
    answer(row(station=["another"]))
elif what == "order":
    answer(row(order=[4000]))
elif what == "null-order":
    answer(row(order=pa.array([None], pa.int64())))
elif what == "twice":
    answer({key: value * 2 for key, value in row().items()})
elif what == "half":
    answer(row(im=pa.array([None], pa.float64())))
elif what == "std":
    answer(row(std=[-0.1]))
elif what == "compressed":
    table = pa.table(row(re=[1.0]))
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(b"harmonics %d\n" % len(body) + body + b"end 0\n")
    sys.stdout.buffer.flush()
elif what == "other-table":
    answer({"a": [1]}, name=b"values")
elif what == "nothing":
    sys.stdout.buffer.write(b"end 0\n")
