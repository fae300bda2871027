"""Writes HDF5 files as other programs have them, and MAT 7.3, with h5py 3.16, which reads them back.

    python write_hdf5.py
"""

import h5py
import numpy as np

from references import FOLDER, expect

RNG = np.random.default_rng(45)


def new(name, **more):
    return h5py.File(FOLDER / name, "w", **more)


# One dataset a channel, all types, with attributes of many names.
expected = []
with new("datasets.h5") as file:
    file.attrs["operator"] = "Ω"
    for number, kind in enumerate("i1 i2 i4 i8 u1 u2 u4 u8 f4 f8 >i2 >f8".split()):
        array = (RNG.normal(size=9) * 50).astype(kind)
        dataset = file.create_dataset(f"runs/a/{kind}", data=array)
        dataset.attrs["unit"] = "µm"
        dataset.attrs["fs"] = 5120.0
        expected.append((f"runs/a/{kind}", "µm", 5120, array))
    group = file["runs"].create_group("b")
    group.attrs["dt"] = 0.0005
    codes = RNG.integers(-(2**15), 2**15, 12).astype("i2")
    dataset = group.create_dataset("scaled", data=codes, chunks=(5,), compression="gzip", shuffle=True)
    dataset.attrs.update(gain=3.1e-4, offset=-0.25, units="V")
    expected.append(("runs/b/scaled", "V", 2000, codes * 3.1e-4 + -0.25))
    matrix = RNG.normal(size=(11, 3)).astype("f4")
    group.create_dataset("matrix", data=matrix, chunks=(4, 2))
    expected += [(f"runs/b/matrix[:, {column}]", None, 2000, matrix[:, column]) for column in range(3)]
    group["rows"] = matrix.T
    expected += [(f"runs/b/rows[{row}, :]", None, 2000, matrix[:, row]) for row in range(3)]
    group["名前"] = np.array([True, False, True])
    expected.append(("runs/b/名前", None, 2000, np.array([1, 0, 1])))
    group["note"] = "text"
    group["loop"] = h5py.SoftLink("/runs")
    group["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
    group["one"] = 4.5
    expected.append(("runs/b/one", None, 2000, [4.5]))
expect("datasets.h5", sorted(expected))

table = np.zeros(7, [("time", "f8"), ("X 1", "f4"), ("count", "u2"), ("name", "S4")])
table["time"], table["X 1"], table["count"] = np.arange(7) / 512, RNG.normal(size=7), RNG.integers(0, 9, 7)
with new("table.h5", libver="latest") as file:
    file.create_dataset("campaign/log", data=table, chunks=(3,))
expect("table.h5", [(f"campaign/log/{field}", None, None, table[field]) for field in ("time", "X 1", "count")])

# As MATLAB writes 7.3: a block of the user, dimensions reversed, classes, cells by references.
expected = []
with new("matlab.mat", userblock_size=512) as file:
    def variable(path, array, clas):
        dataset = file.create_dataset(path, data=np.atleast_2d(array).T)
        dataset.attrs["MATLAB_class"] = np.bytes_(clas)
        return dataset

    column = RNG.normal(size=(9, 1))
    variable("x", column, "double")
    expected.append(("x", None, 800, column[:, 0]))
    pair = RNG.normal(size=(9, 2))
    variable("pair", pair, "double")
    expected += [("pair[:, 0]", None, 800, pair[:, 0]), ("pair[:, 1]", None, 800, pair[:, 1])]
    run = file.create_group("Run0")
    run.attrs["MATLAB_class"] = np.bytes_("struct")
    codes = RNG.integers(-9, 9, (1, 6)).astype("i2")
    variable("Run0/X1", codes, "int16")
    variable("Run0/unit", np.array([ord(letter) for letter in "µm"], "u2")[None, :], "char")
    expected.append(("Run0/X1", "µm", 800, codes[0]))
    variable("fs", np.array([[800.0]]), "double")
    expected.append(("fs", None, None, [800.0]))
    flags = np.array([[1, 0, 1, 1]], "u1")
    variable("flags", flags, "logical")
    expected.append(("flags", None, 800, flags[0]))
    cells = [RNG.normal(size=(4, 1)), RNG.normal(size=(3, 1))]
    references = np.array([[variable(f"#refs#/{name}", cell, "double").ref for name, cell in zip("ab", cells)]], h5py.ref_dtype)
    variable("cells", references, "cell")
    expected += [(f"cells[{number}]", None, 800, cell[:, 0]) for number, cell in enumerate(cells)]
with open(FOLDER / "matlab.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
expect("matlab.mat", expected)
