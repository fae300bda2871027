"""Writes the NPY and NPZ files of the tests with NumPy 2.4, which reads them back.

    python write_numpy.py
"""

import numpy as np

from references import FOLDER, expect

RNG = np.random.default_rng(45)


def channels(name, array):
    """As the loader names them: the longer dimension is that of time."""
    if array.dtype.names:
        for field in array.dtype.names:
            column = array[field]
            if column.ndim == array.ndim:
                yield from ((f"{name}/{path}" if name else path, numbers) for path, numbers in channels(field, column))
            else:
                for number in range(column.shape[-1]):
                    yield (f"{name}/" if name else "") + f"{field}[{number}]", column[..., number]
        return
    name = name or "data"
    array = np.squeeze(array)
    if array.ndim < 2:
        yield name, np.atleast_1d(array)
    elif array.shape[0] >= array.shape[1]:
        yield from ((f"{name}[:, {column}]", array[:, column]) for column in range(array.shape[1]))
    else:
        yield from ((f"{name}[{row}, :]", array[row]) for row in range(array.shape[0]))


def done(file, **arrays):
    expect(file, [(path, None, None, numbers) for name, array in arrays.items() for path, numbers in channels(name, array)])


KINDS = "b1 i1 i2 i4 i8 u1 u2 u4 u8 f2 f4 f8"
for kind in KINDS.split():
    for order in "<>":
        if order == ">" and kind[1] == "1":
            continue
        array = (RNG.normal(size=11) * 60).astype(order + kind)
        name = f"{kind}-{'big' if order == '>' else 'little'}.npy"
        np.save(FOLDER / name, array)
        done(name, **{"": array})
for name, array in (
    ("rows.npy", RNG.normal(size=(9, 3))),
    ("columns.npy", RNG.normal(size=(2, 9)).astype(">f4")),
    ("fortran.npy", np.asfortranarray(RNG.normal(size=(9, 3)))),
    ("fortran-columns.npy", np.asfortranarray(RNG.integers(-9, 9, (3, 8)).astype("<i2"))),
    ("one.npy", np.array([1.5])),
    ("none.npy", np.array([], "<f4")),
):
    np.save(FOLDER / name, array)
    done(name, **{"": array})
records = np.zeros(7, [("time", "<f8"), ("Weg 1 / µm", ">i2"), ("xyz", "<f4", (3,)), ("flag", "?")])
records["time"], records["Weg 1 / µm"], records["xyz"] = np.arange(7) / 512, RNG.integers(-99, 99, 7), RNG.normal(size=(7, 3))
np.save(FOLDER / "records.npy", records)
done("records.npy", **{"": records})
arrays = {"S1": RNG.normal(size=12), "S2": RNG.normal(size=12).astype("f4"), "matrix": RNG.normal(size=(8, 2)), "面": RNG.integers(0, 9, 4)}
for name, save in (("stored.npz", np.savez), ("deflated.npz", np.savez_compressed)):
    save(FOLDER / name, **arrays, names=np.array(["a", "b"]))
    done(name, **arrays)
