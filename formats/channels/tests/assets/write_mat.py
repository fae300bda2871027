"""Writes the MAT files of versions 4 and 5 of the tests with SciPy 1.17 and, big-endian ones, byte by byte; SciPy reads all of them back.

    python write_mat.py
"""

import struct

import numpy as np
from scipy.io import loadmat, savemat

from references import FOLDER, expect

RNG = np.random.default_rng(45)


def channels(group, name, value):
    """As the loader names them: the longer dimension is that of time."""
    path = f"{group}/{name}" if group and name[0] != "[" else group + name
    if value.dtype.names:
        for number, element in enumerate(value.flatten("F")):
            below = path if value.size == 1 else f"{path}[{number}]"
            for field in value.dtype.names:
                yield from channels(below, field, element[field])
    elif value.dtype == object:
        for number, cell in enumerate(value.flatten("F")):
            yield from channels(path, f"[{number}]", cell)
    elif value.dtype.kind in "biufc":
        if value.size == 0 and group:
            return
        squeezed = np.squeeze(value.real)
        path = f"{group}/{name}" if group else name
        if squeezed.ndim < 2:
            yield path, np.atleast_1d(squeezed)
        elif squeezed.ndim == 2 and squeezed.shape[0] >= squeezed.shape[1]:
            yield from ((f"{path}[:, {column}]", squeezed[:, column]) for column in range(squeezed.shape[1]))
        elif squeezed.ndim == 2:
            yield from ((f"{path}[{row}, :]", squeezed[row]) for row in range(squeezed.shape[0]))


def done(name, hints=()):
    hints, found = dict(hints), loadmat(FOLDER / name)
    all_of = [each for key, value in found.items() if key[:2] != "__" for each in channels("", key, value)]
    expect(name, [(path, *hints.get(path, (None, None)), numbers) for path, numbers in all_of])


kinds = "i1 i2 i4 i8 u1 u2 u4 u8 f4 f8".split()
plain = {f"of_{kind}": (RNG.normal(size=(1, 9)) * 50).astype(kind) for kind in kinds}
plain |= {
    "rows": RNG.normal(size=(8, 3)), "columns": RNG.normal(size=(2, 9)), "small": np.array([[3.0]]), "logical": RNG.normal(size=(6, 1)) > 0,
    "complex": RNG.normal(size=(5, 1)) + 1j * RNG.normal(size=(5, 1)), "note": "Größe in µm", "whole": np.arange(12.0).reshape(12, 1),
}
nested = {
    "Run0": {"X1": RNG.normal(size=7), "X2": RNG.normal(size=7).astype("f4"), "unit": "um", "deep": {"y": RNG.normal(size=(6, 2))}},
    "shots": np.array([(RNG.normal(size=4), "a"), (RNG.normal(size=5), "b")], [("x", object), ("label", object)]),
    "cells": np.array([RNG.normal(size=3), "text", np.array([RNG.normal(size=2), 7], object)], object),
}
for compressed in (False, True):
    end = "-packed" if compressed else ""
    savemat(FOLDER / f"plain{end}.mat", plain, do_compression=compressed)
    done(f"plain{end}.mat")
    savemat(FOLDER / f"nested{end}.mat", nested, do_compression=compressed, oned_as="column")
    done(f"nested{end}.mat", {"Run0/X1": ("um", None), "Run0/X2": ("um", None)})
four = {"x": RNG.normal(size=(9, 1)), "m": RNG.normal(size=(2, 7)), "f": RNG.normal(size=(5, 1)).astype("f4"), "i": RNG.integers(-9, 9, (5, 1)).astype("i2"),
        "u": RNG.integers(0, 9, (5, 1)).astype("u1"), "c": RNG.normal(size=(4, 1)) + 1j, "note": "text", "dt": np.array([[0.002]])}
savemat(FOLDER / "four.mat", four, format="4")
done("four.mat", {key: (None, 500.0) for key in ["x", "f", "i", "u", "c", "m[0, :]", "m[1, :]"]})

# Big-endian, as MATLAB wrote it on SPARC.


def element(kind, data):
    if 0 < len(data) <= 4:
        return struct.pack(">HH4s", len(data), kind, data)
    return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(name, array, code, clas, kind):
    body = element(6, struct.pack(">II", clas, 0)) + element(5, struct.pack(">ii", *array.shape)) + element(1, name.encode())
    return element(14, body + element(kind, array.astype(">" + code).tobytes("F")))


content = b"MATLAB 5.0 MAT-file, Platform: SOL2".ljust(124) + struct.pack(">H", 0x0100) + b"MI"
content += matrix("x", RNG.normal(size=(8, 2)), "f8", 6, 9) + matrix("codes", RNG.integers(-9, 9, (1, 7)), "i2", 10, 3)
content += matrix("short", RNG.integers(-9, 9, (7, 1)), "i1", 6, 1) + matrix("one", np.array([[4]]), "u1", 6, 2)
(FOLDER / "big.mat").write_bytes(content)
done("big.mat")
content = b""
for name, code, number, array in (("x", "f8", 1000, RNG.normal(size=(6, 2))), ("i", "i2", 1030, RNG.integers(-9, 9, (5, 1)))):
    content += struct.pack(">5i", number, *array.shape, 0, len(name) + 1) + name.encode() + b"\0" + array.astype(">" + code).tobytes("F")
(FOLDER / "four-big.mat").write_bytes(content)
done("four-big.mat")
