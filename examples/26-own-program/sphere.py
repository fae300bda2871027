"""Least-squares sphere of measured points, which is not linear: centre and radius with ±, and what is left."""
import sys

import numpy as np
import pyarrow as pa


def read():
    while line := sys.stdin.buffer.readline():
        name, size = line.split()
        if name == b"end":
            return points
        points = pa.ipc.open_stream(sys.stdin.buffer.read(int(size))).read_all()


def frame(name, columns):
    table, sink = pa.table(columns), pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    return f"{name} {len(body)}\n".encode() + body


while table := read():
    points = np.stack([table[name].to_numpy() for name in ("x_mm", "y_mm", "z_mm")], 1)
    if len(points) < 5:
        sys.exit(f"expected 5 points or more, found {len(points)}")
    found = np.append(points.mean(0), points.std())
    for _ in range(50):
        away = points - found[:3]
        distance = np.linalg.norm(away, axis=1)
        jacobian = np.column_stack([-away / distance[:, None], -np.ones(len(points))])
        step = np.linalg.lstsq(jacobian, found[3] - distance, rcond=None)[0]
        found += step
        if np.linalg.norm(step) < 1e-12 * found[3]:
            break
    else:
        sys.exit("the fit did not settle: do the points cover a part of a sphere?")
    left = np.linalg.norm(points - found[:3], axis=1) - found[3]
    variance = left @ left / (len(points) - 4)
    std = np.sqrt(variance * np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    values = {"symbol": ["centre"] * 3 + ["radius"], "of": ["x", "y", "z", None], "value": found, "std": std, "unit": ["mm"] * 4}
    residual = {"row": np.arange(len(left)), "residual_um": 1e3 * left}
    sys.stdout.buffer.write(frame("values", values) + frame("residual", residual) + b"end 0\n")
    sys.stdout.buffer.flush()
