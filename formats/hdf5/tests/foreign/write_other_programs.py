"""Writes measurement files as MATLAB and LabVIEW do: write_other_programs.py FOLDER.

`python3 foreign/write_other_programs.py data` makes the files that lie in `data`.

MATLAB (h5create, h5write, h5writeatt) stores arrays by columns and the dimensions in the file reversed: an n x 2 matrix is
(2, n), a column (1, n), a row (n, 1); a char vector is a fixed-length text without a terminator, a string array one of
variable length, a char matrix or a cell in a dataset UTF-16 numbers. LabVIEW keeps one row a channel, pads texts to one
length, and writes attributes as arrays of one element.

Each file (but `lzf`, which cannot be read) holds the same readings: S1 is sample / 8 um, S2 its negative; a turn begins every 50 samples, at 0.25.
"""

import pathlib
import sys

import h5py
import numpy

COUNT, TURN = 300, 50
folder = pathlib.Path(sys.argv[1])
folder.mkdir(exist_ok=True)
rows = numpy.arange(COUNT)
um = numpy.column_stack([rows, -rows]) / 8
turns = numpy.arange(COUNT // TURN) * TURN + 0.25
# The mark in volts: 5 samples up each turn; the rising edge passes 2.5 V at 0.25, the falling one at 6.5.
volts = numpy.zeros(COUNT)
for turn in range(COUNT // TURN):
    volts[turn * TURN : turn * TURN + 7] = [1.75, 4.75, 5, 5, 5, 5, 5]


def fixed(at, name, texts, size=None, pad=h5py.h5t.STR_NULLTERM, scalar=False):
    """A text attribute of fixed length; without `size` there is no room for a terminator."""
    size = size or max(len(text) for text in texts)
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(size)
    kind.set_strpad(pad)
    space = h5py.h5s.create(h5py.h5s.SCALAR) if scalar else h5py.h5s.create_simple((len(texts),))
    filler = b" " if pad == h5py.h5t.STR_SPACEPAD else b"\0"
    padded = numpy.array([text.encode().ljust(size, filler) for text in texts], dtype=f"S{size}")
    h5py.h5a.create(at.id, name.encode(), kind, space).write(padded.reshape(() if scalar else (-1,)), mtype=kind)


def root(name, write_text):
    file = h5py.File(folder / f"{name}.h5", "w", libver=("earliest", "v110"))
    write_text(file, "format", ["runout-measurement"])
    write_text(file, "length_unit", ["um"])
    file.attrs["version"] = numpy.array([1.0])
    return file


def char(at, name, texts):
    fixed(at, name, texts, scalar=True)


def padded(at, name, texts):
    fixed(at, name, texts, size=32, pad=h5py.h5t.STR_SPACEPAD)


def station(file, setup):
    group = file.create_group(f"{setup}/only")
    group.attrs["z_mm"] = numpy.array([5.0])
    group.attrs["speed_rpm"] = numpy.array([60.0], dtype="f4")
    return group


def setups(name, write_text):
    with root(name, write_text) as file:
        for setup in ("initial", "reversed"):
            yield station(file, setup)


def samples(group, data, **options):
    dataset = group.create_dataset("samples", data=data, **options)
    dataset.attrs["sample_rate_hz"] = numpy.array([[50.0]])
    return dataset


string = h5py.string_dtype("utf-8")

# A string array of variable length; column vectors.
for group in setups("matlab", char):
    dataset = samples(group, um.T)
    dataset.attrs.create("sensors", numpy.array([["S1"], ["S2"]], dtype=object), dtype=string)
    group.create_dataset("index", data=turns.reshape(1, -1))

# Older versions write one char vector only; row vectors; packed in chunks.
for group in setups("matlab-one-text", char):
    dataset = samples(group, um.T, chunks=(1, 64), compression="gzip", shuffle=True)
    char(dataset, "sensors", ["S1, S2"])
    group.create_dataset("index", data=turns.reshape(-1, 1))

# Names as a cell array of char vectors, as in a MAT file of version 7.3.
for group in setups("matlab-cells", char):
    samples(group, um.T)
    store = group.file.require_group("#refs#")
    cells = []
    for name in ("S1", "S2"):
        codes = numpy.array([[ord(letter)] for letter in name], dtype="u2")
        cell = store.create_dataset(f"{group.parent.name[1:]}{name}", data=codes)
        cell.attrs["MATLAB_class"] = numpy.bytes_("char")
        cells.append([cell.ref])
    names = group.create_dataset("sensors", data=numpy.array(cells, dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    names.attrs["MATLAB_class"] = numpy.bytes_("cell")
    group.create_dataset("index", data=turns.reshape(1, -1))

# Names as a char matrix, padded with blanks; an encoder's angle as a column.
for group in setups("matlab-char-matrix", char):
    samples(group, um.T)
    matrix = numpy.array([[ord(letter) for letter in name.ljust(4)] for name in ("S1", "S2")], dtype="u2")
    group.create_dataset("sensors", data=matrix.T)
    group.create_dataset("angle_deg", data=((rows - 0.25) * 360 / TURN).reshape(1, -1))

# One row a channel, padded texts, codes with a scale for each channel.
for group in setups("labview", padded):
    dataset = samples(group, numpy.column_stack([rows, -rows]).T.astype("i2"))
    padded(dataset, "sensors", ["S1", "S2"])
    dataset.attrs["scale"] = numpy.array([[0.125], [0.125]])
    dataset.attrs["offset"] = numpy.array([[0.0], [0.0]])
    group.create_dataset("index", data=turns)

# The mark as one more channel, in volts.
for group in setups("labview-trace", padded):
    codes = numpy.column_stack([rows, 1000 * volts, -rows]).T
    dataset = samples(group, codes.astype("i2"))
    fixed(dataset, "sensors", ["S1", "MARK", "S2"], size=8, pad=h5py.h5t.STR_NULLPAD)
    dataset.attrs["scale"] = numpy.array([0.125, 0.001, 0.125])
    dataset.attrs["offset"] = numpy.zeros(3)

# The mark as a dataset of its own, one value a sample.
for group in setups("matlab-trace", char):
    dataset = samples(group, um.T)
    char(dataset, "sensors", ["S1;S2"])
    group.create_dataset("MARK", data=volts.reshape(1, -1))

# Packed by a filter that the C library does not come with.
for group in setups("lzf", char):
    dataset = samples(group, um, chunks=(100, 2), compression="lzf")
    dataset.attrs.create("sensors", numpy.array(["S1", "S2"], dtype=object), dtype=string)
    group.create_dataset("index", data=turns)
