"""An exporter: the range of the form of each section, as text. Tables come one by one; each request is answered by `end 0`."""
import json
import sys

import pyarrow as pa

source, sink = sys.stdin.buffer, sys.stdout.buffer
files, lines = {}, []
while line := source.readline():
    name, size = line.decode().split()
    body = source.read(int(size))
    if name == "files":
        files = dict(zip(*pa.ipc.open_stream(body).read_all().to_pydict().values()))        # name: path
    elif name == "form":
        form = pa.ipc.open_stream(body).read_all().group_by(["station", "section"]).aggregate([("form_um", "min_max")])
        for row in form.to_pylist():
            lowest, highest = row["form_um_min_max"].values()
            lines.append(f"{row['station']} {row['section']}: {highest - lowest:.3f} um")
    elif name == "summary":
        with open(files["roundness.txt"], "w") as out:
            print(json.loads(body)["title"], *lines, sep="\n", file=out)
    elif name == "end":
        sink.write(b"end 0\n")
        sink.flush()
