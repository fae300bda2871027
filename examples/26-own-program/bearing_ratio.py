"""An evaluator: the share of each section's circumference within a depth of its highest point, with ± by draws. No standard has it of a profile."""
import json
import sys

import numpy as np
import pyarrow as pa

source, sink = sys.stdin.buffer, sys.stdout.buffer
sections, config = {}, {}


def share(form_um, depth_um):
    """Share of the circumference above a depth, straight lines between the points."""
    above = form_um - form_um.max(axis=-1, keepdims=True) + depth_um
    ahead = np.roll(above, -1, axis=-1)
    return 100 * np.mean((above.clip(0) + ahead.clip(0)) / (abs(above) + abs(ahead)), axis=-1)


while line := source.readline():
    name, size = line.decode().split()
    body = source.read(int(size))
    if name == "symbols":                                                                   # the first request
        config = json.loads(pa.ipc.open_stream(body).read_all().schema.metadata[b"runout.config"])
    elif name == "harmonics":                                                               # once a station
        for row in pa.ipc.open_stream(body).read_all().to_pylist():
            if row["quantity"] == "form" and row["order"] >= 2 and row["observable"]:
                sections.setdefault(f"{row['station']} {row['section']}", []).append(row)
    elif name == "summary":                                                                 # the last request
        draw, angle, columns = np.random.default_rng(1), np.linspace(0, 2 * np.pi, 720, endpoint=False), {}
        for of, rows in sections.items():
            waves = np.exp(1j * np.outer([row["order"] for row in rows], angle))            # form is Re Σ c exp(i n α)
            found = np.array([row["re"] + 1j * row["im"] for row in rows])
            noise = draw.normal(size=(400, 2, len(rows))) * [(row["std"] or np.nan) / np.sqrt(2) for row in rows]
            ratio = share((found @ waves).real, config["depth_um"])
            std = share(((found + noise[:, 0] + 1j * noise[:, 1]) @ waves).real, config["depth_um"]).std()
            columns.setdefault("of", []).append(of)
            columns.setdefault("value", []).append(ratio)
            columns.setdefault("std", []).append(None if np.isnan(std) else std)
        count = len(sections)
        about = [f"share within {config['depth_um']} um of the highest point"] * count
        table, out = pa.table({"symbol": ["bearing-ratio"] * count, "unit": ["%"] * count, "about": about, **columns}), pa.BufferOutputStream()
        with pa.ipc.new_stream(out, table.schema) as stream:
            stream.write_table(table)
        body = out.getvalue().to_pybytes()
        sink.write(b"values %d\n" % len(body) + body)
    elif name == "end":
        sink.write(b"end 0\n")
        sink.flush()
