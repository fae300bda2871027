"""Three-point separator: form and motion from three sensors around one section, order by order (Whitehouse, 1976)."""
import json
import sys

import numpy as np
import pyarrow as pa


def request():
    """Tables of the next station by name; nothing at the end of the run."""
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


while tables := request():
    profiles, covariance = tables["profiles"], tables["covariance"]
    rig, config, station = (json.loads(profiles.schema.metadata[b"runout." + key]) for key in (b"rig", b"config", b"station"))
    if len(rig["sensors"]) != 3 or len(rig["setups"]) != 1:
        sys.exit(f"expected 3 sensors and 1 setup, found {len(rig['sensors'])} and {len(rig['setups'])}")
    sensors = {sensor["id"]: sensor for sensor in rig["sensors"]}
    names = profiles["sensor"][:3].to_pylist()                                              # rows go by order, then by sensor
    theta = np.radians([sensors[name]["angle_deg"] + rig["setups"][0]["sensors_deg"] for name in names])
    u = (profiles["re"].to_numpy() + 1j * profiles["im"].to_numpy()).reshape(-1, 3)         # [order, sensor]
    sigma = (covariance["re"].to_numpy() + 1j * covariance["im"].to_numpy()).reshape(-1, 3, 3)
    orders = np.arange(2, len(u))                                                           # order 1 is eccentricity
    direction = 1 if rig["rotation"] == "ccw" else -1
    phase = np.exp(1j * direction * np.outer(orders, theta - np.radians(rig["setups"][0]["part_deg"])))
    weights = np.sin(np.roll(theta, -2) - np.roll(theta, -1))                               # no motion in their sum
    form = weights / (phase @ weights)[:, None]                                             # [order, sensor]
    motion = np.linalg.pinv(np.stack([np.cos(theta), np.sin(theta)], 1)) @ (np.eye(3) - phase[:, :, None] * form[:, None, :])
    rows = np.concatenate([form[:, None, :], motion], 1)                                    # [order, form x y, sensor]
    found = np.einsum("nqs,ns->nq", rows, u[2:])
    found[:, 0] = found[:, 0] if direction > 0 else found[:, 0].conj()
    lost = ~(np.linalg.norm(rows, axis=2) <= config.get("max_noise_gain", 30))              # also what is no number
    std = np.sqrt(np.einsum("nqs,nst,nqt->nq", rows, sigma[2:], rows.conj()).real) if len(sigma) else np.full(found.shape, None)
    quantity = np.tile(["form", "x", "y"], len(orders))
    answer(pa.table({
        "station": [station["station"]] * len(quantity), "quantity": quantity,
        "section": pa.array([rig["sensors"][0]["section"] if name == "form" else None for name in quantity], pa.string()),
        "order": np.repeat(orders, 3), "re": pa.array(found.real.ravel(), mask=lost.ravel()),
        "im": pa.array(found.imag.ravel(), mask=lost.ravel()), "std": pa.array(std.ravel(), pa.float64(), mask=lost.ravel())}))
