"""Writes the UFF files of the tests with pyuff 2.5, which reads them back, and variants of them that other programs write.

    python write_uff.py
"""

import numpy as np
import pyuff

from references import FOLDER, expect

RNG = np.random.default_rng(45)


def function(name, kind, x, data, binary, unit="um"):
    is_even = not isinstance(x, np.ndarray)
    return {
        "type": 58, "binary": binary, "id1": "Run 0", "id2": "", "id3": "28-Nov-26 12:00:00", "id4": "", "id5": "", "func_type": 1,
        "rsp_node": 3, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0, "rsp_ent_name": name, "ref_ent_name": "NONE", "data": data,
        "x": np.arange(len(data)) * 0.001 if is_even else x, "ord_data_type": kind, "abscissa_spacing": int(is_even), "abscissa_min": 0.0,
        "abscissa_inc": 0.001 if is_even else 0.0, "num_pts": len(data), "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0,
        "abscissa_axis_lab": "Time", "abscissa_axis_units_lab": "s", "ordinate_axis_lab": "Displacement", "ordinate_axis_units_lab": unit,
        "orddenom_axis_lab": "NONE", "orddenom_axis_units_lab": "NONE", "z_axis_axis_lab": "NONE", "z_axis_axis_units_lab": "NONE",
    }


def expected(name, sets):
    channels = []
    for each in sets:
        path = f"{each['id1'].strip()}/{each['rsp_ent_name'].strip()} {each['rsp_node']}+X"
        is_even = each["abscissa_spacing"] == 1
        data, x = np.asarray(each["data"]), np.asarray(each["x"])
        rate = 1 / each["abscissa_inc"] if is_even else (len(x) - 1) / (x[-1] - x[0])
        unit = each["ordinate_axis_units_lab"].strip()
        channels.append((path, unit, rate, data.real))
        if np.iscomplexobj(data):
            channels.append((f"{path} (imaginary)", unit, rate, data.imag))
        if not is_even:
            channels.append((f"{path} (abscissa)", "s", None, x))
    expect(name, channels)


def sets(binary):
    x = np.arange(9) / 512.0
    real, complex_ = RNG.normal(size=13), RNG.normal(size=7) + 1j * RNG.normal(size=7)
    found = [function("Even2", 2, 0.001, real, binary), function("Even4", 4, 0.001, real * 1e-5, binary, "mm"),
             function("Even5", 5, 0.001, complex_, binary), function("Even6", 6, 0.001, complex_, binary)]
    if not binary:
        return found + [function("Uneven2", 2, x, RNG.normal(size=9), 0)]
    return found + [function("Uneven2", 2, x, RNG.normal(size=9), 1), function("Uneven4", 4, x, RNG.normal(size=9), 1)]


def read(path):
    found = pyuff.UFF(str(path)).read_sets()
    return found if isinstance(found, dict) else found[0]


def written(path, all_sets):
    """One set a file, which pyuff reads, and all behind each other."""
    content, found = b"", []
    for each in all_sets:
        path.unlink(missing_ok=True)
        # pyuff 2.5 writes binary numbers in double precision, and only to the end of a file.
        pyuff.UFF(str(path)).write_sets([each], mode="add", force_double=bool(each["binary"]))
        content += path.read_bytes()
        found.append(read(path))
    path.write_bytes(content)
    return found


for binary, name in ((0, "text.uff"), (1, "binary.uff")):
    expected(name, written(FOLDER / name, sets(binary)))

# Single precision, in both orders of bytes, with lines of Windows.
for order, name in (("<", "single.uff"), (">", "single-big.uff")):
    path = FOLDER / name
    written(path, [function("Even2", 2, 0.001, RNG.normal(size=11), 0)])
    lines = path.read_bytes().split(b"\n")
    data = RNG.normal(size=11).astype(order + "f4").tobytes()
    lines[1] = b"    58b%6d     2          11%12d     0     0           0           0" % (1 if order == "<" else 2, len(data))
    path.write_bytes(b"\r\n".join(lines[:13]) + b"\r\n" + data + b"\r\n    -1\r\n")
    expected(name, [read(path)])

# Exponents of Fortran's double precision, numbers that touch, another dataset between.
path, plain = FOLDER / "fortran.uff", FOLDER / "text.uff"
text = plain.read_bytes().decode()
dataset = "    -1\n   151\nmodel\nmore\n    -1\n"
path.write_bytes((dataset + text.replace("e+", "D+").replace("e-", "D-")).replace("\n", "\r\n").encode())
expected("fortran.uff", pyuff.UFF(str(plain)).read_sets())
# A line end before binary data, which pyuff does not expect.
path = FOLDER / "line-end.uff"
expected("line-end.uff", written(path, sets(1)[:1]))
lines = path.read_bytes().split(b"\n", 13)
path.write_bytes(b"\n".join(lines[:13]) + b"\n\n" + lines[13])
