"""Least squares of all readings, unweighted, on any rig: one matrix an order, made once and used at every station."""
import json
import sys

import numpy as np
import pyarrow as pa


def request():
    tables = {}
    while line := sys.stdin.buffer.readline():
        name, size = line.split()
        if name == b"end":
            return tables
        tables[name.decode()] = pa.ipc.open_stream(sys.stdin.buffer.read(int(size))).read_all()


def answer(table):
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(b"harmonics %d\n" % len(body) + body + b"end 0\n")
    sys.stdout.buffer.flush()


def layout(rig, names, orders):
    """Readings = matrix · unknowns, motion at the sensors' mean z: [order, reading, unknown]."""
    sensors = {sensor["id"]: sensor for sensor in rig["sensors"]}
    sections = list(dict.fromkeys(sensor["section"] for sensor in rig["sensors"]))
    readings = [(sensors[name], setup) for setup in rig["setups"] for name in names]
    theta = np.radians([sensor["angle_deg"] + setup["sensors_deg"] for sensor, setup in readings])
    part = theta - np.radians([setup["part_deg"] for _, setup in readings])
    z = np.array([sensor["z_mm"] for sensor, _ in readings])
    lever = 1e-3 * (z - z.mean())
    direction = 1 if rig["rotation"] == "ccw" else -1
    phase = np.exp(1j * direction * np.outer(orders, part))
    forms = [phase * [sensor["section"] == section for sensor, _ in readings] for section in sections]
    motion = [np.cos(theta), np.sin(theta), -lever * np.sin(theta), lever * np.cos(theta)][: 4 if np.ptp(z) > 1e-6 else 2]
    columns = forms + [np.broadcast_to(column, phase.shape) for column in motion]
    quantities = ["form"] * len(sections) + ["x", "y", "tilt_x", "tilt_y"][: len(motion)]
    return np.stack(columns, 2), quantities, sections, z.mean(), direction


made = None
while tables := request():
    profiles, covariance = tables["profiles"], tables["covariance"]
    rig, station = (json.loads(profiles.schema.metadata[key]) for key in (b"runout.rig", b"runout.station"))
    setups, count = len(rig["setups"]), len(rig["sensors"])
    u = (profiles["re"].to_numpy() + 1j * profiles["im"].to_numpy()).reshape(setups, -1, count)
    orders = np.arange(2, u.shape[1])
    if made is None:
        matrix, quantities, sections, z, direction = layout(rig, profiles["sensor"][:count].to_pylist(), orders)
        rows = np.linalg.pinv(matrix, rcond=1e-9)
        kept = np.abs(np.einsum("nqr,nrq->nq", rows, matrix) - 1) < 1e-9
        forms, at_zero = len(sections), np.eye(len(quantities))
        made = np.tile(quantities, len(orders)), np.tile(sections + [None] * (len(quantities) - forms), len(orders)), np.repeat(orders, len(quantities))
    if len(quantities) > forms + 2:                                                         # motion at z = 0 of the rig
        at_zero[forms, forms + 3], at_zero[forms + 1, forms + 2] = np.array([-1e-3, 1e-3]) * (z + station["z_mm"])
    here = at_zero @ rows
    found = (here @ np.moveaxis(u[:, 2:], 0, 1).reshape(len(orders), -1, 1))[:, :, 0]
    found[:, :forms] = found[:, :forms] if direction > 0 else found[:, :forms].conj()
    std = np.full(found.shape, np.nan)
    if len(covariance):
        sigma = (covariance["re"].to_numpy() + 1j * covariance["im"].to_numpy()).reshape(setups, -1, count, count)[:, 2:]
        parts = np.split(here, setups, axis=2)
        std = np.sqrt(sum(((part @ own) * part.conj()).sum(2).real for part, own in zip(parts, sigma)))
    lost = ~kept.ravel()
    quantity, section, order = made
    answer(pa.table({
        "station": pa.repeat(station["station"], len(order)), "quantity": quantity, "section": pa.array(section, pa.string()), "order": order,
        "re": pa.array(found.real.ravel(), mask=lost), "im": pa.array(found.imag.ravel(), mask=lost),
        "std": pa.array(std.ravel(), mask=lost | np.isnan(std.ravel()))}))
