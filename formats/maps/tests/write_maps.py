"""Writes small height maps with the reference libraries, and what these libraries read of them.

    pip install x3pio sdfio surfalize numpy
    python3 write_maps.py

`data/expected.json` holds of each file rows, columns, steps in mm and heights in m as the library itself reads them; null where there is none.
"""

import datetime
import io
import json
import pathlib
import re
import struct
import warnings
import zipfile
import zlib

import numpy as np
import sdfio
import surfalize
import x3pio

warnings.simplefilter("ignore")
OUT = pathlib.Path(__file__).parent / "data"
EXPECTED = {}
rng = np.random.default_rng(46)
ROWS, COLUMNS = 5, 7
HEIGHTS = np.round(rng.normal(0.0, 1e-6, (ROWS, COLUMNS)), 12)
VOIDS = HEIGHTS.copy()
VOIDS[1, 2] = VOIDS[4, 6] = np.nan
STEP = (2e-6, 3e-6)


def keep(name, heights, step_m, content, **wanted):
    (OUT / name).write_bytes(content)
    listed = [None if not np.isfinite(value) else float(value) for value in np.ravel(heights)]
    EXPECTED[name] = {"rows": heights.shape[0], "columns": heights.shape[1], "step_mm": [1e3 * step for step in step_m], "heights_m": listed, **wanted}


def x3p(name, heights, change=lambda members: members, **options):
    buffer = io.BytesIO()
    date = datetime.datetime(2026, 11, 28, tzinfo=datetime.timezone.utc)
    probe = x3pio.ProbingSystem(type=x3pio.ProbingType.SOFTWARE, identification="none")
    options["metadata"] = x3pio.Metadata(date=date, calibration_date=date, creator="write_maps.py", probing_system=probe)
    y_scale = {} if np.ndim(heights) == 1 else {"y_scale": STEP[1]}
    x3pio.write(buffer, heights, x_scale=STEP[0], **y_scale, **options)
    read = x3pio.read(io.BytesIO(buffer.getvalue())).layers
    with zipfile.ZipFile(buffer) as archive:
        members = change([(member, archive.read(member)) for member in archive.namelist()])
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in members:
            archive.writestr(zipfile.ZipInfo(member, (2026, 11, 28, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    for number, layer in enumerate(read, 1):
        wanted = {"layer": str(number)} if len(read) > 1 else {}
        label = name if number == 1 else f"{name}#{number}"
        keep(name, np.atleast_2d(layer.z), (STEP[0], STEP[1] if np.ndim(heights) > 1 else STEP[0]), packed.getvalue(), **wanted)
        EXPECTED[label] = EXPECTED.pop(name) | {"file": name}


def in_a_folder(members):
    return [("__MACOSX/scan/._main.xml", b"\x00\x05\x16\x07")] + [(f"scan/{member}", content) for member, content in members]


def without_dates(members):
    def change(text):
        text = re.sub(rb"<Date>[^<]*</Date>", b"<Date>N/A</Date>", text)
        return re.sub(rb"<CalibrationDate>[^<]*</CalibrationDate>", b"<CalibrationDate>N/A</CalibrationDate>", text)

    return [(member, change(content) if member == "main.xml" else content) for member, content in members]


for kind in ("int16", "int32", "float32", "float64"):
    x3p(f"{kind}.x3p", VOIDS, z_type=x3pio.DataType[kind.upper()])
    x3p(f"{kind}-list.x3p", VOIDS, z_type=x3pio.DataType[kind.upper()], storage=x3pio.DataStorage.XML)
x3p("folder.x3p", HEIGHTS, in_a_folder)
x3p("no-dates.x3p", VOIDS, without_dates, z_type=x3pio.DataType.INT16)
x3p("layers.x3p", np.stack([HEIGHTS, VOIDS, 2 * HEIGHTS]), z_type=x3pio.DataType.INT32)
x3p("profile.x3p", VOIDS[1])
buffer = io.BytesIO()
grid = [[STEP[0] * column, STEP[1] * row, HEIGHTS[row, column]] for row in range(ROWS) for column in range(COLUMNS)]
x3pio.write_points(buffer, np.array(grid)[rng.permutation(ROWS * COLUMNS)])
keep("cloud.x3p", HEIGHTS, STEP, buffer.getvalue())

for revision in ("ISO_1_0", "ISO_2_0", "BCR_1_0"):
    rules = sdfio.Revision[revision]
    for kind in rules.rules.data_types:
        if kind.name.startswith("UINT"):
            continue
        for encoding in sdfio.FileFormat:
            date = datetime.datetime(2026, 11, 28, tzinfo=datetime.timezone.utc)
            metadata = sdfio.Metadata(revision=rules, manufacturer_id="script", data_type=kind, create_date=date, mod_date=date)
            buffer = io.BytesIO()
            sdfio.write(buffer, VOIDS, x_scale=STEP[0], y_scale=STEP[1], format=encoding, metadata=metadata)
            read = sdfio.read(io.BytesIO(buffer.getvalue()))
            name = f"{revision.lower()}-{kind.name.lower()}-{encoding.name.lower()}.sdf"
            keep(name, read.data, STEP, buffer.getvalue())


def sur(name, heights, **options):
    """Heights as surfalize writes them (µm), with the same header each time; read back by surfalize."""
    buffer = io.BytesIO()
    surfalize.Surface(1e6 * heights, 1e6 * STEP[0], 1e6 * STEP[0]).save(buffer, format=".sur", **options)
    content = bytearray(buffer.getvalue())
    content[306:320] = struct.pack("<7h", 0, 0, 0, 28, 11, 2026, 6)
    buffer = io.BytesIO(bytes(content))
    read = surfalize.Surface.load(buffer, format=".sur")
    # The header holds steps as f32.
    step = 1e-6 * float(np.float32(1e6 * STEP[0]))
    keep(name, 1e-6 * read.data, (step, step), bytes(content))
    return bytes(content)


plain = sur("plain.sur", VOIDS)
sur("comment.sur", HEIGHTS, comment="a comment before the heights")
packed = sur("compressed.sur", VOIDS, compressed=True)

# Several objects: the first header declares them, each has a header of its own. The second is a picture, which is no map.
first = bytearray(plain)
first[14:16] = struct.pack("<h", 3)
first[20:50] = b"left".ljust(30, b"\0")
picture = bytearray(plain)
picture[18:20] = struct.pack("<h", 12)
third = bytearray(packed)
third[20:50] = b"right".ljust(30, b"\0")
heights_m, step = EXPECTED["compressed.sur"]["heights_m"], EXPECTED["compressed.sur"]["step_mm"][0] * 1e-3
known = np.array([np.nan if value is None else value for value in heights_m]).reshape(ROWS, COLUMNS)
keep("objects.sur", known, (step, step), bytes(first) + bytes(picture) + bytes(third), layer="right")

# 16 bits, without a length as unit of heights, steps in mm: written by hand, as surfalize writes 32 bits only.
digits = np.arange(ROWS * COLUMNS, dtype="<i2").reshape(ROWS, COLUMNS) - 9
header = bytearray(plain[:512])
header[98:100] = struct.pack("<h", 16)
header[86:88] = struct.pack("<h", 0)
header[120:132] = struct.pack("<3f", 0.25, 0.5, 0.125)
for place, unit in ((180, b"mm"), (196, b"mm"), (212, b"a.u."), (228, b"mm"), (244, b"mm"), (260, b"a.u.")):
    header[place : place + 16] = unit.ljust(16, b"\0")
header[474:478] = struct.pack("<f", 0.0)
keep("bits16.sur", 0.125e-6 * digits, (0.25e-3, 0.5e-3), bytes(header) + digits.tobytes(), unit="um")

# A grid of 24.691 µm, written with three decimals of a millimetre, in any order, with a point missing.
step = 0.024691
lines = [f"{step * column:.3f} {step * row:.3f} {1e6 * HEIGHTS[row, column]:.6f}" for row in range(ROWS) for column in range(COLUMNS)]
rounded = HEIGHTS.copy()
rounded[2, 3] = np.nan
lines.pop(2 * COLUMNS + 3)
text = "x [mm] y [mm] z [µm]\n" + "\n".join(lines[::-1]) + "\n"
keep("rounded.xyz", rounded, (step * 1e-3, step * 1e-3), text.encode(), rounded=True)
comma = "\n".join(";".join(f"{value:.9f}".replace(".", ",") for value in point) for point in 1e3 * np.array(grid))
keep("comma.xyz", HEIGHTS, STEP, comma.encode(), unit="mm")
matrix = "# Channel: Height\n# Width: 14 µm\n# Height: 15 µm\n# Value units: m\n"
matrix += "\n".join("\t".join("nan" if np.isnan(value) else repr(float(value)) for value in row) for row in VOIDS) + "\n"
keep("matrix.asc", VOIDS, STEP, matrix.encode())

(OUT / "expected.json").write_text(json.dumps(EXPECTED, indent=None, separators=(",", ":"), sort_keys=True).replace("},", "},\n") + "\n")
print(len(EXPECTED), "maps,", sum(path.stat().st_size for path in OUT.iterdir()), "bytes")
