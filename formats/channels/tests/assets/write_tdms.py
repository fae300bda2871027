"""Writes the TDMS files of the tests with npTDMS 1.13 and, what npTDMS does not write, byte by byte; npTDMS reads all of them back.

    python write_tdms.py
"""

import struct

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

from references import FOLDER, expect

RNG = np.random.default_rng(45)
META, NEW, RAW, INTERLEAVED, BIG, DAQMX = 2, 4, 8, 32, 64, 128
NONE, SAME = 0xFFFFFFFF, 0
TYPES = {"i1": 1, "i2": 2, "i4": 3, "i8": 4, "u1": 5, "u2": 6, "u4": 7, "u8": 8, "f4": 9, "f8": 10}


def text(order, value):
    data = value.encode()
    return struct.pack(order + "I", len(data)) + data


def prop(order, name, value):
    if isinstance(value, str):
        return text(order, name) + struct.pack(order + "I", 0x20) + text(order, value)
    if isinstance(value, int):
        return text(order, name) + struct.pack(order + "II", 7, value)
    return text(order, name) + struct.pack(order + "Id", 10, value)


def index(order, kind, count):
    return struct.pack(order + "IIIQ", 20, TYPES[kind], 1, count)


def entry(order, path, stated, properties=()):
    head = text(order, path) + (struct.pack(order + "I", stated) if isinstance(stated, int) else stated)
    return head + struct.pack(order + "I", len(properties)) + b"".join(prop(order, *each) for each in properties)


def segment(toc, entries=None, data=b"", length=None):
    order = ">" if toc & BIG else "<"
    metadata = b"" if entries is None else struct.pack(order + "I", len(entries)) + b"".join(entries)
    toc |= META if entries is not None else 0
    toc |= RAW if data else 0
    length = len(metadata) + len(data) if length is None else length
    return b"TDSm" + struct.pack("<I", toc) + struct.pack(order + "IQQ", 4713, length, len(metadata)) + metadata + data


def done(name, content=None):
    path = FOLDER / name
    if content is not None:
        path.write_bytes(content)
    channels = []
    with TdmsFile.open(path) as file:
        for group in file.groups():
            for channel in group.channels():
                step = channel.properties.get("wf_increment")
                unit = channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription")
                numbers = channel[:] if channel.dtype.kind in "biuf" else []
                if channel.dtype.kind in "biuf":
                    channels.append((f"{group.name}/{channel.name}", unit, 1.0 / step if step else None, numbers))
    expect(name, channels)


# Plain files of npTDMS: all types, text, several groups and names in several scripts.
with TdmsWriter(FOLDER / "types.tdms") as file:
    wave = {"wf_increment": 1.0 / 2048.0, "wf_start_offset": 0.0, "unit_string": "µm"}
    objects = [RootObject({"operator": "Ω"}), GroupObject("Run 0", {"speed": 600})]
    for kind in TYPES:
        numbers = (RNG.normal(size=20) * 50).astype(kind)
        objects.append(ChannelObject("Run 0", f"of {kind}", numbers, wave))
    objects.append(ChannelObject("Läufe / 運転", "it's a 'name'", RNG.normal(size=7), {"unit_string": "mm"}))
    objects.append(ChannelObject("Run 0", "notes", np.array(["one", "zwei", "三"])))
    file.write_segment(objects)
done("types.tdms")

# More segments: another length, the same again without metadata, an object less.
a, b = "/'g'/'a'", "/'g'/'b'"


def f8(order, *arrays):
    return b"".join(np.asarray(array, order + "f8").tobytes() for array in arrays)


for order, big in (("<", 0), (">", BIG)):
    first = [RNG.normal(size=(3, 5)) for _ in range(2)]
    content = segment(NEW | big, [entry(order, a, index(order, "f8", 5), [("unit_string", "um"), ("wf_increment", 0.001)]),
                                  entry(order, b, index(order, "f8", 5))],
                      b"".join(f8(order, first[0][row], first[1][row]) for row in range(3)))
    content += segment(big, None, f8(order, *RNG.normal(size=(2, 5))))
    content += segment(big, None, f8(order, *RNG.normal(size=(2, 5))))
    content += segment(big, [entry(order, b, index(order, "f8", 2))], f8(order, RNG.normal(size=5), RNG.normal(size=2)))
    content += segment(big, [entry(order, a, NONE)], f8(order, RNG.normal(size=2)))
    content += segment(NEW | big, [entry(order, a, SAME), entry(order, "/'g'/'c'", index(order, "i2", 3))],
                       f8(order, RNG.normal(size=5)) + np.array([1, -2, 30000], order + "i2").tobytes())
    done("segments-big.tdms" if big else "segments.tdms", content)

# Interleaved, of unlike types, several chunks and a part of one.
for order, big in (("<", 0), (">", BIG)):
    rows = np.zeros(11, [("a", order + "f8"), ("b", order + "i2"), ("c", order + "f4")])
    rows["a"], rows["b"], rows["c"] = RNG.normal(size=11), RNG.integers(-32768, 32767, 11), RNG.normal(size=11)
    entries = [entry(order, f"/'g'/'{name}'", index(order, kind, 4)) for name, kind in (("a", "f8"), ("b", "i2"), ("c", "f4"))]
    done(f"interleaved{'-big' if big else ''}.tdms", segment(NEW | INTERLEAVED | big, entries, rows.tobytes()))

# Writing was interrupted: the last segment has no length, and ends in a chunk.
entries = [entry("<", a, index("<", "f8", 6)), entry("<", b, index("<", "i2", 6))]
chunk = lambda: RNG.normal(size=6).astype("<f8").tobytes() + RNG.integers(-9, 9, 6).astype("<i2").tobytes()
done("unfinished.tdms", segment(NEW, entries, chunk() + chunk(), 0xFFFFFFFFFFFFFFFF) + b"")
done("unfinished-in-chunk.tdms", segment(NEW, entries, chunk() + chunk() + chunk()[:53], 0xFFFFFFFFFFFFFFFF))
done("shorter.tdms", segment(NEW, entries, chunk()) + segment(0, None, chunk() + chunk())[:-50])

# Scales in chains.
scales = [
    ("NI_Scaling_Status", "unscaled"), ("NI_Number_Of_Scales", 3),
    ("NI_Scale[0]_Scale_Type", "Polynomial"), ("NI_Scale[0]_Polynomial_Coefficients_Size", 3),
    ("NI_Scale[0]_Polynomial_Coefficients[0]", 0.25), ("NI_Scale[0]_Polynomial_Coefficients[1]", 0.0005),
    ("NI_Scale[0]_Polynomial_Coefficients[2]", 1e-9), ("NI_Scale[0]_Polynomial_Input_Source", 0xFFFFFFFF),
    ("NI_Scale[1]_Scale_Type", "Linear"), ("NI_Scale[1]_Linear_Slope", 12.5), ("NI_Scale[1]_Linear_Y_Intercept", -3.0),
    ("NI_Scale[1]_Linear_Input_Source", 0),
    ("NI_Scale[2]_Scale_Type", "Subtract"), ("NI_Scale[2]_Subtract_Left_Operand_Input_Source", 0),
    ("NI_Scale[2]_Subtract_Right_Operand_Input_Source", 1),
]
table = [("NI_Number_Of_Scales", 2), ("NI_Scale[0]_Scale_Type", "Table"), ("NI_Scale[0]_Table_Input_Source", 0xFFFFFFFF),
         ("NI_Scale[0]_Table_Pre_Scaled_Values_Size", 3), ("NI_Scale[0]_Table_Scaled_Values_Size", 3)]
for place, (raw, scaled) in enumerate([(20000.0, 10.0), (0.0, 1.0), (-20000.0, -4.0)]):
    table += [(f"NI_Scale[0]_Table_Pre_Scaled_Values[{place}]", raw), (f"NI_Scale[0]_Table_Scaled_Values[{place}]", scaled)]
table += [("NI_Scale[1]_Scale_Type", "Add"), ("NI_Scale[1]_Add_Left_Operand_Input_Source", 0),
          ("NI_Scale[1]_Add_Right_Operand_Input_Source", 0)]
linear = [("NI_Number_Of_Scales", 1), ("NI_Scale[0]_Scale_Type", "Linear"), ("NI_Scale[0]_Linear_Slope", 3.1e-4),
          ("NI_Scale[0]_Linear_Y_Intercept", 0.7), ("NI_UnitDescription", "Volts")]
names = [("chain", scales), ("table", table), ("linear", linear), ("scaled", [("NI_Scaling_Status", "scaled"), *linear])]
entries = [entry("<", f"/'g'/'{name}'", index("<", "i2", 9), properties) for name, properties in names]
entries.append(entry("<", "/'of group'", NONE, linear[:4]))
entries.append(entry("<", "/'of group'/'x'", index("<", "i2", 9)))
done("scales.tdms", segment(NEW, entries, RNG.integers(-32768, 32767, 45).astype("<i2").tobytes()))

# DAQmx: scalers pick bytes from raw buffers, and digital lines their bits.


def daqmx(values, scalers, widths, header=0x1269, kind=0xFFFFFFFF):
    data = struct.pack("<IIIQI", header, kind, 1, values, len(scalers))
    for code, buffer, offset, scale in scalers:
        data += struct.pack("<IIIBI" if header == 0x126A else "<IIIII", code, buffer, offset, 0, scale)
    return data + struct.pack("<I", len(widths)) + struct.pack(f"<{len(widths)}I", *widths)


by_scaler = lambda slope: [("NI_Scaling_Status", "unscaled"), ("NI_Number_Of_Scales", 2), ("NI_Scale[1]_Scale_Type", "Linear"),
                           ("NI_Scale[1]_Linear_Slope", slope), ("NI_Scale[1]_Linear_Y_Intercept", 0.125),
                           ("NI_Scale[1]_Linear_Input_Source", 0), ("wf_increment", 0.0005)]
rows = RNG.integers(-32768, 32767, (8, 3)).astype("<i2")
other = RNG.integers(-(2**31), 2**31 - 1, (8, 1)).astype("<i4")
entries = [entry("<", f"/'g'/'ai{line}'", daqmx(4, [(3, 0, 2 * line, 0)], [6, 4]), by_scaler(3e-4 + line)) for line in range(3)]
entries.append(entry("<", "/'g'/'wide'", daqmx(4, [(5, 1, 0, 0)], [6, 4]), by_scaler(1e-8)))
data = rows[:4].tobytes() + other[:4].tobytes() + rows[4:].tobytes() + other[4:].tobytes()
done("daqmx.tdms", segment(NEW | DAQMX | INTERLEAVED, entries, data))
entries = [entry("<", f"/'g'/'line {line}'", daqmx(10, [(0, 0, line, 0)], [1], 0x126A, 5)) for line in (0, 3, 7)]
done("daqmx-lines.tdms", segment(NEW | DAQMX, entries, RNG.integers(0, 255, 10).astype("u1").tobytes()))
